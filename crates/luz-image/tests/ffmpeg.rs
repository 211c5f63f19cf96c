//! Decoding and encoding with the ffmpeg program: `cargo test -p luz-image --features ffmpeg-tests --test ffmpeg`.

use std::path::Path;
use std::process::Command;

use luz_image::video::{Matrix, Range, ReadVideoOptions, VideoInfo, VideoReader, VideoWriter, WriteVideoOptions};
use luz_image::{Image, metrics};

/// A picture that moves, smooth enough for lossy codecs.
fn frame(number: usize) -> Image {
    let data = (0..64 * 48)
        .flat_map(|i| {
            let (x, y, t) = ((i % 64) as f32, (i / 64) as f32, number as f32);
            [0.5 + 0.4 * ((x + 2.0 * t) * 0.1).sin(), 0.3 + 0.2 * (y * 0.15).cos(), 0.6 - 0.004 * y]
        })
        .collect();
    let mut image = Image::from_data(64, 48, ["R", "G", "B"], data).unwrap();
    image.metadata.encoding = Some(luz_image::Encoding::Linear);
    image
}

fn write(path: &Path, frames: usize) {
    let mut writer = VideoWriter::create(path, &VideoInfo::new(64, 48), &WriteVideoOptions::default()).unwrap();
    (0..frames).for_each(|i| writer.write(&frame(i)).unwrap());
    writer.finish().unwrap();
}

fn read(path: &Path) -> (VideoInfo, Vec<Image>) {
    let reader = VideoReader::open(path, &ReadVideoOptions::default()).unwrap();
    (reader.info().clone(), reader.map(Result::unwrap).collect())
}

#[test]
fn common_containers_keep_size_rate_length_and_look() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.mp4", "a.mkv", "a.avi", "a.mov", "a.webm"] {
        let path = folder.path().join(name);
        write(&path, 6);
        let (info, frames) = read(&path);
        assert_eq!((info.width, info.height, frames.len()), (64, 48, 6), "{name}");
        assert_eq!(info.frame_rate.per_second(), 25.0, "{name}");
        for (i, found) in frames.iter().enumerate() {
            let mean = metrics::compare(found, &frame(i), &Default::default()).unwrap().mean;
            assert!(mean.psnr > 33.0, "{name} frame {i}: {}", mean.psnr);
        }
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 5);
}

#[test]
fn a_lossless_video_is_read_as_it_was_made_whatever_its_format() {
    let folder = tempfile::tempdir().unwrap();
    for (format, range) in [
        ("yuv420p", Range::Limited),
        ("yuv422p", Range::Limited),
        ("yuv444p", Range::Limited),
        ("yuvj420p", Range::Full),
        ("yuv420p10le", Range::Limited),
        ("yuv444p12le", Range::Limited),
        ("gray", Range::Limited),
    ] {
        let (y4m, mkv) = (folder.path().join("a.y4m"), folder.path().join("a.mkv"));
        let source = ["-y", "-loglevel", "error", "-f", "lavfi", "-i", "testsrc2=size=64x48:rate=10:duration=0.5"];
        let made = |arguments: &[&str], path: &Path| {
            assert!(Command::new("ffmpeg").args(arguments).arg(path).status().unwrap().success(), "{format}");
        };
        let tagged = if range == Range::Full { "pc" } else { "tv" };
        made(&[&source[..], &["-pix_fmt", format, "-color_range", tagged, "-c:v", "ffv1"]].concat(), &mkv);
        made(&["-y", "-loglevel", "error", "-i", mkv.to_str().unwrap(), "-strict", "-1"], &y4m);
        let (ours, theirs) = (read(&y4m), read(&mkv));
        assert_eq!(ours.1.len(), 5, "{format}");
        assert!(ours.1 == theirs.1, "{format}");
        if format != "gray" {
            assert_eq!(ours.0.yuv.unwrap().range, range, "{format}");
        }
        // And ffmpeg reads what we write.
        let again = folder.path().join("b.y4m");
        let mut writer = VideoWriter::create(&again, &ours.0, &WriteVideoOptions::default()).unwrap();
        ours.1.iter().for_each(|frame| writer.write(frame).unwrap());
        writer.finish().unwrap();
        let sum = |path: &Path| {
            let output =
                Command::new("ffmpeg").args(["-loglevel", "error", "-i"]).arg(path).args(["-f", "md5", "-"]).output();
            String::from_utf8(output.unwrap().stdout).unwrap()
        };
        assert!(!sum(&y4m).is_empty() && sum(&y4m) == sum(&again), "{format}");
    }
}

