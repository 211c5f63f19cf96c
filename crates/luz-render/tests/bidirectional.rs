//! Bidirectional path tracing and light tracing against path tracing, and each technique against all together.

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
    let base: u64 = std::env::var("LUZ_SEED").ok().and_then(|s| s.parse().ok()).unwrap_or(0);
    base + 1000 * way..base + 1000 * way + count
}

#[test]
fn all_integrators_agree_on_all_scenes() {
    let mut family = Family::default();
    for TransportScene { name, text, has_specular_view } in transport_scenes::all() {
        let loaded = loaded(&text);
        let depth = loaded.settings.integrator.max_depth();
        let reference = Means::of(&loaded, &path(&loaded, depth), 3, seeds(0, 48));
        let both = Means::of(&loaded, &bdpt(depth), 2, seeds(1, 48));
        family.compare(&format!("{name}, bdpt"), &reference, &both);
        if !has_specular_view {
            let light = Means::of(&loaded, &light(depth), 2, seeds(2, 48));
            family.compare(&format!("{name}, light"), &reference, &light);
        }
    }
    family.assert_agrees(SIGNIFICANCE);
}

/// Scenes whose light every technique can find, but for lights without extent.
fn scenes_for_techniques() -> Vec<TransportScene> {
    const NAMES: [&str; 8] = [
        "diffuse_box",
        "thin_lens",
        "rough_glass",
        "image_environment",
        "bump_map",
        "shading_normals",
        "orthographic_camera",
        "distant_light",
    ];
    transport_scenes::all().into_iter().filter(|scene| NAMES.contains(&scene.name)).collect()
}

#[test]
fn every_technique_agrees_with_all_together() {
    let mut family = Family::default();
    for TransportScene { name, text, .. } in scenes_for_techniques() {
        let loaded = loaded(&text);
        let has_delta_light = name == "distant_light";
        for edges in 1..=5u32 {
            let depth = edges - 1;
            let together = match depth {
                0 => Means::of(&loaded, &bdpt(0), 4, seeds(0, 48)),
                _ => Means::of_difference(&loaded, [&bdpt(depth), &bdpt(depth - 1)], 2, seeds(0, 48)),
            };
            for s in 0..=edges {
                let t = edges + 1 - s;
                // Lights that nothing can meet are not seen, and are found by techniques that begin there.
                if has_delta_light && (s == 0 || (s, t) == (1, 1)) {
                    continue;
                }
                let one = by(BidirectionalTechniques::One { s, t }, depth);
                let alone = Means::of(&loaded, &Integrator::Bidirectional(one), 4, seeds(1 + u64::from(s), 48));
                family.compare(&format!("{name}, all and s = {s}, t = {t}"), &together, &alone);
            }
        }
    }
    family.assert_agrees(SIGNIFICANCE);
}
