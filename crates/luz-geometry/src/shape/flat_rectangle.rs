//! One rectangle, prepared for drawing points from it again and again.

use glam::{Vec2, Vec3, Vec4};
use luz_sample::warp::{self, SphericalRectangle};

use super::far::{Seen, is_far};
use super::{AreaSample, Reference, SolidAngleSample, sample};
use crate::{SurfacePoint, gamma};

/// A rectangle with what is the same for all of its points.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FlatRectangle {
    /// Axis by axis the four corners, so that all are looked at together: those at (0,0), (1,0), (0,1), (1,1).
    places: [Vec4; 3],
    center: Vec3,
    corners: [Vec3; 4],
    /// From the corner at (0,0) to those at (1,0) and (0,1), and what the products with these are divided by for (u,v).
    edges: [Vec3; 2],
    lengths_squared: [f32; 2],
    position_error: Vec3,
    /// Unit, oriented.
    normal: Vec3,
    /// Texture coordinates of the corners.
    uvs: [Vec2; 4],
    pdf_area: f32,
    diagonal_squared: f32,
}

impl FlatRectangle {
    /// The rectangle of the corners at (0,0), (1,0), (0,1), (1,1), with its oriented unit normal and the corners' texture coordinates.
    pub fn new(corners: [Vec3; 4], normal: Vec3, uvs: [Vec2; 4]) -> Self {
        let [p00, p10, p01, p11] = corners;
        let edges = [p10 - p00, p01 - p00];
        let [eu, ev] = edges.map(Vec3::as_dvec3);
        Self {
            places: [0, 1, 2].map(|axis| Vec4::from(corners.map(|p| p[axis]))),
            center: (p00 + p11) * 0.5,
            corners,
            edges,
            lengths_squared: edges.map(Vec3::length_squared),
            position_error: gamma(6) * (p00.abs() + p10.abs() + p01.abs() + p11.abs()),
            normal,
            uvs,
            pdf_area: eu.cross(ev).length().recip() as f32,
            diagonal_squared: (p11 - p00).length_squared().max((p10 - p01).length_squared()),
        }
    }

    /// The point with the parameters (u,v).
    #[inline(always)]
    fn at(&self, Vec2 { x: u, y: v }: Vec2) -> (Vec3, Vec2) {
        let weights = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
        let [w00, w10, w01, w11] = weights;
        let [p00, p10, p01, p11] = self.corners;
        let [t00, t10, t01, t11] = self.uvs;
        (w00 * p00 + w10 * p10 + w01 * p01 + w11 * p11, w00 * t00 + w10 * t10 + w01 * t01 + w11 * t11)
    }

    #[inline(always)]
    pub fn faces_away(&self, position: Vec3) -> bool {
        (position - self.corners[0]).dot(self.normal) < 0.0
    }

    /// A point drawn evenly.
    pub fn sample_area(&self, u: Vec2) -> Option<AreaSample> {
        let Self { position_error, normal, pdf_area, .. } = *self;
        let (position, uv) = self.at(u);
        pdf_area.is_finite().then_some(AreaSample { position, position_error, normal, uv, pdf_area })
    }

    #[inline(always)]
    pub fn sample_solid_angle(&self, reference: &Reference, u: Vec2) -> Option<SolidAngleSample> {
        let Self { position_error, normal, .. } = *self;
        let Some(weights) = self.far_weights(reference) else { return self.sample_near(reference, u) };
        let (point, density) = warp::bilinear_with_pdf(u, weights);
        let (position, uv) = self.at(point);
        let pdf = density * self.pdf_area * sample::area_to_solid_angle(reference.position, position, normal)?;
        (pdf > 0.0 && pdf.is_finite()).then_some(SolidAngleSample { position, position_error, normal, uv, pdf })
    }

    #[inline]
    pub fn pdf_solid_angle(&self, reference: &Reference, point: &SurfacePoint) -> f32 {
        let Some(weights) = self.far_weights(reference) else { return self.pdf_near(reference, point) };
        let density = warp::bilinear_pdf(point.parametric, weights);
        sample::pdf_from_area(reference, point, density * self.pdf_area)
    }

    /// Weights of the corners, where the rectangle is far away.
    #[inline(always)]
    fn far_weights(&self, reference: &Reference) -> Option<[f32; 4]> {
        let distance_squared = self.center.distance_squared(reference.position);
        is_far(self.diagonal_squared, distance_squared).then(|| {
            Seen::new(reference, self.places).irradiance_weights(reference.normal, distance_squared).to_array()
        })
    }

    #[inline(never)]
    fn sample_near(&self, reference: &Reference, u: Vec2) -> Option<SolidAngleSample> {
        let Self { position_error, normal, .. } = *self;
        let Some(spherical) = self.spherical(reference) else {
            return self.sample_area(u)?.seen_from(reference.position);
        };
        let weights = reference.cosine_weights(self.corners);
        let warped = weights.map_or(u, |w| warp::bilinear(u, w));
        let pdf = spherical.pdf() * weights.map_or(1.0, |w| warp::bilinear_pdf(warped, w));
        let position = spherical.sample(warped);
        let from_corner = position - self.corners[0];
        let [u, v] = [0, 1].map(|i| (from_corner.dot(self.edges[i]) / self.lengths_squared[i]).clamp(0.0, 1.0));
        let (_, uv) = self.at(Vec2::new(u, v));
        (pdf > 0.0).then_some(SolidAngleSample { position, position_error, normal, uv, pdf })
    }

    #[cold]
    fn pdf_near(&self, reference: &Reference, point: &SurfacePoint) -> f32 {
        let Some(spherical) = self.spherical(reference) else {
            return sample::pdf_from_area(reference, point, self.pdf_area);
        };
        let weight = reference
            .cosine_weights(self.corners)
            .map_or(1.0, |w| warp::bilinear_pdf(spherical.inverse(point.position), w));
        spherical.pdf() * weight
    }

    /// The rectangle on the sphere around the reference point, unless it is so small that sampling by area is as good.
    fn spherical(&self, reference: &Reference) -> Option<SphericalRectangle> {
        const LEAST: f32 = 1e-4;
        let [edge_x, edge_y] = self.edges;
        SphericalRectangle::new(reference.position, self.corners[0], edge_x, edge_y).filter(|s| s.solid_angle() > LEAST)
    }
}
