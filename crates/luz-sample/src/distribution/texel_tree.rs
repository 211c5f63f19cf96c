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

/// A cell, or part of a texel.
#[derive(Clone, Copy)]
struct Span {
    level: usize,
    cell: [usize; 2],
    /// In texels.
    min: DVec2,
    max: DVec2,
    /// How often the texel has been halved.
    halvings: u32,
}

impl Span {
    fn area(&self) -> f64 {
        (self.max.x - self.min.x) * (self.max.y - self.min.y)
    }

    /// The parts below and above a line.
    fn cut(&self, axis: usize, line: f64) -> [Self; 2] {
        let (mut low, mut high) = (*self, *self);
        low.max[axis] = line;
        high.min[axis] = line;
        [low, high]
    }
}

/// What of the polygon is in a span, in texels.
#[derive(Clone, Copy)]
enum Part {
    /// All of the span, and nothing else.
    Whole(Span),
    /// Some of it, and of its area.
    Some(Span, Polygon, f64),
}

impl Part {
    fn new(span: Span, polygon: Polygon) -> Self {
        let area = polygon.area();
        let (min, max) = polygon.bounds();
        let within = min.cmpge(span.min).all() && max.cmple(span.max).all();
        if within && area >= span.area() * (1.0 - 1e-12) { Self::Whole(span) } else { Self::Some(span, polygon, area) }
    }

    fn span(&self) -> &Span {
        match self {
            Self::Whole(span) | Self::Some(span, ..) => span,
        }
    }

    fn area(&self) -> f64 {
        match self {
            Self::Whole(span) => span.area(),
            Self::Some(.., area) => *area,
        }
    }

    fn middle(&self) -> DVec2 {
        match self {
            Self::Whole(span) => (span.min + span.max) * 0.5,
            Self::Some(_, polygon, _) => polygon.middle(),
        }
    }
}

/// Where a part is halved: coordinate `axis` at `at`.
type Split = (usize, f64);

