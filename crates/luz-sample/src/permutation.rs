//! Permutations of `0..n` by hashing.

/// The image of `i` under a permutation of `0..n` that `seed` chooses; `i < n`.
///
/// Rounds of operations that are invertible modulo a power of two, walked until the result is below `n` (the technique of
/// Kensler 2013, "Correlated Multi-Jittered Sampling").
#[inline]
pub(crate) fn permute(i: u32, n: u32, seed: u64) -> u32 {
    if n <= 1 {
        return 0;
    }
    let mask = u32::MAX >> (n - 1).leading_zeros();
    let shift = mask.count_ones().div_ceil(2);
    // Few bits need more rounds before all orders are equally likely.
    let rounds = if mask < 16 { 8 } else { 4 };
    let mut x = i;
    loop {
        let mut seed = seed;
        for _ in 0..rounds {
            x = x.wrapping_add(seed as u32);
            x = x.wrapping_mul((seed >> 32) as u32 | 1) & mask;
            x ^= x >> shift;
            seed = seed.wrapping_mul(0xd134_2543_de82_ef95).rotate_left(23);
        }
        if x < n {
            return x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random;
    use crate::test_support::chi2;

    #[test]
    fn permutations_are_bijective() {
        for n in (1..70).chain([255, 256, 257, 1000, 4096]) {
            for seed in 0..50 {
                let mut seen = vec![false; n as usize];
                for i in 0..n {
                    let j = permute(i, n, random::hash(0, 0, seed, n));
                    assert!(!std::mem::replace(&mut seen[j as usize], true));
                }
            }
        }
    }

    /// χ² at a significance of 0.001 for each of nine n, of where each pair of elements goes.
    #[test]
    fn pairs_go_anywhere() {
        for n in [2, 3, 4, 5, 6, 7, 8, 11, 16] {
            let (first, second, draws) = (0, n - 1, 100_000u64);
            let mut counts = vec![0; (n * n) as usize];
            for seed in 0..draws {
                let seed = random::hash(1, 0, seed, n);
                counts[(permute(first, n, seed) * n + permute(second, n, seed)) as usize] += 1;
            }
            let each = draws as f64 / f64::from(n * (n - 1));
            let expected: Vec<f64> = (0..n * n).map(|i| if i / n == i % n { 0.0 } else { each }).collect();
            let result = chi2(&counts, &expected);
            assert!(result.passes(0.001), "{n}: {result:?}");
        }
    }
}
