//! The weighted mean of a list of neighbours, for consecutive pixels at once.

use serde::Serialize;

use super::lanes::{Lanes, Task};

/// How exactly the range Gaussian is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
pub enum Precision {
    /// Relative error below 3·10⁻⁶, by a polynomial of degree four.
    Full,
    /// Relative error below 8·10⁻⁵, by a polynomial of degree three.
    #[default]
    Fine,
    /// Relative error below 3 %: linear between powers of two (Schraudolph 1999, "A Fast, Compact Approximation of the
    /// Exponential Function"). An error that depends on the weight alone hardly moves a weighted mean.
    Fast,
    /// As [`Self::Fast`], and in half precision where the processor calculates with that (AVX-512 FP16), an image of up to
    /// three channels is its own guide, and no value of a tile exceeds 2: an error about 70 dB below 1.
    Half,
}

impl Precision {
    /// By what an exponent to base two is multiplied before it is handed to the kernel.
    pub(crate) fn unit(self) -> f32 {
        match self {
            Self::Full | Self::Fine => 1.0,
            Self::Fast => (1u32 << 23) as f32,
            Self::Half => 1024.0,
        }
    }

    /// What the kernel expects in place of the base-two logarithm `log2` of a weight.
    pub(crate) fn exponent(self, log2: f64) -> f32 {
        match self {
            Self::Full | Self::Fine => log2 as f32,
            // The shift by 0.0430 centres the error.
            Self::Fast => ((log2 + 127.0 - 0.043_035_7) * f64::from(1u32 << 23)) as f32,
            // The bits of a half: ten of mantissa, and a bias of 15.
            Self::Half => ((log2 + 15.0 - 0.043_035_7) * 1024.0) as f32,
        }
    }
}

/// How the differences of a guide's channels make a distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Metric {
    /// The root of the sum of squares.
    L2,
    /// The sum of absolute values.
    L1,
}

/// Consecutive planes whose differences make one distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Group {
    /// The first plane.
    pub plane: usize,
    /// How many planes.
    pub channels: usize,
    /// How they make a distance.
    pub metric: Metric,
    /// A plane with factors on the squared distance, taken at the centre.
    pub factor: Option<usize>,
}

/// A row of pixels to be filtered: for each centre `x`, all planes `v` of values become
///
/// `u (v(x) + Σᵢ wᵢ (v(x + oᵢ) − v(x)) / (w₀ + Σᵢ wᵢ))`, `wᵢ = exp2(eᵢ − Σ_g dist_g²(x, x + oᵢ))`.
///
/// Planes lie one after the other. Centres are consecutive samples; the last ones are rounded up to [`RowJob::BLOCK`], so
/// that there must be something to read and room to write there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowJob<'a> {
    /// All planes.
    pub planes: &'a [f32],
    /// The distance from one plane to the next.
    pub plane_size: usize,
    /// How many planes there are of the centres.
    pub plane_count: usize,
    /// Where the first centre is in the first plane.
    pub centre: usize,
    /// How many centres.
    pub columns: usize,
    /// The guides.
    pub groups: &'a [Group],
    /// The first plane of values, and how many.
    pub values: (usize, usize),
    /// Where neighbours are, relative to the centre.
    pub offsets: &'a [i32],
    /// The exponents `eᵢ` of their weights, after [`Precision::exponent`].
    pub exponents: &'a [f32],
    /// The least and the largest offset.
    pub reach: (i32, i32),
    /// The weight `w₀` of the centre, positive.
    pub centre_weight: f32,
    /// Of the range weights.
    pub precision: Precision,
    /// What results are multiplied with.
    pub unscale: f32,
}

