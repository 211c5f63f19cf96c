//! Monte Carlo sampling: counter-based random numbers, low-discrepancy sequences, warps, distributions, multiple importance sampling, running statistics.

mod samples;

pub use samples::Samples;
