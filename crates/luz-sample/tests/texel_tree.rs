//! χ² tests of points drawn from a table within a polygon, steered and not.

use glam::Vec2;
use luz_sample::Samples;
use luz_sample::distribution::{Steering, TexelTree};
use luz_sample::random::Random;
use luz_sample::test_support::{chi2, sidak};

const TESTS: usize = 30;

fn tree([width, height]: [usize; 2]) -> TexelTree {
    let values = (0..width * height).map(|i| if i % 7 == 3 { 0.0 } else { 0.1 + ((i * 5) % 11) as f32 }).collect();
    TexelTree::new(values, [width, height]).unwrap()
}

fn polygons() -> [Vec<Vec2>; 5] {
    let of = |corners: &[(f32, f32)]| corners.iter().map(|&(x, y)| Vec2::new(x, y)).collect();
    [
        of(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]),
        of(&[(0.1, 0.05), (0.95, 0.3), (0.3, 0.9)]),
        // Within a texel or two.
        of(&[(0.41, 0.4), (0.47, 0.41), (0.45, 0.5)]),
        // Beyond the square on two sides.
        of(&[(0.5, -0.4), (1.5, 0.2), (0.8, 0.9)]),
        of(&[(0.2, 0.2), (0.7, 0.3), (0.8, 0.8), (0.1, 0.6)]),
    ]
}

fn inside(polygon: &[Vec2], p: Vec2) -> bool {
    let turn = |i: usize| (polygon[(i + 1) % polygon.len()] - polygon[i]).perp_dot(p - polygon[i]);
    (0..polygon.len()).all(|i| turn(i) >= -1e-7)
}

fn steered(middle: Vec2, area: f32) -> Steering {
    Steering { factor: 0.05 + middle.x * middle.x, is_settled: area < 1e-3 }
}

fn unsteered(_: Vec2, _: f32) -> Steering {
    Steering::NONE
}

/// χ² of points against the density, summed over a fine grid (the density jumps at every texel's border, which adaptive
/// quadrature does not like).
fn passes(tree: &TexelTree, polygon: &[Vec2], steer: fn(Vec2, f32) -> Steering, wrong: f64, significance: f64) -> bool {
    const BINS: usize = 8;
    const FINE: usize = 40;
    const SAMPLES: u64 = 20_000;
    let min = polygon.iter().fold(Vec2::INFINITY, |a, p| a.min(*p));
    let max = polygon.iter().fold(Vec2::NEG_INFINITY, |a, p| a.max(*p));
    let (size, fine) = (max - min, BINS * FINE);
    let mut expected = vec![0.0; BINS * BINS];
    for i in 0..fine * fine {
        let (x, y) = (i % fine, i / fine);
        let offset = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) / fine as f32;
        let p = min + offset * size;
        if inside(polygon, p) {
            let density = f64::from(tree.pdf(polygon, p, steer)) * (1.0 + wrong * f64::from(offset.x - 0.5));
            expected[y / FINE * BINS + x / FINE] += density * f64::from(size.x * size.y) / (fine * fine) as f64;
        }
    }
    let sum: f64 = expected.iter().sum();
    let mut observed = vec![0u64; BINS * BINS];
    for i in 0..SAMPLES {
        let Some((p, density)) = tree.sample(polygon, Random::new(3, 0, i).next_2d(), steer) else { continue };
        assert!(density > 0.0);
        let bin = ((p - min) / size * BINS as f32).clamp(Vec2::ZERO, Vec2::splat(BINS as f32 - 0.5));
        observed[bin.y as usize * BINS + bin.x as usize] += 1;
    }
    // Where a part has weight by what is not of the polygon alone, nothing is drawn.
    let drawn = observed.iter().sum::<u64>() as f64;
    assert!(wrong != 0.0 || (drawn / SAMPLES as f64 - sum).abs() < 0.02, "{drawn} {sum}");
    expected.iter_mut().for_each(|e| *e *= drawn / sum);
    // A bin that the grid has missed holds a sliver of the polygon.
    expected.iter_mut().for_each(|e| *e = e.max(1e-3));
    chi2(&observed, &expected).passes(significance)
}

