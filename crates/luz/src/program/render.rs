//! `luz render`

use super::arguments::{Arguments, Command, OverrideArguments, RenderArguments};
use super::chains;
use super::exit::{Exit, print};
use super::interrupt;
use super::keeper::Keeper;
use super::output::{self, default_outputs};
use super::piece_values::{RenderOutput, SampleName};
use super::pieces::BudgetArguments;
use super::plan::NO_SHARDS_BY_EFFICIENCY;
use super::problems;
use super::progress::{self, Progress};
use super::report::{Report, Stopped};
use super::threads;
use super::trace::{Place, trace};
use clap::Parser;
use luz::Scene;
use luz::checkpoint::{Checkpoint, Identity, SIMD_OPTION, describe};
use luz::geometry::SimdLevel;
use luz::image::{Chromaticities, Image, ImageError, ToneMap};
use luz::render::bsdf::CoatWeights;
use luz::render::{Incident, Overrides, PASS_TIME, Renderer, Shard};
use luz::sample::roulette::Roulette;
use luz::scene::SceneErrors;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Renders a scene and writes what was asked for.
pub fn run(arguments: &RenderArguments) -> Exit {
    match render(arguments) {
        Ok(exit) | Err(exit) => exit,
    }
}

fn render(arguments: &RenderArguments) -> Result<Exit, Exit> {
    interrupt::install(arguments.quiet);
    threads::start(arguments.threads)?;
    let named = arguments.output.iter().map(RenderOutput::path);
    check_outputs(named.chain(arguments.report.as_deref()).chain(arguments.pieces.checkpoint.as_deref()))?;
    let job = Job::new(arguments)?;
    if let Some(SampleName { pixel, sample }) = arguments.pieces.replay {
        return Ok(trace(&job.scene_path, &job.wanted, job.simd, Place { pixel, half: 0, sample }));
    }
    let (overrides, scene) = open(&job, arguments)?;
    let outputs = outputs(arguments, &job, &scene)?;
    let wants_identity = job.resumed.is_some()
        || arguments.pieces.checkpoint.is_some()
        || outputs.iter().any(|output| matches!(output, RenderOutput::Checkpoint(_)));
    let identity = if wants_identity { Some(job.identity(&scene, &overrides)?) } else { None };

    let mut renderer = scene.renderer();
    renderer.set_shard(job.shard);
    let mut resumed = job.resumed.clone();
    if let (Some(identity), RenderOutput::Checkpoint(path)) = (&identity, &outputs[0])
        && !job.shard.is_whole()
        && path.exists()
    {
        resumed = Some((path.clone(), read_checkpoint(path)?));
        if job.is_done_by(identity, resumed.as_ref())? {
            if !arguments.quiet {
                print(&format!("shard {} is already in {}\n", job.shard, path.display()));
            }
            return Ok(Exit::Success);
        }
    }
    if let (Some(identity), Some((path, checkpoint))) = (&identity, &resumed) {
        restore(&mut renderer, identity, path, checkpoint)?;
    }
    let keeper = arguments.pieces.checkpoint.clone().or_else(|| match &outputs[0] {
        RenderOutput::Checkpoint(path) if !job.shard.is_whole() => Some(path.clone()),
        _ => None,
    });
    let keeper = keeper.map(|path| Keeper::new(path, arguments.pieces.every.0));
    if keeper.is_some() {
        renderer.set_pass_time(PASS_TIME.min(arguments.pieces.every.0));
    }
    let snapshot = |renderer: &Renderer<'_>| identity.clone().map(|identity| Checkpoint::of(identity, renderer));
    let (stopped, is_kept) = render_passes(&mut renderer, arguments, keeper, &outputs, snapshot);
    write(arguments, &job, &scene, &renderer, stopped, &outputs, snapshot)?;
    match stopped {
        _ if !is_kept => Err(Exit::Output),
        Stopped::Interrupted => Ok(interrupt::exit()),
        Stopped::Finished | Stopped::Time | Stopped::Error => Ok(Exit::Success),
    }
}

