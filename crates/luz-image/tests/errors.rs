//! Errors name the file, the cause and a way out, and no input makes the reader panic.

use std::fs;

use luz_image::{BitDepth, Format, Image, ImageError, ReadOptions, WriteOptions};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

fn picture() -> Image {
    let data = (0..9 * 6 * 3).map(|i| (i as f32 * 0.37).sin().abs()).collect();
    Image::from_data(9, 6, ["R", "G", "B"], data).unwrap()
}

fn decode_error(bytes: &[u8]) -> String {
    Image::decode(bytes, None, &ReadOptions::default()).unwrap_err().to_string()
}

#[test]
fn reading_names_file_and_cause() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("missing.exr");
    let message = Image::read(&path).unwrap_err().to_string();
    assert!(message.starts_with(&format!("cannot read `{}`: ", path.display())), "{message}");

    let path = folder.path().join("notes.txt");
    fs::write(&path, "not a picture").unwrap();
    assert_eq!(
        Image::read(&path).unwrap_err().to_string(),
        format!(
            "cannot read `{}`: neither its contents nor its extension belong to a known image format \
             (OpenEXR, PNG, JPEG, TIFF, Radiance HDR, PFM, BMP, TGA)",
            path.display()
        )
    );

    let endless = ReadOptions { max_bytes: 3, ..Default::default() };
    assert_eq!(
        Image::read_with(&path, &endless).unwrap_err().to_string(),
        format!("cannot read `{}`: it is larger than the 3 bytes that are allowed", path.display())
    );

    let path = folder.path().join("half.exr");
    let file = picture().encode(Format::Exr, &WriteOptions::default()).unwrap();
    fs::write(&path, &file[..file.len() / 2]).unwrap();
    assert_eq!(
        Image::read(&path).unwrap_err().to_string(),
        format!("cannot read `{}` as OpenEXR: the file ends early; it may be truncated", path.display())
    );
}

#[test]
fn pfm_errors_say_what_is_wrong() {
    for (text, expected) in [
        ("PF\n3 x\n-1\n", "its height is missing or no number"),
        ("PF\n0 3\n-1\n", "its width is zero"),
        ("PF\n3 3\nnan\n", "its scale is NaN, which must be finite and not zero"),
        ("PF\n3 3\n-1\nabc", "the file ends early; it may be truncated"),
        ("PF\n3", "its width is missing or no number"),
    ] {
        assert_eq!(decode_error(text.as_bytes()), format!("cannot read the image as PFM: {expected}"), "{text:?}");
    }
}

#[test]
fn absurd_sizes_are_refused_before_memory_is_taken() {
    assert_eq!(
        decode_error(b"PF\n4000000000 4000000000\n-1.0\n"),
        "cannot read the image: it claims 4000000000×4000000000 pixels with 3 channels, \
         which a file of 30 bytes cannot hold; it is damaged"
    );
    // A PNG whose header claims 60000×60000 pixels; its checksum is right.
    let mut png = picture().encode(Format::Png, &WriteOptions::default()).unwrap();
    png[16..24].copy_from_slice(&[0, 0, 0xea, 0x60, 0, 0, 0xea, 0x60]);
    let crc = crc32(&png[12..29]);
    png[29..33].copy_from_slice(&crc.to_be_bytes());
    let message = decode_error(&png);
    assert!(message.contains("60000×60000 pixels with 3 channels, which a file of"), "{message}");
    // An honest image that is larger than allowed.
    let file = picture().encode(Format::Exr, &WriteOptions::default()).unwrap();
    let error = Image::decode(&file, None, &ReadOptions { max_bytes: 100, ..Default::default() }).unwrap_err();
    assert_eq!(
        error.to_string(),
        "cannot read the image: it claims 9×6 pixels with 3 channels, which need 648 bytes of memory where 100 are allowed"
    );
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |c, _| if c & 1 == 1 { 0xedb8_8320 ^ (c >> 1) } else { c >> 1 })
    })
}

