//! Interfaces between two transparent media.

use glam::{Vec2, Vec3};
use luz_color::SampledSpectrum;

use super::{
    BsdfSample, Lobe, TransportMode, TrowbridgeReitz,
    conductor::microfacet_reflection,
    direction::{face_up, mirror, reflect, refract, same_hemisphere},
    fresnel,
};

/// A smooth or rough interface between two dielectrics (Walter et al. 2007, eq. 20 and 21).
///
/// `eta` is the index of refraction below (`z < 0`) over the one above. With `eta = 1` nothing is bent, whatever the
/// roughness.
#[derive(Clone, Copy, Debug)]
pub struct Dielectric {
    eta: f32,
    distribution: TrowbridgeReitz,
}

impl Dielectric {
    /// The interface with microfacets `distribution`, above a medium of relative index of refraction `eta > 0`.
    ///
    /// Within 10⁻⁴ of one it counts as one: half vectors would have no digits left.
    #[inline]
    pub fn new(distribution: TrowbridgeReitz, eta: f32) -> Self {
        Self { eta: Self::matched(eta), distribution }
    }

    /// `eta`, or one where it is hardly different from it.
    #[inline(always)]
    pub(super) fn matched(eta: f32) -> f32 {
        if (eta - 1.0).abs() < 1e-4 { 1.0 } else { eta }
    }

    /// Index of refraction below over the one above.
    #[inline(always)]
    pub fn eta(&self) -> f32 {
        self.eta
    }

    /// Its microfacets.
    #[inline(always)]
    pub fn distribution(&self) -> &TrowbridgeReitz {
        &self.distribution
    }

    /// True where it is a delta distribution.
    #[inline(always)]
    pub fn is_specular(&self) -> bool {
        self.eta == 1.0 || self.distribution.effectively_smooth()
    }

    /// Its scattering kinds.
    #[inline]
    pub fn flags(&self) -> Lobe {
        let sides = if self.eta == 1.0 { Lobe::TRANSMISSION } else { Lobe::BOTH_SIDES };
        sides | if self.is_specular() { Lobe::SPECULAR } else { Lobe::GLOSSY }
    }

    /// See [`TrowbridgeReitz::regularize`].
    pub fn regularize(&mut self) {
        self.distribution.regularize();
    }

