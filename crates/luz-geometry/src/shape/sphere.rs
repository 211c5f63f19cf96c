//! Spheres and parts of them.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DVec3, Vec2, Vec3};
use luz_sample::warp;

use super::quadric::{self, ObjectRay, ObjectSurface};
use super::{AreaSample, ParametricHit, Reference, SolidAngleSample, sample};
use crate::{Bounds3, Frame, Hit, Ray, SurfacePoint, Transform, gamma};

/// A sphere around the origin of object space, cut at two heights and at an angle; `u` runs with the azimuth, `v` from
/// `z_min` to `z_max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// From object space to the world.
    pub transform: Transform,
    /// Whether the normal points inwards.
    pub reverse_orientation: bool,
    /// The radius, in object space, positive.
    pub radius: f32,
    /// The lower cut, in object space; `−radius` for none.
    pub z_min: f32,
    /// The upper cut, in object space; `radius` for none.
    pub z_max: f32,
    /// The azimuth up to which it reaches, in radians; 2π for all.
    pub phi_max: f32,
}

impl Sphere {
    /// A whole sphere.
    pub fn whole(transform: Transform, radius: f32) -> Self {
        Self { transform, reverse_orientation: false, radius, z_min: -radius, z_max: radius, phi_max: TAU as f32 }
    }

    fn is_whole(&self) -> bool {
        self.z_min.min(self.z_max) <= -self.radius
            && self.z_min.max(self.z_max) >= self.radius
            && self.phi_max >= TAU as f32
    }

    /// The cuts in order, within the sphere.
    fn cuts(&self) -> (f64, f64) {
        let clamp = |z: f32| f64::from(z.clamp(-self.radius, self.radius));
        (clamp(self.z_min.min(self.z_max)), clamp(self.z_min.max(self.z_max)))
    }

    fn keeps(&self, p: DVec3) -> bool {
        if self.is_whole() {
            return true;
        }
        let (lo, hi) = self.cuts();
        let r = f64::from(self.radius);
        (lo <= -r || p.z >= lo) && (hi >= r || p.z <= hi) && quadric::azimuth(p) <= quadric::clamp_angle(self.phi_max)
    }

    /// Azimuth and the polar angles of `v = 0` and of the step to `v = 1`.
    pub(super) fn angles(&self) -> (f64, f64, f64) {
        let r = f64::from(self.radius);
        let (lo, hi) = self.cuts();
        let polar = |z: f64| FRAC_PI_2 - (z / r).clamp(-1.0, 1.0).asin();
        (quadric::clamp_angle(self.phi_max), polar(lo), polar(hi) - polar(lo))
    }

    pub(super) fn is_valid(&self, _: usize) -> bool {
        let (lo, hi) = (self.z_min.min(self.z_max), self.z_min.max(self.z_max));
        self.radius > 0.0
            && self.radius.is_finite()
            && lo < self.radius
            && hi > -self.radius
            && lo < hi
            && self.phi_max > 0.0
            && self.bounds(0).is_finite()
    }

    pub(super) fn bounds(&self, _: usize) -> Bounds3 {
        let (lo, hi) = self.cuts();
        let r = self.radius;
        self.transform.bounds(&Bounds3 { min: Vec3::new(-r, -r, lo as f32), max: Vec3::new(r, r, hi as f32) })
    }

    pub(super) fn intersect(&self, ray: &Ray, t_max: f32, _: usize) -> Option<ParametricHit> {
        let ray = ObjectRay::new(ray, &self.transform);
        let r = f64::from(self.radius);
        let (o, d) = (ray.origin, ray.direction);
        let (a, b) = (d.length_squared(), d.dot(o));
        let c = (o.length() - r) * (o.length() + r);
        // The discriminant from the point nearest the centre (Hearn and Baker; Ray Tracing Gems, chapter 7).
        let nearest = (o - d * (b / a)).length();
        let discriminant = a * (r - nearest) * (r + nearest);
        let c_error = ray.origin_error * (o.length() + r);
        for t in quadric::positive_roots(a, b, c, discriminant, c_error) {
            let p = ray.at(t);
            if t.is_nan() || t as f32 > t_max {
                return None;
            }
            if self.keeps(p) {
                let (phi_max, from, span) = self.angles();
                let theta = (p.z / p.length()).clamp(-1.0, 1.0).acos();
                return Some((t as f32, (quadric::azimuth(p) / phi_max) as f32, ((theta - from) / span) as f32));
            }
        }
        None
    }

