//! Writing videos, whatever their kind, frame by frame.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::ChildStdin;

use tempfile::NamedTempFile;

use super::ffmpeg::{self, Process};
use super::{FramePattern, Matrix, Range, Siting, Subsampling, VideoError, VideoInfo, VideoKind, YuvFormat, y4m};
use crate::{Image, SampleType, WriteOptions, check_folder};

/// How videos are written.
#[derive(Clone, Debug, PartialEq)]
pub struct WriteVideoOptions {
    /// How Y′CbCr samples are stored. `None`: as in the video that was read; else 4:4:4 of eight bits in `.y4m` and 4:2:0 with
    /// `ffmpeg`, as most players want it.
    pub yuv: Option<YuvFormat>,
    /// The file whose sound goes into the new one, where both are `ffmpeg`'s.
    pub sound: Option<PathBuf>,
    /// The `ffmpeg` program.
    pub ffmpeg: PathBuf,
}

impl Default for WriteVideoOptions {
    fn default() -> Self {
        Self { yuv: None, sound: None, ffmpeg: PathBuf::from("ffmpeg") }
    }
}

/// A video that is being written. [`VideoWriter::finish`] completes it; if it is dropped before that, there is no file, and
/// one that had its name stays as it was. Numbered frames are files of their own: each is complete or not there, and those that
/// were written stay.
pub struct VideoWriter {
    path: PathBuf,
    info: VideoInfo,
    target: Target,
    frames: u64,
}

enum Target {
    Y4m { file: BufWriter<NamedTempFile>, yuv: YuvFormat },
    Ffmpeg { input: Option<BufWriter<ChildStdin>>, yuv: YuvFormat, file: NamedTempFile, process: Process },
    Frames { pattern: FramePattern, number: u64 },
}

impl VideoWriter {
    /// Begins a video of frames like those that the information describes; its name says the kind.
    ///
    /// # Errors
    /// When the name stands for no video, its folder is missing or takes no file, or `ffmpeg` is needed but missing.
    pub fn create(path: impl AsRef<Path>, info: &VideoInfo, options: &WriteVideoOptions) -> Result<Self, VideoError> {
        let path = path.as_ref();
        let kind = VideoKind::from_path(path).ok_or_else(|| VideoError::UnknownName { path: path.to_owned() })?;
        check_folder(path)?;
        let yuv = options.yuv.or(info.yuv);
        let temporary = |suffix: &str| temporary_file(path, suffix);
        let target = match kind {
            VideoKind::Frames(pattern) => Target::Frames { pattern, number: info.first_number.unwrap_or(1) },
            VideoKind::Y4m => {
                let yuv = yuv.unwrap_or_else(|| default_format(info, Subsampling::Yuv444));
                let mut file = BufWriter::with_capacity(1 << 20, temporary(".part")?);
                y4m::write_header(&mut file, info, &yuv).map_err(|source| write_error(path, source))?;
                Target::Y4m { file, yuv }
            }
            VideoKind::Ffmpeg => {
                let yuv = yuv.unwrap_or_else(|| default_format(info, Subsampling::Yuv420));
                if yuv.subsampling == Subsampling::Yuv420 && (info.width % 2 == 1 || info.height % 2 == 1) {
                    let reason = format!(
                        "4:2:0 video has no odd sizes such as {}×{}; write .y4m or numbered frames",
                        info.width, info.height
                    );
                    return Err(VideoError::Encode { path: path.to_owned(), reason });
                }
                // ffmpeg tells the container from the name.
                let extension = path.extension().map(|e| format!(".{}", e.to_string_lossy())).unwrap_or_default();
                let file = temporary(&extension)?;
                let sound =
                    options.sound.as_deref().filter(|sound| VideoKind::from_path(sound) == Some(VideoKind::Ffmpeg));
                let (process, input) = ffmpeg::encode(&options.ffmpeg, (path, file.path()), sound, info, &yuv)?;
                let mut input = BufWriter::with_capacity(1 << 20, input);
                // If this fails, ffmpeg has ended, and the first frame tells why.
                let _ = y4m::write_header(&mut input, info, &yuv);
                Target::Ffmpeg { input: Some(input), yuv, file, process }
            }
        };
        Ok(Self { path: path.to_owned(), info: info.clone(), target, frames: 0 })
    }

    /// The file that is written to until the video is complete; none for numbered frames. Who ends the program in between is
    /// to remove it.
    pub fn temporary_path(&self) -> Option<&Path> {
        match &self.target {
            Target::Y4m { file, .. } => Some(file.get_ref().path()),
            Target::Ffmpeg { file, .. } => Some(file.path()),
            Target::Frames { .. } => None,
        }
    }

