//! Lights one behind the other: walks that are to end choose among them with the probability that is said.

mod common;

use common::{load, overrides, render};
use glam::Vec2;
use luz_color::Wavelengths;
use luz_render::film::Film;
use luz_render::integrator::IntegratorKind;
use luz_render::transport::{Bounce, Extension, PathSpace, SceneSpace, SceneVertex, Side};
use luz_render::{MetropolisOverrides, Overrides};
use luz_sample::Samples;
use luz_sample::random::Random;
use std::collections::HashMap;

/// Two environments, a sphere that emits and does not scatter, a panel behind it that does both, and a floor that sees all.
const SCENE: &str = r#"
    LookAt 0 1 -6  0 1 0  0 1 0
    Camera "perspective" "float fov" 50
    WorldBegin
    LightSource "infinite" "rgb L" [0.2 0.3 0.4]
    LightSource "infinite" "rgb L" [0.1 0.1 0.1]
    AttributeBegin
        AreaLightSource "diffuse" "rgb L" [3 2 1] "bool twosided" true
        Material "interface"
        Translate 0 1.5 0
        Shape "sphere" "float radius" 0.8
    AttributeEnd
    Material "diffuse" "rgb reflectance" [0.5 0.6 0.7]
    AttributeBegin
        AreaLightSource "diffuse" "rgb L" [1 2 3] "bool twosided" true
        Shape "bilinearmesh" "point3 P" [-2 1 2  2 1 2  -2 3 2  2 3 2]
    AttributeEnd
    Shape "bilinearmesh" "point3 P" [-3 0 -3  -3 0 3  3 0 -3  3 0 3]
"#;

#[test]
fn walks_choose_their_ends_with_the_probability_that_is_said() {
    let loaded = load(SCENE, &overrides([16, 16], 1));
    let window = loaded.settings.film_window();
    let space = SceneSpace::new(&loaded.world, &loaded.camera, window, Wavelengths::sample_visible(0.5), 0.0);
    let mut rows_of = [0; 5];
    let mut check = |at: &SceneVertex<'_>, found: SceneVertex<'_>| {
        // An even number for any row of up to four.
        const DRAWS: u32 = 120;
        let mut shares: HashMap<(u32, u32), (f32, f32)> = HashMap::new();
        for i in 0..DRAWS {
            let end = space.choose_end(at, found.clone(), (i as f32 + 0.5) / DRAWS as f32);
            let Some(SceneVertex::Light(light)) = space.as_light(&end) else { continue };
            let end = SceneVertex::Light(light);
            let distance = end.position().map_or(0.0, |p| p.distance(at.position().unwrap_or_default()));
            let share = shares.entry((light.light, distance.to_bits())).or_default();
            *share = (share.0 + 1.0 / DRAWS as f32, space.end_probability(at, &end));
        }
        for (share, probability) in shares.values() {
            assert!((share - probability).abs() < 1e-4, "{shares:?}");
        }
        rows_of[shares.len()] += 1;
    };
    for i in 0..2000 {
        let mut random = Random::new(1, 0, i);
        let Some(eye) = space.begin(Side::Eye, &mut random) else { continue };
        if let Some(seen) = space.seen_through(&eye, window.at(random.next_2d()), true) {
            check(&eye, seen);
        }
        let seen = space.seen_through(&eye, window.at(Vec2::new(random.next_1d(), 0.9)), false);
        let Some(floor @ SceneVertex::Surface(_)) = seen else { continue };
        let next = space.extend(Side::Eye, Some(&eye), &floor, true, &mut random);
        if let Some(Extension { vertex, bounce: Bounce::Spread }) = next {
            check(&floor, vertex);
        }
    }
    // The floor or nothing; the panel; the environments or the sphere's two sides; with the panel behind them; or the environments.
    assert!(rows_of.iter().all(|&rows| rows > 20), "{rows_of:?}");
}

/// (Σz² − n)/√(2n) over the pixels' mean colours.
fn z_of_squares(a: &Film, b: &Film, scale: f64) -> f64 {
    let average = |values: [f64; 3]| values.iter().sum::<f64>() / 3.0;
    let squares: Vec<f64> = a
        .estimates()
        .zip(b.estimates())
        .map(|(a, b)| {
            let variance = average(a.variance) + scale * scale * average(b.variance);
            (average(a.mean) - scale * average(b.mean)).powi(2) / variance
        })
        .collect();
    let n = squares.len() as f64;
    (squares.iter().sum::<f64>() - n) / (2.0 * n).sqrt()
}

/// As far as mirrors show them, by path-space Metropolis, which has to find such ends. χ² over 48 pixels, within ±5 of its standard
/// deviation; a picture that is too bright by 15 % is noticed.
#[test]
fn chains_of_paths_find_all_lights_in_a_row() {
    let scene = SCENE.replace(
        r#"Material "diffuse" "rgb reflectance" [0.5 0.6 0.7]"#,
        r#"Material "conductor" "rgb reflectance" [0.5 0.6 0.7] "float roughness" 0"#,
    );
    let reference = render(&load(&scene, &overrides([8, 6], 4000)));
    let metropolis = MetropolisOverrides {
        chains: Some(256),
        batches: Some(128),
        bootstrap_samples: Some(400_000),
        ..MetropolisOverrides::default()
    };
    let wishes = Overrides { integrator: Some(IntegratorKind::PathSpace), metropolis, ..overrides([8, 6], 10_000) };
    let film = render(&load(&scene, &wishes));
    let [z, broken] = [1.0, 1.15].map(|scale| z_of_squares(&reference, &film, scale));
    assert!(z.abs() < 5.0, "{z}");
    assert!(broken > 5.0, "{broken}: the test must be able to fail");
}

/// Connections know what stands before the sky as walks do.
#[test]
fn the_sky_is_visible_where_it_is_seen() {
    let loaded = load(SCENE, &overrides([16, 16], 1));
    let window = loaded.settings.film_window();
    let space = SceneSpace::new(&loaded.world, &loaded.camera, window, Wavelengths::sample_visible(0.5), 0.0);
    let mut counts = [0; 2];
    for i in 0..5000 {
        let mut random = Random::new(2, 0, i);
        let Some(eye) = space.begin(Side::Eye, &mut random) else { continue };
        let Some(sky) = space.begin(Side::Light, &mut random).filter(|light| light.position().is_none()) else {
            continue;
        };
        let Some(film) = space.film(&eye, &sky) else { continue };
        // Through the sphere, which walks pass.
        let seen = space.seen_through(&eye, film, false);
        assert_eq!(space.is_visible(&eye, &sky), seen.is_none(), "{film}");
        assert_eq!(space.is_visible(&sky, &eye), seen.is_none(), "{film}");
        counts[usize::from(seen.is_none())] += 1;
    }
    assert!(counts.iter().all(|&count| count > 50), "{counts:?}");
}
