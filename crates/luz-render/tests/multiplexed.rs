//! Multiplexed Metropolis, and primary-space Metropolis over bidirectional path tracing, against path tracing.
//!
//! Chains of different seeds, candidates included, are independent replicates: differences are Student-t distributed with 15
//! degrees of freedom or more, of which 7 is exceeded with a probability of 4·10⁻⁶. Some 100 are looked at.

mod common;

use common::transport_scenes as scenes;
use common::{load, overrides, render};
use glam::Vec2;
use luz_color::Wavelengths;
use luz_render::integrator::metropolis::{
    ChainContext, ChainProcess, DirectLight, Importance, Multiplexed, MutationStatistics, PrimarySpace,
};
use luz_render::integrator::{Integrator, IntegratorKind, PathEvent, PathObserver};
use luz_render::world::Loaded;
use luz_render::{MetropolisOverrides, Overrides, RenderCost, Renderer};
use luz_sample::markov::Bootstrap;
use luz_sample::random::Random;
use luz_sample::statistics::Running;

/// Replicates of chains.
const REPLICATES: u64 = 16;
/// Differences are smaller, in standard errors.
const LIMIT: f64 = 7.0;
/// Chains of a replicate, and how many mutations each makes.
const CHAINS: u64 = 256;
const STEPS: u64 = 40;

/// What is compared: the mean of the film by the number of scatterings; and that of its four quarters, whatever that number.
#[derive(Clone)]
struct Means {
    lengths: Vec<Running>,
    quarters: [Running; 4],
}

/// The same of one replicate or path.
#[derive(Clone, Default)]
struct Sums {
    lengths: Vec<f64>,
    quarters: [f64; 4],
}

impl Sums {
    fn new(lengths: usize) -> Self {
        Self { lengths: vec![0.0; lengths], quarters: [0.0; 4] }
    }

    fn add(&mut self, length: usize, film: Vec2, size: Vec2, value: f64) {
        let place = film / size;
        self.lengths[length] += value;
        self.quarters[usize::from(place.x >= 0.5) + 2 * usize::from(place.y >= 0.5)] += value;
    }
}

impl Means {
    fn new(lengths: usize) -> Self {
        Self { lengths: vec![Running::default(); lengths], quarters: [Running::default(); 4] }
    }

    fn push(&mut self, sums: &Sums, scale: f64) {
        self.lengths.iter_mut().zip(&sums.lengths).for_each(|(mean, sum)| mean.push(sum * scale));
        self.quarters.iter_mut().zip(&sums.quarters).for_each(|(mean, sum)| mean.push(sum * scale));
    }

    /// Differences in standard errors, where there is any light; `scale` is what others' means are multiplied by.
    fn differences(&self, others: &Self, scale: f64) -> Vec<f64> {
        let ours = self.lengths.iter().chain(&self.quarters);
        let theirs = others.lengths.iter().chain(&others.quarters);
        ours.zip(theirs)
            .map(|(a, b)| {
                let (difference, error) = (a.mean() - b.mean() * scale, a.standard_error().hypot(b.standard_error()));
                if difference == 0.0 { 0.0 } else { difference / error }
            })
            .collect()
    }
}

fn largest(differences: &[f64]) -> f64 {
    differences.iter().fold(0.0, |most: f64, z| if z.abs() <= most { most } else { z.abs() })
}

fn loaded(text: &str, wishes: &MetropolisOverrides, kind: IntegratorKind) -> Loaded {
    load(text, &Overrides { integrator: Some(kind), metropolis: *wishes, ..overrides([20, 20], 96) })
}

fn size(loaded: &Loaded) -> Vec2 {
    let bounds = loaded.settings.bounds;
    Vec2::new(bounds.width() as f32, bounds.height() as f32)
}

fn grey(rgb: [f32; 3]) -> f64 {
    rgb.iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0
}

/// Light of a path, by the number of its scatterings.
struct ByLength<'a> {
    loaded: &'a Loaded,
    film: Vec2,
    sums: Sums,
}

impl PathObserver for ByLength<'_> {
    fn wants_vertex(&self) -> bool {
        false
    }

    fn observe(&mut self, event: PathEvent<'_>, wavelengths: &Wavelengths) {
        if let PathEvent::Light(light) = event {
            let rgb = self.loaded.settings.sensor.to_output_rgb(light.alone * light.weight, wavelengths);
            self.sums.add(light.depth as usize, self.film, size(self.loaded), grey(rgb));
        }
    }
}

