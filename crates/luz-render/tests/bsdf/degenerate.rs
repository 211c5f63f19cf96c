//! Grazing and degenerate directions and numbers give neither NaN nor infinity.

use glam::{Vec2, Vec3};
use luz_color::SampledSpectrum;
use luz_render::bsdf::{
    Bsdf, CoatInterface, CoatedDiffuse, Conductor, Dielectric, Diffuse, DiffuseTransmission, ThinDielectric,
    TrowbridgeReitz,
};
use luz_sample::ONE_MINUS_EPSILON;
use proptest::{prelude::*, test_runner::RngSeed};

use super::specimens::{Coats, MODES, layered_conductor, layered_diffuse, milky};

/// A direction that may lie in the surface, or nearly.
fn any_direction() -> impl Strategy<Value = Vec3> {
    let cosine = prop_oneof![
        -1.0f32..1.0,
        Just(0.0f32),
        Just(-0.0),
        Just(1.0),
        Just(-1.0),
        Just(1e-38),
        Just(-1e-30),
        -1e-6f32..1e-6,
        Just(1.0 - 1e-7)
    ];
    (cosine, prop_oneof![0.0f32..6.3, Just(0.0f32)]).prop_map(|(z, phi)| {
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * phi.cos(), r * phi.sin(), z)
    })
}

fn any_number() -> impl Strategy<Value = f32> {
    prop_oneof![0.0f32..ONE_MINUS_EPSILON, Just(0.0f32), Just(ONE_MINUS_EPSILON), Just(1e-30)]
}

fn any_alpha() -> impl Strategy<Value = f32> {
    prop_oneof![Just(0.0f32), Just(1e-3), Just(1.0), 0.0f32..1.5, 1e-3f32..1e-2]
}

fn any_eta() -> impl Strategy<Value = f32> {
    prop_oneof![Just(1.0f32), Just(1.0 + 1e-7), Just(1.0 - 2e-4), 0.3f32..3.0]
}

fn any_spectrum() -> impl Strategy<Value = SampledSpectrum> {
    prop_oneof![Just(0.0f32), Just(1.0f32), 0.0f32..1.0, 1.0f32..8.0].prop_map(SampledSpectrum::splat)
}

fn check(bsdf: &Bsdf, wo: Vec3, wi: Vec3, uc: f32, u: Vec2) -> Result<(), TestCaseError> {
    for mode in MODES {
        let (f, pdf) = bsdf.evaluate(wo, wi, mode);
        prop_assert!(f.is_finite() && f.min_component() >= 0.0, "{bsdf:?}: f {f:?}");
        prop_assert!(pdf.is_finite() && pdf >= 0.0, "{bsdf:?}: pdf {pdf}");
        if let Some(s) = bsdf.sample(wo, uc, u, mode) {
            prop_assert!(s.f.is_finite() && s.f.min_component() >= 0.0, "{bsdf:?}: {s:?}");
            prop_assert!(s.pdf.is_finite() && s.pdf > 0.0, "{bsdf:?}: {s:?}");
            prop_assert!((s.wi.length() - 1.0).abs() < 1e-4 && s.wi.z != 0.0, "{bsdf:?}: {s:?}");
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, rng_seed: RngSeed::Fixed(5), ..ProptestConfig::default() })]

    #[test]
    fn nothing_degenerates(
        (wo, wi) in (any_direction(), any_direction()),
        (uc, ux, uy) in (any_number(), any_number(), any_number()),
        (x, y) in (any_alpha(), any_alpha()),
        eta in any_eta(),
        (a, b) in (any_spectrum(), any_spectrum()),
    ) {
        let distribution = TrowbridgeReitz::new(x, y);
        let (r, t) = (a.clamp(0.0, 1.0), b.clamp(0.0, 1.0));
        let u = Vec2::new(ux, uy);
        for bsdf in [
            Bsdf::Diffuse(Diffuse::new(r)),
            Bsdf::DiffuseTransmission(DiffuseTransmission::new(r, t)),
            Bsdf::Conductor(Conductor::new(distribution, a, b)),
            Bsdf::Dielectric(Dielectric::new(distribution, eta)),
            Bsdf::ThinDielectric(ThinDielectric::new(eta)),
            Bsdf::Layered(layered_diffuse(r, x, eta, milky(0.5, 0.8, 0.9))),
            Bsdf::Layered(layered_conductor(x, y, milky(0.0, 1.0, -1.0))),
        ] {
            check(&bsdf, wo, wi, uc, u)?;
            check(&bsdf, wo, wo, uc, u)?;
            check(&bsdf, wo, -wo, uc, u)?;
        }
    }

    #[test]
    fn no_coat_degenerates(
        (wo, wi) in (any_direction(), any_direction()),
        (uc, ux, uy) in (any_number(), any_number(), any_number()),
        (x, y) in (any_alpha(), any_alpha()),
        r in any_spectrum(),
    ) {
        thread_local!(static COATS: Coats = Coats::new());
        COATS.with(|coats| {
            for coat in &coats.0 {
                let bsdf = Bsdf::CoatedDiffuse(CoatedDiffuse::textured(r.clamp(0.0, 1.0), coat, x, y));
                check(&bsdf, wo, wi, uc, Vec2::new(ux, uy))?;
                check(&bsdf, wo, -wo, uc, Vec2::new(ux, uy))?;
            }
            Ok::<(), TestCaseError>(())
        })?;
    }
}

#[test]
fn nonsensical_parameters_give_some_bsdf() {
    for (eta, thickness) in [(0.0, 0.01), (-1.0, 0.01), (f32::NAN, 0.01), (1.5, -1.0), (1.5, f32::NAN), (1.5, 1e9)] {
        for alpha in [0.0, 0.3, f32::NAN, -1.0, 1e9] {
            let coat = CoatInterface::new(alpha, alpha, eta, thickness, 10);
            let bsdf = CoatedDiffuse::new(SampledSpectrum::splat(0.5), &coat);
            let (f, pdf) = bsdf.evaluate(Vec3::Z, Vec3::new(0.6, 0.0, 0.8));
            assert!(f.is_finite() && pdf.is_finite(), "{alpha} {eta} {thickness}: {f:?} {pdf}");
        }
    }
}
