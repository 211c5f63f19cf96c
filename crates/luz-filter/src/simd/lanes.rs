//! What the sums need from an instruction set.

/// A vector of `f32`.
///
/// # Safety
/// The methods may be called only where the instruction set of the implementation is present; `load` and `store` only
/// with pointers to [`Self::COUNT`] samples, which need not be aligned.
pub(super) trait Lanes: Copy {
    /// How many samples a vector holds.
    const COUNT: usize;

    unsafe fn splat(value: f32) -> Self;
    unsafe fn load(from: *const f32) -> Self;
    /// Every `stride`-th sample from `from` on, all of which must exist; the stride fits in 16 bits.
    unsafe fn gather(from: *const f32, stride: usize) -> Self;
    unsafe fn store(self, to: *mut f32);
    unsafe fn add(self, other: Self) -> Self;
    unsafe fn sub(self, other: Self) -> Self;
    unsafe fn mul(self, other: Self) -> Self;
    unsafe fn div(self, other: Self) -> Self;
    unsafe fn max(self, other: Self) -> Self;
    unsafe fn abs(self) -> Self;
    /// The larger of the absolute values; NaN if one of them is.
    unsafe fn max_magnitude(self, other: Self) -> Self;
    /// `self · factor + summand`.
    unsafe fn mul_add(self, factor: Self, summand: Self) -> Self;
    /// `summand − self · factor`.
    unsafe fn neg_mul_add(self, factor: Self, summand: Self) -> Self;
    /// `2ˣ` for `−120 ≤ x ≤ 100`, with the polynomial's coefficients from the constant one on, for fractions in
    /// `[−½, ½]`.
    unsafe fn exp2<const TERMS: usize>(self, polynomial: &[Self; TERMS]) -> Self;
    /// The number whose bits are the integer nearest to `self`, which is between 0 and 2³¹.
    unsafe fn bits_of_nearest(self) -> Self;
}

/// `Σ cᵢ xⁱ` by Horner's scheme.
///
/// # Safety
/// As [`Lanes`].
#[inline(always)]
pub(super) unsafe fn polynomial<L: Lanes, const TERMS: usize>(x: L, coefficients: &[L; TERMS]) -> L {
    let mut sum = coefficients[TERMS - 1];
    for i in (0..TERMS - 1).rev() {
        // SAFETY: passed on to the caller.
        sum = unsafe { sum.mul_add(x, coefficients[i]) };
    }
    sum
}

/// Something to do with vectors.
pub(super) trait Task {
    type Output;

    /// Does it.
    ///
    /// # Safety
    /// The instructions of `L` must be present, and what the task demands beside must hold.
    unsafe fn run<L: Lanes>(self) -> Self::Output;
}
