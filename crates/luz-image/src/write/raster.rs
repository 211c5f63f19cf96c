//! PNG, JPEG, TIFF, Radiance HDR, BMP and TGA, through the `image` crate.

use std::io::Cursor;

use ::image::codecs::hdr::HdrEncoder;
use ::image::codecs::jpeg::JpegEncoder;
use ::image::{ExtendedColorType, ImageEncoder, Rgb, codecs};
use luz_color::RgbColorSpace;
use luz_color::encoding::linear_to_srgb;
use rayon::prelude::*;

use super::{BitDepth, WriteOptions, color_channels, unfit};
use crate::tonemap::ToneMap;
use crate::{Format, Image, ImageError, png_chunks};

pub(super) fn encode(image: &Image, format: Format, options: &WriteOptions) -> Result<Vec<u8>, ImageError> {
    let (Ok(width), Ok(height)) = (u32::try_from(image.width()), u32::try_from(image.height())) else {
        return Err(unfit(format, "it has too many pixels"));
    };
    let failed = |error: ::image::ImageError| unfit(format, error.to_string());
    let mut file = Cursor::new(Vec::new());
    if format == Format::Hdr {
        let pixels: Vec<Rgb<f32>> = linear_rgb(image, format)?.into_iter().map(Rgb).collect();
        HdrEncoder::new(&mut file).encode(&pixels, image.width(), image.height()).map_err(failed)?;
        return Ok(file.into_inner());
    }
    if options.bits == BitDepth::Float && format == Format::Tiff {
        let pixels = linear_rgb(image, format)?;
        let bytes: Vec<u8> = pixels.iter().flatten().flat_map(|v| v.to_ne_bytes()).collect();
        codecs::tiff::TiffEncoder::new(&mut file)
            .write_image(&bytes, width, height, ExtendedColorType::Rgb32F)
            .map_err(failed)?;
        return Ok(file.into_inner());
    }
    let bits = match (options.bits, format) {
        (BitDepth::Float, _) => return Err(unfit(format, "it holds no floats; write OpenEXR, TIFF, PFM or HDR")),
        (BitDepth::Sixteen, Format::Png | Format::Tiff) => BitDepth::Sixteen,
        (BitDepth::Sixteen, _) => return Err(unfit(format, "it holds no 16-bit samples; write PNG or TIFF")),
        (BitDepth::Eight, _) => BitDepth::Eight,
    };
    let keeps_opacity = matches!(format, Format::Png | Format::Tiff);
    let opacity = image.channel("A").filter(|_| keeps_opacity);
    let channels = color_channels(image, format)?.len() + usize::from(opacity.is_some());
    let display = display_samples(image, format, opacity, &options.tone_map)?;
    let (bytes, kind) = match bits {
        BitDepth::Sixteen => {
            let bytes = display.iter().flat_map(|v| ((v * 65535.0).round() as u16).to_ne_bytes()).collect();
            (
                bytes,
                [ExtendedColorType::L16, ExtendedColorType::La16, ExtendedColorType::Rgb16, ExtendedColorType::Rgba16],
            )
        }
        _ => {
            let bytes: Vec<u8> = display.iter().map(|v| (v * 255.0).round() as u8).collect();
            (bytes, [ExtendedColorType::L8, ExtendedColorType::La8, ExtendedColorType::Rgb8, ExtendedColorType::Rgba8])
        }
    };
    let kind = kind[channels - 1];
    match format {
        Format::Png => codecs::png::PngEncoder::new(&mut file).write_image(&bytes, width, height, kind),
        Format::Tiff => codecs::tiff::TiffEncoder::new(&mut file).write_image(&bytes, width, height, kind),
        Format::Bmp => codecs::bmp::BmpEncoder::new(&mut file).write_image(&bytes, width, height, kind),
        Format::Tga => codecs::tga::TgaEncoder::new(&mut file).write_image(&bytes, width, height, kind),
        _ => JpegEncoder::new_with_quality(&mut file, options.quality.clamp(1, 100))
            .write_image(&bytes, width, height, kind),
    }
    .map_err(failed)?;
    let mut file = file.into_inner();
    if format == Format::Png {
        png_chunks::insert(&mut file, &image.metadata.text);
    }
    Ok(file)
}

/// The colour of all pixels as three components, in the image's own colour space.
fn linear_rgb(image: &Image, format: Format) -> Result<Vec<[f32; 3]>, ImageError> {
    let channels = color_channels(image, format)?;
    let pick = [channels[0], channels[channels.len() / 2], channels[channels.len() - 1]];
    Ok(image.data().chunks_exact(image.channel_count()).map(|pixel| pick.map(|c| pixel[c])).collect())
}

/// Tone-mapped samples in sRGB, encoded, in `[0, 1]`: one or three of colour, and opacity where it is wanted.
fn display_samples(
    image: &Image,
    format: Format,
    opacity: Option<usize>,
    tone_map: &ToneMap,
) -> Result<Vec<f32>, ImageError> {
    let colors = color_channels(image, format)?.len();
    let rgb = linear_rgb(image, format)?;
    let to_srgb = image
        .metadata
        .chromaticities
        .and_then(|c| c.color_space())
        .filter(|_| colors == 3)
        .map(|space| space.conversion_to(RgbColorSpace::srgb()).to_cols_array_2d());
    let n = colors + usize::from(opacity.is_some());
    let channels = image.channel_count();
    let mut display = vec![0.0; rgb.len() * n];
    display.par_chunks_exact_mut(n).zip(rgb.par_iter()).enumerate().for_each(|(i, (out, &rgb))| {
        let rgb = match to_srgb {
            Some(m) => std::array::from_fn(|row| (0..3).map(|column| m[column][row] * rgb[column]).sum()),
            None => rgb,
        };
        let mapped = tone_map.apply(rgb);
        for (out, v) in out.iter_mut().zip(mapped).take(colors) {
            *out = linear_to_srgb(v).clamp(0.0, 1.0);
        }
        if let Some(a) = opacity {
            let a = image.data()[i * channels + a];
            out[colors] = if a > 0.0 { a.min(1.0) } else { 0.0 };
        }
    });
    Ok(display)
}
