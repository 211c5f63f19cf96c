//! The wavelengths that a path carries, and how they are drawn.

use crate::{LANES, SampledSpectrum};

/// Shortest wavelength that is rendered, in nm.
pub const LAMBDA_MIN: f32 = 360.0;
/// Longest wavelength that is rendered, in nm.
pub const LAMBDA_MAX: f32 = 830.0;

/// The [`LANES`] wavelengths of a path with their probability densities.
///
/// A spectral integral ∫ f(λ) dλ is estimated without bias by the average over the lanes of f(λᵢ) / pdfᵢ, where a lane of
/// density zero counts as zero.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub struct Wavelengths {
    /// The wavelengths in nm.
    pub lambda: [f32; LANES],
    /// The density of each wavelength, per nm. Zero marks a lane that has been terminated.
    pub pdf: [f32; LANES],
}

/// tanh of the scaled distance of [`LAMBDA_MIN`] from the centre 538 nm.
const VISIBLE_OFFSET: f32 = 0.85691062;
/// The span of that tanh over the whole range of wavelengths.
const VISIBLE_SPAN: f32 = 1.82750197;
/// The centre of the density, in nm.
const VISIBLE_CENTER: f32 = 538.0;
/// The width of the density, 1 / 0.0072 nm⁻¹.
const VISIBLE_WIDTH: f32 = 138.888889;
/// The density at its centre, per nm.
const VISIBLE_PEAK: f32 = 0.0039398042;

impl Wavelengths {
    /// Draws wavelengths in proportion to sech²(0.0072 (λ − 538 nm)), which follows the eye's sensitivity.
    ///
    /// Lane `i` uses `u + i / LANES` modulo one, so the lanes are stratified; `u` is in `[0, 1)`. The density of lane `i` is
    /// [`Wavelengths::visible_pdf`]. Source: PBR 4e, eq. 5.9 and its inversion; Radziszewski, Boryczko & Alda 2009.
    #[inline]
    pub fn sample_visible(u: f32) -> Self {
        let mut lambda = [0.0; LANES];
        let mut pdf = [0.0; LANES];
        for i in 0..LANES {
            let up = u + i as f32 * (1.0 / LANES as f32);
            let up = if up >= 1.0 { up - 1.0 } else { up };
            // λ = 538 − w·artanh(t), and sech²(artanh t) = 1 − t².
            let t = VISIBLE_OFFSET - VISIBLE_SPAN * up;
            lambda[i] = VISIBLE_CENTER - (0.5 * VISIBLE_WIDTH) * ln((1.0 + t) / (1.0 - t));
            lambda[i] = lambda[i].clamp(LAMBDA_MIN, LAMBDA_MAX);
            pdf[i] = VISIBLE_PEAK * (1.0 - t * t);
        }
        Self { lambda, pdf }
    }

    /// Draws wavelengths uniformly from `[LAMBDA_MIN, LAMBDA_MAX]`, stratified as in [`Wavelengths::sample_visible`].
    #[inline]
    pub fn sample_uniform(u: f32) -> Self {
        let mut lambda = [0.0; LANES];
        for (i, lambda) in lambda.iter_mut().enumerate() {
            let up = u + i as f32 * (1.0 / LANES as f32);
            let up = if up >= 1.0 { up - 1.0 } else { up };
            *lambda = (1.0 - up) * LAMBDA_MIN + up * LAMBDA_MAX;
        }
        Self { lambda, pdf: [Self::uniform_pdf(); LANES] }
    }

    /// The density per nm with which [`Wavelengths::sample_visible`] draws `lambda` (nm); zero outside the range.
    pub fn visible_pdf(lambda: f32) -> f32 {
        if !(LAMBDA_MIN..=LAMBDA_MAX).contains(&lambda) {
            return 0.0;
        }
        let c = ((lambda - VISIBLE_CENTER) / VISIBLE_WIDTH).cosh();
        VISIBLE_PEAK / (c * c)
    }

    /// The density per nm with which [`Wavelengths::sample_uniform`] draws any wavelength of the range.
    pub const fn uniform_pdf() -> f32 {
        1.0 / (LAMBDA_MAX - LAMBDA_MIN)
    }

    /// The densities as a spectral quantity.
    #[inline(always)]
    pub fn pdf(&self) -> SampledSpectrum {
        SampledSpectrum(self.pdf)
    }

