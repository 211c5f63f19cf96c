//! PNG, JPEG, TIFF, Radiance HDR, BMP and TGA, through the `image` crate.

use std::io::Cursor;

use ::image::codecs::hdr::HdrEncoder;
use ::image::codecs::jpeg::{JpegEncoder, PixelDensity, PixelDensityUnit};
use ::image::{ExtendedColorType, ImageEncoder, Rgb, codecs};
use luz_color::RgbColorSpace;
use luz_color::encoding::linear_to_srgb;
use rayon::prelude::*;

use super::{BitDepth, WriteOptions, color_channels, unfit};
use crate::png_chunks::{self, Stated};
use crate::tonemap::ToneMap;
use crate::{Density, Encoding, Format, Image, ImageError, LengthUnit};

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
    let keeps_opacity = matches!(format, Format::Png | Format::Tiff);
    let opacity = image.channel("A").filter(|_| keeps_opacity);
    if options.bits == BitDepth::Float && format == Format::Tiff {
        let kind = if opacity.is_some() { ExtendedColorType::Rgba32F } else { ExtendedColorType::Rgb32F };
        let alpha = image.data().iter().skip(opacity.unwrap_or(0)).step_by(image.channel_count());
        let pixels = linear_rgb(image, format)?;
        let bytes: Vec<u8> = pixels
            .iter()
            .zip(alpha)
            .flat_map(|(rgb, alpha)| rgb.iter().chain(opacity.map(|_| alpha)))
            .flat_map(|v| v.to_ne_bytes())
            .collect();
        codecs::tiff::TiffEncoder::new(&mut file).write_image(&bytes, width, height, kind).map_err(failed)?;
        return Ok(file.into_inner());
    }
    let bits = match (options.bits, format) {
        (BitDepth::Float, _) => return Err(unfit(format, "it holds no floats; write OpenEXR, TIFF, PFM or HDR")),
        (BitDepth::Sixteen, Format::Png | Format::Tiff) => BitDepth::Sixteen,
        (BitDepth::Sixteen, _) => return Err(unfit(format, "it holds no 16-bit samples; write PNG or TIFF")),
        (BitDepth::Eight, _) => BitDepth::Eight,
    };
    let mut channels = color_channels(image, format)?.len() + usize::from(opacity.is_some());
    let mut samples = match options.encoding {
        Some(encoding) => encoded_samples(image, format, opacity, encoding)?,
        None => display_samples(image, format, opacity, &options.tone_map)?,
    };
    if format == Format::Tiff && channels == 2 {
        // The encoder knows no grey with opacity.
        samples = samples.chunks_exact(2).flat_map(|p| [p[0], p[0], p[0], p[1]]).collect();
        channels = 4;
    }
    let (bytes, kind) = match bits {
        BitDepth::Sixteen => {
            let bytes = samples.iter().flat_map(|v| ((v * 65535.0).round() as u16).to_ne_bytes()).collect();
            (
                bytes,
                [ExtendedColorType::L16, ExtendedColorType::La16, ExtendedColorType::Rgb16, ExtendedColorType::Rgba16],
            )
        }
        _ => {
            let bytes: Vec<u8> = samples.iter().map(|v| (v * 255.0).round() as u8).collect();
            (bytes, [ExtendedColorType::L8, ExtendedColorType::La8, ExtendedColorType::Rgb8, ExtendedColorType::Rgba8])
        }
    };
    let kind = kind[channels - 1];
    let metadata = &image.metadata;
    // A profile describes the samples that were read, not those that a tone map has made.
    let icc_profile = metadata.icc_profile.as_ref().filter(|_| options.encoding.is_some());
    // What an encoder can't hold, it says by an error that loses nothing else.
    match format {
        Format::Png => {
            let mut encoder = codecs::png::PngEncoder::new(&mut file);
            let _ = icc_profile.map(|icc| encoder.set_icc_profile(icc.clone()));
            let _ = metadata.exif.as_ref().map(|exif| encoder.set_exif_metadata(exif.clone()));
            encoder.write_image(&bytes, width, height, kind)
        }
        Format::Tiff => {
            let mut encoder = codecs::tiff::TiffEncoder::new(&mut file);
            let _ = icc_profile.map(|icc| encoder.set_icc_profile(icc.clone()));
            encoder.write_image(&bytes, width, height, kind)
        }
        Format::Bmp => codecs::bmp::BmpEncoder::new(&mut file).write_image(&bytes, width, height, kind),
        Format::Tga => codecs::tga::TgaEncoder::new(&mut file).write_image(&bytes, width, height, kind),
        _ => {
            let mut encoder = JpegEncoder::new_with_quality(&mut file, options.quality.clamp(1, 100));
            let _ = icc_profile.map(|icc| encoder.set_icc_profile(icc.clone()));
            let _ = metadata.exif.as_ref().map(|exif| encoder.set_exif_metadata(exif.clone()));
            if let Some(density) = metadata.density {
                encoder.set_pixel_density(jpeg_density(density));
            }
            encoder.write_image(&bytes, width, height, kind)
        }
    }
    .map_err(failed)?;
    let mut file = file.into_inner();
    if format == Format::Png {
        let stated = if options.encoding.is_some() { Stated::AsRead } else { Stated::Srgb };
        png_chunks::insert(&mut file, metadata, stated);
    }
    Ok(file)
}

fn jpeg_density(density: Density) -> PixelDensity {
    let density = match density.per {
        Some(LengthUnit::Metre) => density.in_unit(LengthUnit::Inch),
        _ => density,
    };
    let unit = match density.per {
        Some(LengthUnit::Centimetre) => PixelDensityUnit::Centimeters,
        Some(_) => PixelDensityUnit::Inches,
        None => PixelDensityUnit::PixelAspectRatio,
    };
    let [x, y] = density.pixels.map(|p| p.round().clamp(1.0, 65535.0) as u16);
    PixelDensity { density: (x, y), unit }
}

/// The colour of all pixels as three components, in the image's own colour space.
fn linear_rgb(image: &Image, format: Format) -> Result<Vec<[f32; 3]>, ImageError> {
    let channels = color_channels(image, format)?;
    let pick = [channels[0], channels[channels.len() / 2], channels[channels.len() - 1]];
    Ok(image.data().chunks_exact(image.channel_count()).map(|pixel| pick.map(|c| pixel[c])).collect())
}

/// Samples in an encoding, in `[0, 1]`: one or three of colour, and opacity where it is wanted. NaN becomes zero.
fn encoded_samples(
    image: &Image,
    format: Format,
    opacity: Option<usize>,
    encoding: Encoding,
) -> Result<Vec<f32>, ImageError> {
    let colors = color_channels(image, format)?;
    let n = colors.len() + usize::from(opacity.is_some());
    let unit = |v: f32| if v > 0.0 { v.min(1.0) } else { 0.0 };
    let mut samples = vec![0.0; image.width() * image.height() * n];
    let pixels = image.data().par_chunks_exact(image.channel_count());
    samples.par_chunks_exact_mut(n).zip(pixels).for_each(|(out, pixel)| {
        for (out, &c) in out.iter_mut().zip(&colors) {
            *out = unit(encoding.from_linear(pixel[c]));
        }
        if let Some(a) = opacity {
            out[colors.len()] = unit(pixel[a]);
        }
    });
    Ok(samples)
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
