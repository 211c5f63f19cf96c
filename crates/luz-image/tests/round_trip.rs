//! Reading a file and writing it again, as a filter that changes nothing would: the same samples in the same depth, and what
//! the file says beside them.

use luz_image::{Density, Encoding, Format, Image, LengthUnit, ReadOptions, SampleType, WriteOptions};

/// Every value of the depth somewhere, in an order that leaves no neighbours alike.
fn samples(count: usize, steps: u32) -> Vec<f32> {
    (0..count as u32).map(|i| (i.wrapping_mul(40_503) % (steps + 1)) as f32 / steps as f32).collect()
}

/// A file with stored samples `data`.
fn file(format: Format, channels: &[&str], steps: u32, prepare: impl Fn(&mut Image)) -> Vec<u8> {
    let (width, height) = if steps > 255 { (256, 256) } else { (32, 24) };
    let data = samples(width * height * channels.len(), steps);
    let mut image = Image::from_data(width, height, channels.iter().copied(), data).unwrap();
    image.metadata.encoding = Some(Encoding::Linear);
    image.metadata.stored_encoding = Some(Encoding::Srgb);
    image.metadata.sample_type = Some(SampleType::Unsigned(if steps > 255 { 16 } else { 8 }));
    prepare(&mut image);
    image.encode(format, &WriteOptions::as_read(&image, format)).unwrap()
}

fn read(file: &[u8], format: Format, options: &ReadOptions) -> Image {
    Image::decode(file, Some(format), options).unwrap()
}

#[test]
fn lossless_files_come_back_sample_by_sample_stored_or_linear() {
    for (format, channels, steps) in [
        (Format::Png, &["R", "G", "B"][..], 255),
        (Format::Png, &["R", "G", "B", "A"], 65535),
        (Format::Png, &["Y"], 65535),
        (Format::Png, &["Y", "A"], 255),
        (Format::Tiff, &["R", "G", "B"], 255),
        (Format::Tiff, &["R", "G", "B", "A"], 255),
        (Format::Tiff, &["R", "G", "B"], 65535),
        (Format::Tiff, &["Y"], 65535),
        (Format::Bmp, &["R", "G", "B"], 255),
        (Format::Tga, &["R", "G", "B"], 255),
    ] {
        let file = file(format, channels, steps, |_| {});
        let stored = read(&file, format, &ReadOptions::stored());
        assert_eq!(stored.data(), samples(stored.data().len(), steps), "{format}");
        let again = stored.encode(format, &WriteOptions::as_read(&stored, format)).unwrap();
        assert!(again == file, "{format} {channels:?} {steps}: stored values");
        // Through linear light.
        let linear = read(&file, format, &ReadOptions::default());
        let again = linear.encode(format, &WriteOptions::as_read(&linear, format)).unwrap();
        assert!(again == file, "{format} {channels:?} {steps}: linear light");
        // Decoding later is decoding while reading.
        let mut later = stored.clone();
        later.decode_stored();
        assert_eq!(later, linear);
        later.encode_stored();
        assert_eq!(later.metadata.encoding, Some(Encoding::Linear));
        assert!(later.encode(format, &WriteOptions::as_read(&later, format)).unwrap() == file);
    }
}

#[test]
fn grey_with_opacity_becomes_colour_with_opacity_in_tiff() {
    let file = file(Format::Tiff, &["Y", "A"], 255, |_| {});
    let back = read(&file, Format::Tiff, &ReadOptions::stored());
    assert_eq!(back.channels(), ["R", "G", "B", "A"]);
    let grey = samples(back.data().len() / 2, 255);
    assert!(back.data().chunks(4).zip(grey.chunks(2)).all(|(p, q)| p == [q[0], q[0], q[0], q[1]]));
}

