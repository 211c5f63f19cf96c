//! Numerical integrals of a dielectric interface, for the tables of a coat.

use std::{
    f32::consts::{FRAC_1_PI, TAU},
    f64::consts::PI,
    sync::LazyLock,
};

use glam::Vec3;

use super::{
    Dielectric, TrowbridgeReitz,
    coat_interface::{Averages, Directional, smooth},
    direction::{face_up, reflect, refract},
    fresnel,
    layered::mis_weight,
};

/// Where the integrands are looked at.
pub(super) struct Rule {
    /// Polar coordinates of visible normals in `[0, 1]`, and weights.
    polar: Vec<(f64, f64)>,
    /// Azimuths of visible normals in half a turn.
    azimuths: usize,
    /// Cosines of the base's light on either side of the critical angle, as fractions of their range, and weights.
    cosines: Vec<(f64, f64)>,
}

impl Rule {
    fn new(polar: usize, azimuths: usize, cosines: usize) -> Self {
        // Normals far out in the tails are at the end of the polar coordinate, where the substitution looks closely.
        let polar = gauss_legendre(polar).into_iter().map(|(x, w)| (1.0 - (1.0 - x) * (1.0 - x), 2.0 * (1.0 - x) * w));
        Self { polar: polar.collect(), azimuths, cosines: gauss_legendre(cosines) }
    }

    /// The rule of the tables: transmittances within 10⁻³ of the truth, and reflectances within 10⁻³ of all the light.
    pub fn table() -> &'static Self {
        static RULE: LazyLock<Rule> = LazyLock::new(|| Rule::new(20, 16, 12));
        &RULE
    }

    /// Calls `f(wm, weight)` for normals spread over those visible from `wo`; the weights sum to one.
    fn over_visible_normals(&self, distribution: &TrowbridgeReitz, wo: Vec3, phi: f32, mut f: impl FnMut(Vec3, f64)) {
        // Where the plane of incidence is a plane of symmetry, half a turn tells all.
        let alpha = distribution.alpha();
        let symmetric = alpha.x == alpha.y && phi == 0.0;
        let (count, turn) = if symmetric { (self.azimuths, 0.5 * TAU) } else { (2 * self.azimuths, TAU) };
        let stretched = distribution.stretched(wo);
        for j in 0..count {
            let (sin_phi, cos_phi) = (turn * (j as f32 + 0.5) / count as f32).sin_cos();
            for &(polar, weight) in &self.polar {
                let z = 1.0 - polar as f32 * (1.0 + stretched.z);
                let r = (1.0 - z * z).max(0.0).sqrt();
                let mirrored = Vec3::new(r * cos_phi, r * sin_phi, z);
                f(distribution.visible_normal(wo, stretched, mirrored), weight / count as f64);
            }
        }
    }
}

/// Averages of the interface above a coat of `thickness` for the direction with cosine `cos` and azimuth `phi`; single
/// scattering on its microfacets.
pub(super) fn directional(
    rule: &Rule,
    distribution: &TrowbridgeReitz,
    eta: f32,
    thickness: f32,
    cos: f32,
    phi: f32,
) -> Directional {
    let interface = Dielectric::new(*distribution, eta);
    if interface.is_specular() {
        return smooth(cos, eta, thickness);
    }
    // The limit at grazing angles, where a rough interface still transmits.
    let wo = direction(cos.max(1e-4), phi);
    let (mut transmittance, mut reflectance) = (0.0, 0.0);
    let (mut by_light, mut by_base, mut enters) = (0.0, 0.0, 0.0);
    rule.over_visible_normals(distribution, wo, phi, |wm, weight| {
        let f = fresnel::dielectric(wo.dot(wm), eta);
        let up = reflect(wo, wm);
        if up.z > 0.0 {
            reflectance += weight * f64::from(f * shadowing(distribution, wo, up));
        }
        if let Some((down, _)) = refract(wo, wm, eta)
            && down.z < 0.0
        {
            let reaches_base = (thickness / down.z).exp();
            let transmitted = weight * f64::from((1.0 - f) * shadowing(distribution, wo, down) * reaches_base);
            transmittance += transmitted;
            enters += weight;
            // The densities that pbrt-v4 compares, see `CoatWeights::PbrtV4`.
            let [inwards, outwards] = interface.transmission_densities(wo, down, wm);
            let base = -down.z * FRAC_1_PI;
            by_light += transmitted * f64::from(mis_weight(inwards, base));
            by_base += transmitted * f64::from(mis_weight(base, outwards));
        }
    });
    Directional {
        transmittance: transmittance as f32,
        reflectance: reflectance as f32,
        emergence: (by_light + enters * by_base) as f32,
    }
}