/// What is to be rendered, and from where on.
struct Job {
    scene_path: PathBuf,
    wanted: OverrideArguments,
    simd: SimdLevel,
    sample_limit: Option<u32>,
    shard: Shard,
    resumed: Option<(PathBuf, Checkpoint)>,
}

/// As many samples as a pixel can have, where something else says when it is enough.
const UNLIMITED: u32 = 1 << 30;

impl Job {
    fn new(arguments: &RenderArguments) -> Result<Self, Exit> {
        let shard = arguments.pieces.shard.unwrap_or_default();
        let is_open_ended = arguments.budget.time.is_some() || arguments.budget.error.is_some();
        let usage = |message: &str| {
            problems::error(message);
            Exit::Usage
        };
        let Some(path) = &arguments.pieces.resume else {
            if !shard.is_whole() && is_open_ended {
                return Err(usage(
                    "shards have a number of samples, --spp, so that they go together: no time, no error",
                ));
            }
            if !shard.is_whole() && arguments.overrides.roulette == Some(Roulette::Efficiency) {
                return Err(usage(NO_SHARDS_BY_EFFICIENCY));
            }
            return Ok(Self {
                scene_path: arguments.scene.clone().unwrap_or_default(),
                wanted: arguments.overrides.clone(),
                simd: arguments.simd.into(),
                sample_limit: (is_open_ended && arguments.overrides.spp.is_none()).then_some(UNLIMITED),
                shard,
                resumed: None,
            });
        };
        let checkpoint = read_checkpoint(path)?;
        let [part] = checkpoint.parts() else {
            problems::error(&format!("`{}` holds several parts; `luz merge` puts them together", path.display()));
            return Err(Exit::Checkpoint);
        };
        let shard = part.header.shard;
        let identity = &checkpoint.identity;
        let scene_path = arguments.scene.clone().unwrap_or_else(|| identity.scene.clone());
        // What the render was begun with, and then what is said now; how many samples there are to be is no part of it.
        let now = OverrideArguments { spp: None, ..arguments.overrides.clone() };
        let command = ["luz".into(), "render".into(), scene_path.clone().into_os_string()];
        let options = identity.arguments.iter().chain(&now.to_arguments()).map(Into::into).collect::<Vec<OsString>>();
        let parsed = Arguments::try_parse_from(command.into_iter().chain(options)).map_err(|error| {
            problems::error(&format!("`{}` was begun with options that are not understood: {error}", path.display()));
            Exit::Checkpoint
        })?;
        let Command::Render(begun) = parsed.command else { return Err(Exit::Checkpoint) };
        let simd = match SimdLevel::from(arguments.simd) {
            SimdLevel::Auto => {
                identity.options.get(SIMD_OPTION).and_then(|name| SimdLevel::from_name(name)).unwrap_or_default()
            }
            level => level,
        };
        Ok(Self {
            scene_path,
            wanted: begun.overrides,
            simd,
            sample_limit: arguments.overrides.spp.or(is_open_ended.then_some(UNLIMITED)),
            shard,
            resumed: Some((path.clone(), checkpoint)),
        })
    }

    fn identity(&self, scene: &Scene, overrides: &Overrides) -> Result<Identity, Exit> {
        Identity::new(scene, &self.scene_path, overrides, self.wanted.to_arguments()).map_err(|error| {
            problems::error(&format!("the scene's files cannot be read any more: {error}"));
            Exit::Scene
        })
    }

    /// Is this shard in a file already?
    fn is_done_by(&self, identity: &Identity, there: Option<&(PathBuf, Checkpoint)>) -> Result<bool, Exit> {
        let Some((path, checkpoint)) = there else { return Ok(false) };
        check_identity(identity, path, checkpoint)?;
        let part = checkpoint.parts().iter().find(|part| part.header.shard == self.shard);
        match part {
            Some(part) => Ok(part.header.is_finished),
            None => {
                problems::error(&format!("`{}` holds other shards; name another file", path.display()));
                Err(Exit::Checkpoint)
            }
        }
    }
}

