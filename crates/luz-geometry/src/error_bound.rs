//! Bounds on floating-point error, and ray origins kept clear of the surfaces they leave.
//!
//! Source: Higham, *Accuracy and Stability of Numerical Algorithms*, section 3.1; Pharr, Jakob, Humphreys, *Physically
//! Based Rendering*, 4th edition, section 6.8.

use glam::Vec3;

/// `γₙ = n ε / (1 − n ε)` with `ε = 2⁻²⁴`: bounds the relative error of `n` chained `f32` operations.
#[inline(always)]
pub const fn gamma(n: i32) -> f32 {
    const EPSILON: f32 = f32::EPSILON * 0.5;
    (n as f32 * EPSILON) / (1.0 - n as f32 * EPSILON)
}

/// The least `f32` greater than `x`.
#[inline]
pub fn next_up(x: f32) -> f32 {
    x.next_up()
}

/// The greatest `f32` less than `x`.
#[inline]
pub fn next_down(x: f32) -> f32 {
    x.next_down()
}

/// Where a ray towards `direction` should start so that it does not meet again the surface it leaves.
///
/// `position` is known up to ±`error` on each axis, `normal` is the unit geometric normal. The origin moves along the
/// normal, to the side that `direction` points to, until the plane through any point of the error box is behind it, and
/// is then rounded away from `position`.
#[inline(always)]
pub fn offset_ray_origin(position: Vec3, error: Vec3, normal: Vec3, direction: Vec3) -> Vec3 {
    let distance = normal.abs().dot(error);
    let offset = if direction.dot(normal) < 0.0 { -distance * normal } else { distance * normal };
    let moved = position + offset;
    // At least one unit in the last place, for |x| 2⁻²³ is never less. Near zero, where units are subnormal, as far as
    // products with other numbers stay normal: subnormal arithmetic costs a hundred times as much.
    let ulp = moved.abs() * f32::EPSILON + 1e-25;
    moved + ulp.copysign(offset)
}
