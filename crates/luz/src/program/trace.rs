//! `luz trace`: one sample, vertex by vertex.

use super::arguments::OverrideArguments;
use super::exit::{Exit, print};
use super::pieces::TraceArguments;
use super::problems;
use super::render::{overrides, refuse};
use luz::Scene;
use luz::color::{SampledSpectrum, Wavelengths};
use luz::geometry::{SimdLevel, SurfacePoint};
use luz::render::integrator::{FoundBy, LightEvent, PathEnd, PathEvent, PathObserver};
use std::fmt::Write;
use std::path::Path;

/// Prints the path of one sample.
pub fn run(arguments: &TraceArguments) -> Exit {
    let place = Place { pixel: arguments.pixel.0, half: arguments.half, sample: arguments.sample };
    trace(&arguments.scene, &arguments.overrides, SimdLevel::Auto, place)
}

/// Which sample.
#[derive(Clone, Copy)]
pub struct Place {
    /// The pixel of the frame.
    pub pixel: [u32; 2],
    /// The half of the pixel.
    pub half: u32,
    /// The number of the sample.
    pub sample: u32,
}

/// Prints the path of one sample of a scene.
pub fn trace(path: &Path, wanted: &OverrideArguments, simd: SimdLevel, place: Place) -> Exit {
    let scene = match Scene::open_with(path, &overrides(wanted), simd) {
        Ok(scene) => scene,
        Err(errors) => return refuse(&errors),
    };
    let [width, height] = scene.settings.resolution;
    let Place { pixel: [x, y], half, sample } = place;
    if x >= width || y >= height {
        problems::error(&format!("the frame has {width} × {height} pixels: there is no pixel {x},{y}"));
        return Exit::Usage;
    }
    if scene.settings.integrator.path().is_none() {
        let kind = scene.settings.integrator.kind();
        problems::error(&format!("`{kind}` has no samples that could be followed; `--integrator path` has"));
        return Exit::Usage;
    }
    let mut story = Story::default();
    let Some(rgb) = scene.renderer().trace([x, y], half, sample, &mut story) else {
        problems::error("only with --adaptive do pixels have a second half");
        return Exit::Usage;
    };
    let [r, g, b] = rgb;
    print(&format!(
        "pixel {x},{y} · sample {sample} · seed {}\n{}\ncolour  {r:.6} {g:.6} {b:.6}\n",
        scene.settings.seed, story.text
    ))
}

/// A path in words.
#[derive(Default)]
struct Story {
    text: String,
}

impl Story {
    fn line(&mut self, what: &str, words: &str) {
        // Writing to a string does not fail.
        let _ = writeln!(self.text, "  {what:<11} {words}");
    }

    fn light(&mut self, light: &LightEvent) {
        let density = |pdf: Option<f32>| pdf.map_or("–".to_owned(), |pdf| format!("{pdf:.5}"));
        let what = match light.found_by {
            FoundBy::Bsdf if light.depth == 0 => "emits",
            FoundBy::Bsdf => "hits light",
            FoundBy::Light => "light",
        };
        let words = if light.alone.is_black() {
            format!("hidden · light pdf {}", density(light.light_pdf))
        } else {
            format!(
                "{} · weight {:.4} · light pdf {} · bsdf pdf {} · adds {}",
                spectrum(light.alone),
                light.weight,
                density(light.light_pdf),
                density(light.bsdf_pdf),
                spectrum(light.alone * light.weight)
            )
        };
        self.line(what, &words);
    }
}

fn spectrum(s: SampledSpectrum) -> String {
    format!("{:.5} [{:.5} {:.5}]", s.average(), s.min_component(), s.max_component())
}

fn point(v: impl Into<[f32; 3]>) -> String {
    let [x, y, z] = v.into();
    format!("({x:.5}, {y:.5}, {z:.5})")
}

fn place(surface: &SurfacePoint) -> String {
    format!("{} · normal {}", point(surface.position), point(surface.geometric_normal))
}

impl PathObserver for Story {
    fn wants_vertex(&self) -> bool {
        true
    }

    fn observe(&mut self, event: PathEvent<'_>, wavelengths: &Wavelengths) {
        match event {
            PathEvent::Ray { ray, depth, throughput } => {
                if depth == 0 && self.text.is_empty() {
                    let lambda = wavelengths.lambda.map(|l| format!("{l:.1}")).join(" ");
                    self.line("wavelengths", &format!("{lambda} nm"));
                }
                let from = if depth == 0 { "camera".to_owned() } else { format!("vertex {depth}") };
                let _ = writeln!(self.text, "ray from {from}");
                let words = format!("{} towards {}", point(ray.origin), point(ray.direction));
                self.line("from", &words);
                self.line("throughput", &spectrum(throughput));
            }
            PathEvent::Passage { surface } => self.line("passes", &place(surface)),
            PathEvent::Vertex(vertex) => {
                let _ = writeln!(self.text, "vertex {} · {}", vertex.depth + 1, vertex.shading.bsdf.kind());
                self.line("at", &place(vertex.surface));
                self.line("shading", &format!("normal {}", point(vertex.shading.frame.n)));
            }
            PathEvent::Light(light) => self.light(&light),
            PathEvent::Scatter { sample, direction, throughput } => {
                let lobe = if sample.flags.is_specular() { "specular" } else { "non-specular" };
                let way = if sample.flags.is_transmission() { "transmission" } else { "reflection" };
                let towards = point(direction);
                self.line("scatters", &format!("{lobe} {way} towards {towards} · pdf {:.5}", sample.pdf));
                self.line("throughput", &spectrum(throughput));
            }
            PathEvent::Roulette { expected, continuations } => {
                let words = format!("{expected:.4} continuations expected, {continuations} drawn");
                self.line("roulette", &words);
            }
            PathEvent::End(end) => self.line(
                "ends",
                match end {
                    PathEnd::Escaped => "the ray leaves the scene",
                    PathEnd::MaxDepth => "the path is as long as it may be",
                    PathEnd::Absorbed => "nothing is scattered in the direction drawn",
                    PathEnd::Roulette => "by roulette",
                    PathEnd::TooManyPassages => "too many surfaces that do not scatter",
                    PathEnd::NotFinite => "the throughput is not finite: the sample counts as dropped",
                },
            ),
        }
    }
}