fn read_checkpoint(path: &Path) -> Result<Checkpoint, Exit> {
    Checkpoint::read(path).map_err(|error| {
        problems::error(&format!("`{}` {error}", path.display()));
        Exit::Checkpoint
    })
}

fn check_identity(identity: &Identity, path: &Path, checkpoint: &Checkpoint) -> Result<(), Exit> {
    let differences = checkpoint.identity.differences(identity);
    if differences.is_empty() {
        return Ok(());
    }
    problems::error(&format!("`{}` is of another render (first there, then here)", path.display()));
    differences.iter().for_each(|difference| problems::error(difference));
    Err(Exit::Checkpoint)
}

fn restore(renderer: &mut Renderer<'_>, identity: &Identity, path: &Path, checkpoint: &Checkpoint) -> Result<(), Exit> {
    check_identity(identity, path, checkpoint)?;
    let restored = checkpoint.parts().first().map(|part| renderer.restore(part));
    match restored {
        Some(Ok(())) => Ok(()),
        Some(Err(error)) => {
            problems::error(&format!("`{}` cannot be used: {error}", path.display()));
            Err(Exit::Checkpoint)
        }
        None => Ok(()),
    }
}

/// What is to be written; the first of a shard is its checkpoint.
fn outputs(arguments: &RenderArguments, job: &Job, scene: &Scene) -> Result<Vec<RenderOutput>, Exit> {
    let is_checkpoint = |output: &RenderOutput| matches!(output, RenderOutput::Checkpoint(_));
    if !job.shard.is_whole() && !arguments.output.iter().all(is_checkpoint) {
        problems::error("a shard is no picture: it is written to a .luz file, for `luz merge`");
        return Err(Exit::Usage);
    }
    if !arguments.output.is_empty() {
        return Ok(arguments.output.clone());
    }
    let film_name = scene.settings.filename.as_deref();
    let outputs = if job.shard.is_whole() {
        default_outputs(film_name, &job.scene_path).into_iter().map(RenderOutput::Image).collect()
    } else {
        let Shard { index, count } = job.shard;
        let stem = output::scene_name(film_name, &job.scene_path);
        vec![RenderOutput::Checkpoint(format!("{stem}-{}-of-{count}.luz", index + 1).into())]
    };
    check_outputs(outputs.iter().map(RenderOutput::path))?;
    Ok(outputs)
}

/// Before anything is rendered: can everything be written?
fn check_outputs<'a>(paths: impl Iterator<Item = &'a Path>) -> Result<(), Exit> {
    let found = output::problems(paths);
    found.iter().for_each(|problem| problems::error(problem));
    if found.is_empty() { Ok(()) } else { Err(Exit::Output) }
}

/// What the command line wants instead of what the scene says.
pub fn overrides(wanted: &OverrideArguments) -> Overrides {
    Overrides {
        resolution: wanted.resolution.map(|r| r.0),
        crop: wanted.crop.map(|c| c.0),
        samples_per_pixel: wanted.spp,
        seed: wanted.seed,
        sampler: wanted.sampler.map(Into::into),
        max_depth: wanted.max_depth,
        integrator: wanted.integrator.map(Into::into),
        metropolis: wanted.metropolis.overrides(),
        filter: wanted.filter.map(Into::into),
        film: wanted.film.map(Into::into),
        light_sampler: wanted.light_sampler,
        mis_compensation: wanted.mis_compensation,
        technique_images: wanted.technique_images,
        technique: wanted.technique,
        heuristic: wanted.mis,
        roulette: wanted.roulette,
        adaptive: wanted.adaptive.map(|share| share.0),
        coat_weights: if wanted.pbrt_coats { CoatWeights::PbrtV4 } else { CoatWeights::Exact },
        ..Overrides::default()
    }
}

