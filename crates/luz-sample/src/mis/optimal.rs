//! Optimal weights, learned from the samples.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::symmetric::pseudo_solve;
use crate::statistics::Running;

/// Directions of the technique matrix along which the densities vary less than this, relative to themselves, squared, are
/// rounding errors.
const CUTOFF: f64 = 1e-10;

/// Multiple importance sampling of an integral by `K` techniques with the weights of least variance that there are, for
/// integrands of `C` channels (Kondapaneni et al. 2019, "Optimal Multiple Importance Sampling").
///
/// In *rounds*, technique `k` draws `nₖ` samples of density `pₖ`. With `D = Σ nₖ pₖ`, the optimal weights are
///
/// ```text
/// wᵢ(x) = αᵢ pᵢ(x) / f(x)  +  nᵢ pᵢ(x) / D(x) · (1 − Σₖ αₖ pₖ(x) / f(x)),     A α = b,
/// Aᵢⱼ = ∫ pᵢ pⱼ / D,    bᵢ = ∫ f pᵢ / D,
/// ```
///
/// which sum to one but need not be positive. The estimator that they give is the balance heuristic with the densities
/// themselves, whose integrals are known to be one, as control variates (as are those of Owen and Zhou 2000, "Safe and
/// Effective Importance Sampling"):
///
/// ```text
/// Î = Σₖ αₖ + Σ over samples (f(x) − Σₖ αₖ pₖ(x)) / D(x).
/// ```
///
/// The *technique matrix* `A` and the *contribution vectors* `b` are accumulated from the samples. Adding a multiple of `n`
/// to `α` changes nothing, since `Σ nₖ pₖ / D = 1` at every sample. So `α` is a multiple of `n` plus a `β` that regresses
/// `f / D` on the `pₖ / D`, both less their means; where densities do not vary against each other, or too few samples have
/// been seen, `β` is zero, and the estimate is that of the balance heuristic.
///
/// * [`Self::end_round`] and [`Self::progressive`]: `α` comes from earlier rounds only. Unbiased after any number of rounds,
///   and as good as the optimum in the end (the paper's Algorithm 2).
/// * [`Self::direct`]: `α` comes from all samples, the same that are weighted. Consistent, with a bias that vanishes as one
///   over the number of rounds (the paper's Algorithm 1).
///
/// An estimator can also serve several integrals that are alike, such as those of neighbouring pixels: each takes the
/// estimates of its own rounds, which are as unbiased, from an `α` that is best for their mean, is learned sooner, and takes
/// less memory.
///
/// # What it asks of densities
///
/// The control variates are right only if every `pₖ` is the density that its technique really has, and integrates to one:
/// * samples at which `f` is zero count: they must be pushed, too, with their densities;
/// * a technique that fails to make a sample (as one that draws a direction below a surface) says so by
///   [`Self::push_failure`];
/// * a round in which nothing is to be integrated, so that no technique was asked, is [`Self::end_empty_round`];
/// * `pₖ` must be evaluated where other techniques drew, too, and by every technique in the same way. Where one draws points
///   on a light and another rays, a point hidden from where it is looked at is one that no ray finds: it is a failure of
///   the former, not a sample with the densities of both; and a ray that ends elsewhere has the density zero for the former;
/// * a technique of which only an approximate density is known biases the result, unlike with heuristics, and so has no
///   place here;
/// * delta distributions are to be handled apart, each by the one technique that can draw it.
///
/// ```
/// use luz_sample::mis::Optimal;
/// use luz_sample::random::Random;
///
/// // ∫ 1 + 2x dx over [0, 1] by the densities 1 and 2x. The optimum has no variance at all.
/// let mut estimator = Optimal::<2, 1>::new([1, 1]);
/// for round in 0..64 {
///     let mut random = Random::new(0, 0, round);
///     let (x, y) = (random.next_f64(), random.next_f64().sqrt());
///     estimator.push(0, &[1.0, 2.0 * x], &[1.0 + 2.0 * x]);
///     estimator.push(1, &[1.0, 2.0 * y], &[1.0 + 2.0 * y]);
///     estimator.end_round();
/// }
/// assert!((estimator.direct()[0] - 2.0).abs() < 1e-9);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Optimal<const K: usize, const C: usize> {
    counts: [f64; K],
    rounds: u64,
    invalid: u64,
    /// `Σ W Wᵀ` over samples, where `W = p / D`; above and on the diagonal.
    matrix: [[f64; K]; K],
    /// `Σ W f / D`.
    contributions: [[f64; C]; K],
    /// What the current round's samples add to `Σ W` and `Σ f / D`.
    round_densities: [f64; K],
    round_sum: [f64; C],
    /// The `β` of the rounds to come, and the round after which it is made anew.
    beta: [[f64; C]; K],
    next_update: u64,
    progressive: [Running; C],
}

