//! The exponential distribution.

/// A distance `x ≥ 0` with density `rate · exp(−rate · x)`; `rate > 0`. Always finite.
#[inline]
pub fn exponential(u: f32, rate: f32) -> f32 {
    -(-u).ln_1p() / rate
}

/// The density of [`exponential`], in length: zero where `x < 0`.
#[inline]
pub fn exponential_pdf(x: f32, rate: f32) -> f32 {
    if x < 0.0 { 0.0 } else { rate * (-rate * x).exp() }
}

/// The `u` that [`exponential`] maps to `x`: `1 − exp(−rate · x)`, in `[0, 1]`.
#[inline]
pub fn exponential_inverse(x: f32, rate: f32) -> f32 {
    -(-rate * x.max(0.0)).exp_m1()
}
