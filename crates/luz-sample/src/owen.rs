//! Owen scrambling (nested uniform scrambling) by hashing, and the two-dimensional Sobol sequence that it is applied to.
//!
//! A nested uniform scramble flips every binary digit by a coin that depends on all digits before it (Owen 1995). It keeps
//! each elementary interval whole, and so every stratification of a net. A hash in which a bit is influenced by lower bits
//! only does this to the digits in reversed order (Laine and Karras 2011, "Stratified Sampling for Stochastic
//! Transparency"; Burley 2020, "Practical Hash-based Owen Scrambling").
//!
//! Applied to fractions it randomises points. Applied to indices it shuffles their order, so that every aligned block of 2ᵐ
//! points stays a block and any prefix of a sequence stays a good point set.
//!
//! Throughout, `reversed` digits have the most significant one in bit 0.

/// A permutation of 32-bit integers, chosen by `seed`, in which bits influence only themselves and higher ones.
///
/// The constants are those that Vegdahl found for this structure (2021, "Building a Better LK Hash").
#[inline(always)]
pub(crate) const fn laine_karras(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed).wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// [`laine_karras`] of 64 bits; the same in the low 32 bits but for the seed.
#[inline(always)]
pub(crate) const fn laine_karras_64(mut x: u64, seed: u64) -> u64 {
    x ^= x.wrapping_mul(0x9e6c_63d1_3d20_adea);
    x = x.wrapping_add(seed).wrapping_mul((seed >> 32) | 1);
    x ^= x.wrapping_mul(0x9b5d_6a8e_0552_6c56);
    x ^ x.wrapping_mul(0x6c1c_9a2b_53a2_2864)
}

/// The first dimension of the Sobol sequence, scrambled: the van der Corput sequence.
#[inline(always)]
pub(crate) const fn sobol_1d(index: u32, seed: u32) -> u32 {
    // The digits of the radical inverse, reversed, are those of the index.
    laine_karras(index, seed).reverse_bits()
}

/// The first two dimensions of the Sobol sequence, scrambled; `second` is the [`second_dimension`] of the index.
#[inline(always)]
pub(crate) const fn sobol_2d(index: u32, second: u32, seeds: [u32; 2]) -> [u32; 2] {
    let x = laine_karras(index, seeds[0]);
    let y = laine_karras(second, seeds[1]);
    let both = (y as u64 | (x as u64) << 32).reverse_bits();
    [both as u32, (both >> 32) as u32]
}

/// The second dimension of the Sobol sequence as reversed digits.
///
/// Its generator matrix, from the primitive polynomial `x + 1` with the initial number 1 (Joe and Kuo 2008), is Pascal's
/// triangle modulo two: digit `j` is the sum of the index's bits `k` with an odd binomial `C(k, j)`, which are the `k` whose
/// set bits include those of `j` (Lucas). That is a sum over supersets, done for all digits at once in six steps.
#[inline(always)]
pub(crate) const fn second_dimension(index: u64) -> u32 {
    let mut v = index as u32 ^ (index >> 32) as u32;
    v ^= v >> 16;
    v ^= (v >> 8) & 0x00ff_00ff;
    v ^= (v >> 4) & 0x0f0f_0f0f;
    v ^= (v >> 2) & 0x3333_3333;
    v ^ ((v >> 1) & 0x5555_5555)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The direction numbers of the second dimension by the recurrence of Bratley and Fox 1988, for `x + 1` and `m₁ = 1`:
    /// `mᵢ = 2 mᵢ₋₁ ⊕ mᵢ₋₁`.
    fn by_direction_numbers(index: u32) -> u32 {
        let (mut m, mut y) = (1u64, 0);
        for bit in 0..32 {
            if index >> bit & 1 == 1 {
                y ^= (m << (31 - bit)) as u32;
            }
            m ^= 2 * m;
        }
        y
    }

    #[test]
    fn pascals_triangle_is_the_second_sobol_dimension() {
        let check = |index: u32| {
            assert_eq!(second_dimension(u64::from(index)).reverse_bits(), by_direction_numbers(index), "{index}");
            let [x, y] = sobol_2d(index, second_dimension(u64::from(index)), [5, 7]);
            assert_eq!(x, sobol_1d(index, 5));
            assert_eq!(y, laine_karras(second_dimension(u64::from(index)), 7).reverse_bits());
        };
        (0..5000).for_each(check);
        (0..5000).map(|i| i * 858_993 + 123).for_each(check);
    }

    #[test]
    fn scrambles_are_nested_and_fair() {
        // Equal digits up to k stay equal up to k; and every digit is flipped half the time, given the digits before it.
        for k in 1..32 {
            let (mut flips, n) = (0u32, 4096u32);
            for seed in 0..n {
                let seed = crate::random::hash(1, 2, u64::from(seed), k) as u32;
                let x = seed.rotate_left(11) ^ 0x1357_9bdf;
                let y = x ^ (1 << k);
                let (a, b) = (laine_karras(x, seed), laine_karras(y, seed));
                assert_eq!(u64::from(a ^ b) & ((1 << (k + 1)) - 1), 1 << k);
                let wide =
                    laine_karras_64(u64::from(x), u64::from(seed)) ^ laine_karras_64(u64::from(y), u64::from(seed));
                assert_eq!(wide & ((1 << (k + 1)) - 1), 1 << k);
                flips += (a ^ x) >> k & 1;
            }
            // Five standard deviations of a binomial count.
            assert!((f64::from(flips) - 2048.0).abs() < 5.0 * 32.0, "digit {k}: {flips}");
        }
    }
}
