//! Sensors: from radiance at a path's wavelengths to tristimulus values.

use std::fmt;

use glam::{Mat3, Vec3};

use crate::color_space::chromaticity;
use crate::observer::{NANOMETRES, xyz_bar};
use crate::spectrum::nearest_nanometre;
use crate::{LANES, RgbColorSpace, SampledSpectrum, Wavelengths, illuminant, spectrum_to_xyz};

/// A sensor that measures in CIE XYZ, with an exposure, an optional white balance, and an output colour space.
///
/// Sensor values are exposure · ∫ L(λ) x̄(λ) dλ and so on, *not* divided by [`crate::CIE_Y_INTEGRAL`]: lights are scaled by
/// the inverse of [`crate::spectrum_to_photometric`] instead, so that a light of scale 1 has Y = 1. Source: PBR 4e, 5.4.2.
#[derive(Clone, Debug)]
pub struct Sensor {
    /// For every whole nanometre the three sensor responses; the fourth number pads.
    response: Box<[[f32; 4]; NANOMETRES]>,
    /// The responses mapped into the output space.
    output_response: Box<[[f32; 4]; NANOMETRES]>,
    output_from_sensor: Mat3,
}

impl Sensor {
    /// The default: exposure 1, no white balance.
    pub fn cie1931(space: &RgbColorSpace) -> Self {
        Self::with(space, 1.0, None)
    }

    /// A sensor by its pbrt-v4 name.
    ///
    /// * `imaging_ratio`: what radiance is multiplied by (exposure time · ISO / 100 in pbrt-v4).
    /// * `white_balance`: the temperature in kelvin of the daylight that becomes white; `None` does nothing.
    ///
    /// # Errors
    /// When the sensor is unknown or its response isn't available; see [`Sensor::NAMES`].
    pub fn named(
        name: &str,
        space: &RgbColorSpace,
        imaging_ratio: f32,
        white_balance: Option<f32>,
    ) -> Result<Self, SensorError> {
        if name != "cie1931" {
            return Err(SensorError { name: name.to_owned() });
        }
        Ok(Self::with(space, imaging_ratio, white_balance))
    }

    /// The names that [`Sensor::named`] knows.
    pub const NAMES: [&'static str; 1] = ["cie1931"];

    fn with(space: &RgbColorSpace, imaging_ratio: f32, white_balance: Option<f32>) -> Self {
        let balance = white_balance.map_or(Mat3::IDENTITY, |temperature| {
            let source = chromaticity(spectrum_to_xyz(&illuminant::daylight(temperature)));
            white_balance_matrix(source, space.white())
        });
        let output_from_sensor = space.rgb_from_xyz() * balance;
        let response = std::array::from_fn(|i| {
            let [x, y, z] = xyz_bar(i).map(|v| v * imaging_ratio);
            [x, y, z, 0.0]
        });
        let output_response =
            response.map(|[x, y, z, _]| (output_from_sensor * Vec3::new(x, y, z)).extend(0.0).to_array());
        Self { response: Box::new(response), output_response: Box::new(output_response), output_from_sensor }
    }

    /// The sensor's values for radiance at a path's wavelengths: an unbiased estimate of its response, which is XYZ for
    /// `cie1931`. Lanes of density zero count as zero.
    #[inline]
    pub fn to_rgb(&self, radiance: SampledSpectrum, wavelengths: &Wavelengths) -> [f32; 3] {
        weigh(&self.response, radiance, wavelengths)
    }

    /// Linear RGB in the output colour space: the same as the [`Sensor::output_matrix`] applied to [`Sensor::to_rgb`], faster.
    #[inline]
    pub fn to_output_rgb(&self, radiance: SampledSpectrum, wavelengths: &Wavelengths) -> [f32; 3] {
        weigh(&self.output_response, radiance, wavelengths)
    }

    /// The matrix from the sensor's values to linear RGB in the output colour space, white balance included.
    pub fn output_matrix(&self) -> Mat3 {
        self.output_from_sensor
    }
}

/// The average over lanes of response · radiance / density.
#[inline(always)]
fn weigh(response: &[[f32; 4]; NANOMETRES], radiance: SampledSpectrum, wavelengths: &Wavelengths) -> [f32; 3] {
    let weight = radiance.safe_div(wavelengths.pdf()) * (1.0 / LANES as f32);
    let mut sum = [0.0; 4];
    for lane in 0..LANES {
        let row = response.get(nearest_nanometre(wavelengths.lambda[lane])).unwrap_or(&[0.0; 4]);
        for c in 0..4 {
            sum[c] += weight[lane] * row[c];
        }
    }
    [sum[0], sum[1], sum[2]]
}

/// The von Kries transform of XYZ from one white's chromaticity to another's, in the cone space of Bradford (Lam 1985).
fn white_balance_matrix(source: [f32; 2], target: [f32; 2]) -> Mat3 {
    let cones =
        Mat3::from_cols_array_2d(&[[0.8951, -0.7502, 0.0389], [0.2664, 1.7135, -0.0685], [-0.1614, 0.0367, 1.0296]]);
    let lms = |[x, y]: [f32; 2]| cones * Vec3::new(x / y, 1.0, (1.0 - x - y) / y);
    cones.inverse() * Mat3::from_diagonal(lms(target) / lms(source)) * cones
}

/// The sensor isn't available.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SensorError {
    name: String,
}

