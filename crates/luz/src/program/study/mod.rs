//! `luz study`

mod arguments;
mod axes;
mod filter;

pub use arguments::{StudyArguments, help};

use arguments::StudyCommand;

use super::exit::{Exit, print};
use super::output;
use super::problems;
use super::render::{overrides, refuse};
use super::threads;
use super::{interrupt, progress};
use axes::AxisKind;
use indicatif::{ProgressBar, ProgressStyle};
use luz::image::{Format, Image, ToneMap};
use luz::render::Overrides;
use luz::scene::{Diagnostics, SourceMap};
use luz::study::render::{
    Axis, Budget, Monitor, Outcome, PageOptions, Progress, ReferenceSource, Study, StudyError, Variant, product,
    run as run_study,
};
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// More variants than a report can show.
const MOST_VARIANTS: usize = 48;
/// How often a log gets a line.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Renders all variants and writes the report.
pub fn run(arguments: &StudyArguments) -> Exit {
    if let Some(StudyCommand::Filter(arguments)) = &arguments.command {
        return filter::run(arguments);
    }
    match study(arguments) {
        Ok(exit) | Err(exit) => exit,
    }
}

fn study(arguments: &StudyArguments) -> Result<Exit, Exit> {
    interrupt::install(arguments.quiet);
    let study = plan(arguments)?;
    threads::start(arguments.threads)?;
    let files = Files::beside(&arguments.output);
    let all = [&files.html, &files.json, &files.csv].map(PathBuf::as_path);
    let unwritable = output::problems(all.into_iter().chain(arguments.save_reference.as_deref()));
    if !unwritable.is_empty() {
        unwritable.iter().for_each(|problem| problems::error(problem));
        return Err(Exit::Output);
    }
    let mut watcher = Watcher::new(arguments.quiet);
    interrupt::begin_rendering();
    let outcome = run_study(&study, &mut watcher);
    watcher.finish();
    let outcome = outcome.map_err(explain)?;
    write(arguments, &files, &outcome)?;
    Ok(if outcome.interrupted { interrupt::exit() } else { Exit::Success })
}

/// What is to be done, or what is wrong with the command line.
fn plan(arguments: &StudyArguments) -> Result<Study, Exit> {
    let usage = |message: String| {
        problems::error(&message);
        Exit::Usage
    };
    let axes: Vec<Axis> =
        arguments.vary.iter().map(|vary| Axis { name: vary.axis.clone(), values: vary.values.clone() }).collect();
    for (index, axis) in axes.iter().enumerate() {
        if axes[..index].iter().any(|other| other.name == axis.name) {
            return Err(usage(format!("`{}` is varied twice; name all its values at once", axis.name)));
        }
    }
    let count = axes.iter().fold(1usize, |count, axis| count.saturating_mul(axis.values.len()));
    if count > MOST_VARIANTS {
        return Err(usage(format!("these are {count} variants; a report can show {MOST_VARIANTS}")));
    }
    let base = Overrides { technique_images: false, ..overrides(&arguments.overrides) };
    let variants = variants(&base, &axes).map_err(usage)?;
    let is_varied = |names: &[&str]| axes.iter().any(|axis| names.contains(&axis.name.as_str()));
    let budget = match arguments.time {
        None => Budget::Samples,
        Some(seconds) => {
            Budget::Seconds { seconds, at_most_samples: base.samples_per_pixel.is_some() || is_varied(&["spp"]) }
        }
    };
    Ok(Study {
        // The grammar asks for one.
        scene: arguments.scene.clone().unwrap_or_default(),
        base,
        variants,
        budget,
        seeds: arguments.seeds.get(),
        reference: match &arguments.reference {
            Some(path) => ReferenceSource::File(path.clone()),
            None => ReferenceSource::Render(arguments.reference_spp),
        },
        technique_images: arguments.overrides.technique_images || is_varied(&["technique", "mis"]),
        simd: arguments.simd.into(),
        axes,
    })
}

/// All combinations of the axes' values.
fn variants(base: &Overrides, axes: &[Axis]) -> Result<Vec<Variant>, String> {
    let kinds = axes.iter().map(|axis| AxisKind::find(&axis.name)).collect::<Result<Vec<_>, _>>()?;
    let variant = |combination: Vec<usize>| {
        let mut overrides = base.clone();
        let (mut values, mut labels, mut world) = (Vec::new(), Vec::new(), String::new());
        for ((kind, axis), index) in kinds.iter().zip(axes).zip(combination) {
            let value = &axis.values[index];
            kind.apply(&mut overrides, value)?;
            if kind.changes_world {
                world += &format!("{}={value} ", kind.name);
            }
            labels.push(kind.label(value, &kinds));
            values.push(value.clone());
        }
        Ok(Variant { name: labels.join(" · "), values, overrides, world })
    };
    product(axes).into_iter().map(variant).collect()
}

/// Why there is no outcome, for people.
fn explain(error: StudyError) -> Exit {
    match error {
        StudyError::Scene { errors, variant } => {
            if let Some(variant) = variant {
                problems::error(&format!("with {variant}:"));
            }
            refuse(&errors)
        }
        StudyError::NothingDone => {
            problems::error("interrupted before every variant had been rendered at all; nothing was written");
            interrupt::exit()
        }
        StudyError::Reference(_) | StudyError::Size { .. } => {
            problems::error(&error.to_string());
            Exit::Image
        }
    }
}

/// Where the report goes.
struct Files {
    html: PathBuf,
    json: PathBuf,
    csv: PathBuf,
}

impl Files {
    fn beside(html: &Path) -> Self {
        Self { html: html.to_owned(), json: html.with_extension("json"), csv: html.with_extension("csv") }
    }

    fn stem(&self) -> String {
        self.html.file_stem().map_or("study".to_owned(), |stem| stem.to_string_lossy().into_owned())
    }
}

