//! Russian roulette and splitting: how often a random walk goes on from where it is.
//!
//! A walk of weight (*throughput*) `T` has come to a place from which what is still to be had is estimated by `R`, of mean
//! `M`, variance `V` and cost `C`. It goes on a random number of times, `n` in the mean, and each continuation carries a
//! weight that makes up for the number ([`Continuations::draw`]). Whatever `n > 0` is, and however it was come by, the
//! estimate stays unbiased, as long as `n` does not look at what the continuations are going to find. For the variance of
//! the whole estimate this adds
//!
//! ```text
//! (1)   T² V / n                  if n ≥ 1 (splitting),
//! (2)   T² ((V + M²) / n − M²)    if n ≤ 1 (Russian roulette),
//! ```
//!
//! and `n C` for its cost. [`Roulette`] names what to make of that:
//!
//! * never end a walk, never split it;
//! * [`throughput_survival`]: `n` in proportion to the throughput, at most one;
//! * [`Efficiency`]: the `n` at which the efficiency, one over variance times cost, of the whole image (or whichever set of
//!   integrals) is largest, from estimates of `M`, `V` and `C` of earlier walks ([`Outcomes`]).
//!
//! Sources: Arvo and Kirk 1990, "Particle Transport and Image Synthesis"; Rath et al. 2022, "EARS: Efficiency-Aware Russian
//! Roulette and Splitting".

use std::fmt;
use std::str::FromStr;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::statistics::Running;

/// How the expected number of continuations is chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Roulette {
    /// One, always. Walks end where they leave, or at their greatest length.
    None,
    /// By throughput, see [`throughput_survival`]; never more than one.
    #[default]
    Throughput,
    /// By what is still to be had and what it costs, see [`Efficiency`].
    Efficiency,
}

impl Roulette {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::None, Self::Throughput, Self::Efficiency];

    const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Throughput => "throughput",
            Self::Efficiency => "efficiency",
        }
    }
}

impl fmt::Display for Roulette {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A text that names no [`Roulette`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParseRouletteError {
    text: String,
}

impl fmt::Display for ParseRouletteError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}` is no Russian roulette: expected one of", self.text)?;
        Roulette::ALL.iter().try_for_each(|kind| write!(f, " `{kind}`"))
    }
}

impl std::error::Error for ParseRouletteError {}

impl FromStr for Roulette {
    type Err = ParseRouletteError;

    /// Reads `none`, `throughput` or `efficiency`.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let found = Self::ALL.into_iter().find(|kind| kind.name() == text);
        found.ok_or_else(|| ParseRouletteError { text: text.to_owned() })
    }
}

/// The least and the largest expected number of continuations that is let pass.
///
/// The least must be positive if estimates are to stay unbiased where a statistic wrongly says that nothing is to be had.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// No walk is ended with a probability above one minus this.
    pub least: f32,
    /// No walk is split into more, in the mean.
    pub most: f32,
}

impl Limits {
    /// Roulette alone, which leaves even the strongest walk a chance of one in twenty to end.
    pub const ROULETTE: Self = Self { least: 0.05, most: 0.95 };

    /// From one in twenty to twenty, for [`Efficiency`] (the range of Rath et al. 2022).
    pub const SPLITTING: Self = Self { least: 0.05, most: 20.0 };

    /// The number within the limits that is nearest to `expected`; one for NaN.
    #[inline]
    pub fn clamp(&self, expected: f32) -> f32 {
        if expected.is_nan() { 1.0 } else { expected.min(self.most).max(self.least) }
    }
}

/// A number of continuations, and the weight of each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Continuations {
    /// How often the walk goes on.
    pub count: u32,
    /// By what each continuation's throughput is to be multiplied; 0 where there are none.
    pub weight: f32,
}

impl Continuations {
    /// The walk goes on as it is.
    pub const ONE: Self = Self { count: 1, weight: 1.0 };

    /// The walk ends.
    pub const NONE: Self = Self { count: 0, weight: 0.0 };

    /// How many continuations there are if `expected` are expected, given a uniform number `u ∈ [0, 1)`.
    ///
    /// Below one: a single one with probability `expected` and weight `1 / expected`. From one on: `expected` rounded down
    /// or up, at random so that its mean is kept, each with one over that number for a weight; the weights then sum to one
    /// with certainty, and only the mean of the reciprocal, `(1 − t) / ⌊n⌋ + t / ⌈n⌉` with the fraction `t` of `n`, is a little
    /// above the `1 / n` of equation (1).
    ///
    /// Probabilities are rounded up to a multiple of `2⁻²⁴`, and weights fit that, so that there is no bias if `u` is of as
    /// many bits. Zero or less ends the walk, NaN lets it go on as it is, and more than 65536 are not to be had.
    #[inline]
    pub fn draw(expected: f32, u: f32) -> Self {
        const UNIT: f32 = (1u32 << 24) as f32;
        const MOST: f32 = 65536.0;
        if expected >= 1.0 {
            let expected = expected.min(MOST);
            let whole = expected.floor();
            let count = whole as u32 + u32::from(u < expected - whole);
            Self { count, weight: 1.0 / count as f32 }
        } else if expected > 0.0 {
            let probability = (expected * UNIT).ceil() / UNIT;
            if u < probability { Self { count: 1, weight: 1.0 / probability } } else { Self::NONE }
        } else if expected.is_nan() {
            Self::ONE
        } else {
            Self::NONE
        }
    }
}

/// The classic choice of an expected number of continuations: the largest component of the throughput, within limits.
///
/// By equation (2) with `M` and `C` alike everywhere, variance and cost are well spent if walks of all places go on with
/// like throughput.
#[inline]
pub fn throughput_survival(largest_throughput: f32, limits: &Limits) -> f32 {
    limits.clamp(largest_throughput)
}

/// What came of the walks that went on from a place: mean and variance of their estimates in `C` channels, and their cost.
///
/// Estimates are those of what is to be had from the place on, as if the walk had come there with throughput one. Costs are
/// in any unit that is the same everywhere; counted steps or rays rather than seconds, if results are to be reproducible.
/// Equal bits need the same outcomes pushed and merged in the same order, too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcomes<const C: usize> {
    estimates: [Running; C],
    cost: Running,
}

impl<const C: usize> Default for Outcomes<C> {
    fn default() -> Self {
        Self { estimates: [Running::new(); C], cost: Running::new() }
    }
}

impl<const C: usize> Outcomes<C> {
    /// Takes in the estimate of one continuation and what it cost. What is not finite is left out.
    pub fn push(&mut self, estimate: &[f64; C], cost: f64) {
        if cost.is_finite() && estimate.iter().all(|e| e.is_finite()) {
            for (running, &e) in self.estimates.iter_mut().zip(estimate) {
                running.push(e);
            }
            self.cost.push(cost);
        }
    }

    /// Takes in all that `other` has seen.
    pub fn merge(&mut self, other: &Self) {
        for (running, more) in self.estimates.iter_mut().zip(&other.estimates) {
            running.merge(more);
        }
        self.cost.merge(&other.cost);
    }

    /// How many continuations were seen.
    pub fn count(&self) -> u64 {
        self.cost.count()
    }

    /// The mean `M` of a channel's estimates; 0 where none was seen.
    pub fn mean(&self, channel: usize) -> f64 {
        self.estimates.get(channel).map_or(0.0, Running::mean)
    }

    /// The variance `V` of a channel's estimates; infinite below two.
    pub fn variance(&self, channel: usize) -> f64 {
        self.estimates.get(channel).map_or(f64::INFINITY, Running::variance)
    }

    /// The mean cost `C` of a continuation; 0 where none was seen.
    pub fn cost(&self) -> f64 {
        self.cost.mean()
    }
}

impl<const C: usize> Serialize for Outcomes<C> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (&self.estimates[..], self.cost).serialize(serializer)
    }
}

impl<'de, const C: usize> Deserialize<'de> for Outcomes<C> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (estimates, cost) = <(Vec<Running>, Running)>::deserialize(deserializer)?;
        let estimates = estimates.try_into();
        let estimates =
            estimates.map_err(|e: Vec<Running>| D::Error::invalid_length(e.len(), &"one for each channel"))?;
        Ok(Self { estimates, cost })
    }
}

/// The cost and the variance of the whole estimate per sample, to which the efficiency of a place is compared.
///
/// Minimising the product of variance `V₀` and cost `C₀` of the whole, to which a place contributes equations (1) or (2),
/// gives for its expected number of continuations (Rath et al. 2022)
///
/// ```text
/// (3)   n = T √(S / C · C₀ / V₀),    S = V if that is above one, S = V + M² if that is below one, else n = 1.
/// ```
///
/// `V₀` and `C₀` in turn depend on all `n`: render, measure them, choose again. With exact statistics the iteration converges
/// to the optimum, and any order of magnitude is good enough to begin with.
///
/// For an image, `V₀` and `C₀` are means over all pixels. If the error that matters is relative to the pixel, `V₀` is the mean of
/// the variances of a pixel's samples over the pixels' squared values, and throughputs are divided by the pixel's value
/// (an estimate of it, kept from zero).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Efficiency {
    /// `C₀ / V₀`.
    cost_per_variance: f64,
}

