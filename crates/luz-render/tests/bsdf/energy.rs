//! No BSDF makes light, and each reflects what an independent integral says.

use std::f64::consts::PI;

use glam::Vec3;
use luz_color::SampledSpectrum;
use luz_render::bsdf::{
    Bsdf, CoatInterface, CoatedDiffuse, Diffuse, DiffuseTransmission, ThinDielectric, TransportMode,
};
use luz_sample::test_support::integrate_rectangle;

use super::specimens::{Coats, MODES, coloured, dielectric, direction, ideal_conductor, outgoing, point};

const IMPORTANCE: TransportMode = TransportMode::Importance;

/// `∫ f·|cosθ_i| dwi` over the sphere, without specular lobes, by adaptive quadrature.
fn integrated_albedo(bsdf: &Bsdf, wo: Vec3) -> f64 {
    let integrand = |cos: f64, phi: f64| f64::from(bsdf.f(wo, direction(cos, phi), IMPORTANCE)[0]) * cos.abs();
    let half = |range: [f64; 2]| integrate_rectangle(&integrand, [range[0], range[1], -PI, PI], 1e-4, 4);
    half([-1.0, 0.0]) + half([0.0, 1.0])
}

/// The mean throughput of samples; quasi-Monte Carlo, to about 10⁻³.
fn sampled_albedo(bsdf: &Bsdf, wo: Vec3, with_specular: bool) -> f64 {
    const COUNT: u32 = 100_000;
    let mut sum = 0.0;
    for i in 0..COUNT {
        let (uc, u) = point(i);
        if let Some(s) = bsdf.sample(wo, uc, u, IMPORTANCE)
            && (with_specular || !s.flags.is_specular())
        {
            sum += f64::from(s.f[0] * s.wi.z.abs() / s.pdf);
        }
    }
    sum / f64::from(COUNT)
}

/// Directional albedo of an isotropic rough mirror, by a product rule over the slopes of its microfacets, from the
/// formulas of the literature: `∫ D(m)·G2(o, i)·(o·m)/cosθ_o dm` (Heitz 2014, eq. 15), with `D` and `Λ` of eq. 71, 72.
fn albedo_over_microfacets(alpha: f64, cos_o: f64) -> f64 {
    const RADII: usize = 600;
    const AZIMUTHS: usize = 400;
    let sin_o = (1.0 - cos_o * cos_o).sqrt();
    let lambda = |cos: f64| {
        let a = cos / (alpha * (1.0 - cos * cos).max(0.0).sqrt());
        0.5 * (-1.0 + (1.0 + 1.0 / (a * a)).sqrt())
    };
    let mut sum = 0.0;
    for i in 0..RADII {
        // Projected area is distributed by P22; its radial distribution function is inverted: tan²θ = α²·u/(1 − u).
        let u = (i as f64 + 0.5) / RADII as f64;
        let tan = alpha * (u / (1.0 - u)).sqrt();
        let cos_m = 1.0 / (1.0 + tan * tan).sqrt();
        for j in 0..AZIMUTHS {
            let phi = 2.0 * PI * (j as f64 + 0.5) / AZIMUTHS as f64;
            let m = [cos_m * tan * phi.cos(), cos_m * tan * phi.sin(), cos_m];
            let dot = sin_o * m[0] + cos_o * m[2];
            let cos_i = 2.0 * dot * m[2] - cos_o;
            if dot > 0.0 && cos_i > 0.0 {
                sum += dot / (cos_o * cos_m) / (1.0 + lambda(cos_o) + lambda(cos_i));
            }
        }
    }
    sum / (RADII * AZIMUTHS) as f64
}

/// Largest error of an albedo that the tests let pass.
const TOLERANCE: f64 = 4e-3;

#[test]
fn a_rough_mirror_agrees_with_an_integral_over_its_microfacets() {
    for alpha in [0.15, 0.4, 0.8] {
        for cos in [0.95, 0.5, 0.2] {
            let bsdf = ideal_conductor(alpha as f32, alpha as f32);
            let expected = albedo_over_microfacets(alpha, cos);
            let wo = direction(cos, 0.7);
            let agrees = |albedo: f64| (albedo / expected - 1.0).abs() < TOLERANCE;
            assert!(expected < 1.0);
            let (integrated, sampled) = (integrated_albedo(&bsdf, wo), sampled_albedo(&bsdf, wo, true));
            assert!(agrees(integrated), "alpha {alpha} cos {cos}: values {integrated}, expected {expected}");
            assert!(agrees(sampled), "alpha {alpha} cos {cos}: samples {sampled}, expected {expected}");
            // An error of 2 % in the BSDF is noticed.
            assert!(!agrees(1.02 * integrated) && !agrees(0.98 * integrated));
            assert!(!agrees(1.02 * sampled) && !agrees(0.98 * sampled));
        }
    }
}

