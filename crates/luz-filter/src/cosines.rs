//! The filter for guides of a single channel in a time that doesn't depend on the window: both Gaussians as sums of cosines.
//!
//! Over guide values within a range of width `D`, `g_r(d) ≈ Σ_k a_k cos(kωd)`, a Fourier series of period `T > D`. With
//! `cos(kω(g(y) − g(x))) = cos kωg(x) cos kωg(y) + sin kωg(x) sin kωg(y)` the sums over neighbours become spatial filters of
//! the images `cos kωg`, `sin kωg`, and of their products with the values (Chaudhury, Sage and Unser 2011, "Fast O(1)
//! Bilateral Filtering Using Trigonometric Range Kernels"). Spatial filters over the window are sums of cosines, too
//! (Sugimoto and Kamata 2015, "Compressive Bilateral Filtering").

use luz_image::Image;

use crate::pattern::{self, Window};
use crate::plan::{Content, Plan};
use crate::run;
use crate::simd::{CosinePass, CosineTerm, Level, RowJob};
use crate::tile::{Area, Layout};
use crate::worker::{Rows, Worker};
use crate::{FilterError, Precision, Progress, Report};

/// Why the method can't be used for a plan, if so.
pub(crate) fn obstacle(plan: &Plan<'_>) -> Option<&'static str> {
    match plan.groups.as_slice() {
        [group] if group.channels > 1 => Some("the guide has several channels; use sampling"),
        [group] if group.factor.is_some() => Some("the guide has widths of its own for each pixel; use sampling"),
        [_] if plan.window.frame_radius > 0 => Some("videos are sampled; use sampling"),
        [_] => None,
        _ => Some("there are several guides; use sampling"),
    }
}

/// About how many neighbours of a sampled filter take the time of this method; none where the method can't be used.
pub(crate) fn cost(plan: &Plan<'_>, quality: f64) -> Option<f64> {
    if obstacle(plan).is_some() {
        return None;
    }
    let source = plan.sources.iter().find(|source| source.plane == plan.groups[0].plane)?;
    let Content::Channels { scale, factor, .. } = source.content else { return None };
    let values = plan.frame.input(source.input).data();
    let usable = values.iter().filter(|v| v.is_finite());
    let (low, high) = usable.fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), &v| (a.min(v), b.max(v)));
    let span = f64::from(factor * (scale.forward(high) - scale.forward(low))).max(0.0);
    let (_, amplitudes) =
        range_terms(GUIDE_SIGMA * f64::from(plan.precision.unit()).sqrt(), span, range_error(quality));
    let filters = (2 * amplitudes.len() - 1) * (1 + plan.values.1);
    let margin = 1.0 + 2.0 * plan.window.radius as f64 / SIDE as f64;
    Some(FILTER_COST * filters as f64 * terms(&plan.window, quality) as f64 / 4.0 * margin * margin)
}

/// The time for a spatial filter by four cosines relative to that for a neighbour, measured.
const FILTER_COST: f64 = 28.0;
/// The side of a tile in pixels.
const SIDE: usize = 256;
/// The width of the range Gaussian on the scale of the planes.
const GUIDE_SIGMA: f64 = 0.849_321_800_288_019_1;

/// The number of spatial cosines for a quality in dB. Three don't fit small windows.
fn terms(window: &Window, quality: f64) -> usize {
    match quality {
        q if q <= 85.0 && window.radius < 8 => 4,
        q if q <= 60.0 => 3,
        q if q <= 85.0 => 4,
        q if q <= 95.0 => 5,
        _ => 6,
    }
}

/// The largest error of the range Gaussian for a quality in dB. Errors are relative to the sum over the window; few pixels
/// have much less weight than that (see [`LEAST_WEIGHT`]), and errors of opposite signs cancel.
fn range_error(quality: f64) -> f64 {
    (0.2 * 10f64.powf(-quality / 20.0)).clamp(1e-7, 1e-3)
}

/// Pixels with less than this part of the window's weight are filtered exactly.
const LEAST_WEIGHT: f64 = 0.01;

