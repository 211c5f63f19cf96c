//! One triangle, prepared for drawing points from it again and again.

use glam::{Vec2, Vec3, Vec4};
use luz_sample::warp::{self, SphericalTriangle};

use super::far::{Seen, is_far};
use super::triangle::{TriangleMesh, normal_and_area};
use super::{AreaSample, Reference, SolidAngleSample, sample};
use crate::{SurfacePoint, gamma};

/// A triangle of a mesh with what is the same for all of its points.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FlatTriangle {
    /// Axis by axis the three corners, and their mean, so that all four are looked at together.
    places: [Vec4; 3],
    corners: [Vec3; 3],
    /// Bounds the error of points' positions.
    error: Vec3,
    uvs: [Vec2; 3],
    /// The unit normal as the order of the corners says.
    normal: Vec3,
    /// On which side of the triangle the surface's normal is: positive where on that of `normal`, interpolated from the corners.
    sides: [f32; 3],
    pdf_area: f32,
    /// Of the edges.
    longest_squared: f32,
}

impl FlatTriangle {
    /// A triangle whose indices are in range.
    pub fn new(mesh: &TriangleMesh, triangle: usize) -> Self {
        let corners @ [p0, p1, p2] = mesh.corners(triangle);
        let (normal, area) = normal_and_area(corners);
        let mean = (p0 + p1 + p2) * (1.0 / 3.0);
        Self {
            places: [0, 1, 2].map(|axis| Vec4::new(p0[axis], p1[axis], p2[axis], mean[axis])),
            corners,
            // No weighted mean is greater than the greatest.
            error: gamma(6) * p0.abs().max(p1.abs()).max(p2.abs()),
            uvs: mesh.corner_uvs(triangle),
            normal,
            sides: mesh.corner_sides(triangle, normal),
            pdf_area: 1.0 / area,
            longest_squared: (p1 - p0).length_squared().max((p2 - p1).length_squared()).max((p0 - p2).length_squared()),
        }
    }

    /// The point at barycentric coordinates.
    #[inline(always)]
    pub fn at(&self, b: [f32; 3]) -> AreaSample {
        let [p0, p1, p2] = self.corners;
        let [uv0, uv1, uv2] = self.uvs;
        let [s0, s1, s2] = self.sides;
        let is_turned = b[0] * s0 + b[1] * s1 + b[2] * s2 < 0.0;
        AreaSample {
            position: b[0] * p0 + b[1] * p1 + b[2] * p2,
            position_error: self.error,
            normal: if is_turned { -self.normal } else { self.normal },
            uv: b[0] * uv0 + b[1] * uv1 + b[2] * uv2,
            pdf_area: self.pdf_area,
        }
    }

    #[inline(always)]
    pub fn faces_away(&self, position: Vec3) -> bool {
        let height = (position - self.corners[0]).dot(self.normal);
        let [s0, s1, s2] = self.sides;
        if height < 0.0 { s0.min(s1).min(s2) >= 0.0 } else { height > 0.0 && s0.max(s1).max(s2) < 0.0 }
    }

    pub fn sample_area(&self, u: Vec2) -> Option<AreaSample> {
        self.pdf_area.is_finite().then(|| self.at(warp::uniform_triangle(u)))
    }

    #[inline(always)]
    pub fn sample_solid_angle(&self, reference: &Reference, u: Vec2) -> Option<SolidAngleSample> {
        // (In scalars, for both ways to meet in registers.)
        let (b0, b1, b2, area, pdf) = match self.far_weights(reference) {
            Some(weights) => {
                let (point, density) = warp::bilinear_with_pdf(u, weights);
                let [b0, b1, b2] = FarMap::barycentric(point);
                (b0, b1, b2, density * self.pdf_area, 0.0)
            }
            None => self.sample_near(reference, u)?,
        };
        let AreaSample { position, position_error, normal, uv, .. } = self.at([b0, b1, b2]);
        let pdf =
            if area > 0.0 { area * sample::area_to_solid_angle(reference.position, position, normal)? } else { pdf };
        (pdf > 0.0 && pdf.is_finite()).then_some(SolidAngleSample { position, position_error, normal, uv, pdf })
    }

