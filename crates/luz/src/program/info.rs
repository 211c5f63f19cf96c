//! `luz info`

use super::arguments::InfoArguments;
use super::exit::{Exit, print};
use super::problems;
use super::progress::{bytes, duration, si};
use super::report::peak_memory;
use super::values::{film_name, sampler_name};
use luz::geometry::SimdLevel;
use luz::render::world::{self, Loaded};
use luz::render::{Overrides, Settings};
use luz::scene::{Description, Diagnostic, Diagnostics, Locator, Severity, ShapeEntity};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

/// Says what is inside a scene.
pub fn run(arguments: &InfoArguments) -> Exit {
    let start = Instant::now();
    let (description, mut diagnostics) = match luz::scene::read(&arguments.scene) {
        Ok(read) => read,
        Err(errors) => {
            problems::print_all(&errors.diagnostics, &errors.sources);
            problems::error(&problems::count(&errors.diagnostics));
            return Exit::Scene;
        }
    };
    let load = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let loaded = world::build(&description, &Overrides::default(), SimdLevel::Auto, &mut diagnostics);
    let seconds = Seconds { load, build: start.elapsed().as_secs_f64() };
    let info = Info::new(&arguments.scene, &description, loaded.as_ref(), &diagnostics, seconds);
    let printed = if arguments.json {
        match serde_json::to_string_pretty(&info) {
            Ok(json) => print(&(json + "\n")),
            Err(error) => {
                problems::error(&error.to_string());
                Exit::Output
            }
        }
    } else {
        let printed = print(&info.to_text());
        problems::print_all(&diagnostics, &description.sources);
        printed
    };
    if loaded.is_none() && printed == Exit::Success { Exit::Scene } else { printed }
}

/// What is inside a scene. Counts are of what the file describes; memory is known only of a scene that can be rendered.
#[derive(Debug, Serialize)]
struct Info<'a> {
    scene: &'a Path,
    /// Is there nothing in it that cannot be rendered?
    renderable: bool,
    files: usize,
    camera: &'a str,
    film: FilmInfo,
    sampler: String,
    samples_per_pixel: Option<u32>,
    integrator: String,
    max_depth: Option<u32>,
    pixel_filter: &'a str,
    /// By kind; those in objects count once.
    shapes: BTreeMap<&'a str, u64>,
    /// In meshes, as the scene describes them; those in objects count once.
    triangles: u64,
    /// With those in objects once for every instance.
    instanced_triangles: u64,
    objects: usize,
    instances: usize,
    /// By kind.
    materials: BTreeMap<&'a str, u64>,
    /// By kind.
    textures: BTreeMap<&'a str, u64>,
    /// By kind; an emitting shape counts once.
    lights: BTreeMap<&'a str, u64>,
    /// By kind.
    media: BTreeMap<&'a str, u64>,
    memory: Option<Memory>,
    peak_memory_bytes: Option<u64>,
    seconds: Seconds,
    errors: usize,
    warnings: usize,
    problems: Vec<Problem>,
}

#[derive(Debug, Serialize)]
struct FilmInfo {
    kind: String,
    resolution: Option<[u32; 2]>,
    filename: Option<String>,
}

/// In bytes.
#[derive(Clone, Copy, Debug, Serialize)]
struct Memory {
    /// The hierarchies that rays traverse.
    hierarchy: u64,
    /// Texture images.
    textures: u64,
}

/// Wall-clock seconds.
#[derive(Debug, Serialize)]
struct Seconds {
    load: f64,
    build: f64,
}

/// A diagnostic, with its place in a person's terms.
#[derive(Debug, Serialize)]
struct Problem {
    severity: String,
    message: String,
    file: Option<String>,
    line: Option<usize>,
    column: Option<usize>,
    help: Option<String>,
}

impl Problem {
    fn new(diagnostic: &Diagnostic, locator: &mut Locator<'_>) -> Self {
        let place = diagnostic.span.map(|span| locator.locate(span));
        Self {
            severity: diagnostic.severity.to_string(),
            message: diagnostic.message.clone(),
            line: place.as_ref().map(|p| p.line),
            column: place.as_ref().map(|p| p.column),
            file: place.map(|p| p.file),
            help: diagnostic.help.clone(),
        }
    }
}

fn count<'a>(kinds: impl Iterator<Item = &'a str>) -> BTreeMap<&'a str, u64> {
    let mut counts = BTreeMap::new();
    kinds.for_each(|kind| *counts.entry(kind).or_default() += 1);
    counts
}

/// The triangles of a mesh; none of other shapes.
fn triangles(shape: &ShapeEntity) -> u64 {
    if let Some(mesh) = &shape.mesh {
        return mesh.triangles.len() as u64;
    }
    let mut ignored = Diagnostics::default();
    let parameters = &shape.entity.parameters;
    match &*shape.entity.kind {
        "trianglemesh" | "loopsubdiv" => match parameters.integers("indices", &mut ignored) {
            Some(indices) => indices.len() as u64 / 3,
            None => parameters.points3("P", &mut ignored).map_or(0, |p| p.len() as u64 / 3),
        },
        _ => 0,
    }
}

