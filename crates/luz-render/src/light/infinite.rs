//! Light from all around: constant, or an environment map.

use super::{LightSample, ScaledSpectrum, Target};
use crate::sphere_map::SphereMap;
use crate::texture::SpectrumKind;
use glam::{Vec2, Vec3};
use luz_color::{RgbColorSpace, SampledSpectrum, Spectrum, Wavelengths};
use luz_geometry::Transform;
use luz_sample::distribution::{DistributionError, PiecewiseConstant2D};
use luz_sample::warp;
use std::f32::consts::{PI, TAU};

/// The same radiance from every direction.
#[derive(Clone, Debug)]
pub struct UniformInfiniteLight {
    /// Radiance.
    pub radiance: ScaledSpectrum,
}

impl UniformInfiniteLight {
    /// Draws a direction evenly over the sphere.
    pub fn sample(&self, u: Vec2, wavelengths: &Wavelengths) -> LightSample {
        LightSample {
            radiance: self.radiance(wavelengths),
            direction: warp::uniform_sphere(u),
            target: Target::Infinity,
            pdf: self.pdf(),
            is_delta: false,
        }
    }

    /// 1 / 4π.
    pub fn pdf(&self) -> f32 {
        1.0 / (2.0 * TAU)
    }

    /// The radiance.
    pub fn radiance(&self, wavelengths: &Wavelengths) -> SampledSpectrum {
        self.radiance.sample(wavelengths)
    }

    /// What falls on the sphere that bounds the scene.
    pub fn power(&self, scene_radius: f32) -> f64 {
        f64::from(2.0 * TAU * PI) * f64::from(scene_radius).powi(2) * self.radiance.weight()
    }
}

/// An environment map: constant radiance over each texel, drawn in proportion to it.
#[derive(Clone, Debug)]
pub struct ImageInfiniteLight {
    map: SphereMap,
    size: [usize; 2],
    texels: Vec<[f32; 3]>,
    color_space: &'static RgbColorSpace,
    scale: f32,
    world_from_light: Transform,
    distribution: PiecewiseConstant2D,
    mean_weight: f64,
}

impl ImageInfiniteLight {
    /// A map of `size` (width, height) texels, row by row from the top; RGB in `color_space`, finite and not negative.
    ///
    /// # Errors
    /// If a texel is negative or not finite.
    pub fn new(
        map: SphereMap,
        size: [usize; 2],
        texels: Vec<[f32; 3]>,
        color_space: &'static RgbColorSpace,
        scale: f32,
        world_from_light: Transform,
    ) -> Result<Self, DistributionError> {
        let [width, height] = size;
        let mut weights = Vec::with_capacity(texels.len());
        for (y, row) in texels.chunks_exact(width.max(1)).enumerate() {
            // Equal-area texels subtend the same solid angle; those of a latitude grow towards the equator.
            let solid_angle = match map {
                SphereMap::EqualArea => 2.0 * TAU / (width * height) as f32,
                SphereMap::LatitudeLongitude => latitude_band(y, height).1 * TAU / width as f32,
            };
            weights.extend(row.iter().map(|rgb| (rgb[0] + rgb[1] + rgb[2]) / 3.0 * solid_angle));
        }
        let mean_weight = weights.iter().map(|&w| f64::from(w)).sum::<f64>() / f64::from(2.0 * TAU);
        let distribution = PiecewiseConstant2D::new(&weights, size)?;
        Ok(Self { map, size, texels, color_space, scale, world_from_light, distribution, mean_weight })
    }

    /// Draws a direction in proportion to the map's radiance; `None` for a black map.
    pub fn sample(&self, u: Vec2, wavelengths: &Wavelengths) -> Option<LightSample> {
        let (uv, pdf_uv) = self.distribution.sample(u);
        if pdf_uv == 0.0 {
            return None;
        }
        let direction = self.direction(uv);
        Some(LightSample {
            radiance: self.texel_radiance(uv, wavelengths),
            direction: self.world_from_light.vector(direction).normalize(),
            target: Target::Infinity,
            pdf: pdf_uv * self.density_factor(uv),
            is_delta: false,
        })
    }

    /// The density of [`sample`](Self::sample) in solid angle.
    pub fn pdf(&self, direction: Vec3) -> f32 {
        let uv = self.coordinates(direction);
        self.distribution.pdf(uv) * self.density_factor(uv)
    }

    /// The radiance that arrives against `direction`.
    pub fn radiance(&self, direction: Vec3, wavelengths: &Wavelengths) -> SampledSpectrum {
        self.texel_radiance(self.coordinates(direction), wavelengths)
    }

    /// What falls on the sphere that bounds the scene.
    pub fn power(&self, scene_radius: f32) -> f64 {
        let radiance = self.mean_weight
            * f64::from(self.scale)
            * f64::from(luz_color::spectrum_to_y(&Spectrum::Dense(self.color_space.illuminant().clone())));
        f64::from(2.0 * TAU * PI) * f64::from(scene_radius).powi(2) * radiance
    }

    fn coordinates(&self, direction: Vec3) -> Vec2 {
        self.map.coordinates(self.world_from_light.inverse().vector(direction).normalize())
    }

    /// Within a texel directions are spread evenly over its solid angle: linear in cos θ, not in θ, on a latitude band.
    fn direction(&self, uv: Vec2) -> Vec3 {
        match self.map {
            SphereMap::EqualArea => self.map.direction(uv),
            SphereMap::LatitudeLongitude => {
                let rows = self.size[1] as f32;
                let row = ((uv.y * rows) as usize).min(self.size[1] - 1);
                let (top, extent) = latitude_band(row, self.size[1]);
                let cos_theta = (top - extent * (uv.y * rows - row as f32)).clamp(-1.0, 1.0);
                let sin_theta = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
                let (sin_phi, cos_phi) = (uv.x * TAU).sin_cos();
                Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
            }
        }
    }

    /// From density over the unit square to density in solid angle: the texel's area over its solid angle.
    fn density_factor(&self, uv: Vec2) -> f32 {
        match self.map {
            SphereMap::EqualArea => 1.0 / (2.0 * TAU),
            SphereMap::LatitudeLongitude => {
                let rows = self.size[1];
                let row = ((uv.y * rows as f32) as usize).min(rows - 1);
                1.0 / (TAU * rows as f32 * latitude_band(row, rows).1)
            }
        }
    }

    fn texel_radiance(&self, uv: Vec2, wavelengths: &Wavelengths) -> SampledSpectrum {
        let [width, height] = self.size;
        let x = ((uv.x * width as f32) as usize).min(width - 1);
        let y = ((uv.y * height as f32) as usize).min(height - 1);
        let rgb = self.texels[y * width + x];
        SpectrumKind::Illuminant.spectrum(self.color_space, rgb, wavelengths) * self.scale
    }
}

/// cos θ at the top of a row of a latitude–longitude map, and how far it falls to the row's bottom.
fn latitude_band(row: usize, rows: usize) -> (f32, f32) {
    let cos = |edge: usize| (std::f64::consts::PI * edge as f64 / rows as f64).cos();
    (cos(row) as f32, (cos(row) - cos(row + 1)) as f32)
}
