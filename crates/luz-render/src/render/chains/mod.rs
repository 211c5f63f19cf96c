//! Rounds of Markov chains: candidates first, then chains that begin at some of them, and advance.
//!
//! A round is one mutation for each pixel on average: mutation `m` of the picture is the next one of chain `m mod C`, so that how many
//! mutations a chain has made is a function of the number of rounds alone. Chain `c` belongs to batch `c mod K`, and to shard
//! `c mod N`.

use crate::film::{Film, FilmWindow, Footprint, Normalization, SplatSums};
use crate::integrator::metropolis::{
    ChainContext, ChainProcess, Importance, Metropolis, MutationRecord, MutationStatistics, cell_at,
};
use crate::render::cost::RenderCost;
use crate::render::incident::Incidents;
use crate::render::shard::Shard;
use crate::settings::Settings;
use luz_sample::markov::{Bootstrap, Outcome};
use luz_sample::random::{hash, unit_f64};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Candidates of a round of preparation.
const CANDIDATES: u64 = 1024;
/// Candidates for each cell of the first image, on average, so that its noise stays small.
const CANDIDATES_PER_CELL: u64 = 48;
/// A cell of the first image is at least so many pixels wide.
const CELL_WIDTH: f32 = 1.0;
/// A chain that has not moved for more mutations than this is called stuck: large steps or bidirectional mutations come so often
/// that only a state which is far brighter than it should be can keep it.
const STUCK: u64 = 1000;
/// The stream of the number by which candidates are chosen for the chains.
const START_STREAM: u64 = 0x6368_6169_6e73;

/// What is known of Markov chains.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChainReport {
    /// Candidates that were drawn, of those that are to be.
    pub candidates: u64,
    /// How many of them had no valid weight.
    pub invalid_candidates: u64,
    /// The integral of the target density; unknown, and zero, until all candidates are drawn.
    pub normalization: Normalization,
    /// Is it known that no light reaches the camera in any way that chains look for?
    pub is_dark: bool,
    /// Chains, of all shards.
    pub chains: u64,
    /// Independent groups of them.
    pub batches: u32,
    /// Chains that could not begin, or in which the program failed.
    pub lost_chains: u64,
    /// The most mutations that a chain has been in one state for.
    pub longest_stay: u64,
    /// Chains that were once in one state for more than [`stuck_after`](Self::stuck_after) mutations.
    pub stuck_chains: u64,
    /// What is called stuck.
    pub stuck_after: u64,
    /// Mutations made, of the shard.
    pub mutations: u64,
    /// What became of them, by their kind.
    pub kinds: Vec<(String, MutationRecord)>,
}

/// Markov chains of some kind.
pub(super) trait Chains: Send + Sync {
    /// Rounds of preparation.
    fn preparation_rounds(&self) -> u32;

    /// Does rounds of preparation; after the last one, chains are at their beginnings.
    fn prepare(&mut self, rounds: Range<u32>, film: &mut Film, cost: &mut RenderCost, incidents: &mut Incidents);

    /// Does rounds of mutations, numbered from 0 after the preparation.
    fn advance(&mut self, rounds: Range<u32>, film: &mut Film, cost: &mut RenderCost, incidents: &mut Incidents);

    /// Lets only the chains of a shard advance. To be said before they begin.
    fn set_shard(&mut self, shard: Shard);

    /// Is it known that there is nothing for chains to find?
    fn is_dark(&self) -> bool;

    /// What is known of them.
    fn report(&self) -> ChainReport;

    /// What became of mutations.
    fn statistics(&self) -> &MutationStatistics;

    /// The chains at rest, but for their statistics, which tell of time.
    fn save(&self) -> Vec<u8>;

    /// The chains of a shard that were saved after so many rounds; `None`, and nothing is changed, if the bytes are of none.
    fn restore(&mut self, bytes: &[u8], statistics: MutationStatistics, shard: Shard, rounds: u32) -> Option<()>;
}

