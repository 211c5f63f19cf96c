//! The cone around +z.
//!
//! A cone is given by `1 − cos θmax`, not by the cosine: a sun of half a degree has a cosine that `f32` holds to three
//! digits only, a smaller light one that rounds to one.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use crate::ONE_MINUS_EPSILON;
use crate::trigonometry::{sin_cos_turns, turns};

/// `1 − cos θ` of the angle `θ ∈ [0, π/2]` whose squared sine is `sin²θ`, without cancellation at small angles.
///
/// The sphere of radius `r` at distance `d > r` fills a cone of `sin²θmax = r²/d²`.
#[inline]
pub fn one_minus_cos_of_sin_squared(sin_squared: f32) -> f32 {
    sin_squared / (1.0 + (1.0 - sin_squared).max(0.0).sqrt())
}

/// A direction within `θmax` of +z, uniform in solid angle; `one_minus_cos_theta_max ∈ [0, 2]`.
///
/// `1 − z = u.x (1 − cos θmax)`, azimuth `2π u.y`.
#[inline]
pub fn uniform_cone(u: Vec2, one_minus_cos_theta_max: f32) -> Vec3 {
    let h = u.x * one_minus_cos_theta_max;
    let r = (h * (2.0 - h)).max(0.0).sqrt();
    let (sin, cos) = sin_cos_turns(u.y);
    Vec3::new(r * cos, r * sin, 1.0 - h)
}

/// The density of [`uniform_cone`] inside the cone, in solid angle: `1 / 2π(1 − cos θmax)`; infinite for an empty cone.
#[inline(always)]
pub fn uniform_cone_pdf(one_minus_cos_theta_max: f32) -> f32 {
    1.0 / (TAU * one_minus_cos_theta_max)
}

/// The `u` that [`uniform_cone`] maps to `w`; `None` where `w` is outside the cone or the cone is empty.
#[inline]
pub fn uniform_cone_inverse(w: Vec3, one_minus_cos_theta_max: f32) -> Option<Vec2> {
    let sin_squared = w.x * w.x + w.y * w.y;
    let h = if w.z > 0.5 { one_minus_cos_of_sin_squared(sin_squared) } else { 1.0 - w.z };
    let x = h / one_minus_cos_theta_max;
    (x <= 1.0).then(|| Vec2::new(x.min(ONE_MINUS_EPSILON), turns(w.y, w.x)))
}
