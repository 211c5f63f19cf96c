//! Finance: the price of an option on an average.
//!
//! An Asian call pays what the average price of a share over a year, looked at 16 times, exceeds the strike by. The price of
//! the share is a geometric Brownian motion, built by halving intervals (a Brownian bridge), so that the first random
//! numbers decide most: there low-discrepancy points are at their best.
//!
//! Known: on the *geometric* average the option has a closed form (Kemna and Vorst 1990). It checks the estimate, and serves
//! as a control variate for the arithmetic average, which has none.

use luz_sample::statistics::Running;
use luz_sample::test_support::normal_survival;
use luz_sample::warp::normal;
use luz_sample::{Sampler, SamplerConfig, SamplerKind, Samples};

const STEPS: usize = 16;
const SPOT: f64 = 100.0;
const STRIKE: f64 = 100.0;
const RATE: f64 = 0.05;
const VOLATILITY: f64 = 0.3;

/// The exact price of the option on the geometric average.
fn geometric_price() -> f64 {
    let m = STEPS as f64;
    let mean = SPOT.ln() + (RATE - 0.5 * VOLATILITY * VOLATILITY) * (m + 1.0) / (2.0 * m);
    let deviation = VOLATILITY * ((m + 1.0) * (2.0 * m + 1.0) / (6.0 * m * m)).sqrt();
    let d = (mean - STRIKE.ln()) / deviation;
    let below = |z: f64| normal_survival(-z);
    (-RATE).exp() * ((mean + 0.5 * deviation * deviation).exp() * below(d + deviation) - STRIKE * below(d))
}

/// The Brownian motion at the times 1/16 … 1 that some uniform numbers make.
fn brownian_motion(samples: &mut impl Samples) -> [f64; STEPS + 1] {
    let mut numbers = [0.0; STEPS];
    for pair in numbers.chunks_exact_mut(2) {
        let u = samples.next_2d();
        pair[0] = f64::from(normal(u.x, 0.0, 1.0));
        pair[1] = f64::from(normal(u.y, 0.0, 1.0));
    }
    let mut path = [0.0; STEPS + 1];
    path[STEPS] = numbers[0];
    let (mut next, mut width) = (1, STEPS);
    while width > 1 {
        for start in (0..STEPS).step_by(width) {
            // The middle of an interval is normal about the mean of its ends.
            let deviation = (0.25 * width as f64 / STEPS as f64).sqrt();
            path[start + width / 2] = 0.5 * (path[start] + path[start + width]) + deviation * numbers[next];
            next += 1;
        }
        width /= 2;
    }
    path
}

/// What the options on the arithmetic and on the geometric average pay, discounted.
fn payoffs(samples: &mut impl Samples) -> [f64; 2] {
    let path = brownian_motion(samples);
    let logs = (1..=STEPS).map(|i| {
        let time = i as f64 / STEPS as f64;
        SPOT.ln() + (RATE - 0.5 * VOLATILITY * VOLATILITY) * time + VOLATILITY * path[i]
    });
    let (mut sum, mut log_sum) = (0.0, 0.0);
    logs.for_each(|log| {
        sum += log.exp();
        log_sum += log;
    });
    let discounted = |average: f64| (-RATE).exp() * (average - STRIKE).max(0.0);
    [discounted(sum / STEPS as f64), discounted((log_sum / STEPS as f64).exp())]
}

/// Estimates over independent randomisations of `samples` points each: of the geometric price, of the arithmetic one, and of
/// that with the geometric one as control variate.
fn measure(kind: SamplerKind, randomizations: u32, samples: u32) -> [Running; 3] {
    let config = SamplerConfig { samples_per_pixel: samples, resolution: [randomizations << 8, 1], seed: 5 };
    let sampler = Sampler::new(kind, config);
    let exact = geometric_price();
    let mut estimates = [Running::new(); 3];
    for r in 0..randomizations {
        let mut mean = [0.0; 2];
        for i in 0..samples {
            // Far apart, since Z-order relates neighbours to each other.
            let paid = payoffs(&mut sampler.samples([r << 8, 0], i));
            mean = [0, 1].map(|k| mean[k] + paid[k] / f64::from(samples));
        }
        let [arithmetic, geometric] = mean;
        estimates[0].push(geometric);
        estimates[1].push(arithmetic);
        estimates[2].push(arithmetic - (geometric - exact));
    }
    estimates
}

fn main() {
    println!("Asian call over {STEPS} dates, 32 randomisations of 1024 paths\n");
    println!("  geometric average, exact: {:.6}\n", geometric_price());
    println!("  sampler       geometric              arithmetic             with control variate");
    for kind in SamplerKind::ALL {
        let [geometric, arithmetic, controlled] =
            measure(kind, 32, 1024).map(|r| format!("{:9.5} ± {:.5}", r.mean(), r.standard_error()));
        println!("  {kind:<12} {geometric:<22} {arithmetic:<22} {controlled}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use luz_sample::test_support::{mean_z_test, sidak};

    /// z-tests over randomisations, at a significance of 0.01 in all.
    #[test]
    fn prices_are_right_and_better_points_make_them_better() {
        let p = sidak(0.01, 3 * SamplerKind::ALL.len());
        let all = SamplerKind::ALL.map(|kind| measure(kind, 64, 256));
        let best = all[2][2];
        for (kind, [geometric, arithmetic, controlled]) in SamplerKind::ALL.into_iter().zip(all) {
            let square = |r: &Running| r.standard_error().powi(2);
            assert!(mean_z_test(geometric.mean(), square(&geometric), geometric_price(), 0.0) > p, "{kind}");
            assert!(mean_z_test(arithmetic.mean(), square(&arithmetic), best.mean(), square(&best)) > p, "{kind}");
            assert!(mean_z_test(controlled.mean(), square(&controlled), best.mean(), square(&best)) > p, "{kind}");
            // The control variate takes most of the variance, and so do the points.
            let ratio = |a: &Running, b: &Running| a.variance() / b.variance();
            assert!(ratio(&controlled, &arithmetic) < 0.04, "{kind}");
            let relative = ratio(&arithmetic, &all[0][1]);
            let limit = match kind {
                SamplerKind::Independent => 1.01,
                SamplerKind::Stratified => 0.2,
                SamplerKind::Halton => 0.03,
                _ => 0.12,
            };
            assert!(relative < limit, "{kind}: {relative}");
        }
    }

    #[test]
    fn brownian_motions_have_the_right_covariance() {
        let sampler = Sampler::new(
            SamplerKind::Independent,
            SamplerConfig { samples_per_pixel: 40_000, resolution: [1, 1], seed: 1 },
        );
        for (i, j) in [(1, 1), (3, 11), (8, 8), (16, 16), (15, 16)] {
            let products: Running = (0..40_000)
                .map(|k| {
                    let path = brownian_motion(&mut sampler.samples([0, 0], k));
                    path[i] * path[j]
                })
                .collect();
            let exact = i.min(j) as f64 / STEPS as f64;
            let p = mean_z_test(products.mean(), products.standard_error().powi(2), exact, 0.0);
            assert!(p > sidak(0.01, 5), "{i} {j}: {} {exact}", products.mean());
        }
    }
}
