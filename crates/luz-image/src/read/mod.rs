//! Reading images.

mod exr;
mod pfm;
mod raster;

use std::fs::File;
use std::io::{self, Read};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use crate::{Encoding, Format, Image, ImageError};

/// How files are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReadOptions {
    /// How integers stand for light. `None`: as the file says, sRGB where it says nothing. [`Encoding::Linear`] gives the
    /// stored values, scaled to `[0, 1]`. Opacity is always linear, and float files are not decoded.
    pub encoding: Option<Encoding>,
    /// Images that need more bytes than this in memory (four for every sample) are refused, and so are files
    /// that have more.
    pub max_bytes: u64,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self { encoding: None, max_bytes: 8 << 30 }
    }
}

impl ReadOptions {
    /// Gives the values as files store them, scaled to `[0, 1]` where they are integers.
    pub fn stored() -> Self {
        Self { encoding: Some(Encoding::Linear), ..Self::default() }
    }
}

/// No format of ours packs more samples than this into a byte, so a file that claims to is damaged: deflate packs 1032 bytes
/// into one, and each may hold eight pixels of a palette, which become three samples each.
const MAX_SAMPLES_PER_BYTE: u64 = 1 << 15;
/// Samples that any file may have.
const FREE_SAMPLES: u64 = 1 << 16;

impl Image {
    /// Reads an image file; its format is told from its contents, or else from its extension.
    ///
    /// # Errors
    /// [`ImageError::Open`], [`ImageError::UnknownContents`], [`ImageError::Decode`], [`ImageError::TooLarge`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self, ImageError> {
        Self::read_with(path, &ReadOptions::default())
    }

    /// As [`Image::read`], with options.
    ///
    /// # Errors
    /// As [`Image::read`].
    pub fn read_with(path: impl AsRef<Path>, options: &ReadOptions) -> Result<Self, ImageError> {
        let path = path.as_ref();
        let bytes = read_bounded(path, options.max_bytes)
            .map_err(|source| ImageError::Open { path: path.to_owned(), source })?;
        Self::decode(&bytes, Format::from_path(path), options).map_err(|error| error.with_path(path))
    }

    /// The image in the bytes of a file. `fallback` is the format to try where the contents don't show one.
    ///
    /// # Errors
    /// As [`Image::read`], without a path.
    pub fn decode(bytes: &[u8], fallback: Option<Format>, options: &ReadOptions) -> Result<Self, ImageError> {
        let Some(format) = Format::from_contents(bytes).or(fallback) else {
            return Err(ImageError::UnknownContents { path: None });
        };
        // The decoders of other authors are not proof against every damaged file; a panic in one is an error of the file.
        let result = catch_unwind(AssertUnwindSafe(|| match format {
            Format::Exr => exr::decode(bytes, options),
            Format::Pfm => pfm::decode(bytes, options),
            _ => raster::decode(bytes, format, options),
        }));
        result.unwrap_or_else(|_| Err(damaged(format, "the file is damaged")))
    }
}

/// A file's bytes, unless there are more than `max_bytes`: pipes and devices may never end.
fn read_bounded(path: &Path, max_bytes: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(max_bytes.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > max_bytes {
        let reason = format!("it is larger than the {max_bytes} bytes that are allowed");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, reason));
    }
    Ok(bytes)
}

/// An error about a file whose path the caller adds.
fn damaged(format: Format, reason: impl Into<String>) -> ImageError {
    ImageError::Decode { path: None::<PathBuf>, format, reason: reason.into() }
}

/// What to say where a file ends early.
fn truncated(format: Format) -> ImageError {
    damaged(format, "the file ends early; it may be truncated")
}

/// An error unless an image of this size can plausibly be in a file of `file_bytes`, and memory can hold it. Called before
/// anything of the image's size is allocated.
fn check_size(
    width: u64,
    height: u64,
    channels: u64,
    file_bytes: usize,
    options: &ReadOptions,
) -> Result<(), ImageError> {
    let error = |reason: String| ImageError::TooLarge { path: None, width, height, channels, reason };
    let samples = width.checked_mul(height).and_then(|n| n.checked_mul(channels));
    let bytes = samples.and_then(|n| n.checked_mul(4)).unwrap_or(u64::MAX);
    if samples.is_none_or(|n| n > FREE_SAMPLES + MAX_SAMPLES_PER_BYTE * file_bytes as u64) {
        return Err(error(format!("which a file of {file_bytes} bytes cannot hold; it is damaged")));
    }
    if bytes > options.max_bytes {
        return Err(error(format!("which need {bytes} bytes of memory where {} are allowed", options.max_bytes)));
    }
    Ok(())
}
