//! The hemisphere around +z.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::{Vec2, Vec3};

use super::disk::{concentric, concentric_disk_inverse};
use crate::ONE_MINUS_EPSILON;
use crate::trigonometry::{sin_cos_turns, turns};

/// A direction of the hemisphere `z ≥ 0`, uniform in solid angle: `z = u.x`, azimuth `2π u.y`.
#[inline]
pub fn uniform_hemisphere(u: Vec2) -> Vec3 {
    let z = u.x;
    let r = ((1.0 - z) * (1.0 + z)).sqrt();
    let (sin, cos) = sin_cos_turns(u.y);
    Vec3::new(r * cos, r * sin, z)
}

/// The density of [`uniform_hemisphere`], in solid angle: `1/2π` where `z ≥ 0`.
#[inline(always)]
pub const fn uniform_hemisphere_pdf() -> f32 {
    1.0 / TAU
}

/// The `u` that [`uniform_hemisphere`] maps to `w`.
#[inline]
pub fn uniform_hemisphere_inverse(w: Vec3) -> Vec2 {
    Vec2::new(w.z.clamp(0.0, ONE_MINUS_EPSILON), turns(w.y, w.x))
}

/// A direction of the hemisphere `z > 0`, with density proportional to its cosine `z`.
///
/// Malley's method: [`super::concentric_disk`], lifted to the sphere. `z` is never zero, so neither is the density.
#[inline]
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let (r, sin, cos, along_x) = concentric(u);
    // u has 24 bits, so the rim stands for a ring of that width; its middle keeps z positive.
    let z = ((1.0 - r.abs()).max(f32::EPSILON / 2.0) * (1.0 + r.abs())).sqrt();
    if along_x { Vec3::new(r * cos, r * sin, z) } else { Vec3::new(r * sin, r * cos, z) }
}

/// The density of [`cosine_hemisphere`], in solid angle: `cos θ / π`, zero below the horizon.
#[inline(always)]
pub fn cosine_hemisphere_pdf(cos_theta: f32) -> f32 {
    cos_theta.max(0.0) * FRAC_1_PI
}

/// The `u` that [`cosine_hemisphere`] maps to `w`, in the closed unit square.
#[inline]
pub fn cosine_hemisphere_inverse(w: Vec3) -> Vec2 {
    concentric_disk_inverse(Vec2::new(w.x, w.y))
}
