//! A plate of glass without thickness.

use glam::Vec3;
use luz_color::SampledSpectrum;

use super::{BsdfSample, Lobe, direction::mirror, fresnel};

/// A thin plate of a smooth dielectric: it reflects like a mirror and transmits without bending.
#[derive(Clone, Copy, Debug)]
pub struct ThinDielectric {
    eta: f32,
}

impl ThinDielectric {
    /// A plate of relative index of refraction `eta`.
    #[inline]
    pub fn new(eta: f32) -> Self {
        Self { eta }
    }

    /// Its scattering kinds.
    #[inline]
    pub fn flags(&self) -> Lobe {
        Lobe::BOTH_SIDES | Lobe::SPECULAR
    }

    /// Samples reflection or transmission, by their share of the light.
    #[inline]
    pub fn sample(&self, wo: Vec3, uc: f32) -> Option<BsdfSample> {
        let cos = wo.z.abs();
        if cos == 0.0 {
            return None;
        }
        let reflectance = fresnel::thin_dielectric(cos, self.eta);
        let (share, wi, side) = if uc < reflectance {
            (reflectance, mirror(wo), Lobe::REFLECTION)
        } else {
            (1.0 - reflectance, -wo, Lobe::TRANSMISSION)
        };
        (share > 0.0).then(|| BsdfSample::new(SampledSpectrum::splat(share / cos), wi, share, side | Lobe::SPECULAR))
    }
}
