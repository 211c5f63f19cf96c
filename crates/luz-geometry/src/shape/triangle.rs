//! Triangle meshes.

use glam::{DVec3, Vec2, Vec3};

use super::flat_triangle::FlatTriangle;
use super::{AreaSample, ParametricHit, Reference, SolidAngleSample};
use crate::{Bounds3, Frame, Hit, NO_INSTANCE, Ray, SurfacePoint, Transform, gamma};

/// Triangles that share vertices, in world space.
///
/// The normal of a triangle is `(p1 − p0) × (p2 − p0)`, turned round where exactly one of `reverse_orientation` and
/// `swaps_handedness` is set; where there are vertex normals it is turned to their side instead.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Three vertices per triangle.
    pub indices: Vec<[u32; 3]>,
    /// Vertex normals, any length; as many as positions.
    pub normals: Option<Vec<Vec3>>,
    /// Vertex tangents; as many as positions.
    pub tangents: Option<Vec<Vec3>>,
    /// Vertex texture coordinates; as many as positions. Without, the corners are (0,0), (1,0), (1,1).
    pub uvs: Option<Vec<Vec2>>,
    /// A number for each triangle, as some textures want it.
    pub face_indices: Option<Vec<u32>>,
    /// Turns the normals, those of the vertices too.
    pub reverse_orientation: bool,
    /// Whether the transform that brought the mesh to the world swaps handedness; [`Self::transform`] keeps it.
    pub swaps_handedness: bool,
}

impl TriangleMesh {
    /// Moves the mesh: positions, normals (by the transposed inverse), tangents, and handedness.
    pub fn transform(&mut self, transform: &Transform) {
        if transform.is_identity() {
            return;
        }
        self.positions.iter_mut().for_each(|p| *p = transform.point(*p));
        self.normals.iter_mut().flatten().for_each(|n| *n = transform.normal(*n));
        self.tangents.iter_mut().flatten().for_each(|s| *s = transform.vector(*s));
        self.swaps_handedness ^= transform.swaps_handedness();
    }