/// Chains of a process, and what they begin from.
pub(super) struct ChainRounds<'a, P: ChainProcess> {
    process: P,
    settings: &'a Settings,
    metropolis: Metropolis,
    window: FilmWindow,
    footprint: Footprint,
    shard: Shard,
    /// Columns and rows of the first image, and how much its candidates give to each cell; none unless there are two stages.
    grid: [u32; 2],
    first_image: Vec<f64>,
    importance: Importance,
    /// The weights of the candidates drawn; once all are, only their number is kept.
    weights: Vec<f64>,
    invalid_candidates: u64,
    /// Known once all candidates are drawn.
    normalization: Option<Normalization>,
    /// The shard's, by number; `None` are those lost.
    chains: Vec<Option<P::Chain>>,
    statistics: MutationStatistics,
}

/// Chains at rest.
#[derive(Serialize, Deserialize)]
struct SavedChains {
    first_image: Vec<f64>,
    weights: Vec<f64>,
    invalid_candidates: u64,
    normalization: Option<Normalization>,
    chains: Vec<Option<Vec<u8>>>,
}

/// What became of a chain in a pass.
struct Advanced {
    statistics: MutationStatistics,
    cost: RenderCost,
    /// Mutations, of which batch.
    mutations: (usize, u64),
    panics: u64,
}

impl<'a, P: ChainProcess> ChainRounds<'a, P> {
    /// Nothing is prepared.
    pub fn new(process: P, settings: &'a Settings) -> Self {
        let metropolis = settings.integrator.metropolis().copied().unwrap_or_default();
        let window = settings.film_window();
        let grid = if metropolis.two_stage { grid(window, process.candidates()) } else { [0, 0] };
        let statistics = MutationStatistics::new(process.mutations().len());
        Self {
            process,
            settings,
            metropolis,
            window,
            footprint: Footprint::new(&settings.filter, settings.bounds),
            shard: Shard::WHOLE,
            grid,
            first_image: vec![0.0; grid[0] as usize * grid[1] as usize],
            importance: Importance::uniform(window),
            weights: Vec::new(),
            invalid_candidates: 0,
            normalization: None,
            chains: Vec::new(),
            statistics,
        }
    }

    /// Rounds of one stage of preparation.
    fn stage_rounds(&self) -> u32 {
        u32::try_from(self.process.candidates().div_ceil(CANDIDATES)).unwrap_or(u32::MAX / 4)
    }

    /// The candidates of rounds of one stage.
    fn candidates(&self, rounds: Range<u32>) -> Range<u64> {
        let first = |round: u32| (u64::from(round) * CANDIDATES).min(self.process.candidates());
        first(rounds.start)..first(rounds.end)
    }

    /// The number of the chain at a place.
    fn number(&self, place: usize) -> u64 {
        u64::from(self.shard.index) + place as u64 * u64::from(self.shard.count)
    }

    /// How many mutations a chain has made after so many rounds.
    fn steps(&self, chain: u64, rounds: u32) -> u64 {
        let all = self.settings.bounds.area() as u64 * u64::from(rounds);
        let chains = self.metropolis.chains;
        all / chains + u64::from(chain < all % chains)
    }

    /// Draws candidates of a stage: their weights, in their order, and what they give to cells of the first image.
    fn draw(&self, stage: u64, numbers: Range<u64>) -> Vec<Drawn> {
        let uniform = Importance::uniform(self.window);
        let importance = if stage == 0 { &self.importance } else { &uniform };
        let draw = |scratch: &mut P::Scratch, number: u64| {
            let mut drawn = Drawn::default();
            let Drawn { cells, cost, .. } = &mut drawn;
            let mut splat = |film, weight: f64| {
                if stage == 1 && weight.is_finite() {
                    cells.push((cell_at(self.window, self.grid, film), weight));
                }
            };
            let weight = catch_unwind(AssertUnwindSafe(|| {
                self.process.candidate(number, stage, importance, scratch, &mut splat, cost)
            }));
            drawn.has_panicked = weight.is_err();
            drawn.weight = weight.unwrap_or(f64::NAN);
            drawn
        };
        numbers.into_par_iter().map_init(|| self.process.scratch(), draw).collect()
    }

