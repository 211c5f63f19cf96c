//! Variants take turns.

use super::measure::Errors;
use super::outcome::{Checkpoint, SeedRun};
use super::reference::Reference;
use super::{Budget, Monitor, Progress, Study, Work};
use luz_render::Renderer;
use luz_render::film::Film;
use std::time::Instant;

/// A variant, being rendered with a seed.
pub(super) struct Job<'a> {
    renderer: Renderer<'a>,
    /// Of samples or mutations; none while Markov chains are being prepared.
    rounds: u32,
    /// Seconds spent in preparing them.
    preparation: f64,
    checkpoints: Vec<Checkpoint>,
    /// Seconds spent in measuring errors.
    measuring: f64,
}

impl<'a> Job<'a> {
    pub fn new(renderer: Renderer<'a>) -> Self {
        Self { renderer, rounds: 0, preparation: 0.0, checkpoints: Vec::new(), measuring: 0.0 }
    }

    pub fn film(&self) -> &Film {
        self.renderer.film()
    }

    /// Is there a pass to speak of?
    pub fn has_begun(&self) -> bool {
        self.rounds > 0
    }

    /// Seconds of rendering.
    pub fn seconds(&self) -> f64 {
        self.renderer.cost().seconds
    }

    /// Seconds of measuring errors.
    pub fn measuring(&self) -> f64 {
        self.measuring
    }

    pub fn add_measuring(&mut self, seconds: f64) {
        self.measuring += seconds;
    }

    /// What has been measured.
    pub fn result(&mut self, seed: u64) -> SeedRun {
        SeedRun {
            seed,
            rounds: self.rounds,
            cost: *self.renderer.cost(),
            checkpoints: std::mem::take(&mut self.checkpoints),
        }
    }

    /// The share of its budget that is used up; one or more when it is done.
    fn progress(&self, budget: Budget) -> f64 {
        if self.renderer.is_finished() {
            return 1.0;
        }
        match budget {
            Budget::Samples => self.renderer.progress().min(1.0 - f64::EPSILON),
            Budget::Seconds { seconds, .. } => {
                // Done when the next round would end further beyond the budget than this one ended before it.
                let used = self.seconds() + 0.5 * self.seconds_per_round();
                if self.has_begun() { used / seconds } else { 0.0 }
            }
        }
    }

    fn seconds_per_round(&self) -> f64 {
        (self.seconds() - self.preparation) / f64::from(self.rounds.max(1))
    }

    /// Renders a pass, to the next power of two at most, and measures the error there and at the end.
    fn pass(&mut self, budget: Budget, reference: &Reference) {
        if self.renderer.is_preparing() {
            // Of time, but of no picture yet.
            self.renderer.pass(self.renderer.next_pass());
            self.preparation = self.seconds();
            return;
        }
        let next = self.rounds.saturating_add(1).checked_next_power_of_two().unwrap_or(u32::MAX);
        let mut pass = self.renderer.next_pass().min(next - self.rounds).max(1);
        if let (Budget::Seconds { seconds, .. }, true) = (budget, self.has_begun()) {
            let fitting = (seconds - self.seconds()) / self.seconds_per_round();
            pass = pass.min(fitting.round().clamp(1.0, f64::from(u32::MAX)) as u32);
        }
        self.renderer.pass(pass);
        self.rounds += pass;
        if self.rounds == next || self.progress(budget) >= 1.0 {
            self.measure(reference);
        }
    }

    /// Measures the error of what there is, unless it has been.
    fn measure(&mut self, reference: &Reference) {
        if !self.has_begun() || self.checkpoints.last().is_some_and(|c| c.rounds == self.rounds) {
            return;
        }
        let start = Instant::now();
        let errors = Errors::of(self.renderer.film(), reference);
        let cost = self.renderer.cost();
        let pixels = self.renderer.film().bounds().area().max(1) as f64;
        // What chains begin from are paths, too, but no samples of pixels.
        let samples = if self.renderer.has_chains() {
            f64::from(self.renderer.samples_done())
        } else {
            cost.paths as f64 / pixels
        };
        self.checkpoints.push(Checkpoint { rounds: self.rounds, samples, seconds: cost.seconds, errors });
        self.measuring += start.elapsed().as_secs_f64();
    }
}

/// Lets all jobs take turns until their budgets are used up; whoever has used the least share of its own is next. Returns whether
/// they got that far.
pub(super) fn run(
    jobs: &mut [Job<'_>],
    study: &Study,
    reference: &Reference,
    seed: u32,
    monitor: &mut dyn Monitor,
    work: &mut Work,
) -> bool {
    let budget = study.budget;
    let finished = loop {
        let shares = jobs.iter().map(|job| job.progress(budget));
        let next = shares.enumerate().filter(|(_, share)| *share < 1.0).min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((index, _)) = next else { break true };
        jobs[index].pass(budget, reference);
        let done: f64 = jobs.iter().map(|job| job.progress(budget).min(1.0)).sum();
        let doing = format!("seed {} of {}: {}", seed + 1, study.seeds, study.variants[index].name);
        monitor.progress(&Progress { doing, done: work.share(done) });
        if monitor.is_stopped() {
            break jobs.iter().all(|job| job.progress(budget) >= 1.0);
        }
    };
    work.done += jobs.len() as f64;
    jobs.iter_mut().for_each(|job| job.measure(reference));
    finished
}
