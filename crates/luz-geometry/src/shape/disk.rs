//! Disks, annuli, and parts of them.

use std::f64::consts::TAU;

use glam::{DVec3, Vec2, Vec3};
use luz_sample::trigonometry::sin_cos_turns;

use super::quadric::{self, ObjectRay, ObjectSurface};
use super::{AreaSample, ParametricHit, Reference, SolidAngleSample, sample};
use crate::{Bounds3, Hit, Ray, SurfacePoint, Transform, gamma};

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

    /// The disk, ready to be sampled.
    pub(super) fn flat(&self) -> FlatDisk {
        let m = self.transform.matrix();
        let (x, y, z, w) = (m.x_axis.truncate(), m.y_axis.truncate(), m.z_axis.truncate(), m.w_axis.truncate());
        let sign = if self.reverse_orientation != self.transform.swaps_handedness() { -1.0 } else { 1.0 };
        let (inner, outer) = self.radii_squared();
        FlatDisk {
            center: self.transform.point(Vec3::Z * self.height),
            magnitude: (z * self.height).abs() + w.abs(),
            axes: [x, y],
            normal: (self.transform.normal(Vec3::Z) * sign).normalize_or_zero(),
            radii: [self.inner_radius, self.radius],
            inner_squared: inner as f32,
            ring_squared: (outer - inner) as f32,
            turns: (quadric::clamp_angle(self.phi_max) / TAU) as f32,
            pdf_area: 1.0 / self.area(0),
        }
    }

    pub(super) fn sample_area(&self, _: usize, u: Vec2) -> Option<AreaSample> {
        Some(self.flat().sample_area(u))
    }

    pub(super) fn pdf_area(&self, _: &SurfacePoint) -> f32 {
        1.0 / self.area(0)
    }

    pub(super) fn sample_solid_angle(&self, reference: &Reference, _: usize, u: Vec2) -> Option<SolidAngleSample> {
        self.flat().sample_solid_angle(reference, u)
    }

    pub(super) fn pdf_solid_angle(&self, reference: &Reference, point: &SurfacePoint) -> f32 {
        self.flat().pdf_solid_angle(reference, point)
    }
}

/// A disk in the world with what is the same for all of its points.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FlatDisk {
    center: Vec3,
    /// Sum of the absolute terms that the centre was computed from, which bounds its rounding.
    magnitude: Vec3,
    /// The axes of object space in the world.
    axes: [Vec3; 2],
    /// Unit, oriented.
    normal: Vec3,
    /// In object space, of the hole and of the rim.
    radii: [f32; 2],
    inner_squared: f32,
    /// The difference of the squared radii.
    ring_squared: f32,
    /// The share of a turn that is there.
    turns: f32,
    pdf_area: f32,
}

impl FlatDisk {
    #[inline]
    fn sample_area(&self, u: Vec2) -> AreaSample {
        let [x, y] = self.axes;
        let [inner, outer] = self.radii;
        let r = (self.inner_squared + self.ring_squared * u.x).sqrt();
        let (sin, cos) = sin_cos_turns(self.turns * u.y);
        AreaSample {
            position: self.center + ((r * cos) * x + (r * sin) * y),
            // Sine and cosine are as exact as four units of rounding of one.
            position_error: gamma(8) * (self.magnitude + r * (x.abs() + y.abs())),
            normal: self.normal,
            uv: Vec2::new(u.y, ((outer - r) / (outer - inner)).clamp(0.0, 1.0)),
            pdf_area: self.pdf_area,
        }
    }

    #[inline]
    pub fn faces_away(&self, position: Vec3) -> bool {
        (position - self.center).dot(self.normal) < 0.0
    }

    pub fn sample_solid_angle(&self, reference: &Reference, u: Vec2) -> Option<SolidAngleSample> {
        self.sample_area(u).seen_from(reference.position)
    }

    #[inline]
    pub fn pdf_solid_angle(&self, reference: &Reference, point: &SurfacePoint) -> f32 {
        sample::pdf_from_area(reference, point, self.pdf_area)
    }
}
