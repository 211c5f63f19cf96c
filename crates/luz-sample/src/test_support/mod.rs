//! Statistical tests of estimators, for the tests of every crate that samples something.
//!
//! [`chi2_sphere`] holds a `sample` and its `pdf` against each other on the sphere, [`chi2_rectangle`] in the plane,
//! [`chi2_interval`] on the line and [`chi2`] for counts; [`reversibility`] tests Markov chains for detailed balance; [`z_test`]
//! compares two means, and [`two_sample_t_test`] those of few values. Each gives a p-value: how often a
//! *correct* implementation would look at least as wrong. A test that makes many of them divides its significance among
//! them by [`sidak`].

mod beta;
mod chi_square;
mod gamma;
mod quadrature;
mod reversibility;
mod t_test;
mod z_test;

pub use beta::{regularized_beta, student_survival};
pub use chi_square::{Chi2Result, chi2, chi2_interval, chi2_rectangle, chi2_sphere};
pub use gamma::{chi2_survival, ln_gamma, normal_survival, regularized_gamma};
pub use quadrature::integrate_rectangle;
pub use reversibility::reversibility;
pub use t_test::{Estimate, two_sample_t_test, welch_test};
pub use z_test::{mean_z_test, sidak, z_test};
