//! Paths begin on lights as the densities say.

use super::SIGNIFICANCE;
use super::specimens::{LIGHTS, ROUNDING, chi2_ends, world};
use glam::{Vec2, Vec3};
use luz_geometry::{Frame, Ray};
use luz_render::light::{
    BoundingSphere, Combination, EmittedSpectrum, Light, LightContext, LightEnd, LightSampler, Place,
};
use luz_render::world::World;
use luz_sample::Samples;
use luz_sample::random::Random;
use luz_sample::test_support::{Chi2Result, chi2_rectangle, chi2_sphere, sidak};
use std::f64::consts::PI;

/// Samples of each χ² test.
const SAMPLES: u64 = 20_000;
/// More tests than there are in any of the functions below.
const TESTS: usize = 150;

/// Does something with every light.
fn each(mut with: impl FnMut(&str, &World, LightContext<'_>, u32, &Light)) {
    for (name, text) in LIGHTS {
        let world = world(name, text);
        let emitted = EmittedSpectrum::default();
        let context = world.light_context(&emitted, Combination::Alone);
        for (number, light) in world.lights().iter().enumerate() {
            with(name, &world, context, number as u32, light);
        }
    }
}

/// Ends of a light against their density, which is wrong by a factor.
fn ends(world: &World, context: LightContext<'_>, number: u32, light: &Light, factor: f64) -> Chi2Result {
    let sample = |u| light.sample_end(number, context, u).map(|(end, _)| end);
    chi2_ends(world, number, sample, |end| factor * f64::from(light.end_pdf(context, end)))
}

#[test]
fn ends_follow_their_density() {
    let mut failures = Vec::new();
    each(|name, world, context, number, light| {
        for i in 0..20 {
            let u = Random::new(5, 0, i).next_2d();
            let Some((end, pdf)) = light.sample_end(number, context, u) else { panic!("{name} has no end") };
            assert_eq!(end.light, number);
            assert_eq!(end.is_delta(), light.is_delta(), "{name}");
            let known = light.end_pdf(context, &end);
            assert!((pdf / known - 1.0).abs() < 1e-2, "{name}: {pdf} {known}");
        }
        if light.is_delta() || number > 0 {
            return; // The triangles of a mesh are alike.
        }
        let result = ends(world, context, number, light, 1.0);
        if !result.passes(sidak(SIGNIFICANCE, TESTS)) {
            failures.push(format!("{name}: {result:?}"));
        }
    });
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Rays from an end of a light against their density, which is wrong by a factor.
fn departures(
    sphere: BoundingSphere,
    context: LightContext<'_>,
    light: &Light,
    end: &LightEnd,
    factor: f64,
) -> Chi2Result {
    let sample = |u| light.sample_departure(context, sphere, end, u);
    let density = |to| factor * f64::from(light.departure_pdf(context, sphere, end, to));
    match (light, end.place) {
        (Light::Portal(_), Place::Infinity(towards)) => {
            // Where they cross the plane y = 3 of the portal.
            let at = |origin: Vec3| origin - towards * ((origin.y - 3.0) / towards.y);
            chi2_rectangle(
                |u| sample(u).map(|departure| at(departure.origin)).map(|p| Vec2::new(p.x, p.z)),
                |p| density(Vec3::new(p.x, 3.0, p.y) - towards) * f64::from(towards.y),
                [-1.6, 1.6, -1.1, 1.6],
                [8, 8],
                SAMPLES,
                7,
            )
        }
        (_, Place::Infinity(towards)) => {
            let frame = Frame::from_z(towards);
            let polar = |origin: Vec3| {
                let p = frame.to_local(origin - sphere.center).truncate() / sphere.radius;
                Vec2::new(p.length_squared(), p.y.atan2(p.x))
            };
            // Squared radii and azimuths are spread evenly over a disk.
            let jacobian = 0.5 * f64::from(sphere.radius).powi(2);
            chi2_rectangle(
                |u| sample(u).map(|departure| polar(departure.origin)),
                |_| density(sphere.center) * jacobian,
                [0.0, 1.0 + 1e-5, -PI - 1e-5, PI + 1e-5],
                [16, 16],
                SAMPLES,
                7,
            )
        }
        (_, Place::Surface(point)) => chi2_sphere(
            |u| sample(u).map(|departure| departure.direction),
            |w| density(point.position + w) * f64::from(w.dot(point.normal).abs()),
            SAMPLES,
            7,
        ),
        (_, Place::Point(position)) => chi2_sphere(
            |u| sample(u).map(|departure| departure.direction),
            |w| ROUNDING + density(position + w),
            SAMPLES,
            7,
        ),
    }
}

#[test]
fn rays_leave_lights_by_their_density() {
    let mut failures = Vec::new();
    each(|name, world, context, number, light| {
        let sphere = world.bounding_sphere().into();
        // A point is always the same.
        for i in 0..if light.is_delta() { 1 } else { 2 } {
            let (end, _) = light.sample_end(number, context, Random::new(5, 1, i).next_2d()).expect("an end");
            let result = departures(sphere, context, light, &end, 1.0);
            if !result.passes(sidak(SIGNIFICANCE, TESTS)) {
                failures.push(format!("{name}: {result:?}"));
            }
        }
    });
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn wrong_densities_are_rejected() {
    each(|name, world, context, number, light| {
        let sphere: BoundingSphere = world.bounding_sphere().into();
        // Images over curves take long to integrate.
        let is_slow = ["curved screen", "triangles of a screen", "globe", "lamp shade", "portal"].contains(&name);
        if !light.is_delta() && !is_slow {
            assert!(!ends(world, context, number, light, 1.05).passes(1e-6), "{name}");
        }
        let (end, _) = light.sample_end(number, context, Random::new(5, 1, 0).next_2d()).expect("an end");
        assert!(!departures(sphere, context, light, &end, 1.03).passes(1e-6), "{name}");
    });
}

/// A ray starts where nothing of the light is in its way, or beyond everything, and brings what the light emits.
#[test]
fn rays_start_clear_of_their_light() {
    each(|name, world, context, number, light| {
        let sphere: BoundingSphere = world.bounding_sphere().into();
        for i in 0..200 {
            let mut random = Random::new(6, u64::from(number), i);
            let (end, _) = light.sample_end(number, context, random.next_2d()).expect("an end");
            let Some(departure) = light.sample_departure(context, sphere, &end, random.next_2d()) else { continue };
            let away = departure.origin + departure.direction * 0.5;
            let known = light.departure_pdf(context, sphere, &end, away);
            assert!((departure.pdf / known - 1.0).abs() < 2e-2, "{name} {i}: {departure:?} {known}");
            match end.place {
                Place::Surface(point) => {
                    assert!(departure.origin.distance(point.position) < 1e-4, "{name}");
                    let ray = Ray::new(departure.origin, departure.direction, 0.0);
                    let t = world.intersect(&ray).map_or(f32::INFINITY, |hit| hit.t);
                    assert!(t > 1e-3, "{name}: meets its own surface at {t}");
                }
                Place::Point(position) => assert_eq!(departure.origin, position, "{name}"),
                Place::Infinity(towards) => {
                    assert_eq!(departure.direction, -towards, "{name}");
                    assert!((departure.origin - sphere.center).dot(towards) >= sphere.radius, "{name}");
                }
            }
        }
    });
}

/// Whatever chooses among lights elsewhere, paths begin by power, and probabilities are those of the choices.
#[test]
fn emitters_are_chosen_by_power() {
    let lights = format!(
        r#"AttributeBegin {} AttributeEnd AttributeBegin {} AttributeEnd AttributeBegin {} AttributeEnd {}"#,
        LIGHTS[11].1, LIGHTS[14].1, LIGHTS[23].1, LIGHTS[22].1
    );
    let world = world("many", &lights);
    let emitted = EmittedSpectrum::default();
    let context = world.light_context(&emitted, Combination::Alone);
    let radius = world.bounding_sphere().1;
    let powers: Vec<f64> = world.lights().iter().map(|light| light.power(context, radius)).collect();
    let total: f64 = powers.iter().sum();
    for (name, sampler) in LightSampler::ALL {
        let selection = luz_render::light::LightSelection::new(sampler, world.lights(), context, radius)
            .expect("powers are finite");
        for (light, power) in powers.iter().enumerate() {
            let expected = 0.75 * power / total + 0.25 / powers.len() as f64;
            let probability = f64::from(selection.emitter_probability(light));
            assert!((probability / expected - 1.0).abs() < 1e-4, "{name}: {probability} {expected}");
        }
        let mut seen = vec![0.0; powers.len()];
        for i in 0..10_000 {
            let (light, probability, rest) = selection.sample_emitter((i as f32 + 0.5) / 10_000.0).expect("a light");
            assert!((0.0..1.0).contains(&rest));
            assert!((probability / selection.emitter_probability(light) - 1.0).abs() < 1e-5);
            seen[light] += 1e-4;
        }
        for (light, share) in seen.iter().enumerate() {
            assert!((share - f64::from(selection.emitter_probability(light))).abs() < 3e-4, "{name} {light}");
        }
    }
}
