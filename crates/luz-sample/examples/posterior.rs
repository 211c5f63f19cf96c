//! Statistics: what twelve measurements say about their mean and spread.
//!
//! Measurements are normal, of unknown mean μ and variance σ². A priori, σ² has the inverse gamma distribution of shape 3 and
//! scale 2, and μ, given σ², the normal one about 0 of variance 4 σ². A Metropolis chain, the same type that carries light in
//! a renderer, walks through (μ, ln σ²) under the posterior density, which nobody has to normalise.
//!
//! Known: this prior is conjugate, so the posterior has a closed form.

use luz_sample::Samples;
use luz_sample::markov::{Acceptance, Chain, Log, Proposal};
use luz_sample::statistics::Running;
use luz_sample::warp::box_muller;

const DATA: [f64; 12] = [2.1, 1.4, 3.3, 0.2, 2.8, 1.9, 2.4, 3.9, 1.1, 2.2, 0.7, 2.6];
const SHAPE: f64 = 3.0;
const SCALE: f64 = 2.0;
const MEAN_VARIANCE: f64 = 4.0;

/// The logarithm of likelihood times prior at (μ, ln σ²), up to a constant, as a density over these two.
fn log_posterior([mu, log_variance]: [f64; 2]) -> Log {
    let variance = log_variance.exp();
    let squares: f64 = DATA.iter().map(|x| (x - mu).powi(2)).sum::<f64>() + mu * mu / MEAN_VARIANCE;
    // The density of ln σ² is that of σ², times σ².
    let powers = 0.5 * (DATA.len() + 1) as f64 + SHAPE + 1.0 - 1.0;
    Log(-powers * log_variance - (0.5 * squares + SCALE) / variance)
}

/// Posterior expectations of μ, its square, and σ².
fn exact() -> [f64; 3] {
    let n = DATA.len() as f64;
    let precision = n + 1.0 / MEAN_VARIANCE;
    let mean = DATA.iter().sum::<f64>() / precision;
    let shape = SHAPE + 0.5 * n;
    let scale = SCALE + 0.5 * (DATA.iter().map(|x| x * x).sum::<f64>() - precision * mean * mean);
    let variance = scale / (shape - 1.0);
    [mean, mean * mean + variance / precision, variance]
}

/// The same from chains that begin anywhere, with standard errors over chains, and how often they moved.
fn measure(chains: u64, warm_up: u64, steps: u64) -> ([Running; 3], Acceptance) {
    let mut estimates = [Running::new(); 3];
    let mut acceptance = Acceptance::default();
    for number in 0..chains {
        let start = [number as f64 - 5.0, 0.3 * number as f64];
        let mut chain = Chain::new(4, number, start, log_posterior(start));
        let mut spare = start;
        let mut sums = [0.0; 3];
        for i in 0..warm_up + steps {
            let step = chain.step(&mut spare, |x, y, random| {
                let z = box_muller(random.next_2d()).as_dvec2();
                *y = [x[0] + 0.6 * z.x, x[1] + 0.8 * z.y];
                Some(Proposal::symmetric(log_posterior(*y)))
            });
            if i >= warm_up {
                // Both states count, by the probability that they had of being the next.
                for (state, weight) in [(step.current, step.current_weight), (step.proposed, step.proposed_weight)] {
                    let values = [state[0], state[0] * state[0], state[1].exp()];
                    sums.iter_mut().zip(values).for_each(|(sum, v)| *sum += weight * v / steps as f64);
                }
            }
        }
        estimates.iter_mut().zip(sums).for_each(|(e, sum)| e.push(sum));
        acceptance.merge(chain.acceptance());
    }
    (estimates, acceptance)
}

fn main() {
    println!("Mean and variance of normal data, conjugate prior, 16 Metropolis chains of 20000 steps\n");
    let (found, acceptance) = measure(16, 500, 20_000);
    println!("  E[·]   chains                exact");
    for ((name, r), exact) in ["μ ", "μ²", "σ²"].iter().zip(found).zip(exact()) {
        println!("  {name}     {:.4} ± {:.4}      {exact:.4}", r.mean(), r.standard_error());
    }
    println!("\n  {:.0} % of proposals accepted", 100.0 * acceptance.rate());
}

#[cfg(test)]
mod tests {
    use super::*;
    use luz_sample::test_support::{mean_z_test, sidak};

    /// z-tests over chains, at a significance of 0.01 in all.
    #[test]
    fn chains_agree_with_the_closed_form() {
        let (found, acceptance) = measure(16, 500, 20_000);
        for (r, exact) in found.iter().zip(exact()) {
            let p = mean_z_test(r.mean(), r.standard_error().powi(2), exact, 0.0);
            assert!(p > sidak(0.01, 3), "{r:?} {exact}");
            assert!(r.standard_error() < 0.01 * exact, "precise enough to tell");
        }
        assert!((0.2..0.6).contains(&acceptance.rate()));
    }
}
