//! Splats: light that arrives anywhere on the film, whatever pixel asked for it.

use super::bounds::PixelBounds;
use super::fixed::FixedImage;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicU64, Ordering};

/// What a film keeps of splats.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum SplatContents {
    /// There are none.
    #[default]
    None,
    /// Those of independent paths, with their squares.
    Paths,
    /// Those of Markov chains, in so many independent batches.
    Batches(u32),
}

impl SplatContents {
    /// Bytes of memory of one pixel.
    pub(super) fn pixel_bytes(self) -> usize {
        let images = match self {
            Self::None => 0,
            Self::Paths => 2,
            Self::Batches(batches) => batches as usize,
        };
        images.saturating_mul(FixedImage::PIXEL_BYTES)
    }
}

/// Splats of a greater magnitude are dropped, as if they were infinite: their squares would leave the range of the sums.
const GREATEST: f64 = (1u64 << 44) as f64;
/// Squares are kept in these units, so that they fit.
const SQUARE_UNIT: f64 = (1u64 << 32) as f64;

/// The splats of a film.
#[derive(Debug)]
pub struct SplatSums {
    kept: Kept,
    dropped: AtomicU64,
}

#[derive(Clone, Debug, PartialEq)]
enum Kept {
    Paths {
        sums: FixedImage,
        /// Of what each path gives a pixel, all its splats together.
        squares: FixedImage,
        /// N.
        paths: u64,
    },
    Batches {
        images: Vec<FixedImage>,
        /// For each batch, how many mutations its image is of.
        mutations: Vec<u64>,
        normalization: Normalization,
    },
}

/// What the sums of Markov chains are scaled by: the integral of their target density.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Normalization {
    /// The estimate of b; zero as long as it is not known, or where there is no light.
    pub value: f64,
    /// Its standard error.
    pub standard_error: f64,
}

/// What splats say of a pixel: mean and variance of the mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SplatEstimate {
    pub mean: [f64; 3],
    pub variance: [f64; 3],
}

impl SplatSums {
    /// No splats yet; `None` where none are kept.
    pub(super) fn new(contents: SplatContents, bounds: PixelBounds) -> Option<Self> {
        let kept = match contents {
            SplatContents::None => return None,
            SplatContents::Paths => {
                Kept::Paths { sums: FixedImage::new(bounds), squares: FixedImage::new(bounds), paths: 0 }
            }
            SplatContents::Batches(batches) => Kept::Batches {
                images: (0..batches).map(|_| FixedImage::new(bounds)).collect(),
                mutations: vec![0; batches as usize],
                normalization: Normalization::default(),
            },
        };
        Some(Self { kept, dropped: AtomicU64::new(0) })
    }

    /// Can the sums hold this? Not if it is infinite, or NaN, or as good as infinite. (Components may be negative: colours of few
    /// wavelengths lie outside of the film's gamut.)
    #[inline]
    pub fn can_hold(rgb: [f64; 3]) -> bool {
        rgb.iter().all(|v| v.abs() <= GREATEST)
    }

    /// Counts a splat that could not be held.
    pub fn drop_one(&self) {
        self.dropped.fetch_add(1, Ordering::Relaxed);
    }

    /// How many splats were dropped.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    /// Adds all that one path gives to a pixel: its square is that of the sum.
    #[inline]
    pub fn add_path(&self, pixel: usize, rgb: [f64; 3]) {
        if let Kept::Paths { sums, squares, .. } = &self.kept {
            sums.add(pixel, rgb);
            squares.add(pixel, rgb.map(|v| v * v / SQUARE_UNIT));
        }
    }

    /// Adds a splat of a chain of a batch.
    #[inline]
    pub fn add_to_batch(&self, batch: usize, pixel: usize, rgb: [f64; 3]) {
        if let Kept::Batches { images, .. } = &self.kept
            && let Some(image) = images.get(batch)
        {
            image.add(pixel, rgb);
        }
    }

    /// Says that so many more paths have been traced.
    pub fn count_paths(&mut self, more: u64) {
        if let Kept::Paths { paths, .. } = &mut self.kept {
            *paths = paths.saturating_add(more);
        }
    }

