//! Pearson's χ² test, of counts and of a `sample`/`pdf` pair.

use std::f64::consts::PI;

use glam::{Vec2, Vec3};

use super::gamma::{chi2_survival, regularized_gamma};
use super::quadrature::{Rectangle, integrate_rectangle};
use crate::Samples;
use crate::random::Random;

/// The least expected count of a cell; smaller cells are pooled.
const POOL_BELOW: f64 = 5.0;

/// Bins of the sphere along `cos θ` and along the azimuth.
const SPHERE_BINS: [usize; 2] = [24, 48];

/// What a χ² test found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chi2Result {
    /// How often samples of the claimed density would differ from it at least as much; 0 where one of them was impossible.
    pub p_value: f64,
    /// `Σ (observed − expected)² / expected` over the pooled cells.
    pub statistic: f64,
    /// Pooled cells, less one.
    pub degrees_of_freedom: f64,
    /// The integral of the claimed density over the domain; 1 where every sample is valid.
    pub pdf_integral: f64,
    /// The fraction of samples that were valid.
    pub valid: f64,
}

impl Chi2Result {
    /// Whether the hypothesis stands at a significance, such as 0.01 or one from [`super::sidak`].
    pub fn passes(&self, significance: f64) -> bool {
        self.p_value >= significance
    }

    const IMPOSSIBLE: Self =
        Self { p_value: 0.0, statistic: f64::INFINITY, degrees_of_freedom: 0.0, pdf_integral: f64::NAN, valid: 0.0 };
}

/// Compares observed counts with expected ones of the same total.
///
/// Cells that expect fewer than five are pooled. Where even the pool expects fewer, it is tested by the tail of the Poisson
/// distribution, so that a few samples where hardly any may be are noticed; the smaller p-value of the two counts double.
pub fn chi2(observed: &[u64], expected: &[f64]) -> Chi2Result {
    let (mut statistic, mut cells) = (0.0, 0.0f64);
    let (mut pool_observed, mut pool_expected) = (0.0, 0.0);
    let mut add = |o: f64, e: f64| {
        statistic += (o - e) * (o - e) / e;
        cells += 1.0;
    };
    for (&o, &e) in observed.iter().zip(expected) {
        if !e.is_finite() || e < 0.0 || (e == 0.0 && o > 0) {
            return Chi2Result::IMPOSSIBLE;
        }
        if e < POOL_BELOW {
            pool_observed += o as f64;
            pool_expected += e;
        } else {
            add(o as f64, e);
        }
    }
    let mut tail = 1.0;
    if pool_expected >= POOL_BELOW {
        add(pool_observed, pool_expected);
    } else if pool_observed > 0.0 {
        // P(X ≥ k) of a Poisson variable of mean μ is P(k, μ).
        tail = regularized_gamma(pool_observed, pool_expected).0;
    }
    let degrees_of_freedom = (cells - 1.0).max(0.0);
    let body = if degrees_of_freedom > 0.0 { chi2_survival(statistic, degrees_of_freedom) } else { 1.0 };
    let p_value = if tail < 1.0 { (2.0 * tail.min(body)).min(1.0) } else { body };
    Chi2Result { p_value, statistic, degrees_of_freedom, pdf_integral: f64::NAN, valid: 1.0 }
}

/// Tests that the directions of `sample` have the density `pdf`, in solid angle.
///
/// `sample` maps uniform numbers to a unit direction, or to `None` where sampling fails (as a BSDF's does below the
/// horizon); failures are expected as often as the integral of `pdf` falls short of one. `n` directions are counted in
/// 24 × 48 bins of (cos θ, φ), over which `pdf` is integrated numerically; bins that expect few are pooled. Use `n ≥ 10⁵`.
/// Every sample needs a positive density at the very direction that was returned, too.
///
/// A `sample` that needs more than two numbers draws the others itself.
pub fn chi2_sphere(
    mut sample: impl FnMut(Vec2) -> Option<Vec3>,
    pdf: impl Fn(Vec3) -> f64,
    n: u64,
    seed: u64,
) -> Chi2Result {
    let direction = |cos: f64, phi: f64| {
        let r = ((1.0 - cos) * (1.0 + cos)).max(0.0).sqrt();
        Vec3::new((r * phi.cos()) as f32, (r * phi.sin()) as f32, cos as f32)
    };
    let mut impossible = false;
    let result = chi2_cells(
        |random| {
            let w = sample(random.next_2d())?;
            let density = pdf(w);
            impossible |= !(w.is_normalized() && density > 0.0 && density.is_finite());
            Some([f64::from(w.z), f64::from(w.y).atan2(f64::from(w.x))])
        },
        |cos, phi| pdf(direction(cos, phi)),
        [-1.0, 1.0, -PI, PI],
        SPHERE_BINS,
        n,
        seed,
    );
    if impossible { Chi2Result { p_value: 0.0, ..result } } else { result }
}

