//! Every format: what is written comes back.

use luz_image::{
    BitDepth, Chromaticities, Encoding, ExrPrecision, Format, Image, Placement, ReadOptions, SampleType, WriteOptions,
};

/// A small picture with dark, bright, negative-free light and an odd size.
fn picture(channels: &[&str]) -> Image {
    let n = channels.len();
    let data = (0..7 * 5 * n).map(|i| (i as f32 * 0.37).sin().abs() * 1.2).collect();
    Image::from_data(7, 5, channels.iter().copied(), data).unwrap()
}

fn decode(bytes: &[u8], format: Format) -> Image {
    Image::decode(bytes, Some(format), &ReadOptions::default()).unwrap()
}

#[test]
fn exr_keeps_every_channel_exactly() {
    let mut image =
        picture(&["R", "G", "B", "A", "Albedo.R", "Albedo.G", "Albedo.B", "Ns.X", "Ns.Y", "Ns.Z", "Variance"]);
    image.pixel_mut(3, 2)[4] = -123.456;
    image.pixel_mut(0, 0)[0] = f32::INFINITY;
    image.pixel_mut(6, 4)[10] = 1e-42;
    let file = image.encode(Format::Exr, &WriteOptions::default()).unwrap();
    let back = decode(&file, Format::Exr);
    // Unlayered channels come first, in their usual order.
    assert_eq!(
        back.channels(),
        ["R", "G", "B", "A", "Variance", "Albedo.R", "Albedo.G", "Albedo.B", "Ns.X", "Ns.Y", "Ns.Z"]
    );
    let names: Vec<&str> = image.channels().iter().map(String::as_str).collect();
    assert_eq!(back.select(&names).unwrap().data(), image.data());
    assert_eq!(back.metadata.sample_type, Some(SampleType::Float(32)));
}

#[test]
fn exr_halves_are_rounded_to_eleven_bits() {
    let image = picture(&["R", "G", "B"]);
    let options = WriteOptions { exr: ExrPrecision::Half, ..WriteOptions::default() };
    let back = decode(&image.encode(Format::Exr, &options).unwrap(), Format::Exr);
    assert_eq!(back.metadata.sample_type, Some(SampleType::Float(16)));
    for (a, b) in image.data().iter().zip(back.data()) {
        assert!((a - b).abs() <= a / 2048.0 + 1e-7, "{a} {b}");
    }
}

#[test]
fn exr_keeps_metadata() {
    let mut image = picture(&["Y"]);
    image.metadata.chromaticities = Some(Chromaticities::of(luz_color::RgbColorSpace::rec2020()));
    image.metadata.placement = Some(Placement { x: 3, y: 4, full_width: 20, full_height: 10 });
    for (k, v) in [("comments", "two cats — ✓"), ("software", "luz"), ("seed", "42")] {
        image.metadata.text.insert(k.to_owned(), v.to_owned());
    }
    let back = decode(&image.encode(Format::Exr, &WriteOptions::default()).unwrap(), Format::Exr).metadata;
    assert_eq!(back.chromaticities.unwrap().color_space().unwrap().name(), "rec2020");
    assert_eq!(back.placement, image.metadata.placement);
    // OpenEXR's texts are Latin-1.
    assert_eq!(back.text["comments"], "two cats ? ?");
    assert_eq!((back.text["software"].as_str(), back.text["seed"].as_str()), ("luz", "42"));
}

#[test]
fn exr_files_are_the_same_bytes_every_time() {
    let data = (0..300 * 200 * 3).map(|i| (i as f32 * 0.1).sin()).collect();
    let image = Image::from_data(300, 200, ["R", "G", "B"], data).unwrap();
    let file = image.encode(Format::Exr, &WriteOptions::default()).unwrap();
    for _ in 0..4 {
        assert!(image.encode(Format::Exr, &WriteOptions::default()).unwrap() == file);
    }
}

#[test]
fn float_formats_are_exact_for_colour() {
    for channels in [&["R", "G", "B"][..], &["Y"]] {
        let image = picture(channels);
        let back = decode(&image.encode(Format::Pfm, &WriteOptions::default()).unwrap(), Format::Pfm);
        assert_eq!((back.channels(), back.data()), (image.channels(), image.data()));
    }
    let image = picture(&["R", "G", "B"]);
    let options = WriteOptions { bits: BitDepth::Float, ..WriteOptions::default() };
    let back = decode(&image.encode(Format::Tiff, &options).unwrap(), Format::Tiff);
    assert_eq!((back.channels(), back.data()), (image.channels(), image.data()));
    assert_eq!(back.metadata.sample_type, Some(SampleType::Float(32)));
    // RGBE has eight bits for the largest component.
    let back = decode(&image.encode(Format::Hdr, &WriteOptions::default()).unwrap(), Format::Hdr);
    for (a, b) in image.data().chunks(3).zip(back.data().chunks(3)) {
        let largest = a.iter().copied().fold(0.0, f32::max);
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= largest / 128.0), "{a:?} {b:?}");
    }
}

