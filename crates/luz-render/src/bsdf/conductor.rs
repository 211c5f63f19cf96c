//! Metals.

use glam::{Vec2, Vec3};
use luz_color::SampledSpectrum;

use super::{
    BsdfSample, Lobe, TrowbridgeReitz,
    direction::{mirror, reflect, same_hemisphere},
    fresnel,
};

/// A smooth or rough conductor: single scattering on Trowbridge–Reitz microfacets (Cook and Torrance 1982;
/// Walter et al. 2007, eq. 20), reflecting on both sides.
#[derive(Clone, Copy, Debug)]
pub struct Conductor {
    distribution: TrowbridgeReitz,
    eta: SampledSpectrum,
    k: SampledSpectrum,
}

impl Conductor {
    /// A metal with the complex index of refraction `eta + i·k`, relative to the outside.
    #[inline]
    pub fn new(distribution: TrowbridgeReitz, eta: SampledSpectrum, k: SampledSpectrum) -> Self {
        Self { distribution, eta, k }
    }

    /// Its microfacets.
    #[inline(always)]
    pub fn distribution(&self) -> &TrowbridgeReitz {
        &self.distribution
    }

    /// Fresnel reflectance at the cosine of incidence `cos_i ≥ 0`.
    #[inline(always)]
    pub fn fresnel(&self, cos_i: f32) -> SampledSpectrum {
        fresnel::conductor(cos_i, self.eta, self.k)
    }

    /// Its scattering kinds.
    #[inline]
    pub fn flags(&self) -> Lobe {
        Lobe::REFLECTION | if self.distribution.effectively_smooth() { Lobe::SPECULAR } else { Lobe::GLOSSY }
    }

    /// See [`TrowbridgeReitz::regularize`].
    pub fn regularize(&mut self) {
        self.distribution.regularize();
    }

    /// Value and density for a pair of directions; zero where the surface is smooth.
    #[inline]
    pub fn evaluate(&self, wo: Vec3, wi: Vec3) -> (SampledSpectrum, f32) {
        if !same_hemisphere(wo, wi) || self.distribution.effectively_smooth() {
            return (SampledSpectrum::ZERO, 0.0);
        }
        let Some(wm) = (wo + wi).try_normalize() else { return (SampledSpectrum::ZERO, 0.0) };
        self.evaluate_at(wo, wi, wm)
    }

    /// Value and density where the microfacet normal is known.
    #[inline(always)]
    fn evaluate_at(&self, wo: Vec3, wi: Vec3, wm: Vec3) -> (SampledSpectrum, f32) {
        let (value, pdf) = microfacet_reflection(&self.distribution, wo, wi, wm);
        (self.fresnel(wo.dot(wm).abs()) * value, pdf)
    }

    /// Mirrors `wo` at the normal or, if rough, at a visible microfacet; `None` where that leads below the surface.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: Vec2) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        if self.distribution.effectively_smooth() {
            let cos = wo.z.abs();
            return Some(BsdfSample::new(self.fresnel(cos) / cos, mirror(wo), 1.0, Lobe::REFLECTION | Lobe::SPECULAR));
        }
        let wm = self.distribution.sample_visible(wo, u);
        let wi = reflect(wo, wm);
        if !same_hemisphere(wo, wi) {
            return None;
        }
        let (f, pdf) = self.evaluate_at(wo, wi, wm);
        (pdf > 0.0).then(|| BsdfSample::new(f, wi, pdf, Lobe::REFLECTION | Lobe::GLOSSY))
    }
}

/// `D·G/(4·cosθ_o·cosθ_i)` without Fresnel reflectance, and the density of `wi` when `wm` is a visible normal,
/// `D·G1(wo)/(4·cosθ_o)`; `wo` and `wi` on one side.
#[inline(always)]
pub(super) fn microfacet_reflection(distribution: &TrowbridgeReitz, wo: Vec3, wi: Vec3, wm: Vec3) -> (f32, f32) {
    let (cos_o, cos_i) = (wo.z.abs(), wi.z.abs());
    let (so, si) = (distribution.stretched_length(wo), distribution.stretched_length(wi));
    let half_d = 0.5 * distribution.d(wm);
    // Cosines may be subnormal.
    (half_d / (cos_i * so + cos_o * si).max(1e-30), half_d / (cos_o + so))
}
