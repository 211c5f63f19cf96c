//! Lights out of a scene's descriptions of them.

use super::images::{Images, color_channels, image_color_space};
use super::{Context, spectra, unsupported};
use crate::light::{
    DistantLight, Emission, ImageInfiniteLight, Light, PointLight, ScaledSpectrum, SpotLight, UniformInfiniteLight,
};
use crate::sphere_map::SphereMap;
use crate::texture::{SpectrumKind, TexelFilter};
use glam::Vec3;
use luz_color::{RgbColorSpace, Spectrum, spectrum_to_photometric};
use luz_geometry::Transform;
use luz_image::{Image, WrapMode};
use luz_scene::{Diagnostic, Entity, LightEntity};
use std::f32::consts::PI;
use std::sync::Arc;

/// An emission as a light's parameters give it: one unit of luminance times `scale`, as pbrt-v4 has it.
///
/// Lookups are by whole nanometres, which costs less than evaluating the spectrum.
fn emission(spectrum: &Spectrum, scale: f32) -> ScaledSpectrum {
    let photometric = spectrum_to_photometric(spectrum);
    let scale = if photometric > 0.0 { scale / photometric } else { 0.0 };
    ScaledSpectrum { spectrum: Spectrum::Dense(Arc::new(spectrum.to_dense())), scale }
}

fn radiating(context: &mut Context<'_>, entity: &Entity, name: &str) -> Spectrum {
    spectra::optional_spectrum(&entity.parameters, name, SpectrumKind::Illuminant, context.diagnostics)
        .unwrap_or_else(|| illuminant(spectra::color_space(entity.color_space)))
}

fn illuminant(space: &RgbColorSpace) -> Spectrum {
    Spectrum::Dense(space.illuminant().clone())
}

/// A light that is not a shape's; `None`, said why, where it cannot be made.
pub(super) fn light(context: &mut Context<'_>, images: &mut Images, light: &LightEntity) -> Option<Light> {
    let entity = &light.entity;
    if light.world_from_light.is_animated() {
        context.diagnostics.push(
            Diagnostic::error(entity.span, "moving lights cannot be rendered yet")
                .with_help("place the light under `ActiveTransform All`"),
        );
    }
    let world_from_light = context.transform(light.world_from_light.start, entity.span);
    let scale = entity.parameters.one_float("scale", 1.0, context.diagnostics);
    if scale < 0.0 {
        let span = entity.parameters.span("scale");
        context.diagnostics.error(span, format!("the scale of a light must not be negative: {scale}"));
    }
    match &*entity.kind {
        "point" => Some(point(context, entity, &world_from_light, scale)),
        "spot" => Some(spot(context, entity, &world_from_light, scale)),
        "distant" => Some(distant(context, entity, &world_from_light, scale)),
        "infinite" => infinite(context, images, entity, world_from_light, scale),
        _ => {
            unsupported(context, entity, "light");
            None
        }
    }
}

/// The photometric quantity of a parameter, where it is given and positive.
fn photometric(context: &mut Context<'_>, entity: &Entity, name: &str) -> Option<f32> {
    Some(entity.parameters.one_float(name, -1.0, context.diagnostics)).filter(|v| *v > 0.0)
}

fn point(context: &mut Context<'_>, entity: &Entity, world_from_light: &Transform, mut scale: f32) -> Light {
    let spectrum = radiating(context, entity, "I");
    if let Some(power) = photometric(context, entity, "power") {
        scale *= power / (4.0 * PI);
    }
    let from = entity.parameters.one_point3("from", Vec3::ZERO, context.diagnostics);
    Light::Point(PointLight { position: world_from_light.point(from), intensity: emission(&spectrum, scale) })
}

