//! Meshes of bilinear patches.

use glam::{DVec2, DVec3, Vec2, Vec3};
use luz_sample::warp;

use super::flat_rectangle::FlatRectangle;
use super::quadric::weingarten;
use super::triangle::face_forward;
use super::{AreaSample, ParametricHit, Reference, SolidAngleSample, sample};
use crate::{Bounds3, Hit, NO_INSTANCE, Ray, SurfacePoint, Transform, gamma};

/// Bilinear patches that share vertices, in world space.
///
/// A patch is `p(u,v) = (1−u)(1−v) p00 + u(1−v) p10 + (1−u)v p01 + uv p11`. Its normal is `∂p/∂u × ∂p/∂v`, turned round as
/// that of [`super::TriangleMesh`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BilinearMesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Four vertices per patch: those at (u,v) = (0,0), (1,0), (0,1), (1,1).
    pub indices: Vec<[u32; 4]>,
    /// Vertex normals, any length; as many as positions.
    pub normals: Option<Vec<Vec3>>,
    /// Vertex texture coordinates; as many as positions. Without, (u,v) of the patch.
    pub uvs: Option<Vec<Vec2>>,
    /// A number for each patch, as some textures want it.
    pub face_indices: Option<Vec<u32>>,
    /// Turns the normals, those of the vertices too.
    pub reverse_orientation: bool,
    /// Whether the transform that brought the mesh to the world swaps handedness; [`Self::transform`] keeps it.
    pub swaps_handedness: bool,
}

impl BilinearMesh {
    /// Moves the mesh: positions, normals (by the transposed inverse), and handedness.
    pub fn transform(&mut self, transform: &Transform) {
        if transform.is_identity() {
            return;
        }
        self.positions.iter_mut().for_each(|p| *p = transform.point(*p));
        self.normals.iter_mut().flatten().for_each(|n| *n = transform.normal(*n));
        self.swaps_handedness ^= transform.swaps_handedness();
    }

    fn patch(&self, patch: usize) -> Patch {
        let [p00, p10, p01, p11] = self.indices[patch].map(|i| self.positions[i as usize].as_dvec3());
        Patch { p00, p10, p01, p11 }
    }

    fn oriented(&self, patch: usize, normal: Vec3, uv: Vec2) -> Vec3 {
        match self.vertex_normal(patch, uv) {
            Some(ns) if ns.length_squared() > 0.0 => face_forward(normal, ns),
            _ if self.reverse_orientation != self.swaps_handedness => -normal,
            _ => normal,
        }
    }

    fn vertex_normal(&self, patch: usize, uv: Vec2) -> Option<Vec3> {
        let n = interpolate(self.corner_normals(patch)?, uv);
        Some(n)
    }

    fn corner_normals(&self, patch: usize) -> Option<[Vec3; 4]> {
        let normals = self.normals.as_ref()?;
        let sign = if self.reverse_orientation { -1.0 } else { 1.0 };
        Some(self.indices[patch].map(|i| sign * normals[i as usize]))
    }

    pub(super) fn corner_uvs(&self, patch: usize) -> Option<[Vec2; 4]> {
        let uvs = self.uvs.as_ref()?;
        Some(self.indices[patch].map(|i| uvs[i as usize]))
    }

    pub(super) fn has_normals(&self) -> bool {
        self.normals.is_some()
    }

    /// `|∂p/∂u × ∂p/∂v|` of a patch.
    pub(super) fn parametric_stretch(&self, patch: usize, uv: Vec2) -> f64 {
        let patch = self.patch(patch);
        patch.dpdu(f64::from(uv.y)).cross(patch.dpdv(f64::from(uv.x))).length()
    }

    fn texture_uv(&self, patch: usize, uv: Vec2) -> Vec2 {
        self.corner_uvs(patch).map_or(uv, |corners| interpolate(corners, uv))
    }

