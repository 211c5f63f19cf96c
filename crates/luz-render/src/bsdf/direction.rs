//! Directions in local shading space, whose z axis is the shading normal.

use glam::Vec3;

/// True where `a` and `b` lie strictly on the same side of the surface.
#[inline(always)]
pub fn same_hemisphere(a: Vec3, b: Vec3) -> bool {
    a.z * b.z > 0.0
}

/// `w` mirrored at the unit vector `n`; both `w` and the result point away from the surface.
#[inline(always)]
pub fn reflect(w: Vec3, n: Vec3) -> Vec3 {
    2.0 * w.dot(n) * n - w
}

/// `w` mirrored at the shading normal.
#[inline(always)]
pub fn mirror(w: Vec3) -> Vec3 {
    Vec3::new(-w.x, -w.y, w.z)
}

/// `n` or `−n`, whichever has a positive z.
#[inline(always)]
pub fn face_up(n: Vec3) -> Vec3 {
    if n.z < 0.0 { -n } else { n }
}

/// Direction into which `w` is refracted at the unit normal `n`, by Snell's law, and the relative index of refraction of
/// the transmitted over the incident side; `None` under total internal reflection.
///
/// `eta` is the index of refraction on the side where `n` points from, over the one where it points to. Both directions
/// point away from the surface, and either may be on any side of `n`.
#[inline]
pub fn refract(w: Vec3, n: Vec3, eta: f32) -> Option<(Vec3, f32)> {
    let cos = w.dot(n);
    let (n, cos_i, eta) = if cos < 0.0 { (-n, -cos, 1.0 / eta) } else { (n, cos, eta) };
    let inv_eta = 1.0 / eta;
    let sin2_t = (1.0 - cos_i * cos_i).max(0.0) * inv_eta * inv_eta;
    if sin2_t >= 1.0 {
        return None;
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    Some((-w * inv_eta + (cos_i * inv_eta - cos_t) * n, eta))
}
