//! The closed form of the coated Lambertian base is the expectation of the random walk, and the walk's two estimators,
//! its values and its samples, are estimates of one BSDF.

use std::f32::consts::PI;

use glam::Vec3;
use luz_color::SampledSpectrum;
use luz_render::bsdf::{
    Base, Bsdf, CoatInterface, CoatWeights, CoatedDiffuse, Dielectric, Diffuse, Layered, TransportMode, TrowbridgeReitz,
};
use luz_sample::{
    Samples,
    random::Random,
    test_support::{mean_z_test, sidak},
    warp,
};

use super::specimens::{clear, coloured, direction, layered_conductor, layered_diffuse, milky};

/// Probability that any of a test's comparisons fails although all is right.
const SIGNIFICANCE: f64 = 0.01;

/// The mean of batches, and its squared standard error.
fn mean_of(batches: u64, mut batch: impl FnMut(u64) -> f64) -> (f64, f64) {
    let values: Vec<f64> = (0..batches).map(&mut batch).collect();
    let mean = values.iter().sum::<f64>() / batches as f64;
    let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (batches - 1) as f64;
    (mean, variance / batches as f64)
}

/// Pairs of directions, from the normal to grazing, in and out of the plane of incidence, above and below.
fn pairs() -> [(Vec3, Vec3); 6] {
    [
        (direction(0.9, 0.0), direction(0.5, 2.0)),
        (direction(0.5, 2.0), direction(0.9, 0.0)),
        (direction(0.2, 0.0), direction(0.7, 3.1)),
        (direction(0.6, 0.0), direction(0.1, 1.0)),
        (direction(1.0, 0.0), direction(0.95, 0.0)),
        (direction(-0.8, 1.0), direction(-0.4, -1.0)),
    ]
}

/// A coat of the given roughness, and its closed form's and its walk's parameters.
struct Coat {
    alpha: f32,
    eta: f32,
    reflectance: f32,
    thickness: f32,
    max_depth: u32,
}

impl Coat {
    fn interface(&self, weights: CoatWeights) -> CoatInterface {
        CoatInterface::new(self.alpha, self.alpha, self.eta, self.thickness, self.max_depth).with_weights(weights)
    }

    fn walks(&self, weights: CoatWeights, walks: u32, seed: u64) -> Layered {
        let top = Dielectric::new(TrowbridgeReitz::new(self.alpha, self.alpha), self.eta);
        let base = Base::Diffuse(Diffuse::new(SampledSpectrum::splat(self.reflectance)));
        Layered::new(top, base, clear(self.thickness), self.max_depth, walks, seed).with_weights(weights)
    }

    /// p-value of the closed form `interface` being the mean of the walks.
    fn compare(&self, interface: &CoatInterface, weights: CoatWeights, wo: Vec3, wi: Vec3) -> f64 {
        let closed = CoatedDiffuse::new(SampledSpectrum::splat(self.reflectance), interface).evaluate(wo, wi).0[0];
        let (mean, error) = mean_of(100, |seed| {
            f64::from(self.walks(weights, 300, seed).evaluate(wo, wi, TransportMode::Radiance).0[0])
        });
        mean_z_test(mean, error, f64::from(closed), 0.0)
    }
}

/// Every roughness with different reflectances, indices of refraction, thicknesses and depths.
fn coats() -> Vec<Coat> {
    let coat = |roughness: f32, eta, reflectance, thickness, max_depth| Coat {
        alpha: roughness.sqrt(),
        eta,
        reflectance,
        thickness,
        max_depth,
    };
    vec![
        coat(0.0, 1.5, 0.5, 0.01, 10),
        coat(0.0, 1.8, 0.9, 0.2, 3),
        coat(0.005, 1.3, 0.9, 0.01, 10),
        coat(0.005, 1.8, 0.07, 0.01, 10),
        coat(0.02, 1.5, 0.5, 0.01, 4),
        coat(0.15, 1.5, 0.5, 0.01, 10),
        coat(0.15, 1.8, 0.9, 0.1, 30),
        coat(0.5, 1.3, 0.07, 0.01, 10),
        coat(0.5, 1.5, 0.9, 0.01, 10),
    ]
}

