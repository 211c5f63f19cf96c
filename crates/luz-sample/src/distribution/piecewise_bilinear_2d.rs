//! A density that interpolates a table.

use std::f64::consts::PI;

use glam::Vec2;

use super::DistributionError;
use super::cumulative::{CumulativeRows, density};
use super::error::check;
use crate::ONE_MINUS_EPSILON;
use crate::warp::linear;

/// What area means on the unit square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SquareMeasure {
    /// Area itself: `dx dy`.
    Flat,
    /// That of a sphere of which `x` is the longitude and `y` the polar angle: `sin(π y) dx dy`.
    Latitudes,
}

impl SquareMeasure {
    /// The integral of `a + (b − a) t` times the measure's weight at `y0 + t dy`, over `t` from 0 to `end`.
    fn integral(self, (y0, dy): (f64, f64), (a, b): (f64, f64), end: f64) -> f64 {
        match self {
            Self::Flat => end * (a + 0.5 * (b - a) * end),
            Self::Latitudes => {
                let (from, step) = (PI * y0, PI * dy);
                let ((sin_0, cos_0), (sin_1, cos_1)) = (from.sin_cos(), (from + step * end).sin_cos());
                let constant = (cos_0 - cos_1) / step;
                let linear = (sin_1 - sin_0) / (step * step) - end * cos_1 / step;
                a * constant + (b - a) * linear
            }
        }
    }

    fn weight(self, y: f64) -> f64 {
        match self {
            Self::Flat => 1.0,
            Self::Latitudes => (PI * y).sin(),
        }
    }

    /// The `t ∈ [0, 1)` up to which [`Self::integral`] is the share `u` of the whole.
    fn invert(self, row: (f64, f64), (a, b): (f64, f64), u: f32) -> f64 {
        let (y0, dy) = row;
        let (w0, w1) = (self.weight(y0), self.weight(y0 + dy));
        // Exact where the weight is constant, near elsewhere.
        let mut t = f64::from(linear(u, (a * w0) as f32, (b * w1) as f32));
        if self == Self::Flat {
            return t;
        }
        let target = f64::from(u) * self.integral(row, (a, b), 1.0);
        for _ in 0..5 {
            let slope = (a + (b - a) * t) * self.weight(y0 + dy * t);
            let step = (self.integral(row, (a, b), t) - target) / slope;
            if !step.is_finite() {
                break;
            }
            t = (t - step).clamp(0.0, f64::from(ONE_MINUS_EPSILON));
            if step.abs() < 1e-8 {
                break;
            }
        }
        t
    }
}

/// A density on the unit square that is proportional to the bilinear interpolation of a table of texels, whose values
/// are those of their centres. It is sampled by inversion: the cell between four centres by row and column, then within.
#[derive(Clone, Debug)]
pub struct PiecewiseBilinear2D {
    width: usize,
    height: usize,
    measure: SquareMeasure,
    /// The values on the lines through the texels' centres and along the square's edges: (width + 2) × (height + 2).
    grid: Vec<f32>,
    conditional: CumulativeRows,
    marginal: CumulativeRows,
    integral: f64,
}

