//! Studies of rendering: variants of one scene's settings, rendered in turns and compared with a reference.
//!
//! [`run`] opens the scene, makes or reads the reference, renders all variants with one seed after the other, and gives an
//! [`Outcome`], which [`page`](Outcome::page) makes a report of. Variants take turns, pass by pass, so that whatever else the
//! machine does meets all of them alike.
//!
//! The error of a picture x against a reference r whose own error is independent of it has the expectation E(x − r)² = MSE +
//! Var(r). The reference's variance is known, either from its parts, which are rendered with seeds of their own, or from its file;
//! it is subtracted, and what is left is an unbiased estimate of the MSE.

mod axes;
mod csv;
mod measure;
mod outcome;
mod page;
mod prepare;
mod reference;
mod schedule;
mod text;

pub use axes::{Axis, Variant, product};
pub use measure::Errors;
pub use outcome::{Checkpoint, Outcome, Seconds, SeedRun, Setup, VariantOutcome, VariantSummary};
pub use page::PageOptions;
pub use reference::{ReferenceOrigin, ReferenceSummary};

use luz_geometry::SimdLevel;
use luz_image::ImageError;
use luz_render::Overrides;
use luz_scene::{Diagnostics, SceneErrors, SourceMap};
use measure::Accumulator;
use prepare::Prepared;
use reference::Reference;
use schedule::Job;
use std::path::PathBuf;
use std::time::Instant;

/// How long each variant is rendered with each seed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Budget {
    /// As many samples per pixel as the settings of the variant say.
    Samples,
    /// So many seconds of rendering, and no more samples than the settings say if the flag is set; else as many as fit.
    Seconds {
        /// Wall-clock seconds, above zero.
        seconds: f64,
        /// Do the settings' samples per pixel end it earlier?
        at_most_samples: bool,
    },
}

/// Where the reference comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum ReferenceSource {
    /// A file of the frame's size, or of the crop window's.
    File(PathBuf),
    /// Rendered by the scene's own settings and the overrides common to all variants, with so many samples per pixel; `None`
    /// for [`REFERENCE_FACTOR`] times as many as a render of the study has.
    Render(Option<u32>),
}

/// How many times the samples of one render a reference has, unless said otherwise.
pub const REFERENCE_FACTOR: u32 = 16;

/// What is to be studied.
#[derive(Clone, Debug)]
pub struct Study {
    /// The scene, a pbrt-v4 file.
    pub scene: PathBuf,
    /// What all variants and the reference render otherwise than the scene says.
    pub base: Overrides,
    /// What is varied.
    pub axes: Vec<Axis>,
    /// At least one; the first is what the others are compared with.
    pub variants: Vec<Variant>,
    /// How long each is rendered.
    pub budget: Budget,
    /// How many seeds each is rendered with, at least one.
    pub seeds: u32,
    /// What they are compared with.
    pub reference: ReferenceSource,
    /// Are pictures of what each technique finds wanted? They are rendered after everything that is timed.
    pub technique_images: bool,
    /// The instruction set of ray traversal.
    pub simd: SimdLevel,
}

/// How far a study is.
#[derive(Clone, Debug, PartialEq)]
pub struct Progress {
    /// What is being done.
    pub doing: String,
    /// The share of all rendering that is done.
    pub done: f64,
}

/// Whoever watches a study and may stop it.
pub trait Monitor {
    /// The scene is there, with these warnings.
    fn opened(&mut self, _diagnostics: &Diagnostics, _sources: &SourceMap) {}
    /// A pass is done.
    fn progress(&mut self, progress: &Progress);
    /// Should the study end after this pass?
    fn is_stopped(&self) -> bool;
}

/// Why a study has no outcome.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The scene has errors, misses files, or cannot be rendered with one of the variants.
    #[error("the scene cannot be rendered{}", .variant.as_ref().map_or(String::new(), |v| format!(" with {v}")))]
    Scene {
        /// What is wrong.
        errors: SceneErrors,
        /// With which variant; `None` for all.
        variant: Option<String>,
    },
    /// The reference cannot be read, or has no colours.
    #[error(transparent)]
    Reference(#[from] ImageError),
    /// The reference is of another size.
    #[error("the reference is of {}×{} pixels, the pictures are of {}×{}", .found[0], .found[1], .wanted[0], .wanted[1])]
    Size {
        /// The reference's width and height.
        found: [usize; 2],
        /// The pictures' width and height.
        wanted: [usize; 2],
    },
    /// It was stopped before every variant had a pass.
    #[error("stopped before every variant had been rendered at all")]
    NothingDone,
}

