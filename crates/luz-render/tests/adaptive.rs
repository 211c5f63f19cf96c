//! Adaptive sampling brings pixels to the same error. (That it is unbiased is tested where it is decided.)

mod common;

use common::{load, overrides, render};
use luz_render::Overrides;
use luz_render::film::{Estimate, Film};
use luz_sample::SamplerKind;

/// A floor under a small bright lamp, half of which stands in the penumbra of a wall: pixels of very different variance.
const SCENE: &str = r#"
    LookAt 0 3 -6  0 0.5 0  0 1 0
    Camera "perspective" "float fov" 40
    Integrator "path" "integer maxdepth" 3
    WorldBegin
    AttributeBegin AreaLightSource "diffuse" "rgb L" [90 80 70] Translate 1 2.5 0 Shape "sphere" "float radius" 0.1 AttributeEnd
    Material "diffuse" "rgb reflectance" [0.5 0.6 0.7]
    Shape "bilinearmesh" "point3 P" [-3 0 -3  -3 0 3  3 0 -3  3 0 3]
    Material "conductor" "float roughness" 0.3
    Translate 0 0.7 0
    Shape "sphere" "float radius" 0.7
"#;

fn adaptive(target: Option<f64>, samples: u32, seed: u64) -> Film {
    let wanted = Overrides {
        adaptive: target,
        seed: Some(seed),
        sampler: Some(SamplerKind::Independent),
        ..overrides([24, 16], samples)
    };
    render(&load(SCENE, &wanted))
}

#[test]
fn errors_become_even_with_fewer_samples() {
    let target = 0.05;
    let (film, uniform) = (adaptive(Some(target), 4096, 1), adaptive(None, 4096, 1));
    assert!(film.samples() < uniform.samples() / 2, "{} of {}", film.samples(), uniform.samples());
    let error = |pixel: &Estimate| {
        let average = |values: [f64; 3]| values.iter().sum::<f64>() / 3.0;
        (average(pixel.variance) / (average(pixel.mean.map(|m| m * m)) + 0.01)).sqrt()
    };
    let errors: Vec<f64> = film.estimates().map(|p| error(&p)).collect();
    let root_mean_square = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    assert!(root_mean_square < 1.2 * target, "{root_mean_square}");
    let counts: Vec<u32> = film.estimates().map(|p| p.count).collect();
    assert!(counts.iter().max() > counts.iter().min(), "{counts:?}");
}

#[test]
fn too_few_samples_for_a_pilot_are_uniform() {
    let film = adaptive(Some(0.01), 16, 1);
    assert!(film.estimates().all(|p| p.count == 16));
}
