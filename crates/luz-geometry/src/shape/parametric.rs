//! Shapes by their texture coordinates: which of them a primitive covers, and where they lie in space. For lights whose
//! emission is an image, and are to be sampled by it.

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::quadric;
use super::{AreaSample, BilinearMesh, Cylinder, Disk, Shape, Sphere, TriangleMesh};

/// The convex polygon that a primitive covers in texture coordinates, one-to-one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvFootprint {
    corners: [Vec2; 4],
    count: usize,
}

impl UvFootprint {
    /// Three or four corners, in order around the polygon.
    pub fn corners(&self) -> &[Vec2] {
        &self.corners[..self.count]
    }
}

/// A point of a primitive, found by its texture coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvPoint {
    /// The point, in world space.
    pub position: Vec3,
    /// The point is known up to ± this on each axis.
    pub position_error: Vec3,
    /// The unit geometric normal, as [`crate::SurfacePoint::geometric_normal`].
    pub normal: Vec3,
    /// Area of the world by area in texture coordinates.
    pub area_by_uv: f32,
}

/// A cone that holds normals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalCone {
    /// Its unit axis.
    pub axis: Vec3,
    /// The cosine of its half angle.
    pub cos_angle: f32,
}

/// The least area in texture coordinates that counts as one.
const LEAST_UV_AREA: f64 = 1e-12;

impl Shape {
    /// What a primitive covers in texture coordinates; `None` where the map is not one-to-one.
    pub fn uv_footprint(&self, primitive: usize) -> Option<UvFootprint> {
        let whole = || Some(UvFootprint { corners: [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y], count: 4 });
        match self {
            Self::Triangles(mesh) => mesh.uv_footprint(primitive),
            Self::Bilinear(mesh) => mesh.uv_footprint(primitive),
            Self::Sphere(_) | Self::Disk(_) | Self::Cylinder(_) => whole(),
        }
    }

    /// The point of a primitive with the texture coordinates `uv`, which lie in its [footprint](Self::uv_footprint).
    pub fn at_uv(&self, primitive: usize, uv: Vec2) -> Option<UvPoint> {
        match self {
            Self::Triangles(mesh) => mesh.at_uv(primitive, uv),
            Self::Bilinear(mesh) => mesh.at_uv(primitive, uv),
            Self::Sphere(sphere) => Some(sphere.at_uv(uv)),
            Self::Disk(disk) => Some(disk.at_uv(uv)),
            Self::Cylinder(cylinder) => Some(cylinder.at_uv(uv)),
        }
    }

    /// Area of the world by area in texture coordinates, at the point that [`crate::SurfacePoint::parametric`] names.
    pub fn area_by_uv(&self, primitive: usize, parametric: Vec2) -> Option<f32> {
        match self {
            Self::Triangles(mesh) => mesh.area_by_uv(primitive),
            Self::Bilinear(mesh) => mesh.area_by_uv(primitive, parametric),
            Self::Sphere(sphere) => Some(sphere.area_by_uv(parametric)),
            Self::Disk(disk) => Some(disk.area_by_uv(parametric)),
            Self::Cylinder(cylinder) => Some(cylinder.area_by_uv(parametric)),
        }
    }

    /// A cone around all geometric normals of a primitive; `None` where they point anywhere, or to both sides.
    pub fn normal_cone(&self, primitive: usize) -> Option<NormalCone> {
        match self {
            Self::Triangles(mesh) => mesh.normal_cone(primitive),
            Self::Bilinear(mesh) => mesh.normal_cone(primitive),
            Self::Disk(disk) => Some(NormalCone { axis: disk.at_uv(Vec2::splat(0.5)).normal, cos_angle: 1.0 }),
            Self::Sphere(_) | Self::Cylinder(_) => None,
        }
    }
}

fn found(sample: AreaSample, area_by_uv: f32) -> UvPoint {
    let AreaSample { position, position_error, normal, .. } = sample;
    UvPoint { position, position_error, normal, area_by_uv }
}

