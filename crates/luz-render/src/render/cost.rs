//! What rendering costs.

use serde::{Deserialize, Serialize};

/// What rendering has cost so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RenderCost {
    /// Samples of pixels, one path or pair of subpaths each; candidates and mutations of Markov chains.
    pub paths: u64,
    /// Rays that asked for the closest hit.
    pub rays: u64,
    /// Rays that asked for any hit.
    pub shadow_rays: u64,
    /// Wall-clock seconds spent in passes.
    pub seconds: f64,
}

impl RenderCost {
    /// All rays per second.
    pub fn rays_per_second(&self) -> f64 {
        if self.seconds > 0.0 { (self.rays + self.shadow_rays) as f64 / self.seconds } else { 0.0 }
    }

    /// Adds what other passes have cost.
    pub fn add(&mut self, other: &Self) {
        self.paths = self.paths.saturating_add(other.paths);
        self.rays = self.rays.saturating_add(other.rays);
        self.shadow_rays = self.shadow_rays.saturating_add(other.shadow_rays);
        self.seconds += other.seconds;
    }
}
