//! The film: what every pixel has received, with its variance.

mod bounds;
mod filter;
mod fixed;
mod footprint;
mod layers;
mod pixel;
mod splat;

pub use bounds::{FilmWindow, PixelBounds};
pub use filter::{Filter, FilterKind, FilterSample};
pub use footprint::Footprint;
pub use layers::{Features, FilmLayers, LayerSample, TechniqueShares};
pub use pixel::{Estimate, Pixel, SignedSums};
pub use splat::{Normalization, SplatContents, SplatSums};

use bytemuck::{cast_slice, cast_slice_mut};
use luz_image::{Image, ImageError};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// What the film measures, by its name in scene files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum FilmKind {
    /// Colour and its variance.
    Rgb,
    /// Colour, its variance, and what the camera sees first: albedo, normals, position, depth.
    GBuffer,
}

/// What a film keeps of each pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FilmContents {
    /// Channels beside colour and variance.
    pub layers: FilmLayers,
    /// Two independent halves of each pixel, each with sums of its own, so that one can decide how long the other is sampled.
    pub halves: bool,
    /// Signed sums, for filters with negative lobes.
    pub signed: bool,
    /// What arrives anywhere.
    pub splats: SplatContents,
}

impl FilmContents {
    /// How many independent sums each pixel has.
    pub fn buffers(self) -> usize {
        if self.halves { 2 } else { 1 }
    }

    fn pixel_bytes(self) -> usize {
        let signed = if self.signed { size_of::<SignedSums>() } else { 0 };
        self.buffers() * (size_of::<Pixel>() + signed) + self.layers.len() * size_of::<f64>()
    }
}

/// Bytes that are copied by one thread.
const COPIED_AT_ONCE: usize = 1 << 20;

/// The sums of every pixel within the crop window, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    contents: FilmContents,
    bounds: PixelBounds,
    /// The buffers of a pixel stand beside each other.
    pixels: Vec<Pixel>,
    /// As many as pixels, or none.
    signed: Vec<SignedSums>,
    layers: Vec<f64>,
    splats: Option<SplatSums>,
}

/// One row of the film, as whoever samples it writes it.
pub struct FilmRow<'a> {
    contents: FilmContents,
    pixels: &'a mut [Pixel],
    signed: &'a mut [SignedSums],
    layers: &'a mut [f64],
}

impl FilmRow<'_> {
    /// Adds a sample to a half of the pixel at column `x`, counted from the row's first pixel; `sign` is that of the pixel
    /// filter. There is but the first half unless the film keeps two. Returns whether the sample was finite.
    #[inline]
    pub fn add(&mut self, x: usize, half: usize, rgb: [f32; 3], sign: f32) -> bool {
        let index = x * self.contents.buffers() + half;
        let was_kept = self.pixels[index].add(rgb);
        if let Some(signed) = self.signed.get_mut(index) {
            signed.add(rgb, sign, was_kept);
        }
        was_kept
    }

    /// Adds to the layers at column `x`; `sign` is that of the pixel filter.
    pub fn add_layers(&mut self, x: usize, sample: &LayerSample, sign: f32) {
        let count = self.contents.layers.len();
        sample.add_to(self.contents.layers, &mut self.layers[x * count..(x + 1) * count], sign);
    }
}

impl Film {
    /// The bytes of memory that a film takes.
    pub fn bytes(contents: FilmContents, bounds: PixelBounds) -> usize {
        bounds.area().saturating_mul(contents.pixel_bytes().saturating_add(contents.splats.pixel_bytes()))
    }

    /// The bytes of so many pixels of a film, but for splats; `None` beyond all memory.
    pub fn bytes_of(contents: FilmContents, pixels: usize) -> Option<usize> {
        pixels.checked_mul(contents.pixel_bytes())
    }

    /// Can the memory for a film be had? (It is asked for and given back.)
    pub fn fits_in_memory(contents: FilmContents, bounds: PixelBounds) -> bool {
        Vec::<u8>::new().try_reserve_exact(Self::bytes(contents, bounds)).is_ok()
    }

