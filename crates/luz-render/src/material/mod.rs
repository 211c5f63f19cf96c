//! Materials: textures in, a BSDF at a point out.

mod perturb;
mod shading;

pub use perturb::{NormalMap, Perturbation};
pub use shading::Shading;

use crate::bsdf::{
    Base, Bsdf, CoatInterface, CoatMedium, CoatWeights, CoatedDiffuse, Conductor, Dielectric, Diffuse,
    DiffuseTransmission, Layered, ThinDielectric, TrowbridgeReitz,
};
use crate::chance::{chance_at, seed_at};
use crate::texture::{FloatTextureId, SpectrumTextureId, SurfaceContext, Textures};
use luz_color::{SampledSpectrum, Spectrum, Wavelengths};

/// Names a material of the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MaterialId(pub(crate) u32);

impl MaterialId {
    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }
}

/// Roughness along the two tangents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roughness {
    /// Along the first and the second tangent.
    pub along: [FloatTextureId; 2],
    /// True if the values are perceptual and α is their square root, as pbrt-v4 remaps them.
    pub remap: bool,
}

impl Roughness {
    fn distribution(&self, textures: &Textures, context: &SurfaceContext) -> TrowbridgeReitz {
        let alpha = self.along.map(|id| {
            let roughness = textures.float(id, context);
            if self.remap { TrowbridgeReitz::roughness_to_alpha(roughness) } else { roughness }
        });
        TrowbridgeReitz::new(alpha[0], alpha[1])
    }
}

/// Index of refraction of a transparent medium.
#[derive(Clone, Debug)]
pub enum Refraction {
    /// The same at all wavelengths.
    Constant(f32),
    /// Dispersive: only one wavelength of a path can go on.
    Dispersive(Spectrum),
}

impl Refraction {
    /// The index at the path's first wavelength; where it depends on the wavelength, the others are given up.
    fn at(&self, wavelengths: &mut Wavelengths) -> f32 {
        match self {
            Self::Constant(eta) => *eta,
            Self::Dispersive(spectrum) => {
                wavelengths.terminate_secondary();
                let eta = spectrum.sample(wavelengths)[0];
                if eta > 0.0 { eta } else { 1.0 }
            }
        }
    }
}

/// The optical constants of a metal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Metal {
    /// Measured: index of refraction and absorption coefficient.
    Measured {
        /// Index of refraction.
        eta: SpectrumTextureId,
        /// Absorption coefficient.
        k: SpectrumTextureId,
    },
    /// The reflectance at normal incidence.
    Reflectance(SpectrumTextureId),
}

impl Metal {
    fn constants(
        &self,
        textures: &Textures,
        context: &SurfaceContext,
        wavelengths: &Wavelengths,
    ) -> (SampledSpectrum, SampledSpectrum) {
        match *self {
            Self::Measured { eta, k } => {
                (textures.spectrum(eta, context, wavelengths), textures.spectrum(k, context, wavelengths))
            }
            Self::Reflectance(reflectance) => {
                // With η = 1 and this k a metal reflects just so much at normal incidence.
                let r = textures.spectrum(reflectance, context, wavelengths).clamp(0.0, 0.9999);
                (SampledSpectrum::ONE, 2.0 * r.sqrt() / (SampledSpectrum::ONE - r).sqrt())
            }
        }
    }
}

/// The clear coat of a coated material.
#[derive(Debug)]
pub struct Coat {
    /// Its outer face.
    pub roughness: Roughness,
    /// What it is made of.
    pub refraction: Refraction,
    /// Optical thickness.
    pub thickness: FloatTextureId,
    /// Single-scattering albedo of what is suspended in it.
    pub albedo: SpectrumTextureId,
    /// Asymmetry of that scattering.
    pub g: FloatTextureId,
    /// How often light meets the coat's two faces before it is given up.
    pub max_depth: u32,
    /// How many walks estimate a value.
    pub samples: u32,
    /// How those walks are weighted.
    pub weights: CoatWeights,
    /// Tables of the closed form, where thickness and index are constant and nothing is suspended.
    pub interface: Option<Box<CoatInterface>>,
}

impl Coat {
    fn layered<'a>(
        &self,
        base: Base,
        (textures, context): (&Textures, &SurfaceContext),
        eta: f32,
        wavelengths: &Wavelengths,
    ) -> Bsdf<'a> {
        let medium = CoatMedium {
            thickness: textures.float(self.thickness, context),
            albedo: textures.spectrum(self.albedo, context, wavelengths).clamp(0.0, 1.0),
            g: textures.float(self.g, context),
        };
        let interface = Dielectric::new(self.roughness.distribution(textures, context), eta);
        let layered = Layered::new(interface, base, medium, self.max_depth, self.samples, seed_at(context.position));
        Bsdf::Layered(layered.with_weights(self.weights))
    }
}

