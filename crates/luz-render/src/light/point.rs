//! Lights without extent.

use super::{LightBounds, LightSample, ScaledSpectrum, Target};
use glam::{Vec2, Vec3};
use luz_color::Wavelengths;
use luz_geometry::Frame;
use std::f64::consts::TAU;

/// A point that radiates evenly: intensity in W·sr⁻¹·nm⁻¹.
#[derive(Clone, Debug)]
pub struct PointLight {
    /// World-space position.
    pub position: Vec3,
    /// Radiant intensity.
    pub intensity: ScaledSpectrum,
}

impl PointLight {
    /// The light that arrives at `reference`: I / r².
    pub fn sample(&self, reference: Vec3, wavelengths: &Wavelengths) -> Option<LightSample> {
        from_point(self.position, &self.intensity, reference, wavelengths, |_| 1.0)
    }

    /// Where the light is and how it shines.
    pub fn bounds(&self) -> LightBounds {
        LightBounds::point(self.position, self.intensity.weight() as f32)
    }

    /// 4π I.
    pub fn power(&self) -> f64 {
        2.0 * TAU * self.intensity.weight()
    }
}

/// A point that radiates into a cone with a soft border.
#[derive(Clone, Debug)]
pub struct SpotLight {
    /// World-space position.
    pub position: Vec3,
    /// Unit axis of the cone.
    pub axis: Vec3,
    /// Radiant intensity along the axis.
    pub intensity: ScaledSpectrum,
    /// Cosine of the angle at which the intensity reaches zero.
    pub cos_total: f32,
    /// Cosine of the angle from which on it falls.
    pub cos_falloff: f32,
}

impl SpotLight {
    /// The light that arrives at `reference`.
    pub fn sample(&self, reference: Vec3, wavelengths: &Wavelengths) -> Option<LightSample> {
        from_point(self.position, &self.intensity, reference, wavelengths, |to_light| {
            self.falloff(-self.axis.dot(to_light))
        })
    }

    /// The share of the axial intensity at an angle to the axis: a smooth step between the two cosines.
    pub fn falloff(&self, cos_theta: f32) -> f32 {
        if self.cos_falloff <= self.cos_total {
            return if cos_theta >= self.cos_total { 1.0 } else { 0.0 };
        }
        let t = ((cos_theta - self.cos_total) / (self.cos_falloff - self.cos_total)).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    }

    /// Draws a direction in which light leaves, in proportion to the intensity, and its density in solid angle.
    pub fn sample_direction(&self, u: Vec2) -> Option<(Vec3, f32)> {
        let core = self.core();
        let share = core / self.whole();
        let one_minus_cos = if u.x < share {
            u.x / share * core
        } else {
            let t = smooth_step_quantile((u.x - share) / (1.0 - share));
            (1.0 - self.cos_total) - t * (self.cos_falloff - self.cos_total)
        };
        let sin = (one_minus_cos * (2.0 - one_minus_cos)).max(0.0).sqrt();
        let (sin_phi, cos_phi) = (u.y * std::f32::consts::TAU).sin_cos();
        let local = Vec3::new(sin * cos_phi, sin * sin_phi, 1.0 - one_minus_cos);
        let direction = Frame::from_z(self.axis).to_world(local);
        Some((direction, self.direction_pdf(direction)))
    }