fn closed_form_is_the_expectation(weights: CoatWeights) {
    let significance = sidak(SIGNIFICANCE, coats().len() * pairs().len());
    for coat in coats() {
        let interface = coat.interface(weights);
        for (wo, wi) in pairs() {
            let p = coat.compare(&interface, weights, wo, wi);
            assert!(p >= significance, "alpha {} eta {}: {wo} {wi}: p {p}", coat.alpha, coat.eta);
        }
    }
}

#[test]
fn the_closed_form_is_the_expectation_of_the_walk() {
    closed_form_is_the_expectation(CoatWeights::Exact);
}

#[test]
fn the_closed_form_is_the_expectation_of_pbrts_walk() {
    closed_form_is_the_expectation(CoatWeights::PbrtV4);
}

#[test]
fn a_wrong_closed_form_is_rejected() {
    let coat = Coat { alpha: 0.15f32.sqrt(), eta: 1.5, reflectance: 0.5, thickness: 0.01, max_depth: 10 };
    let rejected = |interface: CoatInterface| {
        pairs().iter().any(|&(wo, wi)| coat.compare(&interface, CoatWeights::Exact, wo, wi) < 1e-6)
    };
    assert!(!rejected(coat.interface(CoatWeights::Exact)));
    assert!(rejected(Coat { thickness: 0.02, ..coat }.interface(CoatWeights::Exact)), "too thick");
    assert!(rejected(Coat { eta: 1.52, ..coat }.interface(CoatWeights::Exact)), "too dense");
    assert!(rejected(coat.interface(CoatWeights::PbrtV4)), "other weights");
}

#[test]
fn anisotropic_tables_are_the_expectation_of_the_walk() {
    let significance = sidak(SIGNIFICANCE, 12);
    let (x, y) = (0.1, 0.5);
    let interface = CoatInterface::new(x, y, 1.5, 0.01, 10);
    let closed = CoatedDiffuse::new(SampledSpectrum::splat(0.6), &interface);
    let top = Dielectric::new(TrowbridgeReitz::new(x, y), 1.5);
    let base = Base::Diffuse(Diffuse::new(SampledSpectrum::splat(0.6)));
    for phi in [0.0, 0.5, 1.2, PI / 2.0] {
        for (cos_o, cos_i) in [(0.9, 0.3), (0.3, 0.6), (0.1, 0.9)] {
            let (wo, wi) = (direction(cos_o, f64::from(phi)), direction(cos_i, f64::from(phi) + 2.5));
            let (mean, error) = mean_of(100, |seed| {
                let walk = Layered::new(top, base, clear(0.01), 10, 300, seed);
                f64::from(walk.evaluate(wo, wi, TransportMode::Importance).0[0])
            });
            let p = mean_z_test(mean, error, f64::from(closed.evaluate(wo, wi).0[0]), 0.0);
            assert!(p >= significance, "{wo} {wi}: {mean} {p}");
        }
    }
}

#[test]
fn textured_tables_agree_with_those_of_one_roughness() {
    let textured = CoatInterface::textured(1.5, 0.01, 10);
    for alpha in [0.0, 0.02, 0.1, 0.27, 0.5, 0.9] {
        let constant = CoatInterface::new(alpha, alpha, 1.5, 0.01, 10);
        let a = CoatedDiffuse::textured(coloured(0.6), &textured, alpha, alpha);
        let b = CoatedDiffuse::new(coloured(0.6), &constant);
        for (wo, wi) in pairs() {
            let (f, g) = (a.evaluate(wo, wi).0[3], b.evaluate(wo, wi).0[3]);
            // Between the first two rows, a mirror and `alpha` 1/32, grazing angles change fast.
            let tolerance = if alpha > 0.0 && alpha < 0.05 && wo.z.abs().min(wi.z.abs()) < 0.3 { 0.03 } else { 3e-3 };
            assert!((f / g - 1.0).abs() < tolerance, "alpha {alpha} {wo} {wi}: {f} {g}");
        }
    }
}

/// Moments of the reflected light: `∫ f·|cosθ_i|·h(wi) dwi` for three `h`.
fn moments(wi: Vec3) -> [f64; 3] {
    let (x, z) = (f64::from(wi.x), f64::from(wi.z).abs());
    [1.0, z, x * x]
}

