//! Proposals have exact densities, and specular scattering the probabilities with which it is drawn.

use std::cell::Cell;

use glam::Vec3;
use luz_render::bsdf::{Bsdf, BsdfSample, Layered, Lobe, TransportMode};
use luz_sample::{
    Samples,
    random::Random,
    test_support::{Chi2Result, chi2, chi2_sphere, mean_z_test, sidak},
};

use super::specimens::{
    Coats, MODES, clear, coloured, dielectric, layered_conductor, layered_diffuse, milky, outgoing, point,
};

/// Probability that any of a test's comparisons fails although all is right.
const SIGNIFICANCE: f64 = 0.01;
const RADIANCE: TransportMode = TransportMode::Radiance;
const SIDES: [Lobe; 2] = [Lobe::REFLECTION, Lobe::TRANSMISSION];

/// Layers of all kinds, a dark base under a coat that scatters among them.
fn layers() -> Vec<(String, Layered)> {
    let mut all = Vec::new();
    for (top, base) in [(0.0, 0.0), (0.0, 0.3), (0.2, 0.0), (0.2, 0.3), (0.002, 0.0)] {
        for (kind, medium) in [("clear", clear(0.1)), ("milky", milky(0.5, 0.8, 0.3))] {
            all.push((format!("{kind} coat {top} over metal {base}"), layered_conductor(top, base, medium)));
        }
    }
    for top in [0.0, 0.3] {
        for (kind, reflectance) in [("grey", 0.6), ("black", 0.0)] {
            let bsdf = layered_diffuse(coloured(reflectance), top, 1.5, milky(0.5, 0.8, -0.3));
            all.push((format!("milky coat {top} over {kind}"), bsdf));
        }
        all.push((format!("clear coat {top} over grey"), layered_diffuse(coloured(0.6), top, 1.5, clear(0.1))));
        all.push((format!("index 1 {top} over grey"), layered_diffuse(coloured(0.6), top, 1.0, clear(0.1))));
    }
    all
}

/// Holds the non-specular proposals of a BSDF against their density, which is wrong by a factor.
fn chi_square(bsdf: &Bsdf, wo: Vec3, factor: f64) -> Chi2Result {
    let lobes = Cell::new(Random::new(11, 1, 0));
    let sample = |u| {
        let mut random = lobes.get();
        let uc = random.next_1d();
        lobes.set(random);
        let sample = bsdf.propose(wo, uc, u, RADIANCE)?;
        (!sample.flags.is_specular()).then_some(sample.wi)
    };
    chi2_sphere(sample, |wi| factor * f64::from(bsdf.proposal_pdf(wo, wi, RADIANCE)), 20_000, 3)
}

