//! What leaves a light is its power.

use super::SIGNIFICANCE;
use super::specimens::{LIGHTS, luminance, world};
use luz_color::Wavelengths;
use luz_render::light::{BoundingSphere, Combination, EmittedSpectrum};
use luz_sample::Samples;
use luz_sample::random::Random;
use luz_sample::test_support::{mean_z_test, sidak};

/// `E[L / (p_end p_departure)]` is the power: densities, emission and measures fit together for every kind of light.
#[test]
fn what_leaves_a_light_is_its_power() {
    const SAMPLES: u64 = 20_000;
    // The power of a light in a stretched space is an estimate.
    for (name, text) in LIGHTS.iter().filter(|(name, _)| !name.contains("stretched")) {
        let world = world(name, text);
        let sphere: BoundingSphere = world.bounding_sphere().into();
        for (number, light) in world.lights().iter().enumerate() {
            let (mut sum, mut squares) = (0.0, 0.0);
            for i in 0..SAMPLES {
                let mut random = Random::new(9, number as u64, i);
                let wavelengths = Wavelengths::sample_visible(random.next_1d());
                let emitted = EmittedSpectrum::default();
                let context = world.light_context(&emitted, Combination::Alone);
                let Some((end, pdf)) = light.sample_end(number as u32, context, random.next_2d()) else { continue };
                let Some(departure) = light.sample_departure(context, sphere, &end, random.next_2d()) else { continue };
                // Any point on the way; of what a portal lets in, one behind it.
                let beyond = (departure.origin - sphere.center).length() + sphere.radius;
                let to = departure.origin + departure.direction * if end.is_infinite() { beyond } else { 1.0 };
                let leaving = luminance(light.emitted(context, &end, to, &wavelengths), &wavelengths);
                let value = leaving / (f64::from(pdf) * f64::from(departure.pdf));
                sum += value;
                squares += value * value;
            }
            let n = SAMPLES as f64;
            let mean = sum / n;
            let error = (squares / n - mean * mean) / n;
            let emitted = EmittedSpectrum::default();
            let power = light.power(world.light_context(&emitted, Combination::Alone), sphere.radius);
            // Means of images over curved surfaces and through portals are sums over cells.
            let is_approximate = ["globe", "lamp shade", "curved screen", "portal", "projection"].contains(name);
            let cells = if is_approximate { 3e-3 * power } else { 1e-4 * power };
            let p = mean_z_test(mean, error, power, cells * cells);
            assert!(p >= sidak(SIGNIFICANCE, LIGHTS.len()), "{name}: {mean} ± {} instead of {power}", error.sqrt());
        }
    }
}
