//! Multiple importance sampling: combining several sampling techniques into one estimator.
//!
//! An integral `∫ f` is estimated by `Σᵢ 1/nᵢ Σⱼ wᵢ(xᵢⱼ) f(xᵢⱼ) / pᵢ(xᵢⱼ)`, where technique `i` draws `nᵢ` samples of density
//! `pᵢ`. It is unbiased for weights of sum one wherever `f ≠ 0`.
//!
//! * [`Heuristic`]: weights that follow from the `qᵢ = nᵢ pᵢ` at a point alone (Veach 1997, *Robust Monte Carlo Methods for
//!   Light Transport Simulation*, section 9.2.2).
//! * [`Optimal`]: the weights of least variance, which depend on the integrand and so have to be learned from the samples
//!   (Kondapaneni et al. 2019, "Optimal Multiple Importance Sampling").
//!
//! ```
//! use luz_sample::mis::Heuristic;
//!
//! // A point of which the first technique has density 6, with one sample, the second density 1, with two.
//! let techniques = [(1.0, 6.0), (2.0, 1.0)];
//! let weights = [0, 1].map(|i| Heuristic::Balance.weight(i, &techniques));
//! assert_eq!(weights, [0.75, 0.25]);
//! ```

mod heuristic;
mod optimal;
mod symmetric;

pub use heuristic::{Heuristic, ParseHeuristicError};
pub use optimal::Optimal;
