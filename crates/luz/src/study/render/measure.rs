//! How far a film is from the reference.

use super::reference::Reference;
use crate::study::statistics::{CONFIDENCE, Interval, student_t_quantile};
use luz_image::metrics::RELATIVE_EPSILON;
use luz_render::film::Film;
use luz_sample::statistics::Running;
use serde::Serialize;

/// The errors of a picture, over all pixels and channels, less the reference's own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Errors {
    /// The mean of (x − r)² − Var(r): an unbiased estimate of the mean squared error. Below zero where the error is smaller than
    /// what is not known of the reference.
    pub mse: f64,
    /// The mean of ((x − r)² − Var(r)) / (r² + 0.01).
    pub rel_mse: f64,
    /// The same over all pixels but the thousandth whose (x − r)² / (r² + 0.01) is largest. Where it tells another story than `rel_mse`,
    /// few bright pixels decide about that. It forgives who misses light that is rare: a measure beside the others, not instead of them.
    pub trimmed_rel_mse: f64,
}

/// The share of pixels that [`Errors::trimmed_rel_mse`] leaves out.
const TRIMMED: f64 = 1e-3;

impl Errors {
    /// The errors of a film against a reference of the same size.
    pub(super) fn of(film: &Film, reference: &Reference) -> Self {
        let mut squared = 0.0;
        // Of each pixel, the relative error as it is, and less the reference's own.
        let mut relative: Vec<[f64; 2]> = Vec::with_capacity(reference.compared);
        for (i, (pixel, target)) in film.estimates().zip(&reference.mean).enumerate() {
            if target.iter().all(|v| v.is_finite()) {
                let variance = reference.variance.as_ref().map_or([0.0; 3], |variance| variance[i]);
                let mut pixel_error = [0.0; 2];
                for ((x, r), variance) in pixel.mean.iter().zip(target).zip(variance) {
                    let error = (x - r).powi(2);
                    squared += error;
                    pixel_error[0] += error / (r * r + RELATIVE_EPSILON);
                    pixel_error[1] += (error - variance) / (r * r + RELATIVE_EPSILON);
                }
                relative.push(pixel_error);
            }
        }
        let count = 3.0 * reference.compared.max(1) as f64;
        let own = reference.own.unwrap_or_default();
        let rel_mse = relative.iter().map(|e| e[0]).sum::<f64>() / count - own.rel_mse;
        let trimmed_rel_mse = trimmed_mean(&mut relative) / 3.0;
        Self { mse: squared / count - own.mse, rel_mse, trimmed_rel_mse }
    }
}

/// The mean of the second numbers, the thousandth left out whose first numbers are largest. Sorts them as far as it needs.
pub(super) fn trimmed_mean(pixels: &mut [[f64; 2]]) -> f64 {
    let left_out = (TRIMMED * pixels.len() as f64).ceil() as usize;
    let kept = pixels.len() - left_out;
    if left_out > 0 {
        pixels.select_nth_unstable_by(kept, |a, b| a[0].total_cmp(&b[0]));
    }
    pixels[..kept].iter().map(|pixel| pixel[1]).sum::<f64>() / kept.max(1) as f64
}

/// What is known of a variant's pictures, pixel by pixel, over all seeds.
#[derive(Clone, Debug)]
pub(super) struct Accumulator {
    /// The first picture.
    pub first: Vec<[f32; 3]>,
    /// Σ x over the seeds.
    sum: Vec<[f64; 3]>,
    /// Σ x².
    squares: Vec<[f64; 3]>,
    /// Σ over seeds of the pixel's mean of (x − r)² / (r² + 0.01).
    relative: Vec<f64>,
    /// The mean of each seed's whole picture, over the pixels that are compared.
    pub means: Vec<f64>,
    /// Samples that were not finite.
    pub dropped: u64,
}

impl Accumulator {
    pub fn new(reference: &Reference) -> Self {
        let count = reference.mean.len();
        Self {
            first: Vec::new(),
            sum: vec![[0.0; 3]; count],
            squares: vec![[0.0; 3]; count],
            relative: vec![0.0; count],
            means: Vec::new(),
            dropped: 0,
        }
    }

    /// Takes the picture of another seed in.
    pub fn add(&mut self, film: &Film, reference: &Reference) {
        let is_first = self.first.is_empty();
        let mut total = 0.0;
        for (i, (pixel, target)) in film.estimates().zip(&reference.mean).enumerate() {
            if is_first {
                self.first.push(pixel.mean.map(|v| v as f32));
            }
            let mut relative = 0.0;
            for (c, (x, r)) in pixel.mean.iter().zip(target).enumerate() {
                self.sum[i][c] += x;
                self.squares[i][c] += x * x;
                relative += (x - r).powi(2) / (r * r + RELATIVE_EPSILON);
            }
            self.relative[i] += relative / 3.0;
            if target.iter().all(|v| v.is_finite()) {
                total += pixel.mean.iter().sum::<f64>();
            }
        }
        self.means.push(total / (3.0 * reference.compared.max(1) as f64));
        self.dropped += film.dropped();
    }

