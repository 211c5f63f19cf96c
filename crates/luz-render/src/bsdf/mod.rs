//! Scattering at surfaces, in local shading space.
//!
//! The shading normal is +z; `wo` and `wi` are unit vectors that both point away from the surface. A value excludes
//! the cosine; a density is in solid angle, or a discrete probability for specular lobes. Every BSDF is a plain value
//! and a pure function of its arguments; the set is closed and matched in [`Bsdf`].
//!
//! To add a BSDF: add a file with `flags`, `evaluate` and `sample`, and a variant here.

mod coat_interface;
mod coat_quadrature;
mod coated_diffuse;
mod conductor;
mod dielectric;
mod diffuse;
mod direction;
pub mod fresnel;
mod henyey_greenstein;
mod layered;
mod layered_proposal;
mod lobe;
mod microfacet;
mod thin_dielectric;

use glam::{Vec2, Vec3};
use luz_color::SampledSpectrum;

pub use coat_interface::{CoatInterface, CoatWeights};
pub use coated_diffuse::CoatedDiffuse;
pub use conductor::Conductor;
pub use dielectric::Dielectric;
pub use diffuse::{Diffuse, DiffuseTransmission};
pub use layered::{Base, CoatMedium, Layered};
pub use lobe::{BsdfSample, Lobe, TransportMode};
pub use microfacet::TrowbridgeReitz;
pub use thin_dielectric::ThinDielectric;

/// How a point of a surface scatters light.
///
/// It may borrow tables of its material.
#[derive(Clone, Copy, Debug)]
pub enum Bsdf<'a> {
    /// Lambertian reflection.
    Diffuse(Diffuse),
    /// Lambertian reflection and transmission.
    DiffuseTransmission(DiffuseTransmission),
    /// A metal.
    Conductor(Conductor),
    /// An interface between two transparent media.
    Dielectric(Dielectric),
    /// A plate of glass without thickness.
    ThinDielectric(ThinDielectric),
    /// A Lambertian base under a clear coat.
    CoatedDiffuse(CoatedDiffuse<'a>),
    /// Any opaque base under any coat.
    Layered(Layered),
}

