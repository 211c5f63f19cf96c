//! Surfaces that emit.

use super::{LightBounds, LightContext, LightSample, ScaledSpectrum, Target};
use crate::texture::SpectrumImage;
use glam::{Vec2, Vec3};
use luz_color::{SampledSpectrum, Wavelengths};
use luz_geometry::{Bounds3, Reference, ShapeId, SurfacePoint};
use std::f64::consts::PI;

/// What an emitting surface radiates, shared by all its primitives.
#[derive(Clone, Debug)]
pub struct Emission {
    /// Radiance; with an image the factor of the image alone.
    pub radiance: ScaledSpectrum,
    /// Colours over the surface's parameters, instead of the radiance's spectrum.
    pub image: Option<SpectrumImage>,
    /// True if both sides emit, not just the one that the geometric normal points to.
    pub two_sided: bool,
}

impl Emission {
    /// True if light leaves towards `outgoing` from a point with this normal.
    #[inline]
    pub fn shines(&self, normal: Vec3, outgoing: Vec3) -> bool {
        self.two_sided || normal.dot(outgoing) >= 0.0
    }

    /// The mean of the image's channels and texels; 1 without.
    pub(crate) fn mean_brightness(&self) -> f32 {
        let mean = |image: &SpectrumImage| image.pyramid.mean().iter().map(|v| v.max(0.0)).sum::<f32>() / 3.0;
        self.image.as_ref().map_or(1.0, mean)
    }

    /// The radiance of the image at the given parameters.
    pub(super) fn image_radiance(&self, image: &SpectrumImage, uv: Vec2, wavelengths: &Wavelengths) -> SampledSpectrum {
        let rgb = image.pyramid.nearest(Vec2::new(uv.x, 1.0 - uv.y)).map(|v| v.max(0.0));
        image.spectrum(rgb, wavelengths) * self.radiance.scale
    }
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
