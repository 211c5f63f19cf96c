//! Where chains begin.

use crate::statistics::Running;

/// Candidates for the first states of chains, drawn independently of one another, with the target density of each divided by
/// the density that it was drawn with.
///
/// Their mean estimates the integral `b` of the target density, by which the chain's histogram is scaled. A chain that begins
/// at a candidate chosen in proportion to its weight has, in expectation over all candidates, the right distribution from its
/// first step on, if its contribution is scaled by that same `b`: there is no start-up bias and nothing to throw away (Veach
/// 1997, section 11.3.1).
///
/// ```
/// use luz_sample::markov::Bootstrap;
///
/// let bootstrap: Bootstrap = [0.0, 3.0, 1.0, 0.0].into_iter().collect();
/// assert_eq!(bootstrap.normalization(), 1.0);
/// // Of four chains, three begin at the second candidate.
/// let starts: Vec<_> = (0..4).filter_map(|chain| bootstrap.start(chain, 4, 0.5)).collect();
/// assert_eq!(starts, [1, 1, 1, 2]);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bootstrap {
    /// Sums of all weights up to each candidate.
    cumulative: Vec<f64>,
    weights: Running,
    invalid: u64,
}

impl Bootstrap {
    /// Takes in the next candidate's weight. One that is negative or not finite counts as zero, and in [`Self::invalid`].
    pub fn push(&mut self, weight: f64) {
        let total = self.total();
        let valid = weight >= 0.0 && (total + weight).is_finite();
        self.invalid += u64::from(!valid);
        let weight = if valid { weight } else { 0.0 };
        self.cumulative.push(total + weight);
        self.weights.push(weight);
    }

    fn total(&self) -> f64 {
        self.cumulative.last().copied().unwrap_or(0.0)
    }

    /// Candidates.
    pub fn count(&self) -> u64 {
        self.weights.count()
    }

    /// Candidates without a valid weight.
    pub fn invalid(&self) -> u64 {
        self.invalid
    }

    /// The estimate of the integral `b` of the target density; zero where no candidate had a positive one.
    pub fn normalization(&self) -> f64 {
        self.weights.mean()
    }

    /// The standard error of [`Self::normalization`]; infinite below two candidates.
    pub fn standard_error(&self) -> f64 {
        self.weights.standard_error()
    }

    /// The number of the candidate at which chain `chain` of `chains` begins, given a `u ∈ [0, 1)` that all chains share.
    /// `None` if all weights are zero, or there is no such chain.
    ///
    /// Chains are spread evenly over the weights, so that a candidate gets its share of chains rounded up or down
    /// ("systematic resampling").
    pub fn start(&self, chain: u64, chains: u64, u: f64) -> Option<usize> {
        let total = self.total();
        if chain >= chains || total <= 0.0 {
            return None;
        }
        let position = (chain as f64 + u) / chains as f64 * total;
        let index = self.cumulative.partition_point(|&c| c <= position);
        if index < self.cumulative.len() {
            Some(index)
        } else {
            // Rounding has led beyond the last one that has any weight.
            Some(self.cumulative.partition_point(|&c| c < total))
        }
    }
}

impl Extend<f64> for Bootstrap {
    fn extend<T: IntoIterator<Item = f64>>(&mut self, weights: T) {
        weights.into_iter().for_each(|w| self.push(w));
    }
}

impl FromIterator<f64> for Bootstrap {
    fn from_iter<T: IntoIterator<Item = f64>>(weights: T) -> Self {
        let mut bootstrap = Self::default();
        bootstrap.extend(weights);
        bootstrap
    }
}