fn open(job: &Job, arguments: &RenderArguments) -> Result<(Overrides, Scene), Exit> {
    let overrides = Overrides { sample_limit: job.sample_limit, ..overrides(&job.wanted) };
    let simd = job.simd;
    let scene = Scene::open_with(&job.scene_path, &overrides, simd).map_err(|errors| refuse(&errors))?;
    if !arguments.quiet {
        problems::print_all(&scene.diagnostics, &scene.sources);
        let used = scene.world.accelerator().simd();
        if simd != SimdLevel::Auto && simd != used {
            let (wanted, used) = (simd.name(), used.name());
            problems::warning(&format!("`{wanted}` is not to be had here: rays are traced with `{used}`"));
        }
    }
    Ok((overrides, scene))
}

/// Says everything that is wrong with a scene.
pub fn refuse(errors: &SceneErrors) -> Exit {
    problems::print_all(&errors.diagnostics, &errors.sources);
    problems::error(&format!("{}; nothing was rendered", problems::count(&errors.diagnostics)));
    Exit::Scene
}

/// Renders until it is enough. Returns why it stopped, and whether the checkpoint, if one is kept, is there.
fn render_passes(
    renderer: &mut Renderer<'_>,
    arguments: &RenderArguments,
    mut keeper: Option<Keeper>,
    outputs: &[RenderOutput],
    snapshot: impl Fn(&Renderer<'_>) -> Option<Checkpoint>,
) -> (Stopped, bool) {
    let BudgetArguments { time, error } = arguments.budget;
    let start = Instant::now();
    let is_over = |renderer: &Renderer<'_>| {
        if renderer.is_finished() {
            Some(Stopped::Finished)
        } else if interrupt::is_requested() {
            Some(Stopped::Interrupted)
        } else if time.is_some_and(|time| start.elapsed() >= time.0) {
            Some(Stopped::Time)
        } else if error.is_some_and(|error| renderer.film().typical_error() <= error.0) {
            Some(Stopped::Error)
        } else {
            None
        }
    };
    let mut progress = Progress::new(arguments.quiet, time.map(|time| time.0), error.map(|error| error.0));
    interrupt::begin_rendering();
    let stopped = loop {
        if let Some(stopped) = is_over(renderer) {
            break stopped;
        }
        renderer.pass(renderer.next_pass());
        progress.update(renderer);
        if let Some(keeper) = &mut keeper {
            keeper.after_pass(|| snapshot(renderer));
        }
    };
    progress.finish();
    let is_kept = keeper.is_none_or(|mut keeper| {
        let is_output =
            |output: &RenderOutput| matches!(output, RenderOutput::Checkpoint(path) if path == keeper.path());
        if outputs.iter().any(is_output) {
            // It is about to be written anyway.
            keeper.wait();
            return true;
        }
        keeper.finish(|| snapshot(renderer))
    });
    (stopped, is_kept)
}