    /// The corners of a triangle whose indices are in range.
    #[inline]
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.indices[triangle].map(|i| self.positions[i as usize])
    }

    fn flips(&self) -> bool {
        self.reverse_orientation != self.swaps_handedness
    }

    /// The interpolated vertex normal at barycentric coordinates, unnormalised, if there are vertex normals.
    #[inline]
    fn vertex_normal(&self, triangle: usize, b: [f32; 3]) -> Option<Vec3> {
        let normals = self.normals.as_ref()?;
        let [n0, n1, n2] = self.indices[triangle].map(|i| normals[i as usize]);
        let n = b[0] * n0 + b[1] * n1 + b[2] * n2;
        Some(if self.reverse_orientation { -n } else { n })
    }

    /// The unit geometric normal, oriented, of a triangle in the plane of unit normal `n`, where the vertices have that normal.
    #[inline]
    fn geometric_normal(&self, n: Vec3, of_vertices: Option<Vec3>) -> Vec3 {
        match of_vertices {
            Some(ns) if ns.length_squared() > 0.0 => face_forward(n, ns),
            _ if self.flips() => -n,
            _ => n,
        }
    }

    /// For each corner on which side of a triangle of unit normal `n` its vertex normal is, which decides about the geometric
    /// normal: positive where on that of `n`.
    pub(super) fn corner_sides(&self, triangle: usize, n: Vec3) -> [f32; 3] {
        let normals = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
            .map(|b| self.vertex_normal(triangle, b).unwrap_or(Vec3::ZERO));
        if normals == [Vec3::ZERO; 3] {
            return [if self.flips() { -1.0 } else { 1.0 }; 3];
        }
        normals.map(|normal| normal.dot(n))
    }

    pub(super) fn corner_uvs(&self, triangle: usize) -> [Vec2; 3] {
        match &self.uvs {
            Some(uvs) => self.indices[triangle].map(|i| uvs[i as usize]),
            None => [Vec2::ZERO, Vec2::X, Vec2::ONE],
        }
    }

    pub(super) fn is_valid(&self, triangle: usize) -> bool {
        let n = self.positions.len();
        if self.normals.as_ref().is_some_and(|a| a.len() != n)
            || self.uvs.as_ref().is_some_and(|a| a.len() != n)
            || self.tangents.as_ref().is_some_and(|s| s.len() != n)
        {
            return false;
        }
        if self.indices[triangle].iter().any(|&i| i as usize >= n) {
            return false;
        }
        let [p0, p1, p2] = self.corners(triangle);
        p0.is_finite()
            && p1.is_finite()
            && p2.is_finite()
            && (p1.as_dvec3() - p0.as_dvec3()).cross(p2.as_dvec3() - p0.as_dvec3()).length_squared() > 0.0
    }

    pub(super) fn bounds(&self, triangle: usize) -> Bounds3 {
        Bounds3::from_points(self.corners(triangle))
    }

    pub(super) fn intersect(&self, ray: &Ray, t_max: f32, triangle: usize) -> Option<ParametricHit> {
        Shear::new(ray).intersect(self.corners(triangle), t_max, false)
    }

    pub(super) fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let triangle = hit.primitive as usize;
        let corners @ [p0, p1, p2] = self.corners(triangle);
        let b = [1.0 - hit.u - hit.v, hit.u, hit.v];
        let (flat_normal, _) = normal_and_area(corners);
        let (uv, (dpdu, dpdv)) = match &self.uvs {
            None => (Vec2::new(b[1] + b[2], b[2]), (p1 - p0, p2 - p1)),
            Some(_) => {
                let uvs @ [uv0, uv1, uv2] = self.corner_uvs(triangle);
                // Solve p0 − p2 = (uv0 − uv2)·(dpdu, dpdv), and the same for the second edge.
                let derivatives = TextureMap::new(uvs)
                    .map(|texture| texture.derivatives(corners))
                    .filter(|(dpdu, dpdv)| dpdu.cross(*dpdv).length_squared() > 0.0)
                    .unwrap_or_else(|| {
                        let frame = Frame::from_z(-flat_normal);
                        (frame.s, frame.t)
                    });
                (b[0] * uv0 + b[1] * uv1 + b[2] * uv2, derivatives)
            }
        };

        let position = b[0] * p0 + b[1] * p1 + b[2] * p2;
        let magnitude = (b[0] * p0).abs() + (b[1] * p1).abs() + (b[2] * p2).abs();
        let vertex_normal = self.vertex_normal(triangle, b);
        let geometric_normal = self.geometric_normal(flat_normal, vertex_normal);
        let mut point = SurfacePoint {
            position,
            position_error: gamma(7) * magnitude,
            geometric_normal,
            shading_normal: geometric_normal,
            uv,
            dpdu,
            dpdv,
            shading_dpdu: dpdu,
            shading_dpdv: dpdv,
            dndu: Vec3::ZERO,
            dndv: Vec3::ZERO,
            parametric: Vec2::new(hit.u, hit.v),
            face_index: self.face_indices.as_ref().and_then(|f| f.get(triangle).copied()).unwrap_or(0),
            time: ray.time,
            shape: hit.shape,
            primitive: hit.primitive,
            instance: NO_INSTANCE,
        };
        if self.normals.is_some() || self.tangents.is_some() {
            self.shade(triangle, b, vertex_normal, &mut point);
        }
        point
    }

    /// Sets the shading normal and tangents from those of the vertices.
    fn shade(&self, triangle: usize, b: [f32; 3], interpolated: Option<Vec3>, point: &mut SurfacePoint) {
        let ns = interpolated.and_then(Vec3::try_normalize).unwrap_or(point.geometric_normal);
        let tangent = match &self.tangents {
            Some(tangents) => {
                let [s0, s1, s2] = self.indices[triangle].map(|i| tangents[i as usize]);
                let s = b[0] * s0 + b[1] * s1 + b[2] * s2;
                if s.length_squared() > 0.0 { s } else { point.dpdu }
            }
            None => point.dpdu,
        };
        let bitangent = ns.cross(tangent);
        (point.shading_dpdu, point.shading_dpdv) = if bitangent.length_squared() > 0.0 {
            (bitangent.cross(ns), bitangent)
        } else {
            let frame = Frame::from_z(ns);
            (frame.s, frame.t)
        };
        point.shading_normal = ns;
        if let Some(normals) = &self.normals {
            // Of unit length where they meet, whatever length they are given in.
            let length = interpolated.map_or(1.0, Vec3::length).max(f32::MIN_POSITIVE);
            let scale = if self.reverse_orientation { -1.0 } else { 1.0 } / length;
            let [n0, n1, n2] = self.indices[triangle].map(|i| scale * normals[i as usize]);
            (point.dndu, point.dndv) = match TextureMap::new(self.corner_uvs(triangle)) {
                Some(texture) => texture.derivatives([n0, n1, n2]),
                None => match (n2 - n0).cross(n1 - n0).try_normalize() {
                    Some(n) => {
                        let frame = Frame::from_z(n);
                        (frame.s, frame.t)
                    }
                    None => (Vec3::ZERO, Vec3::ZERO),
                },
            };
        }
    }

    pub(super) fn area(&self, triangle: usize) -> f32 {
        normal_and_area(self.corners(triangle)).1
    }

    /// The triangle, ready to be sampled.
    pub(super) fn flat(&self, triangle: usize) -> FlatTriangle {
        FlatTriangle::new(self, triangle)
    }

    pub(super) fn sample_area(&self, triangle: usize, u: Vec2) -> Option<AreaSample> {
        self.flat(triangle).sample_area(u)
    }

    pub(super) fn pdf_area(&self, point: &SurfacePoint) -> f32 {
        1.0 / self.area(point.primitive as usize)
    }

    pub(super) fn sample_solid_angle(
        &self,
        reference: &Reference,
        triangle: usize,
        u: Vec2,
    ) -> Option<SolidAngleSample> {
        self.flat(triangle).sample_solid_angle(reference, u)
    }

    pub(super) fn pdf_solid_angle(&self, reference: &Reference, point: &SurfacePoint) -> f32 {
        self.flat(point.primitive as usize).pdf_solid_angle(reference, point)
    }
}