impl Efficiency {
    /// From the mean cost of a sample, in the unit of [`Outcomes`], and its mean variance. `None` where either is not
    /// positive and finite: nothing is known, or nothing is to be gained.
    pub fn new(cost: f64, variance: f64) -> Option<Self> {
        let cost_per_variance = cost / variance;
        let fine = |x: f64| x.is_finite() && x > 0.0;
        (fine(cost) && fine(variance) && fine(cost_per_variance)).then_some(Self { cost_per_variance })
    }

    /// The expected number of continuations of a walk of the given throughput by equation (3), where `T² S` is the mean of
    /// the channels' (so that the error that counts is the mean of the channels' squared errors). Not limited; one where
    /// fewer than two outcomes are known. Zero only where none of them found anything.
    pub fn expected<const C: usize>(&self, throughput: &[f64; C], outcomes: &Outcomes<C>) -> f64 {
        if outcomes.count() < 2 || C == 0 {
            return 1.0;
        }
        let (mut variance, mut second_moment) = (0.0, 0.0);
        for (t, running) in throughput.iter().zip(&outcomes.estimates) {
            let (m, v) = (running.mean(), running.variance());
            variance += t * t * v;
            second_moment += t * t * (v + m * m);
        }
        self.expected_of(second_moment / C as f64, variance / C as f64, outcomes.cost())
    }

    /// Equation (3), given `T² (V + M²)`, `T² V` and `C`. One where they make no sense.
    pub fn expected_of(&self, second_moment: f64, variance: f64, cost: f64) -> f64 {
        if !(cost > 0.0 && second_moment >= 0.0 && variance >= 0.0) {
            return 1.0;
        }
        let number = |square: f64| (square / cost * self.cost_per_variance).sqrt();
        let (split, survive) = (number(variance), number(second_moment));
        if survive < 1.0 {
            survive
        } else {
            // Between the two, either roulette or splitting would lose.
            split.max(1.0)
        }
    }
}
