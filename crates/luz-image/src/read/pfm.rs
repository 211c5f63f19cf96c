//! Portable Float Maps: a text header, then rows of floats from the bottom to the top.

use super::{ReadOptions, check_size, damaged, truncated};
use crate::{Encoding, Format, Image, ImageError, SampleType};

pub(super) fn decode(bytes: &[u8], options: &ReadOptions) -> Result<Image, ImageError> {
    let mut rest = bytes;
    let channels: &[&str] = match token(&mut rest) {
        Some(b"PF") => &["R", "G", "B"],
        Some(b"Pf") => &["Y"],
        _ => return Err(damaged(Format::Pfm, "it doesn't begin with PF or Pf")),
    };
    let width = dimension(&mut rest, "width")?;
    let height = dimension(&mut rest, "height")?;
    let scale: f32 = number(&mut rest).ok_or_else(|| damaged(Format::Pfm, "its scale is missing or no number"))?;
    if !scale.is_finite() || scale == 0.0 {
        return Err(damaged(Format::Pfm, format!("its scale is {scale}, which must be finite and not zero")));
    }
    check_size(width as u64, height as u64, channels.len() as u64, bytes.len(), options)?;
    // One sample has four bytes, so this is stricter than the check above and can't overflow after it.
    let row = width * channels.len();
    let Some(samples) = rest.get(..row * height * 4) else { return Err(truncated(Format::Pfm)) };
    let (is_little, factor) = (scale < 0.0, scale.abs());
    let mut data = Vec::with_capacity(row * height);
    for line in samples.chunks_exact(row * 4).rev() {
        data.extend(line.chunks_exact(4).map(|b| {
            let b = [b[0], b[1], b[2], b[3]];
            factor * if is_little { f32::from_le_bytes(b) } else { f32::from_be_bytes(b) }
        }));
    }
    let mut image = Image::from_data(width, height, channels.iter().copied(), data)?;
    image.metadata.sample_type = Some(SampleType::Float(32));
    image.metadata.encoding = Some(Encoding::Linear);
    Ok(image)
}

/// The next word, and the one white space behind it, taken off the front.
fn token<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let bytes: &'a [u8] = rest;
    let start = bytes.iter().position(|b| !b.is_ascii_whitespace())?;
    let length = bytes[start..].iter().take(64).position(u8::is_ascii_whitespace)?;
    *rest = &bytes[start + length + 1..];
    Some(&bytes[start..start + length])
}

fn number<T: std::str::FromStr>(rest: &mut &[u8]) -> Option<T> {
    std::str::from_utf8(token(rest)?).ok()?.parse().ok()
}

fn dimension(rest: &mut &[u8], what: &str) -> Result<usize, ImageError> {
    match number::<u32>(rest) {
        Some(0) => Err(damaged(Format::Pfm, format!("its {what} is zero"))),
        Some(value) => Ok(value as usize),
        None => Err(damaged(Format::Pfm, format!("its {what} is missing or no number"))),
    }
}
