//! Statistics of a stream of numbers.

mod power_law;

use serde::{Deserialize, Serialize};

pub use power_law::PowerLaw;

/// Count, mean and variance of numbers that are seen once (Welford 1962), in `f64`.
///
/// [`Self::merge`] gives what one stream of all numbers would have given, up to rounding. Floating-point sums are not
/// associative: equal bits need the same numbers pushed and merged in the same order, whatever the threads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Running {
    count: u64,
    mean: f64,
    /// `Σ (x − mean)²`.
    squares: f64,
}

impl Running {
    /// No numbers yet.
    pub const fn new() -> Self {
        Self { count: 0, mean: 0.0, squares: 0.0 }
    }

    /// Takes a number in. A number that is not finite spoils mean and variance for good.
    #[inline]
    pub fn push(&mut self, x: f64) {
        self.count += 1;
        let delta = x - self.mean;
        self.mean += delta / self.count as f64;
        self.squares += delta * (x - self.mean);
    }

    /// Takes all numbers of `other` in (Chan, Golub and LeVeque 1979).
    pub fn merge(&mut self, other: &Self) {
        if other.count == 0 {
            return;
        }
        if self.count == 0 {
            *self = *other;
            return;
        }
        let (a, b) = (self.count as f64, other.count as f64);
        let delta = other.mean - self.mean;
        self.count += other.count;
        self.mean += delta * (b / (a + b));
        self.squares += other.squares + delta * delta * (a * b / (a + b));
    }

    /// How many numbers were seen.
    pub const fn count(&self) -> u64 {
        self.count
    }

    /// The mean; 0 where no number was seen.
    pub const fn mean(&self) -> f64 {
        self.mean
    }

    /// The unbiased estimate of the variance of a single number, `Σ (x − mean)² / (n − 1)`; infinite, since unknown, below
    /// two numbers.
    pub fn variance(&self) -> f64 {
        if self.count < 2 { f64::INFINITY } else { self.squares / (self.count - 1) as f64 }
    }

    /// The standard error of the mean of independent numbers, `√(variance / n)`; infinite below two numbers.
    pub fn standard_error(&self) -> f64 {
        if self.count < 2 { f64::INFINITY } else { (self.variance() / self.count as f64).sqrt() }
    }
}

impl Extend<f64> for Running {
    fn extend<T: IntoIterator<Item = f64>>(&mut self, numbers: T) {
        numbers.into_iter().for_each(|x| self.push(x));
    }
}

impl FromIterator<f64> for Running {
    fn from_iter<T: IntoIterator<Item = f64>>(numbers: T) -> Self {
        let mut running = Self::new();
        running.extend(numbers);
        running
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    use super::*;

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

        #[test]
        fn merging_is_pushing(numbers in prop::collection::vec(-1e3f64..1e3, 0..60), cut in 0usize..60) {
            // A large offset, so that a naive sum of squares would fail.
            let numbers: Vec<f64> = numbers.into_iter().map(|x| x + 1e8).collect();
            let (a, b) = numbers.split_at(cut.min(numbers.len()));
            let all: Running = numbers.iter().copied().collect();
            let mut merged: Running = a.iter().copied().collect();
            merged.merge(&b.iter().copied().collect());
            prop_assert_eq!(all.count(), merged.count());
            prop_assert!((all.mean() - merged.mean()).abs() <= 1e-6);
            if numbers.len() >= 2 {
                let mean = numbers.iter().map(|x| x - 1e8).sum::<f64>() / numbers.len() as f64;
                let squares: f64 = numbers.iter().map(|x| (x - 1e8 - mean).powi(2)).sum();
                let exact = squares / (numbers.len() - 1) as f64;
                prop_assert!((all.variance() - exact).abs() <= 1e-6 * exact + 1e-9);
                prop_assert!((merged.variance() - exact).abs() <= 1e-6 * exact + 1e-9);
                prop_assert!((all.standard_error().powi(2) * numbers.len() as f64 - exact).abs() <= 1e-6 * exact + 1e-9);
            }
        }
    }

    #[test]
    fn few_numbers() {
        let mut running = Running::new();
        assert_eq!((running.count(), running.mean(), running.variance()), (0, 0.0, f64::INFINITY));
        running.push(3.0);
        assert_eq!((running.count(), running.mean(), running.standard_error()), (1, 3.0, f64::INFINITY));
        running.push(3.0);
        assert_eq!((running.variance(), running.standard_error()), (0.0, 0.0));
    }
}