#[test]
fn png_keeps_what_the_file_says_of_its_samples() {
    let profile: Vec<u8> = (0..400u32).map(|i| (i * i % 251) as u8).collect();
    let exif = exif_with_orientation(1);
    let file = file(Format::Png, &["R", "G", "B"], 65535, |image| {
        image.metadata.icc_profile = Some(profile.clone());
        image.metadata.exif = Some(exif.clone());
        image.metadata.density = Some(Density { pixels: [300.0, 150.0], per: Some(LengthUnit::Inch) });
        image.metadata.text.insert("Author".to_owned(), "Ada Łoś".to_owned());
    });
    let image = read(&file, Format::Png, &ReadOptions::stored());
    let metadata = &image.metadata;
    assert_eq!(metadata.icc_profile.as_ref(), Some(&profile));
    assert_eq!(metadata.exif.as_ref(), Some(&exif));
    assert_eq!(metadata.text["Author"], "Ada Łoś");
    let density = metadata.density.unwrap().in_unit(LengthUnit::Inch).pixels;
    assert!((density[0] - 300.0).abs() < 0.02 && (density[1] - 150.0).abs() < 0.02, "{density:?}");
    assert!(image.encode(Format::Png, &WriteOptions::as_read(&image, Format::Png)).unwrap() == file);
    // A picture whose colours a tone map has changed doesn't claim the profile of those that were read.
    let shown = image.encode(Format::Png, &WriteOptions::default()).unwrap();
    let shown = read(&shown, Format::Png, &ReadOptions::default()).metadata;
    assert_eq!((shown.icc_profile, shown.stored_encoding), (None, Some(Encoding::Srgb)));
    assert_eq!((shown.exif.as_ref(), shown.text.len()), (Some(&exif), 1));
}

#[test]
fn png_states_the_encoding_that_was_stored() {
    for encoding in [Encoding::Linear, Encoding::Srgb, Encoding::Gamma(2.0)] {
        let file = file(Format::Png, &["R", "G", "B"], 255, |image| image.metadata.stored_encoding = Some(encoding));
        let stored = read(&file, Format::Png, &ReadOptions::stored());
        assert_eq!(stored.metadata.stored_encoding, Some(encoding));
        assert!(stored.encode(Format::Png, &WriteOptions::as_read(&stored, Format::Png)).unwrap() == file);
        let linear = read(&file, Format::Png, &ReadOptions::default());
        assert_eq!(linear.metadata.encoding, Some(encoding));
        assert!(linear.encode(Format::Png, &WriteOptions::as_read(&linear, Format::Png)).unwrap() == file);
    }
}

#[test]
fn jpeg_keeps_quality_profile_exif_and_density() {
    let profile = vec![7u8; 70_000]; // More than a segment holds.
    for quality in [30, 75, 92, 100] {
        let file = file(Format::Jpeg, &["R", "G", "B"], 255, |image| {
            image.metadata.jpeg_quality = Some(quality);
            image.metadata.icc_profile = Some(profile.clone());
            image.metadata.exif = Some(exif_with_orientation(1));
            image.metadata.density = Some(Density { pixels: [72.0, 96.0], per: Some(LengthUnit::Inch) });
        });
        let metadata = read(&file, Format::Jpeg, &ReadOptions::stored()).metadata;
        assert_eq!(metadata.jpeg_quality, Some(quality));
        assert_eq!(metadata.icc_profile.as_ref(), Some(&profile));
        assert_eq!(metadata.exif, Some(exif_with_orientation(1)));
        assert_eq!(metadata.density, Some(Density { pixels: [72.0, 96.0], per: Some(LengthUnit::Inch) }));
    }
}

/// A minimal little-endian Exif block.
fn exif_with_orientation(value: u8) -> Vec<u8> {
    let entry = [0x12, 0x01, 3, 0, 1, 0, 0, 0, value, 0, 0, 0];
    [&b"II*\0"[..], &[8, 0, 0, 0, 1, 0], &entry, &[0; 4]].concat()
}

#[test]
fn an_orientation_is_applied_once() {
    // "Rotate by 90 degrees".
    let file = file(Format::Png, &["R", "G", "B"], 255, |image| image.metadata.exif = Some(exif_with_orientation(6)));
    let upright = read(&file, Format::Png, &ReadOptions::stored());
    assert_eq!((upright.width(), upright.height()), (24, 32));
    assert_eq!(upright.metadata.exif, Some(exif_with_orientation(1)));
    let again = upright.encode(Format::Png, &WriteOptions::as_read(&upright, Format::Png)).unwrap();
    assert_eq!(read(&again, Format::Png, &ReadOptions::stored()), upright);
}

