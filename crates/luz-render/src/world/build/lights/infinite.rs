//! Light from all around, out of its description.

use super::super::Context;
use super::super::images::{Images, image_color_space};
use super::{emission, illuminant, light_texels, photometric, radiating};
use crate::light::{ImageInfiniteLight, Light, Portal, PortalInfiniteLight, SphereTexels, UniformInfiniteLight};
use crate::sphere_map::SphereMap;
use crate::texture::TexelFilter;
use glam::Vec3;
use luz_color::{RgbColorSpace, Spectrum, spectrum_to_photometric, spectrum_to_xyz};
use luz_geometry::Transform;
use luz_scene::{Diagnostic, Entity, SpectrumParameter};
use std::f32::consts::PI;

/// A light all around.
pub(super) fn infinite(
    context: &mut Context<'_>,
    images: &mut Images,
    entity: &Entity,
    world_from_light: Transform,
    mut scale: f32,
) -> Option<Light> {
    let parameters = &entity.parameters;
    let portal = match parameters.points3("portal", context.diagnostics) {
        Some(points) => Some(portal(context, entity, points)?),
        None => None,
    };
    let illuminance = photometric(context, entity, "illuminance");
    let Some(name) = parameters.string("filename", context.diagnostics) else {
        let spectrum = radiating(context, entity, "L");
        if let Some(illuminance) = illuminance {
            scale *= illuminance / PI;
        }
        if let Some(portal) = portal {
            return uniform_portal(context, entity, portal, &spectrum, scale, world_from_light);
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
    let filter = if portal.is_some() { TexelFilter::Bilinear } else { texel_filter(context, entity, map)? };
    let texels = light_texels(context, &image, span);
    let space = image_color_space(&image);
    space.sigmoid_table();
    scale /= spectrum_to_photometric(&illuminant(space));
    if let Some(wanted) = illuminance {
        let found = upper_illuminance(map, [width, height], &texels, space);
        scale *= if found > 0.0 { wanted / found } else { 1.0 };
    }
    let texels = SphereTexels::new(map, filter, [width, height], texels);
    let made = match portal {
        // As fine as the map: a rectified one shows half the sphere.
        Some(portal) => texels
            .and_then(|texels| PortalInfiniteLight::new(portal, &texels, height, space, scale, world_from_light))
            .map(|light| Light::Portal(Box::new(light))),
        None => texels
            .and_then(|texels| ImageInfiniteLight::with_texels(texels, space, scale, world_from_light))
            .map(|light| Light::ImageInfinite(Box::new(light))),
    };
    match made {
        Ok(light) => Some(light),
        Err(error) => {
            context.diagnostics.error(span, format!("`{name}` cannot light the scene: {error}"));
            None
        }
    }
}

/// The portal of four points, which are in world space as in pbrt-v4.
fn portal(context: &mut Context<'_>, entity: &Entity, points: &[Vec3]) -> Option<Portal> {
    let made = <[Vec3; 4]>::try_from(points).ok().and_then(Portal::new);
    if made.is_none() {
        context.diagnostics.push(
            Diagnostic::error(entity.parameters.span("portal"), "a portal takes the four corners of a rectangle")
                .with_help(
                    "in order around it, in world space, such that (p3 - p0) × (p1 - p0) points out of the room",
                ),
        );
    }
    made
}

/// The same light from everywhere behind a portal: an environment map of one texel, as pbrt-v4 has it.
fn uniform_portal(
    context: &mut Context<'_>,
    entity: &Entity,
    portal: Portal,
    spectrum: &Spectrum,
    scale: f32,
    world_from_light: Transform,
) -> Option<Light> {
    let space = RgbColorSpace::srgb();
    space.sigmoid_table();
    let rgb = match entity.parameters.spectrum("L", context.diagnostics) {
        Some(SpectrumParameter::Rgb { rgb, .. }) => *rgb,
        Some(_) => {
            context.diagnostics.push(
                Diagnostic::warning(
                    entity.parameters.span("L"),
                    "behind a portal a spectrum counts as the RGB it looks like",
                )
                .with_help("say `\"rgb L\"`"),
            );
            space.from_xyz(spectrum_to_xyz(spectrum)).map(|v| v.max(0.0))
        }
        None => [1.0; 3],
    };
    let texels = SphereTexels::new(SphereMap::EqualArea, TexelFilter::Point, [1, 1], vec![rgb]);
    let scale = scale / spectrum_to_photometric(&illuminant(space));
    match texels.and_then(|texels| PortalInfiniteLight::new(portal, &texels, 1, space, scale, world_from_light)) {
        Ok(light) => Some(Light::Portal(Box::new(light))),
        Err(error) => {
            context.diagnostics.error(entity.parameters.span("L"), format!("`L` cannot light the scene: {error}"));
            None
        }
    }
}

/// How texels are looked up: equal-area maps as pbrt-v4 does, each for itself; others are interpolated, if not said
/// otherwise.
fn texel_filter(context: &mut Context<'_>, entity: &Entity, map: SphereMap) -> Option<TexelFilter> {
    let default = match map {
        SphereMap::EqualArea => "point",
        SphereMap::LatitudeLongitude => "bilinear",
    };
    match entity.parameters.one_string("filter", default, context.diagnostics) {
        "point" => Some(TexelFilter::Point),
        "bilinear" => Some(TexelFilter::Bilinear),
        other => {
            context.diagnostics.push(
                Diagnostic::error(
                    entity.parameters.span("filter"),
                    format!("unknown filter `{other}` of an environment map"),
                )
                .with_help("known are `point` and `bilinear`"),
            );
            None
        }
    }
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
