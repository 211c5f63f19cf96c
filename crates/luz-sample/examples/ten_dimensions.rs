//! An integral over ten dimensions, by every sampler, and how fast each converges.
//!
//! Known: each factor of the integrand Π (1 + (3 xⱼ² − 1) / j²) integrates to one over [0, 1], and so does the product.

use luz_sample::statistics::{PowerLaw, Running};
use luz_sample::{Sampler, SamplerConfig, SamplerKind, Samples};

const DIMENSIONS: usize = 10;
const COUNTS: [u32; 5] = [16, 64, 256, 1024, 4096];

fn integrand(samples: &mut impl Samples) -> f64 {
    let mut product = 1.0;
    for j in (1..=DIMENSIONS).step_by(2) {
        let u = samples.next_2d();
        for (j, x) in [(j, u.x), (j + 1, u.y)] {
            product *= 1.0 + (3.0 * f64::from(x).powi(2) - 1.0) / (j * j) as f64;
        }
    }
    product
}

/// Estimates by `samples` points, over independent randomisations.
fn estimates(kind: SamplerKind, samples: u32, randomizations: u32) -> Running {
    let config = SamplerConfig { samples_per_pixel: samples, resolution: [randomizations << 8, 1], seed: 3 };
    let sampler = Sampler::new(kind, config);
    let estimate = |r: u32| {
        let each = (0..samples).map(|i| integrand(&mut sampler.samples([r << 8, 0], i)));
        each.sum::<f64>() / f64::from(samples)
    };
    (0..randomizations).map(estimate).collect()
}

/// The root-mean-square error of each count of samples, and the power law that they follow.
fn convergence(kind: SamplerKind, randomizations: u32) -> (Vec<f64>, PowerLaw) {
    let error = |n: &u32| {
        let r = estimates(kind, *n, randomizations);
        // About the known integral, so that a bias would show.
        (r.variance() + (r.mean() - 1.0).powi(2)).sqrt()
    };
    let errors: Vec<f64> = COUNTS.iter().map(error).collect();
    let points = COUNTS.iter().zip(&errors).map(|(&n, &e)| (f64::from(n), e));
    let law =
        PowerLaw::fit(points).unwrap_or(PowerLaw { exponent: f64::NAN, exponent_error: f64::NAN, factor: f64::NAN });
    (errors, law)
}

fn main() {
    println!("Root-mean-square error of an integral over {DIMENSIONS} dimensions, 48 randomisations\n");
    print!("  samples    ");
    COUNTS.iter().for_each(|n| print!(" {n:>9}"));
    println!("   slope");
    for kind in SamplerKind::ALL {
        let (errors, law) = convergence(kind, 48);
        print!("  {kind:<12}");
        errors.iter().for_each(|e| print!(" {e:>9.6}"));
        println!("   {:.2} ± {:.2}", law.exponent, law.exponent_error);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use luz_sample::test_support::{mean_z_test, sidak};

    #[test]
    fn integrals_are_one_and_errors_shrink_as_they_should() {
        let p = sidak(0.01, SamplerKind::ALL.len());
        let independent = convergence(SamplerKind::Independent, 48);
        for kind in SamplerKind::ALL {
            let r = estimates(kind, 100, 200);
            assert!(mean_z_test(r.mean(), r.standard_error().powi(2), 1.0, 0.0) > p, "{kind}: {r:?}");
            let (errors, law) = convergence(kind, 48);
            if kind == SamplerKind::Independent {
                assert!((law.exponent + 0.5).abs() < 0.06, "{law:?}");
            } else {
                assert!(errors[4] < 0.5 * independent.0[4], "{kind}: {errors:?}");
            }
        }
    }
}
