//! `luz render`

use super::arguments::{OverrideArguments, RenderArguments};
use super::exit::{Exit, print};
use super::interrupt;
use super::output::{self, default_outputs};
use super::problems;
use super::progress::{self, Progress};
use super::report::{Report, Stopped};
use super::threads;
use super::values::{OutputFile, simd_name};
use luz::Scene;
use luz::geometry::SimdLevel;
use luz::image::{Chromaticities, Image, ImageError, Placement, ToneMap};
use luz::render::bsdf::CoatWeights;
use luz::render::{Overrides, Renderer};
use luz::scene::SceneErrors;
use std::path::{Path, PathBuf};

/// Renders a scene and writes what was asked for.
pub fn run(arguments: &RenderArguments) -> Exit {
    match render(arguments) {
        Ok(exit) | Err(exit) => exit,
    }
}

fn render(arguments: &RenderArguments) -> Result<Exit, Exit> {
    interrupt::install(arguments.quiet);
    threads::start(arguments.threads)?;
    check_outputs(arguments.output.iter().map(|o| o.path.as_path()).chain(arguments.report.as_deref()))?;
    let scene = open(arguments)?;
    let outputs = if arguments.output.is_empty() {
        let outputs = default_outputs(scene.settings.filename.as_deref(), &arguments.scene);
        check_outputs(outputs.iter().map(|o| o.path.as_path()))?;
        outputs
    } else {
        arguments.output.clone()
    };

    let mut renderer = scene.renderer();
    let stopped = render_passes(&mut renderer, arguments.quiet, scene.settings.samples_per_pixel);
    write(arguments, &scene, &renderer, stopped, &outputs)?;
    Ok(match stopped {
        Stopped::Finished => Exit::Success,
        Stopped::Interrupted => Exit::Interrupted,
    })
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
        integrator: wanted.integrator.map(|name| name.name().to_owned()),
        filter: wanted.filter.map(Into::into),
        film: wanted.film.map(Into::into),
        light_sampler: wanted.light_sampler,
        technique_images: wanted.technique_images,
        technique: wanted.technique,
        heuristic: wanted.mis,
        roulette: wanted.roulette,
        adaptive: wanted.adaptive.map(|share| share.0),
        coat_weights: if wanted.pbrt_coats { CoatWeights::PbrtV4 } else { CoatWeights::Exact },
    }
}

fn open(arguments: &RenderArguments) -> Result<Scene, Exit> {
    let overrides = overrides(&arguments.overrides);
    let simd = SimdLevel::from(arguments.simd);
    let scene = Scene::open_with(&arguments.scene, &overrides, simd).map_err(|errors| refuse(&errors))?;
    if !arguments.quiet {
        problems::print_all(&scene.diagnostics, &scene.sources);
        let used = scene.world.accelerator().simd();
        if simd != SimdLevel::Auto && simd != used {
            let (wanted, used) = (simd_name(simd), simd_name(used));
            problems::warning(&format!("`{wanted}` is not to be had here: rays are traced with `{used}`"));
        }
    }
    Ok(scene)
}

/// Says everything that is wrong with a scene.
pub fn refuse(errors: &SceneErrors) -> Exit {
    problems::print_all(&errors.diagnostics, &errors.sources);
    problems::error(&format!("{}; nothing was rendered", problems::count(&errors.diagnostics)));
    Exit::Scene
}

fn render_passes(renderer: &mut Renderer<'_>, is_quiet: bool, samples_per_pixel: u32) -> Stopped {
    let mut progress = Progress::new(is_quiet, samples_per_pixel);
    interrupt::begin_rendering();
    while !renderer.is_finished() {
        renderer.pass(renderer.next_pass());
        progress.update(renderer, samples_per_pixel);
        if interrupt::is_requested() {
            break;
        }
    }
    progress.finish();
    if renderer.is_finished() { Stopped::Finished } else { Stopped::Interrupted }
}

fn write(
    arguments: &RenderArguments,
    scene: &Scene,
    renderer: &Renderer<'_>,
    stopped: Stopped,
    outputs: &[OutputFile],
) -> Result<(), Exit> {
    let image = picture(scene, renderer).map_err(|error| {
        problems::error(&error.to_string());
        Exit::Output
    })?;
    let tone_map = ToneMap { exposure: arguments.exposure, operator: arguments.tone_map.into() };
    let mut is_whole = true;
    let mut written: Vec<PathBuf> = Vec::new();
    for file in outputs {
        match output::write_image(&image, file, tone_map) {
            Ok(()) => written.push(file.path.clone()),
            // The other files may still be saved: hours can lie in them.
            Err(error) => {
                problems::error(&error.to_string());
                is_whole = false;
            }
        }
    }
    let report = Report::new((&arguments.scene, arguments.overrides.pbrt_coats), scene, renderer, stopped, &written);
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
        print(&summary(&report, arguments.report.as_deref()));
    }
    if is_whole { Ok(()) } else { Err(Exit::Output) }
}

/// What has been rendered, with what a file should know of it.
fn picture(scene: &Scene, renderer: &Renderer<'_>) -> Result<Image, ImageError> {
    let settings = &scene.settings;
    let mut image = renderer.film().to_image()?;
    image.metadata.chromaticities = Some(Chromaticities::of(settings.color_space));
    let [full_width, full_height] = settings.resolution.map(|size| size as usize);
    let (x, y) = (settings.bounds.x0 as i32, settings.bounds.y0 as i32);
    image.metadata.placement = Some(Placement { x, y, full_width, full_height });
    let text = &mut image.metadata.text;
    text.insert("software".to_owned(), concat!("luz ", env!("CARGO_PKG_VERSION")).to_owned());
    // One comment: attributes without a place in the format's standard are written in any order, and equal pictures
    // should be equal files.
    let samples = renderer.samples_done();
    let at_most = if settings.adaptive.is_some() { "at most " } else { "" };
    text.insert("comments".to_owned(), format!("{at_most}{samples} samples per pixel, seed {}", settings.seed));
    Ok(image)
}

/// What was rendered, what it cost, what it is worth, and where it is.
fn summary(report: &Report<'_>, report_path: Option<&Path>) -> String {
    let mut parts = vec![
        format!("{} samples per pixel", report.samples),
        format!("{} paths", progress::si(report.paths as f64)),
        format!("{} rays/s", progress::si(report.rays_per_second)),
        progress::duration(report.seconds.render),
        progress::relative_error(report.relative_error.unwrap_or(f64::INFINITY)),
    ];
    if report.settings.adaptive.is_some() {
        parts[0] = format!("{:.1} samples per pixel, at most {}", report.mean_samples, report.samples);
    }
    if report.stopped == Stopped::Interrupted {
        parts[0] =
            format!("interrupted after {} of {} samples per pixel", report.samples, report.settings.samples_per_pixel);
    }
    if report.dropped_samples.not_finite > 0 {
        parts.push(format!("{} samples dropped: not finite", report.dropped_samples.not_finite));
    }
    let files: Vec<String> =
        report.outputs.iter().map(PathBuf::as_path).chain(report_path).map(|p| p.display().to_string()).collect();
    let files = if files.is_empty() { "nothing".to_owned() } else { files.join(", ") };
    format!("{}\nwrote {files}\n", parts.join(" · "))
}
