//! What few repetitions say: confidence intervals and fitted slopes.
//!
//! Repetitions are renderings with different seeds, which are independent; a handful of them is usual, so intervals come
//! from Student's t distribution and not from the normal one. They hold exactly for normal numbers; errors of pictures are
//! means over many pixels, which is near enough unless a few bright pixels carry all of the error.

use luz_sample::statistics::Running;
use luz_sample::test_support::ln_gamma;
use serde::Serialize;

/// The probability that an interval covers what it estimates.
pub const CONFIDENCE: f64 = 0.95;

/// An estimate with a confidence interval. Where nothing is known of its error, because there is one repetition only, the
/// interval reaches to infinity (for ratios: from 0).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    /// The estimate.
    pub value: f64,
    /// The interval's lower end.
    #[serde(serialize_with = "finite_or_null")]
    pub low: f64,
    /// The interval's upper end.
    #[serde(serialize_with = "finite_or_null")]
    pub high: f64,
}

fn finite_or_null<S: serde::Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    value.is_finite().then_some(*value).serialize(serializer)
}

impl Interval {
    /// Is anything known of the error?
    pub fn is_bounded(&self) -> bool {
        self.low.is_finite() && self.high.is_finite()
    }

    /// Does the interval hold this number?
    pub fn covers(&self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }
}

/// The mean of independent repetitions, with Student's interval `x̄ ± t_{n−1} s / √n`; `None` without any.
pub fn mean_interval(values: &[f64]) -> Option<Interval> {
    let running: Running = values.iter().copied().collect();
    if running.count() == 0 {
        return None;
    }
    let half = half_width(&running);
    Some(Interval { value: running.mean(), low: running.mean() - half, high: running.mean() + half })
}

/// The number in the middle, or the mean of both in the middle; `None` without any.
pub fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    let upper = *sorted.get(middle)?;
    Some(if sorted.len().is_multiple_of(2) { 0.5 * (sorted[middle - 1] + upper) } else { upper })
}

/// The ratio of two means, `(Σ aᵢ) / (Σ bᵢ)`, of repetitions that belong together by pairs: those of the same seed, rendered
/// in turns, whose errors and times go up and down together.
///
/// The interval is that of the ratio's logarithm by the delta method: `ln r ± t_{n−1} s_d / √n` with `s_d` the sample
/// standard deviation of `dᵢ = aᵢ/ā − bᵢ/b̄`. `None` without a pair or where a mean is not positive.
pub fn ratio_interval(a: &[f64], b: &[f64]) -> Option<Interval> {
    let pairs = a.iter().zip(b);
    let count = pairs.len() as f64;
    let (sum_a, sum_b) = pairs.clone().fold((0.0, 0.0), |(x, y), (a, b)| (x + a, y + b));
    if !(sum_a > 0.0 && sum_b > 0.0 && sum_a.is_finite() && sum_b.is_finite()) {
        return None;
    }
    let (mean_a, mean_b) = (sum_a / count, sum_b / count);
    let deviations: Running = pairs.map(|(a, b)| a / mean_a - b / mean_b).collect();
    let value = sum_a / sum_b;
    let half = half_width(&deviations);
    Some(Interval { value, low: value * (-half).exp(), high: value * half.exp() })
}

/// Half of Student's interval around a mean.
fn half_width(running: &Running) -> f64 {
    if running.count() < 2 {
        return f64::INFINITY;
    }
    student_t_quantile(0.5 + 0.5 * CONFIDENCE, (running.count() - 1) as f64) * running.standard_error()
}

/// A fitted power law `y = factor · x^slope`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PowerLaw {
    /// The exponent: −1 for the squared error of independent samples.
    pub slope: f64,
    /// The value at x = 1.
    pub factor: f64,
    /// The standard error of the slope as the scatter around the line tells it, if the scatter of the points is independent;
    /// infinite for two points.
    #[serde(serialize_with = "finite_or_null")]
    pub slope_error: f64,
}

impl PowerLaw {
    /// The fitted value.
    pub fn at(&self, x: f64) -> f64 {
        self.factor * x.powf(self.slope)
    }
}

/// Fits a power law by least squares in the logarithms. Points that are not positive or not finite are left out; `None` if fewer
/// than two different x are left.
pub fn fit_power_law(points: &[[f64; 2]]) -> Option<PowerLaw> {
    let usable = |p: &&[f64; 2]| p.iter().all(|v| *v > 0.0 && v.is_finite());
    let logs: Vec<[f64; 2]> = points.iter().filter(usable).map(|p| p.map(f64::ln)).collect();
    let count = logs.len() as f64;
    let mean = [0, 1].map(|i| logs.iter().map(|p| p[i]).sum::<f64>() / count);
    let sum = |f: &dyn Fn(f64, f64) -> f64| logs.iter().map(|p| f(p[0] - mean[0], p[1] - mean[1])).sum::<f64>();
    let spread = sum(&|x, _| x * x);
    // Also false where there is no point, since NaN is not above zero.
    if !(logs.len() >= 2 && spread > 0.0) {
        return None;
    }
    let slope = sum(&|x, y| x * y) / spread;
    let residuals = sum(&|x, y| (y - slope * x).powi(2));
    let slope_error = if logs.len() > 2 { (residuals / (count - 2.0) / spread).sqrt() } else { f64::INFINITY };
    Some(PowerLaw { slope, factor: (mean[1] - slope * mean[0]).exp(), slope_error })
}