    /// Value and density for a pair of directions; zero where the interface is smooth.
    #[inline]
    pub fn evaluate(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (f32, f32) {
        self.evaluate_sides(wo, wi, mode, Lobe::BOTH_SIDES)
    }

    /// As [`evaluate`](Self::evaluate), with the density of [`sample_sides`](Self::sample_sides) for the same `sides`.
    #[inline]
    pub fn evaluate_sides(&self, wo: Vec3, wi: Vec3, mode: TransportMode, sides: Lobe) -> (f32, f32) {
        let product = wo.z * wi.z;
        if self.is_specular() || product == 0.0 || !product.is_finite() {
            return (0.0, 0.0);
        }
        let reflected = product > 0.0;
        let eta = match (reflected, wo.z > 0.0) {
            (true, _) => 1.0,
            (false, true) => self.eta,
            (false, false) => 1.0 / self.eta,
        };
        // The generalised half vector, on the upper side.
        let Some(wm) = (wo + wi * eta).try_normalize() else { return (0.0, 0.0) };
        let wm = face_up(wm);
        let (dot_o, dot_i) = (wo.dot(wm), wi.dot(wm));
        if dot_o * wo.z <= 0.0 || dot_i * wi.z <= 0.0 {
            return (0.0, 0.0); // The microfacet is seen from behind.
        }
        let reflectance = fresnel::dielectric(dot_o, self.eta);
        let probability = side_probability(reflectance, sides, reflected);
        let (value, pdf) = if reflected {
            let (value, pdf) = microfacet_reflection(&self.distribution, wo, wi, wm);
            (reflectance * value, pdf)
        } else {
            let (value, pdf) = self.transmission(wo, wi, wm, eta);
            ((1.0 - reflectance) * value * mode.transmission_scale(eta), pdf)
        };
        (value, pdf * probability)
    }

    /// The microfacet BTDF without Fresnel transmittance and radiance scaling, and the density of `wi` when `wm` is a
    /// visible normal; `eta` is relative to the side of `wo`.
    #[inline(always)]
    fn transmission(&self, wo: Vec3, wi: Vec3, wm: Vec3, eta: f32) -> (f32, f32) {
        let (dot_o, dot_i) = (wo.dot(wm), wi.dot(wm));
        let denominator = dot_i + dot_o / eta;
        // |∂wm/∂wi| = |wi·wm| / (wi·wm + wo·wm/η)²
        let jacobian = dot_i.abs() / (denominator * denominator);
        let (cos_o, cos_i) = (wo.z.abs(), wi.z.abs());
        let (so, si) = (self.distribution.stretched_length(wo), self.distribution.stretched_length(wi));
        let visible = 2.0 * self.distribution.d(wm) * dot_o.abs() * jacobian;
        (visible / (cos_i * so + cos_o * si).max(1e-30), visible / (cos_o + so))
    }

    /// The densities with which transmission alone is sampled from `wo` to `wi`, and from `wi` to `wo`, through a
    /// microfacet with normal `wm`; `wo` above.
    pub(super) fn transmission_densities(&self, wo: Vec3, wi: Vec3, wm: Vec3) -> [f32; 2] {
        [self.transmission(wo, wi, wm, self.eta).1, self.transmission(wi, wo, wm, 1.0 / self.eta).1]
    }

    /// Samples reflection or transmission, by their share of the light.
    #[inline]
    pub fn sample(&self, wo: Vec3, uc: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        self.sample_sides(wo, uc, u, mode, Lobe::BOTH_SIDES)
    }

    /// Samples only the `sides` that are asked for (`REFLECTION`, `TRANSMISSION` or both).
    #[inline]
    pub fn sample_sides(&self, wo: Vec3, uc: f32, u: Vec2, mode: TransportMode, sides: Lobe) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let smooth = self.is_specular();
        let wm = if smooth { Vec3::Z } else { self.distribution.sample_visible(wo, u) };
        let reflectance = fresnel::dielectric(wo.dot(face_up(wm)), self.eta);
        let reflection = side_probability(reflectance, sides, true);
        let transmission = side_probability(reflectance, sides, false);
        let kind = if smooth { Lobe::SPECULAR } else { Lobe::GLOSSY };
        if uc < reflection {
            let wi = if smooth { mirror(wo) } else { reflect(wo, wm) };
            if !same_hemisphere(wo, wi) {
                return None;
            }
            let (value, pdf) =
                if smooth { (1.0 / wi.z.abs(), 1.0) } else { microfacet_reflection(&self.distribution, wo, wi, wm) };
            let f = SampledSpectrum::splat(reflectance * value);
            (pdf > 0.0).then(|| BsdfSample::new(f, wi, pdf * reflection, Lobe::REFLECTION | kind))
        } else if transmission > 0.0 {
            let (wi, eta) = refract(wo, face_up(wm), self.eta)?;
            if wo.z * wi.z >= 0.0 {
                return None;
            }
            let (value, pdf) = if smooth { (1.0 / wi.z.abs(), 1.0) } else { self.transmission(wo, wi, wm, eta) };
            let f = SampledSpectrum::splat((1.0 - reflectance) * value * mode.transmission_scale(eta));
            let sample = BsdfSample::new(f, wi, pdf * transmission, Lobe::TRANSMISSION | kind);
            (pdf > 0.0).then_some(BsdfSample { eta, ..sample })
        } else {
            None
        }
    }
}

/// Probability of sampling reflection or transmission where only `sides` may be sampled; both zero where the allowed
/// side carries no light.
#[inline(always)]
fn side_probability(reflectance: f32, sides: Lobe, reflected: bool) -> f32 {
    let r = if sides.is_reflection() { reflectance } else { 0.0 };
    let t = if sides.is_transmission() { 1.0 - reflectance } else { 0.0 };
    let sum = r + t;
    if sum > 0.0 { if reflected { r / sum } else { t / sum } } else { 0.0 }
}