    pub(super) fn is_valid(&self, patch: usize) -> bool {
        let n = self.positions.len();
        if self.normals.as_ref().is_some_and(|a| a.len() != n) || self.uvs.as_ref().is_some_and(|a| a.len() != n) {
            return false;
        }
        if self.indices[patch].iter().any(|&i| i as usize >= n) {
            return false;
        }
        let p = self.patch(patch);
        [p.p00, p.p10, p.p01, p.p11].iter().all(|p| p.is_finite()) && p.area() > 0.0
    }

    pub(super) fn bounds(&self, patch: usize) -> Bounds3 {
        Bounds3::from_points(self.indices[patch].map(|i| self.positions[i as usize]))
    }

    pub(super) fn intersect(&self, ray: &Ray, t_max: f32, patch: usize) -> Option<ParametricHit> {
        self.patch(patch).intersect(ray, t_max)
    }

    pub(super) fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let index = hit.primitive as usize;
        let patch = self.patch(index);
        let parametric = Vec2::new(hit.u, hit.v);
        let (u, v) = (f64::from(hit.u), f64::from(hit.v));
        let (patch_dpdu, patch_dpdv) = (patch.dpdu(v), patch.dpdv(u));
        let normal = patch_dpdu.cross(patch_dpdv).normalize_or_zero();
        let twist = patch.p00 - patch.p01 - patch.p10 + patch.p11;
        let (patch_dndu, patch_dndv) = weingarten(patch_dpdu, patch_dpdv, normal, DVec3::ZERO, twist, DVec3::ZERO);
        let texture = self.corner_uvs(index).and_then(|corners| TextureMap::new(corners, parametric));
        let (dpdu, dpdv) = texture.map_or((patch_dpdu, patch_dpdv), |t| t.derivatives(patch_dpdu, patch_dpdv));
        let (dndu, dndv) = texture.map_or((patch_dndu, patch_dndv), |t| t.derivatives(patch_dndu, patch_dndv));
        let reach = patch.p00.abs().max(patch.p10.abs()).max(patch.p01.abs().max(patch.p11.abs())).as_vec3();
        let geometric_normal = self.oriented(index, normal.as_vec3(), parametric);
        let side = if geometric_normal.dot(normal.as_vec3()) < 0.0 { -1.0 } else { 1.0 };
        let mut point = SurfacePoint {
            position: patch.at(u, v).as_vec3(),
            position_error: gamma(6) * reach,
            geometric_normal,
            shading_normal: geometric_normal,
            uv: self.texture_uv(index, parametric),
            dpdu: dpdu.as_vec3(),
            dpdv: dpdv.as_vec3(),
            shading_dpdu: dpdu.as_vec3(),
            shading_dpdv: dpdv.as_vec3(),
            dndu: dndu.as_vec3() * side,
            dndv: dndv.as_vec3() * side,
            parametric,
            face_index: self.face_indices.as_ref().and_then(|f| f.get(index).copied()).unwrap_or(0),
            time: ray.time,
            shape: hit.shape,
            primitive: hit.primitive,
            instance: NO_INSTANCE,
        };
        self.shade(index, texture, &mut point);
        point
    }

    /// Sets the shading geometry from the vertex normals: the tangents turn with the normal.
    fn shade(&self, patch: usize, texture: Option<TextureMap>, point: &mut SurfacePoint) {
        let Some(corners @ [n00, n10, n01, n11]) = self.corner_normals(patch) else { return };
        let uv = point.parametric;
        let interpolated = interpolate(corners, uv);
        let Some(ns) = interpolated.try_normalize() else { return };
        // Of unit length where they meet, whatever length they are given in.
        let scale = interpolated.length().recip();
        let dndu = ((n10.lerp(n11, uv.y) - n00.lerp(n01, uv.y)) * scale).as_dvec3();
        let dndv = ((n01.lerp(n11, uv.x) - n00.lerp(n10, uv.x)) * scale).as_dvec3();
        let (dndu, dndv) = texture.map_or((dndu, dndv), |t| t.derivatives(dndu, dndv));
        (point.dndu, point.dndv) = (dndu.as_vec3(), dndv.as_vec3());
        let turn = glam::Quat::from_rotation_arc(point.geometric_normal, ns);
        let dpdu = turn * point.dpdu;
        point.shading_dpdu = dpdu - ns * ns.dot(dpdu);
        point.shading_dpdv = turn * point.dpdv;
        point.shading_normal = ns;
    }

    pub(super) fn area(&self, patch: usize) -> f32 {
        self.patch(patch).area() as f32
    }

    pub(super) fn sample_at(&self, patch: usize, uv: Vec2) -> AreaSample {
        let shape = self.patch(patch);
        let reach = shape.p00.abs() + shape.p10.abs() + shape.p01.abs() + shape.p11.abs();
        let (u, v) = (f64::from(uv.x), f64::from(uv.y));
        let normal = shape.dpdu(v).cross(shape.dpdv(u)).normalize_or_zero().as_vec3();
        AreaSample {
            position: shape.at(u, v).as_vec3(),
            position_error: gamma(6) * reach.as_vec3(),
            normal: self.oriented(patch, normal, uv),
            uv: self.texture_uv(patch, uv),
            pdf_area: shape.pdf_area(uv),
        }
    }

    pub(super) fn sample_area(&self, patch: usize, u: Vec2) -> Option<AreaSample> {
        let shape = self.patch(patch);
        let uv = if shape.is_rectangle() { u } else { warp::bilinear(u, shape.corner_areas()) };
        let sample = self.sample_at(patch, uv);
        (sample.pdf_area > 0.0 && sample.pdf_area.is_finite()).then_some(sample)
    }

    pub(super) fn pdf_area(&self, point: &SurfacePoint) -> f32 {
        let pdf = self.patch(point.primitive as usize).pdf_area(point.parametric);
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    /// The patch as a rectangle, if it is one, and of one side.
    pub(super) fn flat(&self, patch: usize) -> Option<FlatRectangle> {
        const CORNERS: [Vec2; 4] = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE];
        let shape = self.patch(patch);
        if !shape.is_rectangle() {
            return None;
        }
        let normal = shape.dpdu(0.5).cross(shape.dpdv(0.5)).normalize_or_zero().as_vec3();
        // Vertex normals are interpolated linearly: where corners agree, all agree.
        let [normal, others @ ..] = CORNERS.map(|uv| self.oriented(patch, normal, uv));
        let is_one_sided = others.iter().all(|other| *other == normal);
        is_one_sided.then(|| FlatRectangle::new(shape.corners(), normal, self.corner_uvs(patch).unwrap_or(CORNERS)))
    }

    pub(super) fn sample_solid_angle(&self, reference: &Reference, patch: usize, u: Vec2) -> Option<SolidAngleSample> {
        match self.flat(patch) {
            Some(rectangle) => rectangle.sample_solid_angle(reference, u),
            None => self.sample_area(patch, u)?.seen_from(reference.position),
        }
    }

    pub(super) fn pdf_solid_angle(&self, reference: &Reference, point: &SurfacePoint) -> f32 {
        match self.flat(point.primitive as usize) {
            Some(rectangle) => rectangle.pdf_solid_angle(reference, point),
            None => sample::pdf_from_area(reference, point, self.pdf_area(point)),
        }
    }
}

