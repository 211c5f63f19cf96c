//! What can go wrong with videos.

use std::io;
use std::path::PathBuf;

use super::VideoKind;
use crate::ImageError;

/// Why a video couldn't be read or written. The message names the file, the place in it, the cause and a way out.
#[derive(Debug, thiserror::Error)]
pub enum VideoError {
    /// A frame couldn't be read, written or made.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The name stands for no kind of video.
    #[error("`{}` is no video by its name; known are {}", path.display(), VideoKind::known_names())]
    UnknownName {
        /// The file.
        path: PathBuf,
    },
    /// The file couldn't be opened or read.
    #[error("cannot read `{}`: {source}", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The contents aren't what the name says, are damaged, or use what isn't supported.
    #[error("cannot read the video `{}`: {reason}", path.display())]
    Decode {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        reason: String,
    },
    /// The file ends within a frame.
    #[error("the video `{}` ends early, within frame {frame}: {found} of its {expected} bytes are there; it may be truncated", path.display())]
    Truncated {
        /// The file.
        path: PathBuf,
        /// The frame's number, from 1.
        frame: u64,
        /// Bytes of the frame that were found.
        found: usize,
        /// Bytes that a frame has.
        expected: usize,
    },
    /// There are no frames that match.
    #[error("there are no frames `{}`{}", pattern.display(), range.as_ref().map_or(String::new(), |r| format!(" numbered {r}")))]
    NoFrames {
        /// The pattern of their names, or the file.
        pattern: PathBuf,
        /// The numbers that were asked for.
        range: Option<String>,
    },
    /// Numbered frames have a gap.
    #[error("the frame `{}` is missing: the numbers go from {first} to {last}", path.display())]
    MissingFrame {
        /// The first file that is missing.
        path: PathBuf,
        /// The smallest number.
        first: u64,
        /// The largest number.
        last: u64,
    },
    /// Frames differ in size or channels.
    #[error("frame {frame} has {found}, unlike those before, which have {expected}")]
    FrameMismatch {
        /// The frame's number or name.
        frame: String,
        /// Its size.
        found: String,
        /// The others' size.
        expected: String,
    },
    /// The `ffmpeg` program isn't there.
    #[error(
        "`{}` needs the program `{}`, which cannot be started: {reason}; install ffmpeg (https://ffmpeg.org), or use .y4m or \
         numbered frames like `frame_%04d.png`, which need no help", path.display(), program.display()
    )]
    FfmpegMissing {
        /// The video.
        path: PathBuf,
        /// The program that was looked for.
        program: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// The `ffmpeg` process failed or was killed.
    #[error("ffmpeg failed while {action} `{}`, {place}: {reason}", path.display())]
    Ffmpeg {
        /// The video.
        path: PathBuf,
        /// "reading" or "writing".
        action: &'static str,
        /// At which frame.
        place: String,
        /// What it said, or how it ended.
        reason: String,
    },
    /// The file couldn't be written.
    #[error("cannot write `{}`: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The kind of video can't hold these frames.
    #[error("cannot write the video `{}`: {reason}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// What doesn't fit.
        reason: String,
    },
}

impl VideoError {
    /// Is `ffmpeg` missing, or did it fail?
    pub fn is_ffmpeg(&self) -> bool {
        matches!(self, Self::FfmpegMissing { .. } | Self::Ffmpeg { .. })
    }

    /// Is it the output that is at fault?
    pub fn is_output(&self) -> bool {
        match self {
            Self::Write { .. } | Self::Encode { .. } => true,
            Self::Ffmpeg { action, .. } => *action == "writing",
            Self::Image(error) => matches!(
                error,
                ImageError::Write { .. }
                    | ImageError::Encode { .. }
                    | ImageError::MissingFolder { .. }
                    | ImageError::UnknownExtension { .. }
            ),
            _ => false,
        }
    }
}
