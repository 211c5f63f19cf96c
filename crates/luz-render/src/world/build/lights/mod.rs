//! Lights out of a scene's descriptions of them.

mod area;
mod infinite;

pub(super) use area::{PowerFactor, area_emission};

use super::images::{Images, color_channels, image_color_space};
use super::{Context, spectra, unsupported};
use crate::light::{
    DistantLight, GoniometricLight, Light, PointLight, ProjectionLight, ScaledSpectrum, SpotLight, Throw,
};
use crate::texture::SpectrumKind;
use glam::Vec3;
use luz_color::{RgbColorSpace, Spectrum, spectrum_to_photometric};
use luz_geometry::Transform;
use luz_image::Image;
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
        "goniometric" => goniometric(context, images, entity, world_from_light, scale),
        "projection" => projection(context, images, entity, world_from_light, scale),
        "infinite" => infinite::infinite(context, images, entity, world_from_light, scale),
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

fn goniometric(
    context: &mut Context<'_>,
    images: &mut Images,
    entity: &Entity,
    world_from_light: Transform,
    mut scale: f32,
) -> Option<Light> {
    let spectrum = radiating(context, entity, "I");
    let parameters = &entity.parameters;
    let (size, texels) = match parameters.string("filename", context.diagnostics) {
        Some(name) => {
            let span = parameters.span("filename");
            let image = images.image(&context.description.resolve(name), None, span, context.diagnostics)?;
            let (width, height) = (image.width(), image.height());
            if width != height {
                context.diagnostics.push(
                    Diagnostic::error(
                        span,
                        format!("the image of a goniometric light is square, not {width}×{height}"),
                    )
                    .with_help("it is an equal-area octahedral map of all directions"),
                );
                return None;
            }
            let mean = |rgb: [f32; 3]| (rgb[0] + rgb[1] + rgb[2]) / 3.0;
            (width, light_texels(context, &image, span).into_iter().map(mean).collect())
        }
        None => {
            context.diagnostics.push(
                Diagnostic::warning(entity.kind_span, "a goniometric light without an image shines evenly")
                    .with_help("`\"string filename\"` names the image of its intensities"),
            );
            (1, vec![1.0f32])
        }
    };
    if let Some(power) = photometric(context, entity, "power") {
        let mean = texels.iter().map(|&v| f64::from(v)).sum::<f64>() / texels.len() as f64;
        scale *= if mean > 0.0 { power / (4.0 * PI * mean as f32) } else { 0.0 };
    }
    let light = GoniometricLight::new(world_from_light, emission(&spectrum, scale), size, texels);
    Some(Light::Goniometric(Box::new(light)))
}

fn projection(
    context: &mut Context<'_>,
    images: &mut Images,
    entity: &Entity,
    world_from_light: Transform,
    mut scale: f32,
) -> Option<Light> {
    let parameters = &entity.parameters;
    let span = parameters.span("filename");
    let field_of_view = parameters.one_float("fov", 90.0, context.diagnostics);
    if !(field_of_view > 0.0 && field_of_view < 180.0) {
        context.diagnostics.error(
            parameters.span("fov"),
            format!("a field of view lies within 0 and 180 degrees, exclusively, not {field_of_view}"),
        );
        return None;
    }
    let name = parameters.string("filename", context.diagnostics)?;
    let image = images.image(&context.description.resolve(name), None, span, context.diagnostics)?;
    let size @ [width, height] = [image.width(), image.height()];
    let texels = light_texels(context, &image, span);
    let space = image_color_space(&image);
    space.sigmoid_table();
    scale /= spectrum_to_photometric(&illuminant(space));
    if let Some(power) = photometric(context, entity, "power") {
        let throw = Throw::new(field_of_view, width as f32 / height as f32);
        let emitted = texels.iter().enumerate().map(|(i, rgb)| {
            f64::from(space.luminance(*rgb)) * f64::from(throw.solid_angle([i % width, i / width], size))
        });
        let emitted = emitted.sum::<f64>() as f32;
        scale *= if emitted > 0.0 { power / emitted } else { 0.0 };
    }
    let light = ProjectionLight::new(world_from_light, field_of_view, size, texels, space, scale);
    Some(Light::Projection(Box::new(light)))
}

/// The texels of a light's image, negative and non-finite ones set to zero and counted.
fn light_texels(context: &mut Context<'_>, image: &Image, span: Option<luz_scene::Span>) -> Vec<[f32; 3]> {
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
