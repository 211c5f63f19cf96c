//! Surfaces that emit.
//!
//! Of a surface with an alpha texture, only the share `α` of the rays that reach a point meets it, and by that share its light
//! counts. So densities of points that are drawn, in area or in solid angle, are meant with respect to `α dA` and `α dω`: they are
//! those of evenly spread area divided by `α`. Whoever divides by them or compares them with densities of rays need not know of `α`.

use super::parametric::parametric_at;
use super::screen::image_coordinates;
use super::{Departure, EmittingPoint, LightBounds, LightContext, LightSample, ScaledSpectrum, Target};
use crate::texture::{FloatTextureId, SpectrumImage, SurfaceContext};
use glam::{Vec2, Vec3};
use luz_color::{SampledSpectrum, Wavelengths};
use luz_geometry::{
    AreaSample, Bounds3, Frame, NO_INSTANCE, PreparedPrimitive, Reference, Shape, ShapeId, SolidAngleSample,
    SurfacePoint, offset_ray_origin,
};
use luz_sample::distribution::TexelTree;
use luz_sample::warp;
use std::f32::consts::FRAC_1_PI;
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
#[derive(Clone, Debug, PartialEq)]
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
    /// Coverage, where it is not complete.
    pub alpha: Option<FloatTextureId>,
    /// True where no ray meets the surface although it shines: as in pbrt-v4, of shapes with a constant `alpha` of zero.
    pub is_unseen: bool,
    /// The primitive, where it is of a kind that is worth preparing.
    pub prepared: Option<Box<PreparedPrimitive>>,
}

impl AreaLight {
    /// A density with respect to the share of rays that meet a point; zero where none does.
    #[inline]
    pub(super) fn among_met(&self, context: LightContext<'_>, density: f32, position: Vec3, uv: Vec2) -> f32 {
        let Some(alpha) = self.alpha else { return density };
        let at = SurfaceContext { position, uv, ..Default::default() };
        let alpha = context.textures.float(alpha, &at);
        if alpha > 0.0 { density / alpha.min(1.0) } else { 0.0 }
    }

    /// A point of the primitive as seen from `reference`.
    #[inline(always)]
    fn sample_solid_angle(
        &self,
        context: LightContext<'_>,
        reference: &Reference,
        u: Vec2,
    ) -> Option<SolidAngleSample> {
        match &self.prepared {
            Some(prepared) => prepared.sample_solid_angle(reference, u),
            None => context.accelerator.sample_solid_angle(reference, ShapeId(self.shape), self.primitive, u),
        }
    }

    /// Its density.
    #[inline]
    fn pdf_solid_angle(&self, context: LightContext<'_>, reference: &Reference, point: &SurfacePoint) -> f32 {
        match &self.prepared {
            Some(prepared) => prepared.pdf_solid_angle(reference, point),
            None => context.accelerator.pdf_solid_angle(reference, point),
        }
    }

