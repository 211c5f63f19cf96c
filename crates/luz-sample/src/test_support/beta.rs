//! The incomplete beta function, and the tail probabilities of Student's distribution that follow from it.

use super::gamma::ln_gamma;

/// The regularised incomplete beta function `I_x(a, b)` for `a, b > 0`, `0 ≤ x ≤ 1`, by its continued fraction (Abramowitz and
/// Stegun 26.5.8), on whichever side it converges quickly; relative error about 1e-12 for `a, b < 1e4`.
pub fn regularized_beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    if x >= 1.0 {
        return 1.0;
    }
    let factor = (ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b) + a * x.ln() + b * f64::ln_1p(-x)).exp();
    if x < (a + 1.0) / (a + b + 2.0) {
        factor / (a * continued_fraction(a, b, x))
    } else {
        1.0 - factor / (b * continued_fraction(b, a, 1.0 - x))
    }
}

/// `1 + d₁/(1 + d₂/(1 + …))` by the modified method of Lentz.
fn continued_fraction(a: f64, b: f64, x: f64) -> f64 {
    const TINY: f64 = 1e-300;
    let nonzero = |v: f64| if v.abs() < TINY { TINY } else { v };
    let (mut fraction, mut c, mut d) = (1.0, 1.0, 0.0);
    for n in 1..10_000u32 {
        let m = f64::from(n / 2);
        let coefficient = if n % 2 == 0 {
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m))
        } else {
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0))
        };
        d = 1.0 / nonzero(1.0 + coefficient * d);
        c = nonzero(1.0 + coefficient / c);
        fraction *= c * d;
        if (c * d - 1.0).abs() < f64::EPSILON {
            break;
        }
    }
    fraction
}

/// The probability that a variable of Student's distribution with `degrees_of_freedom > 0` is at least `t`.
pub fn student_survival(t: f64, degrees_of_freedom: f64) -> f64 {
    let x = degrees_of_freedom / (degrees_of_freedom + t * t);
    let tail = 0.5 * regularized_beta(0.5 * degrees_of_freedom, 0.5, x);
    if t >= 0.0 { tail } else { 1.0 - tail }
}

#[cfg(test)]
mod tests {
    use statrs::distribution::{ContinuousCDF, StudentsT};
    use statrs::function::beta::beta_reg;

    use super::*;

    #[test]
    fn agree_with_another_library() {
        for (a, b) in [(0.5, 0.5), (1.0, 3.0), (7.5, 0.5), (40.0, 60.0), (500.0, 0.5)] {
            for x in [0.0, 1e-3, 0.2, 0.5, 0.9, 0.999, 1.0] {
                let (ours, theirs) = (regularized_beta(a, b, x), beta_reg(a, b, x));
                assert!((ours - theirs).abs() < 1e-9 * theirs.max(1e-9), "{a} {b} {x}: {ours} {theirs}");
            }
        }
        for freedom in [1.0, 2.0, 5.0, 23.4, 126.0, 1000.0] {
            let reference = StudentsT::new(0.0, 1.0, freedom).unwrap();
            for t in [-3.0, -0.5, 0.0, 0.7, 2.0, 6.0] {
                let (ours, theirs) = (student_survival(t, freedom), reference.sf(t));
                assert!((ours - theirs).abs() < 1e-8 * theirs, "{freedom} {t}: {ours} {theirs}");
            }
        }
    }

    #[test]
    fn extremes() {
        // Student's distribution of one degree is Cauchy's, that of two has a closed form.
        assert!((student_survival(1.0, 1.0) - 0.25).abs() < 1e-14);
        assert!((student_survival(2.0, 2.0) - 0.5 * (1.0 - 2.0 / f64::sqrt(6.0))).abs() < 1e-14);
        assert_eq!(student_survival(f64::INFINITY, 3.0), 0.0);
        let far = student_survival(12.0, 15.0);
        assert!(far > 0.0 && far < 1e-8, "{far}");
    }
}
