//! How far a render is: a bar on terminals, a line now and then elsewhere.

use indicatif::{ProgressBar, ProgressStyle};
use luz::render::Renderer;
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
                    eprintln!(
                        "{done}/{samples_per_pixel} samples · {elapsed} · {}",
                        state(renderer)
                    );
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

/// A number with three digits and a prefix of the SI: 12.3 M.
pub fn si(value: f64) -> String {
    let (scaled, prefix) = match value.abs() {
        v if v >= 1e12 => (value / 1e12, " T"),
        v if v >= 1e9 => (value / 1e9, " G"),
        v if v >= 1e6 => (value / 1e6, " M"),
        v if v >= 1e3 => (value / 1e3, " k"),
        _ => (value, " "),
    };
    let digits = match scaled.abs() {
        v if v >= 100.0 || (prefix == " " && v.fract() == 0.0) => 0,
        v if v >= 10.0 => 1,
        _ => 2,
    };
    format!("{scaled:.digits$}{prefix}").trim_end().to_owned()
}

/// A time for people: 350 ms, 12.3 s, 4 min 10 s, 1 h 02 min.
pub fn duration(seconds: f64) -> String {
    match seconds {
        s if !s.is_finite() => "?".to_owned(),
        s if s < 1.0 => format!("{:.0} ms", s * 1e3),
        s if s < 60.0 => format!("{s:.1} s"),
        s if s < 3600.0 => format!("{} min {:02} s", (s / 60.0) as u64, (s % 60.0) as u64),
        s => format!("{} h {:02} min", (s / 3600.0) as u64, (s % 3600.0 / 60.0) as u64),
    }
}

/// An amount of memory: 12.3 MB.
pub fn bytes(count: u64) -> String {
    let text = si(count as f64);
    if text.contains(' ') { format!("{text}B") } else { format!("{text} B") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_for_people() {
        assert_eq!(si(0.0), "0");
        assert_eq!(si(12.0), "12");
        assert_eq!(si(1234.0), "1.23 k");
        assert_eq!(si(12_345_678.0), "12.3 M");
        assert_eq!(bytes(12), "12 B");
        assert_eq!(bytes(2_500_000), "2.50 MB");
        assert_eq!(duration(0.35), "350 ms");
        assert_eq!(duration(12.34), "12.3 s");
        assert_eq!(duration(250.0), "4 min 10 s");
        assert_eq!(duration(3720.0), "1 h 02 min");
        assert_eq!(duration(f64::INFINITY), "?");
    }
}
