//! Light from all around, out of its description.

use super::super::Context;
use super::super::images::{Images, image_color_space};
use super::{emission, illuminant, light_texels, photometric, radiating};
use crate::light::{ImageInfiniteLight, Light, UniformInfiniteLight};
use crate::sphere_map::SphereMap;
use luz_color::{RgbColorSpace, spectrum_to_photometric};
use luz_geometry::Transform;
use luz_scene::{Diagnostic, Entity};
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
    let texels = light_texels(context, &image, span);
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