impl<const K: usize, const C: usize> Optimal<K, C> {
    /// An estimator without samples, of techniques that draw `counts` samples in each round.
    pub fn new(counts: [u32; K]) -> Self {
        Self {
            counts: counts.map(f64::from),
            rounds: 0,
            invalid: 0,
            matrix: [[0.0; K]; K],
            contributions: [[0.0; C]; K],
            round_densities: [0.0; K],
            round_sum: [0.0; C],
            beta: [[0.0; C]; K],
            next_update: first_update(counts.map(u64::from)),
            progressive: [Running::new(); C],
        }
    }

    /// Takes in a sample of `technique`, at which the techniques have the densities `pdfs`, all in one measure, and the
    /// integrand is `value` (not divided by any density).
    ///
    /// A sample of which a number is not finite, a density negative, or the technique's own density zero counts as a
    /// failure, and in [`Self::invalid`].
    pub fn push(&mut self, technique: usize, pdfs: &[f64; K], value: &[f64; C]) {
        let total: f64 = self.counts.iter().zip(pdfs).map(|(n, p)| n * p).sum();
        let drawn = self.counts.get(technique).is_some_and(|&n| n > 0.0) && pdfs[technique] > 0.0;
        let fine = pdfs.iter().all(|&p| p >= 0.0) && total.is_finite() && total > 0.0;
        let reciprocal = 1.0 / total;
        if !(drawn && fine && reciprocal.is_finite() && value.iter().all(|f| (f * reciprocal).is_finite())) {
            self.invalid += 1;
            self.push_failure(technique);
            return;
        }
        self.add(pdfs.map(|p| p * reciprocal), &value.map(|f| f * reciprocal));
    }

    /// Takes in that `technique` made no sample: it drew a point, with all the probability of failing, that no other
    /// technique can draw, and where the integrand is zero.
    pub fn push_failure(&mut self, technique: usize) {
        if let Some(&n) = self.counts.get(technique)
            && n > 0.0
        {
            let mut densities = [0.0; K];
            densities[technique] = 1.0 / n;
            self.add(densities, &[0.0; C]);
        }
    }

    fn add(&mut self, densities: [f64; K], value: &[f64; C]) {
        for i in 0..K {
            for j in i..K {
                self.matrix[i][j] += densities[i] * densities[j];
            }
            for (sum, f) in self.contributions[i].iter_mut().zip(value) {
                *sum += densities[i] * f;
            }
            self.round_densities[i] += densities[i];
        }
        for (sum, f) in self.round_sum.iter_mut().zip(value) {
            *sum += f;
        }
    }

    /// Ends a round, after all its samples, and returns the round's unbiased estimate of the integral, which uses the `α` of
    /// earlier rounds. Estimates of all rounds have the same expectation and are uncorrelated, so that they can be averaged
    /// as any samples are.
    pub fn end_round(&mut self) -> [f64; C] {
        let mut estimate = self.round_sum;
        for (beta, density) in self.beta.iter().zip(self.round_densities) {
            for (estimate, beta) in estimate.iter_mut().zip(beta) {
                *estimate -= beta * (density - 1.0);
            }
        }
        for (running, estimate) in self.progressive.iter_mut().zip(estimate) {
            running.push(estimate);
        }
        self.round_densities = [0.0; K];
        self.round_sum = [0.0; C];
        self.rounds += 1;
        self.update();
        estimate
    }

    /// Makes `β` anew whenever half as many rounds again have been seen.
    fn update(&mut self) {
        if self.rounds >= self.next_update {
            self.beta = self.regression();
            self.next_update = self.rounds + self.rounds.div_ceil(2);
        }
    }

