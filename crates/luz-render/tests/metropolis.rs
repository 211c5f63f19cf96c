//! Metropolis light transport against path tracing.

mod common;

use common::{load, overrides, render};
use luz_render::film::{Film, Filter, FilterKind, Normalization, SplatSums};
use luz_render::integrator::IntegratorKind;
use luz_render::integrator::metropolis::DirectLight;
use luz_render::{MetropolisOverrides, Overrides, Renderer};
use luz_sample::SamplerKind;
use luz_sample::statistics::Running;

const SIZE: [u32; 2] = [8, 6];

const CAMERA: &str = r#"LookAt 0 2 -6  0 0.6 0  0 1 0  Camera "perspective" "float fov" 35"#;
const LENS: &str = r#"LookAt 0 2 -6  0 0.6 0  0 1 0
    Camera "perspective" "float fov" 35 "float lensradius" 0.3 "float focaldistance" 5"#;
const FLOOR: &str = r#"Material "diffuse" "rgb reflectance" [0.7 0.5 0.3]
    Shape "bilinearmesh" "point3 P" [-4 0 -4  -4 0 4  4 0 -4  4 0 4]"#;
const LAMP: &str = r#"AttributeBegin AreaLightSource "diffuse" "rgb L" [9 8 7] Translate 1.5 3 0
    Shape "sphere" "float radius" 0.8 AttributeEnd"#;
const SKY: &str = r#"LightSource "infinite" "rgb L" [0.4 0.6 1]"#;
const BALL: &str = r#"AttributeBegin Translate 0 0.9 0 Shape "sphere" "float radius" 0.9 AttributeEnd"#;

