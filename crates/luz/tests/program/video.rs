//! Videos through the commands that filter.

use super::support::Folder;
use luz::image::Image;
use luz::image::video::{ReadVideoOptions, VideoReader};

/// A video of 24 × 16 pixels, 4:2:0, with noise.
fn y4m(frames: usize) -> Vec<u8> {
    let mut file = b"YUV4MPEG2 W24 H16 F30000:1001 Ip A1:1 C420mpeg2 XCOLORRANGE=LIMITED\n".to_vec();
    let mut state = 7u32;
    for _ in 0..frames {
        file.extend_from_slice(b"FRAME\n");
        file.extend((0..24 * 16).map(|i| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            if i % 24 < 12 { 60 + (state >> 28) as u8 } else { 180 + (state >> 28) as u8 }
        }));
        file.extend([110; 12 * 8]);
        file.extend([140; 12 * 8]);
    }
    file
}

fn frames(folder: &Folder, name: &str) -> Vec<Image> {
    let reader = VideoReader::open(folder.path().join(name), &ReadVideoOptions::default()).unwrap();
    reader.map(Result::unwrap).collect()
}

/// The mean squared difference of neighbours in the left half.
fn roughness(image: &Image) -> f32 {
    (0..16)
        .flat_map(|y| (0..10).map(move |x| (x, y)))
        .map(|(x, y)| (image.pixel(x, y)[1] - image.pixel(x + 1, y)[1]).powi(2))
        .sum()
}

#[test]
fn a_video_that_is_left_alone_is_the_same_file() {
    let folder = Folder::new();
    folder.write("a.y4m", y4m(5));
    folder.run("filter a.y4m -o b.y4m -s 1 -r 1e-7 --method exact -q").ends_with(0);
    assert!(std::fs::read(folder.path().join("b.y4m")).unwrap() == y4m(5));
    let said = folder.run("filter a.y4m -o c.y4m -s 1 -r 1e-7 --sigma-temporal 1 --method exact --report r.json");
    assert!(said.ends_with(0).stdout.contains("5 frames"));
    assert!(std::fs::read(folder.path().join("c.y4m")).unwrap() == y4m(5));
    let report = folder.json("r.json");
    assert_eq!((report["frames"].as_u64(), report["window_frames"].as_u64()), (Some(5), Some(7)));
}

#[test]
fn time_smooths_more_than_space_alone() {
    let folder = Folder::new();
    folder.write("a.y4m", y4m(7));
    folder.run("filter a.y4m -o space.y4m -s 1 -r 0.2 -q").ends_with(0);
    folder.run("filter a.y4m -o time.y4m -s 1 -r 0.2 --sigma-temporal 2 -q").ends_with(0);
    folder.run("denoise a.y4m -o clean.y4m -q").ends_with(0);
    folder.run("enhance a.y4m -o rough.y4m -q").ends_with(0);
    let middle = |name: &str| roughness(&frames(&folder, name)[3]);
    let [input, space, time, clean, rough] = ["a.y4m", "space.y4m", "time.y4m", "clean.y4m", "rough.y4m"].map(middle);
    assert!(space < 0.5 * input && time < 0.6 * space, "{input} {space} {time}");
    assert!(clean < 0.3 * input && rough > 1.5 * input, "{input} {clean} {rough}");
    // The edge is still there.
    let frame = &frames(&folder, "time.y4m")[3];
    assert!(frame.pixel(18, 8)[1] - frame.pixel(5, 8)[1] > 0.4);
}