/// The unit normal along `(p1 − p0) × (p2 − p0)` and the area; the product in `f64`, so that slivers have one too.
#[inline]
pub(super) fn normal_and_area([p0, p1, p2]: [Vec3; 3]) -> (Vec3, f32) {
    let (p0, p1, p2) = (p0.as_dvec3(), p1.as_dvec3(), p2.as_dvec3());
    let cross = (p1 - p0).cross(p2 - p0);
    let length_squared = cross.length_squared();
    // Single precision has a much faster root, and range enough for all but the smallest and largest triangles.
    if (1e-30..1e30).contains(&length_squared) {
        let length = (length_squared as f32).sqrt();
        (cross.as_vec3() / length, 0.5 * length)
    } else {
        (cross.normalize_or_zero().as_vec3(), (0.5 * cross.length()) as f32)
    }
}

/// `n` or `−n`, whichever is on the side of `towards`.
pub(super) fn face_forward(n: Vec3, towards: Vec3) -> Vec3 {
    if n.dot(towards) < 0.0 { -n } else { n }
}

/// The map from a triangle to its texture coordinates, inverted.
struct TextureMap {
    d02: Vec2,
    d12: Vec2,
    determinant: f32,
}

impl TextureMap {
    /// `None` where the texture coordinates are degenerate.
    fn new([uv0, uv1, uv2]: [Vec2; 3]) -> Option<Self> {
        let (d02, d12) = (uv0 - uv2, uv1 - uv2);
        let determinant = (f64::from(d02.x) * f64::from(d12.y) - f64::from(d02.y) * f64::from(d12.x)) as f32;
        (determinant.abs() >= 1e-9).then_some(Self { d02, d12, determinant })
    }

    /// The derivatives by u and v of what has the values `v0`, `v1`, `v2` at the corners.
    fn derivatives(&self, [v0, v1, v2]: [Vec3; 3]) -> (Vec3, Vec3) {
        let (a, b) = (v0 - v2, v1 - v2);
        let inverse = 1.0 / self.determinant;
        ((self.d12.y * a - self.d02.y * b) * inverse, (self.d02.x * b - self.d12.x * a) * inverse)
    }
}

/// A ray prepared for watertight triangle tests (Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection").
///
/// Space is translated to the origin and sheared so that the ray runs along +z; the edge functions of a triangle are then
/// 2D. Products are rounded once and subtracted, never fused: `fl(ab) − fl(cd)` has the sign of `ab − cd` or is zero, and
/// changes sign with its operands, so two triangles never disagree about an edge they share. Zero counts as inside; where
/// all three vanish, `f64` decides, in which the products are exact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shear {
    pub origin: [f32; 3],
    pub direction: Vec3,
    /// The axes that become x, y, z; z is where the direction is longest.
    pub axes: [usize; 3],
    pub shear: [f32; 2],
    pub scale: f32,
}

impl Shear {
    #[inline]
    pub fn new(ray: &Ray) -> Self {
        let d = ray.direction.to_array();
        let a = ray.direction.abs();
        let z = if a.x > a.y && a.x > a.z {
            0
        } else if a.y > a.z {
            1
        } else {
            2
        };
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        Self {
            origin: ray.origin.to_array(),
            direction: ray.direction,
            axes: [x, y, z],
            shear: [d[x] / d[z], d[y] / d[z]],
            scale: 1.0 / d[z],
        }
    }

    /// The vertex in ray space: x, y, z, and z in units of `t`.
    #[inline(always)]
    fn vertex(&self, p: Vec3) -> (f32, f32, f32, f32) {
        let [x, y, z] = self.axes;
        let p = p.to_array();
        let height = p[z] - self.origin[z];
        (
            (p[x] - self.origin[x]) - self.shear[0] * height,
            (p[y] - self.origin[y]) - self.shear[1] * height,
            height,
            height * self.scale,
        )
    }

