//! The Trowbridge–Reitz (GGX) distribution of microfacet normals.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};
use luz_sample::warp;

/// The anisotropic Trowbridge–Reitz distribution with height-correlated Smith masking and shadowing.
///
/// Microfacet normals `wm` are unit vectors with `z ≥ 0` (`D` is even in `wm`); `w`, `wo`, `wi` may be on either side.
/// Walter et al. 2007; Heitz 2014, "Understanding the Masking-Shadowing Function".
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrowbridgeReitz {
    alpha: Vec2,
}

impl TrowbridgeReitz {
    /// The distribution with the roughnesses `alpha_x`, `alpha_y ≥ 0` (slope scale) along x and y.
    ///
    /// A surface whose larger `alpha` is below 10⁻³ is a mirror; otherwise both are at least 10⁻⁴.
    #[inline]
    pub fn new(alpha_x: f32, alpha_y: f32) -> Self {
        let alpha = Vec2::new(alpha_x, alpha_y);
        let smooth = alpha.max_element() < Self::SMOOTH_BELOW;
        Self { alpha: if smooth { alpha } else { alpha.max(Vec2::splat(1e-4)) } }
    }

    /// The `alpha` below which a surface counts as a mirror.
    pub const SMOOTH_BELOW: f32 = 1e-3;

    /// The `alpha` of a user's roughness in `[0, 1]`: its square root.
    #[inline(always)]
    pub fn roughness_to_alpha(roughness: f32) -> f32 {
        roughness.max(0.0).sqrt()
    }

    /// The two roughnesses.
    #[inline(always)]
    pub fn alpha(&self) -> Vec2 {
        self.alpha
    }

    /// True where the surface counts as a mirror, so that a BSDF treats it as specular.
    #[inline(always)]
    pub fn effectively_smooth(&self) -> bool {
        self.alpha.max_element() < Self::SMOOTH_BELOW
    }

    /// A rougher surface, where it was very smooth: `alpha < 0.3` becomes `2·alpha` within `[0.1, 0.3]`.
    pub fn regularize(&mut self) {
        let roughen = |a: f32| if a < 0.3 { (2.0 * a).clamp(0.1, 0.3) } else { a };
        self.alpha = Vec2::new(roughen(self.alpha.x), roughen(self.alpha.y));
    }

    /// Differential area of microfacets with normal `wm`, per area of surface and solid angle, sr⁻¹:
    /// `∫ D(wm) cosθ_m dwm = 1`.
    #[inline(always)]
    pub fn d(&self, wm: Vec3) -> f32 {
        let sx = wm.x / self.alpha.x;
        let sy = wm.y / self.alpha.y;
        let e = sx * sx + sy * sy + wm.z * wm.z;
        1.0 / (PI * self.alpha.x * self.alpha.y * e * e)
    }

    /// `|cosθ|·(1 + 2Λ(w))`: the length of `w` stretched by the roughness. It is finite at grazing angles, where Λ is
    /// not, and all of Smith's functions are rational in it.
    #[inline(always)]
    pub fn stretched_length(&self, w: Vec3) -> f32 {
        let (x, y) = (self.alpha.x * w.x, self.alpha.y * w.y);
        (x * x + y * y + w.z * w.z).sqrt()
    }

    /// Smith's Λ: area of masked over visible microfacets.
    #[inline]
    pub fn lambda(&self, w: Vec3) -> f32 {
        0.5 * (self.stretched_length(w) / w.z.abs() - 1.0)
    }

    /// Fraction of microfacets that is visible from `w`: `1/(1 + Λ(w))`.
    #[inline(always)]
    pub fn g1(&self, w: Vec3) -> f32 {
        let z = w.z.abs();
        2.0 * z / (z + self.stretched_length(w))
    }

    /// Fraction of microfacets visible from both `wo` and `wi`, by correlated heights: `1/(1 + Λ(wo) + Λ(wi))`.
    #[inline(always)]
    pub fn g(&self, wo: Vec3, wi: Vec3) -> f32 {
        let (zo, zi) = (wo.z.abs(), wi.z.abs());
        2.0 * zo * zi / (zi * self.stretched_length(wo) + zo * self.stretched_length(wi))
    }

    /// Density, in solid angle, of the normals that [`sample_visible`](Self::sample_visible) draws for `w`:
    /// `D(wm)·G1(w)·|w·wm| / |cosθ|`.
    #[inline(always)]
    pub fn pdf_visible(&self, w: Vec3, wm: Vec3) -> f32 {
        2.0 * self.d(wm) * w.dot(wm).abs() / (w.z.abs() + self.stretched_length(w))
    }

    /// A microfacet normal, with probability proportional to its area visible from `w`; it is on the side of `w`.
    ///
    /// Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps".
    #[inline]
    pub fn sample_visible(&self, w: Vec3, u: Vec2) -> Vec3 {
        let stretched = self.stretched(w);
        // In the space where the surface is a unit hemisphere, the directions that it mirrors fill a cap uniformly.
        self.visible_normal(w, stretched, warp::uniform_cone(u, 1.0 + stretched.z))
    }

    /// Where the direction of `w`, mirrored to the upper side, goes when the surface is stretched to a hemisphere.
    #[inline(always)]
    pub(super) fn stretched(&self, w: Vec3) -> Vec3 {
        Vec3::new(self.alpha.x * w.x, self.alpha.y * w.y, w.z.abs()).normalize_or(Vec3::Z)
    }

    /// The normal, on the side of `w`, that mirrors `stretched` to `mirrored` on the hemisphere.
    #[inline(always)]
    pub(super) fn visible_normal(&self, w: Vec3, stretched: Vec3, mirrored: Vec3) -> Vec3 {
        let h = mirrored + stretched;
        Vec3::new(self.alpha.x * h.x, self.alpha.y * h.y, h.z.max(0.0).copysign(w.z)).normalize_or(Vec3::Z)
    }
}
