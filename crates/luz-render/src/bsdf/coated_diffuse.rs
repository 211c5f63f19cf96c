//! A Lambertian base under a dielectric coat.

use std::f32::consts::{FRAC_1_PI, PI};

use glam::{Vec2, Vec3};
use luz_color::SampledSpectrum;
use luz_sample::warp;

use super::{
    BsdfSample, CoatInterface, CoatWeights, Lobe, TrowbridgeReitz,
    conductor::microfacet_reflection,
    direction::{mirror, reflect, same_hemisphere},
    fresnel,
};

/// A Lambertian base of reflectance `R` under a smooth or rough dielectric coat, with all interreflection between the
/// two, on both sides.
///
/// It is the expectation, in closed form, of the random walk that [`Layered`](super::Layered) simulates for a coat
/// without a scattering medium: with the interface's reflection lobe `f_r`, the fraction `T` of the light that arrives
/// at the base, and the fraction `r` of the base's light that the inside of the interface sends back to it,
///
/// `f(wo, wi) = f_r(wo, wi) + T(wo)·T(wi)·R/(π·η²) · Σ_{k<K} (R·r)^k`,
///
/// where `K` is the number of times that a path may meet the base. `1/η²` is what compression of radiance leaves of
/// going in and out of the coat; the sum is the same for both transport modes and, with [`CoatWeights::Exact`],
/// reciprocal.
#[derive(Clone, Copy, Debug)]
pub struct CoatedDiffuse<'a> {
    interface: &'a CoatInterface,
    distribution: TrowbridgeReitz,
    reflectance: SampledSpectrum,
    /// What stands after `T(wo)·T(wi)`.
    base: SampledSpectrum,
    /// Albedo of the base's lobe over `T(wo)`, in the lane where it is largest; it decides between the lobes.
    base_share: f32,
}

impl<'a> CoatedDiffuse<'a> {
    /// A base that reflects the fraction `reflectance`, in `[0, 1]`, under `interface`.
    #[inline]
    pub fn new(reflectance: SampledSpectrum, interface: &'a CoatInterface) -> Self {
        Self::with_distribution(reflectance, interface, interface.distribution())
    }

    /// The same with textured roughness: `interface` must be one of [`CoatInterface::textured`], otherwise its own
    /// roughness is used instead of `alpha_x`, `alpha_y`.
    #[inline]
    pub fn textured(reflectance: SampledSpectrum, interface: &'a CoatInterface, alpha_x: f32, alpha_y: f32) -> Self {
        let distribution =
            if interface.is_textured() { TrowbridgeReitz::new(alpha_x, alpha_y) } else { interface.distribution() };
        Self::with_distribution(reflectance, interface, distribution)
    }

    #[inline]
    fn with_distribution(
        reflectance: SampledSpectrum,
        interface: &'a CoatInterface,
        distribution: TrowbridgeReitz,
    ) -> Self {
        let averages = interface.averages(&distribution);
        let bounces = interface.base_bounces();
        let scale = FRAC_1_PI / (interface.eta() * interface.eta());
        let base = reflectance.map(|r| scale * r * geometric_sum(r * averages.internal_reflectance, bounces));
        let base_share = PI * base.max_component() * averages.transmittance;
        Self { interface, distribution, reflectance, base, base_share }
    }

    /// True where the coat reflects like a mirror.
    #[inline(always)]
    fn has_smooth_coat(&self) -> bool {
        self.interface.eta() == 1.0 || self.distribution.effectively_smooth()
    }

    /// Its scattering kinds.
    pub fn flags(&self) -> Lobe {
        let coat = if self.has_smooth_coat() { Lobe::SPECULAR } else { Lobe::GLOSSY };
        let base = if self.base_share > 0.0 { Lobe::DIFFUSE } else { Lobe::NONE };
        Lobe::REFLECTION | coat | base
    }

    /// See [`TrowbridgeReitz::regularize`]. The first call for a material computes new tables.
    pub fn regularize(&mut self) {
        let mut distribution = self.distribution;
        distribution.regularize();
        *self = Self::with_distribution(self.reflectance, self.interface.regularized(), distribution);
    }

