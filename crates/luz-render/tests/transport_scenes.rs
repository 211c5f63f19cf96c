//! The scenes that integrators are compared on: they are what they say, and path tracing converges on them quickly.

mod common;

use common::transport_scenes::{all, closed_furnace};
use common::{load, mean, overrides, render};
use luz_scene::Diagnostics;

/// Nothing in them is ignored, every sample is finite, and 128 samples per pixel know the picture's mean within 2 %.
#[test]
fn path_tracing_converges() {
    let mut bad = Vec::new();
    for scene in all() {
        let (description, diagnostics) = luz_scene::read_str("test.pbrt", &scene.text).expect("the scene can be read");
        assert_eq!(diagnostics.warning_count(), 0, "{}: {}", scene.name, diagnostics.render(&description.sources));
        let mut diagnostics = Diagnostics::default();
        let loaded =
            luz_render::world::build(&description, &overrides([20, 20], 128), Default::default(), &mut diagnostics);
        assert_eq!(diagnostics.warning_count(), 0, "{}: {}", scene.name, diagnostics.render(&description.sources));
        let Some(loaded) = loaded else { panic!("{}: {}", scene.name, diagnostics.render(&description.sources)) };
        let film = render(&loaded);
        assert_eq!(film.dropped(), 0, "{}", scene.name);
        for (value, error) in mean(&film) {
            println!("{:<24} {value:.4} ± {:.2} %", scene.name, 100.0 * error / value);
            if !(value > 0.01 && error < 0.02 * value) {
                bad.push(format!("{}: {value} ± {error}", scene.name));
            }
        }
    }
    assert!(bad.is_empty(), "{bad:?}");
}

/// Within five standard errors and the 0.1 % by which the wavelengths' table rounds.
#[test]
fn the_furnace_is_a_geometric_series() {
    for depth in [0, 1, 4] {
        let overrides = luz_render::Overrides { max_depth: Some(depth), ..overrides([16, 16], 64) };
        let expected = 2.0 * (1.0 - 0.5f64.powi(depth as i32 + 1));
        for (value, error) in mean(&render(&load(&closed_furnace(), &overrides))) {
            assert!((value - expected).abs() < 5.0 * error + 1e-3 * expected, "{depth}: {value} ± {error}");
        }
    }
}
