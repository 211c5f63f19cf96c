//! Photographs and videos outside the repository, in the folder that LUZ_DATA names: they come back as they were.
//! `LUZ_DATA=../shared/data cargo test --release -p luz-image --features shared-data --test shared_data`

use std::path::PathBuf;

use luz_image::video::{ReadVideoOptions, VideoReader, VideoWriter, WriteVideoOptions};
use luz_image::{Format, Image, ReadOptions, WriteOptions};

fn data(path: &str) -> PathBuf {
    let folder = std::env::var("LUZ_DATA").expect("LUZ_DATA names the folder of shared data");
    // Tests run in the folder of their crate; a relative path is meant from the workspace's.
    let folder = PathBuf::from(folder);
    let root =
        if folder.is_absolute() { PathBuf::new() } else { PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..") };
    root.join(folder).join(path)
}

#[test]
fn photographs_are_written_sample_by_sample_as_they_were_read() {
    let mut count = 0;
    for folder in ["images", "images/kodak", "images/hdr"] {
        for entry in std::fs::read_dir(data(folder)).unwrap() {
            let path = entry.unwrap().path();
            let Some(format) = Format::from_path(&path) else { continue };
            let image = Image::read_with(&path, &ReadOptions::stored()).unwrap();
            let file = image.encode(format, &WriteOptions::as_read(&image, format)).unwrap();
            let again = Image::decode(&file, None, &ReadOptions::stored()).unwrap();
            assert!(again.data() == image.data(), "{}", path.display());
            assert_eq!(again.metadata.sample_type, image.metadata.sample_type);
            // Through linear light and back.
            let mut linear = image.clone();
            linear.decode_stored();
            assert!(
                linear.encode(format, &WriteOptions::as_read(&linear, format)).unwrap() == file,
                "{}",
                path.display()
            );
            count += 1;
        }
    }
    assert!(count >= 15, "{count}");
}

#[test]
fn videos_are_copied_bit_by_bit() {
    let folder = tempfile::tempdir().unwrap();
    for (name, width, height) in [
        ("CiscoVT2people_160x96_6fps.yuv", 160, 96),
        ("CiscoVT2people_320x192_12fps.yuv", 320, 192),
        ("Static_152_100.yuv", 152, 100),
    ] {
        let raw = std::fs::read(data("video").join(name)).unwrap();
        let mut file = format!("YUV4MPEG2 W{width} H{height} F12:1 Ip C420mpeg2 XCOLORRANGE=LIMITED\n").into_bytes();
        for frame in raw.chunks_exact(width * height * 3 / 2) {
            file.extend_from_slice(b"FRAME\n");
            file.extend_from_slice(frame);
        }
        let (a, b) = (folder.path().join("a.y4m"), folder.path().join("b.y4m"));
        std::fs::write(&a, &file).unwrap();
        let mut reader = VideoReader::open(&a, &ReadVideoOptions::default()).unwrap();
        let mut writer = VideoWriter::create(&b, reader.info(), &WriteVideoOptions::default()).unwrap();
        while let Some(frame) = reader.read().unwrap() {
            writer.write(&frame).unwrap();
        }
        assert!(writer.frames() > 0);
        writer.finish().unwrap();
        assert!(std::fs::read(&b).unwrap() == file, "{name}");
    }
}