    /// The root of the mean over the seeds of each pixel's relative squared error.
    pub fn relative_errors(&self) -> Vec<f32> {
        let count = self.means.len().max(1) as f64;
        self.relative.iter().map(|sum| (sum / count).sqrt() as f32).collect()
    }

    /// The part of the mean squared error that more samples do not lessen: the mean over pixels of (x̄ − r)² − s²/n − Var(r), with
    /// the mean x̄ and the sample variance s² over n seeds. Unbiased, so it scatters around zero where there is no bias; the interval
    /// comes from its scatter over the pixels, taken as independent. `None` with fewer than two seeds, or where the reference's own
    /// error is not known.
    pub fn squared_bias(&self, reference: &Reference) -> Option<Interval> {
        let own = reference.own?.mse;
        let n = self.means.len() as f64;
        if self.means.len() < 2 {
            return None;
        }
        let of_pixel = |((sum, squares), target): ((&[f64; 3], &[f64; 3]), &[f64; 3])| {
            let total: f64 = (0..3)
                .map(|c| {
                    let mean = sum[c] / n;
                    let variance = (squares[c] / n - mean * mean).max(0.0) / (n - 1.0);
                    (mean - target[c]).powi(2) - variance
                })
                .sum();
            total / 3.0
        };
        let pixels = self.sum.iter().zip(&self.squares).zip(&reference.mean);
        let all: Running = pixels.filter(|(_, r)| r.iter().all(|v| v.is_finite())).map(of_pixel).collect();
        let (value, half) = (all.mean() - own, student_t_quantile(0.5 + 0.5 * CONFIDENCE, 1e6) * all.standard_error());
        Some(Interval { value, low: value - half, high: value + half })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::render::reference::ReferenceOrigin;
    use luz_render::film::{FilmContents, PixelBounds};

    /// A film of two pixels with these values, one sample each.
    fn film(values: [f32; 2]) -> Film {
        let mut film = Film::new(FilmContents::default(), PixelBounds { x0: 0, y0: 0, x1: 2, y1: 1 });
        for row in &mut film.rows_mut() {
            for (x, value) in values.into_iter().enumerate() {
                row.add(x, 0, [value; 3], 1.0);
            }
        }
        film
    }

    fn reference(mean: [f64; 2], own: Option<Errors>) -> Reference {
        let mean: Vec<[f64; 3]> = mean.iter().map(|v| [*v; 3]).collect();
        Reference::new([2, 1], mean, own, None, ReferenceOrigin::File { path: "r.exr".into() })
    }

    #[test]
    fn the_reference_own_error_is_subtracted() {
        let own = Errors { mse: 0.01, rel_mse: 0.02, ..Errors::default() };
        let errors = Errors::of(&film([1.5, 2.0]), &reference([1.0, 2.0], Some(own)));
        assert!((errors.mse - (0.25 / 2.0 - 0.01)).abs() < 1e-12);
        assert!((errors.rel_mse - (0.25 / 1.01 / 2.0 - 0.02)).abs() < 1e-12);
    }

    #[test]
    fn pixels_without_a_reference_do_not_count() {
        let errors = Errors::of(&film([1.5, 7.0]), &reference([1.0, f64::NAN], None));
        assert!((errors.mse - 0.25).abs() < 1e-12);
    }

    #[test]
    fn trimming_leaves_the_worst_pixel_out() {
        let errors = Errors::of(&film([9.0, 2.5]), &reference([1.0, 2.0], None));
        assert!((errors.trimmed_rel_mse - 0.25 / 4.01).abs() < 1e-12, "{}", errors.trimmed_rel_mse);
        assert!((errors.rel_mse - (64.0 / 1.01 + 0.25 / 4.01) / 2.0).abs() < 1e-9);
    }

    #[test]
    fn bias_is_told_from_variance() {
        let target = reference([1.0, 1.0], Some(Errors::default()));
        // Off by 0.5 each time: all bias.
        let mut biased = Accumulator::new(&target);
        // Off by 0.5 to either side: its mean is right, and of (x̄ − r)² = 0, s²/n = 0.25 is subtracted.
        let mut noisy = Accumulator::new(&target);
        for sign in [1.0, -1.0] {
            biased.add(&film([1.5, 1.5]), &target);
            noisy.add(&film([1.0 + 0.5 * sign; 2]), &target);
        }
        assert!((biased.squared_bias(&target).unwrap().value - 0.25).abs() < 1e-12);
        assert!((noisy.squared_bias(&target).unwrap().value + 0.25).abs() < 1e-12);
        assert_eq!(biased.means, [1.5, 1.5]);
        assert!((biased.relative_errors()[0] - (0.25f32 / 1.01).sqrt()).abs() < 1e-6);
        let mut one = Accumulator::new(&target);
        one.add(&film([1.0, 1.0]), &target);
        assert_eq!(one.squared_bias(&target), None);
    }
}
