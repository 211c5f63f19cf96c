//! What an image knows about itself beside its pixels.

use std::collections::BTreeMap;

use luz_color::RgbColorSpace;

use crate::Encoding;

/// What an image knows about itself beside its pixels. Writing keeps what the format can hold.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImageMetadata {
    /// The colour space of the channels R, G and B; none means that nothing is known and sRGB's primaries are assumed.
    pub chromaticities: Option<Chromaticities>,
    /// How the file that the image came from stored a sample.
    pub sample_type: Option<SampleType>,
    /// The encoding that was undone when the image was read; linear for float files.
    pub encoding: Option<Encoding>,
    /// Where the pixels lie in a larger picture; none where they are all of it.
    pub placement: Option<Placement>,
    /// Free text by keyword: `comments`, `software` and so on.
    pub text: BTreeMap<String, String>,
    /// Layers of a multi-part file that were left out because their size differs from the largest layer's.
    pub skipped_layers: Vec<String>,
}

/// How a file stores a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleType {
    /// Unsigned integers of this many bits.
    Unsigned(u8),
    /// Floating-point numbers of this many bits.
    Float(u8),
    /// Eight bits with a common exponent (RGBE).
    SharedExponent,
}

/// CIE 1931 chromaticities (x, y) of the primaries and white of an RGB colour space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chromaticities {
    /// Red, green and blue.
    pub primaries: [[f32; 2]; 3],
    /// White.
    pub white: [f32; 2],
}

impl Chromaticities {
    /// The chromaticities of a colour space.
    pub fn of(space: &RgbColorSpace) -> Self {
        Self { primaries: space.primaries(), white: space.white() }
    }

    /// The colour space that has these chromaticities, if it is a known one.
    pub fn color_space(&self) -> Option<&'static RgbColorSpace> {
        RgbColorSpace::from_chromaticities(self.primaries, self.white)
    }
}

/// Where an image's pixels lie in the larger picture of which they are a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Placement {
    /// The column of the image's left pixels in the whole picture.
    pub x: i32,
    /// The row of the image's top pixels in the whole picture.
    pub y: i32,
    /// The width of the whole picture in pixels.
    pub full_width: usize,
    /// The height of the whole picture in pixels.
    pub full_height: usize,
}