    pub(super) fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let r = f64::from(self.radius);
        let object = ObjectRay::new(ray, &self.transform);
        let direction = object.at(f64::from(hit.t)).normalize_or(DVec3::Z);
        let p = direction * r;
        let (phi_max, from, span) = self.angles();
        let theta = direction.z.clamp(-1.0, 1.0).acos();
        let around = direction.truncate().length();
        // At the poles any azimuth will do.
        let (cos, sin) = if around > 1e-12 { (direction.x / around, direction.y / around) } else { (1.0, 0.0) };
        let around = around.max(1e-6);
        let dpdu = DVec3::new(-sin, cos, 0.0) * (phi_max * r * around);
        let dpdv = DVec3::new(p.z * cos, p.z * sin, -r * around) * span;
        ObjectSurface {
            position: p,
            error: gamma(5) * p.abs().as_vec3(),
            uv: Vec2::new((quadric::azimuth(p) / phi_max) as f32, ((theta - from) / span) as f32),
            dpdu,
            dpdv,
            d2pduu: DVec3::new(cos, sin, 0.0) * (-phi_max * phi_max * r * around),
            d2pduv: DVec3::new(-sin, cos, 0.0) * (span * p.z * phi_max),
            d2pdvv: p * (-span * span),
        }
        .to_world(&self.transform, self.reverse_orientation, ray, hit)
    }

    pub(super) fn area(&self, _: usize) -> f32 {
        let r = f64::from(self.radius);
        let (lo, hi) = self.cuts();
        let phi_max = quadric::clamp_angle(self.phi_max);
        let object_area = phi_max * r * (hi - lo);
        if let Some(scale) = quadric::uniform_scale(&self.transform) {
            return (object_area * scale * scale) as f32;
        }
        // The mean stretch, by the midpoint rule in the coordinates (z, φ) in which area is uniform.
        const STEPS: u32 = 64;
        let mut sum = 0.0;
        for i in 0..STEPS {
            for j in 0..STEPS {
                let u = Vec2::new((i as f32 + 0.5) / STEPS as f32, (j as f32 + 0.5) / STEPS as f32);
                sum += quadric::area_stretch(&self.transform, self.direction(u));
            }
        }
        (object_area * sum / f64::from(STEPS * STEPS)) as f32
    }

    /// A direction of the part that is kept, uniform in object-space area.
    fn direction(&self, u: Vec2) -> DVec3 {
        let r = f64::from(self.radius);
        let (lo, hi) = self.cuts();
        let z = (hi + (lo - hi) * f64::from(u.x)) / r;
        let around = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        let (sin, cos) = (quadric::clamp_angle(self.phi_max) * f64::from(u.y)).sin_cos();
        DVec3::new(around * cos, around * sin, z)
    }

    fn uv_of(&self, direction: DVec3) -> Vec2 {
        let (phi_max, from, span) = self.angles();
        let theta = direction.z.clamp(-1.0, 1.0).acos();
        Vec2::new((quadric::azimuth(direction) / phi_max) as f32, ((theta - from) / span) as f32)
    }

    fn pdf_area_at(&self, direction: DVec3) -> f32 {
        let (lo, hi) = self.cuts();
        let object_area = quadric::clamp_angle(self.phi_max) * f64::from(self.radius) * (hi - lo);
        (1.0 / (object_area * quadric::area_stretch(&self.transform, direction))) as f32
    }

    pub(super) fn sample_area(&self, _: usize, u: Vec2) -> Option<AreaSample> {
        Some(self.sample_towards(self.direction(u)))
    }

    pub(super) fn sample_towards(&self, direction: DVec3) -> AreaSample {
        let p = direction * f64::from(self.radius);
        let error = gamma(5) * p.abs().as_vec3();
        let (position, position_error, normal) =
            quadric::sampled_point(&self.transform, self.reverse_orientation, p, error, direction);
        let pdf_area = self.pdf_area_at(direction);
        AreaSample { position, position_error, normal, uv: self.uv_of(direction), pdf_area }
    }

    pub(super) fn pdf_area(&self, point: &SurfacePoint) -> f32 {
        self.pdf_area_at(self.transform.inverse().point(point.position).as_dvec3().normalize_or(DVec3::Z))
    }

    /// Centre and radius in the world, and whether the cone of the sphere can be sampled from `reference`: it is whole,
    /// round, and the reference outside.
    fn cone(&self, reference: Vec3) -> Option<Cone> {
        if !self.is_whole() {
            return None;
        }
        let scale = quadric::uniform_scale(&self.transform)?;
        let center = self.transform.point(Vec3::ZERO).as_dvec3();
        let radius = f64::from(self.radius) * scale;
        let to_center = center - reference.as_dvec3();
        let distance = to_center.length();
        // Just outside the cone is a hemisphere and its rim grazes: there sampling by area is as good.
        if distance <= radius * (1.0 + 1e-4) {
            return None;
        }
        let sin_squared = radius * radius / (distance * distance);
        let one_minus_cos = warp::one_minus_cos_of_sin_squared(sin_squared as f32);
        (one_minus_cos > 0.0 && warp::uniform_cone_pdf(one_minus_cos).is_finite()).then_some(Cone {
            to_center,
            distance,
            radius,
            one_minus_cos,
        })
    }

    pub(super) fn sample_solid_angle(&self, reference: &Reference, _: usize, u: Vec2) -> Option<SolidAngleSample> {
        let Some(cone) = self.cone(reference.position) else {
            return self.sample_area(0, u)?.seen_from(reference.position);
        };
        let direction = cone.direction(u);
        let object = self.transform.inverse().vector(direction.as_vec3()).as_dvec3().normalize();
        let AreaSample { position, position_error, normal, uv, .. } = self.sample_towards(object);
        Some(SolidAngleSample { position, position_error, normal, uv, pdf: warp::uniform_cone_pdf(cone.one_minus_cos) })
    }

    pub(super) fn pdf_solid_angle(&self, reference: &Reference, point: &SurfacePoint) -> f32 {
        match self.cone(reference.position) {
            Some(cone) => warp::uniform_cone_pdf(cone.one_minus_cos),
            None => sample::pdf_from_area(reference, point, self.pdf_area(point)),
        }
    }
}

