//! Renderings against references that pbrt-v4 made of the same scenes.
//!
//! The folder that `LUZ_DATA` names holds `references/NAME.exr`, means over 16 replicas of 256 samples per pixel, and
//! `references/NAME.var.exr`, the variances of those means, estimated from the 16 replicas.
//!
//! # The rule
//!
//! Both means are treated as normal and the variances as estimates, so that each comparison is Welch's t-test with the
//! degrees of freedom of Welch and Satterthwaite. Three families are tested, each at a significance of 1 % after Šidák's
//! correction for the number of comparisons in it:
//!
//! 1. every pixel and channel,
//! 2. the mean over every tile of 16×16 pixels, per channel (of which a small bias is seen),
//! 3. the mean over the whole picture, per channel;
//!
//! and the mean of a second render, with stratified samples and so with little noise, must lie within 0.5 % and twice the
//! reference's own standard error (0.03 % of `cornell-box`, but 0.2 % of `veach-mis`, where a lamp smaller than a pixel
//! makes most of it).
//!
//! Pixels whose light is found rarely (caustics, indirect light in dark corners, the edges of lamps) break the
//! assumption of the first family: few samples carry most of the mean, and a variance estimated without them is far too
//! small. As in Mitsuba 3's tests of the same kind, the first family passes if 99.75 % of its comparisons do. Tiles have
//! 256 times the samples; 98 % of their comparisons must pass, since one rare path spoils all three channels of a tile at
//! once. A bias of 2 % in one BSDF fails nine in ten.

mod common;

use common::{load_description, overrides};
use luz_image::Image;
use luz_render::Renderer;
use luz_render::bsdf::CoatWeights;
use luz_render::film::Film;
use luz_render::integrator::IntegratorKind;
use luz_render::integrator::metropolis::DirectLight;
use luz_render::{MetropolisOverrides, Overrides};
use luz_sample::SamplerKind;
use luz_sample::statistics::Running;
use luz_sample::test_support::welch_test;
use std::path::PathBuf;

/// Replicas behind each reference.
const REPLICAS: f64 = 16.0;
/// Significance of a family of comparisons.
const SIGNIFICANCE: f64 = 0.01;
/// The share of pixels' comparisons that may fail.
const EXCUSED: f64 = 0.0025;
/// The share of tiles' comparisons that may fail.
const EXCUSED_TILES: f64 = 0.02;
const TILE: u32 = 16;

