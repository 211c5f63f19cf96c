//! Convergence rates.

/// A power law `y = factor · x^exponent`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerLaw {
    /// The slope in a doubly logarithmic diagram.
    pub exponent: f64,
    /// Its standard error, from how far the points are off the line; infinite for two points.
    pub exponent_error: f64,
    /// The value at `x = 1`.
    pub factor: f64,
}

impl PowerLaw {
    /// The line of least squares through the logarithms of points `(x, y)`. Points that are not positive and finite are left
    /// out; `None` if fewer than two different `x` remain.
    ///
    /// The error of independent samples, as `y` over their number, has exponent −1/2, its square −1.
    pub fn fit(points: impl IntoIterator<Item = (f64, f64)>) -> Option<Self> {
        let logs: Vec<(f64, f64)> =
            points.into_iter().map(|(x, y)| (x.ln(), y.ln())).filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
        let n = logs.len() as f64;
        let mean = |f: fn(&(f64, f64)) -> f64| logs.iter().map(f).sum::<f64>() / n;
        let (x, y) = (mean(|p| p.0), mean(|p| p.1));
        let spread: f64 = logs.iter().map(|p| (p.0 - x).powi(2)).sum();
        if spread.is_nan() || spread <= 1e-12 {
            return None;
        }
        let exponent = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / spread;
        let residual: f64 = logs.iter().map(|p| (p.1 - y - exponent * (p.0 - x)).powi(2)).sum();
        let exponent_error = if n > 2.0 { (residual / (n - 2.0) / spread).sqrt() } else { f64::INFINITY };
        Some(Self { exponent, exponent_error, factor: (y - exponent * x).exp() })
    }

    /// The value at `x`.
    pub fn at(&self, x: f64) -> f64 {
        self.factor * x.powf(self.exponent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::statistics::Running;
    use crate::test_support::mean_z_test;
    use crate::warp::normal_quantile;

    #[test]
    fn exact_laws_are_found() {
        let law = PowerLaw::fit([1.0, 2.0, 5.0, 100.0].map(|x: f64| (x, 3.0 * x.powf(-1.5)))).expect("four points");
        assert!((law.exponent + 1.5).abs() < 1e-12 && (law.factor - 3.0).abs() < 1e-12 && law.exponent_error < 1e-12);
        assert!((law.at(4.0) - 0.375).abs() < 1e-12);
        let two =
            PowerLaw::fit([(1.0, 1.0), (0.0, 1.0), (2.0, -1.0), (f64::NAN, 1.0), (4.0, 2.0)]).expect("two points");
        assert!((two.exponent - 0.5).abs() < 1e-12 && two.exponent_error.is_infinite());
        assert_eq!(PowerLaw::fit([(2.0, 1.0), (2.0, 3.0)]), None);
        assert_eq!(PowerLaw::fit([]), None);
    }

    #[test]
    fn errors_are_what_they_say() {
        let (mut exponents, mut errors) = (Running::new(), Running::new());
        for i in 0..4000 {
            let mut random = Random::new(1, 0, i);
            let law = PowerLaw::fit((0..8).map(|k| {
                let noise = 0.2 * normal_quantile(random.next_f64().max(1e-12));
                (2f64.powi(k), (noise - f64::from(k)).exp2())
            }))
            .expect("eight points");
            exponents.push(law.exponent);
            errors.push(law.exponent_error.powi(2));
        }
        assert!(mean_z_test(exponents.mean(), exponents.standard_error().powi(2), -1.0, 0.0) > 0.01);
        assert!((errors.mean() / exponents.variance() - 1.0).abs() < 0.1);
    }
}