/// Moments of the non-specular part from values at cosine-distributed directions, and from samples.
fn moments_of(bsdf: &Bsdf, wo: Vec3, of: usize, seed: u64, from_values: bool) -> f64 {
    const BATCH: u64 = 500;
    let mut sum = 0.0;
    for i in 0..BATCH {
        let mut random = Random::new(seed, u64::from(from_values), i);
        let (uc, u) = (random.next_1d(), random.next_2d());
        if from_values {
            let wi = warp::cosine_hemisphere(u) * 1f32.copysign(wo.z);
            let f = bsdf.f(wo, wi, TransportMode::Radiance)[2];
            sum += f64::from(f * PI) * moments(wi)[of];
        } else if let Some(s) = bsdf.sample(wo, uc, u, TransportMode::Radiance)
            && !s.flags.is_specular()
        {
            sum += f64::from(s.f[2] * s.wi.z.abs() / s.pdf) * moments(s.wi)[of];
        }
    }
    sum / BATCH as f64
}

#[test]
fn values_and_samples_of_walks_have_the_same_moments() {
    let mut specimens = vec![
        ("clear over diffuse", layered_diffuse(coloured(0.7), 0.3, 1.5, clear(0.1))),
        ("smooth clear over diffuse", layered_diffuse(coloured(0.7), 0.0, 1.5, clear(0.1))),
    ];
    for (top, base) in [(0.0, 0.4), (0.4, 0.0), (0.3, 0.3)] {
        specimens.push(("clear over metal", layered_conductor(top, base, clear(0.05))));
        specimens.push(("milky over metal", layered_conductor(top, base, milky(0.5, 0.9, 0.4))));
    }
    specimens.push(("milky over diffuse", layered_diffuse(coloured(0.5), 0.4, 1.3, milky(1.0, 0.9, -0.5))));
    specimens.push(("smooth milky over diffuse", layered_diffuse(coloured(0.5), 0.0, 1.5, milky(1.0, 0.9, 0.7))));
    let directions = [direction(0.9, 0.3), direction(-0.35, 2.0)];
    let significance = sidak(SIGNIFICANCE, specimens.len() * directions.len() * 3);
    for (name, bsdf) in specimens {
        let bsdf = Bsdf::Layered(bsdf);
        for wo in directions {
            for of in 0..3 {
                let (a, error_a) = mean_of(60, |seed| moments_of(&bsdf, wo, of, seed, true));
                let (b, error_b) = mean_of(60, |seed| moments_of(&bsdf, wo, of, seed, false));
                let p = mean_z_test(a, error_a, b, error_b);
                assert!(p >= significance, "{name} {wo} moment {of}: {a} {b} p {p}");
            }
        }
    }
}

#[test]
fn values_of_walks_are_fixed_by_seed_and_directions() {
    let (wo, wi) = pairs()[0];
    let value = |seed| {
        let top = Dielectric::new(TrowbridgeReitz::new(0.2, 0.2), 1.5);
        let base = Base::Diffuse(Diffuse::new(coloured(0.5)));
        Layered::new(top, base, milky(0.3, 0.5, 0.0), 10, 1, seed).evaluate(wo, wi, TransportMode::Radiance)
    };
    assert_eq!(value(1), value(1));
    assert_ne!(value(1), value(2));
}

#[test]
fn regularising_a_coat_roughens_it() {
    let interface = CoatInterface::new(0.0, 0.0, 1.5, 0.01, 10);
    let mut bsdf = Bsdf::CoatedDiffuse(CoatedDiffuse::new(coloured(0.5), &interface));
    assert!(bsdf.flags().is_specular());
    bsdf.regularize();
    assert!(!bsdf.flags().is_specular());
    let rough = CoatInterface::new(0.1, 0.1, 1.5, 0.01, 10);
    let expected = CoatedDiffuse::new(coloured(0.5), &rough);
    for (wo, wi) in pairs() {
        assert_eq!(bsdf.evaluate(wo, wi, TransportMode::Radiance), expected.evaluate(wo, wi));
    }
}
