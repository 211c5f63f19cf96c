//! Emitting surfaces out of their description.

use super::super::images::Images;
use super::super::{Context, unsupported};
use super::{emission, illuminant, light_texels, photometric, radiating};
use crate::light::{Emission, brightness, shown};
use crate::texture::{SpectrumKind, TexelFilter};
use luz_geometry::Shape;
use luz_image::WrapMode;
use luz_sample::distribution::TexelTree;
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
        return Some(Emission {
            radiance: emission(&spectrum, scale),
            image: None,
            tree: None,
            is_drawn_by_image: false,
            two_sided,
        });
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
    let span = parameters.span("filename");
    let raw = images.image(&path, None, span, context.diagnostics)?;
    let (texels, size) = (light_texels(context, &raw, span), [raw.width(), raw.height()]);
    let tree = images.brightness_tree(&path, || texel_tree(&texels, size, brightness));
    let white = illuminant(image.color_space);
    Some(Emission {
        radiance: emission(&white, scale),
        image: Some(image),
        tree,
        is_drawn_by_image: context.draws_by_images,
        two_sided,
    })
}

/// The tree over a number of each texel; `None` where it is the same for all.
fn texel_tree(texels: &[[f32; 3]], size: [usize; 2], value: impl Fn([f32; 3]) -> f32) -> Option<TexelTree> {
    let values: Vec<f32> = texels.iter().map(|rgb| value(*rgb)).collect();
    let is_even = values.iter().all(|v| *v == values[0]);
    if is_even { None } else { TexelTree::new(values, size).ok() }
}

/// By what factors the primitives of a shape shine for each to give `power` lumens, if that is given.
///
/// pbrt-v4 takes the mean of the whole image for that of each primitive; this is the mean under its texture coordinates.
pub(in super::super) struct PowerFactor {
    power: Option<f32>,
    luminance: Option<TexelTree>,
    even_luminance: f32,
}

impl PowerFactor {
    pub fn new(context: &mut Context<'_>, entity: &Entity, emission: &Emission) -> Self {
        let power = photometric(context, entity, "power");
        let (mut luminance, mut even_luminance) = (None, 1.0);
        if let (Some(_), Some(image)) = (power, &emission.image) {
            let texels: Vec<[f32; 3]> = image.pyramid.texels().iter().map(|rgb| shown(*rgb)).collect();
            let of = |rgb: [f32; 3]| image.color_space.luminance(rgb).max(0.0);
            even_luminance = texels.first().map_or(0.0, |rgb| of(*rgb));
            luminance = texel_tree(&texels, image.pyramid.size(), of);
        }
        Self { power, luminance, even_luminance }
    }

    /// The factor for one primitive.
    pub fn of(&self, emission: &Emission, shape: &Shape, primitive: usize, area: f32) -> f32 {
        let Some(power) = self.power else { return 1.0 };
        let sides = if emission.two_sided { 2.0 } else { 1.0 };
        let luminance = match &self.luminance {
            Some(tree) if area > 0.0 => Emission::mean_over(tree, shape, primitive),
            _ => self.even_luminance,
        };
        let emitted = sides * PI * area * luminance;
        if emitted > 0.0 { power / emitted } else { 0.0 }
    }
}
