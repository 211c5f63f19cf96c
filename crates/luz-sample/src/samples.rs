//! The stream of numbers that an estimator draws.

use glam::Vec2;

/// A stream of numbers in `[0, 1)`, drawn in a fixed order of dimensions.
///
/// Estimators are generic over it, so that the same path can be drawn from a low-discrepancy sequence or from the state
/// of a Markov chain.
pub trait Samples {
    /// The next dimension, in `[0, 1)`.
    fn next_1d(&mut self) -> f32;

    /// The next two dimensions, stratified together, each in `[0, 1)`.
    fn next_2d(&mut self) -> Vec2;

    /// Goes on at `dimension`, so that a consumer's dimensions stay the same whatever was drawn before it.
    fn set_dimension(&mut self, dimension: u32);
}

impl<S: Samples + ?Sized> Samples for &mut S {
    #[inline(always)]
    fn next_1d(&mut self) -> f32 {
        (**self).next_1d()
    }

    #[inline(always)]
    fn next_2d(&mut self) -> Vec2 {
        (**self).next_2d()
    }

    #[inline(always)]
    fn set_dimension(&mut self, dimension: u32) {
        (**self).set_dimension(dimension);
    }
}
