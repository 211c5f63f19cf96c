//! Spectra, colour spaces, illuminants and sensors for spectral rendering.
//!
//! A path carries [`LANES`] [`Wavelengths`], drawn with their densities; a [`Spectrum`] is evaluated there and yields a
//! [`SampledSpectrum`]; a [`Sensor`] turns the radiance that arrives into tristimulus values:
//!
//! ```
//! use luz_color::{RgbColorSpace, Sensor, Spectrum, Wavelengths};
//!
//! let space = RgbColorSpace::srgb();
//! let sensor = Sensor::cie1931(space);
//! let light = Spectrum::rgb_illuminant(space, [1.0, 1.0, 1.0]);
//! let scale = 1.0 / luz_color::spectrum_to_photometric(&light);
//!
//! let n = 256;
//! let mut rgb = [0.0; 3];
//! for i in 0..n {
//!     let wavelengths = Wavelengths::sample_visible((i as f32 + 0.5) / n as f32);
//!     let sample = sensor.to_output_rgb(light.sample(&wavelengths) * scale, &wavelengths);
//!     (0..3).for_each(|c| rgb[c] += sample[c] / n as f32);
//! }
//! assert!(rgb.iter().all(|c| (c - 1.0).abs() < 0.01));
//! ```
//!
//! All conventions (range of wavelengths, their density, normalisation of illuminants, rounding of tables to whole
//! nanometres) are those of *Physically Based Rendering*, 4th edition (Pharr, Jakob & Humphreys 2023), chapters 4 and
//! 5.4, so that renderings agree with pbrt-v4.

mod blackbody;
mod color_space;
mod data;
pub mod encoding;
pub mod illuminant;
pub mod lab;
mod named;
pub mod observer;
mod sampled;
mod sensor;
mod sigmoid;
mod sigmoid_fit;
mod sigmoid_table;
mod spectrum;
mod wavelengths;

pub use blackbody::Blackbody;
pub use color_space::RgbColorSpace;
pub use named::{named_spectrum, spectrum_names};
pub use observer::{CIE_Y_INTEGRAL, inner_product, spectrum_to_photometric, spectrum_to_xyz, spectrum_to_y};
pub use sampled::{LANES, SampledSpectrum};
pub use sensor::{Sensor, SensorError};
pub use sigmoid::SigmoidPolynomial;
pub use sigmoid_table::SigmoidTable;
pub use spectrum::{DenseSpectrum, PiecewiseLinearSpectrum, Spectrum, SpectrumError};
pub use wavelengths::{LAMBDA_MAX, LAMBDA_MIN, Wavelengths};
