//! The tent.

/// `x ∈ (−radius, radius)` with density proportional to `radius − |x|`; `radius > 0`.
#[inline]
pub fn tent(u: f32, radius: f32) -> f32 {
    // A u is at the middle of its 2⁻²⁴ wide cell, so that no end has density zero.
    let u = u + f32::EPSILON / 4.0;
    let distance = |v: f32| 1.0 - v.sqrt();
    if u < 0.5 { -radius * distance(2.0 * u) } else { radius * distance((2.0 - 2.0 * u).max(f32::EPSILON / 2.0)) }
}

/// The density of [`tent`], in length: zero where `|x| ≥ radius`.
#[inline]
pub fn tent_pdf(x: f32, radius: f32) -> f32 {
    (1.0 - (x / radius).abs()).max(0.0) / radius
}

/// The `u` that [`tent`] maps to `x`, in `[0, 1]`.
#[inline]
pub fn tent_inverse(x: f32, radius: f32) -> f32 {
    let h = 1.0 - (x / radius).abs().min(1.0);
    let u = 0.5 * h * h;
    if x < 0.0 { u } else { 1.0 - u }
}
