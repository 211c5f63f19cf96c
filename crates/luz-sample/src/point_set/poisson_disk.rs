//! Points that keep their distance.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::f64::consts::{FRAC_2_PI, SQRT_2, TAU};

use super::{PointSet, Points, Request, Stratified, is_within, mass_within};
use crate::test_support::normal_survival;

/// Blue noise by sample elimination (Yuksel 2015, "Sample Elimination for Generating Poisson Disk Sample Sets"): of
/// `CANDIDATES` times as many stratified points, those that are too close to others are left out one by one.
///
/// Normal points keep their distance in the distribution's own measure: distances are relative to the local spacing
/// `(count · density)^(−1/d)`. The remaining points are turned at random and their radii moved to even quantiles, which
/// hardly changes distances but makes the density right.
#[derive(Clone, Copy, Debug, Default)]
pub struct PoissonDisk;

/// Candidates for each point that stays.
const CANDIDATES: usize = 4;

impl PointSet for PoissonDisk {
    fn uniform(&self, request: &Request) -> Points {
        let n = request.dimensions;
        let candidates = candidates(request, request.count, |u| *u);
        let spacing = (1.0 / request.count as f64).powf(1.0 / n as f64);
        let near = |d: f64| d - d.round();
        let reach = vec![spacing; candidates.len()];
        let kept = eliminate(&candidates, request.count, &reach, n, Some(1.0), |a, b| {
            (0..n).map(|d| near(a[d] - b[d]).powi(2)).sum::<f64>()
        });
        // A random shift on the torus makes every place equally likely.
        let shift: [f64; 3] = std::array::from_fn(|d| request.random(u64::MAX, d as u32));
        let points = kept
            .into_iter()
            .map(|i| {
                std::array::from_fn(|d| {
                    let v = candidates[i][d] + shift[d];
                    if d < n { (v - v.floor()).min(1.0 - f64::EPSILON / 2.0) } else { 0.0 }
                })
            })
            .collect();
        Points { points, expected_count: request.count as f64 }
    }

    fn normal(&self, request: &Request, limits: [f64; 3]) -> Points {
        let n = request.dimensions;
        let wanted = request.count as f64 / mass_within(n, limits);
        let whole = wanted.ceil() as usize;
        let candidates = candidates(request, whole, |u| {
            let r = (-2.0 * (-u[0]).ln_1p()).sqrt();
            let (sin, cos) = (TAU * u[1]).sin_cos();
            let z = if n > 2 { crate::warp::normal_quantile(u[2].max(1e-12)) } else { 0.0 };
            [r * cos, r * sin, z]
        });
        let reach: Vec<f64> = candidates
            .iter()
            .map(|p| {
                let square: f64 = p.iter().map(|v| v * v).sum();
                let density = (-0.5 * square).exp() / TAU.powf(0.5 * n as f64);
                // Far out, where less than a point is left, the spacing has no meaning.
                (1.0 / (wanted * density)).powf(1.0 / n as f64).min(2.0)
            })
            .collect();
        let kept =
            eliminate(&candidates, whole, &reach, n, None, |a, b| (0..n).map(|d| (a[d] - b[d]).powi(2)).sum::<f64>());
        let mut points: Vec<[f64; 3]> = kept.into_iter().map(|i| candidates[i]).collect();
        set_radii(&mut points, wanted, request.random(u64::MAX, 0), n);
        turn(&mut points, request, n);
        points.retain(|p| is_within(p, n, limits));
        Points { points, expected_count: request.count as f64 }
    }
}

/// Candidates are stratified: where there are too many of them on a large scale, too many would stay.
fn candidates(request: &Request, count: usize, warp: impl Fn(&[f64; 3]) -> [f64; 3]) -> Vec<[f64; 3]> {
    let request = Request { count: CANDIDATES * count, ..*request };
    Stratified.uniform(&request).points.iter().map(warp).collect()
}

/// A candidate by how crowded it is; of equally crowded ones the later one.
#[derive(PartialEq)]
struct Crowded(f64, usize);

impl Eq for Crowded {}

impl PartialOrd for Crowded {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Crowded {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0).then(self.1.cmp(&other.1))
    }
}

