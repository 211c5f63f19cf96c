//! What it means to sample a shape.

use glam::{Vec2, Vec3};

use crate::SurfacePoint;

/// A point drawn from a shape, by area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaSample {
    /// The point, in world space.
    pub position: Vec3,
    /// The point is known up to ± this on each axis.
    pub position_error: Vec3,
    /// The unit geometric normal, as [`SurfacePoint::geometric_normal`].
    pub normal: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
    /// The density, in area of the world.
    pub pdf_area: f32,
}

/// A point drawn from a shape as it is seen from a reference point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolidAngleSample {
    /// The point, in world space.
    pub position: Vec3,
    /// The point is known up to ± this on each axis.
    pub position_error: Vec3,
    /// The unit geometric normal, as [`SurfacePoint::geometric_normal`].
    pub normal: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
    /// The density, in solid angle from the reference point.
    pub pdf: f32,
}

/// A point that looks at a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    /// Where it is, in world space.
    pub position: Vec3,
    /// The unit shading normal, if it lies on a surface: samples are then warped towards it, for the cosine.
    pub normal: Option<Vec3>,
}

impl Reference {
    /// A point in free space.
    pub fn point(position: Vec3) -> Self {
        Self { position, normal: None }
    }

    /// A point on a surface with the unit shading normal `normal`.
    pub fn surface(position: Vec3, normal: Vec3) -> Self {
        Self { position, normal: Some(normal) }
    }

    /// The four heights of the bilinear density on the unit square that stands for the cosine at the corners `(0,0)`,
    /// `(1,0)`, `(0,1)`, `(1,1)` seen from here; `None` in free space.
    #[inline(always)]
    pub(crate) fn cosine_weights(&self, corners: [Vec3; 4]) -> Option<[f32; 4]> {
        let normal = self.normal?;
        let weight = |corner: Vec3| {
            let to = corner - self.position;
            let cosine = to.dot(normal).abs() / to.length();
            // What is not a number is too little as well.
            if cosine > 0.01 { cosine } else { 0.01 }
        };
        // Not by `map`, which is not inlined.
        let [c00, c10, c01, c11] = corners;
        Some([weight(c00), weight(c10), weight(c01), weight(c11)])
    }
}

/// The factor from area to solid angle, `d² / |cos θ|`; `None` where it is not positive and finite.
#[inline(always)]
pub(crate) fn area_to_solid_angle(reference: Vec3, position: Vec3, normal: Vec3) -> Option<f32> {
    let to = position - reference;
    let distance_squared = to.length_squared();
    let factor = if (1e-18..1e18).contains(&distance_squared) {
        distance_squared * distance_squared.sqrt() / to.dot(normal).abs()
    } else {
        let to = to.as_dvec3();
        (to.length_squared() * to.length() / to.dot(normal.as_dvec3()).abs()) as f32
    };
    (factor > 0.0 && factor.is_finite()).then_some(factor)
}

impl AreaSample {
    /// The same point with its density in solid angle from `reference`.
    #[inline(always)]
    pub(crate) fn seen_from(&self, reference: Vec3) -> Option<SolidAngleSample> {
        let factor = area_to_solid_angle(reference, self.position, self.normal)?;
        let pdf = self.pdf_area * factor;
        pdf.is_finite().then_some(SolidAngleSample {
            position: self.position,
            position_error: self.position_error,
            normal: self.normal,
            uv: self.uv,
            pdf,
        })
    }
}

/// The density in solid angle of what was sampled by area; 0 where it has none.
#[inline]
pub(crate) fn pdf_from_area(reference: &Reference, point: &SurfacePoint, pdf_area: f32) -> f32 {
    let pdf = area_to_solid_angle(reference.position, point.position, point.geometric_normal).unwrap_or(0.0) * pdf_area;
    if pdf.is_finite() { pdf } else { 0.0 }
}