    /// A black film without samples.
    pub fn new(contents: FilmContents, bounds: PixelBounds) -> Self {
        let buffers = bounds.area() * contents.buffers();
        Self {
            contents,
            bounds,
            pixels: vec![Pixel::default(); buffers],
            signed: vec![SignedSums::default(); if contents.signed { buffers } else { 0 }],
            layers: vec![0.0; bounds.area() * contents.layers.len()],
            splats: SplatSums::new(contents.splats, bounds),
        }
    }

    /// What arrived anywhere; `None` where no splats are kept.
    pub fn splats(&self) -> Option<&SplatSums> {
        self.splats.as_ref()
    }

    /// As [`splats`](Self::splats), to be counted.
    pub fn splats_mut(&mut self) -> Option<&mut SplatSums> {
        self.splats.as_mut()
    }

    /// What is kept.
    pub fn contents(&self) -> FilmContents {
        self.contents
    }

    /// The pixels that the film covers.
    pub fn bounds(&self) -> PixelBounds {
        self.bounds
    }

    /// What is known of each pixel, row by row.
    pub fn estimates(&self) -> impl ExactSizeIterator<Item = Estimate> {
        let buffers = self.contents.buffers();
        let mutations = self.splats.as_ref().map_or(0, SplatSums::mutations);
        let mutations_each = mutations.div_ceil(self.bounds.area().max(1) as u64);
        self.pixels.chunks_exact(buffers).enumerate().map(move |(i, halves)| {
            let signed = self.contents.signed.then(|| &self.signed[i * buffers..(i + 1) * buffers]);
            let of_samples = Estimate::of_halves(halves, signed);
            match &self.splats {
                Some(splats) => of_samples.with_splats(splats.estimate(i), mutations_each),
                None => of_samples,
            }
        })
    }

    /// The sums of one half of the pixels, row by row.
    pub fn half(&self, half: usize) -> impl ExactSizeIterator<Item = &Pixel> {
        self.pixels.iter().skip(half).step_by(self.contents.buffers())
    }

