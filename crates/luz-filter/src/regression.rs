//! Estimates fitted to the image.

use luz_image::Image;
use rayon::prelude::*;

/// Draws estimates halfway to the line that fits them best, as a function of the image, in the 3×3 pixels around each
/// (after the guided filter of He, Sun and Tang 2010).
///
/// Nearby pixels have estimates of independent neighbours, and an edge-aware filter is locally about linear in the image;
/// so the fit has less variance. Where it isn't linear, the fit is biased: therefore halfway. `sigma_range` says which
/// differences of the image are small; pixels with a value beyond `largest` have no part.
pub(crate) fn fit(image: &Image, estimate: &Image, sigma_range: f32, largest: f32) -> Vec<f32> {
    let (width, height, n) = (image.width(), image.height(), image.channel_count());
    let flat = (0.1 * sigma_range).powi(2);
    let mut fitted = vec![0.0f32; estimate.data().len()];
    fitted.par_chunks_exact_mut(width * n).enumerate().for_each(|(y, row)| {
        let (top, bottom) = (y.saturating_sub(1), (y + 1).min(height - 1));
        for x in 0..width {
            let (left, right) = (x.saturating_sub(1), (x + 1).min(width - 1));
            for c in 0..n {
                let at = |x: usize, y: usize| (y * width + x) * n + c;
                let centre = at(x, y);
                let (value, result) = (image.data()[centre], estimate.data()[centre]);
                // Relative to the centre, so that nothing cancels: value, change, and their products.
                let mut sums = [0.0f32; 5];
                for ny in top..=bottom {
                    for nx in left..=right {
                        let v = image.data()[at(nx, ny)];
                        let change = estimate.data()[at(nx, ny)] - v;
                        let usable = v.abs() <= largest && change.is_finite();
                        let v = v - value;
                        if usable {
                            sums =
                                [sums[0] + 1.0, sums[1] + v, sums[2] + change, sums[3] + v * v, sums[4] + v * change];
                        }
                    }
                }
                let [count, v, change, vv, vc] = sums;
                row[x * n + c] = if count > 0.0 && value.abs() <= largest {
                    let (v, change) = (v / count, change / count);
                    let slope = (vc / count - v * change) / ((vv / count - v * v).max(0.0) + flat);
                    0.5 * (result + value + change - slope * v)
                } else {
                    result
                };
            }
        }
    });
    fitted
}