impl PiecewiseBilinear2D {
    /// The density proportional to the interpolation of `width` × `height` texels.
    ///
    /// `grid` holds, row by row, the values at the texels' centres with a frame around them: the values along the edges
    /// of the square, where the first and last row and column lie. (Width + 2) × (height + 2) numbers, finite and not
    /// negative.
    pub fn new(grid: Vec<f32>, [width, height]: [usize; 2], measure: SquareMeasure) -> Result<Self, DistributionError> {
        if width == 0 || height == 0 {
            return Err(DistributionError::Empty);
        }
        if width >= 1 << 21 || height >= 1 << 21 {
            return Err(DistributionError::TooLarge);
        }
        let stride = width + 2;
        let expected = stride * (height + 2);
        if grid.len() != expected {
            return Err(DistributionError::Length { expected, found: grid.len() });
        }
        check(&grid)?;
        let mut conditional = CumulativeRows::new(width + 1, height + 1);
        let mut marginal = CumulativeRows::new(height + 1, 1);
        let totals: Vec<f64> = (0..=height)
            .map(|j| {
                let (top, bottom) = (&grid[j * stride..][..stride], &grid[(j + 1) * stride..][..stride]);
                let row @ (_, dy) = cell(j, height);
                let (first, second) =
                    (measure.integral(row, (1.0, 0.0), 1.0) * dy, measure.integral(row, (0.0, 1.0), 1.0) * dy);
                let mass = |i: usize| {
                    let mean = |line: &[f32]| 0.5 * (f64::from(line[i]) + f64::from(line[i + 1]));
                    (mean(top) * first + mean(bottom) * second) * cell(i, width).1
                };
                conditional.fill(j, (0..=width).map(mass))
            })
            .collect();
        let integral = totals.iter().sum();
        marginal.fill(0, totals.iter().copied());
        Ok(Self { width, height, measure, grid, conditional, marginal, integral })
    }

    /// The integral of the interpolation over the square, in its measure.
    pub fn integral(&self) -> f64 {
        self.integral
    }

    /// A point and its density, in the square's measure. The density may be zero where the table is, or nearly.
    #[inline]
    pub fn sample(&self, u: Vec2) -> (Vec2, f32) {
        let (row, v) = self.marginal.find(0, u.y);
        let (column, u) = self.conditional.find(row, u.x);
        let [a, b, c, d] = self.corners(column, row).map(f64::from);
        let span @ (y0, dy) = cell(row, self.height);
        let t = self.measure.invert(span, (a + b, c + d), v);
        let s = linear(u, (a + (c - a) * t) as f32, (b + (d - b) * t) as f32);
        let (x0, dx) = cell(column, self.width);
        let one = |v: f64| (v as f32).clamp(0.0, ONE_MINUS_EPSILON);
        let point = Vec2::new(one(x0 + dx * f64::from(s)), one(y0 + dy * t));
        (point, self.pdf(point))
    }

    /// The density at `p` in the square's measure; zero outside.
    #[inline]
    pub fn pdf(&self, p: Vec2) -> f32 {
        density(self.value(p), self.integral)
    }

    /// The interpolated value at `p`; zero outside the square.
    #[inline]
    pub fn value(&self, p: Vec2) -> f32 {
        if !(p.cmpge(Vec2::ZERO).all() && p.cmple(Vec2::ONE).all()) {
            return 0.0;
        }
        let (column, s) = locate(p.x, self.width);
        let (row, t) = locate(p.y, self.height);
        let [a, b, c, d] = self.corners(column, row);
        (1.0 - t) * ((1.0 - s) * a + s * b) + t * ((1.0 - s) * c + s * d)
    }

    #[inline]
    fn corners(&self, column: usize, row: usize) -> [f32; 4] {
        let stride = self.width + 2;
        let first = row * stride + column;
        [self.grid[first], self.grid[first + 1], self.grid[first + stride], self.grid[first + stride + 1]]
    }
}

/// Where a cell begins and how long it is, of those between the centres of `count` texels and the edges.
#[inline]
fn cell(index: usize, count: usize) -> (f64, f64) {
    let at = |i: usize| ((i as f64 - 0.5).clamp(0.0, count as f64)) / count as f64;
    let (from, to) = (at(index), at(index + 1));
    (from, to - from)
}

/// The cell of a coordinate in `[0, 1]`, and where in it, in `[0, 1]`.
#[inline]
fn locate(x: f32, count: usize) -> (usize, f32) {
    let scaled = x * count as f32 + 0.5;
    let index = (scaled as usize).min(count);
    let within = scaled - index as f32;
    // The first and the last cell are half as long.
    let within = if index == 0 {
        2.0 * within - 1.0
    } else if index == count {
        2.0 * within
    } else {
        within
    };
    (index, within.clamp(0.0, 1.0))
}
