//! A measured lamp: a point whose intensity an image gives for every direction.

use super::point::from_point;
use super::{LightBounds, LightSample, ScaledSpectrum};
use crate::sphere_map::SphereMap;
use glam::Vec3;
use luz_color::Wavelengths;
use luz_geometry::Transform;
use std::f64::consts::TAU;

/// A point that radiates as an equal-area image of all directions says, as pbrt-v4 has it: its centre is the light's +y.
#[derive(Clone, Debug)]
pub struct GoniometricLight {
    world_from_light: Transform,
    position: Vec3,
    intensity: ScaledSpectrum,
    /// Texels along each side.
    size: usize,
    texels: Vec<f32>,
    mean: f64,
}

impl GoniometricLight {
    /// A light at the origin of its space. The radiant intensity is `intensity` times one of the `size` × `size` texels,
    /// row by row, finite and not negative; those that are missing are dark.
    pub fn new(world_from_light: Transform, intensity: ScaledSpectrum, size: usize, mut texels: Vec<f32>) -> Self {
        texels.resize(size * size, 0.0);
        let mean = texels.iter().map(|&v| f64::from(v)).sum::<f64>() / texels.len().max(1) as f64;
        Self { position: world_from_light.point(Vec3::ZERO), world_from_light, intensity, size, texels, mean }
    }

    /// The light that arrives at `reference`.
    pub fn sample(&self, reference: Vec3, wavelengths: &Wavelengths) -> Option<LightSample> {
        from_point(self.position, &self.intensity, reference, wavelengths, |to_light| self.factor(-to_light))
    }

    /// The factor on the intensity of light that leaves towards `direction`, in world space.
    pub fn factor(&self, direction: Vec3) -> f32 {
        let Some(local) = self.world_from_light.inverse().vector(direction).try_normalize() else { return 0.0 };
        let uv = SphereMap::EqualArea.coordinates(Vec3::new(local.x, local.z, local.y));
        let texel = |x: f32| ((x * self.size as f32) as usize).min(self.size.saturating_sub(1));
        self.texels.get(texel(uv.y) * self.size + texel(uv.x)).copied().unwrap_or(0.0)
    }

    /// ∫ I dω.
    pub fn power(&self) -> f64 {
        2.0 * TAU * self.mean * self.intensity.weight()
    }

    /// Where the light is; a mean of all directions stands for each.
    pub fn bounds(&self) -> LightBounds {
        LightBounds::point(self.position, (self.mean * self.intensity.weight()) as f32)
    }
}
