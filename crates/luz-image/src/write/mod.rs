//! Writing images.

mod exr;
mod pfm;
mod raster;

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use crate::tonemap::ToneMap;
use crate::{Encoding, Format, Image, ImageError, SampleType};

/// How files are written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WriteOptions {
    /// How light becomes integers, in formats that hold no floats. The result is encoded as sRGB.
    pub tone_map: ToneMap,
    /// Instead of tone mapping, colours are kept as they are and encoded like this, in formats of integers. With
    /// [`ImageMetadata::encoding`](crate::ImageMetadata::encoding), which was undone when the image was read, the stored
    /// integers are written as they were read, and what the file said of them is said again.
    pub encoding: Option<Encoding>,
    /// Bits of a sample in PNG and TIFF files.
    pub bits: BitDepth,
    /// Precision of the samples in OpenEXR files.
    pub exr: ExrPrecision,
    /// Quality of JPEG files, 1 to 100.
    pub quality: u8,
}

impl Default for WriteOptions {
    fn default() -> Self {
        Self {
            tone_map: ToneMap::default(),
            encoding: None,
            bits: BitDepth::Eight,
            exr: ExrPrecision::Float,
            quality: 95,
        }
    }
}

impl WriteOptions {
    /// What writes an image as the file that it came from, as far as the format can: its bit depth, its encoding without
    /// tone mapping, its precision, its JPEG quality. Light that was read as floats is tone mapped as by default where the
    /// format holds integers.
    pub fn as_read(image: &Image, format: Format) -> Self {
        let metadata = &image.metadata;
        let bits = match (metadata.sample_type, format) {
            (Some(SampleType::Unsigned(9..)), Format::Png | Format::Tiff) => BitDepth::Sixteen,
            (Some(SampleType::Float(_) | SampleType::SharedExponent), Format::Tiff) => BitDepth::Float,
            _ => BitDepth::Eight,
        };
        Self {
            encoding: metadata.encoding.filter(|_| matches!(metadata.sample_type, Some(SampleType::Unsigned(..=16)))),
            bits,
            exr: ExrPrecision::AsRead,
            quality: metadata.jpeg_quality.unwrap_or(95),
            ..Self::default()
        }
    }
}

/// Bits of a sample in PNG and TIFF files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum BitDepth {
    /// 8-bit integers.
    #[default]
    Eight,
    /// 16-bit integers.
    Sixteen,
    /// 32-bit floats, linear and not tone mapped; TIFF only.
    Float,
}

/// Precision of the samples in OpenEXR files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum ExrPrecision {
    /// 16-bit floats: 11 significant bits, up to 65504.
    Half,
    /// 32-bit floats.
    #[default]
    Float,
    /// For each channel, that of the file that the image came from; floats where nothing is known, and where a number would
    /// become infinite.
    AsRead,
}

impl Image {
    /// Writes an image file in the format of its extension. The file is complete or not there: a temporary file in the same
    /// folder is renamed when it is done.
    ///
    /// # Errors
    /// [`ImageError::UnknownExtension`], [`ImageError::MissingFolder`], [`ImageError::Encode`], [`ImageError::Write`].
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), ImageError> {
        self.write_with(path, &WriteOptions::default())
    }

    /// As [`Image::write`], with options.
    ///
    /// # Errors
    /// As [`Image::write`].
    pub fn write_with(&self, path: impl AsRef<Path>, options: &WriteOptions) -> Result<(), ImageError> {
        let path = path.as_ref();
        let format = Format::from_path(path).ok_or_else(|| ImageError::UnknownExtension { path: path.to_owned() })?;
        check_folder(path)?;
        write_atomically(path, &self.encode(format, options)?)
    }

    /// The bytes of a file that holds the image.
    ///
    /// OpenEXR keeps all channels. All other formats hold the colour, that is R, G and B or Y; PNG and TIFF also keep A.
    ///
    /// # Errors
    /// [`ImageError::Encode`] when the format can't hold the image.
    pub fn encode(&self, format: Format, options: &WriteOptions) -> Result<Vec<u8>, ImageError> {
        match format {
            Format::Exr => exr::encode(self, options.exr),
            Format::Pfm => pfm::encode(self),
            _ => raster::encode(self, format, options),
        }
    }
}

/// An error if a file can't be written there because its folder doesn't exist: to be known before the work, not after it.
///
/// # Errors
/// [`ImageError::MissingFolder`].
pub fn check_folder(path: &Path) -> Result<(), ImageError> {
    let folder = folder_of(path);
    if folder.is_dir() {
        return Ok(());
    }
    Err(ImageError::MissingFolder { path: path.to_owned(), folder: folder.to_owned() })
}

/// Writes a file so that it is complete or, where that fails, as it was before.
///
/// # Errors
/// [`ImageError::Write`].
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    let write = || -> io::Result<()> {
        // Devices and pipes are written to, not replaced.
        if fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir()) {
            return fs::write(path, bytes);
        }
        let mut builder = tempfile::Builder::new();
        builder.prefix(".luz-").suffix(".part");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // As for any new file; the process's mask applies.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let mut file = builder.tempfile_in(folder_of(path))?;
        file.write_all(bytes)?;
        file.persist(path).map_err(|error| error.error)?;
        Ok(())
    };
    write().map_err(|source| ImageError::Write { path: path.to_owned(), source })
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// An error about what a format can't hold.
fn unfit(format: Format, reason: impl Into<String>) -> ImageError {
    ImageError::Encode { format, reason: reason.into() }
}

/// The positions of the colour's channels: three, or one for grey.
fn color_channels(image: &Image, format: Format) -> Result<Vec<usize>, ImageError> {
    match image.rgb() {
        Some([r, g, b]) if r != g => Ok(vec![r, g, b]),
        Some([y, ..]) => Ok(vec![y]),
        None if image.channel_count() == 1 => Ok(vec![0]),
        None => Err(unfit(
            format,
            format!(
                "it has no channels R, G, B or Y, only {}; write OpenEXR or select channels",
                image.channels().join(", ")
            ),
        )),
    }
}
