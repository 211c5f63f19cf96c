//! Disks, annuli, and parts of them.

use glam::{DVec3, Vec2, Vec3};

use super::quadric::{self, ObjectRay, ObjectSurface};
use super::{AreaSample, ParametricHit, Reference, SolidAngleSample, sample};
use crate::{Bounds3, Hit, Ray, SurfacePoint, Transform};

/// A disk at `z = height` in object space with a hole, cut at an angle; `u` runs with the azimuth, `v` from the rim (0)
/// to the hole (1). The normal points along +z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disk {
    /// From object space to the world.
    pub transform: Transform,
    /// Whether the normal points along −z.
    pub reverse_orientation: bool,
    /// Where it lies on the z axis of object space.
    pub height: f32,
    /// The radius of the rim, positive.
    pub radius: f32,
    /// The radius of the hole, in `[0, radius)`.
    pub inner_radius: f32,
    /// The azimuth up to which it reaches, in radians; 2π for all.
    pub phi_max: f32,
}

impl Disk {
    fn radii_squared(&self) -> (f64, f64) {
        (f64::from(self.inner_radius).powi(2), f64::from(self.radius).powi(2))
    }

    fn uv_of(&self, p: DVec3) -> Vec2 {
        let r = p.truncate().length();
        let (inner, outer) = (f64::from(self.inner_radius), f64::from(self.radius));
        Vec2::new(
            (quadric::azimuth(p) / quadric::clamp_angle(self.phi_max)) as f32,
            ((outer - r) / (outer - inner)) as f32,
        )
    }

    pub(super) fn is_valid(&self, _: usize) -> bool {
        self.radius > 0.0
            && self.inner_radius >= 0.0
            && self.inner_radius < self.radius
            && self.phi_max > 0.0
            && self.bounds(0).is_finite()
    }

    pub(super) fn bounds(&self, _: usize) -> Bounds3 {
        let (r, h) = (self.radius, self.height);
        self.transform.bounds(&Bounds3 { min: Vec3::new(-r, -r, h), max: Vec3::new(r, r, h) })
    }

    pub(super) fn intersect(&self, ray: &Ray, t_max: f32, _: usize) -> Option<ParametricHit> {
        let ray = ObjectRay::new(ray, &self.transform);
        let gap = f64::from(self.height) - ray.origin.z;
        // Within rounding of the plane, the ray starts on the disk.
        if gap.abs() <= ray.origin_error {
            return None;
        }
        let t = gap / ray.direction.z;
        if !(t > 0.0 && t.is_finite() && t as f32 <= t_max) {
            return None;
        }
        let p = ray.at(t);
        let r2 = p.truncate().length_squared();
        let (inner, outer) = self.radii_squared();
        if r2 > outer || r2 < inner || quadric::azimuth(p) > quadric::clamp_angle(self.phi_max) {
            return None;
        }
        let uv = self.uv_of(p);
        Some((t as f32, uv.x, uv.y))
    }

    pub(super) fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let object = ObjectRay::new(ray, &self.transform);
        let mut p = object.at(f64::from(hit.t));
        p.z = f64::from(self.height);
        let r = p.truncate().length();
        let (cos, sin) = if r > 0.0 { (p.x / r, p.y / r) } else { (1.0, 0.0) };
        let phi_max = quadric::clamp_angle(self.phi_max);
        // At the centre u has no direction: keep a trace of one, so that the frame stands.
        let r_safe = r.max(1e-6 * f64::from(self.radius));
        let depth = f64::from(self.inner_radius) - f64::from(self.radius);
        let none = DVec3::ZERO;
        ObjectSurface {
            position: p,
            error: Vec3::new(0.0, 0.0, 0.0),
            uv: self.uv_of(p),
            dpdu: DVec3::new(-sin, cos, 0.0) * (phi_max * r_safe),
            dpdv: DVec3::new(cos, sin, 0.0) * depth,
            d2pduu: none,
            d2pduv: none,
            d2pdvv: none,
        }
        .to_world(&self.transform, self.reverse_orientation, ray, hit)
    }

    pub(super) fn area(&self, _: usize) -> f32 {
        let (inner, outer) = self.radii_squared();
        let object = quadric::clamp_angle(self.phi_max) * 0.5 * (outer - inner);
        (object * quadric::area_stretch(&self.transform, DVec3::Z)) as f32
    }

    pub(super) fn sample_area(&self, _: usize, u: Vec2) -> Option<AreaSample> {
        let (inner, outer) = self.radii_squared();
        let r = (inner + (outer - inner) * f64::from(u.x)).sqrt();
        let (sin, cos) = (quadric::clamp_angle(self.phi_max) * f64::from(u.y)).sin_cos();
        let p = DVec3::new(r * cos, r * sin, f64::from(self.height));
        let (position, position_error, normal) =
            quadric::sampled_point(&self.transform, self.reverse_orientation, p, Vec3::ZERO, DVec3::Z);
        Some(AreaSample { position, position_error, normal, uv: self.uv_of(p), pdf_area: 1.0 / self.area(0) })
    }

    pub(super) fn pdf_area(&self, _: &SurfacePoint) -> f32 {
        1.0 / self.area(0)
    }

    pub(super) fn sample_solid_angle(&self, reference: &Reference, _: usize, u: Vec2) -> Option<SolidAngleSample> {
        self.sample_area(0, u)?.seen_from(reference.position)
    }

    pub(super) fn pdf_solid_angle(&self, reference: &Reference, point: &SurfacePoint) -> f32 {
        sample::pdf_from_area(reference, point, self.pdf_area(point))
    }
}
