//! Pixel reconstruction filters, sampled in proportion to their absolute value.

use glam::Vec2;

/// The shape of a pixel filter; all are separable. Radii are in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FilterKind {
    /// Constant within the radius.
    Box,
    /// Falls linearly to zero at the radius.
    Triangle,
    /// A Gaussian of standard deviation `sigma` less its value at the radius.
    Gaussian {
        /// Standard deviation in pixels.
        sigma: f32,
    },
    /// Mitchell and Netravali 1988, stretched to the radius.
    Mitchell {
        /// Blur.
        b: f32,
        /// Ringing.
        c: f32,
    },
    /// A sinc windowed by a sinc of period `tau` (Lanczos).
    LanczosSinc {
        /// How many cycles the sinc passes through before it is cut.
        tau: f32,
    },
}

/// One sample of a filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterSample {
    /// Offset from the pixel's centre, in pixels.
    pub offset: Vec2,
    /// The sign of the filter there: what a sample counts, since offsets are drawn in proportion to |f|.
    pub sign: f32,
}

/// A pixel filter that can be evaluated and sampled.
///
/// Offsets are drawn with density |f| / ∫|f|, so that every sample has the same weight but for its sign (Ernst et al.
/// 2006, "Filter importance sampling"): no sample is shared between pixels, and a pixel depends on nothing but its own
/// samples.
#[derive(Clone, Debug)]
pub struct Filter {
    kind: FilterKind,
    radius: Vec2,
    axes: [Axis; 2],
}

impl Filter {
    /// A filter of the given shape; each radius must be finite and positive.
    pub fn new(kind: FilterKind, radius: Vec2) -> Self {
        Self { kind, radius, axes: [Axis::new(kind, radius.x), Axis::new(kind, radius.y)] }
    }

    /// The box of one pixel: no overlap, no weights.
    pub fn unit_box() -> Self {
        Self::new(FilterKind::Box, Vec2::splat(0.5))
    }

    /// The filter's shape.
    pub fn kind(&self) -> FilterKind {
        self.kind
    }

    /// Half the filter's width, in pixels.
    pub fn radius(&self) -> Vec2 {
        self.radius
    }

    /// The filter's value at an offset from the pixel's centre.
    pub fn evaluate(&self, offset: Vec2) -> f32 {
        profile(self.kind, self.radius.x, offset.x) * profile(self.kind, self.radius.y, offset.y)
    }

    /// The filter's profiles, of which [`evaluate`](Self::evaluate) is the product: along x (axis 0) or y (axis 1), at an offset from
    /// the pixel's centre.
    #[inline]
    pub fn profile(&self, axis: usize, offset: f32) -> f32 {
        profile(self.kind, self.radius[axis], offset)
    }

    /// The integral of [`evaluate`](Self::evaluate) over the plane, in px².
    pub fn integral(&self) -> f64 {
        self.axes[0].integral * self.axes[1].integral
    }

    /// True where the filter is negative somewhere.
    pub fn is_signed(&self) -> bool {
        self.axes.iter().any(|axis| axis.signed)
    }

    /// Draws an offset with density |f| / ∫|f|.
    #[inline]
    pub fn sample(&self, u: Vec2) -> FilterSample {
        if self.kind == FilterKind::Box {
            return FilterSample { offset: (u * 2.0 - 1.0) * self.radius, sign: 1.0 };
        }
        let offset = Vec2::new(self.axes[0].sample(u.x), self.axes[1].sample(u.y));
        let sign = if self.is_signed() { 1f32.copysign(self.evaluate(offset)) } else { 1.0 };
        FilterSample { offset, sign }
    }
}

/// The inverse of one axis' cumulative distribution of |f|, tabulated.
#[derive(Clone, Debug)]
struct Axis {
    inverse: Vec<f32>,
    signed: bool,
    /// Of the profile itself, in pixels.
    integral: f64,
}

/// Knots of the inverse; linear between them.
const KNOTS: usize = 2048;
/// Steps of the integration that the inverse is made from.
const STEPS: usize = 16 * KNOTS;

