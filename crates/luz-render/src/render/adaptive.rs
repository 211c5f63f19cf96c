//! Adaptive sampling towards a uniform relative error, without bias.
//!
//! Whoever stops sampling a pixel when its variance looks small stops too early where the bright samples have not come yet:
//! the mean and the time of stopping depend on each other, and the picture gets darker. Here each pixel has two halves with
//! independent samples. After a pilot of fixed length, each half's number of samples is decided by the *other* half's pilot,
//! so that it is independent of the half's own values, and the mean of each half is unbiased; so is their mean with fixed
//! weights (Kirk and Arvo 1991, "Unbiased sampling techniques for image synthesis", for the bias and for drawing anew).
//!
//! With the mean μ and the variance σ² of one sample, a pixel needs n = σ² / (ε² (μ² + 0.01)) samples for its relative error,
//! as the relMSE of `luz compare` has it, to be ε. Both are taken from the pilots of a pixel's neighbours, too, since a pilot
//! is short and may have missed what is rare.

use crate::film::{Film, Pixel};
use serde::{Deserialize, Serialize};

/// What is added to squared means, so that black pixels need no samples: as in relMSE.
const DARKNESS: f64 = 0.01;
/// A pilot has this share of the most that a half may get, within these bounds.
const PILOT_SHARE: u32 = 8;
const SHORTEST_PILOT: u32 = 16;
const LONGEST_PILOT: u32 = 256;
/// How far a pixel looks at its neighbours' pilots; only within tiles of this size, so that tiles can be rendered apart.
const RADIUS: u32 = 2;
/// Width and height of tiles.
pub const TILE: u32 = 16;

/// How many samples the halves of every pixel are to get.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum SampleLimits {
    /// All the same.
    Uniform(u32),
    /// As many until the pilots are done.
    Undecided { target: f64, pilot: u32, most: u32 },
    /// For each pixel and half. Saved apart.
    Decided {
        /// What the error takes, however much that is.
        #[serde(skip)]
        limits: Vec<[u32; 2]>,
        /// The most that is given.
        #[serde(skip)]
        most: u32,
        #[serde(skip)]
        rounds: u32,
    },
}

impl SampleLimits {
    /// At most `most` samples, fewer where the relative error `target` takes fewer.
    pub fn new(target: Option<f64>, most: u32) -> Self {
        let Some(target) = target else { return Self::Uniform(most) };
        let pilot = (most / PILOT_SHARE).clamp(SHORTEST_PILOT, LONGEST_PILOT);
        if pilot >= most { Self::Uniform(most) } else { Self::Undecided { target, pilot, most } }
    }

    /// The limit of one half of a pixel.
    #[inline]
    pub fn of(&self, pixel: usize, half: usize) -> u32 {
        match self {
            Self::Uniform(limit) => *limit,
            Self::Undecided { pilot, .. } => *pilot,
            Self::Decided { limits, most, .. } => limits[pixel][half].min(*most),
        }
    }

    /// The largest number of samples that some half gets, as far as it is known.
    pub fn rounds(&self) -> u32 {
        match self {
            Self::Uniform(rounds) | Self::Undecided { most: rounds, .. } | Self::Decided { rounds, .. } => *rounds,
        }
    }

    /// How many rounds may follow without [`decide`](Self::decide).
    pub fn rounds_until_decision(&self, done: u32) -> u32 {
        match self {
            Self::Undecided { pilot, .. } => pilot.saturating_sub(done),
            _ => self.rounds().saturating_sub(done),
        }
    }

    /// The share of all samples that is done after so many rounds, as far as it is known.
    pub fn progress(&self, done: u32) -> f64 {
        match self {
            Self::Uniform(rounds) | Self::Undecided { most: rounds, .. } => {
                f64::from(done) / f64::from((*rounds).max(1))
            }
            Self::Decided { limits, most, .. } => {
                let up_to = |most: u32| limits.iter().flatten().map(|&l| u64::from(l.min(most))).sum::<u64>();
                up_to(done.min(*most)) as f64 / up_to(*most).max(1) as f64
            }
        }
    }

    /// Itself without the limits of pixels, and those.
    pub fn saved(&self) -> (Self, &[[u32; 2]]) {
        match self {
            Self::Decided { limits, .. } => (Self::Decided { limits: Vec::new(), most: 0, rounds: 0 }, limits),
            undecided => (undecided.clone(), &[]),
        }
    }

    /// What was saved, for so many pixels; `None` if it does not fit. How many samples there are to be at most is the present
    /// wish: a render may go on for more samples than it was begun for.
    pub fn restored(&self, saved: Self, limits: &[u8], pixels: usize) -> Option<Self> {
        match saved {
            Self::Decided { .. } => {
                let (chunks, rest) = limits.as_chunks::<8>();
                if !rest.is_empty() || chunks.len() != pixels {
                    return None;
                }
                let limits = chunks.iter().map(|bytes| bytemuck::pod_read_unaligned(bytes)).collect();
                Some(Self::decided(limits, self.most()))
            }
            _ if limits.is_empty() => Some(self.clone()),
            _ => None,
        }
    }

