//! Light that scatters once, found from the camera and found from the light, is the same light: emission, response and
//! all measures between them fit together.

use super::SIGNIFICANCE;
use super::camera::looking_at_the_floor;
use super::specimens::{LIGHTS, luminance, world_with};
use glam::{Vec2, Vec3};
use luz_color::Wavelengths;
use luz_geometry::{Ray, Reference, SurfacePoint};
use luz_render::camera::Camera;
use luz_render::light::{Combination, EmittedSpectrum, LightEnd, Target};
use luz_render::world::World;
use luz_sample::Samples;
use luz_sample::random::Random;
use luz_sample::test_support::{mean_z_test, sidak};
use std::f32::consts::FRAC_1_PI;

/// A white floor, seen on both sides.
const FLOOR: &str = r#"Shape "bilinearmesh" "point3 P" [-8 -1 -8  8 -1 -8  -8 -1 8  8 -1 8]"#;

/// The floor where a ray meets it first.
fn floor_at(world: &World, ray: &Ray) -> Option<SurfacePoint> {
    let found = world.interaction(ray, &world.intersect(ray)?);
    found.light.is_none().then_some(found.surface)
}

/// cos θ' / d² at an end, or 1 where it is a direction, times the cosine at the floor.
fn geometry(floor: &SurfacePoint, direction: Vec3, position: Option<Vec3>, normal: Option<Vec3>) -> f32 {
    let at_end = normal.map_or(1.0, |n| n.dot(direction).abs());
    let distance = position.map_or(1.0, |p| p.distance_squared(floor.position));
    floor.geometric_normal.dot(direction).abs() * at_end / distance
}

/// The mean of all pixels from one path that begins at the camera and asks for light.
fn from_camera(world: &World, camera: &Camera, size: Vec2, random: &mut Random) -> f64 {
    let wavelengths = Wavelengths::sample_visible(random.next_1d());
    let emitted = EmittedSpectrum::default();
    let context = world.light_context(&emitted, Combination::Alone);
    let eye = camera.sample_end(random.next_2d(), random.next_1d());
    let ray = camera.departure(&eye, random.next_2d() * size);
    let (choice, u) = (random.next_1d(), random.next_2d());
    let Some(floor) = floor_at(world, &ray) else { return 0.0 };
    let Some((number, probability, _)) = world.light_selection().sample_emitter(choice) else { return 0.0 };
    let light = &world.lights()[number];
    let reference = Reference::surface(floor.position, floor.shading_normal);
    let Some((end, pdf)) = light.sample_end_from(number as u32, context, &reference, u) else { return 0.0 };
    let Some(direction) = end.direction_from(floor.position) else { return 0.0 };
    let same_side = (floor.geometric_normal.dot(direction) > 0.0) == (floor.geometric_normal.dot(ray.direction) < 0.0);
    if !same_side || !world.is_visible(&floor, direction, end.target_from(floor.position)) {
        return 0.0;
    }
    let arriving = luminance(light.emitted(context, &end, floor.position, &wavelengths), &wavelengths);
    let g = geometry(&floor, direction, end.position(), end.normal());
    arriving * f64::from(FRAC_1_PI * g / (probability * pdf))
}

/// The mean of all pixels from one path that begins at a light and is seen.
fn from_light(world: &World, camera: &Camera, size: Vec2, random: &mut Random) -> f64 {
    let wavelengths = Wavelengths::sample_visible(random.next_1d());
    let emitted = EmittedSpectrum::default();
    let context = world.light_context(&emitted, Combination::Alone);
    let eye = camera.sample_end(random.next_2d(), random.next_1d());
    let (choice, u, v) = (random.next_1d(), random.next_2d(), random.next_2d());
    let Some((number, probability, _)) = world.light_selection().sample_emitter(choice) else { return 0.0 };
    let light = &world.lights()[number];
    let Some((end, pdf)): Option<(LightEnd, f32)> = light.sample_end(number as u32, context, u) else { return 0.0 };
    let sphere = world.bounding_sphere().into();
    let Some(departure) = light.sample_departure(context, sphere, &end, v) else { return 0.0 };
    let ray = Ray::new(departure.origin, departure.direction, eye.time());
    let Some(floor) = floor_at(world, &ray) else { return 0.0 };
    let Some((film, response)) = camera.film(&eye, floor.position, 0.0) else { return 0.0 };
    let Some(direction) = eye.direction_from(floor.position) else { return 0.0 };
    let same_side = (floor.geometric_normal.dot(direction) > 0.0) == (floor.geometric_normal.dot(ray.direction) < 0.0);
    let lens = camera.departure(&eye, film).origin;
    if !same_side || !world.is_visible(&floor, direction, Target::Point(lens)) {
        return 0.0;
    }
    let leaving = luminance(light.emitted(context, &end, floor.position, &wavelengths), &wavelengths);
    let g = geometry(&floor, direction, eye.position(), None);
    let densities = probability * pdf * departure.pdf;
    leaving * f64::from(FRAC_1_PI * g * response / (size.x * size.y) / densities)
}

/// z-tests of the mean of all pixels, for every light and, in turn, every camera.
#[test]
fn light_is_the_same_from_both_ends() {
    const SAMPLES: u64 = 30_000;
    let (cameras, size) = looking_at_the_floor();
    let significance = sidak(SIGNIFICANCE, LIGHTS.len());
    let mut seen = 0;
    for ((name, text), (camera_name, camera)) in LIGHTS.iter().zip(cameras.iter().cycle()) {
        let world = world_with(name, text, FLOOR);
        let estimate = |stream, of: fn(&World, &Camera, Vec2, &mut Random) -> f64| {
            let (mut sum, mut squares) = (0.0, 0.0);
            for i in 0..SAMPLES {
                let value = of(&world, camera, size, &mut Random::new(12, stream, i));
                sum += value;
                squares += value * value;
            }
            let n = SAMPLES as f64;
            (sum / n, (squares / n - (sum / n).powi(2)) / n)
        };
        let (eye, eye_error) = estimate(0, from_camera);
        let (light, light_error) = estimate(1, from_light);
        let p = mean_z_test(eye, eye_error, light, light_error);
        let said = format!("{name}, {camera_name}: {eye} ± {}, {light} ± {}", eye_error.sqrt(), light_error.sqrt());
        assert!(p >= significance, "{said}");
        // Both errors are small enough to tell something.
        assert!(light_error.sqrt() < 0.15 * light || light == 0.0, "{said}");
        // A factor would be noticed.
        let wrong = if light > 0.0 { mean_z_test(eye, eye_error, 1.5 * light, light_error) } else { 0.0 };
        assert!(wrong < 1e-3 || light_error.sqrt() > 0.08 * light || eye_error.sqrt() > 0.08 * eye, "{said}");
        seen += i32::from(light > 0.0);
    }
    assert!(seen >= LIGHTS.len() as i32 - 3, "{seen}");
}