impl RowJob<'_> {
    /// Centres are worked on in blocks of this many.
    pub const BLOCK: usize = 32;

    /// Panics unless all reads and writes are in bounds.
    pub fn check(&self, out: usize) {
        let columns = self.columns.next_multiple_of(Self::BLOCK);
        assert_eq!(self.offsets.len(), self.exponents.len());
        assert!(out >= self.values.1 * columns, "no room for the results");
        let planes = |g: &Group| (g.plane + g.channels).max(g.factor.map_or(0, |f| f + 1));
        let last = self.groups.iter().map(planes).fold(self.values.0 + self.values.1, usize::max);
        assert!(last <= self.plane_count, "planes that don't exist");
        assert!(self.centre as i64 + i64::from(self.reach.0.min(0)) >= 0, "neighbours before the first");
        let end = self.centre + columns + self.reach.1.max(0) as usize + (self.plane_count - 1) * self.plane_size;
        assert!(end <= self.planes.len(), "neighbours beyond the last");
        debug_assert!(self.offsets.iter().all(|o| (self.reach.0..=self.reach.1).contains(o)));
    }
}

/// Samples are summed in chunks of this many, so that rounding errors grow with the root of the number.
const CHUNK: usize = 256;

/// Filters a row: the values go to `out`, plane by plane, each [`RowJob::columns`] rounded up to [`RowJob::BLOCK`] apart.
///
/// Demands that `job.check(out.len())` has passed, with offsets within the reach.
pub(super) struct FilterRow<'a> {
    pub job: &'a RowJob<'a>,
    pub out: &'a mut [f32],
}

impl Task for FilterRow<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let Self { job, out } = self;
        // SAFETY: passed on to the caller.
        unsafe {
            match job.precision {
                Precision::Full => filter::<L, Polynomial<L, 5>>(job, out, Polynomial::new(FULL)),
                Precision::Fine => filter::<L, Polynomial<L, 4>>(job, out, Polynomial::new(FINE)),
                Precision::Fast => filter::<L, Linear<L>>(job, out, Linear(L::splat(LEAST_NORMAL))),
                Precision::Half => filter::<L, Widened<L>>(job, out, Widened::new()),
            }
        }
    }
}

/// # Safety
/// As [`FilterRow`].
#[inline(always)]
unsafe fn filter<L: Lanes, E: Exponential<L>>(job: &RowJob<'_>, out: &mut [f32], exponential: E) {
    let alone = match job.groups {
        [g] if g.metric == Metric::L2 && g.factor.is_none() && (g.plane, g.channels) == job.values => g.channels,
        _ => 0,
    };
    // SAFETY: passed on to the caller.
    unsafe {
        match alone {
            1 => filter_alone::<L, E, 1>(job, out, exponential),
            2 => filter_alone::<L, E, 2>(job, out, exponential),
            3 => filter_alone::<L, E, 3>(job, out, exponential),
            4 => filter_alone::<L, E, 4>(job, out, exponential),
            _ => filter_guided::<L, E>(job, out, exponential),
        }
    }
}

/// The range Gaussian as a function of its exponent.
trait Exponential<L: Lanes>: Copy {
    /// # Safety
    /// The instructions of `L` must be present.
    unsafe fn weight(self, exponent: L) -> L;
}

/// `2ˣ` on `[−½, ½]`, of the least relative error.
const FULL: [f32; 5] = [
    0.999_999_284_744_262_7,
    0.693_121_790_885_925_3,
    0.240_247_443_318_367,
    0.055_917_862_802_743_91,
    0.009_570_102_207_362_652,
];
const FINE: [f32; 4] =
    [0.999_928_057_193_756_1, 0.693_260_967_731_475_8, 0.242_611_140_012_741_1, 0.055_171_668_529_510_5];

#[derive(Clone, Copy)]
struct Polynomial<L, const TERMS: usize> {
    coefficients: [L; TERMS],
    least: L,
}

impl<L: Lanes, const TERMS: usize> Polynomial<L, TERMS> {
    /// # Safety
    /// The instructions of `L` must be present.
    #[inline(always)]
    unsafe fn new(coefficients: [f32; TERMS]) -> Self {
        // SAFETY: passed on to the caller.
        unsafe { Self { coefficients: coefficients.map(|c| L::splat(c)), least: L::splat(-120.0) } }
    }
}

impl<L: Lanes, const TERMS: usize> Exponential<L> for Polynomial<L, TERMS> {
    #[inline(always)]
    unsafe fn weight(self, exponent: L) -> L {
        // SAFETY: passed on to the caller.
        unsafe { exponent.max(self.least).exp2(&self.coefficients) }
    }
}

