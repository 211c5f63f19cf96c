//! Spectral Monte Carlo light transport.

pub mod bsdf;
