//! The neighbours that a pixel looks at, and what they count.

use std::collections::BTreeMap;

use luz_sample::point_set::{Request, normal_probability};

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

    /// The pattern with the frames that exist: those from `first` to `last`, relative to the pixel's.
    pub fn within_frames(&self, first: i32, last: i32) -> Self {
        let mut kept = Self { centre_weight: self.centre_weight, ..Self::default() };
        for (&offset, &weight) in self.offsets.iter().zip(&self.log2_weights) {
            if (first..=last).contains(&offset[2]) {
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
    MEMBERS.iter().map(|&member| sampled_member(window, sampling, seed, member)).collect()
}

/// The number of neighbours that a sampling draws from a window.
pub(crate) fn count(window: &Window, samples: SampleCount) -> usize {
    match samples {
        SampleCount::Count(n) => n as usize,
        SampleCount::Windows(c) => (f64::from(c) * (2 * window.radius + 1) as f64).round() as usize,
    }
}

fn sampled_member(window: &Window, sampling: &Sampling, seed: u64, member: u32) -> Pattern {
    let count = count(window, sampling.samples).max(1);
    let dimensions = if window.frame_radius > 0 { 3 } else { 2 };
    let request = Request { dimensions, count, seed, member, members: (PHASES * PHASES) as u32 };
    let axes = [Axis::new(window.sigma, window.radius), Axis::new(window.sigma_frames, window.frame_radius)];
    let axis = |d: usize| &axes[usize::from(d == 2)];
    let points = sampling.strategy.points();
    let drawn = match sampling.density {
        Density::Gaussian => points.normal(&request, std::array::from_fn(|d| axis(d).limit)),
        Density::Uniform => points.uniform(&request),
    };
    let mut counts: BTreeMap<[i32; 3], u32> = BTreeMap::new();
    for point in drawn {
        let offset: [i32; 3] =
            std::array::from_fn(|d| if d < dimensions { axis(d).pixel(point[d], sampling.density) } else { 0 });
        *counts.entry([offset[2], offset[1], offset[0]]).or_default() += 1;
    }
    let mut pattern = Pattern { centre_weight: 1.0, ..Pattern::default() };
    for ([t, y, x], times) in counts {
        let offset = [x, y, t];
        if offset != [0; 3] {
            let p: f64 = (0..dimensions).map(|d| axis(d).probability(offset[d], sampling.density)).product();
            pattern.push(offset, window.log2_weight(offset) + (f64::from(times) / (count as f64 * p)).log2());
        }
    }
    pattern
}

/// The Gaussian along an axis, restricted to the window's pixels.
struct Axis {
    sigma: f64,
    radius: i32,
    /// The outer edge of the last pixel, in σ.
    limit: f64,
}

impl Axis {
    fn new(sigma: f64, radius: usize) -> Self {
        Self { sigma, radius: radius as i32, limit: (radius as f64 + 0.5) / sigma }
    }

    /// The pixel that a point falls on.
    fn pixel(&self, point: f64, density: Density) -> i32 {
        let place = match density {
            Density::Gaussian => (point * self.sigma).round() as i32,
            Density::Uniform => (point * f64::from(2 * self.radius + 1)) as i32 - self.radius,
        };
        place.clamp(-self.radius, self.radius)
    }

    /// The probability that a point falls on a pixel.
    fn probability(&self, pixel: i32, density: Density) -> f64 {
        match density {
            Density::Uniform => 1.0 / f64::from(2 * self.radius + 1),
            Density::Gaussian => {
                let edge = |i: f64| (f64::from(pixel) + i) / self.sigma;
                normal_probability(edge(-0.5), edge(0.5)) / normal_probability(-self.limit, self.limit)
            }
        }
    }
}

#[cfg(test)]
mod tests;
