//! Portable Float Maps, little-endian.

use super::color_channels;
use crate::{Format, Image, ImageError};

pub(super) fn encode(image: &Image) -> Result<Vec<u8>, ImageError> {
    let channels = color_channels(image, Format::Pfm)?;
    let kind = if channels.len() == 3 { "PF" } else { "Pf" };
    let mut file = format!("{kind}\n{} {}\n-1.0\n", image.width(), image.height()).into_bytes();
    let n = image.channel_count();
    for row in image.data().chunks_exact(image.width() * n).rev() {
        for pixel in row.chunks_exact(n) {
            for &c in &channels {
                file.extend_from_slice(&pixel[c].to_le_bytes());
            }
        }
    }
    Ok(file)
}
