//! Structural similarity.

use rayon::prelude::*;

use crate::Image;

/// The window's width in pixels.
const WINDOW: usize = 11;
/// The standard deviation of the window's Gaussian in pixels.
const SIGMA: f64 = 1.5;

/// The structural similarity of one channel of two images of the same size, for samples in `[0, peak]`: 1 for equal images.
///
/// The mean over all positions of an 11×11 Gaussian window (σ = 1.5) that lies inside the image, with K₁ = 0.01 and K₂ = 0.03.
/// Windows with infinite or NaN samples are left out. None where no window is left.
/// Source: Wang, Bovik, Sheikh & Simoncelli 2004, "Image Quality Assessment: From Error Visibility to Structural Similarity".
///
/// # Panics
/// When the images' sizes or numbers of channels differ, or the channel doesn't exist.
pub fn ssim(image: &Image, reference: &Image, channel: usize, peak: f64) -> Option<f64> {
    let (width, height, n) = (image.width(), image.height(), image.channel_count());
    assert_eq!((width, height, n), (reference.width(), reference.height(), reference.channel_count()));
    assert!(channel < n, "channel {channel} of {n}");
    if width < WINDOW || height < WINDOW {
        return None;
    }
    let weights = gaussian();
    let rows: Vec<(f64, usize)> = (0..=height - WINDOW)
        .into_par_iter()
        .map(|top| {
            // Columns first: the moments Σa, Σb, Σa², Σb², Σab of each, and its holes.
            let mut moments = vec![[0.0f64; 5]; width];
            let mut holes = vec![0u32; width];
            for (dy, weight) in weights.iter().enumerate() {
                let start = (top + dy) * width * n;
                let a = image.data()[start..start + width * n].iter().skip(channel).step_by(n);
                let b = reference.data()[start..start + width * n].iter().skip(channel).step_by(n);
                for ((&a, &b), (moments, holes)) in a.zip(b).zip(moments.iter_mut().zip(&mut holes)) {
                    if a.is_finite() && b.is_finite() {
                        let (a, b) = (f64::from(a), f64::from(b));
                        for (moment, value) in moments.iter_mut().zip([a, b, a * a, b * b, a * b]) {
                            *moment += weight * value;
                        }
                    } else {
                        *holes += 1;
                    }
                }
            }
            let mut sum = 0.0;
            let mut count = 0;
            for (window, holes) in moments.windows(WINDOW).zip(holes.windows(WINDOW)) {
                if holes.iter().any(|&h| h > 0) {
                    continue;
                }
                let mut m = [0.0; 5];
                for (column, weight) in window.iter().zip(&weights) {
                    for (m, value) in m.iter_mut().zip(column) {
                        *m += weight * value;
                    }
                }
                sum += similarity(m, peak);
                count += 1;
            }
            (sum, count)
        })
        .collect();
    let (sum, count) = rows.iter().fold((0.0, 0), |(s, c), row| (s + row.0, c + row.1));
    (count > 0).then(|| sum / count as f64)
}

/// Equation 13 of Wang et al., of the weighted moments of a window.
fn similarity([a, b, aa, bb, ab]: [f64; 5], peak: f64) -> f64 {
    let (c1, c2) = ((0.01 * peak).powi(2), (0.03 * peak).powi(2));
    let (variance_a, variance_b, covariance) = ((aa - a * a).max(0.0), (bb - b * b).max(0.0), ab - a * b);
    (2.0 * a * b + c1) * (2.0 * covariance + c2) / ((a * a + b * b + c1) * (variance_a + variance_b + c2))
}

/// The window's weights along one axis, of sum one.
fn gaussian() -> [f64; WINDOW] {
    let weights: [f64; WINDOW] = std::array::from_fn(|i| {
        let x = i as f64 - (WINDOW / 2) as f64;
        (-x * x / (2.0 * SIGMA * SIGMA)).exp()
    });
    let sum: f64 = weights.iter().sum();
    weights.map(|w| w / sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(width: usize, height: usize, f: impl Fn(usize, usize) -> f32) -> Image {
        let data = (0..width * height).map(|i| f(i % width, i / width)).collect();
        Image::from_data(width, height, ["Y"], data).unwrap()
    }

    #[test]
    fn agrees_with_the_definition_computed_directly() {
        let a = grey(15, 13, |x, y| ((x * 5 + y * 3) % 11) as f32 / 11.0);
        let b = grey(15, 13, |x, y| ((x * 4 + y * 7) % 13) as f32 / 13.0);
        let w = gaussian();
        let mut sum = 0.0;
        for top in 0..3 {
            for left in 0..5 {
                let each = |f: &dyn Fn(f64, f64) -> f64| {
                    let mut total = 0.0;
                    for dy in 0..11 {
                        for dx in 0..11 {
                            let (x, y) = (left + dx, top + dy);
                            total += w[dx] * w[dy] * f(a.pixel(x, y)[0].into(), b.pixel(x, y)[0].into());
                        }
                    }
                    total
                };
                let (ma, mb) = (each(&|a, _| a), each(&|_, b| b));
                let va = each(&|a, _| (a - ma) * (a - ma));
                let vb = each(&|_, b| (b - mb) * (b - mb));
                let cov = each(&|a, b| (a - ma) * (b - mb));
                sum += (2.0 * ma * mb + 1e-4) * (2.0 * cov + 9e-4) / ((ma * ma + mb * mb + 1e-4) * (va + vb + 9e-4));
            }
        }
        let value = ssim(&a, &b, 0, 1.0).unwrap();
        assert!((value - sum / 15.0).abs() < 1e-12, "{value}");
    }

    #[test]
    fn noise_and_inversion_lower_it() {
        let a = grey(32, 32, |x, y| ((x / 4 + y / 4) % 2) as f32);
        let inverted = grey(32, 32, |x, y| 1.0 - ((x / 4 + y / 4) % 2) as f32);
        let noisy = grey(32, 32, |x, y| ((x / 4 + y / 4) % 2) as f32 + 0.1 * ((x * 37 + y * 91) % 10) as f32 / 10.0);
        let value = ssim(&noisy, &a, 0, 1.0).unwrap();
        assert!(value < 0.999 && value > 0.8, "{value}");
        assert!(ssim(&inverted, &a, 0, 1.0).unwrap() < -0.5);
    }

    #[test]
    fn holes_and_small_images_are_left_out() {
        let mut a = grey(24, 11, |x, _| x as f32);
        let b = a.clone();
        a.pixel_mut(2, 5)[0] = f32::NAN;
        assert_eq!(ssim(&a, &b, 0, 1.0), Some(1.0));
        a.pixel_mut(12, 5)[0] = f32::INFINITY;
        a.pixel_mut(20, 5)[0] = f32::INFINITY;
        assert_eq!(ssim(&a, &b, 0, 1.0), None);
        assert_eq!(ssim(&grey(10, 30, |_, _| 0.0), &grey(10, 30, |_, _| 0.0), 0, 1.0), None);
    }
}
