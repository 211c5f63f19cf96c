//! The neighbours that a pixel looks at, and what they count.

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