#[test]
fn layered_proposals_follow_their_density() {
    let layers = layers();
    let directions = &outgoing()[1..5];
    let significance = sidak(SIGNIFICANCE, layers.len() * directions.len());
    let mut failures = Vec::new();
    for (name, bsdf) in &layers {
        let bsdf = Bsdf::Layered(*bsdf);
        if bsdf.is_specular() {
            continue;
        }
        for &wo in directions {
            let result = chi_square(&bsdf, wo, 1.0);
            if !result.passes(significance) {
                failures.push(format!("{name}, wo {wo}: {result:?}"));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    let bsdf = Bsdf::Layered(layers[3].1);
    assert!(!chi_square(&bsdf, directions[0], 1.06).passes(1e-6), "a wrong density");
}

#[test]
fn proposals_agree_with_value_and_density() {
    let coats = Coats::new();
    for (name, bsdf) in coats.all() {
        for wo in outgoing() {
            for mode in MODES {
                for i in 0..50 {
                    let (uc, u) = point(i);
                    let Some(s) = bsdf.propose(wo, uc, u, mode) else { continue };
                    assert!(!s.pdf_is_proportional && s.pdf > 0.0 && s.f.is_finite(), "{name} {wo}: {s:?}");
                    assert!(bsdf.flags().contains(s.flags), "{name} {wo}: {s:?}");
                    if s.flags.is_specular() {
                        continue;
                    }
                    let near = |a: f32, b: f32| (a - b).abs() <= 5e-3 * a.abs().max(b.abs()) + 1e-6;
                    let (f, pdf) = bsdf.evaluate(wo, s.wi, mode);
                    assert!(near(pdf, s.pdf), "{name} {wo} {mode:?} {i}: {pdf} {s:?}");
                    assert!(near(f[0], s.f[0]), "{name} {wo} {mode:?} {i}: {f:?} {s:?}");
                }
            }
        }
    }
}

/// Specular scattering is what proposals that are specular draw, as often as they draw it.
#[test]
fn specular_scattering_is_drawn_with_its_probability() {
    const COUNT: u64 = 20_000;
    let coats = Coats::new();
    let mut specimens = coats.all();
    specimens.extend(layers().into_iter().map(|(name, bsdf)| (name, Bsdf::Layered(bsdf))));
    let mut kinds = Vec::new();
    let tests = specimens.len() * outgoing().len();
    for (name, bsdf) in &specimens {
        for wo in outgoing() {
            let expected = SIDES.map(|side| bsdf.specular(wo, side, RADIANCE));
            let mut counts = [0; 3];
            for i in 0..COUNT {
                let mut random = Random::new(3, 0, i);
                let (uc, u) = (random.next_1d(), random.next_2d());
                let sample = bsdf.propose(wo, uc, u, RADIANCE).filter(|s| s.flags.is_specular());
                let Some(s) = sample else {
                    counts[2] += 1;
                    continue;
                };
                let side = usize::from(s.flags.is_transmission());
                let known = expected[side].unwrap_or_else(|| panic!("{name} {wo}: {s:?}"));
                assert_eq!((s.f, s.wi, s.pdf, s.flags, s.eta), (known.f, known.wi, known.pdf, known.flags, known.eta));
                counts[side] += 1;
            }
            let probabilities = expected.map(|s| s.map_or(0.0, |s| f64::from(s.pdf)));
            let rest = (1.0 - probabilities[0] - probabilities[1]).max(0.0);
            let expected = [probabilities[0], probabilities[1], if rest < 1e-6 { 0.0 } else { rest }];
            let result = chi2(&counts, &expected.map(|p| p * COUNT as f64));
            assert!(result.passes(sidak(SIGNIFICANCE, tests)), "{name} {wo}: {counts:?}, probabilities {expected:?}");
            if rest < 1.0 {
                kinds.push(bsdf.kind());
            }
        }
    }
    for kind in ["conductor", "dielectric", "thin dielectric", "coated diffuse", "layered"] {
        assert!(kinds.contains(&kind), "{kind}");
    }
    // A wrong probability is noticed.
    let glass = dielectric(0.0, 0.0, 1.5);
    let of = |side| glass.specular(outgoing()[2], side, RADIANCE).map_or(0.0, |s| f64::from(s.pdf));
    let [reflected, transmitted] = SIDES.map(of);
    let count = |p: f64| (p * COUNT as f64) as u64;
    let wrong = chi2(&[count(reflected), count(transmitted)], &[transmitted, reflected].map(|p| p * COUNT as f64));
    assert!(!wrong.passes(1e-6));
}

/// The mean throughputs of what `draw` finds, without and with specular scattering, and their squared errors.
fn throughputs(draw: impl Fn(u64) -> Option<BsdfSample>) -> [(f64, f64); 2] {
    const COUNT: u64 = 20_000;
    let mut sums = [(0.0, 0.0); 2];
    for s in (0..COUNT).filter_map(draw) {
        let value = f64::from(s.f[1] * s.wi.z.abs() / s.pdf);
        let (sum, squares) = &mut sums[usize::from(s.flags.is_specular())];
        *sum += value;
        *squares += value * value;
    }
    let n = COUNT as f64;
    sums.map(|(sum, squares)| (sum / n, (squares / n - (sum / n).powi(2)) / n))
}

/// Walks that leave where they will, and proposals weighted by value over density, find the same light, specular and not.
#[test]
fn layered_proposals_find_what_samples_find() {
    // The nearly smooth coat is left out: its walks hardly ever find what most of its light takes.
    let layers: Vec<_> = layers().into_iter().filter(|(name, _)| !name.contains("0.002")).collect();
    let directions = [outgoing()[1], outgoing()[4]];
    let significance = sidak(SIGNIFICANCE, layers.len() * directions.len() * 2);
    for (i, (name, bsdf)) in layers.iter().enumerate() {
        let bsdf = Bsdf::Layered(*bsdf);
        for &wo in &directions {
            let mode = MODES[i % 2];
            let draw = |i, proposing: bool| {
                let mut random = Random::new(5, u64::from(proposing), i);
                let (uc, u) = (random.next_1d(), random.next_2d());
                if proposing { bsdf.propose(wo, uc, u, mode) } else { bsdf.sample(wo, uc, u, mode) }
            };
            let proposed = throughputs(|i| draw(i, true));
            let sampled = throughputs(|i| draw(i, false));
            for ((a, a_error), (b, b_error)) in proposed.into_iter().zip(sampled) {
                // Rounding, where all samples are alike.
                let p = mean_z_test(a, a_error, b, b_error + 1e-10);
                assert!(p >= significance, "{name} {wo} {mode:?}: proposed {a}, sampled {b} ± {}", b_error.sqrt());
            }
        }
    }
}
