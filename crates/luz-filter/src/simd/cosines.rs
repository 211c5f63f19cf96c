//! Windowed sums of cosines, updated from one row to the next.

use super::lanes::{Lanes, Task};

/// A cosine of a sum `Σ amplitude · cos(frequency · j)` over a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CosineTerm {
    pub amplitude: f64,
    /// Radians per sample.
    pub frequency: f64,
}

/// Filters each column with `Σₘ aₘ cos(ωₘ j)` for `|j| ≤ radius`, and transposes.
///
/// The complex sums `S(y) = Σ_j e^{iωj} v(y + j)` follow from those of the row before:
/// `S(y + 1) = e^{−iω} S(y) − e^{−iω(R+1)} v(y − R) + e^{iωR} v(y + R + 1)` (after Elboher and Werman 2012, "Cosine Integral
/// Images for Fast Spatial and Range Filtering").
pub(crate) struct CosinePass<'a> {
    /// `rows + 2 · radius` rows of `columns` samples.
    pub from: &'a [f32],
    /// A multiple of [`CosinePass::BLOCK`].
    pub columns: usize,
    /// Rows that are filtered.
    pub rows: usize,
    pub radius: usize,
    pub terms: &'a [CosineTerm],
    /// Those of [`CosinePass::start`].
    pub start: &'a [f32],
    /// `columns` rows of `stride` samples, of which the first `rows` are set.
    pub to: &'a mut [f32],
    /// At least `rows`.
    pub stride: usize,
}

impl CosinePass<'_> {
    /// Columns are worked on in blocks of at most this many.
    pub const BLOCK: usize = 16;
    /// The most terms.
    pub const TERMS: usize = 6;

    /// The cosines and sines with which the first sums are made: of all terms, for each row of the window.
    pub fn start(terms: &[CosineTerm], radius: usize) -> Vec<f32> {
        let angle = |y: usize, term: &CosineTerm| term.frequency * (y as f64 - radius as f64);
        let pair = |angle: f64| [angle.cos() as f32, angle.sin() as f32];
        (0..2 * radius + 1).flat_map(|y| terms.iter().flat_map(move |term| pair(angle(y, term)))).collect()
    }

    /// Panics unless all reads and writes are in bounds.
    pub fn check(&self) {
        assert!(self.columns.is_multiple_of(Self::BLOCK), "columns that fill no block");
        assert!(self.terms.len() <= Self::TERMS, "too many terms");
        assert_eq!(self.start.len(), (2 * self.radius + 1) * self.terms.len() * 2, "not the start of these terms");
        assert!(self.from.len() >= (self.rows + 2 * self.radius) * self.columns, "rows that don't exist");
        assert!(self.stride >= self.rows && self.to.len() >= self.columns * self.stride, "no room for the results");
    }
}

/// What a term needs for an update: the cosine and sine of the turn, and the factors of the samples that leave and enter.
#[derive(Clone, Copy)]
struct Update<L> {
    turn: [L; 2],
    leave: [L; 2],
    enter: [L; 2],
    amplitude: L,
}

impl Task for CosinePass<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        // SAFETY: passed on to the caller.
        unsafe {
            match self.terms.len() {
                0..=3 => columns::<L, 3>(self),
                4 => columns::<L, 4>(self),
                5 => columns::<L, 5>(self),
                _ => columns::<L, 6>(self),
            }
        }
    }
}

