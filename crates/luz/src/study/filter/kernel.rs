//! The kernel of the bilateral filter at a pixel: what each neighbour counts there.

use super::FilterStudy;
use luz_filter::BilateralFilter;
use luz_image::Image;

/// The weights of the neighbours of a pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Kernel {
    /// What the place is like.
    pub name: String,
    /// Column and row.
    pub at: [usize; 2],
    /// The width of the window in pixels.
    pub window: usize,
    /// `f_s · g_r` for each neighbour, row by row; the pixel itself has 1, and what lies beyond the image has NaN.
    pub weights: Vec<f32>,
    /// The values there; those beyond the image are NaN. As many channels as the image has.
    pub values: Vec<f32>,
    /// How many neighbours of equal weight would make as good a mean: (Σ w)² / Σ w².
    pub effective: f64,
    /// The same of the spatial Gaussian alone.
    pub effective_gaussian: f64,
}

impl Kernel {
    /// The kernel at a pixel, which is inside the image.
    pub fn new(study: &FilterStudy, values: &Image, name: String, at: [usize; 2]) -> Self {
        let radius = BilateralFilter::new(study.sigma_spatial, study.sigma_range).radius() as i64;
        let centre = values.pixel(at[0], at[1]);
        let (mut weights, mut shown) = (Vec::new(), Vec::new());
        let (mut sums, mut gaussian) = ([0.0f64; 2], [0.0f64; 2]);
        for dy in -radius..=radius {
            for dx in -radius..=radius {
                let place = [at[0] as i64 + dx, at[1] as i64 + dy];
                let spatial = (-0.5 * (dx * dx + dy * dy) as f64 / f64::from(study.sigma_spatial).powi(2)).exp();
                gaussian = [gaussian[0] + spatial, gaussian[1] + spatial * spatial];
                let is_inside =
                    (0..values.width() as i64).contains(&place[0]) && (0..values.height() as i64).contains(&place[1]);
                if !is_inside {
                    weights.push(f32::NAN);
                    shown.extend(std::iter::repeat_n(f32::NAN, centre.len()));
                    continue;
                }
                let pixel = values.pixel(place[0] as usize, place[1] as usize);
                let distance: f64 = pixel.iter().zip(centre).map(|(a, b)| f64::from(a - b).powi(2)).sum();
                let weight = spatial * (-0.5 * distance / f64::from(study.sigma_range).powi(2)).exp();
                sums = [sums[0] + weight, sums[1] + weight * weight];
                weights.push(weight as f32);
                shown.extend_from_slice(pixel);
            }
        }
        let effective = |[sum, squares]: [f64; 2]| if squares > 0.0 { sum * sum / squares } else { 0.0 };
        Self {
            name,
            at,
            window: 2 * radius as usize + 1,
            weights,
            values: shown,
            effective: effective(sums),
            effective_gaussian: effective(gaussian),
        }
    }
}

/// A flat place, an edge, and a corner or texture, by the structure tensor (Harris and Stephens 1988, "A Combined Corner and Edge
/// Detector") over 7 × 7 pixels; `margin` pixels from the border where the image is large enough.
pub fn interesting_pixels(values: &Image, margin: usize) -> Vec<(String, [usize; 2])> {
    const REACH: usize = 3;
    let (width, height, n) = (values.width(), values.height(), values.channel_count());
    let margin = |size: usize| (margin + REACH + 1).min(size.saturating_sub(1) / 2);
    let (mx, my) = (margin(width), margin(height));
    let grey = |x: usize, y: usize| values.pixel(x, y).iter().sum::<f32>() / n as f32;
    let gradient = |x: usize, y: usize| {
        let (right, left) = ((x + 1).min(width - 1), x.saturating_sub(1));
        let (down, up) = ((y + 1).min(height - 1), y.saturating_sub(1));
        [grey(right, y) - grey(left, y), grey(x, down) - grey(x, up)]
    };
    let mut best = [(f32::INFINITY, [width / 2, height / 2]); 3];
    // Every third pixel is enough to find one.
    for y in (my..height - my).step_by(3) {
        for x in (mx..width - mx).step_by(3) {
            let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
            for v in y.saturating_sub(REACH)..=(y + REACH).min(height - 1) {
                for u in x.saturating_sub(REACH)..=(x + REACH).min(width - 1) {
                    let [gx, gy] = gradient(u, v);
                    xx += gx * gx;
                    xy += gx * gy;
                    yy += gy * gy;
                }
            }
            let root = (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt();
            let (large, small) = (0.5 * (xx + yy) + root, 0.5 * (xx + yy) - root);
            for (best, score) in best.iter_mut().zip([large, 4.0 * small - large, -small]) {
                if score < best.0 {
                    *best = (score, [x, y]);
                }
            }
        }
    }
    let names = ["A flat place", "An edge", "A corner or texture"];
    let mut places: Vec<(String, [usize; 2])> = Vec::new();
    for (name, (_, at)) in names.into_iter().zip(best) {
        if places.iter().all(|(_, other)| *other != at) {
            places.push((name.to_owned(), at));
        }
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A dark field with a bright rectangle, whose corner and edges are known.
    fn picture() -> Image {
        let data = (0..96 * 80).map(|i| if i % 96 >= 48 && i / 96 >= 40 { 0.9 } else { 0.1 }).collect();
        Image::from_data(96, 80, ["Y"], data).unwrap()
    }

    #[test]
    fn places_are_what_they_are_called() {
        let places = interesting_pixels(&picture(), 8);
        let at = |index: usize| places[index].1;
        assert!(at(0)[0].abs_diff(48) > 4 || at(0)[1].abs_diff(40) > 4);
        let is_edge = at(1)[0].abs_diff(48) <= 3 || at(1)[1].abs_diff(40) <= 3;
        assert!(is_edge && (at(1)[0].abs_diff(48) > 3 || at(1)[1].abs_diff(40) > 3), "{places:?}");
        assert!(at(2)[0].abs_diff(48) <= 3 && at(2)[1].abs_diff(40) <= 3, "{places:?}");
        for (width, height) in [(1, 1), (1, 7), (9, 2)] {
            let tiny = Image::new(width, height, ["Y"]).unwrap();
            assert!(interesting_pixels(&tiny, 20).iter().all(|(_, at)| at[0] < width && at[1] < height));
        }
    }

    #[test]
    fn kernels_follow_edges_and_end_with_the_image() {
        let study = FilterStudy { sigma_spatial: 2.0, ..FilterStudy::default() };
        let flat = Kernel::new(&study, &picture(), String::new(), [20, 20]);
        assert_eq!((flat.window, flat.weights.len(), flat.weights[60]), (11, 121, 1.0));
        assert!((flat.effective - flat.effective_gaussian).abs() < 1e-6);
        let edge = Kernel::new(&study, &picture(), String::new(), [48, 60]);
        assert!(edge.effective < 0.7 * flat.effective && edge.weights[59] < 1e-6 && edge.weights[61] > 0.8);
        let corner = Kernel::new(&study, &picture(), String::new(), [0, 0]);
        assert_eq!(corner.weights.iter().filter(|w| w.is_nan()).count(), 121 - 36);
    }
}
