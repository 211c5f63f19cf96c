//! A table on the unit square of which any convex polygon is sampled.

use glam::{DVec2, Vec2};

use super::DistributionError;
use super::error::check;
use super::polygon::Polygon;
use crate::ONE_MINUS_EPSILON;

/// How often a texel is halved at most, where what steers says that it is large.
const MOST_HALVINGS: u32 = 16;

/// What part of a table is worth besides its texels: see [`TexelTree::sample`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steering {
    /// A factor on the part's weight, positive.
    pub factor: f32,
    /// True if the factor hardly varies over the part, so that it need not be asked about parts of it.
    pub is_settled: bool,
}

impl Steering {
    /// No preference.
    pub const NONE: Self = Self { factor: 1.0, is_settled: true };
}

/// A table of equal texels on the unit square, of which any convex polygon can be sampled in proportion, nearly, with the
/// exact density. What lies beyond the square is as the texel nearest to it.
///
/// A point is found by walking down a tree of sums that halves the table at each step (as the hierarchical warps of Clarberg
/// et al. 2005, "Wavelet Importance Sampling"), taking each half in proportion to its mean, the area of the part of the polygon in it,
/// and a factor that the caller may steer by. One tree serves all polygons.
#[derive(Clone, Debug)]
pub struct TexelTree {
    size: [usize; 2],
    /// From the whole table to its texels.
    levels: Vec<Level>,
}

#[derive(Clone, Debug)]
struct Level {
    /// Cells along each axis.
    count: [usize; 2],
    /// Texels of a cell along each axis, but for the last.
    cell: [usize; 2],
    /// Sums of the texels of each cell, row by row.
    sums: Vec<f32>,
}

impl Level {
    fn sum(&self, [i, j]: [usize; 2]) -> f32 {
        self.sums[j * self.count[0] + i]
    }
}

/// A cell, or part of a texel, with what of the polygon is in it.
#[derive(Clone, Copy)]
struct Part {
    level: usize,
    cell: [usize; 2],
    /// The span in texels.
    min: DVec2,
    max: DVec2,
    /// `None` where all of the span belongs to the polygon, and nothing else.
    polygon: Option<Polygon>,
    /// Of the polygon, in texels.
    area: f64,
    /// How often the texel has been halved.
    halvings: u32,
}

impl Part {
    fn middle(&self) -> DVec2 {
        self.polygon.map_or((self.min + self.max) * 0.5, |p| p.middle())
    }
}

/// Where a part is halved: coordinate `axis` at `at`.
type Split = (usize, f64);

