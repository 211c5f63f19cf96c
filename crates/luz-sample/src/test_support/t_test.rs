//! Comparison of means whose errors are estimates from few samples themselves.

use super::beta::student_survival;
use crate::statistics::Running;

/// The two-sided p-value of the hypothesis that two means have the same expectation, where their squared standard errors were
/// estimated with the given degrees of freedom each: Welch's test, with the degrees of freedom of Welch and Satterthwaite.
/// Without any error, the means must be equal.
pub fn welch_test(
    (mean_a, squared_error_a, freedom_a): Estimate,
    (mean_b, squared_error_b, freedom_b): Estimate,
) -> f64 {
    let difference = mean_a - mean_b;
    let variance = squared_error_a + squared_error_b;
    if difference == 0.0 {
        return 1.0;
    }
    let t = difference.abs() / variance.sqrt();
    if t.is_nan() || t.is_infinite() {
        return 0.0;
    }
    let freedom = variance * variance
        / (squared_error_a * squared_error_a / freedom_a + squared_error_b * squared_error_b / freedom_b);
    // Far beyond, it is the normal distribution.
    2.0 * student_survival(t, freedom.clamp(1.0, 1e6))
}

/// A mean, the square of its standard error, and the degrees of freedom with which that was estimated.
pub type Estimate = (f64, f64, f64);

/// [`welch_test`] of the means of two samples of independent values, of two or more each.
pub fn two_sample_t_test(a: &Running, b: &Running) -> f64 {
    let estimate = |sample: &Running| {
        (sample.mean(), sample.standard_error() * sample.standard_error(), sample.count() as f64 - 1.0)
    };
    welch_test(estimate(a), estimate(b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::test_support::sidak;

    #[test]
    fn known_values() {
        // Student's tables: t = 2.228 at 10 degrees of freedom, 2.776 at 4.
        assert!((welch_test((2.228_138_852, 1.0, 10.0), (0.0, 0.0, 1.0)) - 0.05).abs() < 1e-8);
        assert!((welch_test((0.0, 0.5, 2.0), (2.776_445_105, 0.5, 2.0)) - 0.05).abs() < 1e-8);
        assert_eq!(welch_test((1.0, 0.0, 1.0), (1.0, 0.0, 1.0)), 1.0);
        assert_eq!(welch_test((1.0, 0.0, 1.0), (2.0, 0.0, 1.0)), 0.0);
        assert_eq!(welch_test((f64::NAN, 1.0, 1.0), (2.0, 1.0, 1.0)), 0.0);
    }

    /// Of 4000 tests of equal means of five values each, at 5 %, no more fail than a binomial distribution's tail of 10⁻⁶
    /// allows; a z-test would reject 12 %.
    #[test]
    fn is_right_for_few_values() {
        let mut random = Random::new(1, 2, 3);
        let mut sample = |mean: f64| {
            let mut running = Running::default();
            for _ in 0..5 {
                // Nearly normal.
                running.push(mean + (0..12).map(|_| random.next_f64()).sum::<f64>());
            }
            running
        };
        let tests = 4000;
        let rejected = (0..tests).filter(|_| two_sample_t_test(&sample(0.0), &sample(0.0)) < 0.05).count();
        let deviation = (f64::from(tests) * 0.05 * 0.95).sqrt();
        assert!((rejected as f64 - 0.05 * f64::from(tests)).abs() < 4.9 * deviation, "{rejected} of {tests}");
        let found = (0..50).filter(|_| two_sample_t_test(&sample(0.0), &sample(8.0)) < sidak(0.05, 50)).count();
        assert!(found > 45, "{found} of 50");
    }
}
