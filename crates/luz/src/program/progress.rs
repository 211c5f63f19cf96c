//! How far a render is: a bar on terminals, a line now and then elsewhere.

use indicatif::{ProgressBar, ProgressStyle};
use luz::render::Renderer;
pub use luz::study::number::{bytes, duration, si};
use std::io::{self, IsTerminal};
use std::time::{Duration, Instant};

/// How often a log gets a line.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Parts of the bar.
const STEPS: u64 = 1000;

/// Where progress is shown, and what a render is on its way to.
pub struct Progress {
    output: Output,
    start: Instant,
    time: Option<Duration>,
    error: Option<f64>,
}

enum Output {
    /// Nowhere.
    Quiet,
    /// On a terminal.
    Bar(ProgressBar),
    /// In a log, since when.
    Lines(Instant),
}

impl Progress {
    /// Progress, on standard error, of a render that ends after some time or at some error, if not before.
    pub fn new(is_quiet: bool, time: Option<Duration>, error: Option<f64>) -> Self {
        let output = if is_quiet {
            Output::Quiet
        } else if !io::stderr().is_terminal() {
            Output::Lines(Instant::now())
        } else {
            let bar = ProgressBar::new(STEPS);
            let template = "{bar:30.cyan/blue} {msg} · {elapsed}";
            let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
            bar.set_style(style.progress_chars("━━─"));
            bar.enable_steady_tick(Duration::from_millis(250));
            Output::Bar(bar)
        };
        Self { output, start: Instant::now(), time, error }
    }

    /// Shows what has been done, after a pass.
    pub fn update(&mut self, renderer: &Renderer<'_>) {
        let due = match &mut self.output {
            Output::Quiet => false,
            Output::Bar(_) => true,
            Output::Lines(since) => {
                let is_due = since.elapsed() >= LINE_EVERY;
                if is_due {
                    *since = Instant::now();
                }
                is_due
            }
        };
        if !due {
            return;
        }
        let done = self.share_done(renderer);
        let state = self.state(renderer, done);
        match &self.output {
            Output::Quiet => {}
            Output::Bar(bar) => {
                bar.set_position((done * STEPS as f64) as u64);
                bar.set_message(state);
            }
            Output::Lines(_) => eprintln!("{state} · {}", duration(self.start.elapsed().as_secs_f64())),
        }
    }

    /// How far it is, by whichever is going to end it first.
    fn share_done(&self, renderer: &Renderer<'_>) -> f64 {
        let by_time = self.time.map_or(0.0, |time| self.start.elapsed().as_secs_f64() / time.as_secs_f64());
        // The error falls with the root of the work.
        let by_error = self.error.map_or(0.0, |error| (error / renderer.film().typical_error()).powi(2));
        renderer.progress().max(by_time).max(by_error).clamp(0.0, 1.0)
    }

    fn state(&self, renderer: &Renderer<'_>, done: f64) -> String {
        if renderer.is_preparing() {
            let drawn = renderer.chains().map_or(0, |chains| chains.candidates);
            return format!("bootstrap: {} candidates for chains", si(drawn as f64));
        }
        let what = if renderer.has_chains() { "mutations per pixel" } else { "samples" };
        let elapsed = self.start.elapsed().as_secs_f64();
        let left = elapsed * (1.0 - done) / done.max(f64::MIN_POSITIVE);
        format!(
            "{} {what} · {} left · {} rays/s · {}",
            renderer.samples_done(),
            duration(left),
            si(renderer.cost().rays_per_second()),
            relative_error(renderer.film().relative_error())
        )
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Output::Bar(bar) = &self.output {
            bar.finish_and_clear();
        }
    }
}

/// "relative error 1.2 %", as far as it is known.
pub fn relative_error(error: f64) -> String {
    if error.is_finite() { format!("relative error {:.2} %", 100.0 * error) } else { "error not yet known".to_owned() }
}
