//! What lies beyond an image's edges, and smaller versions of it.

use rayon::prelude::*;

use crate::Image;

/// What lies beyond an image's edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum WrapMode {
    /// The image again.
    #[default]
    Repeat,
    /// Zero.
    Black,
    /// The nearest pixel of the edge.
    Clamp,
    /// The neighbour on the sphere of an equal-area octahedral map (Clarberg 2008): each edge continues mirrored into itself.
    Octahedral,
}

impl WrapMode {
    /// The mode of a pbrt-v4 name: `repeat`, `black`, `clamp` or `octahedralsphere`.
    pub fn parse(name: &str) -> Option<Self> {
        match name {
            "repeat" => Some(Self::Repeat),
            "black" => Some(Self::Black),
            "clamp" => Some(Self::Clamp),
            "octahedralsphere" => Some(Self::Octahedral),
            _ => None,
        }
    }

    /// The pixel inside a `width` × `height` image that stands for the pixel (`x`, `y`); none where that is black.
    #[inline]
    pub fn apply(self, x: i64, y: i64, width: usize, height: usize) -> Option<(usize, usize)> {
        let (w, h) = (width as i64, height as i64);
        if (0..w).contains(&x) && (0..h).contains(&y) {
            return Some((x as usize, y as usize));
        }
        match self {
            Self::Repeat => Some((x.rem_euclid(w) as usize, y.rem_euclid(h) as usize)),
            Self::Black => None,
            Self::Clamp => Some((x.clamp(0, w - 1) as usize, y.clamp(0, h - 1) as usize)),
            Self::Octahedral => {
                // Crossing an edge mirrors the other coordinate; both edges may be crossed.
                let (x, flip_y) = mirror(x, w);
                let (y, flip_x) = mirror(y, h);
                let x = if flip_x { w - 1 - x } else { x };
                let y = if flip_y { h - 1 - y } else { y };
                Some((x as usize, y as usize))
            }
        }
    }
}

/// Folds a coordinate back into `[0, size)` at the edges; true where the number of folds is odd.
fn mirror(i: i64, size: i64) -> (i64, bool) {
    let folded = i.rem_euclid(2 * size);
    if folded < size { (folded, false) } else { (2 * size - 1 - folded, true) }
}

/// How pixels are averaged into those of an image of half the size.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum MipFilter {
    /// The mean over the area of the larger pixel: 2×2 pixels, for odd sizes with fractions of pixels
    /// (Guthe & Heckbert 2005). Exact, and independent of what lies beyond the edges.
    #[default]
    Box,
    /// A tent twice as wide: the weights 1 3 3 1 along each axis for even sizes. Smoother.
    Triangle,
}

impl Image {
    /// The sample of a channel at (`x`, `y`), which may lie beyond the edges.
    #[inline]
    pub fn sample(&self, x: i64, y: i64, channel: usize, wrap: WrapMode) -> f32 {
        match wrap.apply(x, y, self.width(), self.height()) {
            Some((x, y)) => self.pixel(x, y)[channel],
            None => 0.0,
        }
    }

    /// The image at half the size along each axis, rounded down but at least one pixel.
    #[must_use]
    pub fn resize_half(&self, filter: MipFilter, wrap: WrapMode) -> Self {
        let n = self.channel_count();
        let (width, height) = ((self.width() / 2).max(1), (self.height() / 2).max(1));
        let columns: Vec<Vec<(i64, f32)>> = (0..width).map(|x| taps(filter, x, self.width(), width)).collect();
        let mut data = vec![0.0; width * height * n];
        data.par_chunks_exact_mut(width * n).enumerate().for_each(|(y, row)| {
            let rows = taps(filter, y, self.height(), height);
            for (pixel, columns) in row.chunks_exact_mut(n).zip(&columns) {
                for &(sy, wy) in &rows {
                    for &(sx, wx) in columns {
                        if let Some((x, y)) = wrap.apply(sx, sy, self.width(), self.height()) {
                            for (sum, value) in pixel.iter_mut().zip(self.pixel(x, y)) {
                                *sum += wy * wx * value;
                            }
                        }
                    }
                }
            }
        });
        Self::replace(self, width, height, data)
    }

    /// The image and its successive halves, down to one pixel.
    pub fn pyramid(self, filter: MipFilter, wrap: WrapMode) -> Vec<Self> {
        let mut levels = vec![self];
        while let Some(last) = levels.last().filter(|l| l.width() > 1 || l.height() > 1) {
            let next = last.resize_half(filter, wrap);
            levels.push(next);
        }
        levels
    }

    /// An image of the same channels with new pixels, whose number fits.
    fn replace(&self, width: usize, height: usize, data: Vec<f32>) -> Self {
        let mut image = self.clone_shape(width, height, data);
        image.metadata.placement = None;
        image
    }
}