#[test]
fn points_have_their_density() {
    for size in [[1, 1], [5, 3], [8, 8]] {
        let tree = tree(size);
        for polygon in polygons().into_iter().filter(|p| tree.mean_over(p) > 0.0) {
            for steer in [unsteered, steered] {
                assert!(passes(&tree, &polygon, steer, 0.0, sidak(0.01, TESTS)), "{size:?} {polygon:?}");
            }
        }
    }
    assert!(!passes(&tree([5, 3]), &polygons()[1], unsteered, 0.5, 1e-6), "a wrong density must be noticed");
}

/// Each sample carries what `pdf` says of it, and unsteered over whole texels it is the table's share exactly.
#[test]
fn densities_are_those_of_the_samples() {
    let tree = tree([9, 4]);
    for (k, polygon) in polygons().iter().enumerate() {
        for steer in [unsteered, steered] {
            let mut off = 0;
            for i in 0..2000 {
                let u = Vec2::new((i as f32 * 0.618_034) % 1.0, (i as f32 + 0.5) / 2000.0);
                let Some((p, density)) = tree.sample(polygon, u, steer) else { continue };
                off += i32::from((tree.pdf(polygon, p, steer) / density - 1.0).abs() > 1e-4);
                if k == 0 && steer(p, 1.0) == Steering::NONE {
                    let texel = (p.y * 4.0) as usize * 9 + (p.x * 9.0) as usize;
                    let value = 0.1 + ((texel * 5) % 11) as f32;
                    assert!((density * tree.mean() as f32 / value - 1.0).abs() < 1e-3, "{p}");
                }
            }
            assert!(off <= 3, "{k}: {off} of 2000");
        }
    }
}

/// The mean over a polygon against a sum over a fine grid.
#[test]
fn means_are_those_of_the_part_inside() {
    let tree = tree([7, 5]);
    let value = |p: Vec2| {
        let (x, y) = ((p.x * 7.0).clamp(0.0, 6.0) as usize, (p.y * 5.0).clamp(0.0, 4.0) as usize);
        let i = y * 7 + x;
        if i % 7 == 3 { 0.0 } else { 0.1 + ((i * 5) % 11) as f32 }
    };
    for polygon in polygons() {
        let (mut sum, mut count) = (0.0, 0.0);
        let min = polygon.iter().fold(Vec2::INFINITY, |a, p| a.min(*p));
        let max = polygon.iter().fold(Vec2::NEG_INFINITY, |a, p| a.max(*p));
        for i in 0..1_000_000 {
            let p = min + (max - min) * Vec2::new((i % 1000) as f32 + 0.5, (i / 1000) as f32 + 0.5) / 1000.0;
            if inside(&polygon, p) {
                sum += f64::from(value(p));
                count += 1.0;
            }
        }
        let mean = tree.mean_over(&polygon);
        assert!((mean * count / sum - 1.0).abs() < 1e-2, "{polygon:?}: {mean} {}", sum / count);
    }
}

#[test]
fn black_tables_give_nothing() {
    let tree = TexelTree::new(vec![0.0; 6], [3, 2]).unwrap();
    let [square, ..] = polygons();
    assert!(tree.sample(&square, Vec2::splat(0.5), unsteered).is_none());
    assert_eq!(tree.mean_over(&square), 0.0);
    let one = TexelTree::new((0..64).map(|i| if i == 37 { 1e5 } else { 0.0 }).collect(), [8, 8]).unwrap();
    let (p, density) = one.sample(&square, Vec2::new(0.2, 0.9), unsteered).unwrap();
    assert_eq!(((p.x * 8.0) as usize, (p.y * 8.0) as usize), (5, 4));
    assert!(density >= 60.0);
}
