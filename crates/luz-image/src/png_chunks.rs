//! The chunks of PNG files that say what the samples mean.
//!
//! Source: W3C, "Portable Network Graphics (PNG) Specification (Third Edition)", sections 5 and 11.

use std::collections::BTreeMap;

use crate::metadata::PngChunk;
use crate::{Chromaticities, Density, Encoding, ImageMetadata, LengthUnit};

/// The length of a PNG file's signature.
const SIGNATURE: usize = 8;
/// The signature and the header chunk, which always comes first.
const AFTER_HEADER: usize = SIGNATURE + 8 + 13 + 4;

/// What the descriptive chunks say.
#[derive(Debug, Default)]
pub(crate) struct Description {
    pub(crate) encoding: Option<Encoding>,
    pub(crate) chromaticities: Option<Chromaticities>,
    pub(crate) text: BTreeMap<String, String>,
    pub(crate) density: Option<Density>,
    /// The chunks that say which colours the samples stand for, but for an ICC profile.
    pub(crate) color: Vec<PngChunk>,
}

/// The chunks of [`Description::color`].
const COLOR: [&[u8; 4]; 6] = [b"gAMA", b"cHRM", b"sRGB", b"cICP", b"mDCV", b"cLLI"];

/// Reads the descriptive chunks of a PNG file; damaged ones are passed over, since the pixels' decoder reports damage.
pub(crate) fn describe(file: &[u8]) -> Description {
    let mut description = Description::default();
    let mut is_srgb = false;
    for (name, data) in chunks(file) {
        if COLOR.contains(&&name) {
            description.color.push((name, data.to_vec()));
        }
        match &name {
            b"pHYs" => description.density = density(data),
            b"sRGB" => {
                is_srgb = true;
                description.encoding = Some(Encoding::Srgb);
            }
            b"gAMA" if !is_srgb => description.encoding = gamma(data),
            b"cHRM" => description.chromaticities = chromaticities(data),
            b"tEXt" => {
                if let Some((keyword, text)) = split_at_zero(data) {
                    description.text.insert(latin1(keyword), latin1(text));
                }
            }
            b"iTXt" => {
                if let Some((keyword, text)) = international_text(data) {
                    description.text.insert(keyword, text);
                }
            }
            _ => {}
        }
    }
    if is_srgb {
        description.chromaticities = None;
    }
    description
}

/// What the samples of a file to be written stand for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Stated {
    /// sRGB's colours.
    Srgb,
    /// What the image's own metadata say of stored samples.
    AsRead,
}

/// Puts chunks into a PNG file, directly after its header, that state what the samples mean and hold the texts. An ICC profile
/// is left to the encoder of the pixels.
pub(crate) fn insert(file: &mut Vec<u8>, metadata: &ImageMetadata, stated: Stated) {
    let mut added = Vec::new();
    if stated == Stated::Srgb {
        push_chunk(&mut added, b"sRGB", &[0]);
    } else if metadata.png_color.is_empty() && metadata.icc_profile.is_none() {
        match metadata.stored_encoding {
            Some(Encoding::Srgb) | None => push_chunk(&mut added, b"sRGB", &[0]),
            Some(Encoding::Linear) => push_chunk(&mut added, b"gAMA", &100_000u32.to_be_bytes()),
            Some(Encoding::Gamma(exponent)) => {
                push_chunk(&mut added, b"gAMA", &((100_000.0 / exponent).round() as u32).to_be_bytes());
            }
        }
    } else {
        metadata.png_color.iter().for_each(|(name, data)| push_chunk(&mut added, name, data));
    }
    if let Some(Density { pixels, per }) = metadata.density.map(|d| d.in_unit(LengthUnit::Metre)) {
        let [x, y] = pixels.map(|p| (p.round() as u32).to_be_bytes());
        push_chunk(&mut added, b"pHYs", &[&x[..], &y, &[u8::from(per.is_some())]].concat());
    }
    for (keyword, value) in &metadata.text {
        // Keywords are Latin-1 of 1 to 79 bytes; texts have no zero.
        let keyword: Vec<u8> =
            keyword.chars().map(|c| u8::try_from(c as u32).unwrap_or(b'?')).filter(|&b| b != 0).take(79).collect();
        if keyword.is_empty() {
            continue;
        }
        let mut data = keyword;
        // Zero, uncompressed, method zero, no language, no translated keyword.
        data.extend_from_slice(&[0, 0, 0, 0, 0]);
        data.extend(value.bytes().filter(|&b| b != 0));
        push_chunk(&mut added, b"iTXt", &data);
    }
    let position = AFTER_HEADER.min(file.len());
    file.splice(position..position, added);
}

