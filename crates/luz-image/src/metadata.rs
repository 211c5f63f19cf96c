//! What an image knows about itself beside its pixels.

use std::collections::BTreeMap;

use luz_color::RgbColorSpace;

use crate::{Encoding, ExrAttributes};

/// What an image knows about itself beside its pixels. Writing keeps what the format can hold.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImageMetadata {
    /// The colour space of the channels R, G and B; none means that nothing is known and sRGB's primaries are assumed.
    pub chromaticities: Option<Chromaticities>,
    /// How the file that the image came from stored a sample.
    pub sample_type: Option<SampleType>,
    /// The encoding that was undone when the image was read; linear for float files.
    pub encoding: Option<Encoding>,
    /// The encoding that a file of integers states or implies, whatever the reader was told to undo; none for floats. It is
    /// what a file says that gets the stored samples back as they were.
    pub stored_encoding: Option<Encoding>,
    /// The ICC profile of the stored samples, as in PNG, JPEG and TIFF files. It isn't interpreted, and not written with
    /// colours that tone mapping has changed.
    pub icc_profile: Option<Vec<u8>>,
    /// The Exif block of PNG and JPEG files, from its byte order mark on. The orientation in it has been applied to the
    /// pixels and says "upright".
    pub exif: Option<Vec<u8>>,
    /// How large a pixel is, as in PNG and JPEG files.
    pub density: Option<Density>,
    /// The quality, 1 to 100, of the JPEG file that the image came from, as its quantisation tables show it.
    pub jpeg_quality: Option<u8>,
    /// What else an OpenEXR file says, and how it stores each channel.
    pub exr: Option<ExrAttributes>,
    /// Chunks of a PNG file that say what its samples mean, to be written again with samples that still mean it.
    pub(crate) png_color: Vec<PngChunk>,
    /// Where the pixels lie in a larger picture; none where they are all of it.
    pub placement: Option<Placement>,
    /// Free text by keyword: `comments`, `software` and so on.
    pub text: BTreeMap<String, String>,
    /// Layers of a multi-part file that were left out because their size differs from the largest layer's.
    pub skipped_layers: Vec<String>,
}

/// A chunk of a PNG file: its name and data.
pub(crate) type PngChunk = ([u8; 4], Vec<u8>);

/// How many pixels there are to a length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Density {
    /// Along rows and columns.
    pub pixels: [f64; 2],
    /// To this length; none where only their ratio is known.
    pub per: Option<LengthUnit>,
}

/// A unit of length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LengthUnit {
    /// 25.4 millimetres.
    Inch,
    /// Ten millimetres.
    Centimetre,
    /// A thousand millimetres.
    Metre,
}

impl LengthUnit {
    /// Its length in metres.
    pub const fn metres(self) -> f64 {
        match self {
            Self::Inch => 0.0254,
            Self::Centimetre => 0.01,
            Self::Metre => 1.0,
        }
    }
}

impl Density {
    /// The same density for another unit; ratios stay ratios.
    #[must_use]
    pub fn in_unit(self, unit: LengthUnit) -> Self {
        match self.per {
            Some(per) => {
                let factor = unit.metres() / per.metres();
                Self { pixels: self.pixels.map(|p| p * factor), per: Some(unit) }
            }
            None => self,
        }
    }
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