/// Bilinear interpolation of the values at (0,0), (1,0), (0,1), (1,1).
fn interpolate<T>([a00, a10, a01, a11]: [T; 4], uv: Vec2) -> T
where
    T: std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>,
{
    let (u, v) = (uv.x, uv.y);
    (a00 * (1.0 - u) + a10 * u) * (1.0 - v) + (a01 * (1.0 - u) + a11 * u) * v
}

/// The map from the patch's (u, v) to the texture's coordinates (s, t), linearised at a point.
#[derive(Clone, Copy)]
struct TextureMap {
    dstdu: DVec2,
    dstdv: DVec2,
    determinant: f64,
}

impl TextureMap {
    /// `None` where it cannot be inverted.
    fn new(corners: [Vec2; 4], uv: Vec2) -> Option<Self> {
        let [st00, st10, st01, st11] = corners.map(|c| c.as_dvec2());
        let (u, v) = (f64::from(uv.x), f64::from(uv.y));
        let dstdu = (st10 - st00) * (1.0 - v) + (st11 - st01) * v;
        let dstdv = (st01 - st00) * (1.0 - u) + (st11 - st10) * u;
        let determinant = dstdu.x * dstdv.y - dstdu.y * dstdv.x;
        (determinant.abs() >= 1e-16).then_some(Self { dstdu, dstdv, determinant })
    }