/// The number that a variable of Student's t distribution stays below with probability `p ∈ (0, 1)`, for
/// `degrees_of_freedom > 0`.
pub fn student_t_quantile(p: f64, degrees_of_freedom: f64) -> f64 {
    if p < 0.5 {
        return -student_t_quantile(1.0 - p, degrees_of_freedom);
    }
    let tail = 1.0 - p;
    let mut high = 1.0;
    while student_t_survival(high, degrees_of_freedom) > tail && high < 1e12 {
        high *= 2.0;
    }
    let mut low = 0.0;
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if student_t_survival(middle, degrees_of_freedom) > tail {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// The probability that a t variable is at least `t ≥ 0`: half the regularised incomplete beta function at ν/(ν + t²) with
/// parameters ν/2 and 1/2 (Abramowitz and Stegun 26.7.1 with 26.5.27).
fn student_t_survival(t: f64, degrees_of_freedom: f64) -> f64 {
    let x = degrees_of_freedom / (degrees_of_freedom + t * t);
    0.5 * regularized_beta(x, 0.5 * degrees_of_freedom, 0.5)
}

/// The regularised incomplete beta function by its continued fraction (Abramowitz and Stegun 26.5.8), evaluated by the modified
/// method of Lentz.
fn regularized_beta(x: f64, a: f64, b: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    if x >= 1.0 {
        return 1.0;
    }
    // The fraction converges fast below the mean only; beyond it, the other tail is as good.
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - regularized_beta(1.0 - x, b, a);
    }
    const TINY: f64 = 1e-300;
    let nonzero = |v: f64| if v.abs() < TINY { TINY } else { v };
    let (mut c, mut d) = (1.0, 1.0 / nonzero(1.0 - (a + b) * x / (a + 1.0)));
    let mut fraction = d;
    for m in 1..1000 {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        let mut change = 1.0;
        for numerator in [even, odd] {
            d = 1.0 / nonzero(1.0 + numerator * d);
            c = nonzero(1.0 + numerator / c);
            change *= c * d;
        }
        fraction *= change;
        if (change - 1.0).abs() < f64::EPSILON {
            break;
        }
    }
    let factor = (a * x.ln() + b * (-x).ln_1p() + ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b)).exp() / a;
    (factor * fraction).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use luz_sample::random::{hash, unit_f64};
    use statrs::distribution::{ContinuousCDF, StudentsT};

    /// Numbers of the standard normal distribution, by the sum of twelve uniform ones: near enough, and bounded.
    fn normals(seed: u64) -> impl Iterator<Item = f64> {
        (0u32..).map(move |i| (0..12).map(|j| unit_f64(hash(seed, 0, 0, 12 * i + j))).sum::<f64>() - 6.0)
    }

    #[test]
    fn quantiles_agree_with_another_library() {
        for degrees in [1.0, 2.0, 3.0, 7.0, 30.0, 200.0] {
            let reference = StudentsT::new(0.0, 1.0, degrees).unwrap();
            for p in [0.05, 0.5, 0.75, 0.95, 0.975, 0.995] {
                let (ours, theirs) = (student_t_quantile(p, degrees), reference.inverse_cdf(p));
                assert!((ours - theirs).abs() < 1e-6 * theirs.abs().max(1.0), "{p} {degrees}: {ours} {theirs}");
            }
        }
        assert!((student_t_quantile(0.975, 3.0) - 3.182_446_305).abs() < 1e-8);
    }

    #[test]
    fn medians_lie_in_the_middle() {
        assert_eq!(median(&[]), None);
        assert_eq!(median(&[3.0, 1.0, 1e9]), Some(3.0));
        assert_eq!(median(&[4.0, 1.0, 1e9, 2.0]), Some(3.0));
    }

    #[test]
    fn one_repetition_says_nothing_of_its_error() {
        let interval = mean_interval(&[2.0]).unwrap();
        assert_eq!(interval.value, 2.0);
        assert!(!interval.is_bounded());
        let ratio = ratio_interval(&[2.0], &[4.0]).unwrap();
        assert_eq!((ratio.value, ratio.low), (0.5, 0.0));
        assert!(!ratio.is_bounded());
        assert_eq!(serde_json::to_value(ratio).unwrap(), serde_json::json!({"value": 0.5, "low": 0.0, "high": null}));
        assert!(mean_interval(&[]).is_none());
        assert!(ratio_interval(&[], &[]).is_none());
        assert!(ratio_interval(&[1.0, 1.0], &[0.0, 0.0]).is_none());
    }

    /// Of 4000 intervals, as many as they say cover the truth; the standard error of that frequency is 0.34 %, and four of them
    /// are allowed (a significance of 6·10⁻⁵).
    fn assert_coverage(covered: usize, extra: f64) {
        let frequency = covered as f64 / 4000.0;
        assert!((frequency - CONFIDENCE).abs() < 4.0 * 0.0034 + extra, "{frequency}");
    }

    #[test]
    fn intervals_of_means_cover_them_as_often_as_they_say() {
        let mut numbers = normals(1);
        let covered = (0..4000).filter(|_| {
            let values: Vec<f64> = (&mut numbers).take(4).map(|z| 5.0 + 2.0 * z).collect();
            mean_interval(&values).unwrap().covers(5.0)
        });
        assert_coverage(covered.count(), 0.0);
    }

    #[test]
    fn intervals_of_the_normal_distribution_would_be_too_narrow() {
        // The same experiment, with 1.96 in place of 3.18: the test above would notice.
        let mut numbers = normals(1);
        let covered = (0..4000).filter(|_| {
            let running: Running = (&mut numbers).take(4).map(|z| 5.0 + 2.0 * z).collect();
            (running.mean() - 5.0).abs() < 1.96 * running.standard_error()
        });
        assert!((covered.count() as f64 / 4000.0) < 0.9);
    }

    #[test]
    fn intervals_of_ratios_cover_them_as_often_as_they_say() {
        // Costs that scatter by 10 % and 20 %, half of it in common, as errors and times of one seed have it. The delta method is
        // good to second order in the scatter, for which 1 % is granted.
        let mut numbers = normals(2);
        let covered = (0..4000).filter(|_| {
            let (mut a, mut b) = (Vec::new(), Vec::new());
            for _ in 0..4 {
                let [common, x, y] = std::array::from_fn(|_| numbers.next().unwrap());
                a.push(3.0 * (1.0 + 0.05 * common + 0.09 * x));
                b.push(2.0 * (1.0 + 0.10 * common + 0.17 * y));
            }
            ratio_interval(&a, &b).unwrap().covers(1.5)
        });
        assert_coverage(covered.count(), 0.01);
    }

    #[test]
    fn an_exact_power_law_is_found() {
        let points: Vec<[f64; 2]> = (0..8).map(|i| 2f64.powi(i)).map(|x| [x, 0.7 * x.powf(-1.3)]).collect();
        let law = fit_power_law(&points).unwrap();
        assert!((law.slope + 1.3).abs() < 1e-12 && (law.factor - 0.7).abs() < 1e-12 && law.slope_error < 1e-12);
        assert!((law.at(10.0) - 0.7 * 10f64.powf(-1.3)).abs() < 1e-12);
    }

    #[test]
    fn slopes_scatter_as_their_errors_say() {
        // Eight doublings with a scatter of 0.1 in the logarithm: the slope's standard error is 0.1 / √Σ (x − x̄)².
        let x: Vec<f64> = (0..8).map(|i| 2f64.powi(i)).collect();
        let spread: f64 = (0..8).map(|i| ((f64::from(i) - 3.5) * 2f64.ln()).powi(2)).sum();
        let expected = 0.1 / spread.sqrt();
        let mut numbers = normals(3);
        let (mut slopes, mut variances) = (Running::new(), Running::new());
        let mut covered = 0;
        let t = student_t_quantile(0.975, 6.0);
        for _ in 0..4000 {
            let points: Vec<[f64; 2]> = x.iter().map(|&x| [x, (0.1 * numbers.next().unwrap()).exp() / x]).collect();
            let law = fit_power_law(&points).unwrap();
            slopes.push(law.slope);
            variances.push(law.slope_error.powi(2));
            covered += usize::from((law.slope + 1.0).abs() < t * law.slope_error);
        }
        // Four standard errors each.
        assert!((slopes.mean() + 1.0).abs() < 4.0 * slopes.standard_error());
        assert!((slopes.variance().sqrt() / expected - 1.0).abs() < 4.0 / (2.0f64 * 4000.0).sqrt());
        assert!((variances.mean() - expected * expected).abs() < 4.0 * variances.standard_error());
        assert_coverage(covered, 0.0);
    }

    #[test]
    fn what_has_no_logarithm_is_left_out() {
        let law = fit_power_law(&[[1.0, 2.0], [2.0, -1.0], [0.0, 5.0], [4.0, 0.5], [8.0, f64::NAN]]).unwrap();
        assert!((law.slope + 1.0).abs() < 1e-12);
        assert_eq!(law.slope_error, f64::INFINITY);
        assert!(fit_power_law(&[[1.0, 2.0]]).is_none());
        assert!(fit_power_law(&[[1.0, 2.0], [1.0, 3.0]]).is_none());
        assert!(fit_power_law(&[]).is_none());
    }
}