/// Filters the plan's frame to a quality in dB.
pub(crate) fn filter(
    plan: &Plan<'_>,
    quality: f64,
    report: &mut Report,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Image, FilterError> {
    if let Some(reason) = obstacle(plan) {
        return Err(FilterError::Unsuitable { method: "the method of cosines", reason: reason.to_owned() });
    }
    let mut plan = plan.clone();
    plan.lay_out(Precision::Full)?;
    let spatial = spatial_terms(&plan.window, terms(&plan.window, quality));
    report.samples_per_pixel = f64::NAN;
    let settings = Settings { spatial, quality };
    let extra = |layout: &Layout| {
        let margin = layout.width + 2 * layout.margin;
        let tile = margin.next_multiple_of(CosinePass::BLOCK) * (layout.height + 2 * layout.margin);
        (8 + 2 * plan.values.1) * tile * 4
    };
    let patterns = [pattern::window(&plan.window)];
    run::tiles(&plan, &patterns, &[Some(plan.frame)], report, progress, SIDE, extra, |worker, area, out| {
        filter_area(worker, area, &settings, out)
    })
}

struct Settings {
    spatial: Vec<CosineTerm>,
    /// In dB.
    quality: f64,
}

/// The amplitudes of `count` cosines whose sum fits the spatial Gaussian over the window best, in the mean square.
///
/// Their period is somewhat longer than the window, which makes the fit much better than a Fourier series.
fn spatial_terms(window: &Window, count: usize) -> Vec<CosineTerm> {
    let stretch = [1.12, 1.22, 1.34, 1.44][count.clamp(3, 6) - 3];
    let count = count.min(window.radius + 1);
    let step = std::f64::consts::PI / ((window.radius as f64 + 0.5) * stretch);
    // Normal equations; few and far from singular.
    let mut rows = vec![vec![0.0; count + 1]; count];
    for j in 0..=window.radius {
        let weight = if j == 0 { 1.0 } else { 2.0 };
        let cosine = |m: usize| (m as f64 * step * j as f64).cos();
        let gaussian = (-0.5 * (j as f64 / window.sigma).powi(2)).exp();
        for (m, row) in rows.iter_mut().enumerate() {
            for (n, entry) in row[..count].iter_mut().enumerate() {
                *entry += weight * cosine(m) * cosine(n);
            }
            row[count] += weight * cosine(m) * gaussian;
        }
    }
    let amplitudes = solve(rows);
    amplitudes
        .into_iter()
        .enumerate()
        .map(|(m, amplitude)| CosineTerm { amplitude, frequency: m as f64 * step })
        .collect()
}

/// The solution of linear equations with their right-hand sides in the last column, by Gaussian elimination with pivoting.
fn solve(mut rows: Vec<Vec<f64>>) -> Vec<f64> {
    let n = rows.len();
    for i in 0..n {
        let pivot = (i..n).max_by(|&a, &b| rows[a][i].abs().total_cmp(&rows[b][i].abs())).unwrap_or(i);
        rows.swap(i, pivot);
        let (above, below) = rows.split_at_mut(i + 1);
        let row = &above[i];
        for other in below {
            let factor = other[i] / row[i];
            other.iter_mut().zip(row).for_each(|(a, b)| *a -= factor * b);
        }
    }
    let mut solution = vec![0.0; n];
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|j| rows[i][j] * solution[j]).sum();
        solution[i] = (rows[i][n] - known) / rows[i][i];
    }
    solution
}

/// The Fourier series of the range Gaussian of width `sigma` for differences up to `span`: the angular frequency of the
/// first term, and the amplitudes. What is left out, and what comes from the next period, is below `error`.
fn range_terms(sigma: f64, span: f64, error: f64) -> (f64, Vec<f64>) {
    use std::f64::consts::TAU;
    let reach = (-2.0 * error.ln()).sqrt();
    let period = span + reach * sigma;
    let count = (reach * period / (TAU * sigma)).ceil() as usize;
    let scale = sigma * TAU.sqrt() / period;
    let amplitude = |k: usize| {
        let decay = (-0.5 * (TAU * k as f64 * sigma / period).powi(2)).exp();
        if k == 0 { scale } else { 2.0 * scale * decay }
    };
    (TAU / period, (0..=count).map(amplitude).collect())
}