/// The pixels along one axis that make up the output pixel `i` of `to`, out of `from`, with weights that sum to one.
fn taps(filter: MipFilter, i: usize, from: usize, to: usize) -> Vec<(i64, f32)> {
    let ratio = from as f64 / to as f64;
    let mut taps = Vec::new();
    match filter {
        MipFilter::Box => {
            let (start, end) = (i as f64 * ratio, (i + 1) as f64 * ratio);
            for k in start.floor() as i64..end.ceil() as i64 {
                let overlap = end.min((k + 1) as f64) - start.max(k as f64);
                if overlap > 1e-9 {
                    taps.push((k.min(from as i64 - 1), overlap));
                }
            }
        }
        MipFilter::Triangle => {
            let center = (i as f64 + 0.5) * ratio;
            for k in (center - ratio).floor() as i64..=(center + ratio).ceil() as i64 {
                let weight = 1.0 - (k as f64 + 0.5 - center).abs() / ratio;
                if weight > 1e-9 {
                    taps.push((k, weight));
                }
            }
        }
    }
    let sum: f64 = taps.iter().map(|t| t.1).sum();
    taps.into_iter().map(|(k, w)| (k, (w / sum) as f32)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: usize, height: usize, f: impl Fn(usize, usize) -> f32) -> Image {
        let data = (0..width * height).map(|i| f(i % width, i / width)).collect();
        Image::from_data(width, height, ["Y"], data).unwrap()
    }

    #[test]
    fn wrap_modes_continue_the_image() {
        use WrapMode::*;
        for (mode, x, y, expected) in [
            (Repeat, -1, 5, Some((3, 1))),
            (Repeat, 8, -4, Some((0, 0))),
            (Black, -1, 0, None),
            (Black, 2, 3, Some((2, 3))),
            (Clamp, -7, 9, Some((0, 3))),
            // Beyond the left edge the sphere continues in the mirrored row of the first column.
            (Octahedral, -1, 0, Some((0, 3))),
            (Octahedral, 4, 1, Some((3, 2))),
            (Octahedral, 1, -1, Some((2, 0))),
            (Octahedral, 1, 4, Some((2, 3))),
            // The four corners are one point of the sphere.
            (Octahedral, -1, -1, Some((3, 3))),
        ] {
            assert_eq!(mode.apply(x, y, 4, 4), expected, "{mode:?} {x} {y}");
        }
        assert_eq!(WrapMode::parse("octahedralsphere"), Some(Octahedral));
        assert_eq!(WrapMode::parse("mirror"), None);
    }

    #[test]
    fn halves_average_two_by_two() {
        let half = image(4, 2, |x, y| (x + 10 * y) as f32).resize_half(MipFilter::Box, WrapMode::Black);
        assert_eq!((half.width(), half.height()), (2, 1));
        assert_eq!(half.data(), [5.5, 7.5]);
    }

    #[test]
    fn odd_sizes_lose_no_light() {
        for (w, h) in [(5, 3), (7, 1), (1, 9), (1, 1), (3, 3), (17, 12)] {
            let full = image(w, h, |x, y| ((x * 7 + y * 13) % 11) as f32);
            let mean = |i: &Image| i.data().iter().sum::<f32>() / i.data().len() as f32;
            for level in full.clone().pyramid(MipFilter::Box, WrapMode::Black) {
                assert!((mean(&level) - mean(&full)).abs() < 1e-4, "{w}×{h}");
            }
        }
    }

    #[test]
    fn triangle_weights_are_binomial_and_wrap() {
        let t = taps(MipFilter::Triangle, 1, 8, 4);
        assert_eq!(t, [(1, 0.125), (2, 0.375), (3, 0.375), (4, 0.125)]);
        let full = image(8, 8, |x, _| if x == 7 { 8.0 } else { 0.0 });
        let repeat = full.resize_half(MipFilter::Triangle, WrapMode::Repeat);
        assert_eq!(repeat.pixel(0, 0), [1.0]);
        assert_eq!(full.resize_half(MipFilter::Triangle, WrapMode::Black).pixel(0, 0), [0.0]);
        let constant = image(6, 4, |_, _| 2.0);
        for wrap in [WrapMode::Repeat, WrapMode::Clamp, WrapMode::Octahedral] {
            assert!(constant.resize_half(MipFilter::Triangle, wrap).data().iter().all(|v| (v - 2.0).abs() < 1e-6));
        }
    }

    #[test]
    fn pyramids_end_in_one_pixel() {
        let levels = image(9, 4, |_, _| 1.0).pyramid(MipFilter::Box, WrapMode::Clamp);
        let sizes: Vec<_> = levels.iter().map(|l| (l.width(), l.height())).collect();
        assert_eq!(sizes, [(9, 4), (4, 2), (2, 1), (1, 1)]);
    }
}