/// The bits of the least number that isn't subnormal, as a number.
const LEAST_NORMAL: f32 = (1u32 << 23) as f32;

#[derive(Clone, Copy)]
struct Linear<L>(L);

impl<L: Lanes> Exponential<L> for Linear<L> {
    #[inline(always)]
    unsafe fn weight(self, exponent: L) -> L {
        // SAFETY: passed on to the caller.
        unsafe { exponent.max(self.0).bits_of_nearest() }
    }
}

/// [`Linear`] of exponents that were made for the bits of halves.
#[derive(Clone, Copy)]
struct Widened<L> {
    scale: L,
    shift: L,
    least: L,
}

impl<L: Lanes> Widened<L> {
    /// # Safety
    /// The instructions of `L` must be present.
    #[inline(always)]
    unsafe fn new() -> Self {
        // 13 more bits of mantissa, and a bias that is larger by 112.
        // SAFETY: passed on to the caller.
        unsafe {
            Self { scale: L::splat(8192.0), shift: L::splat(112.0 * LEAST_NORMAL), least: L::splat(LEAST_NORMAL) }
        }
    }
}

impl<L: Lanes> Exponential<L> for Widened<L> {
    #[inline(always)]
    unsafe fn weight(self, exponent: L) -> L {
        // SAFETY: passed on to the caller.
        unsafe { exponent.mul_add(self.scale, self.shift).max(self.least).bits_of_nearest() }
    }
}

/// The image is its own guide: each sample is read once.
///
/// # Safety
/// As [`FilterRow`].
#[inline(always)]
unsafe fn filter_alone<L: Lanes, E: Exponential<L>, const CHANNELS: usize>(
    job: &RowJob<'_>,
    out: &mut [f32],
    exponential: E,
) {
    let columns = job.columns.next_multiple_of(RowJob::BLOCK);
    let mut column = 0;
    while column < columns {
        // SAFETY: blocks divide the rounded columns; the rest is passed on to the caller.
        unsafe {
            if L::COUNT * 2 <= RowJob::BLOCK && job.columns - column > L::COUNT && L::COUNT == 16 {
                filter_block::<L, E, CHANNELS, 2>(job, out, exponential, column, columns);
                column += 2 * L::COUNT;
            } else {
                filter_block::<L, E, CHANNELS, 1>(job, out, exponential, column, columns);
                column += L::COUNT;
            }
        }
        if column >= job.columns {
            break;
        }
    }
}

/// `VECTORS` vectors of centres from `column` on.
///
/// # Safety
/// As [`FilterRow`], with as many columns.
#[inline(always)]
unsafe fn filter_block<L: Lanes, E: Exponential<L>, const CHANNELS: usize, const VECTORS: usize>(
    job: &RowJob<'_>,
    out: &mut [f32],
    exponential: E,
    column: usize,
    columns: usize,
) {
    // SAFETY: `RowJob::check` compared the farthest reads and writes with the slices' lengths.
    unsafe {
        let first = job.planes.as_ptr().add(job.values.0 * job.plane_size + job.centre + column);
        let zero = L::splat(0.0);
        let mut centre = [[zero; VECTORS]; CHANNELS];
        for (c, centre) in centre.iter_mut().enumerate() {
            for (v, centre) in centre.iter_mut().enumerate() {
                *centre = L::load(first.add(c * job.plane_size + v * L::COUNT));
            }
        }
        let mut weight = [L::splat(job.centre_weight); VECTORS];
        let mut sum = [[zero; VECTORS]; CHANNELS];
        for (offsets, exponents) in job.offsets.chunks(CHUNK).zip(job.exponents.chunks(CHUNK)) {
            let mut part_weight = [zero; VECTORS];
            let mut part = [[zero; VECTORS]; CHANNELS];
            for (&offset, &exponent) in offsets.iter().zip(exponents) {
                let neighbour = first.offset(offset as isize);
                let start = L::splat(exponent);
                for v in 0..VECTORS {
                    let mut exponent = start;
                    let mut difference = [zero; CHANNELS];
                    for c in 0..CHANNELS {
                        let sample = L::load(neighbour.add(c * job.plane_size + v * L::COUNT));
                        difference[c] = sample.sub(centre[c][v]);
                        exponent = difference[c].neg_mul_add(difference[c], exponent);
                    }
                    let w = exponential.weight(exponent);
                    part_weight[v] = part_weight[v].add(w);
                    for c in 0..CHANNELS {
                        part[c][v] = w.mul_add(difference[c], part[c][v]);
                    }
                }
            }
            for v in 0..VECTORS {
                weight[v] = weight[v].add(part_weight[v]);
                for c in 0..CHANNELS {
                    sum[c][v] = sum[c][v].add(part[c][v]);
                }
            }
        }
        let unscale = L::splat(job.unscale);
        for c in 0..CHANNELS {
            for v in 0..VECTORS {
                let mean = centre[c][v].add(sum[c][v].div(weight[v]));
                mean.mul(unscale).store(out.as_mut_ptr().add(c * columns + column + v * L::COUNT));
            }
        }
    }
}

