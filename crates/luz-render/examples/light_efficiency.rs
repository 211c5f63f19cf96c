//! How well lights are sampled: variance per sample and per second, in ratios of one run.
//!
//!     cargo run --release -p luz-render --example light_efficiency -- many
//!     cargo run --release -p luz-render --example light_efficiency -- environment FOLDER
//!     cargo run --release -p luz-render --example light_efficiency -- emitters
//!
//! `many` compares the ways of choosing among 10, 10³, and 10⁵ lights; `environment` environment maps with and without MIS
//! compensation, for each image in a folder; `emitters` surfaces that shine with an image, drawn by it and evenly.
//! Variants are rendered in turns, pass by pass, so that a busy machine is fair to all.
//!
//! The variance is the mean over pixels of the relative variance of one sample (ε = 1 % of the picture's mean), estimated
//! by the film; its errors are not known where fireflies are rare, so look at the mean, too.

use luz_geometry::SimdLevel;
use luz_image::Image;
use luz_render::film::{Film, Filter};
use luz_render::light::LightSampler;
use luz_render::world::{Loaded, build};
use luz_render::{Overrides, Renderer};
use luz_scene::{Diagnostics, read};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

fn main() -> Result<(), String> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments.as_slice() {
        ["many"] => many(),
        ["environment", folder] => environment(Path::new(folder)),
        ["emitters"] => emitters(),
        _ => Err("expected `many`, `environment FOLDER` or `emitters`".to_owned()),
    }
}

/// One way of rendering a scene.
struct Variant {
    name: String,
    loaded: Loaded,
}

/// What was measured of it.
struct Measured {
    /// Relative variance of one sample.
    variance: f64,
    /// Seconds of one sample of all pixels.
    seconds: f64,
    /// The mean of the picture, and its standard error.
    mean: (f64, f64),
}

fn variant(name: &str, file: &Path, wishes: Overrides) -> Result<Variant, String> {
    let (description, _) = read(file).map_err(|errors| errors.to_string())?;
    let wishes = Overrides {
        filter: Some(Filter::unit_box()),
        sampler: Some(luz_sample::SamplerKind::Independent),
        samples_per_pixel: Some(1 << 20),
        ..wishes
    };
    let mut diagnostics = Diagnostics::default();
    let loaded = build(&description, &wishes, SimdLevel::Auto, &mut diagnostics)
        .ok_or_else(|| diagnostics.render(&description.sources))?;
    Ok(Variant { name: name.to_owned(), loaded })
}

/// Renders all variants in turns, about `seconds` each.
fn measure(variants: &[Variant], seconds: f64) -> Vec<Measured> {
    let mut renderers: Vec<Renderer<'_>> =
        variants.iter().map(|v| Renderer::new(&v.loaded.world, &v.loaded.camera, &v.loaded.settings)).collect();
    while renderers.iter().any(|r| r.cost().seconds < seconds) {
        for renderer in renderers.iter_mut().filter(|r| r.cost().seconds < seconds) {
            let samples = if renderer.samples_done() == 0 { 1 } else { renderer.samples_done().min(16) };
            renderer.pass(samples);
        }
    }
    renderers
        .iter()
        .map(|renderer| {
            let samples = f64::from(renderer.samples_done());
            let (variance, mean) = relative_variance(renderer.film());
            Measured { variance: variance * samples, seconds: renderer.cost().seconds / samples, mean }
        })
        .collect()
}

/// The mean over pixels of Var / (mean² + ε²), of the pixels' means; and the picture's mean.
fn relative_variance(film: &Film) -> (f64, (f64, f64)) {
    let grey = |rgb: [f64; 3]| (rgb[0] + rgb[1] + rgb[2]) / 3.0;
    let pixels: Vec<_> = film.estimates().collect();
    let mean = pixels.iter().map(|p| grey(p.mean)).sum::<f64>() / pixels.len() as f64;
    let epsilon = 0.01 * mean;
    let relative = pixels.iter().map(|p| grey(p.variance) / (grey(p.mean).powi(2) + epsilon * epsilon));
    let error = pixels.iter().map(|p| grey(p.variance)).sum::<f64>().sqrt() / pixels.len() as f64;
    (relative.sum::<f64>() / pixels.len() as f64, (mean, error))
}

