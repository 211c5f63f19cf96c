//! A projector.

use super::distortion::{keeps_angles, local_solid_angle};
use super::{LightBounds, LightSample, Target, brightness};
use crate::texture::SpectrumKind;
use glam::{Vec2, Vec3};
use luz_color::{RgbColorSpace, SampledSpectrum, Spectrum, Wavelengths};
use luz_geometry::Transform;
use luz_sample::distribution::PiecewiseConstant2D;

/// The least height above the projector's plane at which directions are lit.
const NEAREST: f32 = 1e-3;

/// The rays of a projector that throws an image of `aspect` (width over height) along +z, with a field of view across the
/// image's shorter side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Throw {
    /// Half the image's size at distance 1.
    half_extent: Vec2,
}

impl Throw {
    /// `field_of_view` in degrees.
    pub fn new(field_of_view: f32, aspect: f32) -> Self {
        let shorter = (field_of_view.to_radians() / 2.0).tan();
        Self { half_extent: if aspect > 1.0 { Vec2::new(aspect, 1.0) } else { Vec2::new(1.0, 1.0 / aspect) } * shorter }
    }

    /// Where in the image, in `[0, 1]²` from its top left, a direction in the projector's space leads: +y is up.
    pub fn coordinates(&self, direction: Vec3) -> Option<Vec2> {
        if direction.z < NEAREST {
            return None;
        }
        let at = Vec2::new(direction.x, -direction.y) / (direction.z * self.half_extent);
        (at.abs().max_element() <= 1.0).then(|| at * 0.5 + 0.5)
    }

    /// The solid angle of a texel of an image of the given size: cos³θ dA.
    pub fn solid_angle(&self, [x, y]: [usize; 2], [width, height]: [usize; 2]) -> f32 {
        let size = Vec2::new(width as f32, height as f32);
        let at = ((Vec2::new(x as f32, y as f32) + 0.5) / size * 2.0 - 1.0) * self.half_extent;
        let cos_squared = 1.0 / (1.0 + at.length_squared());
        let area = 4.0 * self.half_extent.x * self.half_extent.y / (size.x * size.y);
        cos_squared * cos_squared.sqrt() * area
    }

    /// The direction in the projector's space of a point of the image: not a unit vector, but of height 1.
    fn direction(&self, at: Vec2) -> Vec3 {
        let at = (at * 2.0 - 1.0) * self.half_extent;
        Vec3::new(at.x, -at.y, 1.0)
    }

    /// The solid angle by area of the image, whose sides have length 1, about a unit direction: cos³θ dA.
    fn solid_angle_by_area(&self, direction: Vec3) -> f32 {
        4.0 * self.half_extent.x * self.half_extent.y * direction.z.powi(3)
    }

    /// The cosine of the angle between the axis and the image's corners.
    fn cos_corner(&self) -> f32 {
        (1.0 + self.half_extent.length_squared()).sqrt().recip()
    }
}

/// A point that throws an image along its +z, as pbrt-v4 has it.
#[derive(Clone, Debug)]
pub struct ProjectionLight {
    world_from_light: Transform,
    position: Vec3,
    throw: Throw,
    size: [usize; 2],
    texels: Vec<[f32; 3]>,
    color_space: &'static RgbColorSpace,
    scale: f32,
    /// ∫ I dω, in photometric units, and over how much solid angle.
    power: f64,
    solid_angle: f64,
    /// The image, as directions are drawn by it; `None` where it is dark.
    distribution: Option<PiecewiseConstant2D>,
}

