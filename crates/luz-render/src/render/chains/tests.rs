//! A process whose picture is known: light as a function of the film position alone.

use super::*;
use crate::film::{Filter, FilterKind, PixelBounds};
use crate::integrator::Integrator;
use crate::integrator::metropolis::StepWatch;
use crate::integrator::metropolis::{DirectLight, PrimarySpaceIntegrator, scalar_contribution};
use crate::settings::Overrides;
use crate::world::build;
use glam::Vec2;
use luz_geometry::SimdLevel;
use luz_sample::Samples;
use luz_sample::markov::{Chain, Proposal};
use luz_sample::random::Random;
use luz_scene::Diagnostics;

const SEED: u64 = 4;

/// What is to go wrong.
#[derive(Clone, Copy, PartialEq)]
enum Fault {
    None,
    /// The chains take b for larger than it is.
    WrongNormalization,
    /// States are not splatted where they are left with a probability below one half.
    NoExpectedValues,
    /// The first image is taken for something else when colours are scaled.
    ForgottenImportance,
    /// One chain fails.
    Panic,
    /// There is no light.
    Dark,
}

/// Chains over film positions.
struct Toy {
    window: FilmWindow,
    candidates: u64,
    fault: Fault,
}

/// The radiance at a film position: a bright spot on a slope, and a dark left side.
fn radiance(film: Vec2) -> [f32; 3] {
    if film.x < 2.0 {
        return [0.01, 0.02, 0.0];
    }
    let spot = if film.distance(Vec2::new(5.5, 3.0)) < 1.2 { 20.0 } else { 0.0 };
    [film.x + spot, 1.0, film.y * 0.5 + 0.25 * spot]
}

impl Toy {
    fn density(&self, film: Vec2, importance: &Importance) -> f64 {
        if self.fault == Fault::Dark || !self.window.contains(film) {
            return 0.0;
        }
        scalar_contribution(radiance(film)) / importance.at(film)
    }

    fn position(&self, number: u64, stage: u64) -> Vec2 {
        self.window.at(Random::new(SEED + 100 + stage, number, 0).next_2d())
    }
}

impl ChainProcess for Toy {
    type Chain = Chain<[f32; 2]>;
    type Scratch = [f32; 2];

    fn scratch(&self) -> [f32; 2] {
        [0.0; 2]
    }

    fn mutations(&self) -> &'static [&'static str] {
        &["move"]
    }

    fn candidates(&self) -> u64 {
        self.candidates
    }

    fn candidate(
        &self,
        number: u64,
        stage: u64,
        importance: &Importance,
        _: &mut [f32; 2],
        splat: &mut impl FnMut(Vec2, f64),
        cost: &mut RenderCost,
    ) -> f64 {
        cost.paths += 1;
        let film = self.position(number, stage);
        let weight = self.density(film, importance) * f64::from(self.window.area());
        splat(film, weight);
        weight
    }

    fn begin(
        &self,
        chain: u64,
        candidate: u64,
        context: ChainContext<'_>,
        _: f64,
        _: &mut [f32; 2],
        _: &mut RenderCost,
    ) -> Option<Chain<[f32; 2]>> {
        let film = self.position(candidate, 0);
        Some(Chain::new(SEED, chain, film.to_array(), self.density(film, context.importance)))
    }

    fn advance(
        &self,
        chain: &mut Chain<[f32; 2]>,
        steps: u64,
        context: ChainContext<'_>,
        spare: &mut [f32; 2],
        splat: &mut impl FnMut(Vec2, [f32; 3], f64),
        statistics: &mut MutationStatistics,
        cost: &mut RenderCost,
    ) {
        for _ in 0..steps {
            let watch = StepWatch::start(chain.steps(), cost);
            cost.paths += 1;
            assert!(self.fault != Fault::Panic || chain.number() != 3 || chain.steps() != 20, "as it should");
            let step = chain.step(spare, |current, proposed, random| {
                let length = 4.0 * (random.next_f64() as f32 - 0.5);
                let film = Vec2::from_array(*current) + Vec2::from_angle(random.next_f64() as f32 * 7.0) * length;
                *proposed = film.to_array();
                Some(Proposal::symmetric(self.density(film, context.importance)))
            });
            for (state, weight) in [(step.current, step.current_weight), (step.proposed, step.proposed_weight)] {
                let film = Vec2::from_array(*state);
                let importance = match self.fault {
                    Fault::ForgottenImportance => 1.0,
                    _ => context.importance.at(film),
                };
                let density = scalar_contribution(radiance(film)) / importance;
                let scale = if self.fault == Fault::WrongNormalization { 1.1 } else { 1.0 };
                if weight > 0.0 && !(self.fault == Fault::NoExpectedValues && weight < 0.5) {
                    splat(film, radiance(film).map(|v| (f64::from(v) / density) as f32), weight / scale);
                }
            }
            statistics.record(0, step.outcome, step.proposed_weight, &watch, cost);
        }
    }

    fn longest_stay(&self, chain: &Chain<[f32; 2]>) -> u64 {
        chain.longest_stay()
    }

    fn save(&self, chain: &Chain<[f32; 2]>, out: &mut Vec<u8>) {
        out.extend(postcard::to_allocvec(chain).expect("it has a form"));
    }

    fn restore(&self, bytes: &[u8]) -> Option<Chain<[f32; 2]>> {
        postcard::from_bytes(bytes).ok()
    }
}