#[test]
fn our_rgb_is_ffmpeg_s() {
    // Without subsampling, so that only the matrix and the range count.
    let folder = tempfile::tempdir().unwrap();
    let (y4m, png) = (folder.path().join("a.y4m"), folder.path().join("a.png"));
    let run = |arguments: &[&str]| {
        assert!(Command::new("ffmpeg").args(["-y", "-loglevel", "error"]).args(arguments).status().unwrap().success())
    };
    let source = "testsrc2=size=64x48:rate=1:duration=1";
    run(&["-f", "lavfi", "-i", source, "-pix_fmt", "yuv444p", y4m.to_str().unwrap()]);
    let filter = "scale=in_color_matrix=bt709:out_range=pc:flags=accurate_rnd+full_chroma_int";
    run(&["-i", y4m.to_str().unwrap(), "-vf", filter, "-pix_fmt", "rgb24", png.to_str().unwrap()]);
    let theirs = Image::read_with(&png, &luz_image::ReadOptions::stored()).unwrap();
    let worst = |matrix| {
        let options = ReadVideoOptions { matrix: Some(matrix), ..Default::default() };
        let ours = VideoReader::open(&y4m, &options).unwrap().next().unwrap().unwrap();
        let pairs = ours.data().iter().zip(theirs.data());
        pairs.map(|(a, b)| (a.clamp(0.0, 1.0) - b).abs()).fold(0.0, f32::max)
    };
    assert!(worst(Matrix::Bt709) <= 1.51 / 255.0, "{}", 255.0 * worst(Matrix::Bt709));
    assert!(worst(Matrix::Bt601) > 5.0 / 255.0);
}

#[test]
fn broken_files_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mkv");
    write(&path, 20);
    let whole = std::fs::read(&path).unwrap();
    for length in [0, 10, 200] {
        std::fs::write(&path, &whole[..length]).unwrap();
        let result =
            VideoReader::open(&path, &ReadVideoOptions::default()).and_then(|r| r.collect::<Result<Vec<_>, _>>());
        assert!(result.is_err_and(|e| e.is_ffmpeg()), "{length}");
    }
}

#[test]
fn sound_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let (a, b) = (folder.path().join("a.mkv"), folder.path().join("b.mp4"));
    let source =
        ["-f", "lavfi", "-i", "testsrc2=size=64x48:rate=10:duration=1", "-f", "lavfi", "-i", "sine=duration=1"];
    let made = Command::new("ffmpeg").args(["-y", "-loglevel", "error"]).args(source).arg(&a).status().unwrap();
    assert!(made.success());
    let mut reader = VideoReader::open(&a, &ReadVideoOptions::default()).unwrap();
    let options = WriteVideoOptions { sound: Some(a.clone()), ..Default::default() };
    let mut writer = VideoWriter::create(&b, reader.info(), &options).unwrap();
    while let Some(frame) = reader.read().unwrap() {
        writer.write(&frame).unwrap();
    }
    writer.finish().unwrap();
    let streams = Command::new("ffprobe")
        .args(["-loglevel", "error", "-show_entries", "stream=codec_type", "-of", "csv"])
        .arg(&b)
        .output();
    let streams = String::from_utf8(streams.unwrap().stdout).unwrap();
    assert!(streams.contains("video") && streams.contains("audio"), "{streams}");
}