impl ProjectionLight {
    /// A light at the origin of its space, whose radiant intensity towards a texel is the texel's emission times `scale`.
    /// Texels of `size` (width, height), row by row from the top; RGB in `color_space`, finite and not negative; those
    /// that are missing are dark.
    pub fn new(
        world_from_light: Transform,
        field_of_view: f32,
        size: [usize; 2],
        mut texels: Vec<[f32; 3]>,
        color_space: &'static RgbColorSpace,
        scale: f32,
    ) -> Self {
        let [width, height] = size;
        texels.resize(width * height, [0.0; 3]);
        let throw = Throw::new(field_of_view, width as f32 / height as f32);
        let (mut power, mut total) = (0.0, 0.0);
        let mut weights = Vec::with_capacity(texels.len());
        for (i, rgb) in texels.iter().enumerate() {
            let solid_angle = f64::from(throw.solid_angle([i % width, i / width], size));
            power += f64::from(color_space.luminance(*rgb).max(0.0)) * solid_angle;
            total += solid_angle;
            weights.push((f64::from(brightness(*rgb)) * solid_angle) as f32);
        }
        let distribution = PiecewiseConstant2D::new(&weights, size).ok().filter(|d| d.integral() > 0.0);
        let white = luz_color::spectrum_to_y(&Spectrum::Dense(color_space.illuminant().clone()));
        Self {
            position: world_from_light.point(Vec3::ZERO),
            world_from_light,
            throw,
            size,
            texels,
            color_space,
            scale,
            power: power * f64::from(white) * f64::from(scale),
            solid_angle: total,
            distribution,
        }
    }

    /// The light that arrives at `reference`.
    pub fn sample(&self, reference: Vec3, wavelengths: &Wavelengths) -> Option<LightSample> {
        let to_light = self.position - reference;
        let distance_squared = to_light.length_squared();
        if distance_squared == 0.0 || !distance_squared.is_finite() {
            return None;
        }
        let direction = to_light / distance_squared.sqrt();
        let radiance = self.intensity(-direction, wavelengths)? * (1.0 / distance_squared);
        (!radiance.is_black()).then_some(LightSample {
            radiance,
            direction,
            target: Target::Point(self.position),
            pdf: 1.0,
            is_delta: true,
        })
    }

    /// World-space position.
    pub fn position(&self) -> Vec3 {
        self.position
    }

    /// Draws a direction in which light leaves, in proportion to the image, and its density in solid angle.
    pub fn sample_direction(&self, u: Vec2) -> Option<(Vec3, f32)> {
        let (at, _) = self.distribution.as_ref()?.sample(u);
        let direction = self.world_from_light.vector(self.throw.direction(at)).try_normalize()?;
        Some((direction, self.direction_pdf(direction)))
    }

    /// The density of [`sample_direction`](Self::sample_direction), in solid angle.
    pub fn direction_pdf(&self, direction: Vec3) -> f32 {
        let Some(distribution) = &self.distribution else { return 0.0 };
        let Some(local) = self.world_from_light.inverse().vector(direction).try_normalize() else { return 0.0 };
        let Some(at) = self.throw.coordinates(local) else { return 0.0 };
        let pdf = distribution.pdf(at) / self.throw.solid_angle_by_area(local)
            * local_solid_angle(&self.world_from_light, direction);
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    /// The radiant intensity towards a direction in world space; `None` beside the image.
    pub fn intensity(&self, direction: Vec3, wavelengths: &Wavelengths) -> Option<SampledSpectrum> {
        let local = self.world_from_light.inverse().vector(direction).try_normalize()?;
        let uv = self.throw.coordinates(local)?;
        let [width, height] = self.size;
        let x = ((uv.x * width as f32) as usize).min(width - 1);
        let y = ((uv.y * height as f32) as usize).min(height - 1);
        let rgb = self.texels.get(y * width + x)?;
        Some(SpectrumKind::Illuminant.spectrum(self.color_space, *rgb, wavelengths) * self.scale)
    }

    /// ∫ I dω.
    pub fn power(&self) -> f64 {
        self.power
    }

    /// Where the light is and how it shines.
    pub fn bounds(&self) -> LightBounds {
        let axis = self.world_from_light.vector(Vec3::Z).try_normalize();
        let strength = if self.solid_angle > 0.0 { (self.power / self.solid_angle) as f32 } else { 0.0 };
        match axis {
            // Only a transform that keeps angles keeps the cone.
            Some(axis) if keeps_angles(&self.world_from_light) => {
                LightBounds::cone(self.position, axis, self.throw.cos_corner() - 1e-5, strength)
            }
            _ => LightBounds::point(self.position, strength),
        }
    }
}
