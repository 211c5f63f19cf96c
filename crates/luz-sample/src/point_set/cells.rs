//! One point in each of `count` boxes of equal volume.

use super::{PointSet, Request};

/// One point in each box, anywhere in it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stratified;

/// One point in each box, at the same place in all of them: a regular grid, whose place is random.
#[derive(Clone, Copy, Debug, Default)]
pub struct Grid;

impl PointSet for Stratified {
    fn uniform(&self, request: &Request) -> Vec<[f64; 3]> {
        points(request, |i| std::array::from_fn(|d| request.random(i, d as u32)))
    }
}

impl PointSet for Grid {
    fn uniform(&self, request: &Request) -> Vec<[f64; 3]> {
        let place = std::array::from_fn(|d| request.random(0, d as u32));
        points(request, |_| place)
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
