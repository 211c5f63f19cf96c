//! Rounds of samples of pixels: each round gives every pixel that is still sampled one sample, or one in each of its halves.

use super::adaptive::SampleLimits;
use super::cost::RenderCost;
use super::incident::{Failure, Incident, Incidents, panic_message};
use super::optimal::{self, OptimalDirect};
use super::sample::{PathSampler, PixelSampler, Place, Row};
use super::shard::Shard;
use super::splatting::{SplattingEstimator, SplattingSampler, Spread, WithMemory};
use crate::camera::Camera;
use crate::film::{Film, Footprint, PixelBounds};
use crate::integrator::efficiency::{EfficiencyGuide, Findings, PixelRecord};
use crate::integrator::{PathIntegrator, PixelEstimator, Technique};
use crate::settings::Settings;
use crate::world::World;
use luz_sample::mis::Heuristic;
use luz_sample::random::hash;
use luz_sample::roulette::Roulette;
use luz_sample::{Sampler, SamplerConfig};
use rayon::prelude::*;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Who estimates pixels.
pub(super) enum Estimator<'a> {
    /// A path tracer.
    Path(PathIntegrator),
    /// An estimator that splats.
    Splatting(Box<dyn SplattingEstimator + 'a>),
}

impl<'a> Estimator<'a> {
    /// An estimator that splats.
    pub fn splatting<E: PixelEstimator + Send + 'a>(estimator: E) -> Self {
        Self::Splatting(Box::new(WithMemory::new(estimator)))
    }

    /// The settings of a path tracer, with all that only it can do.
    fn path(&self) -> Option<&PathIntegrator> {
        if let Self::Path(path) = self { Some(path) } else { None }
    }
}

/// What samples of pixels have decided and learned; what they have measured is in the film.
pub(super) struct PixelRounds<'a> {
    world: &'a World,
    camera: &'a Camera,
    settings: &'a Settings,
    estimator: Estimator<'a>,
    /// How splats are spread.
    footprint: Footprint,
    /// One for each half of the pixels.
    pub samplers: Vec<Sampler>,
    /// What each pixel, or each of its halves, has learned of its direct light, where that is wanted.
    pub optimal: Vec<OptimalDirect>,
    /// What has been learned of how often paths should go on, where that is wanted, and what it knows of each pixel.
    pub guide: Option<EfficiencyGuide>,
    pub pixel_records: Vec<PixelRecord>,
    pub limits: SampleLimits,
    /// The pixels to be rendered, in each row of the film: all, or those of the shard.
    columns: Vec<Vec<Range<usize>>>,
}

/// What the rows of a pass have cost and found.
#[derive(Default)]
pub(super) struct RowResult {
    pub cost: RenderCost,
    pub incidents: Incidents,
    pub findings: Findings,
}

impl<'a> PixelRounds<'a> {
    /// No sample is done.
    pub fn new(estimator: Estimator<'a>, world: &'a World, camera: &'a Camera, settings: &'a Settings) -> Self {
        let contents = settings.film_contents();
        let path = estimator.path();
        let (center, radius) = world.bounding_sphere();
        let by_efficiency = path.is_some_and(|path| path.roulette == Roulette::Efficiency);
        let guide = by_efficiency.then(|| EfficiencyGuide::new(center, radius));
        let is_optimal =
            path.is_some_and(|path| path.heuristic == Heuristic::Optimal && path.technique == Technique::Both);
        let buffers = contents.buffers() as u32;
        let samplers = (0..contents.buffers() as u64)
            .map(|half| {
                let config = SamplerConfig {
                    samples_per_pixel: settings.samples_per_pixel.div_ceil(buffers),
                    resolution: settings.resolution,
                    seed: if half == 0 { settings.seed } else { hash(settings.seed, half, 0, 0) },
                };
                Sampler::new(settings.sampler, config)
            })
            .collect();
        let area = settings.bounds.area();
        Self {
            world,
            camera,
            settings,
            estimator,
            footprint: Footprint::new(&settings.filter, settings.bounds),
            samplers,
            optimal: vec![optimal::estimator(); if is_optimal { area * contents.buffers() } else { 0 }],
            pixel_records: vec![PixelRecord::default(); if guide.is_some() { area } else { 0 }],
            guide,
            limits: SampleLimits::new(settings.adaptive, settings.sample_limit.div_ceil(buffers)),
            columns: columns(Shard::WHOLE, settings.bounds),
        }
    }

    /// Lets only the pixels of a shard be sampled.
    pub fn set_shard(&mut self, shard: Shard) {
        self.columns = columns(shard, self.settings.bounds);
    }

    /// How many rounds may follow before something is decided or learned from all that is known by then.
    pub fn rounds_until_decision(&self, done: u32) -> u32 {
        let of_limits = self.limits.rounds_until_decision(done);
        self.guide.as_ref().map_or(of_limits, |guide| of_limits.min(guide.epoch_end().saturating_sub(done)))
    }