/// Filters the area of the loaded tile. Returns how many pixels were excluded.
fn filter_area(worker: &mut Worker<'_>, area: &Area, settings: &Settings, out_rows: &mut Rows<'_>) -> u64 {
    let (plan, layout) = (worker.plan, worker.tile.layout);
    let (level, r, values) = (plan.level, plan.window.radius, plan.values.1);
    let (width, height) = (area.width + 2 * r, area.height + 2 * r);
    let columns = width.next_multiple_of(CosinePass::BLOCK);
    let skip = layout.margin - r;
    // Copies the rows of a plane of the tile, with the window's reach.
    let plane = |index: usize| {
        let mut copy = vec![0.0f32; columns * height];
        for (y, row) in copy.chunks_exact_mut(columns).enumerate() {
            let from = index * layout.plane_size + layout.index(skip, y + skip);
            row[..width].copy_from_slice(&worker.tile.planes[from..from + width]);
        }
        copy
    };
    let guide = plane(plan.groups[0].plane);
    let used: Vec<bool> = guide.iter().map(|&g| g < crate::plan::LARGEST).collect();
    let (low, high) = guide
        .iter()
        .zip(&used)
        .filter(|(_, used)| **used)
        .fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), (&g, _)| (a.min(g), b.max(g)));
    let span = f64::from(high - low).max(0.0);
    let (frequency, amplitudes) = range_terms(GUIDE_SIGMA, span, range_error(settings.quality));

    // Values relative to their mean, so that errors of the weights matter less.
    let mut means = vec![0.0f32; values];
    let inputs: Vec<Vec<f32>> = (0..values)
        .map(|v| {
            let mut values = plane(plan.values.0 + v);
            let of_used = || values.iter().zip(&used).filter(|(_, used)| **used).map(|(&v, _)| f64::from(v));
            let mean = (of_used().sum::<f64>() / of_used().count().max(1) as f64) as f32;
            means[v] = mean;
            values.iter_mut().zip(&used).for_each(|(v, used)| *v = if *used { *v - mean } else { 0.0 });
            values
        })
        .collect();
    // Excluded pixels have neither cosine nor sine.
    let angles = |f: fn(f64) -> f64| -> Vec<f32> {
        let angle = |g: f32| frequency * f64::from(g - low);
        guide.iter().zip(&used).map(|(&g, used)| if *used { f(angle(g)) as f32 } else { 0.0 }).collect()
    };
    let (by_cos, by_sin) = (angles(f64::cos), angles(f64::sin));
    let mut cos: Vec<f32> = used.iter().map(|used| f32::from(u8::from(*used))).collect();
    let mut sin = vec![0.0f32; cos.len()];

    let mut spatial = Spatial::new(level, area, r, columns, &settings.spatial);
    let out = spatial.columns * area.height;
    let mut weights = vec![0.0f32; out];
    let mut sums = vec![vec![0.0f32; out]; values];
    let mut product = vec![0.0f32; cos.len()];
    for (k, &amplitude) in amplitudes.iter().enumerate() {
        if k > 0 {
            level.rotate(&mut cos, &mut sin, &by_cos, &by_sin);
        }
        for wave in [&cos, &sin].into_iter().take(if k == 0 { 1 } else { 2 }) {
            spatial.add(wave, wave, amplitude as f32, &mut weights);
            for (input, sum) in inputs.iter().zip(&mut sums) {
                level.multiply(wave, input, &mut product);
                spatial.add(&product, wave, amplitude as f32, sum);
            }
        }
    }

    // The window's sum, against which errors of the weights are to be seen.
    let whole: f64 = (0..=2 * r).map(|j| (-0.5 * ((j as f64 - r as f64) / plan.window.sigma).powi(2)).exp()).sum();
    let least = (LEAST_WEIGHT * whole * whole) as f32;
    let mut rows = vec![0.0f32; RowJob::BLOCK.max(area.width.next_multiple_of(RowJob::BLOCK)) * values];
    let mut exact = vec![0.0f32; RowJob::BLOCK * values];
    let mut excluded = 0;
    for y in 0..area.height {
        let stride = area.width.next_multiple_of(RowJob::BLOCK);
        let at = |x: usize| y * spatial.columns + x;
        for x in 0..area.width {
            for v in 0..values {
                rows[v * stride + x] = (sums[v][at(x)] / weights[at(x)] + means[v]) / plan.value_factor;
            }
        }
        // Pixels that resemble hardly anything are filtered exactly.
        for start in (0..area.width).step_by(RowJob::BLOCK) {
            let end = (start + RowJob::BLOCK).min(area.width);
            if (start..end).any(|x| weights[at(x)] < least) {
                worker.filter_block([start, y], &mut exact);
                for x in (start..end).filter(|&x| weights[at(x)] < least) {
                    (0..values).for_each(|v| rows[v * stride + x] = exact[v * RowJob::BLOCK + x - start]);
                }
            }
        }
        excluded += worker.put_row(area, [0, y], 1, &mut rows, stride, out_rows);
    }
    excluded
}

