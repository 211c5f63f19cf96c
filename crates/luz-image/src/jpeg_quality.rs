//! What the segments of a JPEG file say beside its pixels.
//!
//! Source: ITU-T T.81 (1992), annexes B and K; T.871 (2011) for JFIF.

use crate::{Density, LengthUnit};

/// The luminance quantisation of T.81, table K.1, row by row, which writers scale by their quality.
const LUMINANCE: [u32; 64] = [
    16, 11, 10, 16, 24, 40, 51, 61, //
    12, 12, 14, 19, 26, 58, 60, 55, //
    14, 13, 16, 24, 40, 57, 69, 56, //
    14, 17, 22, 29, 51, 87, 80, 62, //
    18, 22, 37, 56, 68, 109, 103, 77, //
    24, 35, 55, 64, 81, 104, 113, 92, //
    49, 64, 78, 87, 103, 121, 120, 101, //
    72, 92, 95, 98, 112, 100, 103, 99,
];

/// The quality on the usual scale from 1 to 100 whose luminance quantisation is as coarse as the file's.
pub(crate) fn quality(file: &[u8]) -> Option<u8> {
    let (_, tables) = segments(file).find(|(marker, _)| *marker == 0xdb)?;
    let (&kind, values) = tables.split_first()?;
    let total: u32 = if kind >> 4 == 0 {
        values.get(..64)?.iter().map(|&v| u32::from(v)).sum()
    } else {
        values.get(..128)?.chunks_exact(2).map(|v| u32::from(u16::from_be_bytes([v[0], v[1]]))).sum()
    };
    // The sum tells the quality whatever the order of the table.
    (1..=100u8).rev().min_by_key(|&quality| total_of(quality).abs_diff(total))
}

/// The sum of the luminance table at a quality.
fn total_of(quality: u8) -> u32 {
    let quality = u32::from(quality);
    let scale = if quality < 50 { 5000 / quality } else { 200 - 2 * quality };
    LUMINANCE.iter().map(|v| ((v * scale + 50) / 100).clamp(1, 255)).sum()
}

/// The density of the JFIF segment.
pub(crate) fn density(file: &[u8]) -> Option<Density> {
    let (_, data) = segments(file).find(|(marker, data)| *marker == 0xe0 && data.starts_with(b"JFIF\0"))?;
    let &[_, _, unit, a, b, c, d, ..] = data.get(5..)? else { return None };
    let pixels = [[a, b], [c, d]].map(|bytes| f64::from(u16::from_be_bytes(bytes)));
    let per = match unit {
        1 => Some(LengthUnit::Inch),
        2 => Some(LengthUnit::Centimetre),
        _ => None,
    };
    pixels.iter().all(|&p| p > 0.0).then_some(Density { pixels, per })
}

/// The segments before the scan, as markers and data, up to the first that is damaged.
fn segments(file: &[u8]) -> impl Iterator<Item = (u8, &[u8])> {
    let mut rest = file.get(2..).unwrap_or(&[]);
    std::iter::from_fn(move || {
        let &[0xff, marker, high, low, ..] = rest else { return None };
        // The start of the scan, and markers without data.
        if marker == 0xda || (0xd0..=0xd9).contains(&marker) {
            return None;
        }
        let length = usize::from(u16::from_be_bytes([high, low]));
        let data = rest.get(4..2 + length)?;
        rest = &rest[2 + length..];
        Some((marker, data))
    })
}

#[cfg(test)]
mod tests {
    use crate::{Format, Image, WriteOptions};

    use super::*;

    #[test]
    fn qualities_are_recognised() {
        let data = (0..64 * 3).map(|i| i as f32 / 192.0).collect();
        let image = Image::from_data(8, 8, ["R", "G", "B"], data).unwrap();
        for written in [1, 10, 35, 50, 75, 90, 95, 100] {
            let options = WriteOptions { quality: written, ..WriteOptions::default() };
            let file = image.encode(Format::Jpeg, &options).unwrap();
            assert_eq!(quality(&file), Some(written));
            for end in 0..file.len() {
                quality(&file[..end]);
                density(&file[..end]);
            }
        }
    }
}
