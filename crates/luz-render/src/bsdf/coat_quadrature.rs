//! Numerical integrals of a dielectric interface, for the tables of a coat.

use std::f32::consts::TAU;

use glam::Vec3;

use super::{
    TrowbridgeReitz,
    coat_interface::{Averages, Directional, smooth},
    direction::{face_up, reflect, refract},
    fresnel,
};

/// Nodes over the polar coordinate of visible normals.
const POLAR: usize = 20;
/// Nodes over half a turn of their azimuth.
const AZIMUTHAL: usize = 16;
/// Nodes over the cosine of the base's light, and over its azimuth where the interface is anisotropic.
const COSINES: usize = 32;

/// How much of the light from the direction with cosine `cos` and azimuth `phi` the interface sends on to the base
/// behind a coat of `thickness`, and how much it reflects; single scattering on its microfacets.
pub(super) fn directional(distribution: &TrowbridgeReitz, eta: f32, thickness: f32, cos: f32, phi: f32) -> Directional {
    if distribution.effectively_smooth() || eta == 1.0 {
        return smooth(cos, eta, thickness);
    }
    // The limit at grazing angles, where a rough interface still transmits.
    let wo = direction(cos.max(1e-4), phi);
    let (mut transmittance, mut reflectance) = (0.0, 0.0);
    over_visible_normals(distribution, wo, phi, |wm, weight| {
        let f = fresnel::dielectric(wo.dot(wm), eta);
        let up = reflect(wo, wm);
        if up.z > 0.0 {
            reflectance += weight * f64::from(f * shadowing(distribution, wo, up));
        }
        if let Some((down, _)) = refract(wo, wm, eta)
            && down.z < 0.0
        {
            let reaches_base = (thickness / down.z).exp();
            transmittance += weight * f64::from((1.0 - f) * shadowing(distribution, wo, down) * reaches_base);
        }
    });
    Directional { transmittance: transmittance as f32, reflectance: reflectance as f32 }
}

/// The fraction of Lambertian light from the base that the interface reflects back to it, both ways attenuated.
pub(super) fn internal_reflectance(distribution: &TrowbridgeReitz, eta: f32, thickness: f32) -> f32 {
    if distribution.effectively_smooth() || eta == 1.0 {
        return smooth_internal_reflectance(eta, thickness);
    }
    let isotropic = distribution.alpha().x == distribution.alpha().y;
    let azimuths = if isotropic { 1 } else { 8 };
    let mut sum = 0.0;
    for (cos, cos_weight) in gauss_legendre::<COSINES>() {
        let up = 2.0 * cos * cos_weight * f64::from((-thickness / cos as f32).exp()) / f64::from(azimuths);
        for i in 0..azimuths {
            // A quarter turn holds all of an anisotropic interface.
            let phi = if isotropic { 0.0 } else { 0.25 * TAU * (i as f32 + 0.5) / azimuths as f32 };
            let wo = direction(-cos as f32, phi);
            over_visible_normals(distribution, wo, phi, |wm, weight| {
                let down = reflect(wo, wm);
                if down.z < 0.0 {
                    let f = fresnel::dielectric(wo.dot(face_up(wm)), eta);
                    let reaches_base = (thickness / down.z).exp();
                    sum += up * weight * f64::from(f * shadowing(distribution, wo, down) * reaches_base);
                }
            });
        }
    }
    sum as f32
}

/// Averages of a smooth interface over the hemisphere.
pub(super) fn smooth_averages(eta: f32, thickness: f32) -> Averages {
    let transmittance: f64 = gauss_legendre::<64>()
        .into_iter()
        .map(|(x, weight)| {
            let cos = x * x;
            4.0 * x * cos * weight * f64::from(smooth(cos as f32, eta, thickness).transmittance)
        })
        .sum();
    Averages { transmittance: transmittance as f32, internal_reflectance: smooth_internal_reflectance(eta, thickness) }
}

/// `2∫ F(−μ) exp(−2·thickness/μ) μ dμ`, split at the critical angle.
fn smooth_internal_reflectance(eta: f32, thickness: f32) -> f32 {
    let critical = (1.0 - 1.0 / (f64::from(eta) * f64::from(eta))).max(0.0).sqrt();
    let mut sum = 0.0;
    for (x, weight) in gauss_legendre::<64>() {
        // Below the critical cosine all is reflected; above it F falls like a square root, which x² resolves.
        let low = critical * x;
        let high = critical + (1.0 - critical) * x * x;
        for (cos, width) in [(low, critical), (high, (1.0 - critical) * 2.0 * x)] {
            if cos > 0.0 {
                let f = f64::from(fresnel::dielectric(-cos as f32, eta));
                sum += 2.0 * cos * f * (-2.0 * f64::from(thickness) / cos).exp() * width * weight;
            }
        }
    }
    sum as f32
}

/// Calls `f(wm, weight)` for normals spread over those visible from `wo`; the weights sum to one.
fn over_visible_normals(distribution: &TrowbridgeReitz, wo: Vec3, phi: f32, mut f: impl FnMut(Vec3, f64)) {
    // Where the plane of incidence is a plane of symmetry, half a turn tells all.
    let alpha = distribution.alpha();
    let symmetric = alpha.x == alpha.y && phi == 0.0;
    let (count, turn) = if symmetric { (AZIMUTHAL, 0.5 * TAU) } else { (2 * AZIMUTHAL, TAU) };
    let stretched = distribution.stretched(wo);
    for (polar, polar_weight) in gauss_legendre::<POLAR>() {
        let z = 1.0 - polar as f32 * (1.0 + stretched.z);
        for j in 0..count {
            let mirrored = direction(z, turn * (j as f32 + 0.5) / count as f32);
            f(distribution.visible_normal(wo, stretched, mirrored), polar_weight / count as f64);
        }
    }
}

/// `G(wo, wi)/G1(wo)`: the chance that light which met a microfacet visible from `wo` gets away along `wi`.
fn shadowing(distribution: &TrowbridgeReitz, wo: Vec3, wi: Vec3) -> f32 {
    distribution.g(wo, wi) / distribution.g1(wo)
}

fn direction(cos: f32, phi: f32) -> Vec3 {
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    Vec3::new(sin * phi.cos(), sin * phi.sin(), cos)
}

/// Nodes and weights of the Gauss–Legendre rule on `[0, 1]`; the weights sum to one.
pub(super) fn gauss_legendre<const N: usize>() -> [(f64, f64); N] {
    let n = N as f64;
    std::array::from_fn(|i| {
        // Newton's method on the Legendre polynomial, from Tricomi's estimate of its root.
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..8 {
            let (mut previous, mut p) = (1.0, x);
            for k in 2..=N {
                let k = k as f64;
                (previous, p) = (p, ((2.0 * k - 1.0) * x * p - (k - 1.0) * previous) / k);
            }
            slope = n * (x * p - previous) / (x * x - 1.0);
            x -= p / slope;
        }
        (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rule_integrates_polynomials() {
        for degree in 0..40 {
            let sum: f64 = gauss_legendre::<20>().iter().map(|(x, w)| w * x.powi(degree)).sum();
            assert!((sum - 1.0 / f64::from(degree + 1)).abs() < 1e-13, "degree {degree}: {sum}");
        }
    }
}