/// Prints each variant against the first, and returns their efficiencies relative to it.
fn report(title: &str, variants: &[Variant], seconds: f64) -> Vec<f64> {
    let measured = measure(variants, seconds);
    let first = &measured[0];
    println!("{title}");
    let mut efficiencies = Vec::new();
    for (variant, m) in variants.iter().zip(&measured) {
        let efficiency = (first.variance * first.seconds) / (m.variance * m.seconds);
        efficiencies.push(efficiency);
        println!(
            "  {:<24} variance {:>10.4} ({:.3}×)  {:>8.3} ms/sample ({:.3}×)  efficiency {:.3}  mean {:.5} ± {:.5}",
            variant.name,
            m.variance,
            m.variance / first.variance,
            1e3 * m.seconds,
            m.seconds / first.seconds,
            efficiency,
            m.mean.0,
            m.mean.1,
        );
    }
    efficiencies
}

fn scratch(name: &str, text: &str) -> Result<PathBuf, String> {
    let folder = std::env::temp_dir().join(format!("luz-light-efficiency-{}", std::process::id()));
    std::fs::create_dir_all(&folder).map_err(|e| e.to_string())?;
    let path = folder.join(name);
    std::fs::write(&path, text).map_err(|e| e.to_string())?;
    Ok(path)
}

const HEAD: &str = r#"
    Film "rgb" "integer xresolution" 96 "integer yresolution" 64
    Integrator "path" "integer maxdepth" 1
"#;

/// A hall full of small hanging lamps of different strength.
fn many() -> Result<(), String> {
    for count in [10u32, 1000, 100_000] {
        let mut text = format!(
            "{HEAD} LookAt 0 18 -12  0 0 0  0 1 0 Camera \"perspective\" \"float fov\" 60 WorldBegin\n
            Material \"diffuse\" \"rgb reflectance\" [0.6 0.6 0.6]
            Shape \"bilinearmesh\" \"point3 P\" [-20 0 -20  -20 0 20  20 0 -20  20 0 20]
            AttributeBegin Translate -3 1.2 0 Shape \"sphere\" \"float radius\" 1.2 AttributeEnd
            AttributeBegin Translate 3 1.2 2 Shape \"sphere\" \"float radius\" 1.2 AttributeEnd
            AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\n"
        );
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / (1u64 << 24) as f64
        };
        let size = 0.6 / f64::from(count).sqrt();
        for kind in 0..8 {
            // Eight strengths, from 1 to 128: lamps share their entity with those of the same strength.
            let _ = writeln!(
                text,
                "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [1 0.9 0.8] \"float scale\" {}",
                1 << kind
            );
            let lamps = (count as usize + 7 - kind) / 8;
            let (mut points, mut indices) = (String::new(), String::new());
            for lamp in 0..lamps {
                // Hung at all heights, shining down or aslant: the camera, above them, sees none.
                let (x, y, z) = (random() * 30.0 - 15.0, 0.3 + random() * 4.0, random() * 30.0 - 15.0);
                let slant = (random() - 0.5) * size;
                let corner = |dx: f64, dz: f64| format!("{} {} {}  ", x + dx * size, y + slant * dx, z + dz * size);
                points.push_str(&(corner(0.0, 0.0) + &corner(1.0, 0.0) + &corner(0.0, 1.0)));
                let _ = write!(indices, "{} {} {} ", 3 * lamp, 3 * lamp + 1, 3 * lamp + 2);
            }
            let _ = writeln!(
                text,
                "Shape \"trianglemesh\" \"point3 P\" [{points}] \"integer indices\" [{indices}] AttributeEnd"
            );
        }
        text.push_str("AttributeEnd");
        let file = scratch(&format!("many-{count}.pbrt"), &text)?;
        let variants = [LightSampler::Power, LightSampler::Bvh, LightSampler::Uniform]
            .into_iter()
            .map(|sampler| {
                variant(&sampler.to_string(), &file, Overrides { light_sampler: Some(sampler), ..Overrides::default() })
            })
            .collect::<Result<Vec<_>, _>>()?;
        report(&format!("{count} lights"), &variants, 6.0);
    }
    Ok(())
}