#[test]
fn numbered_frames_in_and_out() {
    let folder = Folder::new();
    folder.write("a.y4m", y4m(6));
    folder.run("filter a.y4m -o f_%03d.png -s 1 -r 1e-7 --method exact -q").ends_with(0);
    assert_eq!(folder.files().len(), 7);
    folder.run("filter f_%03d.png -o g_%02d.png -s 1 -r 0.2 --frames 3-5 -q").ends_with(0);
    let mut expected: Vec<String> = (3..=5).map(|i| format!("g_{i:02}.png")).collect();
    expected.extend((1..=6).map(|i| format!("f_{i:03}.png")));
    expected.push("a.y4m".to_owned());
    expected.sort();
    assert_eq!(folder.files(), expected);
    folder.run("filter f_%03d.png -o back.y4m -s 1 -r 0.2 --frame-rate 12.5 -q").ends_with(0);
    let reader = VideoReader::open(folder.path().join("back.y4m"), &ReadVideoOptions::default()).unwrap();
    assert_eq!(reader.info().frame_rate.per_second(), 12.5);
    std::fs::remove_file(folder.path().join("f_004.png")).unwrap();
    folder.run("filter f_%03d.png -o h.y4m -s 1 -r 0.2").ends_with(5).complains(&["f_004.png", "from 1 to 6"]);
    folder.run("filter none_%03d.png -o h.y4m -s 1 -r 0.2").ends_with(5).complains(&["none_%03d.png"]);
    folder.run("filter a.y4m -o a.y4m -s 1 -r 0.2").ends_with(2);
    folder.run("filter a.y4m -o no/h.y4m -s 1 -r 0.2").ends_with(4);
    assert!(!folder.files().contains(&"h.y4m".to_owned()));
}

#[test]
fn guides_of_videos() {
    let folder = Folder::new();
    folder.write("a.y4m", y4m(3));
    folder.write("short.y4m", y4m(2));
    folder.run("filter a.y4m -o plain.y4m -s 1 -r 0.2 --method exact -q").ends_with(0);
    folder.run("filter a.y4m -o same.y4m -s 1 -r 9 --guide a.y4m=0.2 --method exact -q").ends_with(0);
    assert!(
        std::fs::read(folder.path().join("plain.y4m")).unwrap()
            == std::fs::read(folder.path().join("same.y4m")).unwrap()
    );
    folder.run("filter a.y4m -o b.y4m -s 1 -r 9 --guide short.y4m=0.2").ends_with(5).complains(&["short.y4m", "fewer"]);
    assert!(!folder.files().contains(&"b.y4m".to_owned()));
}

#[test]
fn a_truncated_video_leaves_nothing() {
    let folder = Folder::new();
    let whole = y4m(4);
    folder.write("a.y4m", &whole[..whole.len() - 100]);
    for command in [
        "filter a.y4m -o b.y4m -s 1 -r 0.2",
        "filter a.y4m -o b.y4m -s 1 -r 0.2 --sigma-temporal 1",
        "denoise a.y4m -o b.y4m",
    ] {
        folder.run(command).ends_with(5).complains(&["a.y4m", "frame 4", "truncated"]);
        assert_eq!(folder.files(), ["a.y4m"]);
    }
}

#[test]
fn without_ffmpeg_there_is_a_word_and_a_code() {
    let folder = Folder::new();
    folder.write("a.y4m", y4m(2));
    folder.write("a.mp4", "anything");
    let environment = [("LUZ_FFMPEG", "/nowhere/ffmpeg")];
    for command in ["filter a.mp4 -o b.y4m -s 1 -r 0.2", "filter a.y4m -o b.mp4 -s 1 -r 0.2"] {
        let said = folder.run_with(command, &environment).ends_with(6);
        said.complains(&["/nowhere/ffmpeg", "install ffmpeg", ".y4m"]);
        assert_eq!(folder.files(), ["a.mp4", "a.y4m"]);
    }
}

#[cfg(unix)]
#[test]
fn an_ffmpeg_that_dies_leaves_nothing() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::new();
    folder.write("a.y4m", y4m(3));
    folder.write("a.mp4", y4m(3));
    let script = |text: &str| {
        // Run by a shell that reads it, so that it may be written while others start.
        let path = folder.write("ffmpeg", format!("#!/bin/sh\n{text}\n"));
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
        path.display().to_string()
    };
    let killed = script("head -c 800 a.mp4; kill -9 $$");
    let said = folder.run_with("filter a.mp4 -o b.y4m -s 1 -r 0.2", &[("LUZ_FFMPEG", &killed)]).ends_with(6);
    said.complains(&["ffmpeg failed while reading `a.mp4`", "within frame 2"]);
    let full = script("cat > /dev/null; echo 'No space left on device' >&2; exit 1");
    let said = folder.run_with("filter a.y4m -o b.mp4 -s 1 -r 0.2", &[("LUZ_FFMPEG", &full)]).ends_with(6);
    said.complains(&["ffmpeg failed while writing `b.mp4`", "No space left"]);
    assert_eq!(folder.files(), ["a.mp4", "a.y4m", "ffmpeg"]);
}
