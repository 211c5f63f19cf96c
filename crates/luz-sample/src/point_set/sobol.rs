//! The first points of Sobol's sequence.

use super::{PointSet, Points, Request};
use crate::owen::{laine_karras, second_dimension, sobol_2d};
use crate::random::{hash, unit_f64};

/// The first points of Sobol's sequence (Sobol' 1967), with Owen's scrambling (1995), in two or three dimensions.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sobol;

impl PointSet for Sobol {
    fn uniform(&self, request: &Request) -> Points {
        let seed = |d: u32| hash(request.seed, u64::from(request.member), 0, d) as u32;
        let seeds = [seed(0), seed(1)];
        let third = seed(2);
        let points = (0..request.count as u32)
            .map(|i| {
                let [x, y] = sobol_2d(i, second_dimension(u64::from(i)), seeds);
                let z = laine_karras(third_dimension(i), third).reverse_bits();
                // Random digits below those of the net.
                let fill = |v: u32, d: u32| {
                    let low = hash(request.seed, u64::from(request.member), u64::from(i), d) >> 32;
                    unit_f64(u64::from(v) << 32 | low)
                };
                [fill(x, 3), fill(y, 4), if request.dimensions > 2 { fill(z, 5) } else { 0.0 }]
            })
            .collect();
        Points { points, expected_count: request.count as f64 }
    }
}

/// The third dimension of the Sobol sequence as reversed digits: from the primitive polynomial `x² + x + 1` with the
/// initial numbers 1 and 3 (Joe and Kuo 2008), by the recurrence `mᵢ = 2 mᵢ₋₁ ⊕ 4 mᵢ₋₂ ⊕ mᵢ₋₂` of Bratley and Fox 1988.
fn third_dimension(index: u32) -> u32 {
    let (mut m, mut next, mut digits) = (1u64, 3u64, 0u32);
    for bit in 0..32 {
        if index >> bit & 1 == 1 {
            digits ^= ((m << (31 - bit)) as u32).reverse_bits();
        }
        (m, next) = (next, (2 * next) ^ (4 * m) ^ m);
    }
    digits
}
