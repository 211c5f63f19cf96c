//! What a filter did.

use luz_image::Image;
use serde::Serialize;

use crate::{Method, SimdLevel};

/// A filtered image, and how it came about.
#[derive(Clone, Debug)]
pub struct Filtered {
    /// The image, with the channels and metadata of the one that was filtered.
    pub image: Image,
    /// How it came about.
    pub report: Report,
}

/// How a filtered image came about.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// The method that was used; for [`Method::Auto`], the one that it chose.
    pub method: Method,
    /// The window's width `k` in pixels.
    pub window: usize,
    /// The number of frames in the window; 1 for images.
    pub window_frames: usize,
    /// Neighbours per pixel, with the pixel itself; 0 for [`Method::Cosines`].
    pub samples_per_pixel: f64,
    /// Pixels with a sample that is infinite, NaN or too large, in the image or in a guide. They are left as they are, and
    /// have no part in their neighbours.
    pub excluded_pixels: u64,
    /// For a quality target: the peak signal-to-noise ratio in dB that was measured on some pixels against the exact filter.
    pub measured_quality: Option<f64>,
    /// The most memory used beside image, guides and result, in bytes.
    pub scratch_bytes: usize,
    /// Instructions.
    pub simd: SimdLevel,
    /// How long it took, in seconds.
    pub seconds: f64,
}

/// How far a filter is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Pixels that are done.
    pub done: u64,
    /// All pixels.
    pub total: u64,
}
