//! Sine and cosine of reduced arguments.
//!
//! The warps need them on a turn only, where a short polynomial is as exact as `f32` can hold, several times faster
//! than a general routine, and the same on every platform.

use std::f32::consts::TAU;

/// `(sin x, cos x)` for `|x| ≤ π/4`; absolute error below 1e-7.
#[inline(always)]
pub(crate) fn sin_cos_eighth(x: f32) -> (f32, f32) {
    let s = x * x;
    let sin = x + x * s * (-1.0 / 6.0 + s * (1.0 / 120.0 + s * (-1.0 / 5040.0 + s * (1.0 / 362_880.0))));
    let cos = 1.0 + s * (-0.5 + s * (1.0 / 24.0 + s * (-1.0 / 720.0 + s * (1.0 / 40_320.0))));
    (sin, cos)
}

/// `(sin 2πt, cos 2πt)` for `t ∈ [0, 1]`; absolute error below 2e-7. The reduction to an eighth of a turn is exact.
#[inline(always)]
pub fn sin_cos_turns(t: f32) -> (f32, f32) {
    let quarter = (4.0 * t + 0.5) as u32;
    let (s, c) = sin_cos_eighth((t - 0.25 * quarter as f32) * TAU);
    let (s, c) = if quarter & 1 == 0 { (s, c) } else { (c, -s) };
    if quarter & 2 == 0 { (s, c) } else { (-s, -c) }
}

/// The angle of `(x, y)` as a fraction of a turn, in `[0, 1)`.
#[inline]
pub(crate) fn turns(y: f32, x: f32) -> f32 {
    let t = y.atan2(x) / TAU;
    let t = if t < 0.0 { t + 1.0 } else { t };
    t.min(crate::ONE_MINUS_EPSILON)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_double_precision() {
        for i in 0..=100_000u32 {
            let t = i as f32 / 100_000.0;
            let (s, c) = sin_cos_turns(t);
            let (s64, c64) = (f64::from(t) * std::f64::consts::TAU).sin_cos();
            assert!((f64::from(s) - s64).abs() < 2e-7, "sin {t}");
            assert!((f64::from(c) - c64).abs() < 2e-7, "cos {t}");
            assert!((turns(s, c) - t).abs() < 2e-7 || t == 1.0 || t == 0.0, "turns {t}");
        }
    }
}
