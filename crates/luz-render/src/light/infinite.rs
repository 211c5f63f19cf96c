//! The same light from all around.

use super::{Combination, LightSample, ScaledSpectrum, Target};
use glam::{Vec2, Vec3};
use luz_color::{SampledSpectrum, Wavelengths};
use luz_sample::warp;
use std::f32::consts::{PI, TAU};

/// The same radiance from every direction. Where directions drawn from the BSDF are weighted with its own it draws none:
/// they find it as well without (MIS compensation of a light of one brightness).
#[derive(Clone, Debug)]
pub struct UniformInfiniteLight {
    /// Radiance.
    pub radiance: ScaledSpectrum,
}

impl UniformInfiniteLight {
    /// Draws a direction evenly over the sphere; `None` where that is left to the BSDF.
    pub fn sample(&self, combination: Combination, u: Vec2, wavelengths: &Wavelengths) -> Option<LightSample> {
        let (direction, pdf) = self.sample_direction(combination, u)?;
        let radiance = self.radiance(wavelengths);
        Some(LightSample { radiance, direction, target: Target::Infinity, pdf, is_delta: false })
    }

    /// The direction of [`sample`](Self::sample) and its density in solid angle.
    pub fn sample_direction(&self, combination: Combination, u: Vec2) -> Option<(Vec3, f32)> {
        (combination == Combination::Alone).then(|| (warp::uniform_sphere(u), self.pdf(combination)))
    }

    /// The density of [`sample`](Self::sample) in solid angle: 1 / 4π, or none.
    pub fn pdf(&self, combination: Combination) -> f32 {
        match combination {
            Combination::Alone => 1.0 / (2.0 * TAU),
            Combination::WithBsdf => 0.0,
        }
    }

    /// The radiance.
    pub fn radiance(&self, wavelengths: &Wavelengths) -> SampledSpectrum {
        self.radiance.sample(wavelengths)
    }

    /// What of the light [`sample`](Self::sample) draws falls on the sphere that bounds the scene.
    pub fn power(&self, combination: Combination, scene_radius: f32) -> f64 {
        if combination == Combination::WithBsdf {
            return 0.0;
        }
        f64::from(2.0 * TAU * PI) * f64::from(scene_radius).powi(2) * self.radiance.weight()
    }
}
