//! Images of sums in fixed point, to which any thread may add.
//!
//! Integer addition is associative, so that the sums do not depend on the order in which threads come, and putting images
//! together is exact.

use super::bounds::PixelBounds;
use std::sync::atomic::{AtomicU64, Ordering};

/// A sum as a two's complement number of 128 bits, of which 64 stand behind the point: from ±2⁻⁶⁴ to ±2⁶³.
///
/// Two words, each added to atomically; a carry may be on its way between them while others add, which is why a sum is only
/// read when nobody adds.
#[derive(Debug, Default)]
struct Fixed {
    fraction: AtomicU64,
    integer: AtomicU64,
}

const ONE: f64 = 18_446_744_073_709_551_616.0;

impl Fixed {
    /// Adds a number of a magnitude below 2⁶³, rounded down to a multiple of 2⁻⁶⁴.
    #[inline]
    fn add(&self, value: f64) {
        if (0.0..1.0).contains(&value) {
            // The product is exact.
            self.add_words((value * ONE) as u64, 0);
        } else {
            let whole = value.floor();
            // The difference is exact but for numbers just below zero, where it is rounded to one at the worst.
            self.add_words(((value - whole) * ONE) as u64, whole as i64 as u64);
        }
    }

    #[inline]
    fn add_words(&self, fraction: u64, integer: u64) {
        let before = self.fraction.fetch_add(fraction, Ordering::Relaxed);
        let carry = u64::from(before.checked_add(fraction).is_none());
        if integer.wrapping_add(carry) != 0 {
            self.integer.fetch_add(integer.wrapping_add(carry), Ordering::Relaxed);
        }
    }

    fn words(&self) -> [u64; 2] {
        [self.fraction.load(Ordering::Relaxed), self.integer.load(Ordering::Relaxed)]
    }

    fn value(&self) -> f64 {
        let [fraction, integer] = self.words();
        let bits = (u128::from(integer) << 64 | u128::from(fraction)) as i128;
        bits as f64 / ONE
    }
}

impl Clone for Fixed {
    fn clone(&self) -> Self {
        let [fraction, integer] = self.words().map(AtomicU64::new);
        Self { fraction, integer }
    }
}

impl PartialEq for Fixed {
    fn eq(&self, other: &Self) -> bool {
        self.words() == other.words()
    }
}

/// Sums of colours, one for each pixel, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct FixedImage {
    pixels: Vec<[Fixed; 3]>,
}

impl FixedImage {
    /// Bytes of memory, and in files, of one pixel.
    pub const PIXEL_BYTES: usize = size_of::<[Fixed; 3]>();

    /// All sums are zero.
    pub fn new(bounds: PixelBounds) -> Self {
        let mut pixels = Vec::new();
        pixels.resize_with(bounds.area(), Default::default);
        Self { pixels }
    }

    /// Adds a colour, of a magnitude below 2⁶³, to a pixel. A pixel that is not there receives nothing.
    #[inline]
    pub fn add(&self, pixel: usize, rgb: [f64; 3]) {
        if let Some(sums) = self.pixels.get(pixel) {
            sums.iter().zip(rgb).for_each(|(sum, value)| sum.add(value));
        }
    }

    /// A pixel's sums; zero for one that is not there.
    pub fn sum(&self, pixel: usize) -> [f64; 3] {
        self.pixels.get(pixel).map_or([0.0; 3], |sums| std::array::from_fn(|c| sums[c].value()))
    }

    /// Are all sums zero?
    pub fn is_zero(&self) -> bool {
        self.pixels.iter().flatten().all(|sum| sum.words() == [0, 0])
    }

    /// The bytes that [`write`](Self::write) writes.
    pub fn byte_length(&self) -> usize {
        self.pixels.len() * Self::PIXEL_BYTES
    }

    /// Appends all sums: for each pixel and channel the two words, the fraction first, in little-endian numbers.
    pub fn write(&self, out: &mut Vec<u8>) {
        out.reserve(self.byte_length());
        for word in self.pixels.iter().flatten().flat_map(Fixed::words) {
            out.extend_from_slice(&word.to_le_bytes());
        }
    }

    /// Adds what [`write`](Self::write) wrote of an image of the same size; `None`, and nothing is added, if the bytes are too few
    /// or too many.
    pub fn add_written(&self, bytes: &[u8]) -> Option<()> {
        let (words, rest) = bytes.as_chunks::<8>();
        let (pairs, odd) = words.as_chunks::<2>();
        if !rest.is_empty() || !odd.is_empty() || pairs.len() != 3 * self.pixels.len() {
            return None;
        }
        for (sum, [fraction, integer]) in self.pixels.iter().flatten().zip(pairs) {
            sum.add_words(u64::from_le_bytes(*fraction), u64::from_le_bytes(*integer));
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE_PIXEL: PixelBounds = PixelBounds { x0: 0, y0: 0, x1: 1, y1: 1 };

    #[test]
    fn sums_are_exact_where_numbers_are() {
        let sum = Fixed::default();
        for value in [0.5, 0.75, 1e18, -3.25, -0.5, 0.0, -1e18, 7.0] {
            sum.add(value);
        }
        assert_eq!(sum.value(), 0.5 + 0.75 - 3.25 - 0.5 + 7.0);
        let tiny = Fixed::default();
        tiny.add(-1e-30);
        assert!(tiny.value().abs() <= 1.0 / ONE);
    }

    #[test]
    fn order_and_threads_change_nothing() {
        let values: Vec<f64> =
            (0..4000).map(|i| f64::from(i % 97 - 40) * 10f64.powi(i % 23 - 12)).chain([3e17, -3e17]).collect();
        let image = FixedImage::new(ONE_PIXEL);
        values.iter().for_each(|&v| image.add(0, [v; 3]));
        let shared = FixedImage::new(ONE_PIXEL);
        std::thread::scope(|scope| {
            for part in values.chunks(601) {
                let shared = &shared;
                scope.spawn(move || part.iter().rev().for_each(|&v| shared.add(0, [v; 3])));
            }
        });
        assert_eq!(image, shared);
        // In floating point the order does matter: the values are such that the test could fail.
        let (forth, back) = (values.iter().sum::<f64>(), values.iter().rev().sum::<f64>());
        assert_ne!(forth, back);
    }

    #[test]
    fn images_are_written_and_added() {
        let (a, b) = (FixedImage::new(ONE_PIXEL), FixedImage::new(ONE_PIXEL));
        a.add(0, [1.5, -2.0, 3.0]);
        b.add(0, [0.25, 1.0, 1e10]);
        let mut bytes = Vec::new();
        a.write(&mut bytes);
        assert_eq!(bytes.len(), FixedImage::PIXEL_BYTES);
        assert_eq!(b.add_written(&bytes), Some(()));
        assert_eq!(b.sum(0), [1.75, -1.0, 1e10 + 3.0]);
        assert_eq!(b.add_written(&bytes[1..]), None);
        assert!(!b.is_zero() && FixedImage::new(ONE_PIXEL).is_zero());
    }
}
