//! The closed form of the coated Lambertian base is the expectation of the random walk.

use glam::Vec3;
use luz_color::{LANES, SampledSpectrum};
use luz_render::bsdf::{
    Base, CoatInterface, CoatMedium, CoatedDiffuse, Dielectric, Diffuse, Layered, TransportMode, TrowbridgeReitz,
};
use luz_sample::test_support::{sidak, z_test};

use super::specimens::{clear, coloured, direction};

#[test]
#[ignore]
fn timing() {
    let t = std::time::Instant::now();
    for i in 0..10 {
        std::hint::black_box(CoatInterface::new(0.3 + 0.01 * i as f32, 0.3 + 0.01 * i as f32, 1.5, 0.01, 10));
    }
    println!("isotropic {:?}", t.elapsed() / 10);
    let t = std::time::Instant::now();
    std::hint::black_box(CoatInterface::new(0.3, 0.1, 1.5, 0.01, 10));
    println!("anisotropic {:?}", t.elapsed());
    let t = std::time::Instant::now();
    std::hint::black_box(CoatInterface::textured(1.5, 0.01, 10));
    println!("textured {:?}", t.elapsed());
}

#[test]
fn closed_form_is_the_expectation_of_the_walk() {
    for roughness in [0.0f32, 0.005, 0.02, 0.15, 0.5] {
        let alpha = roughness.sqrt();
        for (eta, r) in [(1.5f32, 0.5f32), (1.3, 0.9), (1.8, 0.07)] {
            let interface = CoatInterface::new(alpha, alpha, eta, 0.01, 10);
            let closed = CoatedDiffuse::new(SampledSpectrum::splat(r), &interface);
            let top = Dielectric::new(TrowbridgeReitz::new(alpha, alpha), eta);
            let base = Base::Diffuse(Diffuse::new(SampledSpectrum::splat(r)));
            for (wo, wi) in [
                (direction(0.9, 0.0), direction(0.5, 2.0)),
                (direction(0.5, 2.0), direction(0.9, 0.0)),
                (direction(0.2, 0.0), direction(0.7, 2.0)),
                (direction(0.6, 0.0), direction(0.1, 1.0)),
            ] {
                let n = 100;
                let (mut s, mut s2) = (0.0, 0.0);
                for seed in 0..n {
                    let walk = Layered::new(top, base, clear(0.01), 10, 1000, seed);
                    let v = f64::from(walk.evaluate(wo, wi, TransportMode::Radiance).0[0]);
                    s += v;
                    s2 += v * v;
                }
                let mean = s / n as f64;
                let err = ((s2 / n as f64 - mean * mean) / n as f64).sqrt();
                let c = f64::from(closed.evaluate(wo, wi).0[0]);
                let z = (mean - c) / err;
                println!(
                    "rough {roughness} eta {eta} R {r} {:.2} {:.2}: closed {c:.6} walk {mean:.6} rel err {:.5} rel diff {:.5} z {z:.2}",
                    wo.z,
                    wi.z,
                    err / c,
                    mean / c - 1.0
                );
            }
        }
    }
}