    /// The film's rows, to be written independently of each other.
    pub fn rows_mut(&mut self) -> Vec<FilmRow<'_>> {
        self.rows_and_splats_mut().0
    }

    /// The film's rows, to be written independently of each other, and its splats, to be added to by whomever.
    pub fn rows_and_splats_mut(&mut self) -> (Vec<FilmRow<'_>>, Option<&SplatSums>) {
        let (contents, width) = (self.contents, self.bounds.width() as usize);
        let buffers = (width * contents.buffers()).max(1);
        let mut signed = self.signed.chunks_exact_mut(buffers);
        let mut layers = self.layers.chunks_exact_mut((width * contents.layers.len()).max(1));
        let rows = self.pixels.chunks_exact_mut(buffers).map(|pixels| FilmRow {
            contents,
            pixels,
            signed: signed.next().unwrap_or_default(),
            layers: layers.next().unwrap_or_default(),
        });
        (rows.collect(), self.splats.as_ref())
    }

    /// The sums of runs of pixels: pixels, signed sums, layers, in little-endian numbers.
    pub(crate) fn bytes_of_runs(&self, runs: &[Range<usize>]) -> Vec<u8> {
        let (buffers, layers) = (self.contents.buffers(), self.contents.layers.len());
        let scaled = |scale: usize| runs.iter().map(move |run| run.start * scale..run.end * scale);
        let mut sources: Vec<&[u8]> = scaled(buffers).map(|run| cast_slice(&self.pixels[run])).collect();
        if self.contents.signed {
            sources.extend(scaled(buffers).map(|run| cast_slice::<_, u8>(&self.signed[run])));
        }
        sources.extend(scaled(layers).map(|run| cast_slice::<_, u8>(&self.layers[run])));
        let mut bytes = vec![0; sources.iter().map(|source| source.len()).sum()];
        // The memory is new, and most of the time goes into having it: so several threads ask for it.
        let mut rest = bytes.as_mut_slice();
        let mut copies = Vec::new();
        for chunk in sources.iter().flat_map(|source| source.chunks(COPIED_AT_ONCE)) {
            let (to, behind) = rest.split_at_mut(chunk.len());
            copies.push((to, chunk));
            rest = behind;
        }
        copies.into_par_iter().for_each(|(to, chunk)| to.copy_from_slice(chunk));
        bytes
    }

    /// Takes over what [`bytes_of_runs`](Self::bytes_of_runs) gave of the same runs of such a film; `None` if the bytes are too few
    /// or too many.
    pub(crate) fn read_runs(&mut self, runs: &[Range<usize>], bytes: &[u8]) -> Option<()> {
        let (buffers, layers) = (self.contents.buffers(), self.contents.layers.len());
        let pixels: usize = runs.iter().map(Range::len).sum();
        if Some(bytes.len()) != Self::bytes_of(self.contents, pixels) {
            return None;
        }
        let mut rest = bytes;
        let mut fill = |to: &mut [u8]| {
            let (bytes, behind) = rest.split_at(to.len());
            to.copy_from_slice(bytes);
            rest = behind;
        };
        let scaled = |scale: usize| runs.iter().map(move |run| run.start * scale..run.end * scale);
        scaled(buffers).for_each(|run| fill(cast_slice_mut(&mut self.pixels[run])));
        if self.contents.signed {
            scaled(buffers).for_each(|run| fill(cast_slice_mut(&mut self.signed[run])));
        }
        scaled(layers).for_each(|run| fill(cast_slice_mut(&mut self.layers[run])));
        Some(())
    }

    /// The mean over the pixels of their relative standard errors, the largest hundredth left out, in which a few pixels that
    /// rare paths light would drown all others. A pixel's is √(mean variance / (mean squared value + 0.01)) over its channels,
    /// as relMSE has it. Infinite while the variance is unknown.
    pub fn typical_error(&self) -> f64 {
        let average = |values: [f64; 3]| values.iter().sum::<f64>() / 3.0;
        let of_pixel = |pixel: Estimate| (average(pixel.variance) / (average(pixel.mean.map(|m| m * m)) + 0.01)).sqrt();
        let mut errors: Vec<f64> = self.estimates().filter(|pixel| pixel.count > 0).map(of_pixel).collect();
        let kept = errors.len() - errors.len() / 100;
        if kept == 0 {
            return f64::INFINITY;
        }
        errors.select_nth_unstable_by(kept - 1, f64::total_cmp);
        errors[..kept].iter().sum::<f64>() / kept as f64
    }

    /// Samples that arrived; mutations, where Markov chains make the picture.
    pub fn samples(&self) -> u64 {
        match self.splats.as_ref().map_or(0, SplatSums::mutations) {
            0 => self.pixels.iter().map(|p| u64::from(p.count())).sum(),
            mutations => mutations,
        }
    }

    /// Samples and splats that were dropped for not being finite.
    pub fn dropped(&self) -> u64 {
        let samples: u64 = self.pixels.iter().map(|p| u64::from(p.dropped())).sum();
        samples.saturating_add(self.splats.as_ref().map_or(0, SplatSums::dropped))
    }

    /// The root of Σ variance over Σ mean², over sampled pixels and channels: the relative standard error of the whole picture.
    pub fn relative_error(&self) -> f64 {
        let (mut variance, mut square) = (0.0, 0.0);
        for pixel in self.estimates().filter(|pixel| pixel.count > 0) {
            variance += pixel.variance.iter().sum::<f64>();
            square += pixel.mean.iter().map(|m| m * m).sum::<f64>();
        }
        if square > 0.0 { (variance / square).sqrt() } else { f64::INFINITY }
    }

    /// The picture with all that the film knows: `R G B`, `Variance.R …` of those means, and the layers.
    ///
    /// # Errors
    /// If the picture does not fit in memory.
    pub fn to_image(&self) -> Result<Image, ImageError> {
        let layers = self.contents.layers;
        let mut channels: Vec<&str> = vec!["R", "G", "B", "Variance.R", "Variance.G", "Variance.B"];
        channels.extend(layers.channels());
        let mut data = Vec::with_capacity(self.bounds.area() * channels.len());
        for (i, pixel) in self.estimates().enumerate() {
            data.extend(pixel.mean.map(|v| v as f32));
            // One sample says nothing of its variance; files keep finite numbers.
            data.extend(pixel.variance.map(|v| if v.is_finite() { v as f32 } else { 0.0 }));
            let sums = &self.layers[i * layers.len()..(i + 1) * layers.len()];
            data.extend(LayerSample::means(layers, sums, f64::from(pixel.count), pixel.weight));
        }
        Image::from_data(self.bounds.width() as usize, self.bounds.height() as usize, channels, data)
    }
}
