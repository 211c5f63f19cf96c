//! Reflectance spectra as the sigmoid of a quadratic polynomial.

use crate::wavelengths::{LAMBDA_MAX, LAMBDA_MIN};
use crate::{SampledSpectrum, Wavelengths};

/// The middle of the wavelengths in nm, where the polynomial's variable is zero.
const CENTER: f32 = 0.5 * (LAMBDA_MIN + LAMBDA_MAX);
/// The polynomial's variable runs over [−1, 1] while the wavelength runs over its range.
const INVERSE_HALF_WIDTH: f32 = 2.0 / (LAMBDA_MAX - LAMBDA_MIN);
/// Beyond this argument the sigmoid is 0 or 1 in `f32`, and its square is still finite.
const ARGUMENT_LIMIT: f32 = 1e18;

/// A spectrum s(c₀ t² + c₁ t + c₂) with values in `[0, 1]`, s(x) = ½ + x / (2 √(1 + x²)) and
/// t = (λ − 595 nm) / 235 nm in `[−1, 1]`.
///
/// Smooth, energy-conserving, and cheap to evaluate. Source: Jakob & Hanika 2019, "A Low-Dimensional Function Space for
/// Efficient Spectral Upsampling", eqs. 8 and 9. There the variable is λ itself; the centred one keeps `f32` accurate.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct SigmoidPolynomial {
    /// c₀, c₁ and c₂.
    pub coefficients: [f32; 3],
}

impl SigmoidPolynomial {
    /// The polynomial with the coefficients c₀, c₁, c₂ (of t², t and 1).
    pub const fn new(coefficients: [f32; 3]) -> Self {
        Self { coefficients }
    }

    /// The spectrum that has the same `value` in `[0, 1]` at every wavelength.
    ///
    /// 0 and 1 have an infinite constant coefficient; evaluation handles it and gives exactly 0 and 1. Values outside are
    /// clamped.
    pub fn constant(value: f32) -> Self {
        let value = f64::from(value.clamp(0.0, 1.0));
        Self::new([0.0, 0.0, ((value - 0.5) / (value * (1.0 - value)).sqrt()) as f32])
    }

    /// The spectrum at the wavelength `lambda` in nm.
    #[inline(always)]
    pub fn value(self, lambda: f32) -> f32 {
        let [c0, c1, c2] = self.coefficients;
        let t = (lambda - CENTER) * INVERSE_HALF_WIDTH;
        sigmoid((c0 * t + c1) * t + c2)
    }

    /// The spectrum at a path's wavelengths.
    #[inline(always)]
    pub fn sample(self, wavelengths: &Wavelengths) -> SampledSpectrum {
        SampledSpectrum(wavelengths.lambda).map(|lambda| self.value(lambda))
    }

    /// The largest value over all wavelengths.
    pub fn max_value(self) -> f32 {
        let [c0, c1, _] = self.coefficients;
        let ends = self.value(LAMBDA_MIN).max(self.value(LAMBDA_MAX));
        let extremum = CENTER - c1 / (2.0 * c0) / INVERSE_HALF_WIDTH;
        if (LAMBDA_MIN..=LAMBDA_MAX).contains(&extremum) { ends.max(self.value(extremum)) } else { ends }
    }
}

/// s(x) = ½ + x / (2 √(1 + x²)), also for infinite `x`.
#[inline(always)]
fn sigmoid(x: f32) -> f32 {
    let x = x.clamp(-ARGUMENT_LIMIT, ARGUMENT_LIMIT);
    0.5 + 0.5 * x / (1.0 + x * x).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_are_exact() {
        for (value, tolerance) in [(0.0, 0.0), (1.0, 0.0), (0.5, 0.0), (0.18, 1e-7), (0.001, 1e-7), (0.99, 1e-7)] {
            let p = SigmoidPolynomial::constant(value);
            for lambda in [360.0, 555.5, 830.0] {
                assert!((p.value(lambda) - value).abs() <= tolerance, "{value}: {}", p.value(lambda));
            }
            assert!((p.max_value() - value).abs() <= tolerance);
        }
        assert_eq!(SigmoidPolynomial::constant(-3.0).value(500.0), 0.0);
        assert_eq!(SigmoidPolynomial::constant(7.0).value(500.0), 1.0);
    }

    #[test]
    fn maximum_is_found_inside_and_at_the_ends() {
        for c in [[-3.0, 1.0, 0.5], [3.0, 1.0, 0.5], [-1.0, 4.0, 0.0], [0.0, -2.0, 0.3], [-50.0, -20.0, 3.0]] {
            let p = SigmoidPolynomial::new(c);
            let densest = (0..=4700).map(|i| p.value(360.0 + i as f32 * 0.1)).fold(0.0, f32::max);
            assert!((p.max_value() - densest).abs() < 1e-5, "{c:?}: {} {densest}", p.max_value());
        }
    }
}