/// Leaves out the most crowded candidate until `count` remain; these, in order.
///
/// A candidate is crowded by `(1 − distance / reach)⁸` of every other one, where the reach is that of maximal Poisson disks
/// for the local spacing. `square` is the squared distance; with a `period`, coordinates are on a torus.
fn eliminate(
    points: &[[f64; 3]],
    count: usize,
    spacing: &[f64],
    dimensions: usize,
    period: Option<f64>,
    square: impl Fn(&[f64; 3], &[f64; 3]) -> f64,
) -> Vec<usize> {
    // The largest radius of which disks of unit volume can be packed without overlap, times two.
    let widest =
        if dimensions > 2 { 2.0 * (1.0 / (4.0 * SQRT_2)).cbrt() } else { 2.0 * (1.0 / (2.0 * 3f64.sqrt())).sqrt() };
    // Along the first coordinate, those that can be near are together.
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| points[a][0].total_cmp(&points[b][0]).then(a.cmp(&b)));
    let mut neighbours: Vec<Vec<(usize, f64)>> = vec![Vec::new(); points.len()];
    let mut crowding = vec![0.0; points.len()];
    let loosest = spacing.iter().fold(0.0, |a: f64, &b| a.max(b));
    for (place, &a) in order.iter().enumerate() {
        let ahead = (1..points.len()).map(|step| (place + step) % points.len());
        for b in ahead.map(|next| order[next]) {
            let mut along = points[b][0] - points[a][0];
            if along < 0.0 || (along == 0.0 && b < a) {
                let Some(period) = period else { break };
                along += period;
            }
            if along > 0.5 * widest * (spacing[a] + loosest) {
                break;
            }
            let reach = 0.5 * widest * (spacing[a] + spacing[b]);
            let distance = square(&points[a], &points[b]);
            if distance < reach * reach {
                let weight = (1.0 - distance.sqrt() / reach).powi(8);
                neighbours[a].push((b, weight));
                neighbours[b].push((a, weight));
                crowding[a] += weight;
                crowding[b] += weight;
            }
        }
    }
    let mut heap: BinaryHeap<Crowded> = crowding.iter().enumerate().map(|(i, &c)| Crowded(c, i)).collect();
    let mut alive = vec![true; points.len()];
    let mut left = points.len();
    while left > count {
        let Some(Crowded(c, i)) = heap.pop() else { break };
        if !alive[i] || c != crowding[i] {
            continue;
        }
        alive[i] = false;
        left -= 1;
        for &(j, weight) in &neighbours[i] {
            if alive[j] {
                crowding[j] -= weight;
                heap.push(Crowded(crowding[j], j));
            }
        }
    }
    (0..points.len()).filter(|&i| alive[i]).collect()
}

/// Moves points along their radii to the quantiles `(i + start) / wanted`, in the order of their distance.
fn set_radii(points: &mut Vec<[f64; 3]>, wanted: f64, start: f64, dimensions: usize) {
    let radius = |p: &[f64; 3]| p.iter().map(|v| v * v).sum::<f64>().sqrt();
    points.sort_by(|a, b| radius(a).total_cmp(&radius(b)));
    let mut rank = 0.0;
    points.retain_mut(|p| {
        let u = (rank + start) / wanted;
        rank += 1.0;
        if u >= 1.0 {
            return false;
        }
        let scale = radial_quantile(u, dimensions) / radius(p).max(1e-12);
        p.iter_mut().for_each(|v| *v *= scale);
        true
    });
}

/// The quantile of the length of a standard normal vector.
fn radial_quantile(u: f64, dimensions: usize) -> f64 {
    if dimensions < 3 {
        return (-2.0 * (-u).ln_1p()).sqrt();
    }
    // Bisection of Maxwell's distribution.
    let below = |r: f64| 1.0 - 2.0 * normal_survival(r) - FRAC_2_PI.sqrt() * r * (-0.5 * r * r).exp();
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if below(middle) < u { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Turns all points around the origin by the same random rotation.
fn turn(points: &mut [[f64; 3]], request: &Request, dimensions: usize) {
    let random = |d: u32| request.random(u64::MAX, d);
    let (sin, cos) = (TAU * random(1)).sin_cos();
    // Around the third axis, then the third axis anywhere (Arvo 1992, "Fast Random Rotation Matrices").
    let z = random(2);
    let (phi_sin, phi_cos) = (TAU * random(3)).sin_cos();
    let axis = [phi_cos * z.sqrt(), phi_sin * z.sqrt(), (1.0 - z).sqrt()];
    for p in points {
        *p = [cos * p[0] - sin * p[1], sin * p[0] + cos * p[1], p[2]];
        if dimensions > 2 {
            let along = 2.0 * (0..3).map(|d| axis[d] * p[d]).sum::<f64>();
            *p = std::array::from_fn(|d| along * axis[d] - p[d]);
        }
    }
}