    /// Draws a point of the light as seen from `reference`.
    #[inline(always)]
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
        if let Some(prepared) = &self.prepared
            && !context.emissions[self.emission as usize].two_sided
            && prepared.faces_away(reference.position)
        {
            return None;
        }
        let point = self.sample_solid_angle(context, reference, u)?;
        let direction = (point.position - reference.position).normalize();
        let pdf = self.among_met(context, point.pdf, point.position, point.uv);
        if pdf <= 0.0 || !direction.is_finite() {
            return None;
        }
        let radiance = context.radiance(self, point.normal, point.uv, -direction, wavelengths);
        (!radiance.is_black()).then_some(LightSample {
            radiance,
            direction,
            target: Target::Point(offset_ray_origin(point.position, point.position_error, point.normal, -direction)),
            pdf,
            is_delta: self.is_unseen,
        })
    }

    /// The density in solid angle with which [`sample`](Self::sample) draws from `reference` a point of the light that
    /// a ray has hit.
    #[inline]
    pub fn pdf(&self, context: LightContext<'_>, reference: &Reference, hit: &SurfacePoint) -> f32 {
        let density = match self.is_drawn_by_image(context) {
            true => self.pdf_by_image(context, reference, hit),
            false => self.pdf_solid_angle(context, reference, hit),
        };
        self.among_met(context, density, hit.position, hit.uv)
    }

    /// Draws a point where a path begins, by the image where points are drawn by it and otherwise evenly, with its density
    /// in area.
    pub fn sample_point(&self, context: LightContext<'_>, u: Vec2) -> Option<(EmittingPoint, f32)> {
        let (point, density) = if self.is_drawn_by_image(context) {
            self.sample_image_point(context, None, u)?
        } else {
            let AreaSample { position, position_error: error, normal, uv, pdf_area } =
                context.accelerator.sample_area(ShapeId(self.shape), self.primitive, u)?;
            let parametric = self.parametric(context, position, uv);
            (EmittingPoint { position, error, normal, uv, parametric }, pdf_area)
        };
        Some((point, self.among_met(context, density, point.position, point.uv)))
    }

    /// The density of [`sample_point`](Self::sample_point), in area.
    pub fn point_pdf(&self, context: LightContext<'_>, point: &EmittingPoint) -> f32 {
        let density = match self.is_drawn_by_image(context) {
            true => self.image_point_pdf(context, None, point),
            false => context.accelerator.pdf_area(&self.surface_point(point)),
        };
        self.among_met(context, density, point.position, point.uv)
    }

    /// Draws a point as [`sample`](Self::sample) does, with its density in area.
    pub fn sample_point_from(
        &self,
        context: LightContext<'_>,
        reference: &Reference,
        u: Vec2,
    ) -> Option<(EmittingPoint, f32)> {
        let (point, density) = if self.is_drawn_by_image(context) {
            self.sample_image_point(context, Some(reference), u)?
        } else {
            let SolidAngleSample { position, position_error: error, normal, uv, pdf } =
                self.sample_solid_angle(context, reference, u)?;
            let parametric = self.parametric(context, position, uv);
            let point = EmittingPoint { position, error, normal, uv, parametric };
            (point, point.area_density(pdf, reference.position))
        };
        Some((point, self.among_met(context, density, point.position, point.uv)))
    }

    /// The density of [`sample_point_from`](Self::sample_point_from), in area.
    pub fn point_pdf_from(&self, context: LightContext<'_>, reference: &Reference, point: &EmittingPoint) -> f32 {
        let density = if self.is_drawn_by_image(context) {
            self.image_point_pdf(context, Some(reference), point)
        } else {
            let pdf = self.pdf_solid_angle(context, reference, &self.surface_point(point));
            point.area_density(pdf, reference.position)
        };
        self.among_met(context, density, point.position, point.uv)
    }

    /// Draws a ray that leaves a point of the light, by the cosine; of a light of two sides from either.
    pub fn sample_departure(&self, context: LightContext<'_>, point: &EmittingPoint, mut u: Vec2) -> Option<Departure> {
        let mut side = point.normal;
        let mut pdf = FRAC_1_PI;
        if context.emissions[self.emission as usize].two_sided {
            pdf *= 0.5;
            u.x *= 2.0;
            if u.x >= 1.0 {
                u.x -= 1.0;
                side = -side;
            }
        }
        let direction = Frame::from_z(side).to_world(warp::cosine_hemisphere(u));
        let origin = offset_ray_origin(point.position, point.error, point.normal, direction);
        (direction.dot(side) > 0.0).then_some(Departure { origin, direction, pdf })
    }

    /// The density of [`sample_departure`](Self::sample_departure) in projected solid angle: 1/π, or half of it on each of
    /// two sides.
    pub fn departure_pdf(&self, context: LightContext<'_>, point: &EmittingPoint, to: Vec3) -> f32 {
        let emission = &context.emissions[self.emission as usize];
        match emission.two_sided {
            true => 0.5 * FRAC_1_PI,
            false if emission.shines(point.normal, to - point.position) => FRAC_1_PI,
            false => 0.0,
        }
    }

    fn parametric(&self, context: LightContext<'_>, position: Vec3, uv: Vec2) -> Vec2 {
        parametric_at(context.accelerator.shape(ShapeId(self.shape)), self.primitive as usize, position, uv)
    }

    /// What densities on shapes ask of a point.
    fn surface_point(&self, point: &EmittingPoint) -> SurfacePoint {
        let frame = Frame::from_z(point.normal);
        SurfacePoint {
            position: point.position,
            position_error: point.error,
            geometric_normal: point.normal,
            shading_normal: point.normal,
            uv: point.uv,
            dpdu: frame.s,
            dpdv: frame.t,
            shading_dpdu: frame.s,
            shading_dpdv: frame.t,
            dndu: Vec3::ZERO,
            dndv: Vec3::ZERO,
            parametric: point.parametric,
            face_index: 0,
            time: 0.0,
            shape: self.shape,
            primitive: self.primitive,
            instance: NO_INSTANCE,
        }
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
