//! Videos without help: `.y4m`, numbered frames, and what happens where `ffmpeg` is missing or dies.

use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use luz_image::video::{
    FrameRate, Matrix, Range, ReadVideoOptions, Siting, Subsampling, VideoError, VideoInfo, VideoReader, VideoWriter,
    WriteVideoOptions, YuvFormat,
};
use luz_image::{Image, ImageError};

/// Held by tests that start processes: a script that one of them writes would still be open in a process that another one
/// starts just then, and couldn't be run ("text file busy").
static STARTING: Mutex<()> = Mutex::new(());

fn starting() -> MutexGuard<'static, ()> {
    STARTING.lock().unwrap_or_else(PoisonError::into_inner)
}

const YUV: YuvFormat = YuvFormat {
    subsampling: Subsampling::Yuv420,
    siting: Siting::Left,
    bits: 10,
    range: Range::Limited,
    matrix: Matrix::Bt601,
};

/// The bytes of a `.y4m` file of 6 × 4 pixels.
fn y4m(frames: usize) -> Vec<u8> {
    let mut file = b"YUV4MPEG2 W6 H4 F30000:1001 Ip A4:3 C420p10 XCOLORRANGE=LIMITED XNOTE=a\n".to_vec();
    for frame in 0..frames {
        file.extend_from_slice(b"FRAME\n");
        let count = YUV.frame_bytes(6, 4).unwrap() / 2;
        file.extend((0..count).flat_map(|i| (((i * 37 + frame * 101) % 1024) as u16).to_le_bytes()));
    }
    file
}

fn open(path: &Path) -> Result<VideoReader, VideoError> {
    VideoReader::open(path, &ReadVideoOptions::default())
}

fn copy(from: &Path, to: &Path) -> Result<u64, VideoError> {
    let mut reader = open(from)?;
    let mut writer = VideoWriter::create(to, reader.info(), &WriteVideoOptions::default())?;
    while let Some(frame) = reader.read()? {
        writer.write(&frame)?;
    }
    let frames = writer.frames();
    writer.finish()?;
    Ok(frames)
}

fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn y4m_is_copied_bit_by_bit() {
    let folder = tempfile::tempdir().unwrap();
    let (a, b) = (folder.path().join("a.y4m"), folder.path().join("b.y4m"));
    for frames in [0, 1, 5] {
        std::fs::write(&a, y4m(frames)).unwrap();
        assert_eq!(copy(&a, &b).unwrap(), frames as u64);
        assert!(std::fs::read(&b).unwrap() == y4m(frames));
    }
    let info = open(&a).unwrap().info().clone();
    assert_eq!((info.width, info.height), (6, 4));
    assert_eq!(info.frame_rate, FrameRate { frames: 30000, seconds: 1001 });
    assert_eq!(info.pixel_aspect, Some([4, 3]));
    assert_eq!(info.yuv, Some(YUV));
}

#[test]
fn a_video_becomes_deep_images_and_back() {
    let folder = tempfile::tempdir().unwrap();
    let (a, b) = (folder.path().join("a.y4m"), folder.path().join("b.y4m"));
    std::fs::write(&a, y4m(3)).unwrap();
    let frames = folder.path().join("f_%03d.png");
    copy(&a, &frames).unwrap();
    assert_eq!(files(folder.path()), ["a.y4m", "f_001.png", "f_002.png", "f_003.png"]);
    // Ten bits need sixteen.
    let image = Image::read(folder.path().join("f_002.png")).unwrap();
    assert_eq!(image.metadata.sample_type, Some(luz_image::SampleType::Unsigned(16)));
    copy(&frames, &b).unwrap();
    let info = open(&b).unwrap().info().clone();
    let yuv = info.yuv.unwrap();
    assert_eq!((yuv.subsampling, yuv.bits, info.frame_rate.per_second()), (Subsampling::Yuv444, 8, 25.0));
    // Colours beyond R′G′B′ are lost in images; the noise of this file has many. Luma within the range agrees.
    let [a, b] = [&a, &b].map(|path| open(path).unwrap().map(Result::unwrap).collect::<Vec<_>>());
    let inside = |p: &[f32]| p.iter().all(|v| (0.0..=1.0).contains(v));
    let mut compared = 0;
    for (a, b) in a.iter().zip(&b) {
        for (p, q) in a.data().chunks(3).zip(b.data().chunks(3)).filter(|(p, _)| inside(p)) {
            assert!(p.iter().zip(q).all(|(p, q)| (p - q).abs() < 0.01), "{p:?} {q:?}");
            compared += 1;
        }
    }
    assert!(compared > 3, "{compared}");
}

#[test]
fn only_the_frames_that_are_wanted_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let a = folder.path().join("a.y4m");
    std::fs::write(&a, y4m(5)).unwrap();
    let all: Vec<Image> = open(&a).unwrap().map(Result::unwrap).collect();
    let some = |range| VideoReader::open(&a, &ReadVideoOptions { frames: Some(range), ..Default::default() });
    let part: Vec<Image> = some(2..=4).unwrap().map(Result::unwrap).collect();
    assert_eq!(part, all[1..4]);
    assert_eq!(some(4..=99).unwrap().count(), 2);
    assert!(some(9..=10).unwrap_err().to_string().contains("there are 5"));
}