    /// Says that so many more mutations have been made in a batch.
    pub fn count_mutations(&mut self, batch: usize, more: u64) {
        if let Kept::Batches { mutations, .. } = &mut self.kept
            && let Some(count) = mutations.get_mut(batch)
        {
            *count = count.saturating_add(more);
        }
    }

    /// Says what the chains' target density integrates to.
    pub fn set_normalization(&mut self, value: Normalization) {
        if let Kept::Batches { normalization, .. } = &mut self.kept {
            *normalization = value;
        }
    }

    /// What the chains' target density integrates to; `None` without chains.
    pub fn normalization(&self) -> Option<Normalization> {
        match &self.kept {
            Kept::Paths { .. } => None,
            Kept::Batches { normalization, .. } => Some(*normalization),
        }
    }

    /// All mutations, of all batches; 0 without chains.
    pub fn mutations(&self) -> u64 {
        match &self.kept {
            Kept::Paths { .. } => 0,
            Kept::Batches { mutations, .. } => mutations.iter().sum(),
        }
    }

    /// What is known of a pixel.
    ///
    /// Of N paths with contributions Xᵢ: mean ΣXᵢ/N, variance of the mean (ΣXᵢ²/N − mean²)/(N − 1). Of K batches of mₖ mutations with
    /// sums Sₖ, and M = Σmₖ: mean I = b ΣSₖ/M; with the batch means Iₖ = b Sₖ/mₖ, independent of each other, the variance
    /// of the mean is K/(K−1) Σ (mₖ/M)² (Iₖ − I)², and I² (σ_b/b)² more for b itself.
    pub(super) fn estimate(&self, pixel: usize) -> SplatEstimate {
        const UNKNOWN: SplatEstimate = SplatEstimate { mean: [0.0; 3], variance: [f64::INFINITY; 3] };
        match &self.kept {
            Kept::Paths { paths: 0, .. } => UNKNOWN,
            Kept::Paths { sums, squares, paths } => {
                let n = *paths as f64;
                let mean = sums.sum(pixel).map(|s| s / n);
                let squared = squares.sum(pixel).map(|s| s * SQUARE_UNIT / n);
                let spread = |c: usize| (squared[c] - mean[c] * mean[c]).max(0.0);
                let variance =
                    if *paths > 1 { std::array::from_fn(|c| spread(c) / (n - 1.0)) } else { UNKNOWN.variance };
                SplatEstimate { mean, variance }
            }
            Kept::Batches { images, mutations, normalization } => {
                let total: u64 = mutations.iter().sum();
                if total == 0 {
                    return UNKNOWN;
                }
                let (b, total) = (normalization.value, total as f64);
                let sums: Vec<[f64; 3]> = images.iter().map(|image| image.sum(pixel)).collect();
                let mean = std::array::from_fn(|c| b * sums.iter().map(|s| s[c]).sum::<f64>() / total);
                let batches = mutations.iter().filter(|&&m| m > 0).count() as f64;
                let relative = if b > 0.0 { normalization.standard_error / b } else { 0.0 };
                let variance = std::array::from_fn(|c| {
                    let deviations = sums.iter().zip(mutations).map(|(sum, &m)| {
                        // (mₖ/M)(Iₖ − I).
                        let deviation = (b * sum[c] - m as f64 * mean[c]) / total;
                        deviation * deviation
                    });
                    deviations.sum::<f64>() * batches / (batches - 1.0) + (mean[c] * relative).powi(2)
                });
                // One batch says nothing of its spread: 0 · ∞.
                let variance = if batches > 1.0 { variance } else { UNKNOWN.variance };
                SplatEstimate { mean, variance }
            }
        }
    }

