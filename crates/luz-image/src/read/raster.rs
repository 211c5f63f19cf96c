//! PNG, JPEG, TIFF, Radiance HDR, BMP and TGA, through the `image` crate.

use std::io::{Cursor, ErrorKind};

use ::image::metadata::Orientation;
use ::image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use super::{ReadOptions, check_size, damaged, truncated};
use crate::{Chromaticities, Encoding, Format, Image, ImageError, SampleType};
use crate::{jpeg_quality, png_chunks};

pub(super) fn decode(bytes: &[u8], format: Format, options: &ReadOptions) -> Result<Image, ImageError> {
    let foreign = match format {
        Format::Png => ImageFormat::Png,
        Format::Jpeg => ImageFormat::Jpeg,
        Format::Tiff => ImageFormat::Tiff,
        Format::Hdr => ImageFormat::Hdr,
        Format::Bmp => ImageFormat::Bmp,
        Format::Tga => ImageFormat::Tga,
        Format::Exr | Format::Pfm => return Err(damaged(format, "it has a decoder of its own")),
    };
    let mut limits = Limits::default();
    limits.max_alloc = Some(options.max_bytes);
    let mut reader = ImageReader::with_format(Cursor::new(bytes), foreign);
    reader.limits(limits);
    let mut decoder = reader.into_decoder().map_err(|error| translate(error, format))?;
    let (width, height) = decoder.dimensions();
    let channels = decoder.color_type().channel_count();
    check_size(width.into(), height.into(), channels.into(), bytes.len(), options)?;
    let orientation = decoder.orientation().map_err(|error| translate(error, format))?;
    // A profile that can't be read spoils no pixels.
    let icc_profile = decoder.icc_profile().ok().flatten();
    let mut exif = decoder.exif_metadata().ok().flatten();
    if let Some(exif) = &mut exif {
        // It is about to be applied.
        let _ = Orientation::remove_from_exif_chunk(exif);
    }
    let mut decoded = DynamicImage::from_decoder(decoder).map_err(|error| translate(error, format))?;
    decoded.apply_orientation(orientation);

    let description = if format == Format::Png { png_chunks::describe(bytes) } else { Default::default() };
    let stored_encoding = description.encoding.unwrap_or(Encoding::Srgb);
    let encoding = options.encoding.unwrap_or(stored_encoding);
    let (width, height) = (decoded.width() as usize, decoded.height() as usize);
    let (channels, sample_type, data): (&[&str], _, Vec<f32>) = match decoded {
        DynamicImage::ImageLuma8(i) => (&["Y"], SampleType::Unsigned(8), from_u8(&i, 1, encoding)),
        DynamicImage::ImageLumaA8(i) => (&["Y", "A"], SampleType::Unsigned(8), from_u8(&i, 2, encoding)),
        DynamicImage::ImageRgb8(i) => (&["R", "G", "B"], SampleType::Unsigned(8), from_u8(&i, 3, encoding)),
        DynamicImage::ImageRgba8(i) => (&["R", "G", "B", "A"], SampleType::Unsigned(8), from_u8(&i, 4, encoding)),
        DynamicImage::ImageLuma16(i) => (&["Y"], SampleType::Unsigned(16), from_u16(&i, 1, encoding)),
        DynamicImage::ImageLumaA16(i) => (&["Y", "A"], SampleType::Unsigned(16), from_u16(&i, 2, encoding)),
        DynamicImage::ImageRgb16(i) => (&["R", "G", "B"], SampleType::Unsigned(16), from_u16(&i, 3, encoding)),
        DynamicImage::ImageRgba16(i) => (&["R", "G", "B", "A"], SampleType::Unsigned(16), from_u16(&i, 4, encoding)),
        DynamicImage::ImageRgb32F(i) => (&["R", "G", "B"], float_type(format), i.into_raw()),
        DynamicImage::ImageRgba32F(i) => (&["R", "G", "B", "A"], float_type(format), i.into_raw()),
        _ => return Err(damaged(format, "its kind of samples is not supported")),
    };
    let mut image = Image::from_data(width, height, channels.iter().copied(), data)
        .map_err(|error| damaged(format, error.to_string()))?;
    let is_integer = matches!(sample_type, SampleType::Unsigned(_));
    image.metadata.sample_type = Some(sample_type);
    image.metadata.encoding = Some(if is_integer { encoding } else { Encoding::Linear });
    image.metadata.chromaticities = description.chromaticities.filter(is_plausible);
    image.metadata.stored_encoding = is_integer.then_some(stored_encoding);
    image.metadata.text = description.text;
    image.metadata.png_color = description.color;
    image.metadata.density = description.density;
    image.metadata.icc_profile = icc_profile;
    image.metadata.exif = exif;
    if format == Format::Jpeg {
        image.metadata.density = jpeg_quality::density(bytes);
        image.metadata.jpeg_quality = jpeg_quality::quality(bytes);
    }
    Ok(image)
}

/// False for chromaticities that damaged files have.
fn is_plausible(c: &Chromaticities) -> bool {
    c.white[1] > 0.0 && c.primaries.iter().flatten().chain(&c.white).all(|v| v.is_finite() && v.abs() <= 10.0)
}

fn float_type(format: Format) -> SampleType {
    if format == Format::Hdr { SampleType::SharedExponent } else { SampleType::Float(32) }
}

/// Bytes to linear light; the last of an even number of channels is opacity, which isn't encoded.
fn from_u8(samples: &[u8], channels: usize, encoding: Encoding) -> Vec<f32> {
    let light = encoding.table_8bit();
    let opacity = Encoding::Linear.table_8bit();
    let color = channels - usize::from(channels.is_multiple_of(2));
    samples
        .chunks_exact(channels)
        .flat_map(|pixel| {
            let tables = (0..channels).map(|c| if c < color { &light } else { &opacity });
            pixel.iter().zip(tables).map(|(&v, table)| table[usize::from(v)])
        })
        .collect()
}

/// As [`from_u8`], for 16 bits.
fn from_u16(samples: &[u16], channels: usize, encoding: Encoding) -> Vec<f32> {
    let linear = |v: u16| f32::from(v) / 65535.0;
    let table: Vec<f32> = (0..=u16::MAX).map(|v| encoding.to_linear(linear(v))).collect();
    let color = channels - usize::from(channels.is_multiple_of(2));
    samples
        .chunks_exact(channels)
        .flat_map(|pixel| {
            let table = &table;
            pixel.iter().enumerate().map(move |(c, &v)| if c < color { table[usize::from(v)] } else { linear(v) })
        })
        .collect()
}

/// Our error for one of the `image` crate.
fn translate(error: ::image::ImageError, format: Format) -> ImageError {
    match error {
        ::image::ImageError::IoError(error) if error.kind() == ErrorKind::UnexpectedEof => truncated(format),
        other => {
            // Some decoders wrap the end of the file in their own errors.
            let text = other.to_string();
            let lower = text.to_lowercase();
            if lower.contains("unexpected eof")
                || lower.contains("unexpected end")
                || lower.contains("fill whole buffer")
            {
                return truncated(format);
            }
            damaged(format, text)
        }
    }
}
