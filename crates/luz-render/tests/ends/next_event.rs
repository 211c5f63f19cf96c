//! Ends that are drawn for a point are those that `Light::sample` draws.

use super::SIGNIFICANCE;
use super::specimens::{LIGHTS, chi2_ends, world};
use glam::Vec3;
use luz_color::Wavelengths;
use luz_geometry::{Ray, Reference};
use luz_render::light::{Combination, EmittedSpectrum, LightEnd, Place};
use luz_sample::Samples;
use luz_sample::random::Random;
use luz_sample::test_support::sidak;

fn references() -> [Reference; 4] {
    [
        Reference::surface(Vec3::new(0.5, 3.0, 4.0), Vec3::NEG_Z),
        Reference::surface(Vec3::new(0.3, 0.2, 0.1), Vec3::new(0.6, 0.8, 0.0)),
        Reference::surface(Vec3::new(0.5, 2.0, -0.5), Vec3::Z),
        Reference::point(Vec3::new(-1.0, 0.5, 0.0)),
    ]
}

/// Same direction, same radiance, and the density in solid angle times cos θ / d².
#[test]
fn ends_for_a_point_are_those_of_light_samples() {
    for (name, text) in LIGHTS {
        let world = world(name, text);
        for combination in [Combination::Alone, Combination::WithBsdf] {
            let mut drawn = 0;
            for (i, reference) in (0..600).zip(references().iter().cycle()) {
                let mut random = Random::new(4, 1, i);
                let (u, number) = (random.next_2d(), i as usize % world.lights().len());
                let light = &world.lights()[number];
                let emitted = EmittedSpectrum::default();
                let wavelengths = Wavelengths::sample_visible(random.next_1d());
                let context = world.light_context(&emitted, combination);
                let sample = light.sample(context, reference, u, &wavelengths);
                let Some((end, pdf)) = light.sample_end_from(number as u32, context, reference, u) else {
                    assert!(sample.is_none(), "{name}");
                    continue;
                };
                let radiance = light.emitted(context, &end, reference.position, &wavelengths);
                let Some(sample) = sample else {
                    assert!(radiance.is_black(), "{name}");
                    continue;
                };
                drawn += 1;
                assert_eq!(sample.target, end.target_from(reference.position), "{name}");
                assert_eq!(sample.is_delta, end.is_delta(), "{name}");
                let direction = end.direction_from(reference.position).expect("another point");
                assert!(direction.distance(sample.direction) < 1e-5, "{name}");
                let (by_distance, by_area) = match end.place {
                    Place::Surface(point) => {
                        let to = point.position - reference.position;
                        (1.0, point.normal.dot(direction).abs() / to.length_squared())
                    }
                    Place::Point(position) => (1.0 / reference.position.distance_squared(position), 1.0),
                    Place::Infinity(_) => (1.0, 1.0),
                };
                assert!((radiance[0] * by_distance / sample.radiance[0] - 1.0).abs() < 1e-4, "{name}: {radiance:?}");
                // Nearly from the side, the cosine has few digits.
                let tolerance = if by_area > 1e-3 { 1e-3 } else { 0.05 };
                assert!((pdf / (sample.pdf * by_area) - 1.0).abs() < tolerance, "{name}: {pdf} {sample:?}");
                let known = light.end_pdf_from(context, reference, &end);
                assert!((known / pdf - 1.0).abs() < 2e-2, "{name}: {known} {pdf}");

                // What a ray meets there has the same densities as what was drawn.
                let ray = Ray::new(reference.position, direction, 0.0);
                let hit = world.intersect(&ray).map(|hit| world.interaction(&ray, &hit));
                if let Some((hit, position)) = hit.zip(end.position())
                    && hit.light == Some(number as u32)
                    && hit.surface.position.distance(position) < 1e-4
                {
                    let found = LightEnd::hit(number as u32, &hit.surface);
                    let known = light.end_pdf_from(context, reference, &found);
                    assert!((known / pdf - 1.0).abs() < 2e-2, "{name}: {known} {pdf}");
                }
            }
            let may_be_dark = name.contains("spot")
                || name.contains("projection")
                || (name == "infinite" && combination == Combination::WithBsdf);
            assert!(may_be_dark || drawn > 50, "{name}: {drawn}");
        }
    }
}

/// Closed surfaces, of which half is hidden from outside and drawn by no one, excepted.
#[test]
fn ends_for_a_point_follow_their_density() {
    let closed = ["sphere", "ellipsoid", "cylinder", "globe", "lamp shade", "triangles of a screen"];
    let mut failures = Vec::new();
    for (name, text) in LIGHTS.iter().filter(|(name, _)| !closed.contains(name)) {
        let world = world(name, text);
        let emitted = EmittedSpectrum::default();
        let context = world.light_context(&emitted, Combination::Alone);
        let light = &world.lights()[0];
        if light.is_delta() {
            continue;
        }
        // Images take long to integrate.
        let is_image = ["screen", "sky", "portal"].iter().any(|kind| name.contains(kind));
        for reference in &references()[1..if is_image { 2 } else { 3 }] {
            let sample = |u| light.sample_end_from(0, context, reference, u).map(|(end, _)| end);
            let test = |factor: f64| {
                chi2_ends(&world, 0, sample, |end| factor * f64::from(light.end_pdf_from(context, reference, end)))
            };
            let result = test(1.0);
            if !result.passes(sidak(SIGNIFICANCE, 40)) {
                failures.push(format!("{name}, {reference:?}: {result:?}"));
            }
            if reference.normal.is_some() && ["triangle", "screen", "sky"].contains(name) {
                assert!(!test(1.04).passes(1e-6), "{name}: a wrong density");
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
