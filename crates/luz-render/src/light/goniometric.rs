//! A measured lamp: a point whose intensity an image gives for every direction.

use super::distortion::local_solid_angle;
use super::point::from_point;
use super::{LightBounds, LightSample, ScaledSpectrum};
use crate::sphere_map::SphereMap;
use glam::{Vec2, Vec3};
use luz_color::Wavelengths;
use luz_geometry::Transform;
use luz_sample::distribution::PiecewiseConstant2D;
use std::f64::consts::TAU;

/// A point that radiates as an equal-area image of all directions says, as pbrt-v4 has it: its centre is the light's +y.
#[derive(Clone, Debug)]
pub struct GoniometricLight {
    world_from_light: Transform,
    position: Vec3,
    pub(super) intensity: ScaledSpectrum,
    /// Texels along each side.
    size: usize,
    texels: Vec<f32>,
    mean: f64,
    /// The texels, as directions are drawn by them; `None` where all are dark.
    distribution: Option<PiecewiseConstant2D>,
}

impl GoniometricLight {
    /// A light at the origin of its space. The radiant intensity is `intensity` times one of the `size` × `size` texels,
    /// row by row, finite and not negative; those that are missing are dark.
    pub fn new(world_from_light: Transform, intensity: ScaledSpectrum, size: usize, mut texels: Vec<f32>) -> Self {
        texels.resize(size * size, 0.0);
        let mean = texels.iter().map(|&v| f64::from(v)).sum::<f64>() / texels.len().max(1) as f64;
        let distribution = PiecewiseConstant2D::new(&texels, [size, size]).ok().filter(|_| mean > 0.0);
        let position = world_from_light.point(Vec3::ZERO);
        Self { position, world_from_light, intensity, size, texels, mean, distribution }
    }

    /// World-space position.
    pub fn position(&self) -> Vec3 {
        self.position
    }

    /// Draws a direction in which light leaves, in proportion to the intensity, and its density in solid angle.
    pub fn sample_direction(&self, u: Vec2) -> Option<(Vec3, f32)> {
        let (uv, _) = self.distribution.as_ref()?.sample(u);
        let d = SphereMap::EqualArea.direction(uv);
        let direction = self.world_from_light.vector(Vec3::new(d.x, d.z, d.y)).try_normalize()?;
        Some((direction, self.direction_pdf(direction)))
    }

    /// The density of [`sample_direction`](Self::sample_direction), in solid angle.
    pub fn direction_pdf(&self, direction: Vec3) -> f32 {
        let Some(distribution) = &self.distribution else { return 0.0 };
        let Some(uv) = self.coordinates(direction) else { return 0.0 };
        distribution.pdf(uv) / (2.0 * TAU as f32) * local_solid_angle(&self.world_from_light, direction)
    }

    /// Where in the image a direction in world space leads.
    fn coordinates(&self, direction: Vec3) -> Option<Vec2> {
        let local = self.world_from_light.inverse().vector(direction).try_normalize()?;
        Some(SphereMap::EqualArea.coordinates(Vec3::new(local.x, local.z, local.y)))
    }

    /// The light that arrives at `reference`.
    pub fn sample(&self, reference: Vec3, wavelengths: &Wavelengths) -> Option<LightSample> {
        from_point(self.position, &self.intensity, reference, wavelengths, |to_light| self.factor(-to_light))
    }

    /// The factor on the intensity of light that leaves towards `direction`, in world space.
    pub fn factor(&self, direction: Vec3) -> f32 {
        let Some(uv) = self.coordinates(direction) else { return 0.0 };
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
