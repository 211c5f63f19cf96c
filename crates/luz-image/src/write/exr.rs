//! OpenEXR, through the `exr` crate.

use std::io::Cursor;

use ::exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image as ExrImage, Layer};
use ::exr::math::Vec2;
use ::exr::meta::attribute::{AttributeValue, Chromaticities, IntegerBounds, LineOrder, Text};
use ::exr::meta::header::{ImageAttributes, LayerAttributes};
use ::exr::prelude::WritableImage;
use half::f16;

use super::{ExrPrecision, unfit};
use crate::{Format, Image, ImageError};

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
            let samples = match precision {
                ExrPrecision::Half => FlatSamples::F16(samples.map(f16::from_f32).collect()),
                ExrPrecision::Float => FlatSamples::F32(samples.collect()),
            };
            Ok(AnyChannel::new(name, samples))
        })
        .collect::<Result<_, ImageError>>()?;

    let metadata = &image.metadata;
    let (width, height) = (image.width(), image.height());
    let mut layer_attributes = LayerAttributes::default();
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
    Ok(file.into_inner())
}

/// A text of the format, with question marks for characters that it can't hold.
fn latin1(text: &str) -> Text {
    let bytes: Vec<u8> = text.chars().map(|c| u8::try_from(c as u32).unwrap_or(b'?')).collect();
    Text::from_slice_unchecked(&bytes)
}
