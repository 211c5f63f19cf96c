//! Light from infinitely far away along a single direction.

use super::{LightSample, ScaledSpectrum, Target};
use glam::Vec3;
use luz_color::Wavelengths;
use std::f64::consts::PI;

/// A directional light.
#[derive(Clone, Debug)]
pub struct DistantLight {
    /// Unit direction towards the light.
    pub towards: Vec3,
    /// Irradiance on a surface that faces the light.
    pub irradiance: ScaledSpectrum,
}

impl DistantLight {
    /// The light that arrives, the same everywhere.
    pub fn sample(&self, wavelengths: &Wavelengths) -> LightSample {
        LightSample {
            radiance: self.irradiance.sample(wavelengths),
            direction: self.towards,
            target: Target::Infinity,
            pdf: 1.0,
            is_delta: true,
        }
    }

    /// What falls on the disk that bounds the scene.
    pub fn power(&self, scene_radius: f32) -> f64 {
        PI * f64::from(scene_radius).powi(2) * self.irradiance.weight()
    }
}