/// The means by path tracing.
fn by_path_tracing(text: &str, is_by_length: bool) -> Means {
    let loaded = loaded(text, &MetropolisOverrides::default(), IntegratorKind::Path);
    let Loaded { world, camera, settings, .. } = &loaded;
    let renderer = Renderer::new(world, camera, settings);
    let lengths = settings.integrator.max_depth() as usize + 1;
    let mut means = Means::new(if is_by_length { lengths } else { 1 });
    for sample in 0..settings.samples_per_pixel {
        // One sample of each pixel makes a picture.
        let mut picture = ByLength { loaded: &loaded, film: Vec2::ZERO, sums: Sums::new(lengths) };
        for y in 0..20 {
            for x in 0..20 {
                picture.film = Vec2::new(x as f32, y as f32) + 0.5;
                renderer.trace([x, y], 0, sample, &mut picture).expect("path tracing traces paths");
            }
        }
        if !is_by_length {
            picture.sums.lengths = vec![picture.sums.lengths.iter().sum()];
        }
        means.push(&picture.sums, 1.0 / 400.0);
    }
    means
}

/// A replicate: candidates, chains that begin at some of them, and where these go.
fn replicate<P: ChainProcess>(process: &P, loaded: &Loaded, seed: u64) -> Sums {
    let importance = Importance::uniform(loaded.settings.film_window());
    let (mut scratch, mut cost) = (process.scratch(), RenderCost::default());
    let mut statistics = MutationStatistics::new(process.mutations().len());
    let each = (process.candidates() / process.strata()) as usize;
    let weights: Vec<f64> = (0..process.candidates())
        .map(|number| process.candidate(number, 0, &importance, &mut scratch, &mut |_, _| (), &mut cost))
        .collect();
    let strata: Vec<f64> = weights.chunks(each).map(|c| c.iter().sum::<f64>() / weights.len() as f64).collect();
    let bootstrap: Bootstrap = weights.into_iter().collect();
    let normalization = bootstrap.normalization();
    let context = ChainContext { normalization, importance: &importance };
    let mut sums = Sums::new(strata.len());
    // Rare lengths have a chain in some replicates only.
    let u = Random::new(seed, 0, 0).next_f64();
    for number in 0..CHAINS {
        let candidate = bootstrap.start(number, CHAINS, u).expect("there is light");
        let stratum = candidate / each;
        let chain = process.begin(number, candidate as u64, context, strata[stratum], &mut scratch, &mut cost);
        let mut splat = |film: Vec2, rgb: [f32; 3], weight: f64| {
            sums.add(stratum, film, size(loaded), grey(rgb) * weight * normalization / (CHAINS * STEPS) as f64);
        };
        let mut chain = chain.expect("a candidate that was chosen is where a chain can begin");
        process.advance(&mut chain, STEPS, context, &mut scratch, &mut splat, &mut statistics, &mut cost);
    }
    sums
}

/// The means by chains.
fn by_chains(loaded: &Loaded) -> Means {
    let mut means = None;
    for seed in 0..REPLICATES {
        let mut settings = loaded.settings.clone();
        settings.seed = 300 + seed;
        let Loaded { world, camera, .. } = loaded;
        let sums = match settings.integrator {
            Integrator::Multiplexed(options) => {
                replicate(&Multiplexed::new(world, camera, &settings, options), loaded, seed)
            }
            Integrator::PrimarySpace(options) => {
                replicate(&PrimarySpace::new(world, camera, &settings, options), loaded, seed)
            }
            _ => panic!("of these alone is asked"),
        };
        means.get_or_insert_with(|| Means::new(sums.lengths.len())).push(&sums, 1.0 / 400.0);
    }
    means.expect("there are replicates")
}

/// Fewer candidates than for a picture: that their number is small must not show.
fn few() -> MetropolisOverrides {
    MetropolisOverrides { bootstrap_samples: Some(1500), direct_light: Some(DirectLight::Inside), ..Default::default() }
}