#[test]
fn values_and_samples_have_the_same_albedo() {
    let coats = Coats::new();
    for (name, bsdf) in coats.densities() {
        if name.contains("0.03") || name.contains("0.05") || name.ends_with("diffuse 1") {
            continue; // Too sharp for the quadrature; the χ² test and `a_sample_agrees` cover them.
        }
        for wo in [direction(0.8, 0.4), direction(0.3, 2.0), direction(-0.6, 1.0)] {
            let (integrated, sampled) = (integrated_albedo(&bsdf, wo), sampled_albedo(&bsdf, wo, false));
            assert!((integrated - sampled).abs() < TOLERANCE, "{name} {wo}: {integrated} {sampled}");
        }
    }
}

#[test]
fn no_light_is_made() {
    let coats = Coats::new();
    let mut specimens = coats.all();
    specimens.push(("white".into(), Bsdf::Diffuse(Diffuse::new(SampledSpectrum::ONE))));
    for alpha in [0.0, 0.01, 0.3, 1.0] {
        specimens.push((format!("ideal conductor {alpha}"), ideal_conductor(alpha, alpha)));
    }
    for coat in &coats.0 {
        specimens.push(("white coated".into(), Bsdf::CoatedDiffuse(CoatedDiffuse::new(SampledSpectrum::ONE, coat))));
    }
    for (name, bsdf) in specimens {
        // Walks are noisy.
        let slack = if matches!(bsdf, Bsdf::Layered(_)) { 0.02 } else { 2e-3 };
        for wo in outgoing() {
            let albedo = sampled_albedo(&bsdf, wo, true);
            assert!((0.0..=1.0 + slack).contains(&albedo), "{name} {wo}: {albedo}");
            let estimate = bsdf.albedo(wo);
            assert!(estimate.is_finite() && estimate.min_component() >= 0.0 && estimate.max_component() <= 1.002);
        }
    }
}

#[test]
fn lambertian_furnaces_are_exact() {
    let white = Bsdf::Diffuse(Diffuse::new(SampledSpectrum::ONE));
    let both = DiffuseTransmission::new(SampledSpectrum::splat(0.25), SampledSpectrum::splat(0.75));
    for wo in outgoing() {
        for i in 0..1000 {
            let (uc, u) = point(i);
            for bsdf in [white, Bsdf::DiffuseTransmission(both)] {
                let s = bsdf.sample(wo, uc, u, TransportMode::Radiance).unwrap();
                assert!((s.f[0] * s.wi.z.abs() / s.pdf - 1.0).abs() < 1e-6, "{s:?}");
            }
        }
    }
}

#[test]
fn a_smooth_interface_loses_nothing() {
    let plate = Bsdf::ThinDielectric(ThinDielectric::new(1.5));
    for bsdf in [dielectric(0.0, 0.0, 1.5), dielectric(0.0, 0.0, 0.7), dielectric(0.3, 0.3, 1.0), plate] {
        for wo in outgoing() {
            for mode in MODES {
                let lobes =
                    [0.0, luz_sample::ONE_MINUS_EPSILON].map(|uc| bsdf.sample(wo, uc, point(3).1, mode).unwrap());
                for s in lobes {
                    assert!(s.flags.is_specular() && bsdf.is_specular());
                    // Radiance that crosses is scaled by the squared index of refraction, the energy is not.
                    let scale = if mode == IMPORTANCE { 1.0 } else { s.eta * s.eta };
                    assert!((s.f[0] * s.wi.z.abs() / s.pdf * scale - 1.0).abs() < 1e-5, "{wo}: {s:?}");
                }
                if lobes[0].flags != lobes[1].flags {
                    assert!((lobes[0].pdf + lobes[1].pdf - 1.0).abs() < 1e-6, "probabilities of the lobes: {lobes:?}");
                }
            }
        }
    }
}

#[test]
fn refraction_follows_snell() {
    for wo in outgoing() {
        let bsdf = dielectric(0.0, 0.0, 1.5);
        let s = bsdf.sample(wo, luz_sample::ONE_MINUS_EPSILON, point(0).1, IMPORTANCE).unwrap();
        if s.flags.is_transmission() {
            assert_eq!(s.eta, if wo.z > 0.0 { 1.5 } else { 1.0 / 1.5 });
            assert!((wo.truncate() + s.eta * s.wi.truncate()).length() < 1e-6);
        }
    }
}

#[test]
fn a_smooth_coat_over_white_loses_nothing() {
    for eta in [1.1, 1.5, 2.4] {
        let interface = CoatInterface::new(0.0, 0.0, eta, 0.0, 10_000);
        let bsdf = CoatedDiffuse::new(SampledSpectrum::ONE, &interface);
        for wo in outgoing() {
            let albedo = bsdf.albedo(wo)[0];
            assert!((albedo - 1.0).abs() < 1e-3, "eta {eta} {wo}: {albedo}");
        }
    }
}

#[test]
fn a_coat_of_no_density_is_not_there() {
    let interface = CoatInterface::new(0.2, 0.2, 1.0, 0.0, 1);
    let coated = CoatedDiffuse::new(coloured(0.5), &interface);
    let (wo, wi) = (direction(0.4, 0.0), direction(0.7, 1.0));
    let f = coated.evaluate(wo, wi).0[2];
    let expected = Diffuse::new(coloured(0.5)).evaluate(wo, wi).0[2];
    assert!((f / expected - 1.0).abs() < 1e-4, "{f} {expected}");
}
