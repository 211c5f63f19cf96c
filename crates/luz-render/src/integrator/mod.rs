//! Integrators: from a camera ray to the radiance that arrives along it.

mod path;

pub use path::{FeatureSink, PathCost, PathIntegrator, Technique};
