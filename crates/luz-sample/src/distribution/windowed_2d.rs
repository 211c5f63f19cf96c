//! A piecewise constant density on any window of the unit square.

use glam::Vec2;

use super::DistributionError;
use super::error::check;
use crate::ONE_MINUS_EPSILON;

/// A window of the unit square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// The corner with the least coordinates.
    pub min: Vec2,
    /// The corner with the greatest.
    pub max: Vec2,
}

impl Window {
    /// The whole square.
    pub const ALL: Self = Self { min: Vec2::ZERO, max: Vec2::ONE };

    /// Whether `p` lies in it or on its border.
    #[inline]
    pub fn contains(&self, p: Vec2) -> bool {
        self.min.cmple(p).all() && p.cmple(self.max).all()
    }
}

/// A table of equal cells on the unit square, of which any window is sampled in proportion: by sums over all cells left
/// of and above each corner (Crow 1984, "Summed-Area Tables for Texture Mapping"; Bitterli, Novák, and Jarosz 2015,
/// "Portal-Masked Environment Map Sampling", section 4).
#[derive(Clone, Debug)]
pub struct WindowedPiecewiseConstant2D {
    width: usize,
    height: usize,
    values: Vec<f32>,
    /// (width + 1) × (height + 1) sums of values.
    sums: Vec<f64>,
}

impl WindowedPiecewiseConstant2D {
    /// The table of `values`, finite and not negative: rows of `width` along x, `height` of them along y, the first at
    /// `y = 0`.
    pub fn new(values: Vec<f32>, [width, height]: [usize; 2]) -> Result<Self, DistributionError> {
        if width == 0 || height == 0 {
            return Err(DistributionError::Empty);
        }
        if width > 1 << 21 || height > 1 << 21 {
            return Err(DistributionError::TooLarge);
        }
        if values.len() != width * height {
            return Err(DistributionError::Length { expected: width * height, found: values.len() });
        }
        check(&values)?;
        let stride = width + 1;
        let mut sums = vec![0.0; stride * (height + 1)];
        for (y, row) in values.chunks_exact(width).enumerate() {
            let mut sum = 0.0;
            for (x, value) in row.iter().enumerate() {
                sum += f64::from(*value);
                sums[(y + 1) * stride + x + 1] = sums[y * stride + x + 1] + sum;
            }
        }
        Ok(Self { width, height, values, sums })
    }

    /// The integral of the table over a window.
    pub fn integral(&self, window: &Window) -> f64 {
        let (x, y) = self.cells(window);
        self.mass(x, y) / (self.width * self.height) as f64
    }

    /// A point of the window and its density, in area; `None` where the table is zero all over it.
    #[inline]
    pub fn sample(&self, window: &Window, u: Vec2) -> Option<(Vec2, f32)> {
        let ([x0, x1], [y0, y1]) = self.cells(window);
        let total = self.mass([x0, x1], [y0, y1]);
        if total.is_nan() || total <= 0.0 {
            return None;
        }
        let x = invert([x0, x1], f64::from(u.x) * total, |x| self.mass([x0, x], [y0, y1]));
        let column = (x as usize).min(self.width - 1) as f64;
        let column_total = self.mass([column, column + 1.0], [y0, y1]);
        let y = invert([y0, y1], f64::from(u.y) * column_total, |y| self.mass([column, column + 1.0], [y0, y]));
        let point = Vec2::new((x / self.width as f64) as f32, (y / self.height as f64) as f32);
        let point = point.clamp(window.min, window.max.min(Vec2::splat(ONE_MINUS_EPSILON)).max(window.min));
        let density = self.density(point, total);
        (density > 0.0).then_some((point, density))
    }

    /// The density at `p` of drawing from a window, in area; zero outside.
    #[inline]
    pub fn pdf(&self, window: &Window, p: Vec2) -> f32 {
        if !window.contains(p) {
            return 0.0;
        }
        let (x, y) = self.cells(window);
        self.density(p, self.mass(x, y))
    }

    /// The value of the cell that holds `p`.
    #[inline]
    pub fn value(&self, p: Vec2) -> f32 {
        let x = ((p.x * self.width as f32).max(0.0) as usize).min(self.width - 1);
        let y = ((p.y * self.height as f32).max(0.0) as usize).min(self.height - 1);
        self.values[y * self.width + x]
    }

    #[inline]
    fn density(&self, p: Vec2, mass: f64) -> f32 {
        if mass > 0.0 { (f64::from(self.value(p)) * (self.width * self.height) as f64 / mass) as f32 } else { 0.0 }
    }

    /// A window in cells.
    #[inline]
    fn cells(&self, window: &Window) -> ([f64; 2], [f64; 2]) {
        let along = |min: f32, max: f32, count: usize| {
            let at = |x: f32| f64::from(x.clamp(0.0, 1.0)) * count as f64;
            [at(min), at(max.max(min))]
        };
        (along(window.min.x, window.max.x, self.width), along(window.min.y, window.max.y, self.height))
    }

    /// The sum of all cells, and parts of cells, in `x × y`.
    #[inline]
    fn mass(&self, [x0, x1]: [f64; 2], [y0, y1]: [f64; 2]) -> f64 {
        (self.sum(x1, y1) - self.sum(x0, y1)) - (self.sum(x1, y0) - self.sum(x0, y0))
    }

    /// The sum left of and above a point, which is bilinear in every cell.
    #[inline]
    fn sum(&self, x: f64, y: f64) -> f64 {
        let column = (x as usize).min(self.width - 1);
        let row = (y as usize).min(self.height - 1);
        let (s, t) = (x - column as f64, y - row as f64);
        let first = row * (self.width + 1) + column;
        let lerp = |i: usize| self.sums[i] + s * (self.sums[i + 1] - self.sums[i]);
        let (top, bottom) = (lerp(first), lerp(first + self.width + 1));
        top + t * (bottom - top)
    }
}

/// Where in an interval a function that grows from zero, linear between whole numbers, reaches `target`.
#[inline]
fn invert([from, to]: [f64; 2], target: f64, grown: impl Fn(f64) -> f64) -> f64 {
    // The cell in which it is reached: at its end there is more.
    let (mut low, mut high) = (from.floor(), to.ceil());
    while high - low > 1.0 {
        let middle = ((low + high) / 2.0).floor();
        if grown(middle.clamp(from, to)) <= target { low = middle } else { high = middle }
    }
    let (a, b) = (low.max(from), high.min(to));
    let (before, after) = (grown(a), grown(b));
    let share = if after > before { ((target - before) / (after - before)).clamp(0.0, 1.0) } else { 0.5 };
    // Stay within the cell.
    (a + share * (b - a)).clamp(a, a.max(b.next_down()))
}