/// How a surface scatters, over the whole surface.
#[derive(Debug)]
pub enum Scattering {
    /// Lambertian reflection.
    Diffuse {
        /// Reflectance.
        reflectance: SpectrumTextureId,
    },
    /// Lambertian reflection and transmission.
    DiffuseTransmission {
        /// Reflectance.
        reflectance: SpectrumTextureId,
        /// Transmittance.
        transmittance: SpectrumTextureId,
        /// Factor on both.
        scale: f32,
    },
    /// A metal.
    Conductor {
        /// Its optical constants.
        metal: Metal,
        /// Its roughness.
        roughness: Roughness,
    },
    /// The boundary of a transparent medium.
    Dielectric {
        /// The medium.
        refraction: Refraction,
        /// Its roughness.
        roughness: Roughness,
    },
    /// A pane.
    ThinDielectric {
        /// What it is made of.
        refraction: Refraction,
    },
    /// Paint under varnish.
    CoatedDiffuse {
        /// The paint's reflectance.
        reflectance: SpectrumTextureId,
        /// The varnish.
        coat: Coat,
    },
    /// Metal under varnish.
    CoatedConductor {
        /// The metal's optical constants.
        metal: Metal,
        /// The metal's roughness.
        roughness: Roughness,
        /// The varnish.
        coat: Coat,
    },
    /// One of two materials, chosen at random at each point.
    Mix {
        /// The two materials.
        materials: [MaterialId; 2],
        /// Share of the second.
        amount: FloatTextureId,
    },
    /// Nothing: the boundary of a medium, which light passes.
    Interface,
}

/// A material.
#[derive(Debug)]
pub struct Material {
    /// How it scatters.
    pub scattering: Scattering,
    /// What tilts its shading normal.
    pub perturbation: Option<Perturbation>,
}

impl Material {
    /// False where light may pass as if nothing were there.
    pub(crate) fn always_scatters(&self) -> bool {
        !matches!(self.scattering, Scattering::Mix { .. } | Scattering::Interface)
    }

    /// The material that a mix stands for at a point; `None` for any other.
    pub(crate) fn choose(&self, textures: &Textures, context: &SurfaceContext) -> Option<MaterialId> {
        let Scattering::Mix { materials, amount } = &self.scattering else { return None };
        let amount = textures.float(*amount, context);
        // The choice is a pure function of the point, so that a path finds the same from either of its ends.
        let u = chance_at(context.position, materials[0].0 ^ materials[1].0.rotate_left(16));
        Some(materials[usize::from(amount >= 1.0 || (amount > 0.0 && u < amount))])
    }

    /// The BSDF if it is the same everywhere, and of the commonest kind.
    #[inline(always)]
    pub(crate) fn plain(&self, textures: &Textures, wavelengths: &Wavelengths) -> Option<Diffuse> {
        let Scattering::Diffuse { reflectance } = self.scattering else { return None };
        let spectrum = textures.constant_spectrum(reflectance)?;
        Some(Diffuse::new(spectrum.sample(wavelengths).clamp(0.0, 1.0)))
    }

    /// Sets the BSDF to that at a point. False where nothing scatters; mixes have been resolved before. (Written to its
    /// place, since a BSDF is large and mostly empty.)
    #[inline(always)]
    pub(crate) fn set_bsdf<'w>(
        &'w self,
        bsdf: &mut Bsdf<'w>,
        textures: &Textures,
        context: &SurfaceContext,
        wavelengths: &mut Wavelengths,
    ) -> bool {
        let albedo = |id: SpectrumTextureId, wavelengths: &Wavelengths| {
            textures.spectrum(id, context, wavelengths).clamp(0.0, 1.0)
        };
        match &self.scattering {
            Scattering::Diffuse { reflectance } => {
                *bsdf = Bsdf::Diffuse(Diffuse::new(albedo(*reflectance, wavelengths)));
            }
            Scattering::DiffuseTransmission { reflectance, transmittance, scale } => {
                let r = (textures.spectrum(*reflectance, context, wavelengths) * *scale).clamp(0.0, 1.0);
                let t = (textures.spectrum(*transmittance, context, wavelengths) * *scale).clamp(0.0, 1.0);
                *bsdf = Bsdf::DiffuseTransmission(DiffuseTransmission::new(r, t));
            }
            Scattering::Conductor { metal, roughness } => {
                let (eta, k) = metal.constants(textures, context, wavelengths);
                *bsdf = Bsdf::Conductor(Conductor::new(roughness.distribution(textures, context), eta, k));
            }
            Scattering::Dielectric { refraction, roughness } => {
                let eta = refraction.at(wavelengths);
                *bsdf = Bsdf::Dielectric(Dielectric::new(roughness.distribution(textures, context), eta));
            }
            Scattering::ThinDielectric { refraction } => {
                *bsdf = Bsdf::ThinDielectric(ThinDielectric::new(refraction.at(wavelengths)));
            }
            Scattering::CoatedDiffuse { reflectance, coat } => {
                let eta = coat.refraction.at(wavelengths);
                let reflectance = albedo(*reflectance, wavelengths);
                *bsdf = match &coat.interface {
                    Some(interface) => {
                        let alpha = coat.roughness.distribution(textures, context).alpha();
                        Bsdf::CoatedDiffuse(CoatedDiffuse::textured(reflectance, interface, alpha.x, alpha.y))
                    }
                    None => {
                        let base = Base::Diffuse(Diffuse::new(reflectance));
                        coat.layered(base, (textures, context), eta, wavelengths)
                    }
                };
            }
            Scattering::CoatedConductor { metal, roughness, coat } => {
                let outer = coat.refraction.at(wavelengths);
                let (eta, k) = metal.constants(textures, context, wavelengths);
                // Seen from within the coat.
                let (eta, k) = (eta * (1.0 / outer), k * (1.0 / outer));
                let base = Base::Conductor(Conductor::new(roughness.distribution(textures, context), eta, k));
                *bsdf = coat.layered(base, (textures, context), outer, wavelengths);
            }
            Scattering::Mix { .. } | Scattering::Interface => return false,
        }
        true
    }
}
