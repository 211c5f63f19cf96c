//! Scales of values: there and back.

use luz_color::encoding::{linear_to_srgb, srgb_to_linear};

use crate::Scale;

impl Scale {
    /// A linear value on this scale.
    pub fn forward(self, linear: f32) -> f32 {
        match self {
            Self::Linear => linear,
            Self::Encoded => linear_to_srgb(linear),
            Self::Log if linear.is_nan() => linear,
            Self::Log => linear.max(Self::LOG_FLOOR).ln(),
        }
    }

    /// The linear value of one on this scale.
    pub fn backward(self, value: f32) -> f32 {
        match self {
            Self::Linear => value,
            Self::Encoded => srgb_to_linear(value),
            Self::Log => value.exp(),
        }
    }
}