fn write(arguments: &StudyArguments, files: &Files, outcome: &Outcome) -> Result<(), Exit> {
    let options = PageOptions {
        title: arguments.title.clone(),
        tone_map: ToneMap { exposure: arguments.exposure, operator: arguments.tone_map.into() },
        command: Some(command_line()),
        name: files.stem(),
    };
    let mut is_whole = true;
    let mut keep = |path: &Path, bytes: Result<Vec<u8>, String>| {
        let result = bytes.and_then(|bytes| output::write_bytes(path, &bytes).map_err(|e| e.to_string()));
        // The other files may still be saved.
        if let Err(error) = result {
            problems::error(&error);
            is_whole = false;
        }
    };
    let page = outcome.page(&options).map(String::into_bytes).map_err(|e| e.to_string());
    let page_bytes = page.as_ref().map_or(0, Vec::len);
    keep(&files.html, page);
    keep(&files.json, outcome.to_json().map_err(|e| e.to_string()));
    keep(&files.csv, Ok(outcome.to_csv().into_bytes()));
    let mut written = vec![&files.html, &files.json, &files.csv];
    if let Some(path) = &arguments.save_reference {
        let encode = |image: Image| image.encode(Format::Exr, &luz::image::WriteOptions::default());
        keep(path, outcome.reference_image().and_then(encode).map_err(|e| e.to_string()));
        written.push(path);
    }
    if !is_whole {
        return Err(Exit::Output);
    }
    if !arguments.quiet {
        outcome.warnings().iter().for_each(|warning| problems::warning(warning));
        let names: Vec<String> = written.iter().map(|path| path.display().to_string()).collect();
        let size = progress::bytes(page_bytes as u64);
        print(&format!("{}wrote {} (the report has {size})\n", summary(outcome), names.join(", ")));
    }
    Ok(())
}

/// The numbers, for those who do not open the report at once.
fn summary(outcome: &Outcome) -> String {
    let mut out = String::new();
    if outcome.interrupted {
        out += &format!("interrupted: {} of {} seeds are complete\n", outcome.seeds_done(), outcome.setup.seeds);
    }
    out + &outcome.to_text()
}

/// What was typed, as far as a shell would take it again.
fn command_line() -> String {
    let quoted = |word: String| {
        let is_plain = !word.is_empty() && word.chars().all(|c| c.is_alphanumeric() || "-_=,.:/%+".contains(c));
        if is_plain { word } else { format!("'{}'", word.replace('\'', "'\\''")) }
    };
    let arguments = std::env::args_os().skip(1).map(|a| quoted(a.to_string_lossy().into_owned()));
    ["luz".to_owned()].into_iter().chain(arguments).collect::<Vec<_>>().join(" ")
}

/// Shows how far a study is, and stops it on Ctrl-C.
enum Watcher {
    /// Says nothing.
    Quiet,
    /// On a terminal.
    Bar(ProgressBar),
    /// In a log: when it began, and when the last line was written.
    Lines { began: Instant, last: Instant },
}

impl Watcher {
    fn new(is_quiet: bool) -> Self {
        if is_quiet {
            return Self::Quiet;
        }
        if !io::stderr().is_terminal() {
            return Self::Lines { began: Instant::now(), last: Instant::now() };
        }
        let bar = ProgressBar::new(1000);
        let style = ProgressStyle::with_template("{bar:30.cyan/blue} {percent} % · {elapsed} · {eta} left · {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("━━─"));
        bar.enable_steady_tick(Duration::from_millis(250));
        Self::Bar(bar)
    }

    fn finish(&self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

impl Monitor for Watcher {
    fn opened(&mut self, diagnostics: &Diagnostics, sources: &SourceMap) {
        match self {
            Self::Quiet => {}
            Self::Bar(bar) => bar.suspend(|| problems::print_all(diagnostics, sources)),
            Self::Lines { .. } => problems::print_all(diagnostics, sources),
        }
    }

    fn progress(&mut self, now: &Progress) {
        match self {
            Self::Quiet => {}
            Self::Bar(bar) => {
                bar.set_position((1000.0 * now.done) as u64);
                bar.set_message(now.doing.clone());
            }
            Self::Lines { began, last } => {
                if last.elapsed() >= LINE_EVERY {
                    *last = Instant::now();
                    let elapsed = progress::duration(began.elapsed().as_secs_f64());
                    eprintln!("{:.0} % · {elapsed} · {}", 100.0 * now.done, now.doing);
                }
            }
        }
    }

    fn is_stopped(&self) -> bool {
        interrupt::is_requested()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variants_are_named_by_their_values_and_share_worlds() {
        let axis = |name: &str, values: &[&str]| Axis {
            name: name.to_owned(),
            values: values.iter().map(|v| (*v).to_owned()).collect(),
        };
        let all = variants(&Overrides::default(), &[axis("sampler", &["sobol", "halton"]), axis("max-depth", &["2"])])
            .unwrap();
        let names: Vec<&str> = all.iter().map(|v| v.name.as_str()).collect();
        assert_eq!(names, ["sobol · max-depth 2", "halton · max-depth 2"]);
        assert!(all.iter().all(|v| v.world.is_empty() && v.overrides.max_depth == Some(2)));
        let coats = variants(&Overrides::default(), &[axis("pbrt-coats", &["off", "on"])]).unwrap();
        assert_ne!(coats[0].world, coats[1].world);
    }

    #[test]
    fn numbers_lie_beside_the_report() {
        let files = Files::beside(Path::new("a/b.html"));
        assert_eq!((files.json.as_path(), files.csv.as_path()), (Path::new("a/b.json"), Path::new("a/b.csv")));
        assert_eq!(files.stem(), "b");
    }
}
