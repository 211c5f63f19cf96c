//! The phase function of the scattering medium in a coat.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use luz_geometry::Frame;

/// The phase function of Henyey and Greenstein 1941, with mean cosine `g` in `(−1, 1)`: forward for `g > 0`.
#[derive(Clone, Copy, Debug)]
pub(super) struct HenyeyGreenstein {
    g: f32,
}

impl HenyeyGreenstein {
    pub fn new(g: f32) -> Self {
        Self { g: g.clamp(-0.99, 0.99) }
    }

    /// Its value, sr⁻¹, which is also the density in solid angle; `wo` and `wi` both point away from the point.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.pdf_of_cosine(-wo.dot(wi))
    }

    /// With the cosine of the angle of deflection.
    #[inline]
    fn pdf_of_cosine(&self, cos: f32) -> f32 {
        let g = self.g;
        let d = (1.0 + g * g - 2.0 * g * cos).max(1e-9);
        (1.0 - g * g) / (2.0 * TAU * d * d.sqrt())
    }

    /// A direction, with its density.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: Vec2) -> (Vec3, f32) {
        let g = self.g;
        let cos = if g.abs() < 1e-3 {
            1.0 - 2.0 * u.x
        } else {
            let s = (1.0 - g * g) / (1.0 - g + 2.0 * g * u.x);
            ((1.0 + g * g - s * s) / (2.0 * g)).clamp(-1.0, 1.0)
        };
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let (sin_phi, cos_phi) = (TAU * u.y).sin_cos();
        let wi = Frame::from_z(-wo).to_world(Vec3::new(sin * cos_phi, sin * sin_phi, cos));
        (wi, self.pdf_of_cosine(cos))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_cosine_is_g_and_the_density_integrates_to_one() {
        for g in [-0.7f32, -0.2, 0.0, 0.3, 0.8] {
            let phase = HenyeyGreenstein::new(g);
            let (mut integral, mut mean, mut sampled) = (0.0f64, 0.0f64, 0.0f64);
            const N: usize = 20_000;
            for i in 0..N {
                let cos = -1.0 + 2.0 * (i as f32 + 0.5) / N as f32;
                let p = f64::from(phase.pdf_of_cosine(cos)) * f64::from(TAU) * 2.0 / N as f64;
                integral += p;
                mean += p * f64::from(cos);
                let (wi, _) = phase.sample(Vec3::Z, Vec2::new((i as f32 + 0.5) / N as f32, 0.3));
                sampled += f64::from(-wi.z) / N as f64;
            }
            assert!((integral - 1.0).abs() < 1e-4, "g {g}: {integral}");
            assert!((mean - f64::from(g)).abs() < 1e-4, "g {g}: {mean}");
            assert!((sampled - f64::from(g)).abs() < 1e-3, "g {g}: {sampled}");
        }
    }

    #[test]
    fn the_density_of_a_sample_is_the_density_of_its_direction() {
        let phase = HenyeyGreenstein::new(0.6);
        let wo = Vec3::new(0.6, 0.0, -0.8);
        let (wi, pdf) = phase.sample(wo, Vec2::new(0.3, 0.7));
        assert!((pdf / phase.pdf(wo, wi) - 1.0).abs() < 1e-4);
    }
}
