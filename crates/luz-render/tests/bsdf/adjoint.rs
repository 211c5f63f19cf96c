//! A path has one value, from whichever of its ends it is traced.

use glam::Vec3;
use luz_render::bsdf::{Base, Bsdf, CoatMedium, Diffuse, Layered, Lobe, TransportMode, TrowbridgeReitz};
use luz_render::bsdf::{Conductor, Dielectric};
use luz_sample::test_support::{mean_z_test, sidak};

use super::specimens::{Coats, clear, coloured, direction, milky, outgoing};

const RADIANCE: TransportMode = TransportMode::Radiance;
const IMPORTANCE: TransportMode = TransportMode::Importance;

/// Specular scattering back along the same path: the coefficients of radiance and importance differ by the compression of
/// radiance, `eta²`, and by nothing else (Veach 1997, section 5.2; the delta is that of projected solid angle).
#[test]
fn specular_paths_can_be_reversed() {
    let coats = Coats::new();
    let mut compared = 0;
    for (name, bsdf) in coats.all() {
        for wo in outgoing() {
            for side in [Lobe::REFLECTION, Lobe::TRANSMISSION] {
                let Some(there) = bsdf.specular(wo, side, RADIANCE) else { continue };
                let back = bsdf.specular(there.wi, side, IMPORTANCE).expect("the way back");
                assert!(back.wi.distance(wo) < 1e-4, "{name} {wo}: {there:?} {back:?}");
                assert!((there.eta * back.eta - 1.0).abs() < 1e-5, "{name} {wo}: {there:?} {back:?}");
                let radiance = there.f * (there.wi.z.abs() * there.eta * there.eta);
                let importance = back.f * back.wi.z.abs();
                for (a, b) in radiance.0.into_iter().zip(importance.0) {
                    assert!((a - b).abs() < 2e-3 * a.max(b) + 1e-6, "{name} {wo}: {there:?} {back:?}");
                }
                compared += 1;
            }
        }
    }
    assert!(compared > 50, "{compared}");
}

fn layered(top_alpha: f32, base: Base, medium: CoatMedium, seed: u64) -> Layered {
    let top = Dielectric::new(TrowbridgeReitz::new(top_alpha, top_alpha), 1.5);
    // Of longer walks, a few weigh so much that errors are not known from a hundred values.
    Layered::new(top, base, medium, 3, 100, seed)
}

/// The mean value over many seeds, and its squared error.
fn value(make: impl Fn(u64) -> Layered, wo: Vec3, wi: Vec3, mode: TransportMode) -> (f64, f64) {
    const SEEDS: u64 = 100;
    let values: Vec<f64> = (0..SEEDS).map(|seed| f64::from(Bsdf::Layered(make(seed)).f(wo, wi, mode)[1])).collect();
    let mean = values.iter().sum::<f64>() / SEEDS as f64;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (SEEDS - 1) as f64;
    (mean, variance / SEEDS as f64)
}

/// Values of layers are estimates: their expectation is the same from both ends, in both modes.
#[test]
fn layers_are_the_same_from_both_ends() {
    let metal =
        |alpha| Base::Conductor(Conductor::new(TrowbridgeReitz::new(alpha, alpha), coloured(0.3), coloured(3.0)));
    let grey = Base::Diffuse(Diffuse::new(coloured(0.6)));
    let specimens = [
        (0.0, grey, milky(0.5, 0.8, 0.3)),
        (0.3, grey, milky(0.5, 0.8, -0.3)),
        (0.3, grey, clear(0.1)),
        (0.0, metal(0.3), clear(0.1)),
        (0.2, metal(0.3), clear(0.1)),
        (0.2, metal(0.0), milky(0.5, 0.8, 0.3)),
        (0.0, metal(0.0), milky(0.5, 0.8, 0.3)),
    ];
    let pairs = [(0.95, 0.4), (0.7, 0.2), (-0.5, -0.9)];
    let significance = sidak(0.01, 3 * specimens.len() * pairs.len());
    for (which, (top, base, medium)) in specimens.into_iter().enumerate() {
        let make = |seed| layered(top, base, medium, seed);
        for (cos_o, cos_i) in pairs {
            let (wo, wi) = (direction(cos_o, 0.3), direction(cos_i, 1.9));
            let (there, there_error) = value(make, wo, wi, RADIANCE);
            assert!(there > 0.0, "{which}");
            for (from, to, mode) in [(wi, wo, IMPORTANCE), (wi, wo, RADIANCE), (wo, wi, IMPORTANCE)] {
                let (back, back_error) = value(|seed| make(seed + 1000), from, to, mode);
                let p = mean_z_test(there, there_error, back, back_error);
                assert!(p >= significance, "{which} {wo} {wi} {mode:?}: {there} {back} ± {}", back_error.sqrt());
            }
        }
    }
}

/// The estimate itself is a fixed function of the two directions.
#[test]
fn layers_are_functions_of_the_directions() {
    let coats = Coats::new();
    for (name, bsdf) in coats.all() {
        for wo in outgoing() {
            let wi = direction(f64::from(wo.z.signum()) * 0.6, 0.7);
            assert_eq!(bsdf.evaluate(wo, wi, RADIANCE), bsdf.evaluate(wo, wi, RADIANCE), "{name}");
        }
    }
}