    /// All candidates are drawn: chooses among them, and lets the chains begin.
    fn begin(&mut self, film: &mut Film, cost: &mut RenderCost, incidents: &mut Incidents) {
        let each = self.weights.len().div_ceil(self.process.strata().max(1) as usize).max(1);
        let strata: Vec<f64> =
            self.weights.chunks(each).map(|weights| weights.iter().sum::<f64>() / self.weights.len() as f64).collect();
        let bootstrap: Bootstrap = self.weights.drain(..).collect();
        self.weights.shrink_to_fit();
        let normalization = Normalization {
            value: bootstrap.normalization(),
            standard_error: if bootstrap.count() > 1 { bootstrap.standard_error() } else { bootstrap.normalization() },
        };
        self.normalization = Some(normalization);
        self.scale(film);
        if normalization.value <= 0.0 {
            return;
        }
        let u = unit_f64(hash(self.settings.seed, START_STREAM, 0, 0));
        let context = ChainContext { normalization: normalization.value, importance: &self.importance };
        let begin = |scratch: &mut P::Scratch, place: usize| {
            let number = self.number(place);
            let mut cost = RenderCost::default();
            let begun = bootstrap.start(number, self.metropolis.chains, u).map(|candidate| {
                catch_unwind(AssertUnwindSafe(|| {
                    let stratum = strata.get(candidate / each).copied().unwrap_or(0.0);
                    self.process.begin(number, candidate as u64, context, stratum, scratch, &mut cost)
                }))
            });
            let has_panicked = matches!(begun, Some(Err(_)));
            (begun.and_then(Result::ok).flatten(), cost, has_panicked)
        };
        let begun: Vec<_> = (0..own_chains(self.metropolis.chains, self.shard))
            .into_par_iter()
            .map_init(|| self.process.scratch(), begin)
            .collect();
        self.chains = Vec::with_capacity(begun.len());
        for (chain, chain_cost, has_panicked) in begun {
            self.chains.push(chain);
            cost.add(&chain_cost);
            incidents.panics += u64::from(has_panicked);
        }
    }

    /// Tells the film what its splats are scaled by.
    fn scale(&self, film: &mut Film) {
        if let (Some(splats), Some(normalization)) = (film.splats_mut(), self.normalization) {
            splats.set_normalization(normalization);
        }
    }

    /// Lets the chain at a place go from one number of rounds to another.
    fn advance_chain(
        &self,
        place: usize,
        chain: &mut Option<P::Chain>,
        rounds: &Range<u32>,
        splats: &SplatSums,
        scratch: &mut P::Scratch,
    ) -> Advanced {
        let number = self.number(place);
        let batch = (number % u64::from(self.metropolis.batches)) as usize;
        let mut done = Advanced {
            statistics: MutationStatistics::new(self.statistics.kinds.len()),
            cost: RenderCost::default(),
            mutations: (batch, 0),
            panics: 0,
        };
        let (Some(living), Some(normalization)) = (chain.as_mut(), self.normalization) else { return done };
        let steps = self.steps(number, rounds.end) - self.steps(number, rounds.start);
        let context = ChainContext { normalization: normalization.value, importance: &self.importance };
        let mut splat = |film: glam::Vec2, rgb: [f32; 3], weight: f64| {
            if weight == 0.0 {
                return;
            }
            let rgb = rgb.map(|v| f64::from(v) * weight);
            if !film.is_finite() || !SplatSums::can_hold(rgb) || weight < 0.0 {
                splats.drop_one();
                return;
            }
            self.footprint.spread(film, |pixel, share| splats.add_to_batch(batch, pixel, rgb.map(|v| v * share)));
        };
        let Advanced { statistics, cost, .. } = &mut done;
        let went = catch_unwind(AssertUnwindSafe(|| {
            self.process.advance(living, steps, context, scratch, &mut splat, statistics, cost);
        }));
        done.mutations.1 = steps;
        if went.is_err() {
            // One chain lost is better than all: it is reported, and missed from here on.
            *chain = None;
            done.panics = 1;
        }
        done
    }
}

