//! A density that is linear on the unit interval.

use crate::ONE_MINUS_EPSILON;

/// `x ∈ [0, 1)` with density proportional to `(1 − x) a + x b`; `a, b ≥ 0`. Uniform where both are zero.
///
/// The root of the quadratic distribution function, in the form that does not cancel.
#[inline]
pub fn linear(u: f32, a: f32, b: f32) -> f32 {
    let sum = a + b;
    if sum == 0.0 || !sum.is_finite() {
        return u;
    }
    // Relative heights, so that squares neither overflow nor vanish.
    let (a, b) = (a / sum, b / sum);
    let denominator = a + ((1.0 - u) * a * a + u * b * b).sqrt();
    if denominator > 0.0 { (u / denominator).min(ONE_MINUS_EPSILON) } else { 0.0 }
}

/// The density of [`linear`], in length: zero outside `[0, 1]`.
#[inline]
pub fn linear_pdf(x: f32, a: f32, b: f32) -> f32 {
    if !(0.0..=1.0).contains(&x) {
        return 0.0;
    }
    let sum = a + b;
    if sum == 0.0 || !sum.is_finite() {
        return 1.0;
    }
    2.0 * ((1.0 - x) * (a / sum) + x * (b / sum))
}

/// The `u` that [`linear`] maps to `x`.
#[inline]
pub fn linear_inverse(x: f32, a: f32, b: f32) -> f32 {
    let sum = a + b;
    if sum == 0.0 || !sum.is_finite() {
        return x;
    }
    let (a, b) = (a / sum, b / sum);
    (x * (a * (2.0 - x) + b * x)).clamp(0.0, 1.0)
}