/// Twice the signed area of a triangle.
fn twice_area(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

impl TriangleMesh {
    fn uv_triangle(&self, triangle: usize) -> [DVec2; 3] {
        self.corner_uvs(triangle).map(|uv| uv.as_dvec2())
    }

    fn uv_footprint(&self, triangle: usize) -> Option<UvFootprint> {
        let [a, b, c] = self.corner_uvs(triangle);
        let is_one_to_one = twice_area(a.into(), b.into(), c.into()).abs() >= 2.0 * LEAST_UV_AREA;
        is_one_to_one.then_some(UvFootprint { corners: [a, b, c, c], count: 3 })
    }

    fn area_by_uv(&self, triangle: usize) -> Option<f32> {
        let [a, b, c] = self.uv_triangle(triangle);
        let area = 0.5 * twice_area(a, b, c).abs();
        (area >= LEAST_UV_AREA).then(|| (f64::from(self.area(triangle)) / area) as f32)
    }

    fn at_uv(&self, triangle: usize, uv: Vec2) -> Option<UvPoint> {
        let [a, b, c] = self.uv_triangle(triangle);
        let (p, whole) = (uv.as_dvec2(), twice_area(a, b, c));
        let (u, v) = ((twice_area(a, p, c) / whole).clamp(0.0, 1.0), (twice_area(a, b, p) / whole).clamp(0.0, 1.0));
        // Rounding must not leave the triangle.
        let scale = (u + v).max(1.0).recip();
        let (u, v) = (u * scale, v * scale);
        let barycentric = [(1.0 - u - v).max(0.0) as f32, u as f32, v as f32];
        Some(found(self.flat(triangle).at(barycentric), self.area_by_uv(triangle)?))
    }

    fn normal_cone(&self, triangle: usize) -> Option<NormalCone> {
        // Vertex normals turn the normal to their side: where they disagree it has two.
        let flat = self.flat(triangle);
        let corners = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|b| flat.at(b).normal);
        let axis = corners[0];
        (axis != Vec3::ZERO && corners.iter().all(|n| n.dot(axis) > 0.0)).then_some(NormalCone { axis, cos_angle: 1.0 })
    }
}

impl BilinearMesh {
    fn uv_footprint(&self, patch: usize) -> Option<UvFootprint> {
        let Some([c00, c10, c01, c11]) = self.corner_uvs(patch) else {
            return Some(UvFootprint { corners: [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y], count: 4 });
        };
        let around = [c00, c10, c11, c01];
        // Convex, and so one-to-one, where all corners turn the same way.
        let turn = |i: usize| {
            let [a, b, c] = [i, i + 1, i + 2].map(|k| around[k % 4].as_dvec2());
            twice_area(a, b, c)
        };
        let turns = [turn(0), turn(1), turn(2), turn(3)];
        let convex = turns.iter().all(|t| t.abs() >= 2.0 * LEAST_UV_AREA && t.signum() == turns[0].signum());
        convex.then_some(UvFootprint { corners: around, count: 4 })
    }

    /// The patch's own parameters of a point of its texture, by Newton's method: the map is nearly linear or, for the
    /// usual rectangles, linear.
    fn parameters_at(&self, patch: usize, uv: Vec2) -> Option<Vec2> {
        let Some(corners) = self.corner_uvs(patch) else { return Some(uv) };
        let [c00, c10, c01, c11] = corners.map(|c| c.as_dvec2());
        let target = uv.as_dvec2();
        let (along, up, twist) = (c10 - c00, c01 - c00, c00 - c10 - c01 + c11);
        let mut p = DVec2::splat(0.5);
        for _ in 0..16 {
            let off = c00 + along * p.x + up * p.y + twist * (p.x * p.y) - target;
            let (du, dv) = (along + twist * p.y, up + twist * p.x);
            let determinant = du.perp_dot(dv);
            let step = DVec2::new(off.perp_dot(dv), du.perp_dot(off)) / determinant;
            if !step.is_finite() {
                return None;
            }
            p = (p - step).clamp(DVec2::splat(-0.5), DVec2::splat(1.5));
            if step.abs().max_element() < 1e-12 {
                break;
            }
        }
        Some(p.clamp(DVec2::ZERO, DVec2::ONE).as_vec2())
    }