    /// How many frames have been written.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Writes the next frame: stored values, as [`VideoReader`](super::VideoReader) gives them. Image files keep the depth and
    /// the metadata that the frame was read with.
    ///
    /// # Errors
    /// When the frame is of another size or has no colour, the file can't be written, or `ffmpeg` has ended.
    pub fn write(&mut self, frame: &Image) -> Result<(), VideoError> {
        let number = self.frames + 1;
        if (frame.width(), frame.height()) != (self.info.width, self.info.height) {
            return Err(VideoError::FrameMismatch {
                frame: number.to_string(),
                found: format!("{}×{} pixels", frame.width(), frame.height()),
                expected: format!("{}×{}", self.info.width, self.info.height),
            });
        }
        match &mut self.target {
            Target::Y4m { file, yuv } => {
                let bytes = yuv.encode(frame)?;
                y4m::write_frame(file, &bytes).map_err(|source| write_error(&self.path, source))?;
            }
            Target::Ffmpeg { input, yuv, process, .. } => {
                let bytes = yuv.encode(frame)?;
                let Some(pipe) = input.as_mut() else {
                    return process.finish(format!("at frame {number}"), true);
                };
                if y4m::write_frame(pipe, &bytes).and_then(|()| pipe.flush()).is_err() {
                    // What is left in the buffer has nowhere to go.
                    if let Some(pipe) = input.take() {
                        drop(pipe.into_parts());
                    }
                    return process.finish(format!("at frame {number}"), true);
                }
            }
            Target::Frames { pattern, number } => {
                let mut options = WriteOptions::as_read(frame, pattern.format());
                if frame.metadata.sample_type.is_none() {
                    options.encoding = frame.metadata.encoding;
                }
                let mut decoded;
                let mut written = frame;
                // Stored values are light only after decoding.
                if pattern.format().is_float() && matches!(frame.metadata.sample_type, Some(SampleType::Unsigned(_))) {
                    decoded = frame.clone();
                    decoded.decode_stored();
                    written = &decoded;
                }
                written.write_with(pattern.path(*number), &options)?;
                *number += 1;
            }
        }
        self.frames = number;
        Ok(())
    }

    /// Completes the video: now there is a file of its name.
    ///
    /// # Errors
    /// When the last bytes can't be written, `ffmpeg` fails, or the file can't get its name.
    pub fn finish(self) -> Result<(), VideoError> {
        let path = self.path;
        let frames = self.frames;
        let persist = |file: NamedTempFile| match file.persist(&path) {
            Ok(_) => Ok(()),
            Err(error) => Err(write_error(&path, error.error)),
        };
        match self.target {
            Target::Y4m { file, .. } => {
                persist(file.into_inner().map_err(|error| write_error(&path, error.into_error()))?)
            }
            Target::Ffmpeg { mut input, file, mut process, .. } => {
                let is_broken = input.as_mut().is_none_or(|pipe| pipe.flush().is_err());
                if let Some(pipe) = input.take() {
                    // Closed, so that ffmpeg sees the end.
                    drop(pipe.into_parts());
                }
                process.finish(format!("after {frames} frames"), is_broken)?;
                persist(file)
            }
            Target::Frames { .. } => Ok(()),
        }
    }
}

impl std::fmt::Debug for VideoWriter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("VideoWriter").field("path", &self.path).field("frames", &self.frames).finish_non_exhaustive()
    }
}

fn write_error(path: &Path, source: io::Error) -> VideoError {
    VideoError::Write { path: path.to_owned(), source }
}

/// An empty file in the folder of another, with the permissions of any new file.
fn temporary_file(path: &Path, suffix: &str) -> Result<NamedTempFile, VideoError> {
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    builder.prefix(".luz-").suffix(suffix);
    #[cfg(unix)]
    let permissions = {
        use std::os::unix::fs::PermissionsExt;
        std::fs::Permissions::from_mode(0o666)
    };
    #[cfg(unix)]
    builder.permissions(permissions);
    builder.tempfile_in(folder).map_err(|source| write_error(path, source))
}

/// How frames that were never Y′CbCr are stored.
fn default_format(info: &VideoInfo, subsampling: Subsampling) -> YuvFormat {
    YuvFormat { subsampling, siting: Siting::Left, bits: 8, range: Range::Limited, matrix: Matrix::usual(info.height) }
}
