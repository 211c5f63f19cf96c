//! The unit disk.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_4};

use glam::Vec2;

use crate::trigonometry::sin_cos_eighth;

/// The signed radius of the point that `u` maps to, the sine and cosine of its angle from the nearer axis, and whether
/// that axis is x.
#[inline(always)]
pub(super) fn concentric(u: Vec2) -> (f32, f32, f32, bool) {
    let p = 2.0 * u - Vec2::ONE;
    let along_x = p.x.abs() > p.y.abs();
    let (major, minor) = if along_x { (p.x, p.y) } else { (p.y, p.x) };
    let slope = if major == 0.0 { 0.0 } else { minor / major };
    let (sin, cos) = sin_cos_eighth(FRAC_PI_4 * slope);
    (major, sin, cos, along_x)
}

/// A point of the unit disk, uniform in area: squares around the centre become circles.
///
/// Shirley and Chiu 1997, "A Low Distortion Map between Disk and Square". Density [`concentric_disk_pdf`].
#[inline]
pub fn concentric_disk(u: Vec2) -> Vec2 {
    let (r, sin, cos, along_x) = concentric(u);
    if along_x { Vec2::new(r * cos, r * sin) } else { Vec2::new(r * sin, r * cos) }
}

/// The density of [`concentric_disk`], in area: `1/π`.
#[inline(always)]
pub const fn concentric_disk_pdf() -> f32 {
    FRAC_1_PI
}

/// The `u` that [`concentric_disk`] maps to `p`, in the closed unit square.
#[inline]
pub fn concentric_disk_inverse(p: Vec2) -> Vec2 {
    let r = p.length();
    if r == 0.0 {
        return Vec2::splat(0.5);
    }
    let along_x = p.x.abs() > p.y.abs();
    let (major, minor) = if along_x { (p.x, p.y) } else { (p.y, p.x) };
    let r = r.copysign(major);
    let other = r * (minor / major).atan() / FRAC_PI_4;
    let q = if along_x { Vec2::new(r, other) } else { Vec2::new(other, r) };
    (0.5 * (q + Vec2::ONE)).clamp(Vec2::ZERO, Vec2::ONE)
}
