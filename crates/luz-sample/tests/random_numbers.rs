//! Statistical tests of the counter-based random numbers. All seeds are fixed; every test has a significance of 0.01,
//! divided among its parts (Šidák).

use luz_sample::Samples;
use luz_sample::random::{Random, hash};
use luz_sample::test_support::{chi2, sidak, z_test};

/// The p-value of uniform counts in `cells` cells.
fn uniform(cells: usize, numbers: impl Iterator<Item = usize>) -> f64 {
    let mut counts = vec![0u64; cells];
    numbers.for_each(|i| counts[i] += 1);
    let mean = counts.iter().sum::<u64>() as f64 / cells as f64;
    chi2(&counts, &vec![mean; cells]).p_value
}

type Counter = (&'static str, fn(u64) -> u64);

/// Streams of numbers in which one word counts and the others are fixed: as streams, indices, dimensions and seeds do.
const COUNTERS: [Counter; 6] = [
    ("seed", |i| hash(i, 5, 6, 7)),
    ("stream", |i| hash(1, i, 0, 0)),
    ("stream of rows", |i| hash(1, i << 32, 0, 0)),
    ("index", |i| hash(0, 0, i, 0)),
    ("dimension", |i| hash(0, 0, 0, i as u32)),
    ("diagonal", |i| hash(i, i, i, i as u32)),
];

#[test]
fn every_byte_is_uniform() {
    let p = sidak(0.01, 6 * 8);
    for (name, f) in COUNTERS {
        for byte in 0..8 {
            let value = uniform(256, (0..100_000).map(|i| (f(i) >> (8 * byte)) as usize & 255));
            assert!(value > p, "{name} byte {byte}: {value}");
        }
    }
}

#[test]
fn successive_numbers_are_independent() {
    let p = sidak(0.01, 6 * 3);
    for (name, f) in COUNTERS {
        for lag in [1, 2, 64] {
            let pair = |i| (f(i) >> 59 << 5 | f(i + lag) >> 59) as usize;
            let value = uniform(1024, (0..100_000).map(pair));
            assert!(value > p, "{name} lag {lag}: {value}");
        }
    }
}

#[test]
fn streams_are_uncorrelated() {
    let centred = |stream: u64, i: u64| Random::new(9, stream, i).next_f64() - 0.5;
    let (n, p) = (20_000u64, sidak(0.01, 15));
    for a in 0..6u64 {
        for b in 0..a {
            let sum: f64 = (0..n).map(|i| centred(a, i) * centred(b, i)).sum();
            // A product of two has the variance 1/144.
            let z = sum / (n as f64 / 144.0).sqrt();
            assert!(z_test(z) > p, "streams {a} and {b}: {z}");
        }
    }
}

#[test]
fn every_input_bit_flips_every_output_bit_half_the_time() {
    const N: u64 = 4000;
    let words = |i: u64| [hash(100, 0, i, 0), hash(101, 0, i, 0), hash(102, 0, i, 0), hash(103, 0, i, 0)];
    let at = |w: [u64; 4]| hash(w[0], w[1], w[2], w[3] as u32);
    // One of 224 × 64 binomial counts; also of small inputs, where counters really are.
    let p = sidak(0.01, 2 * 224 * 64);
    for mask in [u64::MAX, 0xff] {
        for bit in 0..224 {
            let mut flips = [0u64; 64];
            for i in 0..N {
                let base = words(i).map(|w| w & mask);
                let mut changed = base;
                changed[bit / 64] ^= 1 << (bit % 64);
                let difference = at(base) ^ at(changed);
                flips.iter_mut().enumerate().for_each(|(k, f)| *f += difference >> k & 1);
            }
            for (k, &f) in flips.iter().enumerate() {
                let z = (f as f64 - N as f64 / 2.0) / (N as f64 / 4.0).sqrt();
                assert!(z_test(z) > p, "input bit {bit}, output bit {k}: {z}");
            }
        }
    }
}

#[test]
fn numbers_depend_on_the_dimension_alone() {
    let mut forwards = Random::new(1, 2, 3);
    let numbers: Vec<f32> = (0..10).map(|_| forwards.next_1d()).collect();
    assert_eq!(forwards.dimension(), 10);
    for d in (0..10).rev() {
        let mut random = Random::new(1, 2, 3);
        random.set_dimension(d);
        assert_eq!(random.next_1d(), numbers[d as usize]);
        assert_eq!(hash(1, 2, 3, d) >> 40, (numbers[d as usize] * 16_777_216.0) as u64);
    }
    let mut random = Random::new(1, 2, 3);
    random.next_2d();
    assert_eq!(random.next_1d(), numbers[2]);
}

#[test]
fn the_tests_reject_a_weak_generator() {
    // A multiplicative congruential generator's low byte, and a counter.
    assert!(
        uniform(256, (0..100_000u64).map(|i| (i.wrapping_mul(6_364_136_223_846_793_005) >> 8) as usize & 255)) > 0.999
    );
    let pair = |i: u64| {
        (i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 59 << 5 | (i + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 59) as usize
    };
    assert!(uniform(1024, (0..100_000).map(pair)) < 1e-6);
}