fn spot(context: &mut Context<'_>, entity: &Entity, world_from_light: &Transform, mut scale: f32) -> Light {
    let spectrum = radiating(context, entity, "I");
    let parameters = &entity.parameters;
    let diagnostics = &mut *context.diagnostics;
    let cone = parameters.one_float("coneangle", 30.0, diagnostics);
    let delta = parameters.one_float("conedeltaangle", 5.0, diagnostics);
    let from = parameters.one_point3("from", Vec3::ZERO, diagnostics);
    let to = parameters.one_point3("to", Vec3::Z, diagnostics);
    let (position, target) = (world_from_light.point(from), world_from_light.point(to));
    let axis = (target - position).try_normalize().unwrap_or_else(|| {
        diagnostics.error(entity.span, "a spot light's `from` and `to` are the same point");
        Vec3::Z
    });
    let (cos_total, cos_falloff) = (cone.to_radians().cos(), (cone - delta).to_radians().cos());
    if let Some(power) = photometric(context, entity, "power") {
        scale *= power / (2.0 * PI * ((1.0 - cos_falloff) + (cos_falloff - cos_total) / 2.0));
    }
    Light::Spot(SpotLight { position, axis, intensity: emission(&spectrum, scale), cos_total, cos_falloff })
}

fn distant(context: &mut Context<'_>, entity: &Entity, world_from_light: &Transform, mut scale: f32) -> Light {
    let spectrum = radiating(context, entity, "L");
    let parameters = &entity.parameters;
    let from = parameters.one_point3("from", Vec3::ZERO, context.diagnostics);
    let to = parameters.one_point3("to", Vec3::Z, context.diagnostics);
    let towards = world_from_light.vector(from - to).try_normalize().unwrap_or_else(|| {
        context.diagnostics.error(entity.span, "a distant light's `from` and `to` are the same point");
        Vec3::Z
    });
    if let Some(illuminance) = photometric(context, entity, "illuminance") {
        scale *= illuminance;
    }
    Light::Distant(DistantLight { towards, irradiance: emission(&spectrum, scale) })
}

fn infinite(
    context: &mut Context<'_>,
    images: &mut Images,
    entity: &Entity,
    world_from_light: Transform,
    mut scale: f32,
) -> Option<Light> {
    let parameters = &entity.parameters;
    if parameters.contains("portal") {
        let span = parameters.span("portal");
        context.diagnostics.error(span, "portals cannot be rendered yet");
        return None;
    }
    let illuminance = photometric(context, entity, "illuminance");
    let Some(name) = parameters.string("filename", context.diagnostics) else {
        let spectrum = radiating(context, entity, "L");
        if let Some(illuminance) = illuminance {
            scale *= illuminance / PI;
        }
        return Some(Light::UniformInfinite(UniformInfiniteLight { radiance: emission(&spectrum, scale) }));
    };
    let span = parameters.span("filename");
    if parameters.contains("L") {
        context.diagnostics.error(parameters.span("L"), "an infinite light has either `L` or an image, not both");
    }
    let path = context.description.resolve(name);
    let image = images.image(&path, None, span, context.diagnostics)?;
    let (width, height) = (image.width(), image.height());
    let map = if width == height {
        SphereMap::EqualArea
    } else if width == 2 * height {
        SphereMap::LatitudeLongitude
    } else {
        context.diagnostics.push(
            Diagnostic::error(
                span,
                format!("an environment map of {width}×{height} pixels is neither kind that is known"),
            )
            .with_help(
                "square images are equal-area octahedral maps, images twice as wide as high latitude–longitude maps",
            ),
        );
        return None;
    };
    let texels = environment_texels(context, &image, span);
    let space = image_color_space(&image);
    space.sigmoid_table();
    scale /= spectrum_to_photometric(&illuminant(space));
    if let Some(wanted) = illuminance {
        let found = upper_illuminance(map, [width, height], &texels, space);
        scale *= if found > 0.0 { wanted / found } else { 1.0 };
    }
    match ImageInfiniteLight::new(map, [width, height], texels, space, scale, world_from_light) {
        Ok(light) => Some(Light::ImageInfinite(Box::new(light))),
        Err(error) => {
            context.diagnostics.error(span, format!("`{name}` cannot light the scene: {error}"));
            None
        }
    }
}

