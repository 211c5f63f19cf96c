//! How the filter is computed.

use luz_sample::point_set::{self, PointSet};
use serde::Serialize;

pub use crate::simd::Precision;

/// How the filter is computed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum Method {
    /// All neighbours in the window: the reference, `O(k²)` per pixel.
    Exact,
    /// A Monte Carlo estimate from some neighbours, `O(n)` per pixel.
    Sampled(Sampling),
    /// For guides of a single channel: sums of cosines for both Gaussians, `O(1)` per pixel whatever the window
    /// (Sugimoto and Kamata 2015, "Compressive Bilateral Filtering").
    Cosines {
        /// How close the result is to be to the exact one: peak signal-to-noise ratio in dB with a peak of 1.
        quality: f64,
    },
    /// The fastest of the others, and as many samples as are needed, for a quality. Some pixels are filtered exactly to
    /// find out.
    Auto {
        /// How close the result is to be to the exact one: peak signal-to-noise ratio in dB with a peak of 1.
        quality: f64,
    },
}

/// How neighbours are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Sampling {
    /// The point set.
    pub strategy: Strategy,
    /// How many neighbours.
    pub samples: SampleCount,
    /// From which density.
    pub density: Density,
    /// Whether estimates are fitted to the image locally, which lowers the variance of few samples, about `k` or fewer, and
    /// brings a bias that more don't need.
    pub regression: bool,
    /// How exactly the range Gaussian is computed.
    pub precision: Precision,
}

impl Default for Sampling {
    fn default() -> Self {
        Self {
            strategy: Strategy::Vogel,
            samples: SampleCount::Windows(2.0),
            density: Density::Gaussian,
            regression: false,
            precision: Precision::Fine,
        }
    }
}

/// Point sets from which neighbours are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
pub enum Strategy {
    /// Independent points, by Box and Muller's method.
    Random,
    /// One point in each cell of equal probability, jittered.
    Stratified,
    /// A regular grid, at a random place.
    Grid,
    /// Points that keep their distance: blue noise in the Gaussian's own measure.
    PoissonDisk,
    /// Sobol's sequence, Owen-scrambled.
    Sobol,
    /// A golden-angle spiral through the Gaussian's inverse radius (Vogel 1979).
    #[default]
    Vogel,
}

impl Strategy {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Random, Self::Stratified, Self::Grid, Self::PoissonDisk, Self::Sobol, Self::Vogel];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Stratified => "stratified",
            Self::Grid => "grid",
            Self::PoissonDisk => "poisson-disk",
            Self::Sobol => "sobol",
            Self::Vogel => "vogel",
        }
    }

    /// Its points.
    pub fn points(self) -> &'static dyn PointSet {
        match self {
            Self::Random => &point_set::Random,
            Self::Stratified => &point_set::Stratified,
            Self::Grid => &point_set::Grid,
            Self::PoissonDisk => &point_set::PoissonDisk,
            Self::Sobol => &point_set::Sobol,
            Self::Vogel => &point_set::Vogel,
        }
    }

    /// The strategy of a [name](Self::name).
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|s| s.name() == name)
    }
}

/// A number of neighbours.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum SampleCount {
    /// This many times the window's width `k` in pixels.
    Windows(f32),
    /// This many.
    Count(u32),
}

/// The density from which neighbours are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
pub enum Density {
    /// The spatial Gaussian `f_s`, so that only `g_r` remains in the weights.
    #[default]
    Gaussian,
    /// Uniform over the window, with `f_s` in the weights.
    Uniform,
}