impl TexelTree {
    /// The tree over `values`, finite and not negative: rows of `width` along x, `height` of them along y, the first at
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
        let mut levels = vec![Level { count: [width, height], cell: [1, 1], sums: values }];
        while let Some(last) = levels.last().filter(|l| l.count != [1, 1]) {
            let axis = usize::from(last.count[1] > last.count[0]);
            let next = halved(last, axis);
            levels.push(next);
        }
        levels.reverse();
        Ok(Self { size: [width, height], levels })
    }

    /// Width and height of the table.
    pub fn resolution(&self) -> [usize; 2] {
        self.size
    }

    /// The mean of the whole table.
    pub fn mean(&self) -> f64 {
        f64::from(self.levels[0].sums[0]) / (self.size[0] * self.size[1]) as f64
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.levels.iter().map(|l| l.sums.len() * size_of::<f32>()).sum()
    }

    /// The mean of the table over a convex polygon.
    pub fn mean_over(&self, polygon: &[Vec2]) -> f64 {
        let whole = self.whole(polygon);
        if whole.area > 0.0 { self.total(&whole) / whole.area } else { 0.0 }
    }

    fn total(&self, part: &Part) -> f64 {
        if part.area <= 0.0 {
            return 0.0;
        }
        if part.polygon.is_none() || part.level + 1 == self.levels.len() {
            return self.mean_of(part) * part.area;
        }
        match self.halves(part) {
            (_, [only, None]) => self.total(&only.unwrap_or(*part)),
            (_, halves) => halves.iter().flatten().map(|half| self.total(half)).sum(),
        }
    }

    /// A point of a convex polygon and its density, in area; `None` where the table is zero all over it.
    ///
    /// `steer` is asked, about the middle of parts of the polygon and their areas, what factor their weights deserve.
    #[inline]
    pub fn sample(&self, polygon: &[Vec2], mut u: Vec2, steer: impl Fn(Vec2, f32) -> Steering) -> Option<(Vec2, f32)> {
        let mut part = self.whole(polygon);
        let mut probability = 1.0;
        let mut is_settled = false;
        while let Some(((axis, _), halves)) = self.step(&part, is_settled) {
            let (first, settled) = self.first_share(&halves, is_settled, &steer)?;
            is_settled = settled;
            let (taken, share) = if u[axis] < first {
                u[axis] /= first;
                (halves[0], first)
            } else {
                u[axis] = (u[axis] - first) / (1.0 - first);
                (halves[1], 1.0 - first)
            };
            u[axis] = u[axis].min(ONE_MINUS_EPSILON);
            probability *= share;
            part = taken?;
        }
        if self.mean_of(&part) <= 0.0 || part.area <= 0.0 {
            return None;
        }
        let at = match &part.polygon {
            Some(polygon) => polygon.sample(u),
            None => part.min + (part.max - part.min) * u.as_dvec2(),
        };
        let point = (at / self.scale()).as_vec2();
        let density = (f64::from(probability) * self.texels() / part.area) as f32;
        (density > 0.0 && density.is_finite()).then_some((point, density))
    }

    /// The density of [`sample`](Self::sample) at a point of the polygon, with the same polygon and steering.
    #[inline]
    pub fn pdf(&self, polygon: &[Vec2], at: Vec2, steer: impl Fn(Vec2, f32) -> Steering) -> f32 {
        let at = at.as_dvec2() * self.scale();
        let mut part = self.whole(polygon);
        let mut probability = 1.0;
        let mut is_settled = false;
        while let Some(((axis, line), halves)) = self.step(&part, is_settled) {
            let Some((first, settled)) = self.first_share(&halves, is_settled, &steer) else { return 0.0 };
            is_settled = settled;
            let second = at[axis] >= line;
            probability *= if second { 1.0 - first } else { first };
            let Some(taken) = halves[usize::from(second)] else { return 0.0 };
            part = taken;
        }
        if self.mean_of(&part) <= 0.0 || part.area <= 0.0 {
            return 0.0;
        }
        let density = (f64::from(probability) * self.texels() / part.area) as f32;
        if density.is_finite() { density } else { 0.0 }
    }

    fn scale(&self) -> DVec2 {
        DVec2::new(self.size[0] as f64, self.size[1] as f64)
    }

    fn texels(&self) -> f64 {
        (self.size[0] * self.size[1]) as f64
    }

    fn whole(&self, polygon: &[Vec2]) -> Part {
        let scale = self.scale();
        let polygon = Polygon::new(polygon.iter().map(|c| c.as_dvec2() * scale));
        let part = Part {
            level: 0,
            cell: [0, 0],
            min: DVec2::ZERO,
            max: scale,
            polygon: Some(polygon),
            area: polygon.area(),
            halvings: 0,
        };
        part.simplified()
    }

    /// The mean of the texels of the cell that a part belongs to.
    #[inline]
    fn mean_of(&self, part: &Part) -> f64 {
        let level = &self.levels[part.level];
        let texels = |axis: usize| {
            let from = part.cell[axis] * level.cell[axis];
            (level.cell[axis].min(self.size[axis] - from)) as f64
        };
        f64::from(level.sum(part.cell)) / (texels(0) * texels(1))
    }

    /// The halves of a part that is to be halved.
    #[inline]
    fn step(&self, part: &Part, is_settled: bool) -> Option<(Split, [Option<Part>; 2])> {
        let is_texel = part.level + 1 == self.levels.len();
        (!is_texel || (!is_settled && part.halvings < MOST_HALVINGS)).then(|| self.halves(part))
    }

    fn halves(&self, part: &Part) -> (Split, [Option<Part>; 2]) {
        if part.level + 1 == self.levels.len() {
            return halved_texel(part);
        }
        let level = &self.levels[part.level + 1];
        let axis = usize::from(level.count[0] == self.levels[part.level].count[0]);
        let mut cell = part.cell;
        cell[axis] *= 2;
        let line = ((cell[axis] + 1) * level.cell[axis]) as f64;
        let below = Part { level: part.level + 1, cell, ..*part };
        if cell[axis] + 1 >= level.count[axis] {
            return ((axis, f64::INFINITY), [Some(below), None]);
        }
        cell[axis] += 1;
        ((axis, line), cut(&below, &Part { cell, ..below }, axis, line))
    }

    /// The probability of the first half, and whether both need no more steering; `None` where neither has any weight.
    #[inline]
    fn first_share(
        &self,
        halves: &[Option<Part>; 2],
        is_settled: bool,
        steer: &impl Fn(Vec2, f32) -> Steering,
    ) -> Option<(f32, bool)> {
        if halves[1].is_none() {
            return Some((1.0, is_settled));
        }
        let mut settled = true;
        let weights = halves.map(|half| {
            let Some(part) = half.filter(|p| p.area > 0.0) else { return 0.0 };
            let weight = self.mean_of(&part) * part.area;
            if is_settled || weight <= 0.0 {
                return weight;
            }
            let middle = (part.middle() / self.scale()).as_vec2();
            let steering = steer(middle, (part.area / self.texels()) as f32);
            settled &= steering.is_settled;
            weight * f64::from(steering.factor)
        });
        let sum = weights[0] + weights[1];
        if sum.is_nan() || sum <= 0.0 || sum.is_infinite() {
            return None;
        }
        // What has no weight has no probability, and what has some keeps it.
        let first = (weights[0] / sum) as f32;
        let first = if weights[0] > 0.0 { first.max(f32::MIN_POSITIVE) } else { 0.0 };
        Some((if weights[1] > 0.0 { first.min(ONE_MINUS_EPSILON) } else { 1.0 }, settled))
    }
}

