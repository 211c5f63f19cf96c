//! Monte Carlo: estimating integrals and sampling distributions, for any field.
//!
//! Everything here serves the estimator `Î = 1/n · Σ w(xᵢ) f(xᵢ) / p(xᵢ)`. What draws a sample says with which density, and the
//! density can be had on its own for any sample; the two are tested against each other.
//!
//! | module | what is in it |
//! |---|---|
//! | [`random`] | random numbers as a pure function of (seed, stream, index, dimension) |
//! | [`Sampler`], [`Samples`] | independent, stratified and low-discrepancy numbers behind one trait |
//! | [`warp`] | maps from uniform numbers to other densities: normal, exponential, spheres, triangles … |
//! | [`distribution`] | discrete and piecewise distributions from weights |
//! | [`mis`] | multiple importance sampling: heuristics and optimal weights for K techniques |
//! | [`roulette`] | Russian roulette and splitting of random walks |
//! | [`markov`] | Metropolis–Hastings chains, primary sample space, bootstrap |
//! | [`statistics`] | running mean and variance, convergence rates |
//! | [`test_support`] | χ², z and detailed-balance tests, for the tests of those who use this |
//!
//! # Where random numbers come from
//!
//! There is no generator to be carried about. A number is a function of a seed and of what it is for, so that results do not
//! depend on the order of computation, on the number of threads, or on an interruption:
//!
//! ```
//! use luz_sample::random::Random;
//! use luz_sample::statistics::Running;
//!
//! // π, from 40000 points in a square.
//! let inside = |index| {
//!     let mut random = Random::new(0, 0, index);
//!     let (x, y) = (random.next_f64(), random.next_f64());
//!     if x * x + y * y < 1.0 { 4.0 } else { 0.0 }
//! };
//! let estimate: Running = (0..40_000).map(inside).collect();
//! assert!((estimate.mean() - std::f64::consts::PI).abs() < 3.0 * estimate.standard_error());
//! ```
//!
//! An estimator that is written against [`Samples`] can be driven by such numbers, by better spread ones, and by the state of
//! a Markov chain:
//!
//! ```
//! use luz_sample::{Sampler, SamplerConfig, SamplerKind, Samples};
//!
//! fn inside(samples: &mut impl Samples) -> f64 {
//!     if samples.next_2d().length_squared() < 1.0 { 4.0 } else { 0.0 }
//! }
//!
//! let config = SamplerConfig { samples_per_pixel: 4096, resolution: [1, 1], seed: 0 };
//! let sampler = Sampler::new(SamplerKind::Sobol, config);
//! let sum: f64 = (0..4096).map(|i| inside(&mut sampler.samples([0, 0], i))).sum();
//! assert!((sum / 4096.0 - std::f64::consts::PI).abs() < 0.01);
//! ```
//!
//! A sampler numbers its integrals by *pixels*, a grid of them; an integral that stands alone is a single one, and other
//! pixels give it other randomisations.
//!
//! # Examples
//!
//! The folder `examples` has programs from other fields whose results are known: an Asian option, the Ising model against
//! Onsager's solution, the energy of a Lennard-Jones liquid, a Bayesian posterior, a ten-dimensional integral, and what
//! stratification is worth. `cargo run --release --example ising`.

pub mod distribution;
pub mod markov;
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
pub mod trigonometry;
pub mod warp;

pub use sampler::{ParseSamplerKindError, PixelSamples, Sampler, SamplerConfig, SamplerKind};
pub use samples::Samples;

/// The largest number that a [`Samples`] may return, `1 − 2⁻²⁴`: the largest `f32` below one.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;

/// The code of the README is tested with the documentation's.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