fn write(
    arguments: &RenderArguments,
    job: &Job,
    scene: &Scene,
    renderer: &Renderer<'_>,
    stopped: Stopped,
    outputs: &[RenderOutput],
    snapshot: impl Fn(&Renderer<'_>) -> Option<Checkpoint>,
) -> Result<(), Exit> {
    let tone_map = ToneMap { exposure: arguments.exposure, operator: arguments.tone_map.into() };
    let mut is_whole = true;
    let mut written: Vec<PathBuf> = Vec::new();
    for file in outputs {
        let result = match file {
            RenderOutput::Image(file) => picture(scene, renderer)
                .and_then(|image| output::write_image(&image, file, tone_map))
                .map_err(|error| error.to_string()),
            RenderOutput::Checkpoint(path) => {
                snapshot(renderer).map_or(Ok(()), |checkpoint| output::write_checkpoint(&checkpoint, path))
            }
        };
        match result {
            Ok(()) => written.push(file.path().to_owned()),
            // The other files may still be saved: hours can lie in them.
            Err(error) => {
                problems::error(&error);
                is_whole = false;
            }
        }
    }
    let report = Report::new((&job.scene_path, arguments.overrides.pbrt_coats), scene, renderer, stopped, &written);
    if let Some(path) = &arguments.report {
        let result = report.to_json().map_err(|e| e.to_string());
        match result.and_then(|json| output::write_bytes(path, &json).map_err(|e| e.to_string())) {
            Ok(()) => {}
            Err(error) => {
                problems::error(&error);
                is_whole = false;
            }
        }
    }
    if !arguments.quiet {
        if let Some(chains) = &report.chains {
            chains::warnings(chains, &scene.settings).iter().for_each(|warning| problems::warning(warning));
            print(&chains::table(chains, &scene.settings));
        }
        print(&summary(&report, arguments.report.as_deref()));
    }
    if is_whole { Ok(()) } else { Err(Exit::Output) }
}

/// What has been rendered, with what a file should know of it.
fn picture(scene: &Scene, renderer: &Renderer<'_>) -> Result<Image, ImageError> {
    let settings = &scene.settings;
    let mut image = renderer.film().to_image()?;
    let samples = renderer.samples_done();
    let at_most = if settings.adaptive.is_some() { "at most " } else { "" };
    let what = if settings.integrator.metropolis().is_some() { "mutations" } else { "samples" };
    let comment = format!("{at_most}{samples} {what} per pixel, seed {}", settings.seed);
    let origin = [settings.bounds.x0, settings.bounds.y0];
    describe(&mut image, Chromaticities::of(settings.color_space), origin, settings.resolution, comment);
    Ok(image)
}

/// What was rendered, what it cost, what it is worth, and where it is.
fn summary(report: &Report<'_>, report_path: Option<&Path>) -> String {
    let what = if report.chains.is_some() { "mutations" } else { "samples" };
    let mut parts = vec![
        format!("{} {what} per pixel", report.samples),
        format!("{} paths", progress::si(report.paths as f64)),
        format!("{} rays/s", progress::si(report.rays_per_second)),
        progress::duration(report.seconds.render),
        progress::relative_error(report.relative_error.unwrap_or(f64::INFINITY)),
    ];
    if report.settings.adaptive.is_some() {
        parts[0] = format!("{:.1} samples per pixel, at most {}", report.mean_samples, report.samples);
    }
    match report.stopped {
        Stopped::Finished => {}
        Stopped::Time => parts[0] = format!("time is over after {}", parts[0]),
        Stopped::Error => parts[0] = format!("the error is reached after {}", parts[0]),
        Stopped::Interrupted => {
            let wanted = report.settings.sample_limit;
            let of = if wanted < UNLIMITED { format!(" of {wanted}") } else { String::new() };
            parts[0] = format!("interrupted after {}{of} {what} per pixel", report.samples);
        }
    }
    let dropped = &report.dropped_samples;
    for (count, why) in [(dropped.not_finite, "not finite"), (dropped.panics, "the program failed in them")] {
        if count > 0 {
            parts.push(format!("{count} samples dropped: {why}"));
        }
    }
    if let Some(Incident { pixel: [x, y], half, sample, .. }) = dropped.first.first() {
        let half = if *half > 0 { " --half 1" } else { "" };
        parts.push(format!("follow the first with `luz trace --pixel {x},{y} --sample {sample}{half}`"));
    }
    let files: Vec<String> =
        report.outputs.iter().map(PathBuf::as_path).chain(report_path).map(|p| p.display().to_string()).collect();
    let files = if files.is_empty() { "nothing".to_owned() } else { files.join(", ") };
    format!("{}\nwrote {files}\n", parts.join(" · "))
}
