//! What keeps a table from being a distribution.

use std::fmt;

/// Why a table of values is no distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DistributionError {
    /// There are no values.
    Empty,
    /// There are more values than `f32` coordinates can tell apart (2²¹ along an axis), or than a 32-bit index can name.
    TooLarge,
    /// The number of values is not width times height.
    Length {
        /// Width times height.
        expected: usize,
        /// How many values were given.
        found: usize,
    },
    /// A value is negative, infinite or NaN.
    Value {
        /// Which one.
        index: usize,
        /// The value.
        value: f32,
    },
    /// The domain is empty, reversed, not finite, or too narrow for `f32` to tell its cells apart.
    Domain,
}

impl fmt::Display for DistributionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => f.write_str("a distribution needs at least one value"),
            Self::TooLarge => f.write_str("too many values for a distribution"),
            Self::Length { expected, found } => write!(f, "expected {expected} values, found {found}"),
            Self::Value { index, value } => write!(f, "value {index} is {value}, expected finite and not negative"),
            Self::Domain => f.write_str("the domain is empty, not finite, or too narrow for the number of its cells"),
        }
    }
}

impl std::error::Error for DistributionError {}

/// Checks that all values are finite and not negative.
pub(super) fn check(values: &[f32]) -> Result<(), DistributionError> {
    if values.is_empty() {
        return Err(DistributionError::Empty);
    }
    match values.iter().position(|v| !(v.is_finite() && *v >= 0.0)) {
        Some(index) => Err(DistributionError::Value { index, value: values[index] }),
        None => Ok(()),
    }
}