/// A candidate that was drawn.
#[derive(Default)]
struct Drawn {
    weight: f64,
    /// What it gives to cells of the first image.
    cells: Vec<(usize, f64)>,
    cost: RenderCost,
    has_panicked: bool,
}

/// How many of so many chains a shard has.
fn own_chains(chains: u64, shard: Shard) -> usize {
    let (index, count) = (u64::from(shard.index), u64::from(shard.count));
    usize::try_from((chains + count - 1 - index) / count).unwrap_or(usize::MAX)
}

/// Columns and rows of the first image.
fn grid(window: FilmWindow, candidates: u64) -> [u32; 2] {
    let most = (candidates / CANDIDATES_PER_CELL).max(1) as f32;
    let width = (window.area() / most).sqrt().max(CELL_WIDTH);
    let count = |size: f32| ((size / width) as u32).max(1);
    [count(window.size().x), count(window.size().y)]
}

impl<P: ChainProcess + Send> Chains for ChainRounds<'_, P> {
    fn preparation_rounds(&self) -> u32 {
        self.stage_rounds() * if self.metropolis.two_stage { 2 } else { 1 }
    }

    fn prepare(&mut self, rounds: Range<u32>, film: &mut Film, cost: &mut RenderCost, incidents: &mut Incidents) {
        let all = self.preparation_rounds();
        // Where there are two stages, the first image comes first.
        let of_image = all - self.stage_rounds();
        let mut take = |drawn: &Drawn| {
            cost.add(&drawn.cost);
            incidents.panics += u64::from(drawn.has_panicked);
            if !drawn.has_panicked && !(0.0..f64::INFINITY).contains(&drawn.weight) {
                incidents.not_finite += 1;
            }
        };
        if rounds.start < of_image {
            for drawn in self.draw(1, self.candidates(rounds.start..rounds.end.min(of_image))) {
                take(&drawn);
                drawn.cells.iter().for_each(|(cell, weight)| self.first_image[*cell] += weight);
            }
        }
        if rounds.start <= of_image && rounds.end >= of_image && of_image > 0 {
            self.importance = Importance::of_sums(self.window, self.grid, &self.first_image);
        }
        if rounds.end > of_image {
            let of_stage = rounds.start.max(of_image) - of_image..rounds.end - of_image;
            for drawn in self.draw(0, self.candidates(of_stage)) {
                take(&drawn);
                let is_valid = (0.0..f64::INFINITY).contains(&drawn.weight);
                self.invalid_candidates += u64::from(!is_valid);
                self.weights.push(if is_valid { drawn.weight } else { 0.0 });
            }
        }
        if rounds.end >= all {
            self.begin(film, cost, incidents);
        }
    }

    fn advance(&mut self, rounds: Range<u32>, film: &mut Film, cost: &mut RenderCost, incidents: &mut Incidents) {
        let mut chains = std::mem::take(&mut self.chains);
        let Some(splats) = film.splats() else { return };
        let dropped_before = splats.dropped();
        let advance = |scratch: &mut P::Scratch, (place, chain): (usize, &mut Option<P::Chain>)| {
            self.advance_chain(place, chain, &rounds, splats, scratch)
        };
        let done: Vec<Advanced> =
            chains.par_iter_mut().enumerate().map_init(|| self.process.scratch(), advance).collect();
        incidents.not_finite += splats.dropped() - dropped_before;
        self.chains = chains;
        for result in done {
            let invalid: u64 = result.statistics.kinds.iter().map(|k| k.acceptance.count(Outcome::Invalid)).sum();
            incidents.not_finite += invalid;
            incidents.panics += result.panics;
            cost.add(&result.cost);
            self.statistics.merge(&result.statistics);
            if let Some(splats) = film.splats_mut() {
                splats.count_mutations(result.mutations.0, result.mutations.1);
            }
        }
    }

    fn set_shard(&mut self, shard: Shard) {
        self.shard = shard;
    }

    fn is_dark(&self) -> bool {
        self.normalization.is_some_and(|normalization| normalization.value <= 0.0)
    }

    fn report(&self) -> ChainReport {
        let stays = || self.chains.iter().flatten().map(|chain| self.process.longest_stay(chain));
        let names = self.process.mutations();
        let drawn = if self.normalization.is_some() { self.process.candidates() } else { self.weights.len() as u64 };
        ChainReport {
            candidates: drawn,
            invalid_candidates: self.invalid_candidates,
            normalization: self.normalization.unwrap_or_default(),
            is_dark: self.is_dark(),
            chains: self.metropolis.chains,
            batches: self.metropolis.batches,
            lost_chains: self.chains.iter().filter(|chain| chain.is_none()).count() as u64,
            longest_stay: stays().max().unwrap_or(0),
            stuck_chains: stays().filter(|&stay| stay > STUCK).count() as u64,
            stuck_after: STUCK,
            mutations: self.statistics.kinds.iter().map(|kind| kind.acceptance.steps()).sum(),
            kinds: names.iter().map(|name| (*name).to_owned()).zip(self.statistics.kinds.iter().copied()).collect(),
        }
    }

    fn statistics(&self) -> &MutationStatistics {
        &self.statistics
    }

    fn save(&self) -> Vec<u8> {
        let bytes = |chain: &P::Chain| {
            let mut bytes = Vec::new();
            self.process.save(chain, &mut bytes);
            bytes
        };
        let saved = SavedChains {
            first_image: self.first_image.clone(),
            weights: self.weights.clone(),
            invalid_candidates: self.invalid_candidates,
            normalization: self.normalization,
            chains: self.chains.iter().map(|chain| chain.as_ref().map(bytes)).collect(),
        };
        // Numbers, and lists of them, always have such a form.
        postcard::to_allocvec(&saved).unwrap_or_default()
    }

    fn restore(&mut self, bytes: &[u8], statistics: MutationStatistics, shard: Shard, prepared: u32) -> Option<()> {
        let (saved, rest): (SavedChains, _) = postcard::take_from_bytes(bytes).ok()?;
        let all = self.preparation_rounds();
        let of_image = all - self.stage_rounds();
        let is_prepared = prepared >= all;
        let drawn = if is_prepared { 0 } else { self.candidates(0..prepared.saturating_sub(of_image)).end };
        let is_dark = saved.normalization.is_some_and(|n| n.value <= 0.0);
        let chains = if is_prepared && !is_dark { own_chains(self.metropolis.chains, shard) } else { 0 };
        let is_sound = rest.is_empty()
            && saved.first_image.len() == self.first_image.len()
            && saved.weights.len() as u64 == drawn
            && saved.normalization.is_some() == is_prepared
            && saved.normalization.is_none_or(|n| n.value.is_finite())
            && saved.chains.len() == chains
            && statistics.kinds.len() == self.statistics.kinds.len();
        if !is_sound {
            return None;
        }
        let restore = |bytes: Option<Vec<u8>>| match bytes {
            Some(bytes) => self.process.restore(&bytes).map(Some),
            None => Some(None),
        };
        self.chains = saved.chains.into_iter().map(restore).collect::<Option<Vec<_>>>()?;
        if of_image > 0 && prepared >= of_image {
            self.importance = Importance::of_sums(self.window, self.grid, &saved.first_image);
        }
        (self.first_image, self.weights) = (saved.first_image, saved.weights);
        (self.invalid_candidates, self.normalization) = (saved.invalid_candidates, saved.normalization);
        (self.statistics, self.shard) = (statistics, shard);
        Some(())
    }
}

#[cfg(test)]
mod tests;