/// What has been decided on the way down.
struct Descent {
    probability: f32,
    /// Whether nothing steers any more.
    is_settled: bool,
}

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
        if whole.area() > 0.0 { self.total(&whole) / whole.area() } else { 0.0 }
    }

    fn total(&self, part: &Part) -> f64 {
        let Part::Some(span, ..) = part else { return self.mean_of(part.span()) * part.area() };
        if part.area() <= 0.0 || self.is_texel(span) {
            return self.mean_of(span) * part.area();
        }
        self.halves(part).1.iter().flatten().map(|half| self.total(half)).sum()
    }

    /// A point of a convex polygon and its density, in area; `None` where the table is zero all over it.
    ///
    /// `steer` is asked, about the middle of parts of the polygon and their areas, what factor their weights deserve.
    #[inline]
    pub fn sample(&self, polygon: &[Vec2], mut u: Vec2, steer: impl Fn(Vec2, f32) -> Steering) -> Option<(Vec2, f32)> {
        let choose = |first: f32, axis: usize, u: &mut Vec2, descent: &mut Descent| {
            let second = u[axis] >= first;
            let (share, within) = if second { (1.0 - first, u[axis] - first) } else { (first, u[axis]) };
            u[axis] = (within / share).min(ONE_MINUS_EPSILON);
            descent.probability *= share;
            usize::from(second)
        };
        let mut descent = Descent { probability: 1.0, is_settled: false };
        let mut part = self.whole(polygon);
        while let Part::Some(span, ..) = &part {
            if self.ends(span, &descent) {
                break;
            }
            let ((axis, _), halves) = self.halves(&part);
            let first = self.first_share(&halves, &mut descent, &steer)?;
            part = halves[choose(first, axis, &mut u, &mut descent)]?;
        }
        let (at, last, area) = match part {
            Part::Some(span, polygon, area) => (polygon.sample(u), span, area),
            Part::Whole(mut span) => {
                while !self.ends(&span, &descent) {
                    let ((axis, _), halves) = self.span_halves(&span);
                    let first = self.first_share_of_spans(&halves, &mut descent, &steer)?;
                    span = halves[choose(first, axis, &mut u, &mut descent)]?;
                }
                (span.min + (span.max - span.min) * u.as_dvec2(), span, span.area())
            }
        };
        let density = self.density(&last, area, &descent);
        (density > 0.0).then(|| ((at / self.scale()).as_vec2(), density))
    }

    /// The density of [`sample`](Self::sample) at a point of the polygon, with the same polygon and steering.
    #[inline]
    pub fn pdf(&self, polygon: &[Vec2], at: Vec2, steer: impl Fn(Vec2, f32) -> Steering) -> f32 {
        let at = at.as_dvec2() * self.scale();
        let choose = |first: f32, (axis, line): Split, descent: &mut Descent| {
            let second = at[axis] >= line;
            descent.probability *= if second { 1.0 - first } else { first };
            usize::from(second)
        };
        let mut descent = Descent { probability: 1.0, is_settled: false };
        let mut part = self.whole(polygon);
        while let Part::Some(span, ..) = &part {
            if self.ends(span, &descent) {
                break;
            }
            let (split, halves) = self.halves(&part);
            let Some(first) = self.first_share(&halves, &mut descent, &steer) else { return 0.0 };
            let Some(taken) = halves[choose(first, split, &mut descent)] else { return 0.0 };
            part = taken;
        }
        let (last, area) = match part {
            Part::Some(span, _, area) => (span, area),
            Part::Whole(mut span) => {
                while !self.ends(&span, &descent) {
                    let (split, halves) = self.span_halves(&span);
                    let first = self.first_share_of_spans(&halves, &mut descent, &steer);
                    let Some(first) = first else { return 0.0 };
                    let Some(taken) = halves[choose(first, split, &mut descent)] else { return 0.0 };
                    span = taken;
                }
                (span, span.area())
            }
        };
        self.density(&last, area, &descent)
    }

    #[inline]
    fn density(&self, span: &Span, area: f64, descent: &Descent) -> f32 {
        if self.mean_of(span) <= 0.0 || area <= 0.0 {
            return 0.0;
        }
        let density = (f64::from(descent.probability) * self.texels() / area) as f32;
        if density.is_finite() { density } else { 0.0 }
    }

    #[inline]
    fn is_texel(&self, span: &Span) -> bool {
        span.level + 1 == self.levels.len()
    }

    /// Whether a part is not to be halved any more.
    #[inline]
    fn ends(&self, span: &Span, descent: &Descent) -> bool {
        self.is_texel(span) && (descent.is_settled || span.halvings >= MOST_HALVINGS)
    }

    fn scale(&self) -> DVec2 {
        DVec2::new(self.size[0] as f64, self.size[1] as f64)
    }

    fn texels(&self) -> f64 {
        (self.size[0] * self.size[1]) as f64
    }

    fn whole(&self, polygon: &[Vec2]) -> Part {
        let scale = self.scale();
        let span = Span { level: 0, cell: [0, 0], min: DVec2::ZERO, max: scale, halvings: 0 };
        Part::new(span, Polygon::new(polygon.iter().map(|c| c.as_dvec2() * scale)))
    }

    /// The mean of the texels of the cell that a span belongs to.
    #[inline]
    fn mean_of(&self, span: &Span) -> f64 {
        let level = &self.levels[span.level];
        let texels = |axis: usize| level.cell[axis].min(self.size[axis] - span.cell[axis] * level.cell[axis]) as f64;
        f64::from(level.sum(span.cell)) / (texels(0) * texels(1))
    }

    /// The halves of a cell, or the only one, and where it is halved.
    #[inline]
    fn cells(&self, span: &Span) -> (Split, [Option<Span>; 2]) {
        let level = &self.levels[span.level + 1];
        let axis = usize::from(level.count[0] == self.levels[span.level].count[0]);
        let mut cell = span.cell;
        cell[axis] *= 2;
        let below = Span { level: span.level + 1, cell, ..*span };
        if cell[axis] + 1 >= level.count[axis] {
            return ((axis, f64::INFINITY), [Some(below), None]);
        }
        let line = ((cell[axis] + 1) * level.cell[axis]) as f64;
        let [low, mut high] = below.cut(axis, line);
        high.cell[axis] += 1;
        ((axis, line), [Some(low), Some(high)])
    }

    #[inline]
    fn span_halves(&self, span: &Span) -> (Split, [Option<Span>; 2]) {
        if !self.is_texel(span) {
            return self.cells(span);
        }
        let axis = longer_side(span.max - span.min);
        let line = 0.5 * (span.min[axis] + span.max[axis]);
        let next = Span { halvings: span.halvings + 1, ..*span };
        ((axis, line), next.cut(axis, line).map(Some))
    }

    fn halves(&self, part: &Part) -> (Split, [Option<Part>; 2]) {
        let Part::Some(span, polygon, area) = part else {
            let (split, halves) = self.span_halves(part.span());
            return (split, halves.map(|half| half.map(Part::Whole)));
        };
        let ((axis, line), spans) = if self.is_texel(span) {
            // Of a texel that goes on beyond the table all that the polygon has is halved.
            let (min, max) = polygon.bounds();
            let axis = longer_side(max - min);
            let line = 0.5 * (min[axis] + max[axis]);
            let next = Span { halvings: span.halvings + 1, ..*span };
            ((axis, line), next.cut(axis, line).map(Some))
        } else {
            self.cells(span)
        };
        match spans {
            [Some(low), Some(high)] => {
                let [a, b] = polygon.cut(axis, line);
                ((axis, line), [Some(Part::new(low, a)), Some(Part::new(high, b))])
            }
            [only, _] => ((axis, line), [only.map(|span| Part::Some(span, *polygon, *area)), None]),
        }
    }

    /// The probability of the first half; `None` where neither has any weight.
    #[inline]
    fn first_share(
        &self,
        halves: &[Option<Part>; 2],
        descent: &mut Descent,
        steer: &impl Fn(Vec2, f32) -> Steering,
    ) -> Option<f32> {
        let of = |half: &Option<Part>| match half {
            Some(part) if part.area() > 0.0 => (self.mean_of(part.span()) * part.area(), part.middle(), part.area()),
            _ => (0.0, DVec2::ZERO, 0.0),
        };
        if halves[1].is_none() { Some(1.0) } else { self.share([of(&halves[0]), of(&halves[1])], descent, steer) }
    }

    #[inline]
    fn first_share_of_spans(
        &self,
        halves: &[Option<Span>; 2],
        descent: &mut Descent,
        steer: &impl Fn(Vec2, f32) -> Steering,
    ) -> Option<f32> {
        let of = |span: &Span| (self.mean_of(span) * span.area(), (span.min + span.max) * 0.5, span.area());
        match halves {
            [Some(a), Some(b)] => self.share([of(a), of(b)], descent, steer),
            _ => Some(1.0),
        }
    }

    /// The probability of the first of two parts, given by their weights, middles, and areas.
    #[inline]
    fn share(
        &self,
        parts: [(f64, DVec2, f64); 2],
        descent: &mut Descent,
        steer: &impl Fn(Vec2, f32) -> Steering,
    ) -> Option<f32> {
        let mut weights = parts.map(|(weight, ..)| weight);
        if !descent.is_settled {
            let mut settled = true;
            for (weight, (_, middle, area)) in weights.iter_mut().zip(parts).filter(|(weight, _)| **weight > 0.0) {
                let steering = steer((middle / self.scale()).as_vec2(), (area / self.texels()) as f32);
                settled &= steering.is_settled;
                *weight *= f64::from(steering.factor);
            }
            descent.is_settled = settled;
        }
        let sum = weights[0] + weights[1];
        if sum.is_nan() || sum <= 0.0 || sum.is_infinite() {
            return None;
        }
        // What has no weight has no probability, and what has some keeps it.
        let first = (weights[0] / sum) as f32;
        let first = if weights[0] > 0.0 { first.max(f32::MIN_POSITIVE) } else { 0.0 };
        Some(if weights[1] > 0.0 { first.min(ONE_MINUS_EPSILON) } else { 1.0 })
    }
}

fn longer_side(extent: DVec2) -> usize {
    usize::from(extent.y > extent.x)
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
