//! OpenEXR, through the `exr` crate.

use std::collections::BTreeMap;
use std::io::Cursor;

use ::exr::error::Error;
use ::exr::image::{AnyChannels, FlatSamples, Layer};
use ::exr::meta::attribute::{AttributeValue, Text};
use ::exr::meta::header::Header;
use ::exr::prelude::{ReadChannels, ReadLayers};

use super::{ReadOptions, check_size, damaged, truncated};
use crate::{Chromaticities, Encoding, ExrAttributes, Format, Image, ImageError, ImageMetadata, Placement, SampleType};

pub(super) fn decode(bytes: &[u8], options: &ReadOptions) -> Result<Image, ImageError> {
    let headers = ::exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(translate)?.headers;
    check_headers(&headers, bytes.len(), options)?;
    let file = ::exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(translate)?;

    let Some(main) = file.layer_data.iter().max_by_key(|l| l.size.area()) else {
        return Err(damaged(Format::Exr, "it has no layers"));
    };
    let (size, position) = (main.size, main.attributes.layer_position);
    let is_multi_part = file.layer_data.len() > 1;
    let mut metadata = ImageMetadata { encoding: Some(Encoding::Linear), ..ImageMetadata::default() };
    metadata.chromaticities = file.attributes.chromaticities.map(|c| Chromaticities {
        primaries: [c.red, c.green, c.blue].map(|p| [p.x(), p.y()]),
        white: [c.white.x(), c.white.y()],
    });
    let display = file.attributes.display_window;
    if display.size != size || display.position != position {
        metadata.placement = Some(Placement {
            x: position.x().saturating_sub(display.position.x()),
            y: position.y().saturating_sub(display.position.y()),
            full_width: display.size.width(),
            full_height: display.size.height(),
        });
    }
    collect_text(&mut metadata.text, &file.attributes.other);

    let mut planes: Vec<(String, &FlatSamples)> = Vec::new();
    for layer in &file.layer_data {
        let name = layer.attributes.layer_name.as_ref().map(Text::to_string);
        if layer.size != size {
            metadata.skipped_layers.push(name.unwrap_or_default());
            continue;
        }
        collect_layer_text(&mut metadata.text, layer);
        for channel in &layer.channel_data.list {
            let own = channel.name.to_string();
            let full = match &name {
                Some(layer) if is_multi_part && !layer.is_empty() && !own.starts_with(&format!("{layer}.")) => {
                    format!("{layer}.{own}")
                }
                _ => own,
            };
            planes.push((full, &channel.sample_data));
        }
    }
    planes.sort_by_key(|(name, _)| sort_key(name));
    metadata.sample_type = planes.first().map(|(_, samples)| sample_type(samples));
    let mut layer = main.attributes.clone();
    // Its picture would be an old one, and parts become one.
    layer.preview = None;
    if is_multi_part {
        layer.layer_name = None;
    }
    metadata.exr = Some(ExrAttributes {
        image: Box::new(file.attributes.clone()),
        layer: Box::new(layer),
        types: planes.iter().map(|(name, samples)| (name.clone(), sample_type(samples))).collect(),
    });

    let n = planes.len();
    let mut data = vec![0.0; size.area() * n];
    for (c, (_, samples)) in planes.iter().enumerate() {
        let pixels = data.chunks_exact_mut(n.max(1));
        match samples {
            FlatSamples::F16(v) => pixels.zip(v).for_each(|(p, v)| p[c] = v.to_f32()),
            FlatSamples::F32(v) => pixels.zip(v).for_each(|(p, v)| p[c] = *v),
            FlatSamples::U32(v) => pixels.zip(v).for_each(|(p, v)| p[c] = *v as f32),
        }
    }
    let names = planes.into_iter().map(|(name, _)| name);
    let mut image = Image::from_data(size.width(), size.height(), names, data)
        .map_err(|error| damaged(Format::Exr, error.to_string()))?;
    image.metadata = metadata;
    Ok(image)
}

fn sample_type(samples: &FlatSamples) -> SampleType {
    match samples {
        FlatSamples::F16(_) => SampleType::Float(16),
        FlatSamples::F32(_) => SampleType::Float(32),
        FlatSamples::U32(_) => SampleType::Unsigned(32),
    }
}

/// Refuses what is not supported or not believable before anything large is allocated.
fn check_headers(headers: &[Header], file_bytes: usize, options: &ReadOptions) -> Result<(), ImageError> {
    let mut total = 0u64;
    for header in headers {
        if header.deep {
            return Err(damaged(Format::Exr, "it has deep data, which is not supported; flatten it first"));
        }
        for channel in &header.channels.list {
            if channel.sampling.x() != 1 || channel.sampling.y() != 1 {
                let reason = format!("its channel `{}` is subsampled, which is not supported", channel.name);
                return Err(damaged(Format::Exr, reason));
            }
        }
        let (width, height) = (header.layer_size.width() as u64, header.layer_size.height() as u64);
        let channels = header.channels.list.len() as u64;
        check_size(width, height, channels, file_bytes, options)?;
        total = total.saturating_add(width * height * channels);
        check_size(total, 1, 1, file_bytes, options)?;
    }
    Ok(())
}

/// Colour before everything else and in its usual order; the file's order is alphabetical.
fn sort_key(name: &str) -> (bool, String, usize, String) {
    let (layer, channel) = name.rsplit_once('.').unwrap_or(("", name));
    let rank = ["R", "G", "B", "Y", "A", "X"].iter().position(|&c| c == channel).unwrap_or(usize::MAX);
    // Vectors are X, Y, Z.
    let rank = if channel == "Y" && !layer.is_empty() { 6 } else { rank };
    (!layer.is_empty(), layer.to_owned(), rank, channel.to_owned())
}

fn collect_text<'a>(
    text: &mut BTreeMap<String, String>,
    attributes: impl IntoIterator<Item = (&'a Text, &'a AttributeValue)>,
) {
    for (name, value) in attributes {
        if let AttributeValue::Text(value) = value {
            text.insert(name.to_string(), value.to_string());
        }
    }
}

fn collect_layer_text(text: &mut BTreeMap<String, String>, layer: &Layer<AnyChannels<FlatSamples>>) {
    let attributes = &layer.attributes;
    for (name, value) in [
        ("comments", &attributes.comments),
        ("owner", &attributes.owner),
        ("software", &attributes.software_name),
        ("capDate", &attributes.capture_date),
    ] {
        if let Some(value) = value {
            text.insert(name.to_owned(), value.to_string());
        }
    }
    collect_text(text, &attributes.other);
}

/// Our error for one of the `exr` crate.
fn translate(error: Error) -> ImageError {
    match error {
        Error::Io(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => truncated(Format::Exr),
        Error::Invalid(reason) if reason.contains("reference to missing bytes") => truncated(Format::Exr),
        other => damaged(Format::Exr, other.to_string()),
    }
}
