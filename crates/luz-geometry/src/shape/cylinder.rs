//! Open cylinders and parts of them.

use glam::{DVec3, Vec2, Vec3};

use super::quadric::{self, ObjectRay, ObjectSurface};
use super::{AreaSample, ParametricHit, Reference, SolidAngleSample, sample};
use crate::{Bounds3, Hit, Ray, SurfacePoint, Transform, gamma};

/// An open cylinder around the z axis of object space, cut at an angle; `u` runs with the azimuth, `v` with z. The normal
/// points outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// From object space to the world.
    pub transform: Transform,
    /// Whether the normal points inwards.
    pub reverse_orientation: bool,
    /// The radius, in object space, positive.
    pub radius: f32,
    /// The lower end, in object space.
    pub z_min: f32,
    /// The upper end, in object space.
    pub z_max: f32,
    /// The azimuth up to which it reaches, in radians; 2π for all.
    pub phi_max: f32,
}

impl Cylinder {
    fn ends(&self) -> (f64, f64) {
        (f64::from(self.z_min.min(self.z_max)), f64::from(self.z_min.max(self.z_max)))
    }

    fn uv_of(&self, p: DVec3) -> Vec2 {
        let (lo, hi) = self.ends();
        Vec2::new((quadric::azimuth(p) / quadric::clamp_angle(self.phi_max)) as f32, ((p.z - lo) / (hi - lo)) as f32)
    }

    pub(super) fn is_valid(&self, _: usize) -> bool {
        let (lo, hi) = self.ends();
        self.radius > 0.0 && lo < hi && self.phi_max > 0.0 && self.bounds(0).is_finite()
    }

    pub(super) fn bounds(&self, _: usize) -> Bounds3 {
        let (lo, hi) = self.ends();
        let r = self.radius;
        self.transform.bounds(&Bounds3 { min: Vec3::new(-r, -r, lo as f32), max: Vec3::new(r, r, hi as f32) })
    }

    pub(super) fn intersect(&self, ray: &Ray, t_max: f32, _: usize) -> Option<ParametricHit> {
        let ray = ObjectRay::new(ray, &self.transform);
        let r = f64::from(self.radius);
        let (o, d) = (ray.origin.truncate(), ray.direction.truncate());
        let (a, b) = (d.length_squared(), d.dot(o));
        let c = (o.length() - r) * (o.length() + r);
        let nearest = (o - d * (b / a)).length();
        let discriminant = a * (r - nearest) * (r + nearest);
        let c_error = ray.origin_error * (o.length() + r);
        let (lo, hi) = self.ends();
        for t in quadric::positive_roots(a, b, c, discriminant, c_error) {
            if t.is_nan() || t as f32 > t_max {
                return None;
            }
            let p = ray.at(t);
            if p.z >= lo && p.z <= hi && quadric::azimuth(p) <= quadric::clamp_angle(self.phi_max) {
                let uv = self.uv_of(p);
                return Some((t as f32, uv.x, uv.y));
            }
        }
        None
    }

    pub(super) fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let object = ObjectRay::new(ray, &self.transform);
        let found = object.at(f64::from(hit.t));
        let around = found.truncate().normalize_or(glam::DVec2::X);
        let r = f64::from(self.radius);
        let (lo, hi) = self.ends();
        let p = DVec3::new(around.x * r, around.y * r, found.z.clamp(lo, hi));
        let phi_max = quadric::clamp_angle(self.phi_max);
        // z comes from the ray as it is, and is as uncertain as the ray's hit.
        let error = Vec3::new(p.x.abs() as f32, p.y.abs() as f32, p.z.abs() as f32) * gamma(3);
        ObjectSurface {
            position: p,
            error,
            uv: self.uv_of(p),
            dpdu: DVec3::new(-p.y, p.x, 0.0) * phi_max,
            dpdv: DVec3::new(0.0, 0.0, hi - lo),
            d2pduu: DVec3::new(p.x, p.y, 0.0) * (-phi_max * phi_max),
            d2pduv: DVec3::ZERO,
            d2pdvv: DVec3::ZERO,
        }
        .to_world(&self.transform, self.reverse_orientation, ray, hit)
    }

    fn object_area(&self) -> f64 {
        let (lo, hi) = self.ends();
        (hi - lo) * f64::from(self.radius) * quadric::clamp_angle(self.phi_max)
    }

    pub(super) fn area(&self, _: usize) -> f32 {
        // The mean stretch over the azimuth, by the midpoint rule (exact to rounding: the integrand is smooth and, for a
        // whole cylinder, periodic).
        const STEPS: u32 = 256;
        let phi_max = quadric::clamp_angle(self.phi_max);
        let stretch = (0..STEPS)
            .map(|i| {
                let (sin, cos) = (phi_max * (f64::from(i) + 0.5) / f64::from(STEPS)).sin_cos();
                quadric::area_stretch(&self.transform, DVec3::new(cos, sin, 0.0))
            })
            .sum::<f64>()
            / f64::from(STEPS);
        (self.object_area() * stretch) as f32
    }

    fn pdf_area_at(&self, around: DVec3) -> f32 {
        (1.0 / (self.object_area() * quadric::area_stretch(&self.transform, around))) as f32
    }

    pub(super) fn sample_area(&self, _: usize, u: Vec2) -> Option<AreaSample> {
        Some(self.point_at(Vec2::new(u.y, u.x)))
    }

    /// The point with the texture coordinates `uv`, which are uniform in object-space area.
    pub(super) fn point_at(&self, uv: Vec2) -> AreaSample {
        let (lo, hi) = self.ends();
        let (sin, cos) = (quadric::clamp_angle(self.phi_max) * f64::from(uv.x)).sin_cos();
        let r = f64::from(self.radius);
        let around = DVec3::new(cos, sin, 0.0);
        let p = DVec3::new(r * cos, r * sin, lo + (hi - lo) * f64::from(uv.y));
        let error = gamma(3) * Vec3::new(p.x.abs() as f32, p.y.abs() as f32, p.z.abs() as f32);
        let (position, position_error, normal) =
            quadric::sampled_point(&self.transform, self.reverse_orientation, p, error, around);
        AreaSample { position, position_error, normal, uv: self.uv_of(p), pdf_area: self.pdf_area_at(around) }
    }

    pub(super) fn pdf_area(&self, point: &SurfacePoint) -> f32 {
        let p = self.transform.inverse().point(point.position).as_dvec3();
        self.pdf_area_at(DVec3::new(p.x, p.y, 0.0).normalize_or(DVec3::X))
    }

    pub(super) fn sample_solid_angle(&self, reference: &Reference, _: usize, u: Vec2) -> Option<SolidAngleSample> {
        self.sample_area(0, u)?.seen_from(reference.position)
    }

    pub(super) fn pdf_solid_angle(&self, reference: &Reference, point: &SurfacePoint) -> f32 {
        sample::pdf_from_area(reference, point, self.pdf_area(point))
    }
}
