//! The unit sphere.

use glam::{Vec2, Vec3};

use crate::ONE_MINUS_EPSILON;
use crate::trigonometry::{sin_cos_turns, turns};

/// A direction of the sphere, uniform in solid angle: `z = 1 − 2 u.x`, azimuth `2π u.y`.
#[inline]
pub fn uniform_sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    // 1 − z² without cancellation at the poles.
    let r = 2.0 * (u.x * (1.0 - u.x)).sqrt();
    let (sin, cos) = sin_cos_turns(u.y);
    Vec3::new(r * cos, r * sin, z)
}

/// The density of [`uniform_sphere`], in solid angle: `1/4π`.
#[inline(always)]
pub const fn uniform_sphere_pdf() -> f32 {
    0.25 * std::f32::consts::FRAC_1_PI
}

/// The `u` that [`uniform_sphere`] maps to `w`.
#[inline]
pub fn uniform_sphere_inverse(w: Vec3) -> Vec2 {
    Vec2::new((0.5 * (1.0 - w.z)).clamp(0.0, ONE_MINUS_EPSILON), turns(w.y, w.x))
}
