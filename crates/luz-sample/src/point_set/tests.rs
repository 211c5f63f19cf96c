//! Every set has the density that it claims.

use super::*;
use crate::test_support::{chi2, sidak};

const SETS: [(&str, &dyn PointSet); 6] = [
    ("random", &Random),
    ("stratified", &Stratified),
    ("grid", &Grid),
    ("poisson-disk", &PoissonDisk),
    ("sobol", &Sobol),
    ("vogel", &Vogel),
];

const LIMITS: [f64; 3] = [2.5, 2.5, 2.2];

/// A random number that tells a point's cell among 4×4 (×2) of equal probability, whatever the set.
fn cell(point: &[f64; 3], dimensions: usize, normal: bool) -> usize {
    let place = |d: usize, parts: usize| {
        let u = if normal {
            let l = LIMITS[d];
            normal_probability(-l, point[d]) / normal_probability(-l, l)
        } else {
            point[d]
        };
        ((u * parts as f64) as usize).min(parts - 1)
    };
    let flat = place(0, 4) * 4 + place(1, 4);
    if dimensions > 2 { flat * 2 + place(2, 2) } else { flat }
}

/// Points of a set are not independent, but those of different seeds are: one of each of many sets is taken. A random one of
/// an unbiased set follows the density where all sets have equally many points; where they differ by one, a phantom that is
/// drawn too stands for the missing one.
fn counts(set: &dyn PointSet, dimensions: usize, normal: bool, spoil: f64) -> Vec<u64> {
    let mut counts = vec![0u64; if dimensions > 2 { 32 } else { 16 }];
    for seed in 0..6_000 {
        let request = Request { dimensions, count: 9, seed, member: (seed % 3) as u32, members: 3 };
        let points = if normal { set.normal(&request, LIMITS) } else { set.uniform(&request) }.points;
        let pick = (crate::random::unit_f64(crate::random::hash(seed, 1, 2, 3)) * 16.0) as usize;
        if let Some(point) = points.get(pick) {
            let mut point = *point;
            point[0] *= spoil;
            counts[cell(&point, dimensions, normal)] += 1;
        }
    }
    counts
}

fn p_value(set: &dyn PointSet, dimensions: usize, normal: bool, spoil: f64) -> f64 {
    let counts = counts(set, dimensions, normal, spoil);
    let total: u64 = counts.iter().sum();
    chi2(&counts, &vec![total as f64 / counts.len() as f64; counts.len()]).p_value
}

/// χ² at a significance of 0.001 for all sets together.
#[test]
fn densities_are_right() {
    let significance = sidak(0.001, SETS.len() * 4);
    for (name, set) in SETS {
        for dimensions in [2, 3] {
            for normal in [false, true] {
                let p = p_value(set, dimensions, normal, 1.0);
                assert!(p > significance, "{name} in {dimensions} dimensions, normal: {normal}: {p}");
            }
        }
    }
}

/// A density that is 20 % too narrow in one dimension is found out.
#[test]
fn wrong_densities_are_rejected() {
    for (name, set) in SETS {
        assert!(p_value(set, 2, true, 0.8) < 1e-4, "{name}");
    }
}

#[test]
fn points_are_where_they_should_be_and_as_many() {
    for (name, set) in SETS {
        for count in [1, 2, 3, 16, 82, 300] {
            for dimensions in [2, 3] {
                let request = Request { dimensions, count, seed: 7, member: 1, members: 16 };
                let uniform = set.uniform(&request);
                assert!(uniform.points.iter().flatten().all(|v| (0.0..1.0).contains(v)), "{name}");
                let normal = set.normal(&request, LIMITS);
                assert!(normal.points.iter().all(|p| is_within(p, dimensions, LIMITS)), "{name}");
                for Points { points, expected_count } in [uniform, normal] {
                    assert!(
                        (expected_count - count as f64).abs() <= 1.0 + 0.5 * (count as f64).sqrt(),
                        "{name} {count}"
                    );
                    let error = (points.len() as f64 - expected_count).abs();
                    let most = 2.0 + 0.4 * (count as f64).sqrt();
                    assert!(error <= most, "{name}: {} of {count}", points.len());
                    assert!(dimensions > 2 || points.iter().all(|p| p[2] == 0.0));
                }
                assert_eq!(set.normal(&request, LIMITS), set.normal(&request, LIMITS));
            }
        }
    }
}

/// Blue noise: the closest two of 100 normal points are farther apart, in units of the local spacing, than random points.
#[test]
fn poisson_disks_do_not_overlap() {
    let closest = |set: &dyn PointSet| {
        let mut least = f64::INFINITY;
        for seed in 0..4 {
            let points =
                set.normal(&Request { dimensions: 2, count: 100, seed, member: 0, members: 1 }, [3.0; 3]).points;
            for (i, a) in points.iter().enumerate() {
                for b in &points[..i] {
                    let middle = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
                    let density = (-0.5 * (middle[0].powi(2) + middle[1].powi(2))).exp() / std::f64::consts::TAU;
                    let distance = (a[0] - b[0]).hypot(a[1] - b[1]);
                    least = least.min(distance * (100.0 * density).sqrt());
                }
            }
        }
        least
    };
    let (blue, random, stratified) = (closest(&PoissonDisk), closest(&Random), closest(&Stratified));
    assert!(blue > 0.4, "{blue}");
    assert!(random < 0.1 && stratified < 0.2, "{random} {stratified}");
}
