//! The spherical triangle.

use glam::{DVec3, Vec2, Vec3};

/// The directions under which a triangle is seen, sampled uniformly in solid angle.
///
/// The map is that of Arvo 1995, "Stratified Sampling of Spherical Triangles". The sub-triangle of area `Ω′ = u.x Ω` is
/// found by half angles, `tan(b′/2) = sin(Ω′/2) / (tan(c/2) sin(α − Ω′/2))`, which follows from Van Oosterom and
/// Strackee's formula for the solid angle and, unlike Arvo's cosines, loses no digits where the triangle is small.
#[derive(Clone, Copy, Debug)]
pub struct SphericalTriangle {
    corners: [DVec3; 3],
    /// Unit vectors to the corners.
    a: DVec3,
    b: DVec3,
    /// Unit tangent at `a` along the great circle to `c`.
    tangent: DVec3,
    /// Tangent of half the angle between `a` and `b`.
    tan_half_c: f64,
    /// Sine and cosine of the angle of the triangle at `a`.
    sin_alpha: f64,
    cos_alpha: f64,
    solid_angle: f64,
}

/// What [`SphericalTriangle::sample`] returns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphericalTriangleSample {
    /// Unit direction from the reference point.
    pub direction: Vec3,
    /// Where the direction meets the plane triangle: barycentric coordinates, non-negative, of sum one.
    pub barycentric: [f32; 3],
}

/// The solid angle of the triangle of unit vectors `a`, `b`, `c` (Van Oosterom and Strackee 1983, eq. 8).
fn solid_angle(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    // The triple product of edges, since that of corners cancels where the triangle is small.
    let triple = a.dot((b - a).cross(c - a)).abs();
    2.0 * triple.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
}

impl SphericalTriangle {
    /// The triangle of corners `a`, `b`, `c`, given as vectors from the reference point, of any length.
    ///
    /// `None` where the solid angle is zero, or so small that its reciprocal overflows, or not finite: the triangle or the
    /// reference point is degenerate, or two corners are opposite, or the reference point lies in the triangle.
    pub fn new(a: Vec3, b: Vec3, c: Vec3) -> Option<Self> {
        let corners = [a.as_dvec3(), b.as_dvec3(), c.as_dvec3()];
        let [a, b, c] = corners.map(DVec3::normalize);
        let solid_angle = solid_angle(a, b, c);
        // Between opposite corners there is no arc.
        let apart = |p: DVec3, q: DVec3| (p + q).length_squared() > 1e-12;
        let whole = apart(a, b) && apart(b, c) && apart(c, a);
        if solid_angle.is_nan() || solid_angle < f64::from(f32::MIN_POSITIVE) || !whole {
            return None;
        }
        // Directions of the edges at a, projected to its tangent plane from the differences, again to keep digits.
        let (to_b, to_c) = (b - a, c - a);
        let ab = to_b - a * a.dot(to_b);
        let tangent = (to_c - a * a.dot(to_c)).normalize();
        // Once more, for what cancels where c is nearly opposite.
        let tangent = (tangent - a * a.dot(tangent)).normalize();
        let sin_alpha = a.dot(ab.cross(tangent)).abs();
        let cos_alpha = ab.dot(tangent);
        let scale = sin_alpha.hypot(cos_alpha).recip();
        if sin_alpha == 0.0 {
            return None;
        }
        let tan_half_c = to_b.length() / (a + b).length();
        let triangle = Self {
            corners,
            a,
            b,
            tangent,
            tan_half_c,
            sin_alpha: sin_alpha * scale,
            cos_alpha: cos_alpha * scale,
            solid_angle,
        };
        (scale.is_finite() && tangent.is_finite() && tan_half_c.is_finite()).then_some(triangle)
    }

    /// The solid angle, in sr, in `(0, 2π]`.
    #[inline]
    pub fn solid_angle(&self) -> f32 {
        self.solid_angle as f32
    }

    /// The density of [`Self::sample`], in solid angle: the reciprocal of [`Self::solid_angle`].
    #[inline]
    pub fn pdf(&self) -> f32 {
        self.solid_angle.recip() as f32
    }

    /// A direction of the triangle, uniform in solid angle.
    pub fn sample(&self, u: Vec2) -> SphericalTriangleSample {
        let (sin, cos) = (0.5 * f64::from(u.x) * self.solid_angle).sin_cos();
        let sin_rest = self.sin_alpha * cos - self.cos_alpha * sin;
        // tan(b′/2) as the quotient y/x, whose denominator may reach zero.
        let (y, x) = (sin, self.tan_half_c * sin_rest);
        let (y2, x2) = (y * y, x * x);
        let c = (self.a * (x2 - y2) + self.tangent * (2.0 * x * y)) / (x2 + y2);

        let chord = c - self.b;
        let h = f64::from(u.y) * 0.5 * chord.length_squared();
        let across = (chord - self.b * self.b.dot(chord)).normalize_or_zero();
        let direction = (self.b * (1.0 - h) + across * (h * (2.0 - h)).max(0.0).sqrt()).normalize_or(self.b);
        SphericalTriangleSample { direction: direction.as_vec3(), barycentric: self.barycentric(direction) }
    }

    /// The `u` that [`Self::sample`] maps to `direction`, in the closed unit square; meaningless outside the triangle.
    pub fn inverse(&self, direction: Vec3) -> Vec2 {
        let p = direction.as_dvec3().normalize();
        // The great circles through b and p, and through a and c, meet in the end of the arc that p lies on.
        let (bp, normal) = (self.b.cross(p - self.b), self.a.cross(self.tangent));
        let mut c = normal.cross(bp).normalize_or(self.a);
        if c.dot(p - self.b * self.b.dot(p)) < 0.0 {
            c = -c;
        }
        let chord = (c - self.b).length_squared();
        let x = solid_angle(self.a, self.b, c) / self.solid_angle;
        let y = if chord > 0.0 { (p - self.b).length_squared() / chord } else { 0.0 };
        Vec2::new(x as f32, y as f32).clamp(Vec2::ZERO, Vec2::ONE)
    }

    fn barycentric(&self, p: DVec3) -> [f32; 3] {
        // Volumes of the tetrahedra of p and two corners; corners relative to one another, to keep digits.
        let [a, b, c] = self.corners;
        let volume = |p: DVec3, q: DVec3, r: DVec3| p.dot(q.cross(r - q));
        let sign = volume(a, b, c).signum();
        let (v0, v1, v2) =
            ((sign * volume(p, b, c)).max(0.0), (sign * volume(p, c, a)).max(0.0), (sign * volume(p, a, b)).max(0.0));
        let sum = v0 + v1 + v2;
        if sum.is_nan() || sum <= 0.0 {
            return [1.0 / 3.0; 3];
        }
        let (b0, b1) = ((v0 / sum) as f32, (v1 / sum) as f32);
        [b0, b1, (1.0 - b0 - b1).max(0.0)]
    }
}