/// The chunks of a file as names and data, up to the first that is damaged.
fn chunks(file: &[u8]) -> impl Iterator<Item = ([u8; 4], &[u8])> {
    let mut rest = file.get(SIGNATURE..).unwrap_or(&[]);
    std::iter::from_fn(move || {
        let (length, after) = rest.split_first_chunk::<4>()?;
        let (name, after) = after.split_first_chunk::<4>()?;
        let (data, after) = after.split_at_checked(u32::from_be_bytes(*length) as usize)?;
        rest = after.get(4..)?;
        Some((*name, data))
    })
}

fn push_chunk(file: &mut Vec<u8>, name: &[u8; 4], data: &[u8]) {
    file.extend_from_slice(&(data.len() as u32).to_be_bytes());
    file.extend_from_slice(name);
    file.extend_from_slice(data);
    let crc = crc32(name.iter().chain(data));
    file.extend_from_slice(&crc.to_be_bytes());
}

/// The cyclic redundancy check of ISO 3309, as PNG uses it.
fn crc32<'a>(bytes: impl Iterator<Item = &'a u8>) -> u32 {
    !bytes.fold(!0u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |c, _| if c & 1 == 1 { 0xedb8_8320 ^ (c >> 1) } else { c >> 1 })
    })
}

/// The encoding of a gAMA chunk, which holds the encoding exponent times 100000.
fn gamma(data: &[u8]) -> Option<Encoding> {
    let value = u32::from_be_bytes(data.try_into().ok()?);
    match value {
        0 => None,
        100_000 => Some(Encoding::Linear),
        // What everyone writes for sRGB.
        45_000..=46_000 => Some(Encoding::Srgb),
        _ => Some(Encoding::Gamma(100_000.0 / value as f32)),
    }
}

/// The chromaticities of a cHRM chunk: white, red, green, blue, times 100000.
fn chromaticities(data: &[u8]) -> Option<Chromaticities> {
    let data: &[u8; 32] = data.try_into().ok()?;
    let value = |i: usize| {
        let bytes = [data[4 * i], data[4 * i + 1], data[4 * i + 2], data[4 * i + 3]];
        (f64::from(u32::from_be_bytes(bytes)) / 1e5) as f32
    };
    let pair = |i: usize| [value(2 * i), value(2 * i + 1)];
    Some(Chromaticities { white: pair(0), primaries: [pair(1), pair(2), pair(3)] })
}

/// The density of a pHYs chunk.
fn density(data: &[u8]) -> Option<Density> {
    let &[a, b, c, d, e, f, g, h, unit] = data else { return None };
    let pixels = [[a, b, c, d], [e, f, g, h]].map(|bytes| f64::from(u32::from_be_bytes(bytes)));
    let per = (unit == 1).then_some(LengthUnit::Metre);
    pixels.iter().all(|&p| p > 0.0).then_some(Density { pixels, per })
}

fn split_at_zero(data: &[u8]) -> Option<(&[u8], &[u8])> {
    let zero = data.iter().position(|&b| b == 0)?;
    Some((&data[..zero], &data[zero + 1..]))
}

fn latin1(bytes: &[u8]) -> String {
    bytes.iter().map(|&b| char::from(b)).collect()
}

/// Keyword and text of an iTXt chunk that isn't compressed.
fn international_text(data: &[u8]) -> Option<(String, String)> {
    let (keyword, rest) = split_at_zero(data)?;
    let rest = rest.strip_prefix(&[0, 0])?;
    let (_language, rest) = split_at_zero(rest)?;
    let (_translated, text) = split_at_zero(rest)?;
    Some((latin1(keyword), String::from_utf8_lossy(text).into_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crc_is_the_published_one() {
        assert_eq!(crc32(b"IEND".iter()), 0xae42_6082);
    }

    #[test]
    fn chunks_survive_truncation_at_every_byte() {
        let mut file = vec![0; AFTER_HEADER];
        file[SIGNATURE..SIGNATURE + 8].copy_from_slice(b"\0\0\0\rIHDR");
        let text = BTreeMap::from([("Comment".to_owned(), "a cat — ✓".to_owned())]);
        let metadata = ImageMetadata { text: text.clone(), ..ImageMetadata::default() };
        insert(&mut file, &metadata, Stated::Srgb);
        assert_eq!(describe(&file).text, text);
        assert_eq!(describe(&file).encoding, Some(Encoding::Srgb));
        for length in 0..file.len() {
            describe(&file[..length]);
        }
    }
}
