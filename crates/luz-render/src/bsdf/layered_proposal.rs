//! Directions for a layered BSDF with an exact density, for techniques whose every density must be known.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};
use luz_color::SampledSpectrum;
use luz_sample::warp;

use super::{
    Base, BsdfSample, Conductor, Layered, Lobe, TransportMode, TrowbridgeReitz,
    conductor::microfacet_reflection,
    direction::{mirror, reflect, refract, same_hemisphere},
    fresnel,
};

/// One part of the mixture that directions are drawn from.
#[derive(Clone, Copy)]
enum Part {
    /// What leaves as from a mirror.
    Specular,
    /// Mirrored at visible microfacets.
    Facets(TrowbridgeReitz),
    /// By the cosine.
    Cosine,
}

/// Parts with their probabilities, which sum to one.
struct Mixture([(f32, Part); 3]);

impl Mixture {
    /// The part that `uc` chooses.
    fn choose(&self, mut uc: f32) -> Part {
        let [first, second, last] = self.0;
        for (share, part) in [first, second] {
            if uc < share {
                return part;
            }
            uc -= share;
        }
        last.1
    }

    /// The probability of the specular parts.
    fn specular(&self) -> f32 {
        self.0.iter().filter(|(_, part)| matches!(part, Part::Specular)).map(|(share, _)| share).sum()
    }
}

impl Layered {
    /// The interface's lobe, the base's lobe as it looks through the interface, and a cosine lobe; `wo` above.
    fn mixture(&self, wo: Vec3) -> Mixture {
        if !self.flags().has_non_specular() {
            return Mixture([(1.0, Part::Specular), (0.0, Part::Specular), (0.0, Part::Specular)]);
        }
        let smooth_top = self.top.is_specular();
        let top = if smooth_top { Part::Specular } else { Part::Facets(*self.top.distribution()) };
        // What is suspended in the coat sends light back, too, however dark the base.
        let suspended = self.medium.albedo.max_component();
        let (base, albedo) = match &self.base {
            Base::Diffuse(base) => (Part::Cosine, base.reflectance().max_component().max(suspended)),
            Base::Conductor(base) if smooth_top && base.flags().is_specular() => (Part::Specular, 1.0),
            Base::Conductor(base) => (Part::Facets(self.base_lobe(base)), 1.0),
        };
        let reflectance = fresnel::dielectric(wo.z, self.top.eta());
        let share = (1.0 - reflectance) * albedo;
        let from_top = if share > 0.0 { reflectance / (reflectance + share) } else { 1.0 };
        let spread = if self.scatters() { 1.0 - 0.9 * (-2.0 * self.medium.thickness).exp() } else { 0.1 };
        let below = 1.0 - from_top;
        Mixture([(from_top, top), (below * (1.0 - spread), base), (below * spread, Part::Cosine)])
    }

    /// The base's microfacets as they look through the interface. For small slopes a facet of the base tilted by `m`
    /// turns the reflected ray by `2m` inside and `2ηm` outside, as a facet tilted by `ηm` would without a coat; one of
    /// the interface turns each crossing by `(η − 1)m`. Variances add.
    fn base_lobe(&self, base: &Conductor) -> TrowbridgeReitz {
        let (eta, bend) = (self.top.eta(), self.top.eta() - 1.0);
        let variance = |a: Vec2| a * a;
        let top = if self.top.is_specular() { Vec2::ZERO } else { variance(self.top.distribution().alpha()) };
        let alpha2 = eta * eta * variance(base.distribution().alpha()) + 0.5 * bend * bend * top;
        // One of the two is rough: so is what is seen.
        let rough = Vec2::splat(TrowbridgeReitz::SMOOTH_BELOW);
        let alpha = Vec2::new(alpha2.x.sqrt(), alpha2.y.sqrt()).clamp(rough, Vec2::ONE);
        TrowbridgeReitz::new(alpha.x, alpha.y)
    }

    /// The density of [`propose`](Self::propose), in solid angle; specular parts count nothing. It is a stand-in for the
    /// unknown density of [`sample`](Self::sample), noise-free and normalised, up to what a rough lobe loses below the
    /// horizon and what is specular.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let (wo, wi) = if wo.z < 0.0 { (-wo, -wi) } else { (wo, wi) };
        if !same_hemisphere(wo, wi) {
            return 0.0;
        }
        let Some(wm) = (wo + wi).try_normalize() else { return 0.0 };
        let density = |part: Part| match part {
            Part::Specular => 0.0,
            Part::Facets(distribution) => microfacet_reflection(&distribution, wo, wi, wm).1,
            Part::Cosine => FRAC_1_PI * wi.z,
        };
        self.mixture(wo).0.into_iter().filter(|(share, _)| *share > 0.0).map(|(s, part)| s * density(part)).sum()
    }

    /// A direction with its exact density, the value being that of [`evaluate`](Self::evaluate).
    pub fn propose(&self, wo: Vec3, uc: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        let side = 1f32.copysign(wo.z);
        let up = wo * side;
        if up.z == 0.0 {
            return None;
        }
        let wi = match self.mixture(up).choose(uc) {
            Part::Specular => return self.specular(wo),
            Part::Facets(distribution) => reflect(up, distribution.sample_visible(up, u)),
            Part::Cosine => warp::cosine_hemisphere(u),
        };
        let wi = wi * side;
        let (f, pdf) = self.evaluate(wo, wi, mode);
        let kind = if self.flags().is_diffuse() { Lobe::DIFFUSE } else { Lobe::GLOSSY };
        (pdf > 0.0).then(|| BsdfSample::new(f, wi, pdf, Lobe::REFLECTION | kind))
    }

    /// What leaves as from a mirror, with the probability that [`propose`](Self::propose) draws it; `None` where nothing
    /// does. Its value is the expectation, in closed form, of what walks find that meet nothing but mirrors:
    ///
    /// `R + Σ_{k<K} T² A (R A)^k` with the Fresnel reflectance `R = 1 − T` of the coat, and the fraction `A` of the light
    /// that goes from the coat to the base and comes back to it; `2K` is the number of events that a walk may have.
    pub fn specular(&self, wo: Vec3) -> Option<BsdfSample> {
        let side = 1f32.copysign(wo.z);
        let up = wo * side;
        if up.z == 0.0 || !self.top.is_specular() {
            return None;
        }
        let probability = self.mixture(up).specular();
        let reflectance = fresnel::dielectric(up.z, self.top.eta());
        let mut value = SampledSpectrum::splat(reflectance);
        if let Base::Conductor(base) = &self.base
            && base.flags().is_specular()
            && let Some((inside, _)) = refract(up, Vec3::Z, self.top.eta())
        {
            let crossing = Self::transmittance(self.medium.thickness, inside);
            let back = base.fresnel(inside.z.abs()) * (crossing * crossing);
            let mut term = back * (1.0 - reflectance).powi(2);
            for _ in 0..self.max_depth / 2 {
                value += term;
                term *= back * reflectance;
                if term.max_component() < 1e-9 {
                    break;
                }
            }
        }
        let flags = Lobe::REFLECTION | Lobe::SPECULAR;
        let is_any = probability > 0.0 && !value.is_black();
        is_any.then(|| BsdfSample::new(value / up.z, mirror(wo), probability, flags))
    }
}
