//! Orthonormal frames.

use glam::Vec3;

/// A vector that is a unit vector but for rounding, made one to the last bits: a step of Newton's method, much faster than a root
/// and a quotient. What it was off by, squared, remains.
#[inline(always)]
pub fn renormalized(v: Vec3) -> Vec3 {
    v * (1.5 - 0.5 * v.length_squared())
}

/// A right-handed orthonormal basis; `n` is the local z axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Local x axis, in world space.
    pub s: Vec3,
    /// Local y axis, in world space.
    pub t: Vec3,
    /// Local z axis, in world space.
    pub n: Vec3,
}

impl Frame {
    /// A frame around the unit vector `n`, continuous but at `n.z = −0` (Duff et al. 2017,
    /// "Building an Orthonormal Basis, Revisited").
    #[inline]
    pub fn from_z(n: Vec3) -> Self {
        let sign = 1f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            s: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            t: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }

    /// A frame around the unit vector `n` whose x axis is as near as can be to `x`; any frame around `n` where `x` is
    /// parallel to `n` or not finite.
    #[inline]
    pub fn from_zx(n: Vec3, x: Vec3) -> Self {
        let s = x - n * n.dot(x);
        let squared = s.length_squared();
        let (s, t) = if squared > 1e-12 * x.length_squared() && squared.is_finite() {
            let s = s * (1.0 / squared.sqrt());
            (s, n.cross(s))
        } else {
            let Self { s, t, .. } = Self::from_z(n);
            (s, t)
        };
        Self { s, t, n }
    }

    /// From world to local space.
    #[inline(always)]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.s), v.dot(self.t), v.dot(self.n))
    }

    /// From local to world space.
    #[inline(always)]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.s * v.x + self.t * v.y + self.n * v.z
    }
}
