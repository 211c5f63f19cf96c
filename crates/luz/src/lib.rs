//! Monte Carlo imaging: a spectral path tracer and its program.