/// The spatial filter of the images of a tile.
struct Spatial<'a> {
    level: Level,
    width: usize,
    height: usize,
    radius: usize,
    /// Of the images, rounded up.
    input_columns: usize,
    /// Of the results, rounded up.
    columns: usize,
    terms: &'a [CosineTerm],
    start: Vec<f32>,
    turned: Vec<f32>,
    filtered: Vec<f32>,
}

impl<'a> Spatial<'a> {
    fn new(level: Level, area: &Area, radius: usize, input_columns: usize, terms: &'a [CosineTerm]) -> Self {
        let (columns, rows) = (area.width.next_multiple_of(16), area.height.next_multiple_of(CosinePass::BLOCK));
        Self {
            level,
            width: area.width,
            height: area.height,
            radius,
            input_columns,
            columns,
            terms,
            start: CosinePass::start(terms, radius),
            turned: vec![0.0; input_columns * rows],
            filtered: vec![0.0; rows * columns],
        }
    }

    /// Adds to `sum` the filtered `image` times `amplitude` and the samples of `wave` at the centres.
    fn add(&mut self, image: &[f32], wave: &[f32], amplitude: f32, sum: &mut [f32]) {
        let rows = self.height.next_multiple_of(CosinePass::BLOCK);
        self.level.cosine_pass(CosinePass {
            from: image,
            columns: self.input_columns,
            rows: self.height,
            radius: self.radius,
            terms: self.terms,
            start: &self.start,
            to: &mut self.turned,
            stride: rows,
        });
        self.level.cosine_pass(CosinePass {
            from: &self.turned,
            columns: rows,
            rows: self.width,
            radius: self.radius,
            terms: self.terms,
            start: &self.start,
            to: &mut self.filtered,
            stride: self.columns,
        });
        for y in 0..self.height {
            let centre = (y + self.radius) * self.input_columns + self.radius;
            let row = y * self.columns..y * self.columns + self.width;
            let wave = &wave[centre..centre + self.width];
            self.level.add_product(&self.filtered[row.clone()], wave, amplitude, &mut sum[row]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_of_cosines_fit_the_spatial_gaussian() {
        for sigma in [0.3, 1.0, 4.0, 33.3] {
            let window = Window { sigma, radius: (2.5 * sigma).ceil() as usize, sigma_frames: 1.0, frame_radius: 0 };
            for (count, bound) in [(3, 1e-2), (4, 2e-4), (5, 5e-5), (6, 1e-6)] {
                if count == 3 && window.radius < 8 {
                    continue;
                }
                let terms = spatial_terms(&window, count);
                for j in 0..=window.radius {
                    let sum: f64 = terms.iter().map(|t| t.amplitude * (t.frequency * j as f64).cos()).sum();
                    let error = (sum - (-0.5 * (j as f64 / sigma).powi(2)).exp()).abs();
                    assert!(error < bound, "{sigma} {count} {j}: {error}");
                }
            }
        }
    }

    #[test]
    fn the_series_fits_the_range_gaussian() {
        for span in [0.0, 0.5, 20.0] {
            let (frequency, amplitudes) = range_terms(0.8, span, 1e-5);
            for i in 0..=100 {
                let d = span * f64::from(i) / 100.0;
                let sum: f64 = amplitudes.iter().enumerate().map(|(k, a)| a * (k as f64 * frequency * d).cos()).sum();
                assert!((sum - (-0.5 * (d / 0.8).powi(2)).exp()).abs() < 4e-5, "{span} {d}");
            }
        }
    }
}
