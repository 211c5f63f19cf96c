//! Video: sequences of frames, read and written one at a time.
//!
//! Three kinds, told apart by the name of the file ([`VideoKind`]): uncompressed `.y4m`; numbered image files, named by a
//! pattern like `frame_%04d.png`; and everything else, which an `ffmpeg` process decodes and encodes, connected by pipes.
//! Memory holds one frame, whatever the length of the video.
//!
//! A frame is an [`Image`](crate::Image) of stored values: R′, G′ and B′ (or Y′ alone) in `[0, 1]`, not linear light. Values
//! beyond that range, which Y′CbCr can express, are kept, so that a frame that isn't changed is written bit by bit as it was
//! read, from and to `.y4m` of any subsampling.

mod error;
mod ffmpeg;
mod frames;
mod reader;
mod writer;
mod y4m;
mod yuv;

pub use error::VideoError;
pub use frames::FramePattern;
pub use reader::{ReadVideoOptions, VideoReader};
pub use writer::{VideoWriter, WriteVideoOptions};
pub use yuv::{Matrix, Range, Siting, Subsampling, YuvFormat};

use std::fmt;
use std::path::Path;
use std::str::FromStr;

/// How a video is stored.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum VideoKind {
    /// YUV4MPEG2, uncompressed, read and written by luz itself.
    Y4m,
    /// Image files with numbers in their names.
    Frames(FramePattern),
    /// Left to an `ffmpeg` process.
    Ffmpeg,
}

/// File extensions of videos that `ffmpeg` is asked to read and write.
const FFMPEG_EXTENSIONS: [&str; 20] = [
    "mp4", "mov", "m4v", "mkv", "webm", "avi", "mpg", "mpeg", "m2v", "ts", "mts", "m2ts", "wmv", "flv", "ogv", "3gp",
    "mxf", "gif", "h264", "hevc",
];

impl VideoKind {
    /// The kind of video that a file's name stands for; none for images and unknown names.
    pub fn from_path(path: &Path) -> Option<Self> {
        if let Some(pattern) = FramePattern::parse(path) {
            return Some(Self::Frames(pattern));
        }
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "y4m" => Some(Self::Y4m),
            other if FFMPEG_EXTENSIONS.contains(&other) => Some(Self::Ffmpeg),
            _ => None,
        }
    }

    /// The names that stand for videos, for messages.
    pub fn known_names() -> String {
        let extensions: Vec<String> = FFMPEG_EXTENSIONS.iter().map(|e| format!(".{e}")).collect();
        format!(".y4m, numbered frames like `frame_%04d.png`, and with ffmpeg {}", extensions.join(", "))
    }
}

/// Frames per second, as a fraction in lowest terms or as the file says it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameRate {
    /// Frames …
    pub frames: u32,
    /// … in so many seconds.
    pub seconds: u32,
}

impl Default for FrameRate {
    fn default() -> Self {
        Self { frames: 25, seconds: 1 }
    }
}

impl FrameRate {
    /// Frames per second.
    pub fn per_second(self) -> f64 {
        f64::from(self.frames) / f64::from(self.seconds)
    }
}

impl fmt::Display for FrameRate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.seconds {
            1 => write!(f, "{}", self.frames),
            seconds => write!(f, "{}/{seconds}", self.frames),
        }
    }
}

impl FromStr for FrameRate {
    type Err = String;

    /// `25`, `30000/1001` or `23.976`.
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is no frame rate: 25, 30000/1001 or 23.976 would be");
        let (frames, seconds) = text.split_once(['/', ':']).unwrap_or((text, "1"));
        if let (Ok(frames @ 1..), Ok(seconds @ 1..)) = (frames.trim().parse(), seconds.trim().parse()) {
            return Ok(Self { frames, seconds });
        }
        match text.trim().parse::<f64>() {
            Ok(rate) if (1e-3..=1e5).contains(&rate) => {
                Ok(Self { frames: (rate * 1000.0).round() as u32, seconds: 1000 })
            }
            _ => Err(wrong()),
        }
    }
}

/// What a video says of all its frames.
#[derive(Clone, Debug, PartialEq)]
pub struct VideoInfo {
    /// Pixels from left to right.
    pub width: usize,
    /// Pixels from top to bottom.
    pub height: usize,
    /// Frames per second.
    pub frame_rate: FrameRate,
    /// How many frames there are; none where that is known only at the end.
    pub frames: Option<u64>,
    /// How Y′CbCr samples are stored; none for numbered images.
    pub yuv: Option<YuvFormat>,
    /// The width of a pixel to its height; none where nothing is said.
    pub pixel_aspect: Option<[u32; 2]>,
    /// How fields are interlaced, as `.y4m` says it: `p` for progressive, `t` or `b` for the field that comes first, `m` for
    /// mixed, `?` for unknown.
    pub interlacing: char,
    /// The number of the first frame of a numbered sequence.
    pub first_number: Option<u64>,
    /// The fields of a `.y4m` header that begin with `X`, but for those that [`VideoInfo::yuv`] holds.
    pub(crate) extensions: Vec<String>,
    /// The names that `ffmpeg` gives to matrix, primaries and transfer function; none for those that are unknown.
    pub(crate) color_names: [Option<String>; 3],
}

impl VideoInfo {
    /// A video of frames of this size: 25 progressive frames per second, nothing else known.
    pub fn new(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            frame_rate: FrameRate::default(),
            frames: None,
            yuv: None,
            pixel_aspect: None,
            interlacing: 'p',
            first_number: None,
            extensions: Vec::new(),
            color_names: [None, None, None],
        }
    }

    /// Do frames hold two fields, seen at different times?
    pub fn is_interlaced(&self) -> bool {
        matches!(self.interlacing, 't' | 'b' | 'm')
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_the_kind() {
        let kind = |name: &str| VideoKind::from_path(Path::new(name));
        assert_eq!(kind("a/b.Y4M"), Some(VideoKind::Y4m));
        assert_eq!(kind("clip.MP4"), Some(VideoKind::Ffmpeg));
        assert!(matches!(kind("f_%04d.png"), Some(VideoKind::Frames(_))));
        assert_eq!(kind("a.png"), None);
        assert_eq!(kind("a.xyz"), None);
        assert_eq!(kind("a"), None);
    }

    #[test]
    fn frame_rates() {
        assert_eq!("25".parse(), Ok(FrameRate { frames: 25, seconds: 1 }));
        assert_eq!("30000/1001".parse(), Ok(FrameRate { frames: 30000, seconds: 1001 }));
        assert_eq!("23.976".parse(), Ok(FrameRate { frames: 23976, seconds: 1000 }));
        for wrong in ["", "0", "25/0", "-1", "nan", "inf", "a"] {
            assert!(wrong.parse::<FrameRate>().is_err(), "{wrong}");
        }
    }
}
