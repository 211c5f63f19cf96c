//! Surfaces that emit.

use super::screen::image_coordinates;
use super::{LightBounds, LightContext, LightSample, ScaledSpectrum, Target};
use crate::texture::SpectrumImage;
use glam::{Vec2, Vec3};
use luz_color::{SampledSpectrum, Wavelengths};
use luz_geometry::{Bounds3, Reference, Shape, ShapeId, SurfacePoint};
use luz_sample::distribution::TexelTree;
use std::f64::consts::PI;
use std::sync::Arc;

/// What an emitting surface radiates, shared by all its primitives.
#[derive(Clone, Debug)]
pub struct Emission {
    /// Radiance; with an image the factor of the image alone.
    pub radiance: ScaledSpectrum,
    /// Colours over the surface's parameters, instead of the radiance's spectrum.
    pub image: Option<SpectrumImage>,
    /// The brightness of the image, by which points are drawn, shared by all that shine with it; without, all texels
    /// are the same.
    pub tree: Option<Arc<TexelTree>>,
    /// Whether points are drawn by the tree, or evenly all the same.
    pub is_drawn_by_image: bool,
    /// True if both sides emit, not just the one that the geometric normal points to.
    pub two_sided: bool,
}

impl Emission {
    /// True if light leaves towards `outgoing` from a point with this normal.
    #[inline]
    pub fn shines(&self, normal: Vec3, outgoing: Vec3) -> bool {
        self.two_sided || normal.dot(outgoing) >= 0.0
    }

    /// The mean brightness of the image over a primitive's area; 1 without image.
    pub(crate) fn brightness_over(&self, shape: &Shape, primitive: usize) -> f32 {
        match (&self.tree, &self.image) {
            (Some(tree), _) => Self::mean_over(tree, shape, primitive),
            // All texels are the same.
            (None, Some(image)) => brightness(shown(image.pyramid.nearest(Vec2::splat(0.5)))),
            (None, None) => 1.0,
        }
    }

    /// The radiance of the image at the given parameters.
    pub(super) fn image_radiance(&self, image: &SpectrumImage, uv: Vec2, wavelengths: &Wavelengths) -> SampledSpectrum {
        let rgb = shown(image.pyramid.nearest(image_coordinates(uv)));
        image.spectrum(rgb, wavelengths) * self.radiance.scale
    }
}

/// A texel as it shines: what is negative or not finite is dark.
pub(crate) fn shown(rgb: [f32; 3]) -> [f32; 3] {
    rgb.map(|v| if v.is_finite() { v.max(0.0) } else { 0.0 })
}

/// What a texel counts.
pub(crate) fn brightness(rgb: [f32; 3]) -> f32 {
    (rgb[0] + rgb[1] + rgb[2]) / 3.0
}

/// One emitting primitive: a triangle or patch of a mesh, or a whole quadric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaLight {
    /// The shape, as the accelerator numbers it.
    pub shape: u32,
    /// The primitive within the shape.
    pub primitive: u32,
    /// Which of the world's emissions.
    pub emission: u32,
    /// Factor on the emission.
    pub scale: f32,
    /// Mean over the light's area of the emission's image; 1 without.
    pub brightness: f32,
}

impl AreaLight {
    /// Draws a point of the light as seen from `reference`.
    #[inline]
    pub fn sample(
        &self,
        context: LightContext<'_>,
        reference: &Reference,
        u: Vec2,
        wavelengths: &Wavelengths,
    ) -> Option<LightSample> {
        if self.is_drawn_by_image(context) {
            return self.sample_by_image(context, reference, u, wavelengths);
        }
        let point = context.accelerator.sample_solid_angle(reference, ShapeId(self.shape), self.primitive, u)?;
        let direction = (point.position - reference.position).normalize();
        if point.pdf <= 0.0 || !direction.is_finite() {
            return None;
        }
        let radiance = context.radiance(self, point.normal, point.uv, -direction, wavelengths);
        (!radiance.is_black()).then_some(LightSample {
            radiance,
            direction,
            target: Target::Surface { position: point.position, error: point.position_error, normal: point.normal },
            pdf: point.pdf,
            is_delta: false,
        })
    }

    /// The density in solid angle with which [`sample`](Self::sample) draws from `reference` a point of the light that
    /// a ray has hit.
    #[inline]
    pub fn pdf(&self, context: LightContext<'_>, reference: &Reference, hit: &SurfacePoint) -> f32 {
        if self.is_drawn_by_image(context) {
            return self.pdf_by_image(context, reference, hit);
        }
        context.accelerator.pdf_solid_angle(reference, hit)
    }

    /// Mean radiance times area, in photometric units.
    fn strength(&self, context: LightContext<'_>) -> f64 {
        let area = f64::from(context.accelerator.shape_area(ShapeId(self.shape), self.primitive));
        let radiance = context.emissions[self.emission as usize].radiance.weight();
        area * radiance * f64::from(self.scale) * f64::from(self.brightness)
    }

    /// π A L, both sides counted.
    pub fn power(&self, context: LightContext<'_>) -> f64 {
        let sides = if context.emissions[self.emission as usize].two_sided { 2.0 } else { 1.0 };
        PI * sides * self.strength(context)
    }

    /// Where the light is and how it shines.
    pub fn bounds(&self, context: LightContext<'_>) -> LightBounds {
        let shape = context.accelerator.shape(ShapeId(self.shape));
        let primitive = self.primitive as usize;
        let strength = self.strength(context) as f32;
        // A primitive that was skipped may have indices out of range.
        let bounds = if strength > 0.0 { shape.bounds(primitive) } else { Bounds3::EMPTY };
        let cone = if strength > 0.0 { shape.normal_cone(primitive) } else { None };
        LightBounds {
            bounds,
            axis: cone.map_or(Vec3::Z, |cone| cone.axis),
            cos_normals: cone.map_or(-1.0, |cone| cone.cos_angle),
            cos_emission: 0.0,
            strength,
            two_sided: context.emissions[self.emission as usize].two_sided,
        }
    }
}
