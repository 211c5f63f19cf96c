//! Transforms that move.

use glam::{DMat3, DMat4, DQuat, DVec3, Mat4, Vec3};

use crate::{Bounds3, Transform};

/// A transform that goes from one to another while time goes from `start_time` to `end_time`.
///
/// Translation is interpolated linearly, rotation by slerp along the shorter arc, and the remaining scale and shear
/// linearly, after a polar decomposition `M = T R S` (Shoemake and Duff 1992, "Matrix Animation and Polar
/// Decomposition"). Reflections are counted to `S`.
#[derive(Clone, Debug, PartialEq)]
pub struct AnimatedTransform {
    start: Transform,
    end: Transform,
    start_time: f32,
    end_time: f32,
    parts: Option<[Parts; 2]>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Parts {
    translation: DVec3,
    rotation: DQuat,
    scale: DMat3,
}

impl AnimatedTransform {
    /// `start` until `start_time`, `end` from `end_time` on, a smooth way in between. Where the times do not increase,
    /// there is no way between: it is `start` up to and at `start_time`, then `end`.
    pub fn new(start: Transform, start_time: f32, end: Transform, end_time: f32) -> Self {
        let parts = (start != end).then(|| {
            let a = decompose(start.matrix());
            let mut b = decompose(end.matrix());
            if a.rotation.dot(b.rotation) < 0.0 {
                b.rotation = -b.rotation;
            }
            [a, b]
        });
        Self { start, end, start_time, end_time, parts }
    }

    /// Whether it moves at all.
    pub fn is_animated(&self) -> bool {
        self.parts.is_some()
    }

    /// The transform at `time`.
    pub fn interpolate(&self, time: f32) -> Transform {
        let Some([a, b]) = &self.parts else { return self.start };
        if time <= self.start_time || time.is_nan() {
            return self.start;
        }
        if time >= self.end_time {
            return self.end;
        }
        let s =
            (f64::from(time) - f64::from(self.start_time)) / (f64::from(self.end_time) - f64::from(self.start_time));
        let translation = a.translation.lerp(b.translation, s);
        let linear = DMat3::from_quat(slerp(a.rotation, b.rotation, s)) * (a.scale * (1.0 - s) + b.scale * s);
        let matrix = DMat4::from_cols(
            linear.x_axis.extend(0.0),
            linear.y_axis.extend(0.0),
            linear.z_axis.extend(0.0),
            translation.extend(1.0),
        );
        // Between two reflections or squeezes the scale may pass through zero: then there is nothing to invert, and the
        // nearer end stands in.
        Transform::try_from_f64(matrix).unwrap_or(if s < 0.5 { self.start } else { self.end })
    }

    /// A box around the image of `bounds` at every time: conservative.
    ///
    /// A corner moves on `f(s) = T(s) + R(s) S(s) p` with `T` and `S` linear and `R` a rotation at constant speed `θ`, so
    /// `|f''| ≤ θ² |S p| + 2 θ |S' p|`; on a piece of length `h` it strays from the chord by at most `h² max|f''| / 8`.
    pub fn motion_bounds(&self, bounds: &Bounds3) -> Bounds3 {
        let ends = self.start.bounds(bounds).union(self.end.bounds(bounds));
        let Some([a, b]) = &self.parts else { return ends };
        if bounds.is_empty() || !bounds.is_finite() || self.start_time >= self.end_time {
            return ends;
        }
        let theta = 2.0 * a.rotation.dot(b.rotation).clamp(-1.0, 1.0).acos();
        if theta == 0.0 && a.scale == b.scale {
            // Translation alone moves along straight lines.
            return ends.expanded(1e-5 * (ends.min.abs().max(ends.max.abs())).max_element());
        }
        const PIECES: u32 = 64;
        let mut curvature: f64 = 0.0;
        for corner in bounds.corners() {
            let p = corner.as_dvec3();
            let stretched = (a.scale * p).length().max((b.scale * p).length());
            let change = ((b.scale - a.scale) * p).length();
            curvature = curvature.max(theta * theta * stretched + 2.0 * theta * change);
        }
        let stray = (curvature / f64::from(8 * PIECES * PIECES)) as f32;
        let mut out = ends;
        for i in 1..PIECES {
            let s = i as f32 / PIECES as f32;
            let time = self.start_time + (self.end_time - self.start_time) * s;
            out = out.union(self.interpolate(time).bounds(bounds));
        }
        // The decomposition reproduces the ends only up to rounding.
        out.expanded(stray * 1.001 + 1e-5 * out.min.abs().max(out.max.abs()).max_element())
    }

    /// The times between which it moves.
    pub fn time_range(&self) -> (f32, f32) {
        (self.start_time, self.end_time)
    }

    /// The transforms at the two ends.
    pub fn ends(&self) -> (&Transform, &Transform) {
        (&self.start, &self.end)
    }

    /// Whether it turns left hands into right ones, at the start.
    pub fn swaps_handedness(&self) -> bool {
        self.start.swaps_handedness()
    }

    /// Where the point `p` is at `time`.
    pub fn point(&self, p: Vec3, time: f32) -> Vec3 {
        self.interpolate(time).point(p)
    }
}

/// `M = T R S` with `R` a proper rotation, by Newton's iteration `R ← (R + R⁻ᵀ)/2`.
fn decompose(matrix: &Mat4) -> Parts {
    let m = matrix.as_dmat4();
    let translation = m.w_axis.truncate();
    let linear = DMat3::from_mat4(m);
    let mut r = linear;
    for _ in 0..100 {
        let next = (r + r.inverse().transpose()) * 0.5;
        let change = (0..3).map(|i| (next.col(i) - r.col(i)).abs().element_sum()).fold(0.0, f64::max);
        r = next;
        if change < 1e-14 {
            break;
        }
    }
    if r.determinant() < 0.0 {
        r *= -1.0;
    }
    Parts { translation, rotation: DQuat::from_mat3(&r).normalize(), scale: r.transpose() * linear }
}

/// Spherical interpolation along the arc from `a` to `b` as they are given, stable for near-equal rotations.
fn slerp(a: DQuat, b: DQuat, s: f64) -> DQuat {
    let difference = (a - b).length();
    let sum = (a + b).length();
    let angle = 2.0 * difference.atan2(sum);
    let sinc = |x: f64| if x.abs() < 1e-8 { 1.0 } else { x.sin() / x };
    let whole = sinc(angle);
    let (wa, wb) = ((1.0 - s) * sinc((1.0 - s) * angle) / whole, s * sinc(s * angle) / whole);
    (a * wa + b * wb).normalize()
}
