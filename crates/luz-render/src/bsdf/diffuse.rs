//! Lambertian reflection, and Lambertian reflection with transmission.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};
use luz_color::SampledSpectrum;
use luz_sample::warp;

use super::{BsdfSample, Lobe, direction::same_hemisphere};

/// Lambertian reflection on both sides: `f = R/π`.
#[derive(Clone, Copy, Debug)]
pub struct Diffuse {
    reflectance: SampledSpectrum,
}

impl Diffuse {
    /// Reflects the fraction `reflectance`, in `[0, 1]`.
    #[inline]
    pub const fn new(reflectance: SampledSpectrum) -> Self {
        Self { reflectance }
    }

    /// The fraction of light that is reflected.
    #[inline(always)]
    pub fn reflectance(&self) -> SampledSpectrum {
        self.reflectance
    }

    /// Its scattering kinds; none where it is black.
    #[inline(always)]
    pub fn flags(&self) -> Lobe {
        if self.reflectance.is_black() { Lobe::NONE } else { Lobe::REFLECTION | Lobe::DIFFUSE }
    }

    /// Value and density for a pair of directions.
    #[inline]
    pub fn evaluate(&self, wo: Vec3, wi: Vec3) -> (SampledSpectrum, f32) {
        if !same_hemisphere(wo, wi) {
            return (SampledSpectrum::ZERO, 0.0);
        }
        (self.reflectance * FRAC_1_PI, wi.z.abs() * FRAC_1_PI)
    }

    /// A cosine-distributed direction on the side of `wo`.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: Vec2) -> Option<BsdfSample> {
        let mut wi = warp::cosine_hemisphere(u);
        if wo.z < 0.0 {
            wi.z = -wi.z;
        }
        let (f, pdf) = self.evaluate(wo, wi);
        (pdf > 0.0).then(|| BsdfSample::new(f, wi, pdf, Lobe::REFLECTION | Lobe::DIFFUSE))
    }
}

/// Lambertian reflection and transmission, the same from both sides: `f = R/π` and `f = T/π`.
#[derive(Clone, Copy, Debug)]
pub struct DiffuseTransmission {
    reflectance: SampledSpectrum,
    transmittance: SampledSpectrum,
}

impl DiffuseTransmission {
    /// Reflects the fraction `reflectance` and transmits `transmittance`; their sum should be in `[0, 1]`.
    #[inline]
    pub fn new(reflectance: SampledSpectrum, transmittance: SampledSpectrum) -> Self {
        Self { reflectance, transmittance }
    }

    /// Its scattering kinds; none where it is black.
    pub fn flags(&self) -> Lobe {
        let mut lobes = Lobe::NONE;
        if !self.reflectance.is_black() {
            lobes |= Lobe::REFLECTION | Lobe::DIFFUSE;
        }
        if !self.transmittance.is_black() {
            lobes |= Lobe::TRANSMISSION | Lobe::DIFFUSE;
        }
        lobes
    }

    /// Fraction of all light that goes on, on either side.
    #[inline(always)]
    pub fn albedo(&self) -> SampledSpectrum {
        self.reflectance + self.transmittance
    }

    /// Probability of sampling reflection, by the two largest values; `None` where both are black.
    #[inline(always)]
    fn reflection_probability(&self) -> Option<f32> {
        let (r, t) = (self.reflectance.max_component(), self.transmittance.max_component());
        (r + t > 0.0).then(|| r / (r + t))
    }

    /// Value and density for a pair of directions.
    #[inline]
    pub fn evaluate(&self, wo: Vec3, wi: Vec3) -> (SampledSpectrum, f32) {
        let Some(reflected) = self.reflection_probability() else { return (SampledSpectrum::ZERO, 0.0) };
        let cos_pdf = wi.z.abs() * FRAC_1_PI;
        if same_hemisphere(wo, wi) {
            (self.reflectance * FRAC_1_PI, reflected * cos_pdf)
        } else if wo.z * wi.z < 0.0 {
            (self.transmittance * FRAC_1_PI, (1.0 - reflected) * cos_pdf)
        } else {
            (SampledSpectrum::ZERO, 0.0)
        }
    }

    /// A cosine-distributed direction on the side that `uc` picks.
    #[inline]
    pub fn sample(&self, wo: Vec3, uc: f32, u: Vec2) -> Option<BsdfSample> {
        let reflect = uc < self.reflection_probability()?;
        let mut wi = warp::cosine_hemisphere(u);
        if (wo.z < 0.0) == reflect {
            wi.z = -wi.z;
        }
        let side = if reflect { Lobe::REFLECTION } else { Lobe::TRANSMISSION };
        let (f, pdf) = self.evaluate(wo, wi);
        (pdf > 0.0).then(|| BsdfSample::new(f, wi, pdf, side | Lobe::DIFFUSE))
    }
}