fn data() -> PathBuf {
    let path = std::env::var_os("LUZ_DATA").expect("LUZ_DATA must name the folder of scenes and references");
    // Tests run in the crate's folder; a relative path is meant from the workspace.
    let path = PathBuf::from(path);
    if path.is_absolute() { path } else { PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..").join(path) }
}

/// A mean with the variance of that mean and the degrees of freedom of the variance.
#[derive(Clone, Copy, Debug)]
struct Estimate {
    mean: f64,
    variance: f64,
    freedom: f64,
}

/// Mean, variance and count per pixel and channel.
struct Measured {
    width: u32,
    height: u32,
    estimates: Vec<[Estimate; 3]>,
}

impl Measured {
    fn reference(name: &str) -> Self {
        let read = |file: String| {
            let path = data().join("references").join(file);
            Image::read(&path).unwrap_or_else(|error| panic!("{error}"))
        };
        let (mean, variance) = (read(format!("{name}.exr")), read(format!("{name}.var.exr")));
        let channel = |image: &Image, wanted: &str| {
            image.channels().iter().position(|c| c == wanted).unwrap_or_else(|| panic!("{name} has no {wanted}"))
        };
        let stride = (mean.channels().len(), variance.channels().len());
        let places = ["R", "G", "B"].map(|c| (channel(&mean, c), channel(&variance, c)));
        let estimates = (0..mean.width() * mean.height())
            .map(|i| {
                places.map(|(m, v)| Estimate {
                    mean: f64::from(mean.data()[i * stride.0 + m]),
                    variance: f64::from(variance.data()[i * stride.1 + v]),
                    freedom: REPLICAS - 1.0,
                })
            })
            .collect();
        Self { width: mean.width() as u32, height: mean.height() as u32, estimates }
    }

    fn film(film: &Film) -> Self {
        let estimates = film
            .estimates()
            .map(|pixel| {
                let (mean, variance) = (pixel.mean, pixel.variance);
                let freedom = f64::from(pixel.count) - 1.0;
                std::array::from_fn(|c| Estimate { mean: mean[c], variance: variance[c], freedom })
            })
            .collect();
        Self { width: film.bounds().width(), height: film.bounds().height(), estimates }
    }

    /// The mean over all pixels.
    fn whole(&self, channel: usize) -> Estimate {
        self.over(0..self.width, 0..self.height, channel)
    }

    /// The means over all tiles, in each channel.
    fn tiles(&self) -> Vec<Estimate> {
        let ranges = |size: u32| (0..size.div_ceil(TILE)).map(move |i| i * TILE..((i + 1) * TILE).min(size));
        let rectangles = ranges(self.height).flat_map(|y| ranges(self.width).map(move |x| (x, y.clone())));
        rectangles.flat_map(|(x, y)| (0..3).map(move |c| self.over(x.clone(), y.clone(), c))).collect()
    }

    /// The mean over a rectangle of pixels.
    fn over(&self, x: std::ops::Range<u32>, y: std::ops::Range<u32>, channel: usize) -> Estimate {
        let pixels: Vec<Estimate> = y
            .flat_map(|y| x.clone().map(move |x| (x, y)))
            .map(|(x, y)| self.estimates[(y * self.width + x) as usize][channel])
            .collect();
        let n = pixels.len() as f64;
        let variance = pixels.iter().map(|p| p.variance).sum::<f64>();
        // Welch and Satterthwaite.
        let freedom = pixels.iter().map(|p| p.variance * p.variance / p.freedom).sum::<f64>();
        Estimate {
            mean: pixels.iter().map(|p| p.mean).sum::<f64>() / n,
            variance: variance / (n * n),
            freedom: if freedom > 0.0 { variance * variance / freedom } else { f64::INFINITY },
        }
    }
}

/// The probability of a difference as large as this between estimates of the same quantity.
fn p_value(a: Estimate, b: Estimate) -> f64 {
    // Where nothing is random, rounding remains.
    if (a.mean - b.mean).abs() <= 1e-5 * (a.mean.abs() + b.mean.abs()) {
        return 1.0;
    }
    welch_test((a.mean, a.variance, a.freedom), (b.mean, b.variance, b.freedom))
}

/// What a comparison found.
#[derive(Debug)]
struct Verdict {
    pixels: usize,
    pixels_failed: usize,
    tiles: usize,
    tiles_failed: usize,
    brightness_p: [f64; 3],
}

fn compare(reference: &Measured, ours: &Measured) -> Verdict {
    assert_eq!((reference.width, reference.height), (ours.width, ours.height));
    let failures = |p_values: Vec<f64>| {
        let each = 1.0 - (1.0 - SIGNIFICANCE).powf(1.0 / p_values.len() as f64);
        p_values.iter().filter(|p| **p < each).count()
    };
    let pixels = reference.estimates.iter().zip(&ours.estimates);
    let pixels_failed = failures(pixels.flat_map(|(r, o)| (0..3).map(move |c| p_value(r[c], o[c]))).collect());
    let tile_values: Vec<f64> = reference.tiles().iter().zip(ours.tiles()).map(|(r, o)| p_value(*r, o)).collect();
    Verdict {
        pixels: 3 * ours.estimates.len(),
        pixels_failed,
        tiles: tile_values.len(),
        tiles_failed: failures(tile_values),
        brightness_p: std::array::from_fn(|c| p_value(reference.whole(c), ours.whole(c))),
    }
}

/// How far the means over the whole picture lie apart, relatively.
fn brightness_off(reference: &Measured, ours: &Measured) -> [f64; 3] {
    std::array::from_fn(|c| ours.whole(c).mean / reference.whole(c).mean - 1.0)
}

/// Renders a scene at the reference's resolution; `change` edits the scene's text first.
fn rendered(
    scene: &str,
    reference: &Measured,
    (sampler, samples): (SamplerKind, u32),
    change: impl Fn(String) -> String,
) -> Measured {
    let path = data().join("scenes/pbrt").join(scene);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let changed = change(text.clone());
    let description = if changed == text {
        luz_scene::read(&path)
    } else {
        let folder = path.parent().expect("a scene lies in a folder");
        luz_scene::read_bytes("changed.pbrt", changed.into_bytes(), folder, &luz_scene::ReadOptions::default())
    };
    let (description, _) = description.unwrap_or_else(|errors| panic!("{errors}"));
    let mut wishes = overrides([reference.width, reference.height], samples);
    wishes.max_depth = Some(16);
    wishes.seed = Some(7);
    // The references have pbrt-v4's bias in rough coats.
    wishes.coat_weights = CoatWeights::PbrtV4;
    wishes.sampler = Some(sampler);
    let loaded = load_description(&description, &wishes);
    let mut renderer = Renderer::new(&loaded.world, &loaded.camera, &loaded.settings);
    renderer.finish();
    assert_eq!(renderer.film().dropped(), 0, "{scene} has samples that are not finite");
    Measured::film(renderer.film())
}

/// Independent samples, whose variance the film knows.
const INDEPENDENT: (SamplerKind, u32) = (SamplerKind::Independent, 512);
/// Stratified samples, which have less of it.
const STRATIFIED: (SamplerKind, u32) = (SamplerKind::Sobol, 512);

fn assert_agrees(scene: &str, name: &str) {
    let reference = Measured::reference(name);
    let verdict = compare(&reference, &rendered(scene, &reference, INDEPENDENT, |text| text));
    let brightness = brightness_off(&reference, &rendered(scene, &reference, STRATIFIED, |text| text));
    println!("{name}: {verdict:?}, stratified brightness off by {brightness:?}");
    assert!(verdict.pixels_failed as f64 <= EXCUSED * verdict.pixels as f64, "{name}: {verdict:?}");
    assert!(verdict.tiles_failed as f64 <= EXCUSED_TILES * verdict.tiles as f64, "{name}: {verdict:?}");
    for c in 0..3 {
        assert!(verdict.brightness_p[c] > SIGNIFICANCE / 3.0, "{name}: {verdict:?}");
        let own = reference.whole(c);
        let tolerance = 5e-3 + 2.0 * own.variance.sqrt() / own.mean;
        assert!(brightness[c].abs() < tolerance, "{name}: {brightness:?}");
    }
}

/// Seeds of those integrators whose neighbouring pixels hang together, by splats or chains: tiles' errors are those of means over
/// seeds.
const SEEDS: u64 = 12;

/// The means over tiles, and over the whole picture, in each channel.
fn means_by(kind: IntegratorKind, scene: &str, resolution: [u32; 2], samples: u32) -> Vec<Estimate> {
    let path = data().join("scenes/pbrt").join(scene);
    let (description, _) = luz_scene::read(&path).unwrap_or_else(|errors| panic!("{errors}"));
    let mut wishes = Overrides { integrator: Some(kind), max_depth: Some(16), ..overrides(resolution, samples) };
    if kind.is_metropolis() {
        wishes.metropolis = MetropolisOverrides {
            chains: Some(256),
            bootstrap_samples: Some(20_000),
            direct_light: Some(DirectLight::Inside),
            ..MetropolisOverrides::default()
        };
    } else {
        wishes.sampler = Some(SamplerKind::Independent);
    }
    let mut loaded = load_description(&description, &wishes);
    let mut means: Vec<Running> = Vec::new();
    for seed in 0..SEEDS {
        loaded.settings.seed = 100 + seed;
        let mut renderer = Renderer::new(&loaded.world, &loaded.camera, &loaded.settings);
        renderer.finish();
        assert_eq!(renderer.film().dropped(), 0, "{scene} has samples that are not finite");
        let measured = Measured::film(renderer.film());
        let whole = (0..3).map(|c| measured.whole(c));
        let all: Vec<Estimate> = measured.tiles().into_iter().chain(whole).collect();
        means.resize(all.len(), Running::default());
        means.iter_mut().zip(all).for_each(|(mean, estimate)| mean.push(estimate.mean));
    }
    let estimate = |m: &Running| Estimate {
        mean: m.mean(),
        variance: m.standard_error() * m.standard_error(),
        freedom: SEEDS as f64 - 1.0,
    };
    means.iter().map(estimate).collect()
}

/// How many tiles differ, of how many; and how probable the difference of whole pictures is, in the worst channel.
fn disagreement(a: &[Estimate], b: &[Estimate]) -> (usize, usize, f64) {
    let p: Vec<f64> = a.iter().zip(b).map(|(a, b)| p_value(*a, *b)).collect();
    let (tiles, whole) = p.split_at(p.len() - 3);
    let each = 1.0 - (1.0 - SIGNIFICANCE).powf(1.0 / tiles.len() as f64);
    let worst = whole.iter().copied().fold(1.0, f64::min);
    (tiles.iter().filter(|p| **p < each).count(), tiles.len(), worst)
}

/// The second and third family, at the same significance; the third sees what is too bright by the factor `visible`.
fn assert_means_agree(what: &str, reference: &[Estimate], ours: &[Estimate], visible: f64) {
    let (failed, tiles, worst) = disagreement(reference, ours);
    let brighter: Vec<Estimate> = ours
        .iter()
        .map(|e| Estimate { mean: visible * e.mean, variance: visible * visible * e.variance, ..*e })
        .collect();
    let wrong = disagreement(reference, &brighter);
    println!("{what}: {failed} of {tiles} tiles, brightness p {worst}; {visible} times as bright: {wrong:?}");
    assert!(failed as f64 <= EXCUSED_TILES * tiles as f64, "{what}: {failed} of {tiles} tiles");
    assert!(worst > SIGNIFICANCE / 3.0, "{what}: brightness, p = {worst}");
    assert!(wrong.2 < SIGNIFICANCE / 3.0, "{what}: {wrong:?}: the test must be able to fail");
}

fn assert_others_agree(scene: &str, name: &str) {
    let measured = Measured::reference(name);
    let whole = (0..3).map(|c| measured.whole(c));
    let reference: Vec<Estimate> = measured.tiles().into_iter().chain(whole).collect();
    for (kind, samples, visible) in [(IntegratorKind::Bidirectional, 16, 1.02), (IntegratorKind::PathSpace, 32, 1.05)] {
        let ours = means_by(kind, scene, [measured.width, measured.height], samples);
        assert_means_agree(&format!("{name}, {kind}"), &reference, &ours, visible);
    }
}

#[test]
fn others_on_cornell_box_specular() {
    assert_others_agree("cornell-box/cornell-box-specular.pbrt", "cornell-box-specular");
}

#[test]
fn others_on_killeroo_gold() {
    assert_others_agree("killeroos/killeroo-gold.pbrt", "killeroo-gold");
}

/// The caustic of a spot light through glass, which path tracing cannot find: there is no reference, but two integrators that can
/// must agree, on far more light than a third finds that cannot. Tiles of less than a hundredth of the mean brightness are left out: chains
/// come by there a few times in all seeds together, which makes no normal mean.
#[test]
fn others_find_the_caustic_of_a_point() {
    const SCENE: &str = "caustic-glass/caustic-glass-v4.pbrt";
    let [path, bdpt, mlt] =
        [(IntegratorKind::Path, 16), (IntegratorKind::Bidirectional, 64), (IntegratorKind::PathSpace, 512)]
            .map(|(kind, samples)| means_by(kind, SCENE, [70, 100], samples));
    let whole = bdpt.len() - 3;
    let judged: Vec<usize> = (0..bdpt.len()).filter(|&i| bdpt[i].mean > 0.01 * bdpt[whole + i % 3].mean).collect();
    assert!(judged.len() as f64 > 0.9 * bdpt.len() as f64, "{} of {}", judged.len(), bdpt.len());
    let [bdpt_there, mlt_there] =
        [&bdpt, &mlt].map(|means| judged.iter().map(|&i| means[i]).collect::<Vec<Estimate>>());
    assert_means_agree("caustic-glass, bdpt and mlt", &bdpt_there, &mlt_there, 1.05);
    let green = whole + 1;
    let (found, missed) = (bdpt[green], path[green]);
    println!("bdpt {found:?}, path {missed:?}");
    assert!(found.mean - missed.mean > 20.0 * (found.variance + missed.variance).sqrt(), "{found:?} {missed:?}");
}

#[test]
fn cornell_box() {
    assert_agrees("cornell-box/cornell-box.pbrt", "cornell-box");
}

#[test]
fn veach_mis() {
    assert_agrees("veach-mis/veach-mis.pbrt", "veach-mis");
}

#[test]
fn killeroo_simple() {
    assert_agrees("killeroos/killeroo-simple.pbrt", "killeroo-simple");
}

#[test]
fn killeroo_gold() {
    assert_agrees("killeroos/killeroo-gold.pbrt", "killeroo-gold");
}

#[test]
fn cornell_box_specular() {
    assert_agrees("cornell-box/cornell-box-specular.pbrt", "cornell-box-specular");
}

#[test]
fn smallpt() {
    assert_agrees("cornell-box/smallpt.pbrt", "smallpt");
}

/// The rule itself: walls that reflect 2 % more do not pass.
#[test]
fn a_two_percent_error_in_one_bsdf_is_found() {
    let brighter = |text: String| text.replace("0.73 0.73 0.73", "0.7446 0.7446 0.7446");
    let reference = Measured::reference("cornell-box");
    let ours = rendered("cornell-box/cornell-box.pbrt", &reference, INDEPENDENT, brighter);
    let verdict = compare(&reference, &ours);
    println!("2 % too much: {verdict:?}");
    assert!(verdict.tiles_failed as f64 > 10.0 * EXCUSED_TILES * verdict.tiles as f64, "{verdict:?}");
    assert!(verdict.brightness_p.iter().any(|p| *p < SIGNIFICANCE / 3.0), "{verdict:?}");
    assert!(brightness_off(&reference, &ours).iter().any(|off| off.abs() > 5e-3), "{verdict:?}");
}
