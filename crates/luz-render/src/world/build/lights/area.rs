//! Emitting surfaces out of their description.

use super::super::images::Images;
use super::super::{Context, unsupported};
use super::{emission, illuminant, photometric, radiating};
use crate::light::Emission;
use crate::texture::{SpectrumKind, TexelFilter};
use luz_image::WrapMode;
use luz_scene::Entity;
use std::f32::consts::PI;

/// The emission of an area light, without the factor of `power`, which depends on the primitive's area.
pub(in super::super) fn area_emission(
    context: &mut Context<'_>,
    images: &mut Images,
    entity: &Entity,
) -> Option<Emission> {
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
pub(in super::super) fn power_factor(
    context: &mut Context<'_>,
    entity: &Entity,
    emission: &Emission,
    area: f32,
) -> f32 {
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