    /// A round in which there was nothing to integrate, decided before any technique was asked: all of them drew one and
    /// the same point, where the integrand is zero.
    pub fn end_empty_round(&mut self) -> [f64; C] {
        let total: f64 = self.counts.iter().sum();
        if total > 0.0 {
            for i in 0..K {
                for j in i..K {
                    self.matrix[i][j] += 1.0 / total;
                }
                self.round_densities[i] = 1.0;
            }
        }
        self.end_round()
    }

    /// Takes in what another estimator of the same integral by the same techniques has seen. Both must be between rounds.
    pub fn merge(&mut self, other: &Self) {
        debug_assert_eq!(self.counts, other.counts, "the same techniques");
        for i in 0..K {
            for j in i..K {
                self.matrix[i][j] += other.matrix[i][j];
            }
            for (sum, more) in self.contributions[i].iter_mut().zip(other.contributions[i]) {
                *sum += more;
            }
        }
        self.rounds += other.rounds;
        self.invalid += other.invalid;
        for (running, more) in self.progressive.iter_mut().zip(&other.progressive) {
            running.merge(more);
        }
        self.next_update = first_update(self.counts.map(|n| n as u64));
        self.update();
    }

    /// Rounds that have ended.
    pub fn rounds(&self) -> u64 {
        self.rounds
    }

    /// Samples that had to be taken for failures, see [`Self::push`].
    pub fn invalid(&self) -> u64 {
        self.invalid
    }

    /// The mean of the rounds' estimates: unbiased. Zero without rounds.
    pub fn progressive(&self) -> [f64; C] {
        self.progressive.each_ref().map(Running::mean)
    }

    /// The standard error of [`Self::progressive`]; infinite below two rounds.
    pub fn standard_error(&self) -> [f64; C] {
        self.progressive.each_ref().map(Running::standard_error)
    }

    /// The estimate with an `α` from all samples: consistent, not unbiased. Zero without rounds.
    pub fn direct(&self) -> [f64; C] {
        let alpha = self.alpha();
        std::array::from_fn(|channel| alpha.iter().map(|a| a[channel]).sum())
    }

    /// The estimate of the balance heuristic from the same samples. Zero without rounds.
    pub fn balance(&self) -> [f64; C] {
        if self.rounds == 0 {
            return [0.0; C];
        }
        // Σₖ nₖ pₖ / D is one at every sample.
        std::array::from_fn(|channel| {
            self.counts.iter().zip(&self.contributions).map(|(n, b)| n * b[channel]).sum::<f64>() / self.rounds as f64
        })
    }

    /// The `α` that solves `A α = b` for what has been seen, by technique and channel. Zero without rounds.
    ///
    /// Its weights are those of the class's formula; [`Self::direct`] is its sum over techniques.
    pub fn alpha(&self) -> [[f64; C]; K] {
        let total: f64 = self.counts.iter().sum();
        if self.rounds == 0 || total <= 0.0 {
            return [[0.0; C]; K];
        }
        let beta = self.regression();
        let rounds = self.rounds as f64;
        let densities = self.density_sums();
        let balance = self.balance();
        // c n + β with the c at which the mean of (f − α p) / D is zero.
        let c: [f64; C] = std::array::from_fn(|channel| {
            let explained: f64 = densities.iter().zip(&beta).map(|(w, beta)| w * beta[channel]).sum();
            (balance[channel] - explained / rounds) / total
        });
        std::array::from_fn(|k| std::array::from_fn(|channel| self.counts[k] * c[channel] + beta[k][channel]))
    }

    /// The technique matrix `A`, estimated. Zero without rounds.
    pub fn technique_matrix(&self) -> [[f64; K]; K] {
        let scale = if self.rounds == 0 { 0.0 } else { 1.0 / self.rounds as f64 };
        std::array::from_fn(|i| std::array::from_fn(|j| scale * self.matrix[i.min(j)][i.max(j)]))
    }

    /// The contribution vectors `b`, estimated, by technique and channel. Zero without rounds.
    pub fn contribution_vectors(&self) -> [[f64; C]; K] {
        let scale = if self.rounds == 0 { 0.0 } else { 1.0 / self.rounds as f64 };
        self.contributions.map(|b| b.map(|b| scale * b))
    }