#[test]
fn multiplexed_chains_find_the_light_of_every_length() {
    let mut all = Vec::new();
    for text in [
        scenes::diffuse_box(),
        scenes::all_lights(),
        scenes::specular(),
        scenes::dispersion(),
        scenes::passed_through(),
        scenes::thin_lens(),
    ] {
        let expected = by_path_tracing(&text, true);
        let found = by_chains(&loaded(&text, &few(), IntegratorKind::Multiplexed));
        let differences = found.differences(&expected, 1.0);
        println!("{differences:.1?}");
        assert!(largest(&differences) < LIMIT, "{differences:?}\n{text}");
        all.push(largest(&found.differences(&expected, 1.2)));
    }
    // The test must be able to fail: a picture too dark by a sixth is noticed in most scenes.
    assert!(all.iter().filter(|z| **z > LIMIT).count() > 3, "{all:?}");
}

#[test]
fn chains_over_bidirectional_path_tracing_find_the_light() {
    let wishes = MetropolisOverrides { estimator: "bdpt".parse().ok(), ..few() };
    let mut all = Vec::new();
    for text in [scenes::diffuse_box(), scenes::all_lights(), scenes::specular(), scenes::dispersion()] {
        let expected = by_path_tracing(&text, false);
        let found = by_chains(&loaded(&text, &wishes, IntegratorKind::PrimarySpace));
        let differences = found.differences(&expected, 1.0);
        println!("{differences:.1?}");
        assert!(largest(&differences) < LIMIT, "{differences:?}\n{text}");
        all.push(largest(&found.differences(&expected, 1.2)));
    }
    assert!(all.iter().filter(|z| **z > LIMIT).count() > 2, "{all:?}");
}

/// Means of whole pictures, by the engine, of independent seeds.
fn pictures(text: &str, wishes: &Overrides, seeds: std::ops::Range<u64>) -> Running {
    let mut loaded = load(text, wishes);
    let mut means = Running::default();
    for seed in seeds {
        loaded.settings.seed = seed;
        let film = render(&loaded);
        assert_eq!(film.dropped(), 0);
        let pixels = film.estimates().len() as f64;
        means.push(film.estimates().map(|p| p.mean.iter().sum::<f64>() / 3.0).sum::<f64>() / pixels);
    }
    means
}

/// Neither the number of candidates nor seeds make a difference, and neither does it who finds direct light.
#[test]
fn bootstrap_and_direct_light_make_no_difference() {
    let text = scenes::all_lights();
    let plain = overrides([20, 20], 32);
    let expected = pictures(&text, &plain, 0..16);
    for (kind, estimator) in [(IntegratorKind::Multiplexed, None), (IntegratorKind::PrimarySpace, "bdpt".parse().ok())]
    {
        for (bootstrap_samples, direct_light, two_stage) in
            [(500, DirectLight::Inside, false), (4000, DirectLight::Inside, false), (2000, DirectLight::Separate, true)]
        {
            let metropolis = MetropolisOverrides {
                chains: Some(64),
                bootstrap_samples: Some(bootstrap_samples),
                direct_light: Some(direct_light),
                two_stage,
                estimator,
                ..Default::default()
            };
            let wishes = Overrides { integrator: Some(kind), metropolis, ..plain.clone() };
            let found = pictures(&text, &wishes, bootstrap_samples..bootstrap_samples + 16);
            let error = found.standard_error().hypot(expected.standard_error());
            let z = (found.mean() - expected.mean()) / error;
            println!("{kind} {bootstrap_samples} {z:.1} ± {:.1} %", 100.0 * error / expected.mean());
            assert!(z.abs() < LIMIT, "{kind} {metropolis:?}: {z}");
            assert!(error < 0.03 * expected.mean(), "{kind}: {error} knows too little");
        }
    }
}

/// Where all paths are too short for the chains, the rest of the picture is there.
#[test]
fn there_may_be_no_length_for_chains() {
    let text = scenes::diffuse_box();
    let plain = Overrides { max_depth: Some(1), ..overrides([20, 20], 16) };
    let direct_light = Some(DirectLight::Separate);
    let metropolis = MetropolisOverrides { bootstrap_samples: Some(100), direct_light, ..Default::default() };
    let wishes = Overrides { integrator: Some(IntegratorKind::Multiplexed), metropolis, ..plain.clone() };
    let (expected, found) = (pictures(&text, &plain, 0..16), pictures(&text, &wishes, 16..32));
    let error = found.standard_error().hypot(expected.standard_error());
    let difference = found.mean() - expected.mean();
    assert!(difference.abs() < LIMIT * error && error < 0.03 * expected.mean(), "{difference} ± {error}");
}