    /// Drops every lane but the first, as where a path's direction depends on its wavelength (dispersion).
    ///
    /// The first lane's density is divided by [`LANES`], so the average over lanes stays unbiased. A second call changes
    /// nothing.
    #[inline]
    pub fn terminate_secondary(&mut self) {
        if self.secondary_terminated() {
            return;
        }
        self.pdf[0] /= LANES as f32;
        self.pdf[1..].fill(0.0);
    }

    /// True where [`Wavelengths::terminate_secondary`] has been called.
    #[inline(always)]
    pub fn secondary_terminated(&self) -> bool {
        LANES > 1 && self.pdf[1..].iter().all(|&p| p == 0.0)
    }
}

/// The natural logarithm of a positive normal number, within 2 units in the last place; without branches, so that the
/// loop over lanes becomes SIMD code.
///
/// Splits x = 2ᵉ·m with m in [√½, √2) and sums the series of 2·artanh((m − 1)/(m + 1)).
#[inline(always)]
fn ln(x: f32) -> f32 {
    const SQRT_HALF_BITS: u32 = 0x3f35_04f3;
    let bits = x.to_bits().wrapping_sub(SQRT_HALF_BITS);
    let exponent = ((bits as i32) >> 23) as f32;
    let m = f32::from_bits((bits & 0x007f_ffff).wrapping_add(SQRT_HALF_BITS));
    let s = (m - 1.0) / (m + 1.0);
    let z = s * s;
    let series = 2.0 / 3.0 + z * (2.0 / 5.0 + z * (2.0 / 7.0 + z * (2.0 / 9.0 + z * (2.0 / 11.0))));
    exponent * std::f32::consts::LN_2 + (2.0 * s + s * z * series)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithm_is_accurate() {
        for i in 0..20_000 {
            let x = 1e-3 * 1.0007f32.powi(i);
            let exact = f64::from(x).ln();
            let error = (f64::from(ln(x)) - exact).abs();
            assert!(error <= 2.5e-7 * exact.abs().max(0.5), "{x}: {error}");
        }
    }

    #[test]
    fn visible_density_integrates_to_one() {
        let n = 470_000;
        let sum: f64 =
            (0..n).map(|i| f64::from(Wavelengths::visible_pdf(360.0 + (i as f32 + 0.5) * 1e-3))).sum::<f64>() * 1e-3;
        assert!((sum - 1.0).abs() < 1e-5, "{sum}");
    }

    #[test]
    fn samples_follow_their_density() {
        // The inverse of the cumulative distribution has the slope 1 / pdf.
        let h = 1.0 / 4096.0;
        for i in 1..511 {
            let u = i as f32 / 4096.0;
            let (a, w, b) = (
                Wavelengths::sample_visible(u - h),
                Wavelengths::sample_visible(u),
                Wavelengths::sample_visible(u + h),
            );
            for lane in 0..LANES {
                let pdf = Wavelengths::visible_pdf(w.lambda[lane]);
                assert!((w.pdf[lane] / pdf - 1.0).abs() < 1e-4);
                let (lo, hi) = (a.lambda[lane], b.lambda[lane]);
                if lo > 365.0 && hi < 825.0 {
                    assert!(((hi - lo) / (2.0 * h) * pdf - 1.0).abs() < 3e-3, "lane {lane} at u = {u}");
                }
            }
        }
    }

    #[test]
    fn lanes_stay_in_range_at_the_ends_of_u() {
        for u in [0.0, f32::MIN_POSITIVE, 0.124_999_99, 0.125, 0.5, 0.999_999_94] {
            for w in [Wavelengths::sample_visible(u), Wavelengths::sample_uniform(u)] {
                assert!(w.lambda.iter().all(|l| (LAMBDA_MIN..=LAMBDA_MAX).contains(l)), "{w:?}");
                assert!(w.pdf.iter().all(|&p| p > 0.0));
            }
        }
    }

    #[test]
    fn termination_is_idempotent() {
        let mut w = Wavelengths::sample_visible(0.3);
        let first = w.pdf[0];
        assert!(!w.secondary_terminated());
        w.terminate_secondary();
        let once = w;
        w.terminate_secondary();
        assert_eq!(w, once);
        assert!(w.secondary_terminated());
        assert_eq!(w.pdf[0], first / LANES as f32);
    }
}