/// The cone under which a sphere is seen from outside.
struct Cone {
    to_center: DVec3,
    distance: f64,
    radius: f64,
    one_minus_cos: f32,
}

impl Cone {
    /// The unit vector from the centre to a point of the near side, such that the direction from the reference point is
    /// uniform in the cone.
    fn direction(&self, u: Vec2) -> DVec3 {
        // Half-angle forms: 1 − cos θ loses no digits for small cones.
        let one_minus_cos = f64::from(u.x) * f64::from(self.one_minus_cos);
        let cos = 1.0 - one_minus_cos;
        let sin_squared = one_minus_cos * (1.0 + cos);
        // Along the ray, the near intersection; then from the centre.
        let root = (self.radius * self.radius - self.distance * self.distance * sin_squared).max(0.0).sqrt();
        let t = self.distance * cos - root;
        let sin = sin_squared.sqrt();
        let (sin_phi, cos_phi) = (2.0 * PI * f64::from(u.y)).sin_cos();
        let frame = Frame::from_z((self.to_center / self.distance).as_vec3());
        let local = DVec3::new(t * sin * cos_phi, t * sin * sin_phi, t * cos - self.distance) / self.radius;
        let world = frame.s.as_dvec3() * local.x + frame.t.as_dvec3() * local.y + frame.n.as_dvec3() * local.z;
        world.normalize()
    }
}