impl Bsdf<'_> {
    /// What kind of surface this is, in a word or two.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Diffuse(_) => "diffuse",
            Self::DiffuseTransmission(_) => "diffuse transmission",
            Self::Conductor(_) => "conductor",
            Self::Dielectric(_) => "dielectric",
            Self::ThinDielectric(_) => "thin dielectric",
            Self::CoatedDiffuse(_) => "coated diffuse",
            Self::Layered(_) => "layered",
        }
    }

    /// True if [`pdf`](Self::pdf) is the density of [`sample`](Self::sample), and not an estimate of it.
    #[inline]
    pub fn has_exact_pdf(&self) -> bool {
        !matches!(self, Self::Layered(_))
    }

    /// Value for a pair of directions, sr⁻¹, without the cosine; zero for specular lobes.
    #[inline]
    pub fn f(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> SampledSpectrum {
        self.evaluate(wo, wi, mode).0
    }

    /// Density, in solid angle, with which [`propose`](Self::propose) draws `wi` for `wo`, and [`sample`](Self::sample)
    /// but for [`Layered`], for which it is a stand-in; specular lobes count nothing.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> f32 {
        match self {
            Self::Layered(bsdf) => bsdf.pdf(wo, wi),
            _ => self.evaluate(wo, wi, mode).1,
        }
    }

    /// [`f`](Self::f) and [`pdf`](Self::pdf) together, for less than the price of both.
    #[inline(always)]
    pub fn evaluate(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (SampledSpectrum, f32) {
        match self {
            Self::Diffuse(bsdf) => bsdf.evaluate(wo, wi),
            other => other.evaluate_other(wo, wi, mode),
        }
    }

    /// [`evaluate`](Self::evaluate) of the kinds that are not inlined everywhere.
    #[inline(never)]
    fn evaluate_other(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (SampledSpectrum, f32) {
        match self {
            Self::Diffuse(bsdf) => bsdf.evaluate(wo, wi),
            Self::DiffuseTransmission(bsdf) => bsdf.evaluate(wo, wi),
            Self::Conductor(bsdf) => bsdf.evaluate(wo, wi),
            Self::Dielectric(bsdf) => {
                let (f, pdf) = bsdf.evaluate(wo, wi, mode);
                (SampledSpectrum::splat(f), pdf)
            }
            Self::ThinDielectric(_) => (SampledSpectrum::ZERO, 0.0),
            Self::CoatedDiffuse(bsdf) => bsdf.evaluate(wo, wi),
            Self::Layered(bsdf) => bsdf.evaluate(wo, wi, mode),
        }
    }

    /// A direction, with its value and density; `None` where the sample leads nowhere.
    ///
    /// `uc` picks the lobe, `u` the direction in it, all in `[0, 1)`.
    #[inline(always)]
    pub fn sample(&self, wo: Vec3, uc: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        match self {
            Self::Diffuse(bsdf) => bsdf.sample(wo, u),
            other => other.sample_other(wo, uc, u, mode),
        }
    }

    /// [`sample`](Self::sample) of the kinds that are not inlined everywhere.
    #[inline(never)]
    fn sample_other(&self, wo: Vec3, uc: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        match self {
            Self::Diffuse(bsdf) => bsdf.sample(wo, u),
            Self::DiffuseTransmission(bsdf) => bsdf.sample(wo, uc, u),
            Self::Conductor(bsdf) => bsdf.sample(wo, u),
            Self::Dielectric(bsdf) => bsdf.sample(wo, uc, u, mode),
            Self::ThinDielectric(bsdf) => bsdf.sample(wo, uc),
            Self::CoatedDiffuse(bsdf) => bsdf.sample(wo, uc, u),
            Self::Layered(bsdf) => bsdf.sample(wo, uc, u, mode),
        }
    }

    /// A direction with its value and *exact* density, [`proposal_pdf`](Self::proposal_pdf); `None` where it leads
    /// nowhere.
    ///
    /// For all but [`Layered`] this is [`sample`](Self::sample). There the value is the estimate of
    /// [`evaluate`](Self::evaluate), a fixed function of the two directions.
    #[inline]
    pub fn propose(&self, wo: Vec3, uc: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        match self {
            Self::Layered(bsdf) => bsdf.propose(wo, uc, u, mode),
            _ => self.sample(wo, uc, u, mode),
        }
    }

    /// The density of [`propose`](Self::propose), in solid angle; specular lobes count nothing.
    #[inline]
    pub fn proposal_pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> f32 {
        self.pdf(wo, wi, mode)
    }

    /// Specular scattering to one side, `Lobe::REFLECTION` or `Lobe::TRANSMISSION`: the one direction, its value, and the
    /// probability with which [`propose`](Self::propose) draws it. `None` where there is none.
    #[inline]
    pub fn specular(&self, wo: Vec3, side: Lobe, mode: TransportMode) -> Option<BsdfSample> {
        if !self.flags().is_specular() {
            return None;
        }
        // Of two specular lobes reflection comes first.
        let uc = if side.is_reflection() { 0.0 } else { 1.0 };
        let sample = match self {
            Self::Layered(bsdf) => bsdf.specular(wo),
            _ => self.sample(wo, uc, Vec2::ZERO, mode),
        };
        sample.filter(|s| s.flags.is_specular() && s.flags.contains(side))
    }

    /// The union of its scattering kinds.
    #[inline(always)]
    pub fn flags(&self) -> Lobe {
        match self {
            Self::Diffuse(bsdf) => bsdf.flags(),
            other => other.flags_other(),
        }
    }

    /// [`flags`](Self::flags) of the kinds that are not inlined everywhere.
    #[inline(never)]
    fn flags_other(&self) -> Lobe {
        match self {
            Self::Diffuse(bsdf) => bsdf.flags(),
            Self::DiffuseTransmission(bsdf) => bsdf.flags(),
            Self::Conductor(bsdf) => bsdf.flags(),
            Self::Dielectric(bsdf) => bsdf.flags(),
            Self::ThinDielectric(bsdf) => bsdf.flags(),
            Self::CoatedDiffuse(bsdf) => bsdf.flags(),
            Self::Layered(bsdf) => bsdf.flags(),
        }
    }

    /// Whether [`sample`](Self::sample) looks at `uc`.
    #[inline(always)]
    pub fn has_choices(&self) -> bool {
        !matches!(self, Self::Diffuse(_) | Self::Conductor(_))
    }

    /// True where all lobes are delta distributions, so that lights need not be sampled.
    #[inline]
    pub fn is_specular(&self) -> bool {
        !self.has_non_specular()
    }

    /// True where some lobe has a finite density.
    #[inline]
    pub fn has_non_specular(&self) -> bool {
        self.flags().has_non_specular()
    }

    /// Roughens very smooth surfaces, so that lights can be sampled through them: biased, but without fireflies.
    /// See [`TrowbridgeReitz::regularize`].
    pub fn regularize(&mut self) {
        match self {
            Self::Diffuse(_) | Self::DiffuseTransmission(_) | Self::ThinDielectric(_) => {}
            Self::Conductor(bsdf) => bsdf.regularize(),
            Self::Dielectric(bsdf) => bsdf.regularize(),
            Self::CoatedDiffuse(bsdf) => bsdf.regularize(),
            Self::Layered(bsdf) => bsdf.regularize(),
        }
    }

    /// Fraction of importance from `wo` that goes on in any direction: exact for Lambertian, smooth and
    /// [`CoatedDiffuse`] surfaces, otherwise an estimate from 16 fixed samples. A guide feature, not for transport.
    pub fn albedo(&self, wo: Vec3) -> SampledSpectrum {
        match self {
            Self::Diffuse(bsdf) => bsdf.reflectance(),
            Self::DiffuseTransmission(bsdf) => bsdf.albedo(),
            Self::CoatedDiffuse(bsdf) => bsdf.albedo(wo),
            Self::ThinDielectric(_) => SampledSpectrum::ONE,
            Self::Dielectric(bsdf) if bsdf.is_specular() => SampledSpectrum::ONE,
            Self::Conductor(bsdf) if bsdf.flags().is_specular() => bsdf.fresnel(wo.z.abs()),
            Self::Conductor(_) | Self::Dielectric(_) | Self::Layered(_) => self.estimated_albedo(wo),
        }
    }

    fn estimated_albedo(&self, wo: Vec3) -> SampledSpectrum {
        const SIDE: usize = 4;
        const COUNT: usize = SIDE * SIDE;
        let mut sum = SampledSpectrum::ZERO;
        for i in 0..COUNT {
            // A grid, with a third dimension that visits every stratum once.
            let (x, y) = (i % SIDE, i / SIDE);
            let u = Vec2::new((x as f32 + 0.5) / SIDE as f32, (y as f32 + 0.5) / SIDE as f32);
            let uc = ((i * 7 % COUNT) as f32 + 0.5) / COUNT as f32;
            if let Some(sample) = self.sample(wo, uc, u, TransportMode::Importance)
                && sample.pdf > 0.0
            {
                sum += sample.f * (sample.wi.z.abs() / sample.pdf);
            }
        }
        (sum / COUNT as f32).clamp(0.0, 1.0)
    }
}
