//! Film, filter, sampler, integrator and camera out of a scene's descriptions of them.

use super::{Context, spectra, unsupported};
use crate::camera::{Camera, Lens, Projection, ScreenWindow};
use crate::film::{Film, FilmContents, FilmKind, FilmLayers, Filter, FilterKind, PixelBounds};
use crate::integrator::Integrator;
use crate::light::ScaledSpectrum;
use crate::settings::{Crop, Overrides, Settings};
use crate::sphere_map::SphereMap;
use glam::Vec2;
use luz_color::{Sensor, Spectrum, spectrum_to_photometric};
use luz_geometry::AnimatedTransform;
use luz_sample::SamplerKind;
use luz_scene::{Description, Diagnostic, Entity};

/// Frames wider or higher than this are taken for a slip of the keyboard.
const MAX_RESOLUTION: u32 = 1 << 16;

pub(super) fn settings(context: &mut Context<'_>, overrides: &Overrides) -> Settings {
    let description = context.description;
    let film = &description.film;
    let kind = overrides.film.unwrap_or_else(|| match &*film.kind {
        "rgb" => FilmKind::Rgb,
        "gbuffer" => FilmKind::GBuffer,
        _ => {
            unsupported(context, film, "film");
            FilmKind::Rgb
        }
    });
    let resolution = overrides.resolution.unwrap_or_else(|| {
        [("xresolution", 1280), ("yresolution", 720)].map(|(name, default)| {
            let value = film.parameters.one_integer(name, default, context.diagnostics);
            if !(1..=MAX_RESOLUTION as i32).contains(&value) {
                let span = film.parameters.span(name);
                context
                    .diagnostics
                    .error(span, format!("`{name}` must lie within 1 and {MAX_RESOLUTION}, not {value}"));
            }
            value.clamp(1, MAX_RESOLUTION as i32) as u32
        })
    });
    let bounds = pixel_bounds(context, film, resolution, overrides.crop);
    let mut integrator = super::integrator::integrator(context, overrides);
    let filter = overrides.filter.clone().unwrap_or_else(|| filter(context, &description.pixel_filter));
    let contents = FilmContents {
        layers: FilmLayers { features: kind == FilmKind::GBuffer, techniques: overrides.technique_images },
        halves: overrides.adaptive.is_some(),
        signed: filter.is_signed(),
        splats: integrator.splat_contents(),
    };
    if bounds.area() > PixelBounds::MOST_PIXELS || !Film::fits_in_memory(contents, bounds) {
        let (width, height) = (bounds.width(), bounds.height());
        let gigabytes = Film::bytes(contents, bounds) as f64 / 1e9;
        context.diagnostics.push(
            Diagnostic::error(
                film.span,
                format!("a film of {width}×{height} pixels takes {gigabytes:.0} GB, which cannot be had"),
            )
            .with_help("render fewer pixels, or a part of them"),
        );
    }
    let sampler = &description.sampler;
    let (sampler_kind, samples) = sampling(context, sampler, overrides);
    let mutations = super::integrator::mutations_per_pixel(context, &integrator);
    let samples_per_pixel = overrides.samples_per_pixel.or(mutations).unwrap_or(samples);
    let all_mutations = bounds.area() as u64 * u64::from(samples_per_pixel);
    super::integrator::default_bootstrap(&mut integrator, &description.integrator, overrides, all_mutations);
    let option_seed = description.options.seed.map_or(0, |s| s.value);
    let seed = sampler.parameters.one_integer("seed", option_seed, context.diagnostics);
    let (sensor, white) = sensor(context, film);
    Settings {
        resolution,
        bounds,
        film: kind,
        technique_images: overrides.technique_images,
        filter,
        sensor,
        color_space: spectra::color_space(film.color_space),
        white,
        max_component: max_component(context, film, &integrator),
        integrator,
        sampler: sampler_kind,
        samples_per_pixel,
        sample_limit: overrides.sample_limit.unwrap_or(samples_per_pixel),
        adaptive: overrides.adaptive,
        seed: overrides.seed.unwrap_or(seed as u64),
        filename: film.parameters.string("filename", context.diagnostics).map(str::to_owned),
    }
}

fn max_component(context: &mut Context<'_>, film: &Entity, integrator: &Integrator) -> f32 {
    const NAME: &str = "maxcomponentvalue";
    let value = film.parameters.one_float(NAME, f32::INFINITY, context.diagnostics);
    if value <= 0.0 {
        let span = film.parameters.span(NAME);
        context.diagnostics.error(span, format!("`{NAME}` must be positive, not {value}: nothing would be seen"));
        return f32::INFINITY;
    }
    if integrator.metropolis().is_some() && value.is_finite() {
        let span = film.parameters.span(NAME);
        let message = format!("`{NAME}` is not heeded: what chains splat is about equally bright everywhere");
        context.diagnostics.warning(span, message);
    }
    value
}