/// Tests that the points of `sample` have the density `pdf`, in area, on the rectangle `[x0, x1] × [y0, y1]`, cut into
/// `bins`; otherwise as [`chi2_sphere`]. Points outside the rectangle are impossible.
pub fn chi2_rectangle(
    mut sample: impl FnMut(Vec2) -> Option<Vec2>,
    pdf: impl Fn(Vec2) -> f64,
    rectangle: [f64; 4],
    bins: [usize; 2],
    n: u64,
    seed: u64,
) -> Chi2Result {
    let mut impossible = false;
    let result = chi2_cells(
        |random| {
            let p = sample(random.next_2d())?;
            let density = pdf(p);
            let [x0, x1, y0, y1] = rectangle;
            let inside = (x0..=x1).contains(&f64::from(p.x)) && (y0..=y1).contains(&f64::from(p.y));
            impossible |= !(inside && density > 0.0 && density.is_finite());
            Some([f64::from(p.x), f64::from(p.y)])
        },
        |x, y| pdf(Vec2::new(x as f32, y as f32)),
        rectangle,
        bins,
        n,
        seed,
    );
    if impossible { Chi2Result { p_value: 0.0, ..result } } else { result }
}

/// Tests that the numbers of `sample` have the density `pdf` on `[a, b]`, cut into `bins`. Numbers outside count as
/// failures, so that the ends of an unbounded distribution may be cut off.
pub fn chi2_interval(
    mut sample: impl FnMut(f32) -> f32,
    pdf: impl Fn(f32) -> f64,
    [a, b]: [f64; 2],
    bins: usize,
    n: u64,
    seed: u64,
) -> Chi2Result {
    let mut impossible = false;
    let result = chi2_cells(
        |random| {
            let x = sample(random.next_1d());
            let density = pdf(x);
            impossible |= !(density > 0.0 && density.is_finite());
            (a..=b).contains(&f64::from(x)).then_some([f64::from(x), 0.5])
        },
        |x, _| pdf(x as f32),
        [a, b, 0.0, 1.0],
        [bins, 1],
        n,
        seed,
    );
    if impossible { Chi2Result { p_value: 0.0, ..result } } else { result }
}

/// Counts samples in the cells of a rectangle and compares them with the integral of the density over each.
fn chi2_cells(
    mut sample: impl FnMut(&mut Random) -> Option<[f64; 2]>,
    pdf: impl Fn(f64, f64) -> f64,
    [x0, x1, y0, y1]: Rectangle,
    [columns, rows]: [usize; 2],
    n: u64,
    seed: u64,
) -> Chi2Result {
    let (width, height) = ((x1 - x0) / columns as f64, (y1 - y0) / rows as f64);
    let cell = |x: f64, start: f64, size: f64, count: usize| (((x - start) / size).max(0.0) as usize).min(count - 1);
    let mut observed = vec![0u64; columns * rows + 1];
    for i in 0..n {
        let index = match sample(&mut Random::new(seed, 0, i)) {
            Some([x, y]) => cell(y, y0, height, rows) * columns + cell(x, x0, width, columns),
            None => columns * rows,
        };
        observed[index] += 1;
    }
    let mut expected: Vec<f64> = (0..columns * rows)
        .map(|i| {
            let (x, y) = (x0 + (i % columns) as f64 * width, y0 + (i / columns) as f64 * height);
            let count = observed[i] as f64;
            // A fiftieth of the statistical error. Cells that hold much are looked at closely, lest a narrow peak slip
            // between the nodes.
            let tolerance = 0.02 * count.max(POOL_BELOW).sqrt() / n as f64;
            let depth = if count * (columns * rows) as f64 > 4.0 * n as f64 { 4 } else { 1 };
            let integral =
                |depth| n as f64 * integrate_rectangle(&pdf, [x, x + width, y, y + height], tolerance, depth);
            let coarse = integral(depth);
            if coarse >= 0.25 * count {
                return coarse;
            }
            // More samples than the density explains, unless it has been missed. What falls in a corner finer still is left
            // to the density at the samples themselves.
            integral(depth + 3).max(tolerance * n as f64)
        })
        .collect();
    let pdf_integral = expected.iter().sum::<f64>() / n as f64;
    let valid = 1.0 - observed[columns * rows] as f64 / n as f64;
    // The quadrature's own error must not count as impossible failures, nor as an excess.
    let failures = (1.0 - pdf_integral) * n as f64;
    let slack = 0.1 * (n as f64).sqrt();
    if failures.abs() <= slack && observed[columns * rows] == 0 {
        let scale = n as f64 / expected.iter().sum::<f64>();
        expected.iter_mut().for_each(|e| *e *= scale);
        expected.push(0.0);
    } else if failures < -slack {
        return Chi2Result { pdf_integral, valid, ..Chi2Result::IMPOSSIBLE };
    } else {
        expected.push(failures.max(0.0) + slack.min(observed[columns * rows] as f64));
    }
    Chi2Result { pdf_integral, valid, ..chi2(&observed, &expected) }
}
