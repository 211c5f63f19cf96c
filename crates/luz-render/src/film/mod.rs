//! The film: what every pixel has received, with its variance.

mod filter;

pub use filter::{Filter, FilterKind, FilterSample};

use luz_image::{Image, ImageError};
use serde::Serialize;

/// What the film measures, besides its own dimensions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum FilmKind {
    /// Colour and its variance.
    Rgb,
    /// Colour, its variance, and what the camera sees first: albedo, normals, position, depth.
    GBuffer,
}

/// What a camera ray met first, as the `gbuffer` film keeps it; world space.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Features {
    /// Directional albedo in the film's RGB.
    pub albedo: [f32; 3],
    /// Geometric normal.
    pub normal: [f32; 3],
    /// Shading normal.
    pub shading_normal: [f32; 3],
    /// Position.
    pub position: [f32; 3],
    /// Distance from the camera's ray origin.
    pub depth: f32,
}

const FEATURES: usize = 13;

impl Features {
    fn as_array(&self) -> [f32; FEATURES] {
        let mut all = [0.0; FEATURES];
        all[0..3].copy_from_slice(&self.albedo);
        all[3..6].copy_from_slice(&self.normal);
        all[6..9].copy_from_slice(&self.shading_normal);
        all[9..12].copy_from_slice(&self.position);
        all[12] = self.depth;
        all
    }
}

const FEATURE_CHANNELS: [&str; FEATURES] =
    ["Albedo.R", "Albedo.G", "Albedo.B", "N.X", "N.Y", "N.Z", "Ns.X", "Ns.Y", "Ns.Z", "P.X", "P.Y", "P.Z", "Z"];

/// The sums of one pixel.
///
/// With filter signs sᵢ = ±1 and samples Lᵢ, the pixel's value is r = Σ sᵢLᵢ / Σ sᵢ, and the variance of that ratio
/// estimator is, to first order, n/(n−1) · Σ (Lᵢ − r)² / (Σ sᵢ)²; for filters without negative lobes it is the sample
/// variance of the mean, exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pixel {
    /// Σ sᵢLᵢ.
    signed: [f64; 3],
    /// Σ Lᵢ.
    plain: [f64; 3],
    /// Σ Lᵢ².
    squared: [f64; 3],
    /// Σ sᵢ.
    weight: f64,
    /// n.
    count: u32,
    /// Samples that were not finite; they are counted as zero in the sums.
    dropped: u32,
}

impl Pixel {
    /// Adds a sample; one that is not finite is counted as dropped and adds zero radiance. Returns whether it was kept.
    #[inline]
    pub fn add(&mut self, rgb: [f32; 3], sign: f32) -> bool {
        let finite = rgb.iter().all(|v| v.is_finite());
        self.weight += f64::from(sign);
        self.count += 1;
        if !finite {
            self.dropped += 1;
            return false;
        }
        for (channel, &value) in rgb.iter().enumerate() {
            let value = f64::from(value);
            self.signed[channel] += f64::from(sign) * value;
            self.plain[channel] += value;
            self.squared[channel] += value * value;
        }
        true
    }

    /// The filtered value; zero without samples.
    pub fn mean(&self) -> [f64; 3] {
        if self.weight == 0.0 { [0.0; 3] } else { self.signed.map(|s| s / self.weight) }
    }

    /// The variance of [`mean`](Self::mean); infinite with fewer than two samples.
    pub fn variance(&self) -> [f64; 3] {
        if self.count < 2 || self.weight == 0.0 {
            return [f64::INFINITY; 3];
        }
        let n = f64::from(self.count);
        let mean = self.mean();
        std::array::from_fn(|c| {
            let spread = self.squared[c] - 2.0 * mean[c] * self.plain[c] + n * mean[c] * mean[c];
            (spread.max(0.0) * n / (n - 1.0)) / (self.weight * self.weight)
        })
    }

    /// How many samples arrived.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// How many of them were not finite.
    pub fn dropped(&self) -> u32 {
        self.dropped
    }
}

/// A rectangle of pixels: `x0 ≤ x < x1`, `y0 ≤ y < y1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct PixelBounds {
    /// Left edge, included.
    pub x0: u32,
    /// Top edge, included.
    pub y0: u32,
    /// Right edge, excluded.
    pub x1: u32,
    /// Bottom edge, excluded.
    pub y1: u32,
}

impl PixelBounds {
    /// Columns.
    pub fn width(&self) -> u32 {
        self.x1 - self.x0
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.y1 - self.y0
    }

    /// Pixels.
    pub fn area(&self) -> usize {
        (self.width() as usize).saturating_mul(self.height() as usize)
    }
}

/// The sums of every pixel within the crop window, row by row.
#[derive(Clone, Debug)]
pub struct Film {
    kind: FilmKind,
    bounds: PixelBounds,
    pixels: Vec<Pixel>,
    features: Vec<[f64; FEATURES]>,
}

/// One row of the film, as a tile writes it.
pub struct FilmRow<'a> {
    /// The sums of the row's pixels.
    pub pixels: &'a mut [Pixel],
    features: &'a mut [[f64; FEATURES]],
}

