//! `sample` and `pdf` are one distribution.

use std::cell::Cell;

use glam::Vec3;
use luz_render::bsdf::{Bsdf, TransportMode};
use luz_sample::{
    Samples,
    random::Random,
    test_support::{Chi2Result, chi2_sphere, sidak},
};

use super::specimens::{Coats, MODES, conductor, outgoing, point};

/// Probability that any of a test's comparisons fails although all is right.
const SIGNIFICANCE: f64 = 0.01;
/// Samples of each χ² test.
const SAMPLES: u64 = 100_000;

/// Holds the non-specular samples of a BSDF against a density.
fn chi_square(bsdf: &Bsdf, wo: Vec3, pdf: impl Fn(Vec3) -> f64) -> Chi2Result {
    let lobes = Cell::new(Random::new(11, 1, 0));
    let sample = |u| {
        let mut random = lobes.get();
        let uc = random.next_1d();
        lobes.set(random);
        let sample = bsdf.sample(wo, uc, u, TransportMode::Radiance)?;
        (!sample.flags.is_specular()).then_some(sample.wi)
    };
    chi2_sphere(sample, pdf, SAMPLES, 3)
}

#[test]
fn samples_follow_the_density() {
    let coats = Coats::new();
    let specimens = coats.densities();
    let directions = outgoing();
    let significance = sidak(SIGNIFICANCE, specimens.len() * directions.len());
    let mut failures = Vec::new();
    for (name, bsdf) in &specimens {
        for &wo in &directions {
            let result = chi_square(bsdf, wo, |wi| f64::from(bsdf.pdf(wo, wi, TransportMode::Radiance)));
            if !result.passes(significance) {
                failures.push(format!("{name}, wo {wo}: {result:?}"));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn a_wrong_density_is_rejected() {
    let wo = outgoing()[1];
    let bsdf = conductor(0.2, 0.2);
    let rougher = conductor(0.21, 0.21);
    let pdf = |bsdf: &Bsdf, wi| f64::from(bsdf.pdf(wo, wi, TransportMode::Radiance));
    assert!(chi_square(&bsdf, wo, |wi| pdf(&bsdf, wi)).passes(SIGNIFICANCE));
    assert!(!chi_square(&bsdf, wo, |wi| pdf(&rougher, wi)).passes(1e-6), "wrong shape");
    assert!(!chi_square(&bsdf, wo, |wi| 1.02 * pdf(&bsdf, wi)).passes(1e-6), "wrong scale");
}

#[test]
fn a_sample_agrees_with_value_and_density() {
    let coats = Coats::new();
    for (name, bsdf) in coats.all() {
        for wo in outgoing() {
            for mode in MODES {
                for i in 0..200 {
                    let (uc, u) = point(i);
                    let Some(s) = bsdf.sample(wo, uc, u, mode) else { continue };
                    assert!(s.pdf > 0.0 && s.f.is_finite(), "{name} {wo}: {s:?}");
                    assert!((s.wi.length() - 1.0).abs() < 1e-5, "{name} {wo}: {s:?}");
                    assert_eq!(s.flags.is_reflection(), wo.z * s.wi.z > 0.0, "{name} {wo}: {s:?}");
                    assert!(bsdf.flags().contains(s.flags) || s.pdf_is_proportional, "{name} {wo}: {s:?}");
                    let (f, pdf) = bsdf.evaluate(wo, s.wi, mode);
                    assert_eq!((f, pdf), (bsdf.f(wo, s.wi, mode), bsdf.pdf(wo, s.wi, mode)), "{name} {wo}");
                    if s.flags.is_specular() || s.pdf_is_proportional {
                        continue;
                    }
                    // The half vector of nearly opposite directions is only known to some digits.
                    let near = |a: f32, b: f32| (a - b).abs() <= 5e-3 * a.abs().max(b.abs()) + 1e-6;
                    assert!(near(pdf, s.pdf), "{name} {wo} {mode:?} {i}: {pdf} {s:?}");
                    for (a, b) in f.0.into_iter().zip(s.f.0) {
                        assert!(near(a, b), "{name} {wo} {mode:?} {i}: {f:?} {s:?}");
                    }
                }
            }
        }
    }
}