/// The texels of an environment map, negative and non-finite ones set to zero and counted.
fn environment_texels(context: &mut Context<'_>, image: &Image, span: Option<luz_scene::Span>) -> Vec<[f32; 3]> {
    let channels = color_channels(image);
    let (mut negative, mut broken) = (0usize, 0usize);
    let texels = image
        .data()
        .chunks_exact(image.channels().len())
        .map(|texel| {
            let rgb = channels.map(|c| texel[c]);
            broken += usize::from(rgb.iter().any(|v| !v.is_finite()));
            negative += usize::from(rgb.iter().any(|v| *v < 0.0));
            rgb.map(|v| if v.is_finite() { v.max(0.0) } else { 0.0 })
        })
        .collect();
    if negative > 0 {
        context.diagnostics.warning(span, format!("{negative} texels are negative; they count as zero there"));
    }
    if broken > 0 {
        context.diagnostics.warning(span, format!("{broken} texels are not finite; they count as zero there"));
    }
    texels
}

/// The illuminance of a plane that looks up, in units of the map's white.
fn upper_illuminance(map: SphereMap, [width, height]: [usize; 2], texels: &[[f32; 3]], space: &RgbColorSpace) -> f32 {
    let mut sum = 0.0f64;
    for (i, rgb) in texels.iter().enumerate() {
        let (x, y) = ((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
        let direction = map.direction(glam::Vec2::new(x / width as f32, y / height as f32));
        if direction.z <= 0.0 {
            continue;
        }
        let solid_angle = match map {
            SphereMap::EqualArea => 4.0 * PI / (width * height) as f32,
            SphereMap::LatitudeLongitude => {
                let sin_theta = (1.0 - direction.z * direction.z).max(0.0).sqrt();
                2.0 * PI * PI * sin_theta / (width * height) as f32
            }
        };
        sum += f64::from(space.luminance(*rgb) * direction.z * solid_angle);
    }
    sum as f32
}

/// The emission of an area light, without the factor of `power`, which depends on the primitive's area.
pub(super) fn area_emission(context: &mut Context<'_>, images: &mut Images, entity: &Entity) -> Option<Emission> {
    if &*entity.kind != "diffuse" {
        unsupported(context, entity, "area light");
        return None;
    }
    let parameters = &entity.parameters;
    let scale = parameters.one_float("scale", 1.0, context.diagnostics);
    if scale < 0.0 {
        context
            .diagnostics
            .error(parameters.span("scale"), format!("the scale of a light must not be negative: {scale}"));
    }
    let two_sided = parameters.one_bool("twosided", false, context.diagnostics);
    let Some(name) = parameters.string("filename", context.diagnostics) else {
        let spectrum = radiating(context, entity, "L");
        return Some(Emission { radiance: emission(&spectrum, scale), image: None, two_sided });
    };
    if parameters.contains("L") {
        context.diagnostics.error(parameters.span("L"), "an area light has either `L` or an image, not both");
    }
    let path = context.description.resolve(name);
    let image = images.colors(
        &path,
        None,
        (WrapMode::Clamp, TexelFilter::Point),
        SpectrumKind::Illuminant,
        parameters.span("filename"),
        context.diagnostics,
    )?;
    let white = illuminant(image.color_space);
    Some(Emission { radiance: emission(&white, scale), image: Some(image), two_sided })
}

/// The factor by which `power` (in lumens, if given) scales a primitive of this area that emits `emission`.
pub(super) fn power_factor(context: &mut Context<'_>, entity: &Entity, emission: &Emission, area: f32) -> f32 {
    let Some(power) = photometric(context, entity, "power") else { return 1.0 };
    let sides = if emission.two_sided { 2.0 } else { 1.0 };
    let brightness = emission.image.as_ref().map_or(1.0, |image| {
        // Luminance of the image's mean colour.
        let mean = image.pyramid.mean();
        image.color_space.luminance(mean)
    });
    let emitted = sides * PI * area * brightness;
    if emitted > 0.0 { power / emitted } else { 0.0 }
}