fn scenes() -> [(&'static str, String); 4] {
    [
        ("diffuse", format!("{CAMERA} WorldBegin {LAMP} {FLOOR} {BALL}")),
        ("glass", format!(r#"{CAMERA} WorldBegin {LAMP} {FLOOR} Material "dielectric" {BALL}"#)),
        ("lens", format!(r#"{LENS} WorldBegin {LAMP} {FLOOR} Material "conductor" "float roughness" 0.2 {BALL}"#)),
        ("environment", format!("{CAMERA} WorldBegin {SKY} {FLOOR} {BALL}")),
    ]
}

fn path(scene: &str, filter: &Filter) -> Film {
    let wishes = Overrides {
        sampler: Some(SamplerKind::Independent),
        filter: Some(filter.clone()),
        seed: Some(1000),
        ..overrides(SIZE, 4000)
    };
    render(&load(scene, &wishes))
}

const BATCHES: u32 = 128;

fn primary(scene: &str, filter: &Filter, mutations: u32, metropolis: MetropolisOverrides) -> Film {
    let wishes = Overrides {
        integrator: Some(IntegratorKind::PrimarySpace),
        filter: Some(filter.clone()),
        metropolis: MetropolisOverrides {
            chains: metropolis.chains.or(Some(256)),
            bootstrap_samples: metropolis.bootstrap_samples.or(Some(400_000)),
            batches: Some(BATCHES),
            ..metropolis
        },
        ..overrides(SIZE, mutations)
    };
    render(&load(scene, &wishes))
}

/// (Σz² − n)/√(2n) over the pixels' mean colours.
fn z_of_squares(a: &Film, b: &Film, scale: f64) -> f64 {
    let average = |values: [f64; 3]| values.iter().sum::<f64>() / 3.0;
    let brightness = a.estimates().map(|pixel| average(pixel.mean)).sum::<f64>() / a.estimates().len() as f64;
    let squares: Vec<f64> = a
        .estimates()
        .zip(b.estimates())
        // What is nearly black is visited too rarely for its error to be known.
        .filter(|(a, _)| average(a.mean) > 0.01 * brightness)
        // Channels hang together: the variance of their mean is taken for the mean of their variances, or it is above.
        .map(|(a, b)| {
            let variance = average(a.variance) + scale * scale * average(b.variance);
            (average(a.mean) - scale * average(b.mean)).powi(2) / variance.max(1e-12)
        })
        .collect();
    let n = squares.len() as f64;
    (squares.iter().sum::<f64>() - n) / (2.0 * n).sqrt()
}

/// χ² over 48 pixels, each within ±5 of its standard deviation (neighbouring pixels hang together, by chains that visit both); a
/// picture that is too bright by 15 % is noticed.
#[test]
fn primary_space_chains_agree_with_path_tracing() {
    let box_filter = Filter::unit_box();
    for (name, scene) in scenes() {
        let reference = path(&scene, &box_filter);
        for direct_light in [DirectLight::Inside, DirectLight::Separate] {
            let chains = MetropolisOverrides { direct_light: Some(direct_light), ..Default::default() };
            let film = primary(&scene, &box_filter, 8000, chains);
            let z = z_of_squares(&reference, &film, 1.0);
            assert!(z.abs() < 5.0, "{name}, {direct_light}: {z}");
            let broken = z_of_squares(&reference, &film, 1.15);
            assert!(broken > 5.0, "{name}, {direct_light}: {broken}: the test must be able to fail");
        }
    }
}

#[test]
fn filters_and_two_stages_change_nothing_in_the_mean() {
    let (name, scene) = &scenes()[1];
    let wide = Filter::new(FilterKind::Gaussian { sigma: 0.5 }, glam::Vec2::splat(1.5));
    let reference = path(scene, &wide);
    let film = primary(scene, &wide, 5000, MetropolisOverrides { two_stage: true, ..Default::default() });
    let z = z_of_squares(&reference, &film, 1.0);
    assert!(z.abs() < 7.0, "{name}: {z}");
    let broken = z_of_squares(&reference, &film, 1.15);
    assert!(broken > 7.0, "{name}: {broken}: the test must be able to fail");
}

/// In pbrt-v4 they do not: its issue 525.
#[test]
fn bootstraps_of_different_sizes_agree() {
    let (name, scene) = &scenes()[0];
    let box_filter = Filter::unit_box();
    let films: Vec<Film> = [300, 3000, 30_000]
        .into_iter()
        .map(|samples| {
            let chains = MetropolisOverrides { bootstrap_samples: Some(samples), ..Default::default() };
            primary(scene, &box_filter, 2000, chains)
        })
        .collect();
    for pair in films.windows(2) {
        let normalization = |film: &Film| film.splats().and_then(SplatSums::normalization).expect("chains have one");
        let [a, b] = [normalization(&pair[0]), normalization(&pair[1])];
        let z = (a.value - b.value) / a.standard_error.hypot(b.standard_error);
        assert!(z.abs() < 3.9, "{name}: {a:?} {b:?}");
        // What b is wrong by, all pixels are.
        let [mean_a, mean_b] = [common::mean(&pair[0])[1], common::mean(&pair[1])[1]];
        let relative = |mean: (f64, f64), b: Normalization| (mean.1 / mean.0).hypot(b.standard_error / b.value);
        let z = (mean_a.0 / mean_b.0).ln() / relative(mean_a, a).hypot(relative(mean_b, b));
        assert!(z.abs() < 3.9, "{name}: {mean_a:?} {mean_b:?}");
    }
}

#[test]
fn without_light_the_picture_is_black_at_once() {
    let scene = format!("{CAMERA} WorldBegin {FLOOR} {BALL}");
    let wishes = Overrides {
        integrator: Some(IntegratorKind::PrimarySpace),
        sample_limit: Some(1 << 30),
        ..overrides(SIZE, 64)
    };
    let loaded = load(&scene, &wishes);
    let mut renderer = Renderer::new(&loaded.world, &loaded.camera, &loaded.settings);
    renderer.finish();
    let report = renderer.chains().expect("there are chains");
    assert!(report.is_dark && report.kinds.iter().all(|(_, kind)| kind.acceptance.steps() == 0));
    assert!(renderer.film().estimates().all(|pixel| pixel.mean == [0.0; 3]));
    assert!(renderer.incidents().is_empty());
}

#[test]
fn one_pixel_and_more_chains_than_mutations_are_rendered() {
    let (_, scene) = &scenes()[0];
    let wishes = Overrides {
        integrator: Some(IntegratorKind::PrimarySpace),
        metropolis: MetropolisOverrides { bootstrap_samples: Some(5000), ..Default::default() },
        ..overrides([1, 1], 200)
    };
    let chains = render(&load(scene, &wishes));
    let paths = render(&load(scene, &overrides([1, 1], 4096)));
    let [chains, paths] = [chains, paths].map(|film| film.estimates().next().expect("there is a pixel"));
    let z = (chains.mean[1] - paths.mean[1]) / (chains.variance[1] + paths.variance[1]).sqrt();
    assert!(z.abs() < 4.0 && chains.variance[1].is_finite(), "{chains:?} {paths:?}");
}

/// Over 24 seeds the pixels' variances are what their films say: within a quarter, which is four standard errors of the ratio.
#[test]
fn pixels_know_their_errors() {
    const SEEDS: u64 = 24;
    let (name, scene) = &scenes()[3];
    let films: Vec<Film> = (0..SEEDS)
        .map(|seed| {
            let wishes = Overrides {
                integrator: Some(IntegratorKind::PrimarySpace),
                seed: Some(seed),
                metropolis: MetropolisOverrides {
                    chains: Some(64),
                    bootstrap_samples: Some(20_000),
                    ..Default::default()
                },
                ..overrides(SIZE, 300)
            };
            render(&load(scene, &wishes))
        })
        .collect();
    let (mut estimated, mut empirical) = (0.0, 0.0);
    for pixel in 0..films[0].estimates().len() {
        let mut means = Running::default();
        for film in &films {
            let estimate = film.estimates().nth(pixel).expect("there is a pixel");
            estimated += estimate.variance[1] / SEEDS as f64;
            means.push(estimate.mean[1]);
        }
        empirical += means.variance();
    }
    assert!((estimated / empirical).ln().abs() < 0.25, "{name}: {estimated} {empirical}");
}