/// Renders all variants and measures their errors. When it is stopped, the outcome has what there is by then.
///
/// # Errors
/// See [`StudyError`].
pub fn run(study: &Study, monitor: &mut dyn Monitor) -> Result<Outcome, StudyError> {
    let started = Instant::now();
    let mut prepared = Prepared::open(study, monitor)?;
    let mut seconds = Seconds { read: prepared.times.read, build: prepared.times.build, ..Seconds::default() };

    // The file is read before anything long is done.
    let file = match &study.reference {
        ReferenceSource::File(path) => Some(Reference::read(path, &prepared.base.settings)?),
        ReferenceSource::Render(_) => None,
    };
    let calibration = Instant::now();
    prepared.calibrate(study.budget);
    let mut work = Work::new(study, &prepared);
    seconds.calibration = calibration.elapsed().as_secs_f64();
    let making = Instant::now();
    let reference = match (file, &study.reference) {
        (None, ReferenceSource::Render(samples)) => Reference::render(&prepared, *samples, monitor, &mut work)?,
        (Some(reference), _) => reference,
        (None, ReferenceSource::File(path)) => Reference::read(path, &prepared.base.settings)?,
    };
    seconds.reference = making.elapsed().as_secs_f64();

    let count = study.variants.len();
    let mut runs: Vec<Vec<SeedRun>> = vec![Vec::new(); count];
    let mut accumulators: Vec<Accumulator> = (0..count).map(|_| Accumulator::new(&reference)).collect();
    let mut interrupted = false;
    for seed in 0..study.seeds {
        let settings = prepared.settings_of_seed(seed);
        let mut jobs: Vec<Job<'_>> = prepared.jobs(&settings);
        let finished = schedule::run(&mut jobs, study, &reference, seed, monitor, &mut work);
        interrupted |= !finished;
        let is_usable = jobs.iter().all(Job::has_begun);
        if !finished && (seed > 0 || !is_usable) {
            // A seed that is not done for all variants would count for some of them only.
            seconds.discarded += jobs.iter().map(Job::seconds).sum::<f64>();
            if seed == 0 {
                return Err(StudyError::NothingDone);
            }
            break;
        }
        for ((job, runs), accumulator) in jobs.iter_mut().zip(&mut runs).zip(&mut accumulators) {
            let measuring = Instant::now();
            accumulator.add(job.film(), &reference);
            job.add_measuring(measuring.elapsed().as_secs_f64());
            seconds.variants += job.seconds();
            seconds.measuring += job.measuring();
            runs.push(job.result(settings[0].seed));
        }
        if !finished {
            break;
        }
    }

    let techniques = Instant::now();
    let samples: Vec<u32> = runs.iter().map(|runs| runs.first().map_or(0, |run| run.rounds)).collect();
    let technique_images = if study.technique_images && !interrupted {
        let images = prepared.technique_images(study, &samples, monitor, &mut work);
        interrupted |= images.is_none();
        images
    } else {
        None
    };
    seconds.techniques = techniques.elapsed().as_secs_f64();
    seconds.total = started.elapsed().as_secs_f64();
    Ok(Outcome::new(study, &prepared, reference, runs, accumulators, technique_images, seconds, interrupted))
}

/// How much of all rendering is done, in renders of a variant with a seed.
#[derive(Debug)]
struct Work {
    /// Renders that are done.
    done: f64,
    /// How many renders the reference is worth.
    reference: f64,
    /// Renders in all.
    all: f64,
}

impl Work {
    fn new(study: &Study, prepared: &Prepared) -> Self {
        let renders = study.variants.len() as f64 * f64::from(study.seeds);
        let techniques = if study.technique_images { study.variants.len() as f64 } else { 0.0 };
        let reference = match study.reference {
            ReferenceSource::File(_) => 0.0,
            ReferenceSource::Render(samples) => {
                samples.map_or(f64::from(REFERENCE_FACTOR), |n| f64::from(n) / f64::from(prepared.longest().max(1)))
            }
        };
        Self { done: 0.0, reference, all: renders + techniques + reference }
    }

    /// The share of all work, if `renders` more are done.
    fn share(&self, renders: f64) -> f64 {
        ((self.done + renders) / self.all.max(1.0)).clamp(0.0, 1.0)
    }
}
