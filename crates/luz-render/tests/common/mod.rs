//! Rendering small scenes in tests.

#![allow(dead_code)]

pub mod agreement;
pub mod transport_scenes;
pub mod ways;

use luz_geometry::SimdLevel;
use luz_render::film::{Film, Filter};
use luz_render::integrator::PathIntegrator;
use luz_render::world::{Loaded, build};
use luz_render::{Overrides, Renderer};
use luz_scene::{Description, Diagnostics};

/// The world of a scene's text; panics with its diagnostics where there is none.
pub fn load(text: &str, overrides: &Overrides) -> Loaded {
    match luz_scene::read_str("test.pbrt", text) {
        Ok((description, _)) => load_description(&description, overrides),
        Err(errors) => panic!("{errors}"),
    }
}

/// The world of a description; panics with its diagnostics where there is none.
pub fn load_description(description: &Description, overrides: &Overrides) -> Loaded {
    let mut diagnostics = Diagnostics::default();
    build(description, overrides, SimdLevel::Auto, &mut diagnostics)
        .unwrap_or_else(|| panic!("{}", diagnostics.render(&description.sources)))
}

/// The settings of path tracing; panics where something else renders.
pub fn path(loaded: &mut Loaded) -> &mut PathIntegrator {
    loaded.settings.integrator.path_mut().expect("path tracing renders it")
}

/// All samples of a world.
pub fn render(loaded: &Loaded) -> Film {
    let mut renderer = Renderer::new(&loaded.world, &loaded.camera, &loaded.settings);
    renderer.finish();
    renderer.film().clone()
}

/// Width, height, samples per pixel, box filter.
pub fn overrides(resolution: [u32; 2], samples_per_pixel: u32) -> Overrides {
    Overrides {
        resolution: Some(resolution),
        samples_per_pixel: Some(samples_per_pixel),
        filter: Some(Filter::unit_box()),
        ..Overrides::default()
    }
}

/// The mean over all pixels, and its standard error, per channel.
pub fn mean(film: &Film) -> [(f64, f64); 3] {
    let n = film.estimates().len() as f64;
    std::array::from_fn(|c| {
        let mean = film.estimates().map(|p| p.mean[c]).sum::<f64>() / n;
        let variance = film.estimates().map(|p| p.variance[c]).sum::<f64>() / (n * n);
        (mean, variance.sqrt())
    })
}
