//! How far a render is: a bar on terminals, a line now and then elsewhere.

use indicatif::{ProgressBar, ProgressStyle};
use luz::render::Renderer;
pub use luz::study::number::{bytes, duration, si};
use std::io::{self, IsTerminal};
use std::time::{Duration, Instant};

/// How often a log gets a line.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Where progress is shown.
pub enum Progress {
    /// Nowhere.
    Quiet,
    /// On a terminal.
    Bar(ProgressBar),
    /// In a log, since when.
    Lines(Instant),
}

impl Progress {
    /// Progress of a render of so many samples per pixel, on standard error.
    pub fn new(is_quiet: bool, samples_per_pixel: u32) -> Self {
        if is_quiet {
            return Self::Quiet;
        }
        if !io::stderr().is_terminal() {
            return Self::Lines(Instant::now());
        }
        let bar = ProgressBar::new(u64::from(samples_per_pixel));
        let template = "{bar:30.cyan/blue} {pos}/{len} samples · {elapsed}{msg}";
        let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
        bar.set_style(style.progress_chars("━━─"));
        bar.enable_steady_tick(Duration::from_millis(250));
        Self::Bar(bar)
    }

    /// Shows what has been done, after a pass.
    pub fn update(&mut self, renderer: &Renderer<'_>, samples_per_pixel: u32) {
        match self {
            Self::Quiet => {}
            Self::Bar(bar) => {
                bar.set_position(u64::from(renderer.samples_done()));
                bar.set_message(format!(" · {}", state(renderer)));
            }
            Self::Lines(since) => {
                if since.elapsed() >= LINE_EVERY {
                    *since = Instant::now();
                    let done = renderer.samples_done();
                    let elapsed = duration(renderer.cost().seconds);
                    eprintln!("{done}/{samples_per_pixel} samples · {elapsed} · {}", state(renderer));
                }
            }
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

fn state(renderer: &Renderer<'_>) -> String {
    let cost = renderer.cost();
    let done = renderer.progress();
    let left = cost.seconds * (1.0 - done) / done.max(f64::MIN_POSITIVE);
    let rays = si(cost.rays_per_second());
    format!("{} left · {rays} rays/s · {}", duration(left), relative_error(renderer.film().relative_error()))
}

/// "relative error 1.2 %", as far as it is known.
pub fn relative_error(error: f64) -> String {
    if error.is_finite() { format!("relative error {:.2} %", 100.0 * error) } else { "error not yet known".to_owned() }
}
