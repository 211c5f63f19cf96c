//! A dielectric coat, with or without a scattering medium, over any opaque base, by random walks.

use glam::{Vec2, Vec3};
use luz_color::SampledSpectrum;
use luz_sample::{
    Samples,
    mis::Heuristic,
    random::{Random, hash},
    warp,
};

use super::{
    BsdfSample, CoatWeights, Conductor, Dielectric, Diffuse, Lobe, TransportMode, direction::same_hemisphere, fresnel,
    henyey_greenstein::HenyeyGreenstein,
};

/// What lies under the coat.
#[derive(Clone, Copy, Debug)]
pub enum Base {
    /// A Lambertian surface.
    Diffuse(Diffuse),
    /// A metal.
    Conductor(Conductor),
}

impl Base {
    fn flags(&self) -> Lobe {
        match self {
            Self::Diffuse(base) => base.flags(),
            Self::Conductor(base) => base.flags(),
        }
    }

    #[inline]
    fn evaluate(&self, wo: Vec3, wi: Vec3) -> (SampledSpectrum, f32) {
        match self {
            Self::Diffuse(base) => base.evaluate(wo, wi),
            Self::Conductor(base) => base.evaluate(wo, wi),
        }
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: Vec2) -> Option<BsdfSample> {
        match self {
            Self::Diffuse(base) => base.sample(wo, u),
            Self::Conductor(base) => base.sample(wo, u),
        }
    }
}

/// The medium between the coat's interface and the base.
#[derive(Clone, Copy, Debug)]
pub struct CoatMedium {
    /// Optical thickness: `exp(−thickness/|cosθ|)` of the light crosses without an event.
    pub thickness: f32,
    /// Fraction of the light that an event scatters, in `[0, 1]`. Where it is zero, the coat only absorbs.
    pub albedo: SampledSpectrum,
    /// Mean cosine of the Henyey–Greenstein phase function, in `(−1, 1)`.
    pub g: f32,
}

/// A dielectric coat over an opaque base, on both sides, evaluated by position-free random walks (Guo, Hašan and Zhao
/// 2018, "Position-Free Monte Carlo Simulation for Arbitrary Layered BSDFs"), under the conventions of pbrt-v4.
///
/// The value is an unbiased estimate that is a fixed function of the seed and the two directions. The density of
/// [`sample`](Self::sample) is unknown, its `f/pdf` an unbiased estimate of the throughput; for combining with other
/// techniques, the density of [`evaluate`](Self::evaluate) is a fixed, noise-free function that resembles it, and is exact
/// for [`propose`](Self::propose). Because
/// both techniques are weighted by that one function, the weights sum to one, and because it does not depend on the
/// walks, the combination stays unbiased.
#[derive(Clone, Copy, Debug)]
pub struct Layered {
    pub(super) top: Dielectric,
    pub(super) base: Base,
    pub(super) medium: CoatMedium,
    pub(super) max_depth: u32,
    walks: u32,
    seed: u64,
    weights: CoatWeights,
}

impl Layered {
    /// `base` under the interface `top`, whose `eta` is that of the coat over that outside, with `medium` between them.
    ///
    /// A walk ends after `max_depth` events; a value is the mean of `walks ≥ 1` of them. Different seeds give
    /// independent values.
    pub fn new(top: Dielectric, base: Base, medium: CoatMedium, max_depth: u32, walks: u32, seed: u64) -> Self {
        let medium = CoatMedium { thickness: medium.thickness.max(f32::MIN_POSITIVE), ..medium };
        Self { top, base, medium, max_depth, walks: walks.max(1), seed, weights: CoatWeights::Exact }
    }

    /// The same BSDF with other `weights`.
    #[must_use]
    pub fn with_weights(self, weights: CoatWeights) -> Self {
        Self { weights, ..self }
    }

    #[inline(always)]
    pub(super) fn scatters(&self) -> bool {
        !self.medium.albedo.is_black()
    }

    /// Its scattering kinds.
    pub fn flags(&self) -> Lobe {
        let (top, base) = (self.top.flags(), self.base.flags());
        let mut flags = Lobe::REFLECTION;
        if top.is_specular() {
            flags |= Lobe::SPECULAR;
        }
        if base.is_diffuse() || self.scatters() {
            flags |= Lobe::DIFFUSE;
        } else if top.is_glossy() || base.is_glossy() {
            flags |= Lobe::GLOSSY;
        }
        flags
    }

    /// See [`TrowbridgeReitz::regularize`](super::TrowbridgeReitz::regularize).
    pub fn regularize(&mut self) {
        self.top.regularize();
        if let Base::Conductor(base) = &mut self.base {
            base.regularize();
        }
    }

    /// Fraction of the light along `w` that goes the height `dz` without an event.
    #[inline(always)]
    pub(super) fn transmittance(dz: f32, w: Vec3) -> f32 {
        (-(dz / w.z).abs()).exp()
    }