/// Any guides and any number of values: the weights of some samples first, then their sums, value by value.
///
/// # Safety
/// As [`FilterRow`].
#[inline(always)]
unsafe fn filter_guided<L: Lanes, E: Exponential<L>>(job: &RowJob<'_>, out: &mut [f32], exponential: E) {
    const BATCH: usize = 64;
    let columns = job.columns.next_multiple_of(RowJob::BLOCK);
    // SAFETY: `RowJob::check` compared the farthest reads and writes with the slices' lengths.
    unsafe {
        let zero = L::splat(0.0);
        let mut weights = [zero; BATCH];
        for column in (0..job.columns).step_by(L::COUNT) {
            let first = job.planes.as_ptr().add(job.centre + column);
            let to = out.as_mut_ptr().add(column);
            for v in 0..job.values.1 {
                zero.store(to.add(v * columns));
            }
            let mut total = L::splat(job.centre_weight);
            for (offsets, exponents) in job.offsets.chunks(BATCH).zip(job.exponents.chunks(BATCH)) {
                for (weight, &exponent) in weights.iter_mut().zip(exponents) {
                    *weight = L::splat(exponent);
                }
                for group in job.groups {
                    let plane = first.add(group.plane * job.plane_size);
                    let factor = match group.factor {
                        Some(factor) => L::load(first.add(factor * job.plane_size)),
                        None => L::splat(1.0),
                    };
                    for (weight, &offset) in weights.iter_mut().zip(offsets) {
                        let neighbour = plane.offset(offset as isize);
                        let mut distance = zero;
                        for c in 0..group.channels {
                            let centre = L::load(plane.add(c * job.plane_size));
                            let difference = L::load(neighbour.add(c * job.plane_size)).sub(centre);
                            distance = match group.metric {
                                Metric::L2 => difference.mul_add(difference, distance),
                                Metric::L1 => distance.add(difference.abs()),
                            };
                        }
                        if group.metric == Metric::L1 {
                            distance = distance.mul(distance);
                        }
                        *weight = distance.neg_mul_add(factor, *weight);
                    }
                }
                let mut part = zero;
                for weight in &mut weights[..offsets.len()] {
                    *weight = exponential.weight(*weight);
                    part = part.add(*weight);
                }
                total = total.add(part);
                for v in 0..job.values.1 {
                    let plane = first.add((job.values.0 + v) * job.plane_size);
                    let centre = L::load(plane);
                    let mut part = zero;
                    for (weight, &offset) in weights.iter().zip(offsets) {
                        let difference = L::load(plane.offset(offset as isize)).sub(centre);
                        part = weight.mul_add(difference, part);
                    }
                    let to = to.add(v * columns);
                    L::load(to).add(part).store(to);
                }
            }
            for v in 0..job.values.1 {
                let centre = L::load(first.add((job.values.0 + v) * job.plane_size));
                let to = to.add(v * columns);
                centre.add(L::load(to).div(total)).mul(L::splat(job.unscale)).store(to);
            }
        }
    }
}