    /// Fraction of the light from `wo` that is reflected.
    pub fn albedo(&self, wo: Vec3) -> SampledSpectrum {
        let coat = self.interface.directional(wo, &self.distribution);
        let base = PI * coat.transmittance * self.interface.averages(&self.distribution).transmittance;
        self.base * base + coat.reflectance
    }

    /// Value and density for a pair of directions; of the base only, where the coat is smooth.
    #[inline]
    pub fn evaluate(&self, wo: Vec3, wi: Vec3) -> (SampledSpectrum, f32) {
        if !same_hemisphere(wo, wi) {
            return (SampledSpectrum::ZERO, 0.0);
        }
        let out = self.interface.directional(wo, &self.distribution);
        let into = self.interface.directional(wi, &self.distribution);
        let into = match self.interface.weights() {
            CoatWeights::Exact => into.transmittance,
            CoatWeights::PbrtV4 => into.emergence,
        };
        let probability = self.coat_probability(out.reflectance, out.transmittance);
        self.evaluate_from(wo, wi, out.transmittance * into, probability)
    }

    /// Probability of sampling the coat's lobe: its share of the albedo.
    #[inline(always)]
    fn coat_probability(&self, reflectance: f32, transmittance: f32) -> f32 {
        let base = self.base_share * transmittance;
        if base > 0.0 { reflectance / (reflectance + base) } else { 1.0 }
    }

    #[inline(always)]
    fn evaluate_from(&self, wo: Vec3, wi: Vec3, transmittance: f32, coat_probability: f32) -> (SampledSpectrum, f32) {
        let mut f = self.base * transmittance;
        let mut pdf = (1.0 - coat_probability) * FRAC_1_PI * wi.z.abs();
        if !self.has_smooth_coat()
            && let Some(wm) = (wo + wi).try_normalize()
        {
            let (value, density) = microfacet_reflection(&self.distribution, wo, wi, wm);
            f += value * fresnel::dielectric(wo.dot(wm).abs(), self.interface.eta());
            pdf += coat_probability * density;
        }
        (f, pdf)
    }

    /// Samples the coat's lobe or the base's, by their share of the albedo; the density is that of the mixture. The value
    /// has exact weights, whatever [`CoatWeights`] evaluations use.
    #[inline]
    pub fn sample(&self, wo: Vec3, uc: f32, u: Vec2) -> Option<BsdfSample> {
        let cos = wo.z.abs();
        if cos == 0.0 {
            return None;
        }
        let out = self.interface.directional(wo, &self.distribution);
        let probability = self.coat_probability(out.reflectance, out.transmittance);
        let (wi, flags) = if uc < probability {
            if self.has_smooth_coat() {
                let f = SampledSpectrum::splat(out.reflectance / cos);
                let flags = Lobe::REFLECTION | Lobe::SPECULAR;
                return (out.reflectance > 0.0).then(|| BsdfSample::new(f, mirror(wo), probability, flags));
            }
            let wi = reflect(wo, self.distribution.sample_visible(wo, u));
            (wi, Lobe::REFLECTION | Lobe::GLOSSY)
        } else {
            let wi = warp::cosine_hemisphere(u);
            (wi * 1f32.copysign(wo.z), Lobe::REFLECTION | Lobe::DIFFUSE)
        };
        if !same_hemisphere(wo, wi) {
            return None;
        }
        let into = self.interface.directional(wi, &self.distribution).transmittance;
        let (f, pdf) = self.evaluate_from(wo, wi, out.transmittance * into, probability);
        (pdf > 0.0).then(|| BsdfSample::new(f, wi, pdf, flags))
    }
}

/// `Σ_{k<count} q^k` for `q ≥ 0`.
#[inline]
fn geometric_sum(q: f32, count: u32) -> f32 {
    if count <= 8 {
        (0..count).fold(0.0, |sum, _| sum * q + 1.0)
    } else if q < 0.999 {
        (1.0 - q.powi(count as i32)) / (1.0 - q)
    } else {
        // Only an ideal mirror's coat is here; the closed form would cancel.
        (0..count.min(10_000)).fold(0.0, |sum, _| sum * q + 1.0)
    }
}