const BOUNDS: PixelBounds = PixelBounds { x0: 0, y0: 0, x1: 8, y1: 6 };

fn settings(filter: Filter, metropolis: Metropolis) -> Settings {
    let (description, _) = luz_scene::read_str("x.pbrt", "WorldBegin").expect("it can be read");
    let wishes = Overrides { resolution: Some([8, 6]), filter: Some(filter), ..Overrides::default() };
    let loaded = build(&description, &wishes, SimdLevel::Auto, &mut Diagnostics::default()).expect("it can be built");
    let integrator = Integrator::PrimarySpace(PrimarySpaceIntegrator {
        max_depth: 1,
        metropolis,
        estimator: Default::default(),
        large_step_probability: 0.3,
        kernel: Default::default(),
    });
    Settings { integrator, ..loaded.settings }
}

const METROPOLIS: Metropolis = Metropolis {
    chains: 512,
    bootstrap_samples: 20_000,
    batches: 256,
    direct_light: DirectLight::Inside,
    two_stage: false,
};

struct Done {
    film: Film,
    report: ChainReport,
    incidents: Incidents,
}

fn run(settings: &Settings, fault: Fault, rounds: u32) -> Done {
    let candidates = settings.integrator.metropolis().map_or(0, |m| m.bootstrap_samples);
    let toy = Toy { window: settings.film_window(), candidates, fault };
    let mut chains = ChainRounds::new(toy, settings);
    let mut film = Film::new(settings.film_contents(), settings.bounds);
    let (mut cost, mut incidents) = (RenderCost::default(), Incidents::default());
    chains.prepare(0..chains.preparation_rounds(), &mut film, &mut cost, &mut incidents);
    chains.advance(0..rounds, &mut film, &mut cost, &mut incidents);
    Done { film, report: chains.report(), incidents }
}

/// The pixels' values by quadrature.
fn expected(settings: &Settings) -> Vec<[f64; 3]> {
    const STEPS: usize = 64;
    let footprint = Footprint::new(&settings.filter, BOUNDS);
    let window = settings.film_window();
    let mut pixels = vec![[0.0; 3]; BOUNDS.area()];
    let [columns, rows] = window.size().to_array().map(|size| (size.ceil() as usize) * STEPS);
    let area = f64::from(window.area()) / (columns * rows) as f64;
    for y in 0..rows {
        for x in 0..columns {
            let u = (Vec2::new(x as f32, y as f32) + 0.5) / Vec2::new(columns as f32, rows as f32);
            let film = window.at(u);
            let rgb = radiance(film);
            footprint.spread(film, |pixel, weight| {
                pixels[pixel].iter_mut().zip(rgb).for_each(|(sum, v)| *sum += f64::from(v) * weight * area);
            });
        }
    }
    pixels
}

/// (Σz² − n)/√(2n) over the channels of all pixels, with the film's own variances.
fn z_of_squares(film: &Film, expected: &[[f64; 3]]) -> f64 {
    let squares: Vec<f64> = film
        .estimates()
        .zip(expected)
        .flat_map(|(pixel, expected)| {
            (0..3)
                .filter(move |&c| expected[c] > 0.0)
                .map(move |c| (pixel.mean[c] - expected[c]).powi(2) / pixel.variance[c])
        })
        .collect();
    let n = squares.len() as f64;
    (squares.iter().sum::<f64>() - n) / (2.0 * n).sqrt()
}