#[test]
fn truncated_files_say_where_and_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (a, b) = (folder.path().join("a.y4m"), folder.path().join("b.y4m"));
    let whole = y4m(3);
    let frame = YUV.frame_bytes(6, 4).unwrap();
    let header = whole.len() - 3 * (frame + 6);
    // At the end of a frame it is just a shorter video.
    for end in (0..whole.len()).filter(|end| end.checked_sub(header).is_none_or(|end| end % (frame + 6) != 0)) {
        std::fs::write(&a, &whole[..end]).unwrap();
        copy(&a, &b).unwrap_err();
        assert_eq!(files(folder.path()), ["a.y4m"]);
    }
    std::fs::write(&a, &whole[..whole.len() - 10]).unwrap();
    let error = copy(&a, &b).unwrap_err().to_string();
    assert!(error.contains("frame 3") && error.contains(&format!("{} of its {frame} bytes", frame - 10)), "{error}");
    // After an error there is nothing more.
    let mut reader = open(&a).unwrap();
    assert!(reader.by_ref().any(|frame| frame.is_err()));
    assert!(reader.read().unwrap().is_none());
}

#[test]
fn unbelievable_and_foreign_files_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let a = folder.path().join("a.y4m");
    for (text, word) in [
        (&b"YUV4MPEG2 W4000000000 H4000000000 C420\nFRAME\n"[..], "4000000000×4000000000"),
        (b"YUV4MPEG2 W60000 H60000 C420\nFRAME\n", "60000×60000"),
        (b"\x89PNG\r\n\x1a\n", "YUV4MPEG2"),
        (b"", "empty"),
        (b"YUV4MPEG2 W2 H2 C444\nFRAMES\n", "FRAME"),
    ] {
        std::fs::write(&a, text).unwrap();
        let error = open(&a).and_then(|mut reader| reader.read()).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
    assert!(matches!(open(Path::new("a.xyz")), Err(VideoError::UnknownName { .. })));
    assert!(matches!(open(&folder.path().join("none.y4m")), Err(VideoError::Open { .. })));
}

#[test]
fn frames_must_be_there_and_alike() {
    let folder = tempfile::tempdir().unwrap();
    let pattern = folder.path().join("f%d.png");
    let image = |width| Image::new(width, 2, ["R", "G", "B"]).unwrap();
    for (number, width) in [(3, 4), (4, 4), (5, 6)] {
        image(width).write(folder.path().join(format!("f{number}.png"))).unwrap();
    }
    let mut reader = open(&pattern).unwrap();
    assert_eq!((reader.info().frames, reader.info().first_number), (Some(3), Some(3)));
    assert!(reader.read().is_ok() && reader.read().is_ok());
    let error = reader.read().unwrap_err().to_string();
    assert!(error.contains("f5.png") && error.contains("6×2") && error.contains("4×2"), "{error}");
    std::fs::write(folder.path().join("f4.png"), b"\x89PNG\r\n\x1a\n").unwrap();
    assert!(open(&pattern).unwrap().any(|frame| frame.is_err_and(|e| e.to_string().contains("f4.png"))));
    // Writing another size than was said.
    let mut writer =
        VideoWriter::create(folder.path().join("a.y4m"), &VideoInfo::new(4, 2), &WriteVideoOptions::default()).unwrap();
    assert!(matches!(writer.write(&image(5)), Err(VideoError::FrameMismatch { .. })));
    drop(writer);
    let error = VideoWriter::create(folder.path().join("no/a.y4m"), &VideoInfo::new(4, 2), &Default::default());
    assert!(matches!(error, Err(VideoError::Image(ImageError::MissingFolder { .. }))));
    assert_eq!(files(folder.path()), ["f3.png", "f4.png", "f5.png"]);
}

#[test]
fn a_missing_ffmpeg_is_named_with_a_way_out() {
    let _alone = starting();
    let folder = tempfile::tempdir().unwrap();
    let a = folder.path().join("a.mp4");
    std::fs::write(&a, b"something").unwrap();
    let ffmpeg = folder.path().join("no-such-ffmpeg");
    let error = VideoReader::open(&a, &ReadVideoOptions { ffmpeg: ffmpeg.clone(), ..Default::default() }).unwrap_err();
    assert!(error.is_ffmpeg());
    for part in ["a.mp4", "no-such-ffmpeg", "not installed", "install ffmpeg", ".y4m", "frame_%04d.png"] {
        assert!(error.to_string().contains(part), "{error}");
    }
    let options = WriteVideoOptions { ffmpeg, ..Default::default() };
    let error = VideoWriter::create(folder.path().join("b.mp4"), &VideoInfo::new(4, 2), &options).unwrap_err();
    assert!(matches!(error, VideoError::FfmpegMissing { .. }));
    assert_eq!(files(folder.path()), ["a.mp4"]);
}

