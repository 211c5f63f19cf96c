//! Markov chains whose states are samples of a density that need not be normalised (Metropolis et al. 1953, Hastings 1970).
//!
//! A [`Chain`] holds a state and moves by proposals: whatever makes a new state out of the current one and knows the ratio
//! of the densities with which it makes either from the other. The chain accepts or stays, keeps count, and hands out both
//! states with their weights, so that the rejected one is not lost for an estimate.
//!
//! * [`Chain`], [`Proposal`], [`Step`]: the algorithm, for any state and any proposals; densities as numbers or as
//!   logarithms ([`Density`], [`Log`]).
//! * [`Acceptance`]: what was proposed and what became of it.
//! * [`PrimarySample`], [`PrimarySamples`], [`Kernel`]: chains in *primary sample space* (Kelemen et al. 2002), whose states
//!   are the uniform numbers that drive any estimator written against [`Samples`](crate::Samples).
//! * [`Bootstrap`]: where chains begin so that they are in equilibrium from the start, and what the density integrates to.
//!
//! A chain has no random number generator in it: the numbers of a step are a pure function of (seed, chain, step), so that it
//! is plain data that can be stopped, written down and resumed, and chains can advance in any order on any number of threads.
//!
//! ```
//! use luz_sample::markov::{Chain, Proposal};
//!
//! // Samples of the density in proportion to x (1 - x) on [0, 1], by steps of up to 0.3.
//! let density = |x: f64| (x * (1.0 - x)).max(0.0);
//! let mut chain = Chain::new(0, 0, 0.5, density(0.5));
//! let (mut spare, mut mean) = (0.0, 0.0);
//! for _ in 0..20_000 {
//!     let step = chain.step(&mut spare, |&x, y, random| {
//!         *y = x + 0.6 * random.next_f64() - 0.3;
//!         Some(Proposal::symmetric(density(*y)))
//!     });
//!     mean += (step.current_weight * step.current + step.proposed_weight * step.proposed) / 20_000.0;
//! }
//! assert!((mean - 0.5f64).abs() < 0.02);
//! assert!(chain.acceptance().rate() > 0.5);
//! ```

mod acceptance;
mod bootstrap;
mod chain;
mod density;
mod primary_space;

pub use acceptance::{Acceptance, Outcome};
pub use bootstrap::Bootstrap;
pub use chain::{Chain, Proposal, Step};
pub use density::{Density, Log};
pub use primary_space::{Kernel, PrimarySample, PrimarySamples, large_step_weights};
