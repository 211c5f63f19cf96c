//! Light by its colour temperature.

use std::sync::Arc;

use crate::data::daylight::DAYLIGHT_BASIS;
use crate::{DenseSpectrum, PiecewiseLinearSpectrum, Spectrum};

/// CIE standard illuminant D of the correlated colour temperature `temperature` in kelvin, relative to 1 at 560 nm.
///
/// The nominal temperature is corrected by 1.4388/1.4380, as the radiation constant has changed since D65 was named.
/// Below 4000 K, where daylight isn't defined, this is a black body with a peak of one. Source: CIE 015:2018, eqs. 4.1–4.8.
pub fn daylight(temperature: f32) -> Spectrum {
    let cct = f64::from(temperature) * 1.4388 / 1.4380;
    if cct.is_nan() || cct < 4000.0 {
        return Spectrum::blackbody(cct as f32);
    }
    let [x, y] = daylight_chromaticity(cct);
    let m = 0.0241 + 0.2562 * x - 0.7341 * y;
    let m1 = (-1.3515 - 1.7703 * x + 5.9114 * y) / m;
    let m2 = (0.0300 - 31.4424 * x + 30.0717 * y) / m;
    let points: Vec<(f32, f32)> = DAYLIGHT_BASIS
        .iter()
        .map(|&(lambda, s0, s1, s2)| {
            let value = (f64::from(s0) + f64::from(s1) * m1 + f64::from(s2) * m2) * 0.01;
            (lambda, value as f32)
        })
        .collect();
    match PiecewiseLinearSpectrum::new(&points) {
        Ok(linear) => Spectrum::Dense(Arc::new(DenseSpectrum::from_fn(|lambda| linear.value(lambda)))),
        // An infinite temperature has no points.
        Err(_) => Spectrum::Constant(1.0),
    }
}

/// The CIE 1931 chromaticity of daylight of a correlated colour temperature of 4000–25000 K (CIE 015:2018, eqs. 4.1–4.3).
fn daylight_chromaticity(cct: f64) -> [f64; 2] {
    let r = 1e3 / cct;
    let x = if cct <= 7000.0 {
        ((-4.6070 * r + 2.9678) * r + 0.09911) * r + 0.244063
    } else {
        ((-2.0064 * r + 1.9018) * r + 0.24748) * r + 0.237040
    };
    [x, (-3.0 * x + 2.870) * x - 0.275]
}
