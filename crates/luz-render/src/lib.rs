//! Spectral Monte Carlo light transport.