/// Each map over a floor with a diffuse and two glossy balls.
fn environment(folder: &Path) -> Result<(), String> {
    let mut maps: Vec<PathBuf> = std::fs::read_dir(folder)
        .map_err(|e| e.to_string())?
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|e| e == "exr" || e == "hdr" || e == "pfm"))
        .collect();
    maps.sort();
    let materials = [
        (
            "mixed",
            "Material \"diffuse\" \"rgb reflectance\" [0.6 0.5 0.4]",
            "Material \"conductor\" \"float roughness\" 0.2",
        ),
        ("diffuse", "Material \"diffuse\" \"rgb reflectance\" [0.6 0.5 0.4]", "Material \"diffuse\""),
        (
            "glossy",
            "Material \"coateddiffuse\" \"rgb reflectance\" [0.6 0.5 0.4] \"float roughness\" 0.3",
            "Material \"conductor\" \"float roughness\" 0.1",
        ),
    ];
    let mut all = Vec::new();
    for map in &maps {
        for (kind, floor, ball) in materials {
            let text = format!(
                "{HEAD} LookAt 0 3 -7  0 0.7 0  0 1 0 Camera \"perspective\" \"float fov\" 40 WorldBegin
                AttributeBegin Rotate 90 -1 0 0 LightSource \"infinite\" \"string filename\" \"{}\" AttributeEnd
                {floor} Shape \"bilinearmesh\" \"point3 P\" [-5 0 -5  -5 0 5  5 0 -5  5 0 5]
                AttributeBegin Translate -1.2 0.9 0 Shape \"sphere\" \"float radius\" 0.9 AttributeEnd
                {ball} AttributeBegin Translate 1.2 0.9 0 Shape \"sphere\" \"float radius\" 0.9 AttributeEnd",
                map.display()
            );
            let file = scratch("environment.pbrt", &text)?;
            let of = |name: &str, compensated: bool| {
                let wishes = Overrides { mis_compensation: Some(compensated), ..Overrides::default() };
                variant(name, &file, wishes)
            };
            let variants = [of("plain", false)?, of("compensated", true)?];
            let name = map.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            all.push(report(&format!("{name}, {kind}"), &variants, 2.5)[1]);
        }
    }
    let geometric = (all.iter().map(|e| e.ln()).sum::<f64>() / all.len() as f64).exp();
    let least = all.iter().copied().fold(f64::INFINITY, f64::min);
    println!("efficiency of compensation: geometric mean {geometric:.3}, least {least:.3}, of {} scenes", all.len());
    Ok(())
}

/// A video wall of mostly dark pixels over a floor: near, far, and on triangles.
fn emitters() -> Result<(), String> {
    let size = [96usize, 54];
    let texel = |x: usize, y: usize| match (x * 31 + y * 17) % 97 {
        0 => [30.0f32, 20.0, 10.0],
        n if n < 40 => [0.0; 3],
        _ => [0.2, 0.1, 0.4],
    };
    let data = (0..size[0] * size[1]).flat_map(|i| texel(i % size[0], i / size[0])).collect();
    let image = Image::from_data(size[0], size[1], ["R", "G", "B"], data).map_err(|e| e.to_string())?;
    let path = scratch("wall.pfm", "")?;
    image.write(&path).map_err(|e| e.to_string())?;
    let corners = "-3 0.5 3  3 0.5 3  -3 4 3  3 4 3";
    for (name, shape) in [
        ("patch", format!("Shape \"bilinearmesh\" \"point3 P\" [{corners}]")),
        (
            "triangles",
            format!(
                "Shape \"trianglemesh\" \"point3 P\" [{corners}] \"integer indices\" [0 1 2 1 3 2] \"point2 uv\" [0 0 1 0 0 1 1 1]"
            ),
        ),
        ("sphere", "Translate 0 2 3 Shape \"sphere\" \"float radius\" 1.5".to_owned()),
    ] {
        let text = format!(
            "{HEAD} LookAt 0 3 -7  0 0.7 0  0 1 0 Camera \"perspective\" \"float fov\" 40 WorldBegin
            AttributeBegin AreaLightSource \"diffuse\" \"string filename\" \"wall.pfm\" \"bool twosided\" true {shape} AttributeEnd
            Material \"diffuse\" Shape \"bilinearmesh\" \"point3 P\" [-5 0 -5  -5 0 5  5 0 -5  5 0 5]"
        );
        let file = scratch(&format!("emitter-{name}.pbrt"), &text)?;
        let by_image = variant("by image", &file, Overrides::default())?;
        let evenly = Variant {
            name: "evenly".to_owned(),
            loaded: variant("evenly", &file, Overrides { emission_images: Some(false), ..Overrides::default() })?
                .loaded,
        };
        report(name, &[evenly, by_image], 4.0);
    }
    Ok(())
}