#[test]
fn integer_formats_round_in_srgb() {
    let eight = WriteOptions::default();
    let sixteen = WriteOptions { bits: BitDepth::Sixteen, ..eight };
    let srgb = |v: f32| Encoding::Srgb.from_linear(v.clamp(0.0, 1.0));
    for (format, options, channels, steps) in [
        (Format::Png, eight, &["R", "G", "B"][..], 255.0),
        (Format::Png, eight, &["Y"], 255.0),
        (Format::Png, eight, &["Y", "A"], 255.0),
        (Format::Png, sixteen, &["R", "G", "B", "A"], 65535.0),
        (Format::Png, sixteen, &["Y"], 65535.0),
        (Format::Tiff, eight, &["R", "G", "B"], 255.0),
        (Format::Tiff, sixteen, &["R", "G", "B"], 65535.0),
        (Format::Bmp, eight, &["R", "G", "B"], 255.0),
        (Format::Tga, eight, &["R", "G", "B"], 255.0),
    ] {
        let image = picture(channels);
        let back = decode(&image.encode(format, &options).unwrap(), format);
        assert_eq!(back.channels(), image.channels(), "{format}");
        assert_eq!(back.metadata.sample_type, Some(SampleType::Unsigned(if steps > 255.0 { 16 } else { 8 })));
        for (i, (a, b)) in image.data().iter().zip(back.data()).enumerate() {
            // Within half a step of the stored integers, so correctly rounded.
            let encode = |v: f32| if channels[i % channels.len()] == "A" { v.clamp(0.0, 1.0) } else { srgb(v) };
            assert!((encode(*a) - encode(*b)).abs() <= 0.5001 / steps, "{format} {a} {b}");
        }
        // Reading and writing again changes nothing any more.
        assert_eq!(decode(&back.encode(format, &options).unwrap(), format).data(), back.data());
    }
}

#[test]
fn jpeg_is_close() {
    let image = Image::from_data(64, 64, ["R", "G", "B"], (0..64 * 64 * 3).map(|i| (i / 192) as f32 / 64.0).collect());
    let image = image.unwrap();
    let back = decode(&image.encode(Format::Jpeg, &WriteOptions::default()).unwrap(), Format::Jpeg);
    let worst = image.data().iter().zip(back.data()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(worst < 0.03, "{worst}");
}

#[test]
fn stored_values_are_read_on_request() {
    let image = Image::from_data(2, 1, ["Y"], vec![0.0, 0.214_041_14]).unwrap();
    let file = image.encode(Format::Png, &WriteOptions { bits: BitDepth::Sixteen, ..Default::default() }).unwrap();
    let options = ReadOptions { encoding: Some(Encoding::Linear), ..Default::default() };
    let raw = Image::decode(&file, None, &options).unwrap();
    assert!((raw.data()[1] - 0.5).abs() < 1e-5);
    let options = ReadOptions { encoding: Some(Encoding::Gamma(2.0)), ..Default::default() };
    assert!((Image::decode(&file, None, &options).unwrap().data()[1] - 0.25).abs() < 1e-5);
}

#[test]
fn png_keeps_text_and_converts_wide_colour_to_srgb() {
    let mut image = Image::from_data(1, 1, ["R", "G", "B"], vec![0.5, 0.5, 0.5]).unwrap();
    image.metadata.text.insert("Comment".to_owned(), "two cats — ✓".to_owned());
    let back = decode(&image.encode(Format::Png, &WriteOptions::default()).unwrap(), Format::Png);
    assert_eq!(back.metadata.text["Comment"], "two cats — ✓");
    assert_eq!(back.metadata.encoding, Some(Encoding::Srgb));

    let space = luz_color::RgbColorSpace::dci_p3();
    image.data_mut().copy_from_slice(&[0.2, 0.5, 0.4]);
    image.metadata.chromaticities = Some(Chromaticities::of(space));
    let options = WriteOptions { bits: BitDepth::Sixteen, ..Default::default() };
    let back = decode(&image.encode(Format::Png, &options).unwrap(), Format::Png);
    let expected = space.conversion_to(luz_color::RgbColorSpace::srgb()) * glam_vector(&image);
    for (a, b) in back.data().iter().zip([expected.x, expected.y, expected.z]) {
        assert!((a - b.max(0.0)).abs() < 1e-4, "{:?} {expected}", back.data());
    }
}

fn glam_vector(image: &Image) -> glam::Vec3 {
    glam::Vec3::from_slice(image.pixel(0, 0))
}

#[test]
fn contents_win_over_the_extension() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wrong.png");
    let image = picture(&["R", "G", "B"]);
    std::fs::write(&path, image.encode(Format::Exr, &WriteOptions::default()).unwrap()).unwrap();
    assert_eq!(Image::read(&path).unwrap().data(), image.data());
}

#[test]
fn big_endian_and_scaled_pfm_is_read() {
    let mut file = b"Pf\n2 2\n2.0\n".to_vec();
    for v in [1.0f32, 2.0, 3.0, 4.0] {
        file.extend(v.to_be_bytes());
    }
    assert_eq!(decode(&file, Format::Pfm).data(), [6.0, 8.0, 2.0, 4.0]);
}
