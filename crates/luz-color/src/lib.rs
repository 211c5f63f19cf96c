//! Spectra, colour spaces, illuminants and sensors for spectral rendering.

mod sampled;

pub use sampled::{LANES, SampledSpectrum};
