//! Comparison of means.

use super::gamma::normal_survival;

/// The two-sided p-value of a standard normal statistic.
pub fn z_test(z: f64) -> f64 {
    if z.is_nan() { 0.0 } else { 2.0 * normal_survival(z.abs()) }
}

/// The two-sided p-value of the hypothesis that two means with the given squared standard errors have the same
/// expectation. For a known expectation, its squared error is 0. Without any error, the means must be equal.
pub fn mean_z_test(mean_a: f64, squared_error_a: f64, mean_b: f64, squared_error_b: f64) -> f64 {
    let variance = squared_error_a + squared_error_b;
    let difference = mean_a - mean_b;
    if difference == 0.0 { 1.0 } else { z_test(difference / variance.sqrt()) }
}

/// The significance that each of `tests` independent tests must have so that the family has `significance`: the
/// probability that any of them fails although all hypotheses hold (Šidák 1967): `1 − (1 − α)^(1/m)`.
pub fn sidak(significance: f64, tests: usize) -> f64 {
    -f64::exp_m1(f64::ln_1p(-significance) / tests.max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        assert!((z_test(1.959_963_984_540_054) - 0.05).abs() < 1e-12);
        assert_eq!(z_test(f64::NAN), 0.0);
        assert_eq!(mean_z_test(1.0, 0.0, 1.0, 0.0), 1.0);
        assert_eq!(mean_z_test(1.0, 0.0, 2.0, 0.0), 0.0);
        assert!((mean_z_test(0.0, 3.0, 2.0 * 1.959_963_984_540_054, 1.0) - 0.05).abs() < 1e-12);
        assert!((sidak(0.05, 1) - 0.05).abs() < 1e-15);
        assert!((1.0 - (1.0 - sidak(0.01, 1000)).powi(1000) - 0.01).abs() < 1e-12);
    }
}
