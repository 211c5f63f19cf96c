//! Ideal black bodies.

use crate::{SampledSpectrum, Wavelengths};

/// An ideal black body, scaled so that its peak over all wavelengths is `scale`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blackbody {
    temperature: f32,
    scale: f32,
    /// `scale` over Planck's law at its peak.
    factor: f64,
}

impl Blackbody {
    /// The black body of `temperature` kelvin with a peak of one; zero everywhere if the temperature isn't positive.
    pub fn new(temperature: f32) -> Self {
        let peak = planck(wien_peak(temperature), f64::from(temperature));
        let factor = if peak > 0.0 { 1.0 / peak } else { 0.0 };
        Self { temperature, scale: 1.0, factor }
    }

    /// The temperature in kelvin.
    pub fn temperature(&self) -> f32 {
        self.temperature
    }

    /// The value at the wavelength `lambda` in nm.
    pub fn value(&self, lambda: f32) -> f32 {
        (planck(f64::from(lambda), f64::from(self.temperature)) * self.factor) as f32
    }

    /// The values at a path's wavelengths.
    pub fn sample(&self, wavelengths: &Wavelengths) -> SampledSpectrum {
        SampledSpectrum(wavelengths.lambda).map(|lambda| self.value(lambda))
    }

    /// The peak over all wavelengths, visible or not.
    pub fn max_value(&self) -> f32 {
        if self.factor == 0.0 { 0.0 } else { self.scale }
    }

    /// The black body multiplied by `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f32) -> Self {
        Self { scale: self.scale * factor, factor: self.factor * f64::from(factor), ..*self }
    }
}

/// The wavelength in nm at which a black body of `temperature` kelvin peaks (Wien's displacement law).
fn wien_peak(temperature: f32) -> f64 {
    2.8977721e-3 / f64::from(temperature) * 1e9
}

/// Planck's law: the radiance of a black body in W·m⁻²·sr⁻¹·m⁻¹ at `lambda` nm and `temperature` kelvin; zero for
/// temperatures that aren't positive.
fn planck(lambda: f64, temperature: f64) -> f64 {
    // CODATA 2010, as in PBR 4e, eq. 4.17.
    const C: f64 = 299_792_458.0;
    const H: f64 = 6.62606957e-34;
    const K: f64 = 1.3806488e-23;
    if temperature.is_nan() || temperature <= 0.0 {
        return 0.0;
    }
    let l = lambda * 1e-9;
    2.0 * H * C * C / (l.powi(5) * (H * C / (l * K * temperature)).exp_m1())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Spectrum;

    #[test]
    fn plancks_law_has_its_published_values() {
        // W·m⁻²·sr⁻¹·m⁻¹ at (nm, K).
        for (lambda, temperature, expected) in [
            (483.0, 6000.0, 3.1849e13),
            (600.0, 6000.0, 2.86772e13),
            (500.0, 3700.0, 1.59845e12),
            (600.0, 4500.0, 7.46497e12),
        ] {
            let value = planck(lambda, temperature);
            assert!((value / expected - 1.0).abs() < 1e-3, "{lambda} {temperature}: {value}");
        }
    }

    #[test]
    fn black_bodies_peak_at_one_where_wien_says() {
        for temperature in [2700.0, 3000.0, 4500.0, 5600.0, 6000.0] {
            let body = Blackbody::new(temperature);
            let peak = wien_peak(temperature) as f32;
            assert!((body.value(peak) - 1.0).abs() < 1e-6);
            assert!(body.value(0.99 * peak) < 1.0 && body.value(1.01 * peak) < 1.0);
        }
        for temperature in [0.0, -5.0, f32::NAN] {
            let body = Spectrum::blackbody(temperature);
            assert_eq!((body.value(500.0), body.max_value()), (0.0, 0.0));
        }
        assert_eq!(Spectrum::blackbody(5000.0).scaled(3.0).max_value(), 3.0);
    }
}