    /// As bytes: counts, normalisation, and the images, each behind its length, of which those without light have none.
    pub(crate) fn write(&self, out: &mut Vec<u8>) {
        let mut number = |value: u64| out.extend_from_slice(&value.to_le_bytes());
        number(self.dropped());
        let images: Vec<&FixedImage> = match &self.kept {
            Kept::Paths { sums, squares, paths } => {
                number(*paths);
                vec![sums, squares]
            }
            Kept::Batches { images, mutations, normalization } => {
                number(normalization.value.to_bits());
                number(normalization.standard_error.to_bits());
                mutations.iter().for_each(|&m| number(m));
                images.iter().collect()
            }
        };
        for image in images {
            let start = out.len();
            out.extend_from_slice(&0u64.to_le_bytes());
            if !image.is_zero() {
                image.write(out);
                let length = (out.len() - start - 8) as u64;
                out[start..start + 8].copy_from_slice(&length.to_le_bytes());
            }
        }
    }

    /// Reads what [`write`](Self::write) wrote of such a film; `None` if the bytes are of none.
    pub(crate) fn read<'b>(&self, mut bytes: &'b [u8]) -> Option<WrittenSplats<'b>> {
        let dropped = read_number(&mut bytes)?;
        let normalization = match self.kept {
            Kept::Paths { .. } => Normalization::default(),
            Kept::Batches { .. } => Normalization {
                value: f64::from_bits(read_number(&mut bytes)?),
                standard_error: f64::from_bits(read_number(&mut bytes)?),
            },
        };
        let (counts, images): (&[u64], Vec<&FixedImage>) = match &self.kept {
            Kept::Paths { paths, sums, squares } => (std::slice::from_ref(paths), vec![sums, squares]),
            Kept::Batches { mutations, images, .. } => (mutations, images.iter().collect()),
        };
        let mut new_counts = Vec::with_capacity(counts.len());
        for count in counts {
            new_counts.push(count.checked_add(read_number(&mut bytes)?)?);
        }
        let mut image_bytes = Vec::with_capacity(images.len());
        for image in images {
            let length = usize::try_from(read_number(&mut bytes)?).ok()?;
            let (of_image, rest) = bytes.split_at_checked(length)?;
            bytes = rest;
            (length == 0 || length == image.byte_length()).then_some(())?;
            image_bytes.push(of_image);
        }
        bytes.is_empty().then_some(WrittenSplats { dropped, normalization, counts: new_counts, images: image_bytes })
    }

    /// Adds what was [`read`](Self::read) for these sums. The normalisation, if it is known there, is taken over.
    pub(crate) fn add_written(&mut self, written: &WrittenSplats<'_>) {
        let add = |image: &FixedImage, bytes: &[u8]| {
            if !bytes.is_empty() {
                // Its length has been checked.
                let _ = image.add_written(bytes);
            }
        };
        match &mut self.kept {
            Kept::Paths { sums, squares, paths } => {
                *paths = written.counts.first().copied().unwrap_or(*paths);
                [sums, squares].into_iter().zip(&written.images).for_each(|(image, bytes)| add(image, bytes));
            }
            Kept::Batches { images, mutations, normalization } => {
                // Parts whose chains are still being prepared know none.
                if written.normalization.value > 0.0 {
                    *normalization = written.normalization;
                }
                mutations.iter_mut().zip(&written.counts).for_each(|(count, written)| *count = *written);
                images.iter().zip(&written.images).for_each(|(image, bytes)| add(image, bytes));
            }
        }
        self.dropped.fetch_add(written.dropped, Ordering::Relaxed);
    }
}

/// Splats as they were written, not yet added.
pub(crate) struct WrittenSplats<'a> {
    dropped: u64,
    normalization: Normalization,
    /// Paths, or mutations of each batch: the sums of those written and those there.
    counts: Vec<u64>,
    images: Vec<&'a [u8]>,
}

fn read_number(bytes: &mut &[u8]) -> Option<u64> {
    let (number, rest) = bytes.split_first_chunk()?;
    *bytes = rest;
    Some(u64::from_le_bytes(*number))
}

impl Clone for SplatSums {
    fn clone(&self) -> Self {
        Self { kept: self.kept.clone(), dropped: AtomicU64::new(self.dropped()) }
    }
}

impl PartialEq for SplatSums {
    fn eq(&self, other: &Self) -> bool {
        self.kept == other.kept && self.dropped() == other.dropped()
    }
}
