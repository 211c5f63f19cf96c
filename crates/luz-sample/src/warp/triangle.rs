//! The triangle.

use glam::Vec2;

/// Barycentric coordinates of a point of a triangle, uniform in area.
///
/// Heitz 2019, "A Low-Distortion Map Between Triangle and Square". The coordinates are non-negative and the third is
/// exact: `1 − max(u)`.
#[inline]
pub fn uniform_triangle(u: Vec2) -> [f32; 3] {
    if u.x < u.y {
        let b0 = 0.5 * u.x;
        [b0, u.y - b0, 1.0 - u.y]
    } else {
        let b1 = 0.5 * u.y;
        [u.x - b1, b1, 1.0 - u.x]
    }
}

/// The density of [`uniform_triangle`] on a triangle of the given area, in area; infinite where the area is zero.
#[inline(always)]
pub fn uniform_triangle_pdf(area: f32) -> f32 {
    1.0 / area
}

/// The `u` that [`uniform_triangle`] maps to the barycentric coordinates `b`, in the closed unit square.
#[inline]
pub fn uniform_triangle_inverse(b: [f32; 3]) -> Vec2 {
    let u = if b[0] < b[1] { Vec2::new(2.0 * b[0], b[0] + b[1]) } else { Vec2::new(b[0] + b[1], 2.0 * b[1]) };
    u.clamp(Vec2::ZERO, Vec2::ONE)
}