#[test]
fn exr_keeps_precision_by_channel_and_attributes() {
    use exr::image::{AnyChannel, AnyChannels, FlatSamples, Layer};
    use exr::meta::attribute::AttributeValue;
    use exr::meta::header::{ImageAttributes, LayerAttributes};
    use exr::prelude::{IntegerBounds, Text, Vec2, WritableImage};
    use half::f16;

    let channels = AnyChannels::sort(
        [
            AnyChannel::new("R", FlatSamples::F16((0..6).map(|i| f16::from_f32(i as f32 / 7.0)).collect())),
            AnyChannel::new("Z", FlatSamples::F32((0..6).map(|i| i as f32 / 7.0).collect())),
            AnyChannel::new("id", FlatSamples::U32((0..6).collect())),
        ]
        .into_iter()
        .collect(),
    );
    let mut layer = LayerAttributes::named("beauty");
    layer.exposure = Some(0.01);
    layer.aperture = Some(5.6);
    layer.other.insert(Text::from("lens"), AttributeValue::F32(35.0));
    layer.other.insert(Text::from("note"), AttributeValue::Text(Text::from("dusk")));
    let mut attributes = ImageAttributes::new(IntegerBounds::from_dimensions(Vec2(3, 2)));
    attributes.pixel_aspect = 2.0;
    let mut file = std::io::Cursor::new(Vec::new());
    exr::image::Image::empty(attributes)
        .with_layer(Layer::new((3, 2), layer, exr::image::Encoding::FAST_LOSSLESS, channels))
        .write()
        .to_buffered(&mut file)
        .unwrap();

    let image = read(&file.into_inner(), Format::Exr, &ReadOptions::stored());
    let kept = |image: &Image, name: &str| image.metadata.exr.as_ref().unwrap().sample_type(name).unwrap();
    assert_eq!(kept(&image, "R"), SampleType::Float(16));
    let options = WriteOptions::as_read(&image, Format::Exr);
    let bytes = image.encode(Format::Exr, &options).unwrap();
    let again = read(&bytes, Format::Exr, &ReadOptions::stored());
    assert_eq!(again, image);
    assert!(again.encode(Format::Exr, &options).unwrap() == bytes);
    assert_eq!(again.metadata.text["note"], "dusk");
    assert_eq!(again.metadata.exr.as_ref().unwrap().custom_names(), ["lens", "note"]);
    assert_eq!(kept(&again, "id"), SampleType::Unsigned(32));

    // A half would have become infinite.
    let mut bright = again;
    bright.pixel_mut(1, 1)[0] = 1e6;
    let bright = read(&bright.encode(Format::Exr, &options).unwrap(), Format::Exr, &ReadOptions::stored());
    assert_eq!((kept(&bright, "R"), bright.pixel(1, 1)[0]), (SampleType::Float(32), 1e6));
}

#[test]
fn floats_of_other_formats_come_back() {
    let data: Vec<f32> = (0..9 * 4 * 4).map(|i| (i as f32 * 0.7).sin() * 3.0 + 3.0).collect();
    let mut image = Image::from_data(9, 4, ["R", "G", "B", "A"], data).unwrap();
    image.metadata.sample_type = Some(SampleType::Float(32));
    let tiff = image.encode(Format::Tiff, &WriteOptions::as_read(&image, Format::Tiff)).unwrap();
    assert_eq!(read(&tiff, Format::Tiff, &ReadOptions::stored()).data(), image.data());
    // What RGBE can hold, it holds when it is written again.
    let hdr = image.encode(Format::Hdr, &WriteOptions::as_read(&image, Format::Hdr)).unwrap();
    let back = read(&hdr, Format::Hdr, &ReadOptions::stored());
    assert_eq!(back.metadata.sample_type, Some(SampleType::SharedExponent));
    assert!(back.encode(Format::Hdr, &WriteOptions::as_read(&back, Format::Hdr)).unwrap() == hdr);
}