/// At 144 values that hang together (channels, neighbours through chains), |z| < 6 is no rare event; every fault gives more than 8.
#[test]
fn chains_make_the_picture() {
    let filters = [Filter::unit_box(), Filter::new(FilterKind::Gaussian { sigma: 0.5 }, Vec2::splat(1.5))];
    for filter in filters {
        for two_stage in [false, true] {
            let settings = settings(filter.clone(), Metropolis { two_stage, ..METROPOLIS });
            let expected = expected(&settings);
            let done = run(&settings, Fault::None, 16_000);
            let z = z_of_squares(&done.film, &expected);
            assert!(z.abs() < 6.0, "{z} {:?} {two_stage}", filter.kind());
            assert!(done.incidents.is_empty());
            let mut faults = vec![Fault::WrongNormalization, Fault::NoExpectedValues];
            if two_stage {
                faults.push(Fault::ForgottenImportance);
            }
            for fault in faults {
                let z = z_of_squares(&run(&settings, fault, 16_000).film, &expected);
                assert!(z > 8.0, "{z}: the test must be able to fail");
            }
        }
    }
}

/// Over 60 seeds of candidates, here bootstrap sizes, b is right within its own error: χ² at a significance of 10⁻⁴.
#[test]
fn the_normalization_knows_its_error() {
    let mut squares = 0.0;
    const RUNS: u32 = 60;
    let exact = {
        let settings = settings(Filter::unit_box(), METROPOLIS);
        expected(&settings).iter().flatten().sum::<f64>() / 3.0
    };
    for i in 0..RUNS {
        let samples = 500 + 40 * u64::from(i);
        let settings = settings(Filter::unit_box(), Metropolis { bootstrap_samples: samples, ..METROPOLIS });
        let mut film = Film::new(settings.film_contents(), settings.bounds);
        let toy = Toy { window: settings.film_window(), candidates: samples, fault: Fault::None };
        let mut chains = ChainRounds::new(toy, &settings);
        let rounds = chains.preparation_rounds();
        chains.prepare(0..rounds, &mut film, &mut RenderCost::default(), &mut Incidents::default());
        let Normalization { value, standard_error } = chains.report().normalization;
        squares += ((value - exact) / standard_error).powi(2);
    }
    // All bootstraps begin with the same candidates: far fewer than sixty are independent.
    assert!(squares < 4.0 * f64::from(RUNS), "{squares}");
}

/// The dark side is known better.
#[test]
fn two_stages_look_into_the_dark() {
    let dark_error = |two_stage| {
        let settings = settings(Filter::unit_box(), Metropolis { two_stage, ..METROPOLIS });
        let film = run(&settings, Fault::None, 2000).film;
        let first = film.estimates().next().expect("there are pixels");
        first.variance[1].sqrt() / first.mean[1]
    };
    let (one, two) = (dark_error(false), dark_error(true));
    assert!(two < 0.5 * one, "{one} {two}");
}

#[test]
fn a_scene_without_light_is_black_and_said_to_be() {
    let settings = settings(Filter::unit_box(), METROPOLIS);
    let done = run(&settings, Fault::Dark, 10);
    assert!(done.report.is_dark);
    assert_eq!(done.report.normalization.value, 0.0);
    assert!(done.film.estimates().all(|pixel| pixel.mean == [0.0; 3]));
}

#[test]
fn a_chain_that_fails_is_lost_alone() {
    let settings = settings(Filter::unit_box(), METROPOLIS);
    let done = run(&settings, Fault::Panic, 2000);
    assert_eq!((done.incidents.panics, done.report.lost_chains), (1, 1));
    assert!(done.film.relative_error() < 0.2);
}

#[test]
fn mutations_are_dealt_out_evenly() {
    let settings = settings(Filter::unit_box(), Metropolis { chains: 100, batches: 16, ..METROPOLIS });
    let toy = Toy { window: settings.film_window(), candidates: 1, fault: Fault::None };
    let chains = ChainRounds::new(toy, &settings);
    for rounds in [0, 1, 2, 3, 100] {
        let steps: Vec<u64> = (0..100).map(|chain| chains.steps(chain, rounds)).collect();
        assert_eq!(steps.iter().sum::<u64>(), 48 * u64::from(rounds));
        assert!(steps.iter().max() <= steps.iter().min().map(|m| m + 1).as_ref());
    }
}