/// Scripts that stand in for ffmpeg.
#[cfg(unix)]
mod impostors {
    use super::*;
    use std::os::unix::fs::PermissionsExt;
    use std::path::PathBuf;

    fn script(folder: &Path, text: &str) -> PathBuf {
        let path = folder.join("ffmpeg");
        std::fs::write(&path, format!("#!/bin/sh\n{text}\n")).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
        path
    }

    #[test]
    fn dying_while_it_reads() {
        let _alone = starting();
        let folder = tempfile::tempdir().unwrap();
        let mp4 = folder.path().join("a.mp4");
        let data = folder.path().join("data");
        std::fs::write(&mp4, b"something").unwrap();
        let whole = y4m(3);
        for (text, bytes, words) in [
            ("cat data; exit 0", whole.len(), &[][..]),
            ("cat data; echo 'moov atom not found' >&2; exit 1", 0, &["before its first frame", "moov atom not found"]),
            ("cat data; exit 1", whole.len() - 20, &["within frame 3", "exit status: 1"]),
            ("cat data; kill -9 $$", whole.len() - 20, &["within frame 3", "signal: 9"]),
            ("cat data; exit 0", whole.len() - 20, &["within frame 3"]),
            ("cat data; echo 'corrupt' >&2; exit 1", whole.len(), &["after frame 3", "corrupt"]),
            // It says that something is missing, though it doesn't call that a failure.
            ("cat data; echo 'truncated' >&2", whole.len(), &["after frame 3", "truncated"]),
            ("exit 0", 0, &["before its first frame"]),
        ] {
            std::fs::write(&data, &whole[..bytes]).unwrap();
            let ffmpeg = script(folder.path(), &text.replace("data", &format!("'{}'", data.display())));
            let options = ReadVideoOptions { ffmpeg, ..Default::default() };
            let result: Result<Vec<Image>, VideoError> =
                VideoReader::open(&mp4, &options).and_then(|reader| reader.collect());
            match result {
                Ok(frames) => assert!(words.is_empty() && frames.len() == 3, "{text}"),
                Err(error) => {
                    assert!(error.is_ffmpeg() && !error.is_output() && !words.is_empty(), "{text}: {error}");
                    words.iter().for_each(|word| assert!(error.to_string().contains(word), "{text}: {error}"));
                }
            }
        }
    }

    #[test]
    fn dying_while_it_writes() {
        let _alone = starting();
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("b.mp4");
        let info = VideoInfo::new(640, 480);
        let frame = Image::new(640, 480, ["R", "G", "B"]).unwrap();
        // The last argument is the file to be written.
        for (text, words) in [
            ("for f; do :; done; cat > \"${f#file:}\"", &[][..]),
            ("exit 1", &["exit status: 1"]),
            ("echo 'Unknown encoder' >&2; exit 1", &["Unknown encoder"]),
            ("head -c 100000 > /dev/null; kill -9 $$", &["signal: 9"]),
            ("cat > /dev/null; echo 'disk full' >&2; exit 1", &["after 4 frames", "disk full"]),
        ] {
            let ffmpeg = script(folder.path(), text);
            let options = WriteVideoOptions { ffmpeg, ..Default::default() };
            let result = VideoWriter::create(&out, &info, &options).and_then(|mut writer| {
                for _ in 0..4 {
                    writer.write(&frame)?;
                }
                writer.finish()
            });
            match result {
                Ok(()) => {
                    assert!(words.is_empty(), "{text}");
                    let expected = 4 * (640 * 480 * 3 / 2 + 6);
                    assert!(std::fs::metadata(&out).unwrap().len() > expected);
                    std::fs::remove_file(&out).unwrap();
                }
                Err(error) => {
                    assert!(error.is_ffmpeg() && error.is_output() && !words.is_empty(), "{text}: {error}");
                    words.iter().for_each(|word| assert!(error.to_string().contains(word), "{text}: {error}"));
                }
            }
            assert_eq!(files(folder.path()), ["ffmpeg"], "{text}");
        }
    }

    #[test]
    fn leaving_early_ends_it() {
        let _alone = starting();
        let folder = tempfile::tempdir().unwrap();
        let ffmpeg = script(folder.path(), "echo $$ > \"$0.pid\"; exec sleep 60");
        let options = WriteVideoOptions { ffmpeg: ffmpeg.clone(), ..Default::default() };
        let writer = VideoWriter::create(folder.path().join("b.mp4"), &VideoInfo::new(4, 2), &options).unwrap();
        assert!(writer.temporary_path().unwrap().exists());
        let start = std::time::Instant::now();
        drop(writer);
        assert!(start.elapsed().as_secs() < 20);
        assert!(!files(folder.path()).iter().any(|name| name.contains("mp4") || name.starts_with(".luz")));
    }
}
