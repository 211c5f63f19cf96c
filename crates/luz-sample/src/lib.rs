//! Monte Carlo sampling: counter-based random numbers, low-discrepancy sequences, warps, distributions, multiple importance
//! sampling, running statistics.

pub mod distribution;
pub mod mis;
mod owen;
mod permutation;
pub mod point_set;
pub mod random;
pub mod roulette;
mod sampler;
mod samples;
pub mod statistics;
pub mod test_support;
mod trigonometry;
pub mod warp;

pub use sampler::{ParseSamplerKindError, PixelSamples, Sampler, SamplerConfig, SamplerKind};
pub use samples::Samples;

/// The largest number that a [`Samples`] may return, `1 − 2⁻²⁴`: the largest `f32` below one.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;