    /// A path tracer's samples; `None` where something else estimates pixels.
    pub fn path_sampler(&self) -> Option<PathSampler<'_>> {
        let path = self.estimator.path()?;
        Some(PathSampler::new(path, self.world, self.camera, self.settings, &self.samplers))
    }

    /// Does rounds between which nothing is decided.
    pub fn pass(&mut self, rounds: Range<u32>, film: &mut Film, cost: &mut RenderCost, incidents: &mut Incidents) {
        // (Taken out, so that it can be lent while its neighbours are written to.)
        let mut optimal = std::mem::take(&mut self.optimal);
        let mut records = std::mem::take(&mut self.pixel_records);
        let done = match &self.estimator {
            Estimator::Path(path) => {
                let sampler = PathSampler::new(path, self.world, self.camera, self.settings, &self.samplers);
                self.sample_rows(&sampler, rounds.clone(), film, &mut optimal, &mut records)
            }
            Estimator::Splatting(estimator) => {
                let Self { settings, samplers, footprint, .. } = &*self;
                let sampler = SplattingSampler { estimator: &**estimator, settings, samplers, footprint };
                self.sample_rows(&sampler, rounds.clone(), film, &mut optimal, &mut records)
            }
        };
        (self.optimal, self.pixel_records) = (optimal, records);
        if let Some(splats) = film.splats_mut() {
            splats.count_paths(done.iter().map(|result| result.cost.paths).sum());
        }
        for result in done {
            if let Some(guide) = &mut self.guide {
                guide.take(&result.findings);
            }
            cost.add(&result.cost);
            incidents.merge(result.incidents);
        }
        self.limits.decide(rounds.end, film);
        if let Some(guide) = &mut self.guide
            && rounds.end >= guide.epoch_end()
        {
            guide.learn(rounds.end, &mut self.pixel_records, self.settings.bounds.width() as usize);
        }
    }

    fn sample_rows(
        &self,
        sampler: &impl PixelSampler,
        rounds: Range<u32>,
        film: &mut Film,
        optimal: &mut [OptimalDirect],
        records: &mut [PixelRecord],
    ) -> Vec<RowResult> {
        let width = self.settings.bounds.width() as usize;
        let mut optimal = optimal.chunks_exact_mut((width * self.samplers.len()).max(1));
        let mut records = records.chunks_exact_mut(width.max(1));
        let (rows, splats) = film.rows_and_splats_mut();
        let rows: Vec<Row<'_>> = rows
            .into_iter()
            .map(|film| Row {
                film,
                splats,
                optimal: optimal.next().unwrap_or_default(),
                records: records.next().unwrap_or_default(),
                guide: self.guide.as_ref(),
                spread: Spread::default(),
                result: RowResult::default(),
            })
            .collect();
        let sample_row = |(number, mut row): (usize, Row<'_>)| {
            for column in self.columns[number].iter().cloned().flatten() {
                self.sample_pixel(sampler, rounds.clone(), &mut row, [column, number]);
            }
            row.result
        };
        rows.into_par_iter().enumerate().map(sample_row).collect()
    }

    /// The samples of one pixel, at a place in the film, in their order.
    fn sample_pixel(
        &self,
        sampler: &impl PixelSampler,
        rounds: Range<u32>,
        row: &mut Row<'_>,
        [column, number]: [usize; 2],
    ) {
        let bounds = self.settings.bounds;
        let pixel = [bounds.x0 + column as u32, bounds.y0 + number as u32];
        let index = number * bounds.width() as usize + column;
        for half in 0..self.samplers.len() {
            for sample in rounds.start..rounds.end.min(self.limits.of(index, half)) {
                let place = Place { pixel, half, sample, column };
                let went = catch_unwind(AssertUnwindSafe(|| sampler.sample(place, row)));
                let failure = match went {
                    Ok(true) => continue,
                    Ok(false) => Failure::NotFinite,
                    // One sample lost is better than all: it is reported, and counts as black.
                    Err(payload) => {
                        row.film.add(column, half, [f32::NAN; 3], 1.0);
                        Failure::Panic(panic_message(&*payload))
                    }
                };
                row.result.incidents.push(Incident { pixel, half: half as u32, sample, failure });
            }
        }
    }
}

/// The pixels of a shard in each row of the film.
fn columns(shard: Shard, bounds: PixelBounds) -> Vec<Vec<Range<usize>>> {
    let width = bounds.width() as usize;
    let mut rows = vec![Vec::new(); bounds.height() as usize];
    for run in shard.runs(bounds) {
        let mut start = run.start;
        // A run may go on in the next row.
        while start < run.end {
            let row = start / width;
            let end = run.end.min((row + 1) * width);
            rows[row].push(start - row * width..end - row * width);
            start = end;
        }
    }
    rows
}
