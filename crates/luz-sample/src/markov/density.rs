//! Densities that need not be normalised.

use serde::{Deserialize, Serialize};

/// The value of a target density at a state: a number, or the logarithm of one where numbers would overflow or underflow.
pub trait Density: Copy {
    /// This density over that of `other`, which is possible.
    fn ratio(self, other: Self) -> f64;

    /// Whether the state can occur at all, its density is positive.
    fn is_possible(self) -> bool;

    /// Whether it is a density: neither negative nor infinite nor NaN.
    fn is_valid(self) -> bool;
}

impl Density for f64 {
    #[inline]
    fn ratio(self, other: Self) -> f64 {
        self / other
    }

    #[inline]
    fn is_possible(self) -> bool {
        self > 0.0
    }

    #[inline]
    fn is_valid(self) -> bool {
        (0.0..Self::INFINITY).contains(&self)
    }
}

/// The natural logarithm of a density, `-∞` for zero.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
pub struct Log(pub f64);

impl Density for Log {
    #[inline]
    fn ratio(self, other: Self) -> f64 {
        (self.0 - other.0).exp()
    }

    #[inline]
    fn is_possible(self) -> bool {
        self.0 > f64::NEG_INFINITY
    }

    #[inline]
    fn is_valid(self) -> bool {
        self.0 < f64::INFINITY
    }
}
