//! Which light to ask.

use luz_geometry::Reference;
use luz_sample::distribution::{Discrete, DistributionError};

/// The share of choices that is spread evenly. By power alone, a weak light near a surface that a strong one hardly
/// reaches would be asked too rarely: little of the picture's error, but pixels full of fireflies.
const EVEN_SHARE: f64 = 0.25;

/// Chooses a light with a fixed probability: most of it in proportion to power, a share evenly among all lights that
/// have any.
#[derive(Clone, Debug)]
pub struct LightSelection {
    table: Discrete,
    probabilities: Vec<f32>,
}

impl LightSelection {
    /// Chooses among lights of the given powers; evenly among all if none has any.
    ///
    /// # Errors
    /// If a power is negative or not finite.
    pub fn by_power(powers: &[f64]) -> Result<Self, DistributionError> {
        let total: f64 = powers.iter().sum();
        let weights: Vec<f32> = if total > 0.0 && total.is_finite() {
            let even = EVEN_SHARE / powers.iter().filter(|p| **p > 0.0).count() as f64;
            let share = |p: f64| if p > 0.0 { (1.0 - EVEN_SHARE) * p / total + even } else { 0.0 };
            powers.iter().map(|&p| share(p) as f32).collect()
        } else {
            vec![1.0; powers.len()]
        };
        let table = Discrete::new(&weights)?;
        let probabilities = (0..powers.len()).map(|i| table.probability(i)).collect();
        Ok(Self { table, probabilities })
    }

    /// A light's number as seen from `reference`, the probability of choosing it, and a fresh number in `[0, 1)` made of what choosing has left
    /// of `u`; `None` if there are no lights.
    #[inline]
    pub fn sample(&self, reference: &Reference, u: f32) -> Option<(usize, f32, f32)> {
        let _ = reference;
        (!self.probabilities.is_empty()).then(|| self.table.sample(u))
    }

    /// The probability of choosing a light from `reference`.
    #[inline]
    pub fn probability(&self, reference: &Reference, light: usize) -> f32 {
        let _ = reference;
        self.probabilities[light]
    }
}
