//! A piecewise constant density on a rectangle.

use glam::Vec2;

use super::DistributionError;
use super::cumulative::{Cells, CumulativeRows, density, without_underflow};
use super::error::check;

/// A density on a rectangle that is proportional to a table of equal cells, sampled by inversion: `y` from its marginal
/// density by `u.y`, then `x` from the row by `u.x`.
#[derive(Clone, Debug)]
pub struct PiecewiseConstant2D {
    columns: Cells,
    rows: Cells,
    values: Vec<f32>,
    conditional: CumulativeRows,
    marginal: CumulativeRows,
    integral: f64,
}

impl PiecewiseConstant2D {
    /// The density proportional to `values`, finite and not negative, over equal cells of `[0, 1]²`: rows of `width` along x,
    /// `height` of them along y, the first at `y = 0`.
    pub fn new(values: &[f32], [width, height]: [usize; 2]) -> Result<Self, DistributionError> {
        Self::with_domain(values, [width, height], Vec2::ZERO, Vec2::ONE)
    }

    /// As [`Self::new`], over the rectangle from `min` to `max`.
    pub fn with_domain(
        values: &[f32],
        [width, height]: [usize; 2],
        min: Vec2,
        max: Vec2,
    ) -> Result<Self, DistributionError> {
        if width == 0 || height == 0 {
            return Err(DistributionError::Empty);
        }
        let columns = Cells::new(min.x, max.x, width)?;
        let rows = Cells::new(min.y, max.y, height)?;
        if values.len() != width * height {
            return Err(DistributionError::Length { expected: width * height, found: values.len() });
        }
        check(values)?;
        // The density of a single cell must not overflow.
        let area = columns.width() * rows.width();
        if !(area.recip() as f32).is_finite() {
            return Err(DistributionError::Domain);
        }
        let integral = values.iter().copied().map(f64::from).sum::<f64>() * area;
        let values = without_underflow(values, integral);
        let mut conditional = CumulativeRows::new(width, height);
        let fill = |(i, row): (usize, &[f32])| conditional.fill(i, row.iter().copied().map(f64::from));
        let totals: Vec<f64> = values.chunks_exact(width).enumerate().map(fill).collect();
        let mut marginal = CumulativeRows::new(height, 1);
        marginal.fill(0, totals.iter().copied());
        Ok(Self { columns, rows, values, conditional, marginal, integral })
    }

    /// Width and height of the table.
    pub fn resolution(&self) -> [usize; 2] {
        [self.columns.count(), self.rows.count()]
    }

    /// The integral of the table over its rectangle.
    pub fn integral(&self) -> f64 {
        self.integral
    }

    /// A point and its density, in area. The density is positive unless all values are zero.
    #[inline]
    pub fn sample(&self, u: Vec2) -> (Vec2, f32) {
        let (row, y) = self.marginal.find(0, u.y);
        let (column, x) = self.conditional.find(row, u.x);
        let point = Vec2::new(self.columns.point(column, x), self.rows.point(row, y));
        (point, self.density(column, row))
    }

    /// The density at `p`, in area; zero outside the rectangle.
    #[inline]
    pub fn pdf(&self, p: Vec2) -> f32 {
        match (self.columns.index(p.x), self.rows.index(p.y)) {
            (Some(column), Some(row)) => self.density(column, row),
            _ => 0.0,
        }
    }

    /// The `u` that [`Self::sample`] maps to `p`, up to rounding; `None` outside the rectangle.
    #[inline]
    pub fn invert(&self, p: Vec2) -> Option<Vec2> {
        let (column, x) = self.columns.locate(p.x)?;
        let (row, y) = self.rows.locate(p.y)?;
        Some(Vec2::new(self.conditional.lerp(row, column, x), self.marginal.lerp(0, row, y)))
    }

    #[inline]
    fn density(&self, column: usize, row: usize) -> f32 {
        density(self.values[row * self.columns.count() + column], self.integral)
    }
}
