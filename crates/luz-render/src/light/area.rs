//! Surfaces that emit.

use super::{LightContext, LightSample, ScaledSpectrum, Target};
use crate::texture::{Pyramid, SpectrumImage};
use glam::{Vec2, Vec3};
use luz_color::{SampledSpectrum, Wavelengths};
use luz_geometry::{Reference, ShapeId, SurfacePoint};
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

    /// The radiance of the image at the given parameters.
    pub(super) fn image_radiance(&self, image: &SpectrumImage, uv: Vec2, wavelengths: &Wavelengths) -> SampledSpectrum {
        let rgb = image.pyramid.nearest(Vec2::new(uv.x, 1.0 - uv.y)).map(|v| v.max(0.0));
        image.spectrum(rgb, wavelengths) * self.radiance.scale
    }

    /// Radiant exitance over π, averaged over the image, in photometric units.
    fn weight(&self) -> f64 {
        let sides = if self.two_sided { 2.0 } else { 1.0 };
        let brightness = self.image.as_ref().map_or(1.0, |image| mean_brightness(&image.pyramid));
        sides * brightness * self.radiance.weight()
    }
}

/// The mean over the channels and texels of an image.
pub(crate) fn mean_brightness(pyramid: &Pyramid<3>) -> f64 {
    pyramid.mean().iter().map(|&v| f64::from(v.max(0.0))).sum::<f64>() / 3.0
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

    /// π A L, both sides counted.
    pub fn power(&self, context: LightContext<'_>) -> f64 {
        let area = f64::from(context.accelerator.shape_area(ShapeId(self.shape), self.primitive));
        PI * area * f64::from(self.scale) * context.emissions[self.emission as usize].weight()
    }
}