/// The fraction of Lambertian light from the base that the interface reflects back to it, both ways attenuated.
pub(super) fn internal_reflectance(rule: &Rule, distribution: &TrowbridgeReitz, eta: f32, thickness: f32) -> f32 {
    if distribution.effectively_smooth() || eta == 1.0 {
        return smooth_internal_reflectance(eta, thickness);
    }
    let isotropic = distribution.alpha().x == distribution.alpha().y;
    let azimuths = if isotropic { 1 } else { 6 };
    let mut sum = 0.0;
    let critical = critical_cosine(eta);
    let below = rule.cosines.iter().map(|&(x, w)| (critical * x, critical * w));
    let above = rule.cosines.iter().map(|&(x, w)| (critical + (1.0 - critical) * x, (1.0 - critical) * w));
    for (cos, cos_weight) in below.chain(above).filter(|&(cos, _)| cos > 0.0) {
        let up = 2.0 * cos * cos_weight * f64::from((-thickness / cos as f32).exp()) / f64::from(azimuths);
        for i in 0..azimuths {
            // A quarter turn holds all of an anisotropic interface.
            let phi = if isotropic { 0.0 } else { 0.25 * TAU * (i as f32 + 0.5) / azimuths as f32 };
            let wo = direction(-cos as f32, phi);
            rule.over_visible_normals(distribution, wo, phi, |wm, weight| {
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
    let transmittance: f64 = gauss_legendre(64)
        .into_iter()
        .map(|(x, weight)| {
            let cos = x * x;
            4.0 * x * cos * weight * f64::from(smooth(cos as f32, eta, thickness).transmittance)
        })
        .sum();
    Averages { transmittance: transmittance as f32, internal_reflectance: smooth_internal_reflectance(eta, thickness) }
}

/// The cosine inside below which all light is reflected; zero where there is none.
fn critical_cosine(eta: f32) -> f64 {
    (1.0 - 1.0 / (f64::from(eta) * f64::from(eta))).max(0.0).sqrt()
}

/// `2∫ F(−μ) exp(−2·thickness/μ) μ dμ`, split at the critical angle.
fn smooth_internal_reflectance(eta: f32, thickness: f32) -> f32 {
    let critical = critical_cosine(eta);
    let mut sum = 0.0;
    for (x, weight) in gauss_legendre(64) {
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

/// `G(wo, wi)/G1(wo)`: the chance that light which met a microfacet visible from `wo` gets away along `wi`.
fn shadowing(distribution: &TrowbridgeReitz, wo: Vec3, wi: Vec3) -> f32 {
    distribution.g(wo, wi) / distribution.g1(wo)
}

fn direction(cos: f32, phi: f32) -> Vec3 {
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    Vec3::new(sin * phi.cos(), sin * phi.sin(), cos)
}

/// The `count` nodes and weights of the Gauss–Legendre rule on `[0, 1]`; the weights sum to one.
fn gauss_legendre(count: usize) -> Vec<(f64, f64)> {
    let n = count as f64;
    let node = |i: usize| {
        // Newton's method on the Legendre polynomial, from Tricomi's estimate of its root.
        let mut x = (PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..8 {
            let (mut previous, mut p) = (1.0, x);
            for k in 2..=count {
                let k = k as f64;
                (previous, p) = (p, ((2.0 * k - 1.0) * x * p - (k - 1.0) * previous) / k);
            }
            slope = n * (x * p - previous) / (x * x - 1.0);
            x -= p / slope;
        }
        (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..count).map(node).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rule_integrates_polynomials() {
        for degree in 0..40 {
            let sum: f64 = gauss_legendre(20).iter().map(|(x, w)| w * x.powi(degree)).sum();
            assert!((sum - 1.0 / f64::from(degree + 1)).abs() < 1e-13, "degree {degree}: {sum}");
        }
    }

    #[test]
    fn the_rule_of_the_tables_is_fine_enough() {
        let (table, fine) = (Rule::table(), Rule::new(64, 64, 32));
        for alpha in [0.01, 0.07, 0.3, 0.7, 1.0] {
            let d = TrowbridgeReitz::new(alpha, alpha);
            for eta in [1.3, 1.8] {
                let near = |a: f32, b: f32, scale: f32, what: &str| {
                    assert!((a - b).abs() < 1e-3 * scale, "alpha {alpha}, eta {eta}, {what}: {a} {b}");
                };
                for cos in [0.02, 0.2, 0.5, 0.9] {
                    let [a, b] = [table, &fine].map(|rule| directional(rule, &d, eta, 0.01, cos, 0.0));
                    near(a.transmittance, b.transmittance, b.transmittance, "transmittance");
                    near(a.emergence, b.emergence, b.emergence, "emergence");
                    near(a.reflectance, b.reflectance, 1.0, "reflectance");
                }
                let [a, b] = [table, &fine].map(|rule| internal_reflectance(rule, &d, eta, 0.01));
                near(a, b, 1.0, "internal reflectance");
            }
        }
    }

    #[test]
    fn a_vanishing_roughness_is_smooth() {
        let d = TrowbridgeReitz::new(2e-3, 2e-3);
        for eta in [1.5, 0.75] {
            for cos in [0.1, 0.5, 0.9] {
                let a = directional(Rule::table(), &d, eta, 0.01, cos, 0.0);
                let b = smooth(cos, eta, 0.01);
                assert!((a.transmittance - b.transmittance).abs() < 1e-3, "{eta} {cos}: {a:?} {b:?}");
                assert!((a.reflectance - b.reflectance).abs() < 1e-3, "{eta} {cos}: {a:?} {b:?}");
            }
            let (a, b) = (internal_reflectance(Rule::table(), &d, eta, 0.01), smooth_internal_reflectance(eta, 0.01));
            assert!((a - b).abs() < 1e-3, "{eta}: {a} {b}");
        }
    }
}