    /// The derivatives by s and t of what has the derivatives `du` and `dv` by u and v.
    fn derivatives(&self, du: DVec3, dv: DVec3) -> (DVec3, DVec3) {
        (
            (du * self.dstdv.y - dv * self.dstdu.y) / self.determinant,
            (dv * self.dstdu.x - du * self.dstdv.x) / self.determinant,
        )
    }
}

/// One patch, in `f64`.
struct Patch {
    p00: DVec3,
    p10: DVec3,
    p01: DVec3,
    p11: DVec3,
}

impl Patch {
    fn at(&self, u: f64, v: f64) -> DVec3 {
        self.p00.lerp(self.p10, u).lerp(self.p01.lerp(self.p11, u), v)
    }

    fn dpdu(&self, v: f64) -> DVec3 {
        (self.p10 - self.p00).lerp(self.p11 - self.p01, v)
    }

    fn dpdv(&self, u: f64) -> DVec3 {
        (self.p01 - self.p00).lerp(self.p11 - self.p10, u)
    }

    fn corners(&self) -> [Vec3; 4] {
        [self.p00, self.p10, self.p01, self.p11].map(|p| p.as_vec3())
    }

    /// Whether it is a flat rectangle, up to `f32` rounding.
    fn is_rectangle(&self) -> bool {
        let (eu, ev) = (self.p10 - self.p00, self.p01 - self.p00);
        let size = eu.length().max(ev.length());
        (self.p00 + eu + ev - self.p11).length() <= 1e-5 * size
            && eu.dot(ev).abs() <= 1e-5 * eu.length() * ev.length()
            && eu.length() > 0.0
            && ev.length() > 0.0
    }

    /// `|∂p/∂u × ∂p/∂v|` at the corners.
    fn corner_areas(&self) -> [f32; 4] {
        [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].map(|(u, v)| self.dpdu(v).cross(self.dpdv(u)).length() as f32)
    }

    /// Far above the rounding of `f64`, far below that of positions in `f32`.
    const NEAREST: f64 = 1e-10;

    /// The density in area of drawing (u,v) uniformly for a rectangle, or else bilinearly by the corners' areas.
    fn pdf_area(&self, uv: Vec2) -> f32 {
        let stretch = self.dpdu(f64::from(uv.y)).cross(self.dpdv(f64::from(uv.x))).length();
        let pdf = if self.is_rectangle() { 1.0 } else { warp::bilinear_pdf(uv, self.corner_areas()) };
        (f64::from(pdf) / stretch) as f32
    }

    /// The area, by Gauss–Legendre quadrature of `|∂p/∂u × ∂p/∂v|` on 8×8 cells of 2×2 points; exact for flat patches
    /// that do not fold.
    fn area(&self) -> f64 {
        const CELLS: u32 = 8;
        let offset = 0.5 / 3f64.sqrt();
        let nodes = || {
            (0..CELLS).flat_map(move |i| [0.5 - offset, 0.5 + offset].map(|x| (f64::from(i) + x) / f64::from(CELLS)))
        };
        let sum: f64 = nodes()
            .flat_map(|u| nodes().map(move |v| (u, v)))
            .map(|(u, v)| self.dpdu(v).cross(self.dpdv(u)).length())
            .sum();
        sum / f64::from(4 * CELLS * CELLS)
    }

