//! Which pixels a film position belongs to, and with which weights.

use super::bounds::PixelBounds;
use super::filter::{Filter, FilterKind};
use glam::Vec2;

/// Values of the profile along x that are kept.
const KEPT: usize = 16;

/// Spreads splats over pixels: each receives what its filter, normalised to an integral of 1 px², has at the splat's distance.
///
/// So a pixel's expectation is `∫ h(film) L(film) / ∫ h`, the same as that of filter importance sampling, whose samples are
/// drawn in proportion to |h| and weighted with its sign.
#[derive(Clone, Debug)]
pub struct Footprint {
    filter: Filter,
    radius: Vec2,
    inverse_integral: f64,
    bounds: PixelBounds,
}

impl Footprint {
    /// Of a filter, over the pixels of a film.
    pub fn new(filter: &Filter, bounds: PixelBounds) -> Self {
        let integral = filter.integral();
        let inverse_integral = if integral > 0.0 { 1.0 / integral } else { 0.0 };
        Self { filter: filter.clone(), radius: filter.radius(), inverse_integral, bounds }
    }

    /// Calls `receive` with the number of each pixel in whose filter `film`, in pixels of the frame, lies, and with the filter's
    /// value there, in 1/px².
    #[inline]
    pub fn spread(&self, film: Vec2, mut receive: impl FnMut(usize, f64)) {
        let PixelBounds { x0, y0, x1, y1 } = self.bounds;
        let range = |at: f32, radius: f32, first: u32, end: u32| {
            // Pixel p is centred at p + 1/2, and has all with −radius ≤ at − (p + 1/2) < radius. (A NaN is in none.)
            let from = ((at - radius - 0.5).floor() + 1.0).max(first as f32) as u32;
            let to = ((at + radius - 0.5).floor() + 1.0).min(end as f32) as u32;
            from..if at.is_nan() { from } else { to }
        };
        let width = (x1 - x0) as usize;
        let (columns, rows) = (range(film.x, self.radius.x, x0, x1), range(film.y, self.radius.y, y0, y1));
        if self.filter.kind() == FilterKind::Box {
            // The profile is one everywhere.
            for y in rows {
                for x in columns.clone() {
                    receive((y - y0) as usize * width + (x - x0) as usize, self.inverse_integral);
                }
            }
            return;
        }
        // The profile along x is the same for all rows. Wide filters have more pixels than are kept, and are taken piece by piece.
        let mut first = columns.start;
        while first < columns.end {
            let end = columns.end.min(first + KEPT as u32);
            let mut across = [0.0; KEPT];
            for (value, x) in across.iter_mut().zip(first..end) {
                *value = self.filter.profile(0, film.x - (x as f32 + 0.5));
            }
            for y in rows.clone() {
                let down = f64::from(self.filter.profile(1, film.y - (y as f32 + 0.5))) * self.inverse_integral;
                let row = (y - y0) as usize * width;
                for (value, x) in across.iter().zip(first..end) {
                    receive(row + (x - x0) as usize, f64::from(*value) * down);
                }
            }
            first = end;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: PixelBounds = PixelBounds { x0: 3, y0: 2, x1: 13, y1: 9 };

    fn filters() -> [Filter; 5] {
        [
            Filter::unit_box(),
            Filter::new(FilterKind::Triangle, Vec2::splat(2.0)),
            Filter::new(FilterKind::Gaussian { sigma: 0.5 }, Vec2::splat(1.5)),
            Filter::new(FilterKind::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 }, Vec2::splat(2.0)),
            Filter::new(FilterKind::LanczosSinc { tau: 3.0 }, Vec2::splat(4.0)),
        ]
    }

    #[test]
    fn the_unit_box_gives_all_to_one_pixel() {
        let footprint = Footprint::new(&Filter::unit_box(), BOUNDS);
        for (film, expected) in [
            ((3.0, 2.0), Some(0)),
            ((12.99, 8.99), Some(69)),
            ((4.5, 3.5), Some(11)),
            ((2.9, 4.0), None),
            ((13.0, 4.0), None),
        ] {
            let mut found = Vec::new();
            footprint.spread(film.into(), |pixel, weight| found.push((pixel, weight)));
            assert_eq!(found, expected.map(|pixel| (pixel, 1.0)).into_iter().collect::<Vec<_>>(), "{film:?}");
        }
        footprint.spread(Vec2::NAN, |_, _| panic!("nowhere"));
        footprint.spread(Vec2::splat(f32::INFINITY), |_, _| panic!("nowhere"));
    }

    /// Splats all over the plane, in proportion to a radiance that is a polynomial over the film, give each pixel what its samples
    /// average to, to three digits.
    #[test]
    fn splats_and_samples_have_the_same_expectation() {
        let radiance = |film: Vec2| 1.0 + f64::from(film.x) * 0.5 + f64::from(film.y * film.y) * 0.02;
        const STEPS: usize = 20;
        for filter in filters() {
            let footprint = Footprint::new(&filter, BOUNDS);
            let mut splatted = vec![0.0; BOUNDS.area()];
            let area = 1.0 / (STEPS * STEPS) as f64;
            for i in 0..22 * STEPS {
                for j in 0..22 * STEPS {
                    let film = (Vec2::new(i as f32, j as f32) + 0.5) / STEPS as f32 - 4.0;
                    footprint.spread(film, |pixel, weight| splatted[pixel] += radiance(film) * weight * area);
                }
            }
            // Signed moments of the samples' offsets: 1, x, y, y².
            let mut moments = [0.0; 4];
            const N: usize = 2000;
            for i in 0..N * N {
                let u = (Vec2::new((i % N) as f32, (i / N) as f32) + 0.5) / N as f32;
                let sample = filter.sample(u);
                let (sign, x, y) = (f64::from(sample.sign), f64::from(sample.offset.x), f64::from(sample.offset.y));
                moments.iter_mut().zip([1.0, x, y, y * y]).for_each(|(sum, value)| *sum += sign * value);
            }
            for (pixel, splatted) in splatted.into_iter().enumerate() {
                let (x, y) = ((pixel % 10) as f64 + 3.5, (pixel / 10) as f64 + 2.5);
                let [m, mx, my, myy] = moments;
                let sampled = 1.0 + 0.5 * (x + mx / m) + 0.02 * (y * y + 2.0 * y * my / m + myy / m);
                assert!((splatted - sampled).abs() < 3e-3 * sampled, "{:?} {splatted} {sampled}", filter.kind());
            }
        }
    }
}