    /// The hit at `0 < t ≤ t_max`; where rounding leaves it open whether `t` is positive, there is none if the ray `leaves`
    /// the triangle, and otherwise `f64` decides. The SIMD tests do the same arithmetic in the same order, so that they agree to
    /// the last bit.
    #[inline]
    pub fn intersect(&self, corners: [Vec3; 3], t_max: f32, leaves: bool) -> Option<ParametricHit> {
        let [(x0, y0, h0, z0), (x1, y1, h1, z1), (x2, y2, h2, z2)] = corners.map(|p| self.vertex(p));
        let (mut e0, mut e1, mut e2) = (x1 * y2 - y1 * x2, x2 * y0 - y2 * x0, x0 * y1 - y0 * x1);
        if (e0 < 0.0 || e1 < 0.0 || e2 < 0.0) && (e0 > 0.0 || e1 > 0.0 || e2 > 0.0) {
            return None;
        }
        let mut determinant = (e0 + e1) + e2;
        if determinant == 0.0 {
            let edge =
                |ax: f32, ay: f32, bx: f32, by: f32| f64::from(ax) * f64::from(by) - f64::from(ay) * f64::from(bx);
            let exact = [edge(x1, y1, x2, y2), edge(x2, y2, x0, y0), edge(x0, y0, x1, y1)];
            if exact.iter().any(|&e| e < 0.0) && exact.iter().any(|&e| e > 0.0) {
                return None;
            }
            // Scaled up, for the quotients alone matter and f32 might not hold them.
            let largest = exact.iter().fold(0f64, |m, e| m.max(e.abs()));
            if largest == 0.0 {
                return None;
            }
            [e0, e1, e2] = exact.map(|e| (e / largest) as f32);
            determinant = (e0 + e1) + e2;
        }
        let mut t = ((e0 * z0 + e1 * z1) + e2 * z2) / determinant;
        // If all corners are behind the origin so is the hit, whatever the rounding.
        if t > t_max || !(z0 > 0.0 || z1 > 0.0 || z2 > 0.0) {
            return None;
        }
        let max_h = h0.abs().max(h1.abs()).max(h2.abs());
        let max_z = z0.abs().max(z1.abs()).max(z2.abs());
        let max_x = x0.abs().max(x1.abs()).max(x2.abs());
        let max_y = y0.abs().max(y1.abs()).max(y2.abs());
        let max_e = e0.abs().max(e1.abs()).max(e2.abs());
        if t.abs() <= t_error(max_x, max_y, max_h, max_z, max_e, determinant.abs()) {
            if leaves {
                return None;
            }
            t = self.plane_distance(corners)?;
        }
        // NaN, which only overflow makes, is no hit.
        (t > 0.0 && t <= t_max).then_some((t, e1 / determinant, e2 / determinant))
    }

    /// Where the ray meets the plane of a triangle, in `f64`, for rays that start near it or run along it; `None` where that
    /// is behind the origin, and where not even `f64` tells where it is, as for origins in the plane.
    #[inline]
    pub fn plane_distance(&self, corners: [Vec3; 3]) -> Option<f32> {
        const MARGIN: f64 = 1e-14;
        let origin = DVec3::from_array(self.origin.map(f64::from));
        let direction = self.direction.as_dvec3();
        let [p0, p1, p2] = corners.map(|p| p.as_dvec3() - origin);
        let (a, b) = (p1 - p0, p2 - p0);
        let normal = a.cross(b);
        let (height, slope) = (normal.dot(p0), normal.dot(direction));
        if (height > 0.0) != (slope > 0.0) {
            return None;
        }
        let size_squared = a.length_squared() * b.length_squared() * (MARGIN * MARGIN);
        (height * height > size_squared * p0.length_squared()
            && slope * slope > size_squared * direction.length_squared())
        .then_some((height / slope) as f32)
    }
}

/// How far `t` may be off by rounding (*Physically Based Rendering*, 4th edition, section 6.8.3), from the largest
/// absolute coordinates in ray space: heights `h` are lengths, `z` are those in units of `t`.
#[inline(always)]
fn t_error(max_x: f32, max_y: f32, max_h: f32, max_z: f32, max_e: f32, determinant: f32) -> f32 {
    let delta_x = gamma(5) * (max_x + max_h);
    let delta_y = gamma(5) * (max_y + max_h);
    let delta_z = gamma(3) * max_z;
    let delta_e = 2.0 * ((gamma(2) * (max_x * max_y) + delta_y * max_x) + delta_x * max_y);
    3.0 * (((gamma(3) * max_e) * max_z + delta_e * max_z) + delta_z * max_e) / determinant
}
