//! A discrete distribution.

use super::DistributionError;
use super::error::check;
use crate::ONE_MINUS_EPSILON;

/// One of equally probable bins, cut in two: its own outcome below `threshold`, another outcome above.
#[derive(Clone, Copy, Debug)]
struct Bin {
    threshold: f32,
    alias: u32,
    /// How much probability, in bins, the alias has in other parts that come before this one.
    offset: f32,
}

/// Outcomes `0..len` with probabilities proportional to given weights, sampled in constant time by an alias table
/// (Walker 1974; built as in Vose 1991).
#[derive(Clone, Debug)]
pub struct Discrete {
    bins: Vec<Bin>,
    probabilities: Vec<f32>,
    /// For every outcome, the bins that have it as alias, in order of `offset`: `parts[starts[i]..starts[i + 1]]`.
    parts: Vec<u32>,
    starts: Vec<u32>,
    sum: f64,
}

impl Discrete {
    /// The distribution of the given weights, finite and not negative.
    pub fn new(weights: &[f32]) -> Result<Self, DistributionError> {
        check(weights)?;
        let n = weights.len();
        if u32::try_from(n).is_err() {
            return Err(DistributionError::TooLarge);
        }
        let sum: f64 = weights.iter().copied().map(f64::from).sum();
        let mut bins: Vec<Bin> = (0..n as u32).map(|i| Bin { threshold: 1.0, alias: i, offset: 0.0 }).collect();
        if sum == 0.0 {
            let (parts, starts) = (Vec::new(), vec![0; n + 1]);
            return Ok(Self { bins, probabilities: vec![0.0; n], parts, starts, sum });
        }
        let probabilities: Vec<f32> = weights.iter().map(|&w| (f64::from(w) / sum) as f32).collect();
        // Probabilities in bins, one on average. What underflows is impossible.
        let in_bins = |(&w, &p): (&f32, &f32)| if p > 0.0 { f64::from(w) * (n as f64 / sum) } else { 0.0 };
        let mut rest: Vec<f64> = weights.iter().zip(&probabilities).map(in_bins).collect();
        let (mut small, mut large): (Vec<u32>, Vec<u32>) = (0..n as u32).partition(|&i| rest[i as usize] < 1.0);
        let heaviest = (0..n).fold(0, |best, i| if weights[i] > weights[best] { i } else { best }) as u32;
        while let Some(s) = small.pop() {
            let l = match large.last() {
                Some(&l) => l,
                // Only rounding leaves a bin without a partner: its own outcome fills it, unless that is impossible.
                None if probabilities[s as usize] > 0.0 => continue,
                None => heaviest,
            };
            bins[s as usize].threshold = rest[s as usize] as f32;
            bins[s as usize].alias = l;
            rest[l as usize] -= 1.0 - rest[s as usize];
            if rest[l as usize] < 1.0 && large.last() == Some(&l) {
                large.pop();
                small.push(l);
            }
        }
        let (parts, starts) = index_parts(&mut bins);
        Ok(Self { bins, probabilities, parts, starts, sum })
    }

    /// How many outcomes there are, impossible ones included.
    pub fn len(&self) -> usize {
        self.bins.len()
    }

    /// Never: a table without values is an error.
    pub fn is_empty(&self) -> bool {
        self.bins.is_empty()
    }

    /// The sum of the weights.
    pub fn sum(&self) -> f64 {
        self.sum
    }

    /// An outcome, its probability, and a number in `[0, 1)` that is uniform given the outcome, to be used again.
    ///
    /// The probability is positive unless all weights are zero. Of the 24 bits of `u`, the choice takes about
    /// `log2(len / probability)`.
    #[inline]
    pub fn sample(&self, u: f32) -> (usize, f32, f32) {
        // Exact in f64: 24 bits of u, 32 of the length.
        let scaled = f64::from(u.clamp(0.0, ONE_MINUS_EPSILON)) * self.bins.len() as f64;
        let index = (scaled as usize).min(self.bins.len() - 1);
        let position = (scaled - index as f64) as f32;
        let bin = self.bins[index];
        let (outcome, within) = if position < bin.threshold {
            (index, position)
        } else {
            (bin.alias as usize, bin.offset + (position - bin.threshold))
        };
        let probability = self.probabilities[outcome];
        let remapped = within / (probability * self.bins.len() as f32);
        (outcome, probability, remapped.min(ONE_MINUS_EPSILON))
    }

    /// The probability of an outcome; zero for one that is not there.
    #[inline]
    pub fn probability(&self, index: usize) -> f32 {
        self.probabilities.get(index).copied().unwrap_or(0.0)
    }

    /// The `u` that [`Self::sample`] maps to the outcome `index` and the number `remapped`, up to rounding; `None` for an
    /// outcome that is impossible or not there.
    pub fn invert(&self, index: usize, remapped: f32) -> Option<f32> {
        let probability = self.probability(index);
        if probability == 0.0 {
            return None;
        }
        let n = self.bins.len() as f32;
        let within = remapped.clamp(0.0, 1.0) * probability * n;
        let own = self.bins[index];
        let parts = &self.parts[self.starts[index] as usize..self.starts[index + 1] as usize];
        let (bin, position) = if parts.is_empty() || within < own.threshold {
            (index, within.min(own.threshold))
        } else {
            let after = parts.partition_point(|&b| self.bins[b as usize].offset <= within);
            let bin = parts[after.max(1) - 1] as usize;
            let part = self.bins[bin];
            (bin, (within - part.offset + part.threshold).clamp(part.threshold, 1.0))
        };
        let u = (bin as f64 + f64::from(position.min(ONE_MINUS_EPSILON))) / f64::from(n);
        Some((u as f32).min(ONE_MINUS_EPSILON))
    }
}

/// Lays the parts of every outcome end to end, its own bin's first; sets `offset` in every bin, and lists the bins by alias.
fn index_parts(bins: &mut [Bin]) -> (Vec<u32>, Vec<u32>) {
    let n = bins.len();
    let mut starts = vec![0u32; n + 1];
    let is_part = |i: usize, bin: Bin| bin.alias as usize != i && bin.threshold < 1.0;
    for (i, &bin) in bins.iter().enumerate() {
        if is_part(i, bin) {
            starts[bin.alias as usize + 1] += 1;
        }
    }
    for i in 0..n {
        starts[i + 1] += starts[i];
    }
    let mut next = starts.clone();
    let mut filled: Vec<f64> = bins.iter().map(|bin| f64::from(bin.threshold)).collect();
    let mut parts = vec![0u32; starts[n] as usize];
    for (i, bin) in bins.iter_mut().enumerate().filter(|(i, bin)| is_part(*i, **bin)) {
        let alias = bin.alias as usize;
        parts[next[alias] as usize] = i as u32;
        next[alias] += 1;
        bin.offset = filled[alias] as f32;
        filled[alias] += 1.0 - f64::from(bin.threshold);
    }
    (parts, starts)
}