    /// Decides when the pilots are done.
    pub fn decide(&mut self, done: u32, film: &Film) {
        let Self::Undecided { target, pilot, most } = *self else { return };
        if done < pilot {
            return;
        }
        let needs = [0, 1].map(|half| needed(film, half, target));
        let clamp = |needed: f64| if needed.is_finite() { (needed.ceil() as u32).max(pilot) } else { u32::MAX };
        let is_ours = film.half(0).map(|pixel| pixel.count() > 0);
        // Crossed: each half obeys the other.
        let limits: Vec<[u32; 2]> = needs[1]
            .iter()
            .zip(&needs[0])
            .zip(is_ours)
            .map(
                |((&first, &second), is_ours)| {
                    if is_ours { [clamp(first / 2.0), clamp(second / 2.0)] } else { [pilot; 2] }
                },
            )
            .collect();
        *self = Self::decided(limits, most);
    }

    fn decided(limits: Vec<[u32; 2]>, most: u32) -> Self {
        let rounds = limits.iter().flatten().copied().max().unwrap_or(0).min(most);
        Self::Decided { limits, most, rounds }
    }

    /// The most samples that a half may get.
    fn most(&self) -> u32 {
        match self {
            Self::Uniform(most) | Self::Undecided { most, .. } | Self::Decided { most, .. } => *most,
        }
    }
}

/// How many samples each pixel needs, after the pilots of one half.
fn needed(film: &Film, half: usize, target: f64) -> Vec<f64> {
    let bounds = film.bounds();
    let pilots: Vec<[f64; 2]> = film.half(half).map(moments).collect();
    let (width, height) = (bounds.width(), bounds.height());
    let mut needed = Vec::with_capacity(pilots.len());
    for y in 0..height {
        for x in 0..width {
            let (columns, rows) = (window(x, bounds.x0, width), window(y, bounds.y0, height));
            let mut sums = [0.0; 2];
            for row in rows {
                for column in columns.clone() {
                    let [variance, square] = pilots[(row * width + column) as usize];
                    sums[0] += variance;
                    sums[1] += square + DARKNESS;
                }
            }
            needed.push(sums[0] / (target * target * sums[1]));
        }
    }
    needed
}

/// Variance of one sample and squared mean, averaged over the channels.
fn moments(pixel: &Pixel) -> [f64; 2] {
    let average = |values: [f64; 3]| values.iter().sum::<f64>() / 3.0;
    [average(pixel.sample_variance()), average(pixel.mean().map(|m| m * m))]
}

/// The neighbours of a place within the tile that it lies in, in coordinates of the film.
fn window(place: u32, origin: u32, size: u32) -> std::ops::Range<u32> {
    let tile = (place + origin) / TILE * TILE;
    let first = place.saturating_sub(RADIUS).max(tile.saturating_sub(origin));
    let end = (place + RADIUS + 1).min(tile + TILE - origin).min(size);
    first..end
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{FilmContents, PixelBounds};
    use luz_sample::random::Random;
    use luz_sample::statistics::Running;

    const BOUNDS: PixelBounds = PixelBounds { x0: 0, y0: 0, x1: 1, y1: 1 };

    /// The mean of a pixel of rare bright samples; each half gets as many as the limits give the half that it `obeys`.
    fn mean_of_pixel(seed: u64, obeys: [usize; 2]) -> f64 {
        let mut film = Film::new(FilmContents { halves: true, ..Default::default() }, BOUNDS);
        let mut limits = SampleLimits::new(Some(0.1), 256);
        let mut random = [Random::new(seed, 0, 0), Random::new(seed, 1, 0)];
        let mut done = 0;
        while done < limits.rounds() {
            let rounds = limits.rounds_until_decision(done);
            for half in [0, 1] {
                for _ in done..(done + rounds).min(limits.of(0, obeys[half])) {
                    let value = if random[half].next_f64() < 0.05 { 20.0 } else { 0.1 };
                    film.rows_mut()[0].add(0, half, [value; 3], 1.0);
                }
            }
            done += rounds;
            limits.decide(done, &film);
        }
        let mean = film.estimates().next().map(|pixel| pixel.mean[0]);
        mean.unwrap_or_default()
    }

    /// |z| < 4 over 20,000 pixels; where each half decides for itself instead, z is below −20.
    #[test]
    fn crossed_decisions_do_not_bias_the_mean() {
        let z = |obeys: [usize; 2]| {
            let mut means = Running::default();
            (0..20_000).for_each(|seed| means.push(mean_of_pixel(seed, obeys)));
            (means.mean() - (0.05 * 20.0 + 0.95 * f64::from(0.1_f32))) / means.standard_error()
        };
        let (crossed, own) = (z([0, 1]), z([1, 0]));
        assert!(crossed.abs() < 4.0, "z = {crossed}");
        assert!(own < -20.0, "z = {own}: the test must be able to fail");
    }

    #[test]
    fn windows_stay_within_their_tile() {
        assert_eq!(window(0, 0, 40), 0..3);
        assert_eq!(window(15, 0, 40), 13..16);
        assert_eq!(window(16, 0, 40), 16..19);
        assert_eq!(window(39, 0, 40), 37..40);
        // The film begins at column 5 of the frame, its first tile has 11 columns.
        assert_eq!(window(0, 5, 40), 0..3);
        assert_eq!(window(10, 5, 40), 8..11);
        assert_eq!(window(11, 5, 40), 11..14);
    }
}