    /// Estimated value, and stand-in density.
    pub fn evaluate(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (SampledSpectrum, f32) {
        let (wo, wi) = if wo.z < 0.0 { (-wo, -wi) } else { (wo, wi) };
        if !same_hemisphere(wo, wi) {
            return (SampledSpectrum::ZERO, 0.0);
        }
        let mut random = random_of(self.seed, wo, wi);
        let mut sum = SampledSpectrum::ZERO;
        for _ in 0..self.walks {
            sum += self.walk(wo, wi, mode, &mut random).unwrap_or_default();
        }
        (sum / self.walks as f32 + self.top.evaluate(wo, wi, mode).0, self.pdf(wo, wi))
    }

    /// One estimate of everything but the reflection of `top`'s outside: a walk from `wo` that is connected, at every
    /// event, to the light from `wi`. `None` if it does not get in.
    fn walk(&self, wo: Vec3, wi: Vec3, mode: TransportMode, random: &mut Random) -> Option<SampledSpectrum> {
        let (uc, u) = (random.next_1d(), random.next_2d());
        let enter = self.top.sample_sides(wo, uc, u, mode, Lobe::TRANSMISSION);
        // Where light from `wi` goes inside: the connection to which walks are weighed against their own exit.
        let (uc, u) = (random.next_1d(), random.next_2d());
        let light = self.top.sample_sides(wi, uc, u, mode.adjoint(), Lobe::TRANSMISSION);
        let enter = enter.filter(|s| s.wi.z < 0.0)?;
        let light = light.filter(|s| s.wi.z < 0.0);
        if light.is_none() && self.weights == CoatWeights::PbrtV4 {
            return None; // Although the walk could leave on its own.
        }

        let exit_specular = self.top.is_specular();
        let base_specular = !self.base.flags().has_non_specular();
        let phase = HenyeyGreenstein::new(self.medium.g);
        let (thickness, albedo) = (self.medium.thickness, self.medium.albedo);
        let scatters = self.scatters();
        // Light that arrives through `top` along the sampled `light`, and its weight against a technique of density `pdf`.
        let connect =
            |pdf: f32| light.map(|s| (-s.wi, s.f * (if exit_specular { 1.0 } else { mis_weight(s.pdf, pdf) } / s.pdf)));
        // What leaves along `wi` of a walk that was sampled into `w` with density `pdf`.
        let leave = |w: Vec3, pdf: Option<f32>| {
            let value = self.top.evaluate(-w, wi, mode).0;
            if value == 0.0 {
                return 0.0;
            }
            pdf.map_or(value, |pdf| {
                let (_, other) = match self.weights {
                    CoatWeights::Exact => self.top.evaluate_sides(wi, -w, mode.adjoint(), Lobe::TRANSMISSION),
                    CoatWeights::PbrtV4 => self.top.evaluate_sides(-w, wi, mode, Lobe::TRANSMISSION),
                };
                value * mis_weight(pdf, other)
            })
        };

        // Where both faces are mirrors, no walk that goes on will find light that comes by way of them.
        let mirror_below = match &self.base {
            Base::Conductor(base) if exit_specular && base_specular && self.weights == CoatWeights::Exact => Some(base),
            _ => None,
        };

        let mut sum = SampledSpectrum::ZERO;
        let mut beta = enter.f * (enter.wi.z.abs() / enter.pdf);
        let mut w = enter.wi;
        let mut z = thickness;
        for depth in 0..self.max_depth {
            if !survives(&mut beta, depth, random) {
                break;
            }
            if scatters {
                let reached = z + warp::exponential(random.next_1d(), 1.0 / w.z.abs()) * 1f32.copysign(w.z);
                if 0.0 < reached && reached < thickness {
                    z = reached;
                    beta *= albedo;
                    if let Some((to_light, incident)) = connect(light.map_or(0.0, |s| phase.pdf(-w, -s.wi))) {
                        let from = |to_light: Vec3, height: f32| {
                            phase.pdf(-w, to_light) * Self::transmittance(height, to_light)
                        };
                        sum += beta * incident * from(to_light, thickness - z);
                        if let Some(base) = mirror_below {
                            let more = self.max_depth - depth - 1;
                            let [down, up] = self.between_mirrors(base, to_light, more);
                            let reflected = Vec3::new(to_light.x, to_light.y, -to_light.z);
                            sum += beta * incident * (down * from(to_light, thickness - z) + up * from(reflected, z));
                        }
                    }
                    let (wi_medium, pdf) = phase.sample(-w, random.next_2d());
                    w = wi_medium;
                    if w.z > 0.0 && !exit_specular {
                        sum += beta * (leave(w, Some(pdf)) * Self::transmittance(thickness - z, w));
                    } else if w.z == 0.0 {
                        break;
                    }
                    continue;
                }
                z = if w.z > 0.0 { thickness } else { 0.0 };
            } else {
                z = if w.z > 0.0 { thickness } else { 0.0 };
                beta *= Self::transmittance(thickness, w);
            }

            let (uc, u) = (random.next_1d(), random.next_2d());
            if w.z > 0.0 {
                let Some(back) = self.top.sample_sides(-w, uc, u, mode, Lobe::REFLECTION) else { break };
                beta *= back.f * (back.wi.z.abs() / back.pdf);
                w = back.wi;
            } else {
                if !base_specular && let Some(light) = light {
                    let (f, pdf) = self.base.evaluate(-w, -light.wi);
                    if let Some((to_light, incident)) = connect(pdf) {
                        sum += beta * f * incident * (to_light.z * Self::transmittance(thickness, to_light));
                    }
                }
                let Some(up) = self.base.sample(-w, u).filter(|s| s.wi.z > 0.0) else { break };
                beta *= up.f * (up.wi.z / up.pdf);
                w = up.wi;
                if !exit_specular {
                    let pdf = (!base_specular).then_some(up.pdf);
                    sum += beta * (leave(w, pdf) * Self::transmittance(thickness, w));
                }
            }
        }
        Some(sum)
    }

    /// What of the light that has come in through a smooth interface, and is seen in the direction `to_light` at first,
    /// goes down and goes up in the coat after `events` reflections at most between the interface and a smooth `base`, at
    /// least one of them: as fractions of the light at the interface and at the base.
    fn between_mirrors(&self, base: &Conductor, to_light: Vec3, events: u32) -> [SampledSpectrum; 2] {
        let crossing = Self::transmittance(self.medium.thickness, to_light);
        let above = fresnel::dielectric(-to_light.z, self.top.eta()) * crossing;
        let below = base.fresnel(to_light.z) * crossing;
        let (mut down, mut up) = (SampledSpectrum::ZERO, SampledSpectrum::ZERO);
        let mut light = SampledSpectrum::ONE;
        for event in 0..events {
            if event % 2 == 0 {
                light *= below;
                up += light;
            } else {
                light *= above;
                down += light;
            }
        }
        [down, up]
    }

    /// A direction by a walk that leaves where it will. Its `f/pdf` is an unbiased estimate of the throughput; the two
    /// are not right alone.
    pub fn sample(&self, wo: Vec3, uc: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        let sign = if wo.z < 0.0 { -1.0 } else { 1.0 };
        let wo = wo * sign;
        let leaves = |beta: SampledSpectrum, wi: Vec3, specular: bool| {
            let flags = Lobe::REFLECTION | if specular { Lobe::SPECULAR } else { Lobe::GLOSSY };
            Some(BsdfSample { pdf_is_proportional: true, ..BsdfSample::new(beta / wi.z.abs(), wi * sign, 1.0, flags) })
        };
        let enter = self.top.sample(wo, uc, u, mode)?;
        let mut specular = enter.flags.is_specular();
        let mut beta = enter.f * (enter.wi.z.abs() / enter.pdf);
        if enter.flags.is_reflection() {
            return leaves(beta, enter.wi, specular);
        }
        let mut random = random_of(self.seed, wo, Vec3::new(uc, u.x, u.y));
        let phase = HenyeyGreenstein::new(self.medium.g);
        let thickness = self.medium.thickness;
        let mut w = enter.wi;
        let mut z = thickness;
        for depth in 0..self.max_depth {
            if w.z == 0.0 || !survives(&mut beta, depth, &mut random) {
                return None;
            }
            if self.scatters() {
                let reached = z + warp::exponential(random.next_1d(), 1.0 / w.z.abs()) * 1f32.copysign(w.z);
                if 0.0 < reached && reached < thickness {
                    z = reached;
                    beta *= self.medium.albedo;
                    w = phase.sample(-w, random.next_2d()).0;
                    specular = false;
                    continue;
                }
            } else {
                beta *= Self::transmittance(thickness, w);
            }
            let (uc, u) = (random.next_1d(), random.next_2d());
            let next = if w.z > 0.0 {
                z = thickness;
                self.top.sample(-w, uc, u, mode)?
            } else {
                z = 0.0;
                self.base.sample(-w, u)?
            };
            beta *= next.f * (next.wi.z.abs() / next.pdf);
            specular &= next.flags.is_specular();
            w = next.wi;
            if next.flags.is_transmission() {
                return leaves(beta, w, specular);
            }
        }
        None
    }
}

/// Russian roulette after the first few events, as in pbrt-v4; false where the walk ends.
#[inline]
fn survives(beta: &mut SampledSpectrum, depth: u32, random: &mut Random) -> bool {
    let largest = beta.max_component();
    if depth <= 3 || largest >= 0.25 {
        return largest > 0.0;
    }
    if random.next_1d() >= largest {
        return false;
    }
    *beta /= largest;
    true
}

/// Weight of a technique of density `a` against one of density `b`, by pbrt-v4's heuristic.
#[inline]
pub(super) fn mis_weight(a: f32, b: f32) -> f32 {
    Heuristic::Power(2.0).weight2(1.0, a, 1.0, b)
}

/// Random numbers that follow from a seed and two vectors.
fn random_of(seed: u64, a: Vec3, b: Vec3) -> Random {
    let bits = |v: Vec3| v.to_array().map(|x| u64::from(x.to_bits()));
    let [ax, ay, az] = bits(a);
    let [bx, by, bz] = bits(b);
    Random::new(hash(seed, ax << 32 | ay, az, 0), bx << 32 | by, bz)
}
