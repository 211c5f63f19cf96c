//! Patterns estimate sums over the window without bias.

use luz_sample::statistics::Running;
use luz_sample::test_support::{mean_z_test, sidak};

use super::*;
use crate::Strategy;

const IMAGE: Window = Window { sigma: 1.7, radius: 5, sigma_frames: 1.0, frame_radius: 0 };
const VIDEO: Window = Window { sigma: 1.1, radius: 3, sigma_frames: 0.8, frame_radius: 2 };

/// A range weight that a neighbourhood could have, and a value times it: the filter's denominator and numerator.
fn integrands([x, y, t]: [i32; 3]) -> [f64; 2] {
    let (x, y, t) = (f64::from(x), f64::from(y), f64::from(t));
    let weight = if x + 0.5 * y - t > 1.0 { 0.2 } else { 0.7 + 0.3 * (1.3 * x).sin() * (0.9 * y + t).cos() };
    [weight, weight * (0.3 * x - 0.2 * y * y + 0.5 * t)]
}

fn sums(pattern: &Pattern) -> [f64; 2] {
    let mut sums = integrands([0; 3]).map(|v| v * pattern.centre_weight);
    for (&offset, &weight) in pattern.offsets.iter().zip(&pattern.log2_weights) {
        let values = integrands(offset);
        (0..2).for_each(|i| sums[i] += values[i] * weight.exp2());
    }
    sums
}

/// The p-values of numerator and denominator, over seeds; `spoil` scales the weights.
fn p_values(window: &Window, strategy: Strategy, density: Density, spoil: f64) -> [f64; 2] {
    let sampling = Sampling { strategy, density, samples: SampleCount::Count(30), ..Sampling::default() };
    let exact = sums(&super::window(window));
    let axes = axes(window, density);
    let mut estimates = [Running::new(); 2];
    for seed in 0..400 {
        // Members of one seed depend on each other.
        let member = MEMBERS[seed as usize % MEMBERS.len()];
        let mut pattern = sampled_member(&axes, window, &sampling, seed, member);
        pattern.log2_weights.iter_mut().for_each(|w| *w += spoil.log2());
        let sums = sums(&pattern);
        (0..2).for_each(|i| estimates[i].push(sums[i]));
    }
    std::array::from_fn(|i| {
        let e = &estimates[i];
        mean_z_test(e.mean(), e.standard_error().powi(2), exact[i], 0.0)
    })
}

/// z tests at a significance of 0.001 for all together.
#[test]
fn numerator_and_denominator_are_unbiased() {
    let significance = sidak(0.001, Strategy::ALL.len() * 8);
    for strategy in Strategy::ALL {
        for density in [Density::Gaussian, Density::Uniform] {
            for window in [&IMAGE, &VIDEO] {
                let p = p_values(window, strategy, density, 1.0);
                assert!(p.iter().all(|&p| p > significance), "{strategy:?} {density:?} {window:?}: {p:?}");
            }
        }
    }
}

/// Weights that are 10 % too large are found out.
#[test]
fn wrong_weights_are_rejected() {
    for strategy in Strategy::ALL {
        let p = p_values(&IMAGE, strategy, Density::Gaussian, 1.1);
        assert!(p[0] < 1e-6, "{strategy:?}: {p:?}");
    }
}

/// The standard deviation of the estimated denominator at a number of samples, over seeds.
fn deviation(strategy: Strategy, count: u32) -> f64 {
    // So wide that moving points to pixels doesn't matter.
    let window = Window { sigma: 120.0, radius: 300, sigma_frames: 1.0, frame_radius: 0 };
    // A grid is regular where the density is uniform; warped, it is as bad at linear functions as its spacing is wide.
    let density = if strategy == Strategy::Grid { Density::Uniform } else { Density::Gaussian };
    let sampling = Sampling { strategy, density, samples: SampleCount::Count(count), ..Sampling::default() };
    let smooth = |[x, y, _]: [i32; 3]| 0.5 + 0.5 * (0.011 * f64::from(x) + 0.007 * f64::from(y)).sin();
    let axes = axes(&window, density);
    let mut estimates = Running::new();
    for seed in 0..300 {
        let pattern = sampled_member(&axes, &window, &sampling, seed, 3);
        let sum: f64 = pattern.offsets.iter().zip(&pattern.log2_weights).map(|(&o, w)| smooth(o) * w.exp2()).sum();
        estimates.push(sum);
    }
    estimates.variance().sqrt()
}

/// Over 16 times as many samples, the error of random ones falls by 16^(−1/2) = 0.25, and by more for all others. 300 seeds
/// know a ratio of deviations to about 6 % (one standard error); the bounds are three of them away.
#[test]
fn errors_fall_as_they_should() {
    for strategy in Strategy::ALL {
        // A grid of 64 points is as good as points can be that are moved to pixels.
        let few = if strategy == Strategy::Grid { 9 } else { 32 };
        let ratio = deviation(strategy, 16 * few) / deviation(strategy, few);
        if strategy == Strategy::Random {
            assert!((0.207..0.293).contains(&ratio), "{strategy:?}: {ratio}");
        } else {
            assert!(ratio < 0.207, "{strategy:?}: {ratio}");
        }
    }
}