    /// The density of [`sample_direction`](Self::sample_direction), in solid angle.
    pub fn direction_pdf(&self, direction: Vec3) -> f32 {
        let pdf = self.falloff(self.axis.dot(direction)) / (std::f32::consts::TAU * self.whole());
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    /// The integral of the falloff over the part of the cone where it is one, by 2π.
    fn core(&self) -> f32 {
        1.0 - self.cos_falloff.max(self.cos_total)
    }

    /// The integral of the falloff over the cone, by 2π: the smooth step averages ½.
    fn whole(&self) -> f32 {
        self.core() + 0.5 * (self.cos_falloff - self.cos_total).max(0.0)
    }

    /// Where the light is and how it shines.
    pub fn bounds(&self) -> LightBounds {
        LightBounds::cone(self.position, self.axis, self.cos_total, self.intensity.weight() as f32)
    }

    /// ∫ I dω: the full cone, and half of the border, over which the smooth step averages ½.
    pub fn power(&self) -> f64 {
        let (total, falloff) = (f64::from(self.cos_total), f64::from(self.cos_falloff));
        TAU * self.intensity.weight() * ((1.0 - falloff) + 0.5 * (falloff - total))
    }
}

/// The `t ∈ [0, 1]` up to which the smooth step `3t² − 2t³` has the fraction `u` of its integral: `2t³ − t⁴ = u`.
fn smooth_step_quantile(u: f32) -> f32 {
    let u = f64::from(u);
    let (mut low, mut high) = (0.0, 1.0);
    // Newton's method, kept within what is known.
    let mut t = u.cbrt() * 0.8;
    for _ in 0..24 {
        let off = t * t * t * (2.0 - t) - u;
        if off > 0.0 {
            high = t
        } else {
            low = t
        }
        let next = t - off / (t * t * (6.0 - 4.0 * t));
        let next = if next > low && next < high { next } else { 0.5 * (low + high) };
        if (next - t).abs() < 1e-9 {
            return next as f32;
        }
        t = next;
    }
    t as f32
}

pub(super) fn from_point(
    position: Vec3,
    intensity: &ScaledSpectrum,
    reference: Vec3,
    wavelengths: &Wavelengths,
    falloff: impl Fn(Vec3) -> f32,
) -> Option<LightSample> {
    let to_light = position - reference;
    let distance_squared = to_light.length_squared();
    if distance_squared == 0.0 || !distance_squared.is_finite() {
        return None;
    }
    let direction = to_light / distance_squared.sqrt();
    let factor = falloff(direction);
    (factor > 0.0).then(|| LightSample {
        radiance: intensity.sample(wavelengths) * (factor / distance_squared),
        direction,
        target: Target::Point(position),
        pdf: 1.0,
        is_delta: true,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use luz_color::Spectrum;

    fn spot() -> SpotLight {
        SpotLight {
            position: Vec3::ZERO,
            axis: Vec3::Z,
            intensity: ScaledSpectrum { spectrum: Spectrum::Constant(1.0), scale: 2.0 },
            cos_total: 0.8,
            cos_falloff: 0.9,
        }
    }

    #[test]
    fn the_cone_fades_from_its_core_to_its_border() {
        let spot = spot();
        assert_eq!([spot.falloff(1.0), spot.falloff(0.9), spot.falloff(0.8), spot.falloff(0.0)], [1.0, 1.0, 0.0, 0.0]);
        assert!((spot.falloff(0.85) - 0.5).abs() < 1e-5);
    }

    #[test]
    fn intensity_falls_with_the_square_of_the_distance() {
        let wavelengths = Wavelengths::sample_uniform(0.3);
        let near = spot().sample(Vec3::new(0.0, 0.0, 1.0), &wavelengths).map(|s| s.radiance[0]);
        let far = spot().sample(Vec3::new(0.0, 0.0, 4.0), &wavelengths).map(|s| s.radiance[0]);
        assert_eq!((near, far), (Some(2.0), Some(0.125)));
        assert!(spot().sample(Vec3::new(0.0, 0.0, -1.0), &wavelengths).is_none());
        assert!(spot().sample(Vec3::ZERO, &wavelengths).is_none());
    }

    #[test]
    fn power_is_the_integral_of_the_intensity() {
        let spot = spot();
        let n = 200_000;
        let integral: f64 = (0..n)
            .map(|i| f64::from(spot.falloff(1.0 - 2.0 * (i as f32 + 0.5) / n as f32)) * 2.0 * TAU / f64::from(n))
            .sum();
        assert!((spot.power() / spot.intensity.weight() - integral).abs() < 1e-3);
    }
}