fn pixel_bounds(
    context: &mut Context<'_>,
    film: &Entity,
    [width, height]: [u32; 2],
    crop: Option<Crop>,
) -> PixelBounds {
    let from_fractions = |[x0, x1, y0, y1]: [f32; 4]| {
        let at = |fraction: f32, size: u32| (fraction.clamp(0.0, 1.0) * size as f32).ceil() as u32;
        PixelBounds {
            x0: at(x0.min(x1), width),
            x1: at(x0.max(x1), width),
            y0: at(y0.min(y1), height),
            y1: at(y0.max(y1), height),
        }
    };
    let from_pixels = |[x0, x1, y0, y1]: [u32; 4]| PixelBounds {
        x0: x0.min(width),
        x1: x1.min(width),
        y0: y0.min(height),
        y1: y1.min(height),
    };
    let four = |name: &str, found: usize, diagnostics: &mut luz_scene::Diagnostics| {
        let span = film.parameters.span(name);
        diagnostics.error(span, format!("`{name}` takes four values (x0 x1 y0 y1), not {found}"));
    };
    let mut bounds = PixelBounds { x0: 0, y0: 0, x1: width, y1: height };
    if let Some(window) = film.parameters.floats("cropwindow", context.diagnostics) {
        match <[f32; 4]>::try_from(window) {
            Ok(window) => bounds = from_fractions(window),
            Err(_) => four("cropwindow", window.len(), context.diagnostics),
        }
    } else if let Some(pixels) = film.parameters.integers("pixelbounds", context.diagnostics) {
        match <[i32; 4]>::try_from(pixels) {
            Ok(pixels) => bounds = from_pixels(pixels.map(|v| v.max(0) as u32)),
            Err(_) => four("pixelbounds", pixels.len(), context.diagnostics),
        }
    }
    match crop {
        Some(Crop::Fraction(window)) => bounds = from_fractions(window),
        Some(Crop::Pixels(pixels)) => bounds = from_pixels(pixels),
        None => {}
    }
    if bounds.x0 >= bounds.x1 || bounds.y0 >= bounds.y1 {
        context.diagnostics.error(film.span, "the crop window contains no pixel");
        return PixelBounds { x0: 0, y0: 0, x1: 1, y1: 1 };
    }
    bounds
}

/// The sensor, and the light that it sees as white.
fn sensor(context: &mut Context<'_>, film: &Entity) -> (Sensor, ScaledSpectrum) {
    let camera = &context.description.camera.entity.parameters;
    let parameters = &film.parameters;
    let space = spectra::color_space(film.color_space);
    let diagnostics = &mut *context.diagnostics;
    let exposure =
        camera.one_float("shutterclose", 1.0, diagnostics) - camera.one_float("shutteropen", 0.0, diagnostics);
    if exposure.is_nan() || exposure <= 0.0 {
        diagnostics.error(camera.span("shutterclose"), "the shutter closes before it opens: nothing would be exposed");
    }
    let imaging_ratio = exposure.max(0.0) * parameters.one_float("iso", 100.0, diagnostics) / 100.0;
    let white_balance = parameters.one_float("whitebalance", 0.0, diagnostics);
    let name = parameters.one_string("sensor", "cie1931", diagnostics);
    let white_balance = (white_balance > 0.0).then_some(white_balance);
    let sensor = Sensor::named(name, space, imaging_ratio, white_balance).unwrap_or_else(|error| {
        diagnostics.error(parameters.span("sensor"), error.to_string());
        Sensor::cie1931(space)
    });
    let white = Spectrum::Dense(space.illuminant().clone());
    let scale = 1.0 / (spectrum_to_photometric(&white) * imaging_ratio.max(f32::MIN_POSITIVE));
    (sensor, ScaledSpectrum { spectrum: white, scale })
}

fn filter(context: &mut Context<'_>, entity: &Entity) -> Filter {
    let parameters = &entity.parameters;
    let diagnostics = &mut *context.diagnostics;
    let mut number = |name: &str, default: f32| {
        let value = parameters.one_float(name, default, diagnostics);
        let is_length = !matches!(name, "B" | "C");
        if is_length && !(value > 0.0 && value.is_finite()) {
            diagnostics
                .error(parameters.span(name), format!("`{name}` of a pixel filter must be positive, not {value}"));
            return default;
        }
        value
    };
    let (radius, kind) = match &*entity.kind {
        "box" => (0.5, FilterKind::Box),
        "triangle" => (2.0, FilterKind::Triangle),
        "gaussian" => (1.5, FilterKind::Gaussian { sigma: number("sigma", 0.5) }),
        "mitchell" => (2.0, FilterKind::Mitchell { b: number("B", 1.0 / 3.0), c: number("C", 1.0 / 3.0) }),
        "sinc" => (4.0, FilterKind::LanczosSinc { tau: number("tau", 3.0) }),
        _ => {
            unsupported(context, entity, "pixel filter");
            return Filter::unit_box();
        }
    };
    let radius = Vec2::new(number("xradius", radius), number("yradius", radius));
    Filter::new(kind, radius)
}