    #[inline]
    pub fn pdf_solid_angle(&self, reference: &Reference, point: &SurfacePoint) -> f32 {
        let Some(weights) = self.far_weights(reference) else { return self.pdf_near(reference, point) };
        let density = warp::bilinear_pdf(FarMap::square(point.parametric), weights);
        sample::pdf_from_area(reference, point, density * self.pdf_area)
    }

    /// Weights for [`FarMap`], where the triangle is far away.
    #[inline(always)]
    fn far_weights(&self, reference: &Reference) -> Option<[f32; 4]> {
        let seen = Seen::new(reference, self.places);
        let distance_squared = seen.distances_squared.w;
        if !is_far(self.longest_squared, distance_squared) {
            return None;
        }
        let [w0, w1, w2, _] = seen.irradiance_weights(reference.normal, distance_squared).to_array();
        Some([w0, w0, w1, w2])
    }

    /// Barycentric coordinates, and the density: a part in area and a part in solid angle, one of which is zero. By solid angle,
    /// unless the triangle is so small that sampling by area is as good, or so large that the map loses its precision.
    #[inline(never)]
    fn sample_near(&self, reference: &Reference, u: Vec2) -> Option<(f32, f32, f32, f32, f32)> {
        let Some(spherical) = self.spherical(reference) else {
            let [b0, b1, b2] = warp::uniform_triangle(u);
            return self.pdf_area.is_finite().then_some((b0, b1, b2, self.pdf_area, 0.0));
        };
        let weights = self.weights(reference);
        let warped = weights.map_or(u, |w| warp::bilinear(u, w));
        let pdf = spherical.pdf() * weights.map_or(1.0, |w| warp::bilinear_pdf(warped, w));
        let [b0, b1, b2] = spherical.sample(warped).barycentric;
        Some((b0, b1, b2, 0.0, pdf))
    }

    #[cold]
    fn pdf_near(&self, reference: &Reference, point: &SurfacePoint) -> f32 {
        let Some(spherical) = self.spherical(reference) else {
            return sample::pdf_from_area(reference, point, self.pdf_area);
        };
        let weight = self.weights(reference).map_or(1.0, |w| {
            let direction = (point.position - reference.position).normalize_or_zero();
            warp::bilinear_pdf(spherical.inverse(direction), w)
        });
        spherical.pdf() * weight
    }

    /// The triangle on the sphere around the reference point (the limits are pbrt-v4's).
    fn spherical(&self, reference: &Reference) -> Option<SphericalTriangle> {
        const LEAST: f32 = 3e-4;
        const GREATEST: f32 = 6.22;
        let [p0, p1, p2] = self.corners.map(|p| p - reference.position);
        SphericalTriangle::new(p0, p1, p2).filter(|s| (LEAST..=GREATEST).contains(&s.solid_angle()))
    }

    /// The cosine weights over the unit square that [`SphericalTriangle::sample`] maps to the triangle: its side
    /// `u.y = 0` goes to the second corner.
    fn weights(&self, reference: &Reference) -> Option<[f32; 4]> {
        let [p0, p1, p2] = self.corners;
        reference.cosine_weights([p1, p1, p0, p2])
    }
}

/// The map from the unit square to a triangle that keeps areas, with the side `y = 0` at the first corner, `(0, 1)` at the
/// second and `(1, 1)` at the third.
struct FarMap;

impl FarMap {
    #[inline]
    fn barycentric(p: Vec2) -> [f32; 3] {
        let t = p.y.sqrt();
        [1.0 - t, t * (1.0 - p.x), t * p.x]
    }

    /// The inverse, of the second and third barycentric coordinate.
    #[inline]
    fn square(b: Vec2) -> Vec2 {
        let t = (b.x + b.y).clamp(0.0, 1.0);
        Vec2::new(if t > 0.0 { (b.y / t).clamp(0.0, 1.0) } else { 0.5 }, t * t)
    }
}
