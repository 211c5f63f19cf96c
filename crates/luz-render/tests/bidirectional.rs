//! Bidirectional path tracing and light tracing against path tracing, and each technique against all together.
//!
//! What these tests see, by trial: emission too strong by 2 %, one technique's density counted twice in the others' weights, and
//! shading normals without the ratio of cosines by which the BSDF's value is to be changed.

mod common;

use common::agreement::{Family, Means};
use common::load;
use common::transport_scenes::{self, TransportScene};
use luz_render::Overrides;
use luz_render::film::Filter;
use luz_render::integrator::{BidirectionalIntegrator, BidirectionalTechniques, Integrator};
use luz_render::world::Loaded;
use luz_sample::mis::Heuristic;

/// How often one of these tests, of another seed, would fail though nothing is wrong. Their seeds are fixed.
const SIGNIFICANCE: f64 = 1e-3;

fn loaded(text: &str) -> Loaded {
    load(text, &Overrides { filter: Some(Filter::unit_box()), ..Overrides::default() })
}

fn by(techniques: BidirectionalTechniques, max_depth: u32) -> BidirectionalIntegrator {
    BidirectionalIntegrator { max_depth, techniques, heuristic: Heuristic::default() }
}

fn bdpt(max_depth: u32) -> Integrator {
    Integrator::Bidirectional(by(BidirectionalTechniques::All, max_depth))
}

fn light(max_depth: u32) -> Integrator {
    Integrator::Light(by(BidirectionalTechniques::Light, max_depth))
}

fn path(loaded: &Loaded, max_depth: u32) -> Integrator {
    let mut integrator = loaded.settings.integrator.clone();
    integrator.path_mut().expect("the scenes say `path`").max_depth = max_depth;
    integrator
}

/// The seeds of the first way to render, the second, and so on: all different.
fn seeds(way: u64, count: u64) -> std::ops::Range<u64> {
    1000 * way..1000 * way + count
}

#[test]
fn all_integrators_agree_on_all_scenes() {
    let (mut family, mut broken) = (Family::default(), Family::default());
    for TransportScene { name, text, has_specular_view } in transport_scenes::all() {
        let loaded = loaded(&text);
        let depth = loaded.settings.integrator.max_depth();
        let reference = Means::of(&loaded, &path(&loaded, depth), 3, seeds(0, 24));
        let both = Means::of(&loaded, &bdpt(depth), 2, seeds(1, 24));
        family.compare(&format!("{name}, bdpt"), &reference, &both);
        broken.compare(name, &reference, &both.scaled(1.02));
        if !has_specular_view {
            let light = Means::of(&loaded, &light(depth), 2, seeds(2, 24));
            family.compare(&format!("{name}, light"), &reference, &light);
        }
    }
    family.assert_agrees(SIGNIFICANCE);
    assert!(!broken.contradictions(SIGNIFICANCE).is_empty(), "the test must be able to fail");
}

/// Scenes whose light every technique can find, but for lights without extent.
const SCENES_FOR_TECHNIQUES: [&str; 5] =
    ["diffuse_box", "thin_lens", "rough_glass", "image_environment", "distant_light"];

#[test]
fn every_technique_agrees_with_all_together() {
    let mut family = Family::default();
    for TransportScene { name, text, .. } in transport_scenes::all() {
        if !SCENES_FOR_TECHNIQUES.contains(&name) {
            continue;
        }
        let loaded = loaded(&text);
        let has_delta_light = name == "distant_light";
        for edges in 1..=5u32 {
            let depth = edges - 1;
            let together = match depth {
                0 => Means::of(&loaded, &bdpt(0), 2, seeds(0, 20)),
                _ => Means::of_difference(&loaded, [&bdpt(depth), &bdpt(depth - 1)], 2, seeds(0, 20)),
            };
            for s in 0..=edges {
                let t = edges + 1 - s;
                // Lights that nothing can meet are not seen, and are found by techniques that begin there.
                if has_delta_light && (s == 0 || (s, t) == (1, 1)) {
                    continue;
                }
                let one = Integrator::Bidirectional(by(BidirectionalTechniques::One { s, t }, depth));
                let alone = Means::of(&loaded, &one, 2, seeds(1 + u64::from(s), 20));
                family.compare_whole(&format!("{name}, all and s = {s}, t = {t}"), &together, &alone);
            }
        }
    }
    family.assert_agrees(SIGNIFICANCE);
}

/// Within the shining ball every path of so many edges carries the same light, whatever technique makes it, and any two points
/// have the same geometry factor: the lamp's radiance of one, halved at each scattering. What remains random is the colour that the
/// wavelengths make of it, and, of `t = 1` or roulette, what arrives at all.
#[test]
fn every_technique_is_exact_in_a_furnace() {
    let loaded = loaded(&transport_scenes::closed_furnace());
    let (mut family, mut broken) = (Family::default(), Family::default());
    for edges in 1..=6u32 {
        let depth = edges - 1;
        let seen = Means::of(&loaded, &path(&loaded, 0), 4, seeds(20 + u64::from(edges), 10));
        let reference = seen.scaled(0.5f64.powi(depth as i32));
        assert!((seen.whole(1).0 - 1.0).abs() < 1e-3, "{:?}", seen.whole(1));
        for s in 0..=edges {
            let one = Integrator::Bidirectional(by(BidirectionalTechniques::One { s, t: edges + 1 - s }, depth));
            let alone = Means::of(&loaded, &one, 4, seeds(1 + u64::from(s), 10));
            family.compare(&format!("s = {s} of {edges} edges"), &reference, &alone);
            broken.compare("2 % too bright", &reference, &alone.scaled(1.02));
        }
    }
    family.assert_agrees(SIGNIFICANCE);
    assert!(broken.contradictions(SIGNIFICANCE).len() > family.len() / 4, "the test must be able to fail");
}

/// The light of each path length by itself: differences between pictures of the same random numbers.
#[test]
fn integrators_agree_at_each_path_length() {
    let mut family = Family::default();
    for TransportScene { name, text, .. } in transport_scenes::all() {
        if !["all_lights", "mixed_materials", "equirectangular_camera"].contains(&name) {
            continue;
        }
        let loaded = loaded(&text);
        for depth in 1..=4 {
            let ways: [Means; 3] = std::array::from_fn(|way| {
                let [more, less] = [depth, depth - 1].map(|depth| match way {
                    0 => path(&loaded, depth),
                    1 => bdpt(depth),
                    _ => light(depth),
                });
                Means::of_difference(&loaded, [&more, &less], 2, seeds(way as u64, 20))
            });
            family.compare(&format!("{name}, depth {depth}, bdpt"), &ways[0], &ways[1]);
            family.compare_whole(&format!("{name}, depth {depth}, light"), &ways[0], &ways[2]);
        }
    }
    family.assert_agrees(SIGNIFICANCE);
}
