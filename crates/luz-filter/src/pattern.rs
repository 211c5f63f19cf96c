//! The neighbours that a pixel looks at, and what they count.

use std::ops::RangeInclusive;

use luz_sample::point_set::{Request, normal_probability};
use rayon::prelude::*;

use crate::{Density, SampleCount, Sampling};

/// The neighbours of a pixel, without itself.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pattern {
    /// Where: columns, rows, frames.
    pub offsets: Vec<[i32; 3]>,
    /// The base-two logarithms of their spatial weights.
    pub log2_weights: Vec<f64>,
    /// The spatial weight of the pixel itself.
    pub centre_weight: f64,
}

impl Pattern {
    /// Adds a neighbour of a positive weight.
    pub fn push(&mut self, offset: [i32; 3], weight_log2: f64) {
        self.offsets.push(offset);
        self.log2_weights.push(weight_log2);
    }

    /// The pattern with the frames that exist, relative to the pixel's.
    pub fn within_frames(&self, frames: &RangeInclusive<i32>) -> Self {
        let mut kept = Self { centre_weight: self.centre_weight, ..Self::default() };
        for (&offset, &weight) in self.offsets.iter().zip(&self.log2_weights) {
            if frames.contains(&offset[2]) {
                kept.push(offset, weight);
            }
        }
        kept
    }
}

/// All neighbours of the window: `f_s = exp(−x²/2σ_s² − t²/2σ_t²)` up to the radii in pixels and frames.
pub(crate) fn window(window: &Window) -> Pattern {
    let mut pattern = Pattern { centre_weight: 1.0, ..Pattern::default() };
    let (r, rt) = (window.radius as i32, window.frame_radius as i32);
    for t in -rt..=rt {
        for y in -r..=r {
            for x in -r..=r {
                if [x, y, t] != [0; 3] {
                    pattern.push([x, y, t], window.log2_weight([x, y, t]));
                }
            }
        }
    }
    pattern
}

/// The spatial Gaussian and its window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Window {
    /// σ_s in pixels.
    pub sigma: f64,
    /// R in pixels.
    pub radius: usize,
    /// σ_t in frames.
    pub sigma_frames: f64,
    /// The radius in frames; 0 for images.
    pub frame_radius: usize,
}

impl Window {
    /// How many pixels it has, over all frames.
    pub fn pixels(&self) -> usize {
        (2 * self.radius + 1).pow(2) * (2 * self.frame_radius + 1)
    }

    /// The base-two logarithm of the unnormalised `f_s`.
    pub fn log2_weight(&self, [x, y, t]: [i32; 3]) -> f64 {
        let square = |v: i32, sigma: f64| (f64::from(v) / sigma).powi(2);
        let time = if self.frame_radius == 0 { 0.0 } else { square(t, self.sigma_frames) };
        -0.5 * std::f64::consts::LOG2_E * (square(x, self.sigma) + square(y, self.sigma) + time)
    }
}

/// The patterns of drawn neighbours repeat after this many columns and rows.
pub(crate) const PHASES: usize = 4;

/// Which of the point sets' members each phase gets: neighbours in the image have members far apart (Bayer 1973).
const MEMBERS: [u32; PHASES * PHASES] = [0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5];

/// Neighbours that are drawn, a pattern for each phase.
///
/// Points are drawn from the Gaussian, restricted to the window, and moved to the nearest pixel `o`, which so has a
/// probability `p(o)`. Its weight is `f_s(o) / (n p(o))`, and as often as it is drawn; numerator and denominator of the
/// filter are unbiased. The pixel itself is no chance: it has its weight `f_s(0) = 1`, and draws of it are left out.
pub(crate) fn sampled(window: &Window, sampling: &Sampling, seed: u64) -> Vec<Pattern> {
    let axes = axes(window, sampling.density);
    MEMBERS.par_iter().map(|&member| sampled_member(&axes, window, sampling, seed, member)).collect()
}