impl<'a> Info<'a> {
    fn new(
        scene: &'a Path,
        description: &'a Description,
        loaded: Option<&Loaded>,
        diagnostics: &Diagnostics,
        seconds: Seconds,
    ) -> Self {
        let in_objects: Vec<u64> = description.objects.iter().map(|o| o.shapes.iter().map(triangles).sum()).collect();
        let outside: u64 = description.shapes.iter().map(triangles).sum();
        let instanced: u64 = description.instances.iter().map(|i| in_objects.get(i.object).copied().unwrap_or(0)).sum();
        let all_shapes = || description.shapes.iter().chain(description.objects.iter().flat_map(|o| &o.shapes));
        let emitting = all_shapes().filter_map(|s| s.area_light).filter_map(|i| description.area_lights.get(i));
        let lights = description.lights.iter().map(|l| &*l.entity.kind);
        // The first is the default, which most scenes never use.
        let materials = description
            .materials
            .iter()
            .enumerate()
            .filter(|(index, _)| *index > 0 || all_shapes().any(|shape| shape.material == 0));
        let settings = loaded.map(|l| &l.settings);
        let mut locator = Locator::new(&description.sources);
        Self {
            scene,
            renderable: loaded.is_some(),
            files: description.sources.files().len(),
            camera: &description.camera.entity.kind,
            film: film(description, settings),
            sampler: settings.map_or(&*description.sampler.kind, |s| sampler_name(s.sampler)).to_owned(),
            samples_per_pixel: settings.map(|s| s.samples_per_pixel),
            integrator: description.integrator.kind.to_string(),
            max_depth: settings.map(|s| s.integrator.max_depth()),
            pixel_filter: &description.pixel_filter.kind,
            shapes: count(all_shapes().map(|s| &*s.entity.kind)),
            triangles: outside + in_objects.iter().sum::<u64>(),
            instanced_triangles: outside + instanced,
            objects: description.objects.len(),
            instances: description.instances.len(),
            materials: count(materials.map(|(_, m)| &*m.entity.kind)),
            textures: count(description.textures.iter().map(|t| &*t.entity.kind)),
            lights: count(lights.chain(emitting.map(|e| if &*e.kind == "diffuse" { "area" } else { &*e.kind }))),
            media: count(description.media.iter().map(|m| &*m.entity.kind)),
            memory: loaded.map(|l| {
                let statistics = l.world.statistics();
                Memory { hierarchy: statistics.hierarchy_bytes, textures: statistics.texture_bytes }
            }),
            peak_memory_bytes: peak_memory(),
            seconds,
            errors: diagnostics.error_count(),
            warnings: diagnostics.warning_count(),
            problems: diagnostics.iter().map(|d| Problem::new(d, &mut locator)).collect(),
        }
    }

    fn to_text(&self) -> String {
        let mut out = String::new();
        let mut line = |name: &str, text: String| {
            // Writing to a string cannot fail.
            let _ = writeln!(out, "{name:<13}{text}");
        };
        let kinds = |counts: &BTreeMap<&str, u64>| {
            let total: u64 = counts.values().sum();
            let each: Vec<String> = counts.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
            if each.is_empty() { "none".to_owned() } else { format!("{total} ({})", each.join(", ")) }
        };
        line(
            "scene",
            format!("{}, {} file{}", self.scene.display(), self.files, if self.files == 1 { "" } else { "s" }),
        );
        line("camera", self.camera.to_owned());
        let resolution = self.film.resolution.map(|[w, h]| format!(", {w} × {h}")).unwrap_or_default();
        let filename = self.film.filename.as_ref().map(|name| format!(", `{name}`")).unwrap_or_default();
        line("film", format!("{}{resolution}{filename}", self.film.kind));
        line("filter", self.pixel_filter.to_owned());
        let samples = self.samples_per_pixel.map(|n| format!(", {n} samples per pixel")).unwrap_or_default();
        line("sampler", format!("{}{samples}", self.sampler));
        let depth = self.max_depth.map(|n| format!(", paths of up to {n} bounces")).unwrap_or_default();
        line("integrator", format!("{}{depth}", self.integrator));
        line("shapes", kinds(&self.shapes));
        let instanced = if self.instanced_triangles != self.triangles {
            format!(", {} with instances", si(self.instanced_triangles as f64))
        } else {
            String::new()
        };
        line("triangles", format!("{}{instanced}", si(self.triangles as f64)));
        if self.objects > 0 {
            line(
                "instances",
                format!("{} of {} object{}", self.instances, self.objects, if self.objects == 1 { "" } else { "s" }),
            );
        }
        line("materials", kinds(&self.materials));
        line("textures", kinds(&self.textures));
        line("lights", kinds(&self.lights));
        if !self.media.is_empty() {
            line("media", kinds(&self.media));
        }
        if let Some(Memory { hierarchy, textures }) = self.memory {
            let peak = self.peak_memory_bytes.map(|p| format!(", at most {} at once", bytes(p))).unwrap_or_default();
            line("memory", format!("{} hierarchy, {} textures{peak}", bytes(hierarchy), bytes(textures)));
        }
        line("time", format!("{} to load, {} to build", duration(self.seconds.load), duration(self.seconds.build)));
        let unsupported = self.problems.iter().filter(|p| p.severity == Severity::Error.to_string()).count();
        line(
            "renderable",
            if self.renderable { "yes".to_owned() } else { format!("no: {} below", plural(unsupported)) },
        );
        out
    }
}

fn film(description: &Description, settings: Option<&Settings>) -> FilmInfo {
    match settings {
        Some(settings) => FilmInfo {
            kind: film_name(settings.film).to_owned(),
            resolution: Some(settings.resolution),
            filename: settings.filename.clone(),
        },
        None => FilmInfo { kind: description.film.kind.to_string(), resolution: None, filename: None },
    }
}

fn plural(reasons: usize) -> String {
    if reasons == 1 { "one reason".to_owned() } else { format!("{reasons} reasons") }
}
