//! How far a filter is: a bar on terminals, a line now and then elsewhere; nothing for what takes less than a second.

use crate::program::progress::duration;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{self, IsTerminal};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// What is done sooner needs no bar.
const PATIENCE: Duration = Duration::from_millis(800);
/// How often a log gets a line.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Shows progress, from any thread.
pub struct Ticker {
    is_quiet: bool,
    start: Instant,
    state: Mutex<State>,
}

struct State {
    bar: Option<ProgressBar>,
    line: Instant,
    /// Which frame of how many, for videos.
    frame: Option<(u64, Option<u64>)>,
}

impl Ticker {
    pub fn new(is_quiet: bool) -> Self {
        let state = Mutex::new(State { bar: None, line: Instant::now(), frame: None });
        Self { is_quiet, start: Instant::now(), state }
    }

    /// From now on, a frame of a video is worked on, counted from 0.
    pub fn frame(&self, number: u64, total: Option<u64>) {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).frame = Some((number, total));
        self.update(0, 1);
    }

    /// So much of the image or the frame is done.
    pub fn update(&self, done: u64, total: u64) {
        let elapsed = self.start.elapsed();
        if self.is_quiet || elapsed < PATIENCE {
            return;
        }
        // Whoever comes while it is shown leaves it to the others.
        let Ok(mut state) = self.state.try_lock() else { return };
        let part = done as f64 / total.max(1) as f64;
        let (fraction, what) = match state.frame {
            None => (Some(part), String::new()),
            Some((number, Some(frames))) => {
                (Some((number as f64 + part) / frames.max(1) as f64), format!("frame {} of {frames} · ", number + 1))
            }
            Some((number, None)) => (None, format!("frame {} · ", number + 1)),
        };
        let left = fraction
            .filter(|f| *f > 0.0)
            .map(|f| format!(" · {} left", duration(elapsed.as_secs_f64() * (1.0 - f) / f)));
        let text = format!("{what}{}{}", duration(elapsed.as_secs_f64()), left.unwrap_or_default());
        if io::stderr().is_terminal() {
            let bar = state.bar.get_or_insert_with(bar);
            bar.set_position((fraction.unwrap_or(0.0) * 1000.0) as u64);
            bar.set_message(text);
        } else if state.line.elapsed() >= LINE_EVERY {
            state.line = Instant::now();
            match fraction {
                Some(fraction) => eprintln!("{:.0} % · {text}", 100.0 * fraction),
                None => eprintln!("{text}"),
            }
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Some(bar) = self.state.lock().unwrap_or_else(PoisonError::into_inner).bar.take() {
            bar.finish_and_clear();
        }
    }
}

fn bar() -> ProgressBar {
    let bar = ProgressBar::new(1000);
    let style = ProgressStyle::with_template("{bar:30.cyan/blue} {percent} % · {msg}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("━━─"));
    bar
}
