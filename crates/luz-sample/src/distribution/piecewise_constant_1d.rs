//! A piecewise constant density on an interval.

use super::DistributionError;
use super::cumulative::{Cells, CumulativeRows, density, without_underflow};
use super::error::check;

/// A density on an interval that is proportional to a step function of equal steps, sampled by inversion.
#[derive(Clone, Debug)]
pub struct PiecewiseConstant1D {
    cells: Cells,
    values: Vec<f32>,
    sums: CumulativeRows,
    integral: f64,
}

impl PiecewiseConstant1D {
    /// The density proportional to `values`, finite and not negative, over equal parts of `[0, 1]`.
    pub fn new(values: &[f32]) -> Result<Self, DistributionError> {
        Self::with_domain(values, 0.0, 1.0)
    }

    /// As [`Self::new`], over `[min, max]`.
    pub fn with_domain(values: &[f32], min: f32, max: f32) -> Result<Self, DistributionError> {
        check(values)?;
        let cells = Cells::new(min, max, values.len())?;
        let integral = values.iter().copied().map(f64::from).sum::<f64>() * cells.width();
        let values = without_underflow(values, integral);
        let mut sums = CumulativeRows::new(values.len(), 1);
        sums.fill(0, values.iter().copied().map(f64::from));
        Ok(Self { cells, values, sums, integral })
    }

    /// How many steps there are.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Never: a table without values is an error.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// The integral of the step function over its domain.
    pub fn integral(&self) -> f64 {
        self.integral
    }

    /// A point, its density (in length), and its step. The density is positive unless all values are zero.
    #[inline]
    pub fn sample(&self, u: f32) -> (f32, f32, usize) {
        let (index, offset) = self.sums.find(0, u);
        (self.cells.point(index, offset), self.density(index), index)
    }

    /// The density at `x`, in length; zero outside the domain.
    #[inline]
    pub fn pdf(&self, x: f32) -> f32 {
        self.cells.index(x).map_or(0.0, |index| self.density(index))
    }

    /// The `u` that [`Self::sample`] maps to `x`, up to rounding; `None` outside the domain.
    #[inline]
    pub fn invert(&self, x: f32) -> Option<f32> {
        let (index, offset) = self.cells.locate(x)?;
        Some(self.sums.lerp(0, index, offset))
    }

    #[inline]
    fn density(&self, index: usize) -> f32 {
        density(self.values[index], self.integral)
    }
}