    fn area_by_uv(&self, patch: usize, parametric: Vec2) -> Option<f32> {
        let stretch = self.parametric_stretch(patch, parametric);
        let Some(corners) = self.corner_uvs(patch) else { return Some(stretch as f32) };
        let [c00, c10, c01, c11] = corners.map(|c| c.as_dvec2());
        let (u, v) = (f64::from(parametric.x), f64::from(parametric.y));
        let (du, dv) = ((c10 - c00).lerp(c11 - c01, v), (c01 - c00).lerp(c11 - c10, u));
        let area = du.perp_dot(dv).abs();
        (area >= LEAST_UV_AREA).then(|| (stretch / area) as f32)
    }

    fn at_uv(&self, patch: usize, uv: Vec2) -> Option<UvPoint> {
        let parameters = self.parameters_at(patch, uv)?;
        Some(found(self.sample_at(patch, parameters), self.area_by_uv(patch, parameters)?))
    }

    fn normal_cone(&self, patch: usize) -> Option<NormalCone> {
        // ∂p/∂u × ∂p/∂v is bilinear in (u, v): what holds its corners holds it everywhere.
        let corners = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE].map(|uv| self.sample_at(patch, uv).normal);
        let axis = corners.iter().sum::<Vec3>().try_normalize()?;
        let cos_angle = corners.iter().filter(|n| **n != Vec3::ZERO).fold(1.0f32, |least, n| least.min(n.dot(axis)));
        // Beyond a right angle the corners say nothing about what is between them.
        (cos_angle > 0.0 && !self.has_normals()).then_some(NormalCone { axis, cos_angle: cos_angle - 1e-6 })
    }
}

impl Sphere {
    fn direction_at(&self, uv: Vec2) -> (DVec3, f64) {
        let (phi_max, from, span) = self.angles();
        let (sin_phi, cos_phi) = (phi_max * f64::from(uv.x)).sin_cos();
        let (sin, cos) = (from + span * f64::from(uv.y)).sin_cos();
        let r = f64::from(self.radius);
        (DVec3::new(sin * cos_phi, sin * sin_phi, cos), (phi_max * span * sin).abs() * r * r)
    }

    fn at_uv(&self, uv: Vec2) -> UvPoint {
        found(self.sample_towards(self.direction_at(uv).0), self.area_by_uv(uv))
    }

    fn area_by_uv(&self, uv: Vec2) -> f32 {
        let (direction, area) = self.direction_at(uv);
        (area * quadric::area_stretch(&self.transform, direction)) as f32
    }
}

impl Disk {
    fn radius_at(&self, v: f32) -> (f64, f64) {
        let (inner, outer) = (f64::from(self.inner_radius), f64::from(self.radius));
        (outer - (outer - inner) * f64::from(v), outer - inner)
    }

    fn at_uv(&self, uv: Vec2) -> UvPoint {
        let (r, _) = self.radius_at(uv.y);
        let (sin, cos) = (quadric::clamp_angle(self.phi_max) * f64::from(uv.x)).sin_cos();
        let p = DVec3::new(r * cos, r * sin, f64::from(self.height));
        let (position, position_error, normal) =
            quadric::sampled_point(&self.transform, self.reverse_orientation, p, Vec3::ZERO, DVec3::Z);
        UvPoint { position, position_error, normal, area_by_uv: self.area_by_uv(uv) }
    }

    fn area_by_uv(&self, uv: Vec2) -> f32 {
        let (r, width) = self.radius_at(uv.y);
        (quadric::clamp_angle(self.phi_max) * r * width * quadric::area_stretch(&self.transform, DVec3::Z)) as f32
    }
}

impl Cylinder {
    fn at_uv(&self, uv: Vec2) -> UvPoint {
        let sample = self.point_at(uv);
        UvPoint { area_by_uv: 1.0 / sample.pdf_area, ..found(sample, 0.0) }
    }

    fn area_by_uv(&self, uv: Vec2) -> f32 {
        1.0 / self.point_at(uv).pdf_area
    }
}