/// # Safety
/// As [`CosinePass`], after [`CosinePass::check`], with at most `TERMS` terms.
#[inline(always)]
unsafe fn columns<L: Lanes, const TERMS: usize>(pass: CosinePass<'_>) {
    let r = pass.radius as f64;
    // SAFETY: `CosinePass::check` compared the farthest reads and writes with the slices' lengths.
    unsafe {
        let pair = |angle: f64| [L::splat(angle.cos() as f32), L::splat(angle.sin() as f32)];
        let nothing = CosineTerm { amplitude: 0.0, frequency: 0.0 };
        let terms: [CosineTerm; TERMS] = std::array::from_fn(|m| pass.terms.get(m).copied().unwrap_or(nothing));
        let updates = terms.map(|term| Update {
            turn: pair(term.frequency),
            leave: pair(term.frequency * (r + 1.0)),
            enter: pair(term.frequency * r),
            amplitude: L::splat(term.amplitude as f32),
        });
        let mut block = [0.0f32; 16 * 16];
        for x in (0..pass.columns).step_by(L::COUNT) {
            let from = pass.from.as_ptr().add(x);
            let row = |y: usize| L::load(from.add(y * pass.columns));
            let mut sums = [[L::splat(0.0); 2]; TERMS];
            for y in 0..2 * pass.radius + 1 {
                let sample = row(y);
                let waves = &pass.start[y * pass.terms.len() * 2..];
                for (sum, wave) in sums.iter_mut().zip(waves.chunks_exact(2)).take(pass.terms.len()) {
                    sum[0] = sample.mul_add(L::splat(wave[0]), sum[0]);
                    sum[1] = sample.mul_add(L::splat(wave[1]), sum[1]);
                }
            }
            for start in (0..pass.rows).step_by(L::COUNT) {
                let end = (start + L::COUNT).min(pass.rows);
                for y in start..end {
                    let mut total = L::splat(0.0);
                    for (sum, update) in sums.iter().zip(&updates) {
                        total = sum[0].mul_add(update.amplitude, total);
                    }
                    total.store(block.as_mut_ptr().add((y - start) * L::COUNT));
                    if y + 1 == pass.rows {
                        break;
                    }
                    let (leaving, entering) = (row(y), row(y + 2 * pass.radius + 1));
                    for (sum, update) in sums.iter_mut().zip(&updates) {
                        let [re, im] = *sum;
                        let edge_re = leaving.neg_mul_add(update.leave[0], entering.mul(update.enter[0]));
                        let edge_im = leaving.mul_add(update.leave[1], entering.mul(update.enter[1]));
                        sum[0] = re.mul_add(update.turn[0], im.mul_add(update.turn[1], edge_re));
                        sum[1] = im.mul_add(update.turn[0], re.neg_mul_add(update.turn[1], edge_im));
                    }
                }
                for lane in 0..L::COUNT {
                    let to = (x + lane) * pass.stride + start;
                    for (i, to) in pass.to[to..to + end - start].iter_mut().enumerate() {
                        *to = block[i * L::COUNT + lane];
                    }
                }
            }
        }
    }
}

/// `to = a · b`.
pub(super) struct Multiply<'a> {
    pub a: &'a [f32],
    pub b: &'a [f32],
    pub to: &'a mut [f32],
}

impl Task for Multiply<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        self.to.iter_mut().zip(self.a.iter().zip(self.b)).for_each(|(to, (a, b))| *to = a * b);
    }
}

/// `to += factor · a · b`.
pub(super) struct AddProduct<'a> {
    pub a: &'a [f32],
    pub b: &'a [f32],
    pub factor: f32,
    pub to: &'a mut [f32],
}

impl Task for AddProduct<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let factor = self.factor;
        self.to.iter_mut().zip(self.a.iter().zip(self.b)).for_each(|(to, (a, b))| *to += factor * (a * b));
    }
}

/// Turns vectors by angles.
pub(super) struct Rotate<'a> {
    pub cos: &'a mut [f32],
    pub sin: &'a mut [f32],
    pub by_cos: &'a [f32],
    pub by_sin: &'a [f32],
}

impl Task for Rotate<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        for ((c, s), (bc, bs)) in self.cos.iter_mut().zip(self.sin.iter_mut()).zip(self.by_cos.iter().zip(self.by_sin))
        {
            (*c, *s) = (*c * bc - *s * bs, *s * bc + *c * bs);
        }
    }
}
