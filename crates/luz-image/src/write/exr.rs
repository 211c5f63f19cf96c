//! OpenEXR, through the `exr` crate.

use std::io::Cursor;

use ::exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image as ExrImage, Layer};
use ::exr::math::Vec2;
use ::exr::meta::attribute::{AttributeValue, Chromaticities, IntegerBounds, LineOrder, Text};
use ::exr::meta::header::{ImageAttributes, LayerAttributes};
use ::exr::prelude::WritableImage;
use half::f16;

use super::{ExrPrecision, unfit};
use crate::{Format, Image, ImageError, SampleType};

pub(super) fn encode(image: &Image, precision: ExrPrecision) -> Result<Vec<u8>, ImageError> {
    let n = image.channel_count();
    let channels = image
        .channels()
        .iter()
        .enumerate()
        .map(|(c, name)| {
            let name = Text::new_or_none(name)
                .ok_or_else(|| unfit(Format::Exr, format!("the channel `{name}` has a name that isn't Latin-1")))?;
            let samples = image.data().iter().skip(c).step_by(n).copied();
            let samples = match sample_type(image, c, precision) {
                SampleType::Float(16) => FlatSamples::F16(samples.map(f16::from_f32).collect()),
                SampleType::Unsigned(_) => FlatSamples::U32(samples.map(|v| v.round() as u32).collect()),
                _ => FlatSamples::F32(samples.collect()),
            };
            Ok(AnyChannel::new(name, samples))
        })
        .collect::<Result<_, ImageError>>()?;

    let metadata = &image.metadata;
    let (width, height) = (image.width(), image.height());
    let mut layer_attributes =
        metadata.exr.as_ref().map_or_else(LayerAttributes::default, |kept| (*kept.layer).clone());
    layer_attributes.layer_position = Vec2(0, 0);
    // The texts are the image's own, which may have changed.
    layer_attributes.comments = None;
    layer_attributes.owner = None;
    layer_attributes.software_name = None;
    layer_attributes.capture_date = None;
    layer_attributes.other.retain(|_, value| !matches!(value, AttributeValue::Text(_)));
    let mut display = IntegerBounds::from_dimensions(Vec2(width, height));
    if let Some(place) = metadata.placement {
        layer_attributes.layer_position = Vec2(place.x, place.y);
        display = IntegerBounds::from_dimensions(Vec2(place.full_width.max(1), place.full_height.max(1)));
    }
    for (keyword, value) in &metadata.text {
        let value = latin1(value);
        match keyword.as_str() {
            "comments" => layer_attributes.comments = Some(value),
            "owner" => layer_attributes.owner = Some(value),
            "software" => layer_attributes.software_name = Some(value),
            "capDate" => layer_attributes.capture_date = Some(value),
            "" => {}
            _ => {
                layer_attributes.other.insert(latin1(keyword), AttributeValue::Text(value));
            }
        }
    }
    let mut attributes = ImageAttributes::new(display);
    if let Some(kept) = &metadata.exr {
        attributes = ImageAttributes { display_window: display, ..(*kept.image).clone() };
        attributes.other.retain(|_, value| !matches!(value, AttributeValue::Text(_)));
    }
    attributes.chromaticities = metadata.chromaticities.map(|c| {
        let [red, green, blue] = c.primaries.map(|[x, y]| Vec2(x, y));
        Chromaticities { red, green, blue, white: Vec2(c.white[0], c.white[1]) }
    });
    // Blocks in order: the same image gives the same bytes for any number of threads.
    let encoding = Encoding { line_order: LineOrder::Increasing, ..Encoding::SMALL_LOSSLESS };
    let layer = Layer::new((width, height), layer_attributes, encoding, AnyChannels::sort(channels));
    let mut file = Cursor::new(Vec::new());
    ExrImage::empty(attributes)
        .with_layer(layer)
        .write()
        .to_buffered(&mut file)
        .map_err(|error| unfit(Format::Exr, error.to_string()))?;
    let mut file = file.into_inner();
    sort_attributes(&mut file);
    Ok(file)
}

/// How a channel is to be stored.
fn sample_type(image: &Image, channel: usize, precision: ExrPrecision) -> SampleType {
    let kept = |name: &String| image.metadata.exr.as_ref().and_then(|kept| kept.sample_type(name));
    match precision {
        ExrPrecision::Half => SampleType::Float(16),
        ExrPrecision::Float => SampleType::Float(32),
        ExrPrecision::AsRead => {
            let mut samples = image.data().iter().skip(channel).step_by(image.channel_count());
            match image.channels().get(channel).and_then(kept) {
                // What would become infinite is kept as it is.
                Some(SampleType::Float(16)) if samples.all(|v| !v.is_finite() || v.abs() <= f16::MAX.to_f32()) => {
                    SampleType::Float(16)
                }
                Some(SampleType::Unsigned(bits)) => SampleType::Unsigned(bits),
                _ => SampleType::Float(32),
            }
        }
    }
}

/// Sorts the attributes of a file of one part by their names: those without a field of their own are written in an order that
/// changes from run to run, but equal images should be equal files. Nothing behind the header moves.
fn sort_attributes(file: &mut [u8]) {
    const MAGIC_AND_VERSION: usize = 8;
    let mut attributes: Vec<(&[u8], &[u8])> = Vec::new();
    let mut end = MAGIC_AND_VERSION;
    // Each is a name, a type, both ended by zero, and a value behind its length; an empty name ends the header.
    loop {
        let Some(rest) = file.get(end..) else { return };
        let text = |from: usize| rest.get(from..)?.iter().position(|&b| b == 0);
        let Some(name) = text(0) else { return };
        if name == 0 {
            break;
        }
        let Some(kind) = text(name + 1) else { return };
        let start = name + kind + 2;
        let Some(&[a, b, c, d]) = rest.get(start..start + 4) else { return };
        let length = start + 4 + u32::from_le_bytes([a, b, c, d]) as usize;
        let Some(whole) = rest.get(..length) else { return };
        attributes.push((&rest[..name], whole));
        end += length;
    }
    attributes.sort_by_key(|(name, _)| *name);
    let sorted: Vec<u8> = attributes.iter().flat_map(|(_, whole)| whole.iter().copied()).collect();
    file[MAGIC_AND_VERSION..end].copy_from_slice(&sorted);
}

/// A text of the format, with question marks for characters that it can't hold.
fn latin1(text: &str) -> Text {
    let bytes: Vec<u8> = text.chars().map(|c| u8::try_from(c as u32).unwrap_or(b'?')).collect();
    Text::from_slice_unchecked(&bytes)
}
