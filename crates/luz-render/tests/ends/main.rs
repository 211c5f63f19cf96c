//! The ends of paths: on lights and on cameras, each `sample` against its `pdf`, and all against what is known already.

mod camera;
#[path = "../common/mod.rs"]
mod common;
mod emission;
mod next_event;
mod one_bounce;
mod power;
mod specimens;

/// Probability that any of a test's comparisons fails although all is right.
const SIGNIFICANCE: f64 = 0.01;