#[test]
fn writing_names_file_and_way_out() {
    let folder = tempfile::tempdir().unwrap();
    let image = picture();
    let path = folder.path().join("a.xyz");
    assert_eq!(
        image.write(&path).unwrap_err().to_string(),
        format!(
            "cannot write `{}`: `.xyz` is no known image format; \
             use one of .exr, .png, .jpg, .jpeg, .tif, .tiff, .hdr, .pic, .pfm, .bmp, .tga",
            path.display()
        )
    );
    let path = folder.path().join("no/such/a.exr");
    assert_eq!(
        image.write(&path).unwrap_err().to_string(),
        format!(
            "cannot write `{}`: there is no folder `{}`; create it first",
            path.display(),
            path.parent().unwrap().display()
        )
    );
    let options = WriteOptions { bits: BitDepth::Sixteen, ..Default::default() };
    assert_eq!(
        image.encode(Format::Jpeg, &options).unwrap_err().to_string(),
        "cannot write this image as JPEG: it holds no 16-bit samples; write PNG or TIFF"
    );
    let depth = Image::new(2, 2, ["Z", "Id"]).unwrap();
    assert_eq!(
        depth.encode(Format::Png, &WriteOptions::default()).unwrap_err().to_string(),
        "cannot write this image as PNG: it has no channels R, G, B or Y, only Z, Id; write OpenEXR or select channels"
    );
}

#[test]
fn files_are_replaced_whole_and_nothing_else_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    fs::write(&path, "old").unwrap();
    picture().write(&path).unwrap();
    assert_eq!(Image::read(&path).unwrap().data(), picture().data());
    // A directory in the way: an error, and no temporary file stays behind.
    let blocked = folder.path().join("b.exr");
    fs::create_dir(&blocked).unwrap();
    fs::write(blocked.join("inside"), "").unwrap();
    assert!(matches!(picture().write(&blocked), Err(ImageError::Write { .. })));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = fs::metadata(&path).unwrap().permissions().mode();
        assert_eq!(mode & 0o600, 0o600);
        assert_ne!(mode & 0o044, 0, "readable for others as new files are: {mode:o}");
    }
}

/// A file of every format.
fn samples() -> Vec<(Format, Vec<u8>)> {
    let float_tiff = WriteOptions { bits: BitDepth::Float, ..Default::default() };
    let mut all: Vec<_> = Format::ALL
        .into_iter()
        .map(|format| (format, picture().encode(format, &WriteOptions::default()).unwrap()))
        .collect();
    all.push((Format::Tiff, picture().encode(Format::Tiff, &float_tiff).unwrap()));
    all
}

#[test]
fn truncated_files_never_panic() {
    for (format, file) in samples() {
        for length in 0..file.len().min(400) {
            // Whatever comes out, it comes out as a value.
            let _ = Image::decode(&file[..length], Some(format), &ReadOptions::default());
        }
        let cut = file.len() - file.len() / 4;
        let result = Image::decode(&file[..cut], Some(format), &ReadOptions::default());
        // JPEG decoders show what they have; every other format says that something is missing.
        assert!(result.is_err() || format == Format::Jpeg, "{format}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, rng_seed: RngSeed::Fixed(7), ..ProptestConfig::default() })]

    #[test]
    fn damaged_files_never_panic(flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let options = ReadOptions { max_bytes: 1 << 24, ..Default::default() };
        for (format, mut file) in samples() {
            for (index, value) in &flips {
                let i = index.index(file.len());
                file[i] = *value;
            }
            let _ = Image::decode(&file, Some(format), &options);
        }
    }

    #[test]
    fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..400), format in 0..8usize) {
        let _ = Image::decode(&bytes, Some(Format::ALL[format]), &ReadOptions { max_bytes: 1 << 24, ..Default::default() });
    }
}
