//! What spheres, disks and cylinders share: rays in object space, and the way from object space to the world.
//!
//! Object-space arithmetic is `f64`, with a bound on the error that the `f32` ray and matrix bring along, so that a ray
//! that starts on the surface does not find it again.

use std::f64::consts::TAU;

use glam::{DMat3, DVec3, Vec2, Vec3};

use crate::{Hit, NO_INSTANCE, Ray, SurfacePoint, Transform, gamma};

/// A ray in object space.
pub(super) struct ObjectRay {
    pub origin: DVec3,
    pub direction: DVec3,
    /// How far `origin` may be off, by rounding, in any direction.
    pub origin_error: f64,
}

impl ObjectRay {
    pub fn new(ray: &Ray, transform: &Transform) -> Self {
        let m = transform.inverse_matrix().as_dmat4();
        let o = ray.origin.as_dvec3();
        let reach = (m.x_axis.truncate() * o.x).abs()
            + (m.y_axis.truncate() * o.y).abs()
            + (m.z_axis.truncate() * o.z).abs()
            + m.w_axis.truncate().abs();
        Self {
            origin: m.transform_point3(o),
            direction: m.transform_vector3(ray.direction.as_dvec3()),
            origin_error: f64::from(gamma(3)) * reach.length(),
        }
    }

    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }
}

/// The positive roots of `a t² + 2 b t + c = 0`, in order, as candidates for hits; missing ones are NaN. `discriminant`
/// is `b² − a c`, given apart because it can be computed with less cancellation. Where `|c| ≤ c_error` the origin may
/// lie on the surface: that root is 0 and does not count.
pub(super) fn positive_roots(a: f64, b: f64, c: f64, discriminant: f64, c_error: f64) -> [f64; 2] {
    let none = [f64::NAN; 2];
    if !(discriminant >= 0.0 && a > 0.0) {
        return none;
    }
    if c.abs() <= c_error {
        let far = -2.0 * b / a;
        return if far > 0.0 { [far, f64::NAN] } else { none };
    }
    let root = discriminant.sqrt();
    let q = if b < 0.0 { root - b } else { -root - b };
    let (t0, t1) = (q / a, c / q);
    let (near, far) = if t0 <= t1 { (t0, t1) } else { (t1, t0) };
    match (near > 0.0, far > 0.0) {
        (true, true) => [near, far],
        (false, true) => [far, f64::NAN],
        _ => none,
    }
}

/// The angle of `(x, y)` in `[0, 2π)`.
pub(super) fn azimuth(p: DVec3) -> f64 {
    let phi = p.y.atan2(p.x);
    if phi < 0.0 { (phi + TAU).min(TAU) } else { phi }
}

/// `phi_max` as shapes take it, brought into `[0, 2π]`.
pub(super) fn clamp_angle(phi: f32) -> f64 {
    f64::from(phi).clamp(0.0, TAU)
}

/// The surface in object space at one point.
pub(super) struct ObjectSurface {
    pub position: DVec3,
    pub error: Vec3,
    pub uv: Vec2,
    pub dpdu: DVec3,
    pub dpdv: DVec3,
    pub d2pduu: DVec3,
    pub d2pduv: DVec3,
    pub d2pdvv: DVec3,
}

impl ObjectSurface {
    /// To the world. The normal is `dpdu × dpdv` in object space, turned round where exactly one of `reverse_orientation`
    /// and a handedness-swapping transform asks for it.
    pub fn to_world(&self, transform: &Transform, reverse_orientation: bool, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let normal = self.dpdu.cross(self.dpdv).normalize_or_zero();
        let (dndu, dndv) = weingarten(self.dpdu, self.dpdv, normal, self.d2pduu, self.d2pduv, self.d2pdvv);
        let side = if reverse_orientation != transform.swaps_handedness() { -1.0 } else { 1.0 };
        let oriented = (normal * side).as_vec3();
        let (dpdu, dpdv) = (self.dpdu.as_vec3(), self.dpdv.as_vec3());
        let local = SurfacePoint {
            position: self.position.as_vec3(),
            position_error: self.error,
            geometric_normal: oriented,
            shading_normal: oriented,
            uv: self.uv,
            dpdu,
            dpdv,
            shading_dpdu: dpdu,
            shading_dpdv: dpdv,
            dndu: (dndu * side).as_vec3(),
            dndv: (dndv * side).as_vec3(),
            parametric: Vec2::new(hit.u, hit.v),
            face_index: 0,
            time: ray.time,
            shape: hit.shape,
            primitive: hit.primitive,
            instance: NO_INSTANCE,
        };
        transform.surface(&local)
    }
}

/// The derivatives of the unit normal by u and v, from the fundamental forms (Weingarten's equations).
pub(super) fn weingarten(
    dpdu: DVec3,
    dpdv: DVec3,
    normal: DVec3,
    d2pduu: DVec3,
    d2pduv: DVec3,
    d2pdvv: DVec3,
) -> (DVec3, DVec3) {
    let (e1, f1, g1) = (dpdu.dot(dpdu), dpdu.dot(dpdv), dpdv.dot(dpdv));
    let (e2, f2, g2) = (normal.dot(d2pduu), normal.dot(d2pduv), normal.dot(d2pdvv));
    let determinant = e1 * g1 - f1 * f1;
    if determinant.abs() <= f64::MIN_POSITIVE {
        return (DVec3::ZERO, DVec3::ZERO);
    }
    let along = |a: f64, b: f64| dpdu * (a / determinant) + dpdv * (b / determinant);
    (along(f2 * f1 - e2 * g1, e2 * f1 - f2 * e1), along(g2 * f1 - f2 * g1, f2 * f1 - g2 * e1))
}

/// How much the transform stretches area at a surface with the unit normal `normal`, all in object space:
/// `|det M| · |M⁻ᵀ n|`.
pub(super) fn area_stretch(transform: &Transform, normal: DVec3) -> f64 {
    let inverse = DMat3::from_mat4(transform.inverse_matrix().as_dmat4());
    (inverse.transpose() * normal).length() / inverse.determinant().abs()
}

/// The factor by which the transform scales all lengths, if it scales them all alike (up to `f32` rounding).
pub(super) fn uniform_scale(transform: &Transform) -> Option<f64> {
    let m = DMat3::from_mat4(transform.matrix().as_dmat4());
    let squared = m.transpose() * m;
    let scale = (squared.x_axis.x + squared.y_axis.y + squared.z_axis.z) / 3.0;
    let off = (squared - DMat3::from_diagonal(DVec3::splat(scale))).abs();
    let worst = off.x_axis.max(off.y_axis).max(off.z_axis).max_element();
    (worst <= 4e-6 * scale).then(|| scale.sqrt())
}

/// A point of a quadric and its normal, brought to the world for sampling.
pub(super) fn sampled_point(
    transform: &Transform,
    reverse_orientation: bool,
    position: DVec3,
    error: Vec3,
    normal: DVec3,
) -> (Vec3, Vec3, Vec3) {
    let (world, world_error) = transform.point_with_error(position.as_vec3(), error);
    let sign = if reverse_orientation != transform.swaps_handedness() { -1.0 } else { 1.0 };
    (world, world_error, (transform.normal(normal.as_vec3()) * sign).normalize_or_zero())
}
