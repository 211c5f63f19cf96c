//! The spherical rectangle.

use std::f64::consts::TAU;

use glam::{DVec3, Vec2, Vec3};

/// Below this solid angle the closed form has lost too many digits, and its result is refined by Newton's method.
const REFINE_BELOW: f64 = 1e-6;

/// A rectangle seen from a point, sampled uniformly in solid angle.
///
/// Ureña, Fajardo and King 2013, "An Area-Preserving Parametrization for Spherical Rectangles".
#[derive(Clone, Copy, Debug)]
pub struct SphericalRectangle {
    reference: DVec3,
    /// Local frame around the reference point: x and y along the edges, the rectangle in the plane `z = z0 < 0`.
    x: DVec3,
    y: DVec3,
    z: DVec3,
    x0: f64,
    x1: f64,
    y0: f64,
    y1: f64,
    z0: f64,
    /// z components of the normals of the planes through the reference point and the edges `y = y0` and `y = y1`.
    b0: f64,
    b1: f64,
    /// `2π − γ₂ − γ₃` of the paper.
    k: f64,
    solid_angle: f64,
}

/// The interior angle between two planes with outward unit normals `n` and `m`.
fn angle(n: DVec3, m: DVec3) -> f64 {
    n.cross(m).length().atan2(-n.dot(m))
}

/// The solid angle of the rectangle `[x0, x1] × [y0, y1]` at height `z` over the origin, without cancellation: the sum of
/// two triangles by Van Oosterom and Strackee 1983.
fn solid_angle(x0: f64, x1: f64, y0: f64, y1: f64, z: f64) -> f64 {
    let length = |x: f64, y: f64| (x * x + y * y + z * z).sqrt();
    let (l00, l10, l11, l01) = (length(x0, y0), length(x1, y0), length(x1, y1), length(x0, y1));
    let (d00_11, zz) = (x0 * x1 + y0 * y1 + z * z, z * z);
    // The triple product of every such triangle is its height times twice its area.
    let triple = z.abs() * (x1 - x0) * (y1 - y0);
    let lower =
        triple.atan2(l00 * l10 * l11 + (x0 * x1 + y0 * y0 + zz) * l11 + (x1 * x1 + y0 * y1 + zz) * l00 + d00_11 * l10);
    let upper =
        triple.atan2(l00 * l01 * l11 + (x0 * x0 + y0 * y1 + zz) * l11 + (x0 * x1 + y1 * y1 + zz) * l00 + d00_11 * l01);
    2.0 * (lower + upper)
}

impl SphericalRectangle {
    /// The rectangle `corner + s·edge_x + t·edge_y`, `s, t ∈ [0, 1]`, seen from `reference`.
    ///
    /// The edges must be perpendicular; what is sampled is otherwise the rectangle of the same lengths along `edge_x` and
    /// the part of `edge_y` perpendicular to it. `None` where the solid angle is zero, too small for its reciprocal, or not
    /// finite, where the reference point is on an edge, and where the edges are within 30° of parallel.
    pub fn new(reference: Vec3, corner: Vec3, edge_x: Vec3, edge_y: Vec3) -> Option<Self> {
        let (reference, edge_x, edge_y) = (reference.as_dvec3(), edge_x.as_dvec3(), edge_y.as_dvec3());
        let d = corner.as_dvec3() - reference;
        let x = edge_x.normalize();
        let perpendicular = edge_y - x * x.dot(edge_y);
        if perpendicular.length_squared() < 0.25 * edge_y.length_squared() {
            return None;
        }
        let y = perpendicular.normalize();
        let mut z = x.cross(y);
        let mut z0 = d.dot(z);
        if z0 > 0.0 {
            (z, z0) = (-z, -z0);
        }
        let (x0, y0) = (d.dot(x), d.dot(y));
        let (x1, y1) = (x0 + edge_x.length(), y0 + edge_y.dot(y));
        let solid_angle = solid_angle(x0, x1, y0, y1, z0);
        // More than a hemisphere is what rounding makes of a reference point on an edge.
        if !(f64::from(f32::MIN_POSITIVE)..=TAU * (1.0 + 1e-9)).contains(&solid_angle) {
            return None;
        }
        let v = |x: f64, y: f64| DVec3::new(x, y, z0);
        let n0 = v(x0, y0).cross(v(x1, y0)).normalize();
        let n2 = v(x1, y1).cross(v(x0, y1)).normalize();
        let n3 = v(x0, y1).cross(v(x0, y0)).normalize();
        let k = TAU - angle(n2, n3) - angle(n3, n0);
        (k.is_finite()).then_some(Self { reference, x, y, z, x0, x1, y0, y1, z0, b0: n0.z, b1: n2.z, k, solid_angle })
    }

