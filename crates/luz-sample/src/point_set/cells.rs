//! One point in each of `count` boxes of equal volume.

use super::{PointSet, Points, Request};

/// One point in each box, anywhere in it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stratified;

/// A regular grid of about as many points, at a random place. Normal points are those of the grid, warped: a regular one
/// has the uniform density.
#[derive(Clone, Copy, Debug, Default)]
pub struct Grid;

impl PointSet for Stratified {
    fn uniform(&self, request: &Request) -> Points {
        let points = points(request, |i| std::array::from_fn(|d| request.random(i, d as u32)));
        Points { points, expected_count: request.count as f64 }
    }
}

impl PointSet for Grid {
    fn uniform(&self, request: &Request) -> Points {
        let root = |count: f64, degree: usize| count.powf(1.0 / degree as f64).round().max(1.0);
        let mut left = request.count as f64;
        let mut axes = [vec![0.0], vec![0.0], vec![0.0]];
        for (d, axis) in axes.iter_mut().enumerate().take(request.dimensions) {
            let cells = root(left, request.dimensions - d);
            left /= cells;
            let place = request.random(0, d as u32);
            let below_one = |x: f64| x.min(1.0 - f64::EPSILON / 2.0);
            *axis = (0..cells as usize).map(|i| below_one((i as f64 + place) / cells)).collect();
        }
        let mut points = Vec::with_capacity(axes.iter().map(Vec::len).product());
        for &z in &axes[2] {
            for &y in &axes[1] {
                points.extend(axes[0].iter().map(|&x| [x, y, z]));
            }
        }
        let expected_count = points.len() as f64;
        Points { points, expected_count }
    }
}

/// A point for each box, at the place in `[0, 1)ᵈ` within the box that `place` gives.
fn points(request: &Request, place: impl Fn(u64) -> [f64; 3]) -> Vec<[f64; 3]> {
    let mut points = Vec::with_capacity(request.count);
    if request.dimensions < 3 {
        add_layer(&mut points, request.count, [0.0, 1.0], &place);
        points.iter_mut().for_each(|p| p[2] = 0.0);
    } else {
        let layers = (request.count as f64).cbrt().round().max(1.0) as usize;
        for (count, bounds) in shares(request.count, layers) {
            add_layer(&mut points, count, bounds, &place);
        }
    }
    points
}

/// Adds `count` points of a layer with the given bounds in the third dimension.
fn add_layer(points: &mut Vec<[f64; 3]>, count: usize, bounds: [f64; 2], place: &impl Fn(u64) -> [f64; 3]) {
    let rows = (count as f64).sqrt().round().max(1.0) as usize;
    for (columns, row) in shares(count, rows) {
        for column in 0..columns {
            let p = place(points.len() as u64);
            let between = |t: f64, [a, b]: [f64; 2]| (a + t * (b - a)).min(1.0 - f64::EPSILON / 2.0);
            points.push([(column as f64 + p[0]) / columns as f64, between(p[1], row), between(p[2], bounds)]);
        }
    }
}

/// Divides `count` among `parts` as evenly as possible: how many each gets, and its bounds in `[0, 1]`, in proportion.
fn shares(count: usize, parts: usize) -> impl Iterator<Item = (usize, [f64; 2])> {
    (0..parts).map(move |i| {
        let (start, end) = (i * count / parts, (i + 1) * count / parts);
        (end - start, [start as f64 / count as f64, end as f64 / count as f64])
    })
}