impl fmt::Display for SensorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the sensor `{}` is not supported; known sensors: {}", self.name, Sensor::NAMES.join(", "))
    }
}

impl std::error::Error for SensorError {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CIE_Y_INTEGRAL, Spectrum, named_spectrum, spectrum_to_photometric};

    /// The mean over `n` regular positions of u, which for smooth integrands is far more precise than random ones.
    fn estimate(n: usize, mut f: impl FnMut(Wavelengths) -> [f32; 3]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for i in 0..n {
            let value = f(Wavelengths::sample_visible((i as f32 + 0.5) / n as f32));
            (0..3).for_each(|c| sum[c] += f64::from(value[c]) / n as f64);
        }
        sum
    }

    #[test]
    fn estimates_are_unbiased_with_and_without_secondary_wavelengths() {
        let sensor = Sensor::cie1931(RgbColorSpace::srgb());
        for name in ["stdillum-D65", "stdillum-A", "stdillum-F1", "metal-Au-k"] {
            let spectrum = named_spectrum(name).unwrap();
            let exact = spectrum_to_xyz(&spectrum).map(|v| f64::from(v * CIE_Y_INTEGRAL));
            for terminate in [false, true] {
                let mean = estimate(50_000, |mut w| {
                    if terminate {
                        w.terminate_secondary();
                    }
                    sensor.to_rgb(spectrum.sample(&w), &w)
                });
                for c in 0..3 {
                    assert!((mean[c] / exact[c] - 1.0).abs() < 1e-3, "{name} {terminate}: {mean:?} {exact:?}");
                }
            }
        }
    }

    #[test]
    fn a_wrong_density_is_noticed() {
        // The estimator above, with one lane's density 2 % off, must not pass for unbiased.
        let sensor = Sensor::cie1931(RgbColorSpace::srgb());
        let spectrum = named_spectrum("stdillum-D65").unwrap();
        let exact = f64::from(spectrum_to_photometric(&spectrum));
        let mean = estimate(50_000, |mut w| {
            w.pdf.iter_mut().for_each(|p| *p *= 1.02);
            sensor.to_rgb(spectrum.sample(&w), &w)
        });
        assert!((mean[1] / exact - 1.0).abs() > 1e-2);
    }

    #[test]
    fn white_light_of_unit_scale_is_white() {
        for name in RgbColorSpace::NAMES {
            let space = RgbColorSpace::named(name).unwrap();
            let sensor = Sensor::cie1931(space);
            let light = Spectrum::rgb_illuminant(space, [1.0; 3]);
            let scale = 1.0 / spectrum_to_photometric(&light);
            let rgb = estimate(50_000, |w| sensor.to_output_rgb(light.sample(&w) * scale, &w));
            assert!(rgb.iter().all(|c| (c - 1.0).abs() < 1e-3), "{name}: {rgb:?}");
        }
    }

    #[test]
    fn output_is_the_matrix_times_the_sensor() {
        let sensor = Sensor::named("cie1931", RgbColorSpace::rec2020(), 2.5, Some(3200.0)).unwrap();
        for i in 0..100 {
            let w = Wavelengths::sample_visible(i as f32 / 100.0);
            let radiance = SampledSpectrum::splat(0.7 + 0.01 * i as f32);
            let direct = sensor.to_output_rgb(radiance, &w);
            let indirect = sensor.output_matrix() * Vec3::from(sensor.to_rgb(radiance, &w));
            assert!((Vec3::from(direct) - indirect).abs().max_element() < 1e-4 * indirect.abs().max_element());
        }
    }

    #[test]
    fn white_balance_makes_its_daylight_white() {
        let space = RgbColorSpace::srgb();
        for temperature in [3000.0, 5000.0, 6500.0, 9000.0] {
            let sensor = Sensor::named("cie1931", space, 1.0, Some(temperature)).unwrap();
            let rgb = sensor.output_matrix() * Vec3::from(spectrum_to_xyz(&illuminant::daylight(temperature)));
            assert!((rgb / rgb.y - Vec3::ONE).abs().max_element() < 1e-4, "{temperature}: {rgb}");
        }
    }

    #[test]
    fn other_sensors_are_named_errors() {
        let error = Sensor::named("canon_eos_5d", RgbColorSpace::srgb(), 1.0, None).unwrap_err();
        assert_eq!(error.to_string(), "the sensor `canon_eos_5d` is not supported; known sensors: cie1931");
    }
}