    /// `Σ W` over samples, which is `A n`.
    fn density_sums(&self) -> [f64; K] {
        std::array::from_fn(|i| (0..K).map(|j| self.matrix[i.min(j)][i.max(j)] * self.counts[j]).sum())
    }

    /// The coefficients `β` of the regression of `f / D` on the `pₖ / D`.
    fn regression(&self) -> [[f64; C]; K] {
        let samples = self.rounds as f64 * self.counts.iter().sum::<f64>();
        let densities = self.density_sums();
        let sums: [f64; C] = self.balance().map(|b| b * self.rounds as f64);
        // Every density on its own scale, so that small ones are not taken for rounding errors of large ones.
        let scale: [f64; K] = std::array::from_fn(|k| {
            let square = self.matrix[k][k];
            if square > 0.0 { 1.0 / square.sqrt() } else { 0.0 }
        });
        let covariance = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let product = if i <= j { self.matrix[i][j] } else { self.matrix[j][i] };
                (product - densities[i] * densities[j] / samples) * scale[i] * scale[j]
            })
        });
        let with_values = std::array::from_fn(|k| {
            std::array::from_fn(|channel| {
                (self.contributions[k][channel] - densities[k] * sums[channel] / samples) * scale[k]
            })
        });
        let mut beta = pseudo_solve(covariance, &with_values, CUTOFF, CUTOFF);
        for (beta, scale) in beta.iter_mut().zip(scale) {
            *beta = beta.map(|b| b * scale);
        }
        beta
    }
}

/// Rounds before `β` is first made: with fewer than eight samples for each technique its noise would outweigh what it gains.
fn first_update<const K: usize>(counts: [u64; K]) -> u64 {
    (8 * K as u64).div_ceil(counts.iter().sum::<u64>().max(1)).max(2)
}

/// The numbers of an estimator, in the order of its fields.
#[derive(Serialize, Deserialize)]
struct Flat {
    counts: Vec<f64>,
    rounds: u64,
    invalid: u64,
    matrix: Vec<f64>,
    contributions: Vec<f64>,
    round_densities: Vec<f64>,
    round_sum: Vec<f64>,
    beta: Vec<f64>,
    next_update: u64,
    progressive: Vec<Running>,
}

impl<const K: usize, const C: usize> Serialize for Optimal<K, C> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let flat = Flat {
            counts: self.counts.to_vec(),
            rounds: self.rounds,
            invalid: self.invalid,
            matrix: self.matrix.as_flattened().to_vec(),
            contributions: self.contributions.as_flattened().to_vec(),
            round_densities: self.round_densities.to_vec(),
            round_sum: self.round_sum.to_vec(),
            beta: self.beta.as_flattened().to_vec(),
            next_update: self.next_update,
            progressive: self.progressive.to_vec(),
        };
        flat.serialize(serializer)
    }
}

impl<'de, const K: usize, const C: usize> Deserialize<'de> for Optimal<K, C> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        fn array<T: Copy, const N: usize, E: serde::de::Error>(values: &[T]) -> Result<[T; N], E> {
            values.try_into().map_err(|_| E::invalid_length(values.len(), &"one number for each technique or channel"))
        }
        fn table<const R: usize, const W: usize, E: serde::de::Error>(values: &[f64]) -> Result<[[f64; W]; R], E> {
            if values.len() != R * W {
                return Err(E::invalid_length(values.len(), &"one number for each technique and channel"));
            }
            Ok(std::array::from_fn(|r| std::array::from_fn(|c| values[r * W + c])))
        }
        let flat = Flat::deserialize(deserializer)?;
        if K == 0 {
            return Err(D::Error::custom("no techniques"));
        }
        Ok(Self {
            counts: array(&flat.counts)?,
            rounds: flat.rounds,
            invalid: flat.invalid,
            matrix: table(&flat.matrix)?,
            contributions: table(&flat.contributions)?,
            round_densities: array(&flat.round_densities)?,
            round_sum: array(&flat.round_sum)?,
            beta: table(&flat.beta)?,
            next_update: flat.next_update,
            progressive: array(&flat.progressive)?,
        })
    }
}