    /// The nearest hit at `0 < t ≤ t_max`: the lines `u = const` that the ray meets are the roots of a quadratic
    /// (Reshetov 2019, "Cool Patches: A Geometric Approach to Ray/Bilinear Patch Intersections").
    ///
    /// A ray that starts on the patch, as one that leaves a wall at x = 0 does, meets it at a t that is zero but for the
    /// rounding of `f64`; such hits, nearer than [`Self::NEAREST`] of the distances in play, do not count.
    fn intersect(&self, ray: &Ray, t_max: f32) -> Option<ParametricHit> {
        let d = ray.direction.as_dvec3();
        let o = ray.origin.as_dvec3();
        let (q00, q10) = (self.p00 - o, self.p10 - o);
        let (left, right) = (self.p01 - self.p00, self.p11 - self.p10);
        // The volume spanned by the ray and the line at u is a + b u + c u².
        let a = q00.cross(d).dot(left);
        let c = (self.p10 - self.p00).cross(self.p01 - self.p11).dot(d);
        let b = q10.cross(d).dot(right) - a - c;
        let discriminant = b * b - 4.0 * a * c;
        if discriminant < 0.0 || discriminant.is_nan() {
            return None;
        }
        let q = -0.5 * (b + discriminant.sqrt().copysign(b));
        // A root that does not exist is NaN or infinite, and fails the tests below. For c = 0 the second is −a/b.
        let roots = [q / c, a / q];
        let mut best: Option<ParametricHit> = None;
        let reach = q00.length().max(q10.length()) + left.length().max(right.length());
        let nearest = Self::NEAREST * reach / d.length();
        let mut limit = f64::from(t_max);
        for u in roots {
            if !(0.0..=1.0).contains(&u) {
                continue;
            }
            let start = q00.lerp(q10, u);
            let along = left.lerp(right, u);
            // Where the ray and the line come nearest.
            let across = d.cross(along);
            let scale = across.length_squared();
            let side = across.cross(start);
            let (t, v) = (side.dot(along) / scale, side.dot(d) / scale);
            if t > nearest && t <= limit && (0.0..=1.0).contains(&v) {
                limit = t;
                best = Some((t as f32, u as f32, v as f32));
            }
        }
        best.filter(|&(t, ..)| t > 0.0 && t <= t_max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use luz_sample::random::{hash, unit_f32};

    #[test]
    fn rays_that_leave_a_patch_do_not_meet_it_again() {
        // Walls at coordinate zero, where an origin has no error to be offset by: flat and with all corners different.
        let walls = [
            [[0.0, 0.0, 0.0], [0.0, 0.0, 559.2], [0.0, 548.8, 0.0], [0.0, 548.8, 559.2]],
            [[0.0, 0.0, 0.0], [0.0, 3.0, 551.7], [0.0, 541.1, 13.0], [0.0, 548.8, 559.2]],
        ];
        for corners in walls {
            let [p00, p10, p01, p11] = corners.map(DVec3::from);
            let patch = Patch { p00, p10, p01, p11 };
            for i in 0..10_000 {
                let number = |dimension| unit_f32((hash(1, 0, i, dimension) >> 32) as u32);
                let origin = patch.at(number(0).into(), number(1).into()).as_vec3();
                let direction = Vec3::new(number(2), number(3) - 0.5, number(4) - 0.5);
                let ray = Ray::new(origin, direction, 0.0);
                assert_eq!(patch.intersect(&ray, f32::INFINITY), None, "{ray:?}");
            }
        }
    }
}
