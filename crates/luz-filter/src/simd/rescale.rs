//! Scales of values there and back, for many values at once.

use super::lanes::{Lanes, Task};
use crate::Scale;

/// Takes linear values to a scale, or back: within about 10⁻⁶ of [`Scale::forward`] and [`Scale::backward`], relative. Values
/// that aren't finite become NaN. Returns the largest absolute value; NaN if one is.
pub(super) struct Rescale<'a> {
    pub scale: Scale,
    pub backward: bool,
    /// What results are multiplied with.
    pub factor: f32,
    pub values: &'a mut [f32],
}

impl Task for Rescale<'_> {
    type Output = f32;

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) -> f32 {
        let Self { scale, backward, factor, values } = self;
        match (scale, backward) {
            (Scale::Linear, _) => map(values, factor, |v| v),
            (Scale::Encoded, false) => map(values, factor, encode),
            (Scale::Encoded, true) => map(values, factor, decode),
            (Scale::Log, false) => map(values, factor, |v| {
                let floored = if v > Scale::LOG_FLOOR { v } else { Scale::LOG_FLOOR };
                std::f32::consts::LN_2 * log2(floored)
            }),
            (Scale::Log, true) => map(values, factor, |v| exp2(v * std::f32::consts::LOG2_E)),
        }
    }
}

#[inline(always)]
fn map(values: &mut [f32], factor: f32, f: impl Fn(f32) -> f32) -> f32 {
    let mut largest = 0u32;
    for value in values {
        // The second summand is zero but for what isn't finite.
        let v = factor * f(*value) + 0.0 * *value;
        largest = largest.max(v.to_bits() & 0x7fff_ffff);
        *value = v;
    }
    f32::from_bits(largest)
}

/// sRGB's encoding, odd.
#[inline(always)]
fn encode(v: f32) -> f32 {
    let a = v.abs();
    let curve = 1.055 * exp2(log2(a.max(1e-30)) * (1.0 / 2.4)) - 0.055;
    (if a <= 0.04045 / 12.92 { 12.92 * a } else { curve }).copysign(v)
}

/// The inverse of [`encode`].
#[inline(always)]
fn decode(v: f32) -> f32 {
    let a = v.abs();
    let curve = exp2(2.4 * log2((a + 0.055) * (1.0 / 1.055)));
    (if a <= 0.04045 { a * (1.0 / 12.92) } else { curve }).copysign(v)
}

/// The base-two logarithm of a normal positive number.
#[inline(always)]
fn log2(v: f32) -> f32 {
    // v = 2ᵉ m with m around 1; ln m = 2 artanh((m − 1) / (m + 1)).
    const MIDDLE: u32 = 0x3f35_04f3;
    let exponent = (v.to_bits().wrapping_sub(MIDDLE) as i32) >> 23;
    let m = f32::from_bits(v.to_bits().wrapping_sub((exponent << 23) as u32));
    let s = (m - 1.0) / (m + 1.0);
    let q = s * s;
    let series = 1.0 + q * (1.0 / 3.0 + q * (1.0 / 5.0 + q * (1.0 / 7.0 + q * (1.0 / 9.0))));
    exponent as f32 + 2.0 * std::f32::consts::LOG2_E * s * series
}

/// `2ˣ`, clamped to normal numbers.
#[inline(always)]
fn exp2(x: f32) -> f32 {
    const MAGIC: f32 = 12_582_912.0;
    let x = if x > -126.0 { x } else { -126.0 };
    let x = if x < 127.0 { x } else { 127.0 };
    let shifted = x + MAGIC;
    // Taylor's series of eˣ to the sixth power: the rest is below 10⁻⁷ for fractions up to one half.
    let y = (x - (shifted - MAGIC)) * std::f32::consts::LN_2;
    let series =
        1.0 + y * (1.0 + y * (0.5 + y * (1.0 / 6.0 + y * (1.0 / 24.0 + y * (1.0 / 120.0 + y * (1.0 / 720.0))))));
    f32::from_bits(series.to_bits().wrapping_add(shifted.to_bits() << 23))
}

#[cfg(test)]
mod tests {
    use super::super::{Level, SimdLevel};
    use super::*;

    #[test]
    fn scales_agree_with_their_definition() {
        let values: Vec<f32> = (-60..=60).map(|i| (i as f32 * 0.2).exp2()).chain([0.0, 0.003, 0.04, 1.0]).collect();
        let values: Vec<f32> = values.iter().flat_map(|&v| [v, -v]).collect();
        for level in [SimdLevel::Scalar, SimdLevel::Auto].map(Level::choose) {
            for scale in [Scale::Linear, Scale::Encoded, Scale::Log] {
                let mut there = values.clone();
                level.rescale(scale, false, 1.0, &mut there);
                for (&v, &result) in values.iter().zip(&there) {
                    let expected = scale.forward(v);
                    assert!((result - expected).abs() <= 3e-6 * expected.abs().max(0.1), "{scale:?} {v}: {result}");
                }
                let mut back = there.clone();
                level.rescale(scale, true, 1.0, &mut back);
                for (&v, &result) in there.iter().zip(&back) {
                    let expected = scale.backward(v);
                    assert!((result - expected).abs() <= 3e-6 * expected.abs(), "back {scale:?} {v}: {result}");
                }
            }
            let mut bad = [1.0, f32::NAN, 2.0, f32::INFINITY];
            assert!(level.rescale(Scale::Encoded, false, 1.0, &mut bad).is_nan());
            assert_eq!(bad.map(f32::is_nan), [false, true, false, true]);
        }
    }
}