impl Part {
    /// Without the polygon where that is the whole span.
    fn simplified(self) -> Self {
        let Some(polygon) = &self.polygon else { return self };
        let span = self.max - self.min;
        let (min, max) = polygon.bounds();
        let within = min.cmpge(self.min).all() && max.cmple(self.max).all();
        if within && self.area >= span.x * span.y * (1.0 - 1e-12) {
            Self { polygon: None, area: span.x * span.y, ..self }
        } else {
            self
        }
    }
}

/// The parts below and above a line of what `below` holds; the one above belongs to the cell of `above`.
fn cut(below: &Part, above: &Part, axis: usize, line: f64) -> [Option<Part>; 2] {
    let (mut low, mut high) = (*below, *above);
    low.max[axis] = line;
    high.min[axis] = line;
    match &below.polygon {
        None => {
            let area = |p: &Part| (p.max.x - p.min.x) * (p.max.y - p.min.y);
            low.area = area(&low);
            high.area = area(&high);
            [Some(low), Some(high)]
        }
        Some(polygon) => {
            let parts = polygon.cut(axis, line);
            let with = |part: Part, polygon: Polygon| {
                Some(Part { area: polygon.area(), polygon: Some(polygon), ..part }.simplified())
            };
            [with(low, parts[0]), with(high, parts[1])]
        }
    }
}

/// The halves of a texel, or what of the polygon is in it, along its longer side.
fn halved_texel(part: &Part) -> (Split, [Option<Part>; 2]) {
    let (min, max) = part.polygon.map_or((part.min, part.max), |p| p.bounds());
    let span = max - min;
    let axis = usize::from(span.y > span.x);
    let line = 0.5 * (min[axis] + max[axis]);
    let next = Part { halvings: part.halvings + 1, ..*part };
    ((axis, line), cut(&next, &next, axis, line))
}

/// A level with half as many cells along an axis.
fn halved(level: &Level, axis: usize) -> Level {
    let [width, height] = level.count;
    let mut count = level.count;
    count[axis] = count[axis].div_ceil(2);
    let mut cell = level.cell;
    cell[axis] *= 2;
    let mut sums = Vec::with_capacity(count[0] * count[1]);
    for j in 0..count[1] {
        for i in 0..count[0] {
            let (first, second) = if axis == 0 { ([2 * i, j], [2 * i + 1, j]) } else { ([i, 2 * j], [i, 2 * j + 1]) };
            let both = second[0] < width && second[1] < height;
            sums.push(level.sum(first) + if both { level.sum(second) } else { 0.0 });
        }
    }
    Level { count, cell, sums }
}