impl FilmRow<'_> {
    /// Adds what the camera saw first at column `x`, counted from the row's first pixel.
    pub fn add_features(&mut self, x: usize, features: &Features) {
        for (sum, value) in self.features[x].iter_mut().zip(features.as_array()) {
            // Positions can be far away but not infinite; a miss adds zeros.
            *sum += f64::from(if value.is_finite() { value } else { 0.0 });
        }
    }
}

impl Film {
    /// The bytes of memory that a film takes.
    pub fn bytes(kind: FilmKind, bounds: PixelBounds) -> usize {
        let features = if kind == FilmKind::GBuffer { size_of::<[f64; FEATURES]>() } else { 0 };
        bounds.area().saturating_mul(size_of::<Pixel>() + features)
    }

    /// Can the memory for a film be had? (It is asked for and given back.)
    pub fn fits_in_memory(kind: FilmKind, bounds: PixelBounds) -> bool {
        Vec::<u8>::new().try_reserve_exact(Self::bytes(kind, bounds)).is_ok()
    }

    /// A black film without samples.
    pub fn new(kind: FilmKind, bounds: PixelBounds) -> Self {
        let features = if kind == FilmKind::GBuffer { bounds.area() } else { 0 };
        Self { kind, bounds, pixels: vec![Pixel::default(); bounds.area()], features: vec![[0.0; FEATURES]; features] }
    }

    /// What is measured.
    pub fn kind(&self) -> FilmKind {
        self.kind
    }

    /// The pixels that the film covers.
    pub fn bounds(&self) -> PixelBounds {
        self.bounds
    }

    /// The pixels, row by row.
    pub fn pixels(&self) -> &[Pixel] {
        &self.pixels
    }

    /// The film's rows, to be written independently of each other.
    pub fn rows_mut(&mut self) -> Vec<FilmRow<'_>> {
        let width = self.bounds.width() as usize;
        let mut features = self.features.chunks_exact_mut(width.max(1));
        self.pixels
            .chunks_exact_mut(width.max(1))
            .map(|pixels| FilmRow { pixels, features: features.next().unwrap_or_default() })
            .collect()
    }

    /// Samples that were dropped for not being finite.
    pub fn dropped(&self) -> u64 {
        self.pixels.iter().map(|p| u64::from(p.dropped)).sum()
    }

    /// The root of Σ variance over Σ mean², over pixels and channels: the relative standard error of the whole picture.
    pub fn relative_error(&self) -> f64 {
        let (mut variance, mut square) = (0.0, 0.0);
        for pixel in &self.pixels {
            variance += pixel.variance().iter().sum::<f64>();
            square += pixel.mean().iter().map(|m| m * m).sum::<f64>();
        }
        if square > 0.0 { (variance / square).sqrt() } else { f64::INFINITY }
    }

    /// The picture with all that the film knows: `R G B`, `Variance.R …` of those means, and a `gbuffer`'s features.
    ///
    /// # Errors
    /// If the picture does not fit in memory.
    pub fn to_image(&self) -> Result<Image, ImageError> {
        let mut channels: Vec<&str> = vec!["R", "G", "B", "Variance.R", "Variance.G", "Variance.B"];
        if self.kind == FilmKind::GBuffer {
            channels.extend(FEATURE_CHANNELS);
        }
        let mut data = Vec::with_capacity(self.pixels.len() * channels.len());
        for (i, pixel) in self.pixels.iter().enumerate() {
            data.extend(pixel.mean().map(|v| v as f32));
            // One sample says nothing of its variance; files keep finite numbers.
            data.extend(pixel.variance().map(|v| if v.is_finite() { v as f32 } else { 0.0 }));
            if let Some(features) = self.features.get(i) {
                let count = f64::from(pixel.count.max(1));
                data.extend(features.map(|v| (v / count) as f32));
            }
        }
        Image::from_data(self.bounds.width() as usize, self.bounds.height() as usize, channels, data)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_filtered_pixel_has_the_textbook_mean_and_variance() {
        let mut pixel = Pixel::default();
        for value in [1.0, 2.0, 4.0] {
            pixel.add([value, 0.5, 0.0], 1.0);
        }
        assert!((pixel.mean()[0] - 7.0 / 3.0).abs() < 1e-12);
        // Sample variance 7/3, of the mean 7/9.
        assert!((pixel.variance()[0] - 7.0 / 9.0).abs() < 1e-12);
        assert_eq!(pixel.variance()[1], 0.0);
    }

    #[test]
    fn a_nan_is_counted_and_adds_nothing() {
        let mut pixel = Pixel::default();
        assert!(pixel.add([1.0; 3], 1.0));
        assert!(!pixel.add([f32::NAN, 1.0, 1.0], 1.0));
        assert_eq!((pixel.count(), pixel.dropped()), (2, 1));
        assert_eq!(pixel.mean(), [0.5; 3]);
    }

    #[test]
    fn negative_lobes_subtract() {
        let mut pixel = Pixel::default();
        pixel.add([3.0; 3], 1.0);
        pixel.add([3.0; 3], 1.0);
        pixel.add([3.0; 3], -1.0);
        assert_eq!(pixel.mean(), [3.0; 3]);
        assert_eq!(pixel.variance(), [0.0; 3]);
    }
}
