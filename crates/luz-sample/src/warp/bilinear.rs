//! A density that is bilinear on the unit square.

use glam::Vec2;

use super::linear::{linear, linear_inverse, linear_pdf};
use crate::ONE_MINUS_EPSILON;

/// The heights at `(0, y)` and `(1, y)`.
#[inline]
fn row(y: f32, w: [f32; 4]) -> (f32, f32) {
    ((1.0 - y) * w[0] + y * w[2], (1.0 - y) * w[1] + y * w[3])
}

/// A point of the unit square whose density is proportional to the bilinear interpolation of the heights `w ≥ 0` at
/// `(0,0)`, `(1,0)`, `(0,1)`, `(1,1)`. Uniform where all are zero.
///
/// y is drawn from its marginal density by `u.y`, then x from the row by `u.x`.
#[inline]
pub fn bilinear(u: Vec2, w: [f32; 4]) -> Vec2 {
    let y = linear(u.y, w[0] + w[1], w[2] + w[3]);
    let (a, b) = row(y, w);
    Vec2::new(linear(u.x, a, b), y)
}

/// The density of [`bilinear`], in area: zero outside the unit square.
#[inline]
pub fn bilinear_pdf(p: Vec2, w: [f32; 4]) -> f32 {
    let (a, b) = row(p.y, w);
    linear_pdf(p.y, w[0] + w[1], w[2] + w[3]) * linear_pdf(p.x, a, b)
}

/// [`bilinear`] and its density, for less than the price of both, where heights are positive and the squares of their sums
/// neither overflow nor vanish.
#[inline(always)]
pub fn bilinear_with_pdf(u: Vec2, w: [f32; 4]) -> (Vec2, f32) {
    let along =
        |u: f32, a: f32, b: f32| (u * (a + b) / (a + ((1.0 - u) * a * a + u * b * b).sqrt())).min(ONE_MINUS_EPSILON);
    let (low, high) = (w[0] + w[1], w[2] + w[3]);
    let y = along(u.y, low, high);
    let (a, b) = row(y, w);
    let x = along(u.x, a, b);
    (Vec2::new(x, y), 4.0 * ((1.0 - x) * a + x * b) / (low + high))
}

/// The `u` that [`bilinear`] maps to `p`.
#[inline]
pub fn bilinear_inverse(p: Vec2, w: [f32; 4]) -> Vec2 {
    let (a, b) = row(p.y, w);
    Vec2::new(linear_inverse(p.x, a, b), linear_inverse(p.y, w[0] + w[1], w[2] + w[3]))
}