fn sampling(context: &mut Context<'_>, entity: &Entity, overrides: &Overrides) -> (SamplerKind, u32) {
    let parameters = &entity.parameters;
    let kind = match &*entity.kind {
        "independent" => SamplerKind::Independent,
        "stratified" => SamplerKind::Stratified,
        "halton" => SamplerKind::Halton,
        "zsobol" => SamplerKind::ZSobol,
        "sobol" | "paddedsobol" => SamplerKind::Sobol,
        "pmj02bn" => {
            context.diagnostics.warning(
                entity.kind_span,
                "`pmj02bn` points are drawn from the `sobol` sampler: both are stratified in all elementary intervals",
            );
            SamplerKind::Sobol
        }
        _ => {
            unsupported(context, entity, "sampler");
            SamplerKind::Sobol
        }
    };
    let diagnostics = &mut *context.diagnostics;
    let samples = if &*entity.kind == "stratified" {
        let x = parameters.one_integer("xsamples", 4, diagnostics);
        x.saturating_mul(parameters.one_integer("ysamples", 4, diagnostics))
    } else {
        parameters.one_integer("pixelsamples", 16, diagnostics)
    };
    if samples < 1 {
        diagnostics.error(entity.span, format!("a picture needs at least one sample per pixel, not {samples}"));
    }
    (overrides.sampler.unwrap_or(kind), samples.max(1) as u32)
}

pub(super) fn camera(context: &mut Context<'_>, description: &Description, resolution: [u32; 2]) -> Camera {
    let entity = &description.camera.entity;
    let parameters = &entity.parameters;
    let aspect =
        parameters.one_float("frameaspectratio", resolution[0] as f32 / resolution[1] as f32, context.diagnostics);
    let mut window = ScreenWindow::of_aspect(aspect);
    if let Some(list) = parameters.floats("screenwindow", context.diagnostics) {
        match <[f32; 4]>::try_from(list) {
            Ok([x0, x1, y0, y1]) if x0 != x1 && y0 != y1 => {
                window = ScreenWindow { min: Vec2::new(x0, y0), max: Vec2::new(x1, y1) };
            }
            _ => {
                let span = parameters.span("screenwindow");
                context
                    .diagnostics
                    .error(span, "`screenwindow` takes four values: x0 x1 y0 y1, with x0 ≠ x1 and y0 ≠ y1");
            }
        }
    }
    let diagnostics = &mut *context.diagnostics;
    let lens = Lens {
        radius: parameters.one_float("lensradius", 0.0, diagnostics).max(0.0),
        focal_distance: parameters.one_float("focaldistance", 1e6, diagnostics),
    };
    let shutter =
        [parameters.one_float("shutteropen", 0.0, diagnostics), parameters.one_float("shutterclose", 1.0, diagnostics)];
    let mut field_of_view = 90.0;
    let projection = match &*entity.kind {
        "perspective" => {
            field_of_view = parameters.one_float("fov", 90.0, diagnostics);
            if !(field_of_view > 0.0 && field_of_view < 180.0) {
                diagnostics.error(
                    parameters.span("fov"),
                    format!("a field of view lies within 0 and 180 degrees, exclusively, not {field_of_view}"),
                );
                field_of_view = 90.0;
            }
            Projection::Perspective
        }
        "orthographic" => Projection::Orthographic,
        "spherical" => Projection::Spherical(match parameters.one_string("mapping", "equalarea", diagnostics) {
            "equalarea" => SphereMap::EqualArea,
            "equirectangular" => SphereMap::LatitudeLongitude,
            other => {
                diagnostics.push(
                    Diagnostic::error(parameters.span("mapping"), format!("unknown mapping `{other}`"))
                        .with_help("known are `equalarea` and `equirectangular`"),
                );
                SphereMap::EqualArea
            }
        }),
        _ => {
            unsupported(context, entity, "camera");
            Projection::Perspective
        }
    };
    let placed = description.camera.camera_from_world;
    let [start, end] = [placed.start, placed.end].map(|m| context.transform(m, entity.span).inverse());
    let [start_time, end_time] = description.transform_times;
    let world_from_camera = AnimatedTransform::new(start, start_time, end, end_time);
    Camera::new(projection, field_of_view, window, lens, shutter, resolution, world_from_camera)
}