impl Axis {
    fn new(kind: FilterKind, radius: f32) -> Self {
        let position = |step: usize| radius * (2.0 * step as f64 / STEPS as f64 - 1.0) as f32;
        let mut signed = false;
        let mut integral = 0.0;
        let mut cumulative = Vec::with_capacity(STEPS + 1);
        cumulative.push(0.0f64);
        for step in 0..STEPS {
            let value = profile(kind, radius, 0.5 * (position(step) + position(step + 1)));
            signed |= value < 0.0;
            integral += f64::from(value);
            cumulative.push(cumulative[step] + f64::from(value.abs()));
        }
        let total = cumulative[STEPS];
        let mut step = 0;
        let inverse = (0..=KNOTS)
            .map(|knot| {
                let target = total * knot as f64 / KNOTS as f64;
                while step < STEPS - 1 && cumulative[step + 1] < target {
                    step += 1;
                }
                let width = cumulative[step + 1] - cumulative[step];
                let fraction = if width > 0.0 { ((target - cumulative[step]) / width).clamp(0.0, 1.0) } else { 0.5 };
                position(step) + (position(step + 1) - position(step)) * fraction as f32
            })
            .collect();
        Self { inverse, signed, integral: integral * 2.0 * f64::from(radius) / STEPS as f64 }
    }

    #[inline]
    fn sample(&self, u: f32) -> f32 {
        let scaled = u * KNOTS as f32;
        let knot = (scaled as usize).min(KNOTS - 1);
        let (a, b) = (self.inverse[knot], self.inverse[knot + 1]);
        a + (b - a) * (scaled - knot as f32)
    }
}

fn profile(kind: FilterKind, radius: f32, x: f32) -> f32 {
    let x = x.abs();
    if x > radius {
        return 0.0;
    }
    match kind {
        FilterKind::Box => 1.0,
        FilterKind::Triangle => radius - x,
        FilterKind::Gaussian { sigma } => {
            let gaussian = |x: f32| (-x * x / (2.0 * sigma * sigma)).exp();
            (gaussian(x) - gaussian(radius)).max(0.0)
        }
        FilterKind::Mitchell { b, c } => {
            let x = 2.0 * x / radius;
            let cubic = if x <= 1.0 {
                ((12.0 - 9.0 * b - 6.0 * c) * x + (-18.0 + 12.0 * b + 6.0 * c)) * x * x + (6.0 - 2.0 * b)
            } else {
                (((-b - 6.0 * c) * x + (6.0 * b + 30.0 * c)) * x + (-12.0 * b - 48.0 * c)) * x + (8.0 * b + 24.0 * c)
            };
            cubic / 6.0
        }
        FilterKind::LanczosSinc { tau } => sinc(x) * sinc(x / tau),
    }
}

/// sin(πx) / (πx).
fn sinc(x: f32) -> f32 {
    let t = std::f32::consts::PI * x;
    if t.abs() < 1e-3 { 1.0 - t * t / 6.0 } else { t.sin() / t }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filters() -> [Filter; 5] {
        [
            Filter::new(FilterKind::Box, Vec2::new(0.5, 1.0)),
            Filter::new(FilterKind::Triangle, Vec2::splat(2.0)),
            Filter::new(FilterKind::Gaussian { sigma: 0.5 }, Vec2::splat(1.5)),
            Filter::new(FilterKind::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 }, Vec2::splat(2.0)),
            Filter::new(FilterKind::LanczosSinc { tau: 3.0 }, Vec2::splat(4.0)),
        ]
    }

    /// The signed moments of the samples along x are those of the filter by quadrature, to three digits.
    #[test]
    fn samples_follow_the_filter() {
        for filter in filters() {
            let radius = filter.radius().x;
            let (mut absolute, mut moments) = (0.0, [0.0; 2]);
            let n = 20_000;
            for i in 0..n {
                let x = radius * (2.0 * (i as f32 + 0.5) / n as f32 - 1.0);
                let value = f64::from(profile(filter.kind, radius, x));
                absolute += value.abs();
                moments[0] += value;
                moments[1] += value * f64::from(x * x);
            }
            let mut sampled = [0.0; 2];
            for i in 0..n {
                let sample = filter.sample(Vec2::new((i as f32 + 0.5) / n as f32, 0.5));
                // At the centre of y every one of these filters is positive.
                sampled[0] += f64::from(sample.sign);
                sampled[1] += f64::from(sample.sign * sample.offset.x * sample.offset.x);
            }
            for k in 0..2 {
                let (expected, found) = (moments[k] / absolute, sampled[k] / f64::from(n));
                assert!((expected - found).abs() < 1e-3 * f64::from(radius * radius), "{filter:?} moment {k}");
            }
        }
    }

    #[test]
    fn only_mitchell_and_sinc_are_signed() {
        assert_eq!(filters().map(|f| f.is_signed()), [false, false, false, true, true]);
    }

    #[test]
    fn extremes_of_u_stay_within_the_radius() {
        for filter in filters() {
            for u in [Vec2::ZERO, Vec2::splat(1.0 - f32::EPSILON)] {
                let offset = filter.sample(u).offset;
                assert!(offset.abs().cmple(filter.radius()).all(), "{offset}");
            }
        }
    }
}