    /// The solid angle, in sr, in `(0, 2π]`.
    #[inline]
    pub fn solid_angle(&self) -> f32 {
        self.solid_angle as f32
    }

    /// The density of [`Self::sample`], in solid angle from the reference point: the reciprocal of
    /// [`Self::solid_angle`].
    #[inline]
    pub fn pdf(&self) -> f32 {
        self.solid_angle.recip() as f32
    }

    /// A point on the rectangle, uniform in the solid angle from the reference point.
    pub fn sample(&self, u: Vec2) -> Vec3 {
        let x = self.column(f64::from(u.x));
        let d_squared = x * x + self.z0 * self.z0;
        let sine = |y: f64| y / (d_squared + y * y).sqrt();
        let h0 = sine(self.y0);
        let h = h0 + f64::from(u.y) * (sine(self.y1) - h0);
        let y = (h * (d_squared / ((1.0 - h) * (1.0 + h))).sqrt()).clamp(self.y0, self.y1);
        let y = if y.is_nan() { self.y0 } else { y };
        (self.reference + self.x * x + self.y * y + self.z * self.z0).as_vec3()
    }

    /// The `u` that [`Self::sample`] maps to `point`, in the closed unit square; meaningless off the rectangle.
    pub fn inverse(&self, point: Vec3) -> Vec2 {
        let p = point.as_dvec3() - self.reference;
        let (x, y) = (p.dot(self.x).clamp(self.x0, self.x1), p.dot(self.y).clamp(self.y0, self.y1));
        let d_squared = x * x + self.z0 * self.z0;
        let sine = |y: f64| y / (d_squared + y * y).sqrt();
        let (h0, h1) = (sine(self.y0), sine(self.y1));
        let v = if h1 > h0 { (sine(y) - h0) / (h1 - h0) } else { 0.0 };
        let u = solid_angle(self.x0, x, self.y0, self.y1, self.z0) / self.solid_angle;
        Vec2::new(u as f32, v as f32).clamp(Vec2::ZERO, Vec2::ONE)
    }

    /// The x at which the part of the rectangle left of it has the fraction `u` of the solid angle (section 3.1).
    fn column(&self, u: f64) -> f64 {
        if self.solid_angle < REFINE_BELOW {
            return self.column_by_iteration(u);
        }
        let (sin, cos) = (u * self.solid_angle + self.k).sin_cos();
        let f = (cos * self.b0 - self.b1) / sin;
        let x = -f.signum() * self.z0 / (f * f + self.b0 * self.b0 - 1.0).sqrt();
        if x.is_nan() { self.x0 } else { x.clamp(self.x0, self.x1) }
    }

    /// [`Self::column`] by Newton's method, kept in a bracket by bisection.
    fn column_by_iteration(&self, u: f64) -> f64 {
        let target = u * self.solid_angle;
        let (mut low, mut high) = (self.x0, self.x1);
        let mut x = low + u * (high - low);
        for _ in 0..64 {
            let excess = solid_angle(self.x0, x, self.y0, self.y1, self.z0) - target;
            if excess > 0.0 {
                high = x;
            } else {
                low = x;
            }
            let d_squared = x * x + self.z0 * self.z0;
            let sine = |y: f64| y / (d_squared + y * y).sqrt();
            let slope = -self.z0 / d_squared * (sine(self.y1) - sine(self.y0));
            let next = x - excess / slope;
            let next = if next > low && next < high { next } else { 0.5 * (low + high) };
            if (next - x).abs() <= 1e-9 * (self.x1 - self.x0) {
                return next;
            }
            x = next;
        }
        x
    }
}