/// The number of neighbours that a sampling draws from a window.
pub(crate) fn count(window: &Window, samples: SampleCount) -> usize {
    match samples {
        SampleCount::Count(n) => n as usize,
        SampleCount::Windows(c) => (f64::from(c) * (2 * window.radius + 1) as f64).round() as usize,
    }
}

fn sampled_member(axes: &[Axis; 3], window: &Window, sampling: &Sampling, seed: u64, member: u32) -> Pattern {
    let count = count(window, sampling.samples).max(1);
    let dimensions = if window.frame_radius > 0 { 3 } else { 2 };
    let request = Request { dimensions, count, seed, member, members: (PHASES * PHASES) as u32 };
    let points = sampling.strategy.points();
    let drawn = match sampling.density {
        Density::Gaussian => points.normal(&request, std::array::from_fn(|d| axes[d].limit)),
        Density::Uniform => points.uniform(&request),
    };
    // By frames, rows and columns: near in memory, and equal ones together.
    let mut offsets: Vec<[i32; 3]> = drawn
        .points
        .iter()
        .map(|point| {
            [2, 1, 0].map(|d: usize| if d < dimensions { axes[d].pixel(point[d], sampling.density) } else { 0 })
        })
        .collect();
    offsets.sort_unstable();
    let mut pattern = Pattern { centre_weight: 1.0, ..Pattern::default() };
    for same in offsets.chunk_by(|a, b| a == b).filter(|same| same[0] != [0; 3]) {
        let [t, y, x] = same[0];
        let log2 =
            axes[0].log2_ratio(x) + axes[1].log2_ratio(y) + if dimensions > 2 { axes[2].log2_ratio(t) } else { 0.0 };
        pattern.push([x, y, t], log2 + (same.len() as f64 / drawn.expected_count).log2());
    }
    pattern
}

/// The Gaussian along an axis, restricted to the window's pixels.
struct Axis {
    sigma: f64,
    radius: i32,
    /// The outer edge of the last pixel, in σ.
    limit: f64,
    /// The base-two logarithms of `f_s / p` for the pixels from `−radius` on.
    log2_ratios: Vec<f64>,
}

impl Axis {
    fn new(sigma: f64, radius: usize, density: Density) -> Self {
        let limit = (radius as f64 + 0.5) / sigma;
        let r = radius as i32;
        let total = normal_probability(-limit, limit);
        let log2_ratio = |i: i32| {
            let edge = |shift: f64| (f64::from(i) + shift) / sigma;
            let p = match density {
                Density::Uniform => 1.0 / f64::from(2 * r + 1),
                Density::Gaussian => normal_probability(edge(-0.5), edge(0.5)) / total,
            };
            -0.5 * std::f64::consts::LOG2_E * edge(0.0).powi(2) - p.log2()
        };
        // Both Gaussians are even.
        let half: Vec<f64> = (0..=r).map(log2_ratio).collect();
        let log2_ratios = (-r..=r).map(|i| half[i.unsigned_abs() as usize]).collect();
        Self { sigma, radius: r, limit, log2_ratios }
    }

    /// The pixel that a point falls on.
    fn pixel(&self, point: f64, density: Density) -> i32 {
        let place = match density {
            Density::Gaussian => (point * self.sigma).round() as i32,
            Density::Uniform => (point * f64::from(2 * self.radius + 1)) as i32 - self.radius,
        };
        place.clamp(-self.radius, self.radius)
    }

    /// The base-two logarithm of the Gaussian at a pixel over the probability that a point falls on it.
    fn log2_ratio(&self, pixel: i32) -> f64 {
        self.log2_ratios[(pixel + self.radius) as usize]
    }
}

/// The axes of columns, rows and frames.
fn axes(window: &Window, density: Density) -> [Axis; 3] {
    let space = || Axis::new(window.sigma, window.radius, density);
    [space(), space(), Axis::new(window.sigma_frames, window.frame_radius, density)]
}

#[cfg(test)]
mod tests;
