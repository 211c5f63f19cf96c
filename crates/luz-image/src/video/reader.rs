//! Reading videos, whatever their kind, frame by frame.

use std::fs::File;
use std::io::BufReader;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::process::ChildStdout;

use super::ffmpeg::{self, Probe, Process};
use super::y4m::{self, StreamError};
use super::{FramePattern, FrameRate, Matrix, VideoError, VideoInfo, VideoKind, YuvFormat};
use crate::{Image, ReadOptions};

/// How videos are read.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadVideoOptions {
    /// Which matrix made Y′CbCr. `None`: as the video says, and what is usual for its height where it says nothing.
    pub matrix: Option<Matrix>,
    /// Only these frames: the numbers in the names of image files, else counted from 1.
    pub frames: Option<RangeInclusive<u64>>,
    /// Frames per second, whatever the video says.
    pub frame_rate: Option<FrameRate>,
    /// The `ffmpeg` program.
    pub ffmpeg: PathBuf,
    /// Videos whose frames need more bytes than this in memory are refused.
    pub max_frame_bytes: u64,
}

impl Default for ReadVideoOptions {
    fn default() -> Self {
        Self { matrix: None, frames: None, frame_rate: None, ffmpeg: PathBuf::from("ffmpeg"), max_frame_bytes: 8 << 30 }
    }
}

/// The frames of a video, one after the other. After an error or the end there are no more.
pub struct VideoReader {
    path: PathBuf,
    info: VideoInfo,
    source: Source,
    /// The number of the next frame.
    next: u64,
    /// The last frame that is wanted.
    last: u64,
}

enum Source {
    Y4m {
        stream: Stream<BufReader<File>>,
        yuv: YuvFormat,
    },
    Ffmpeg {
        stream: Stream<BufReader<ChildStdout>>,
        yuv: YuvFormat,
        process: Box<Process>,
    },
    /// The first frame has been read already.
    Frames {
        pattern: FramePattern,
        max_bytes: u64,
        first: Option<Box<Image>>,
    },
    Ended,
}

/// Frames of bytes.
struct Stream<R> {
    input: R,
    buffer: Vec<u8>,
}

impl VideoReader {
    /// Opens a video; its name says the kind.
    ///
    /// # Errors
    /// When the name stands for no video, the file can't be read or isn't what it should be, frames are missing, or `ffmpeg`
    /// is needed but missing.
    pub fn open(path: impl AsRef<Path>, options: &ReadVideoOptions) -> Result<Self, VideoError> {
        let path = path.as_ref();
        let kind = VideoKind::from_path(path).ok_or_else(|| VideoError::UnknownName { path: path.to_owned() })?;
        let wanted = options.frames.clone().unwrap_or(1..=u64::MAX);
        let mut reader = match kind {
            VideoKind::Frames(pattern) => Self::open_frames(path, pattern, options)?,
            VideoKind::Y4m => {
                let file = File::open(path).map_err(|source| VideoError::Open { path: path.to_owned(), source })?;
                let mut input = BufReader::with_capacity(1 << 20, file);
                let info =
                    y4m::read_header(&mut input, options.matrix).map_err(|error| stream_error(error, path, 0, 0))?;
                let (buffer, yuv) = frame_buffer(path, &info, options)?;
                let source = Source::Y4m { stream: Stream { input, buffer }, yuv };
                Self { path: path.to_owned(), info, source, next: 1, last: *wanted.end() }
            }
            VideoKind::Ffmpeg => {
                let probe = Probe::of(&options.ffmpeg, path);
                let (mut process, mut input) = ffmpeg::decode(&options.ffmpeg, path, &probe)?;
                let mut info = match y4m::read_header(&mut input, options.matrix) {
                    Ok(info) => info,
                    Err(error) => {
                        drop(input);
                        process.finish("before its first frame".to_owned(), true)?;
                        return Err(stream_error(error, path, 0, 0));
                    }
                };
                probe.complete(&mut info, options.matrix);
                let (buffer, yuv) = frame_buffer(path, &info, options)?;
                info.yuv = Some(yuv);
                let source = Source::Ffmpeg { stream: Stream { input, buffer }, yuv, process: Box::new(process) };
                Self { path: path.to_owned(), info, source, next: 1, last: *wanted.end() }
            }
        };
        if let Some(rate) = options.frame_rate {
            reader.info.frame_rate = rate;
        }
        if !matches!(reader.source, Source::Frames { .. }) {
            reader.skip_to(*wanted.start())?;
            if options.frames.is_some() {
                let end = reader.info.frames.map_or(*wanted.end(), |all| all.min(*wanted.end()));
                reader.info.frames = (end < u64::MAX).then(|| (end + 1).saturating_sub(*wanted.start()));
            }
        }
        Ok(reader)
    }

    fn open_frames(path: &Path, pattern: FramePattern, options: &ReadVideoOptions) -> Result<Self, VideoError> {
        let numbers = pattern.numbers(options.frames.as_ref())?;
        let (next, last) = (*numbers.start(), *numbers.end());
        let max_bytes = options.max_frame_bytes;
        let first = read_frame_file(&pattern, next, max_bytes)?;
        let mut info = VideoInfo::new(first.width(), first.height());
        info.frames = Some(last - next + 1);
        info.first_number = Some(next);
        let source = Source::Frames { pattern, max_bytes, first: Some(Box::new(first)) };
        Ok(Self { path: path.to_owned(), info, source, next, last })
    }

    /// What is known of the video.
    pub fn info(&self) -> &VideoInfo {
        &self.info
    }

    /// The file, or the pattern of files.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The next frame; none at the end.
    ///
    /// # Errors
    /// When the video is truncated or damaged, a frame differs from the first in size, or `ffmpeg` fails.
    pub fn read(&mut self) -> Result<Option<Image>, VideoError> {
        let frame = self.advance(true);
        if !matches!(frame, Ok(Some(_))) {
            self.source = Source::Ended;
        }
        frame.map(Option::flatten)
    }

    /// The next frame, decoded if it is wanted; none at the end.
    fn advance(&mut self, is_wanted: bool) -> Result<Option<Option<Image>>, VideoError> {
        let number = self.next;
        if number > self.last {
            return Ok(None);
        }
        let (width, height) = (self.info.width, self.info.height);
        let decode = |yuv: &YuvFormat, bytes: &[u8]| {
            is_wanted.then(|| yuv.decode(width, height, bytes)).transpose().map_err(VideoError::from)
        };
        let frame = match &mut self.source {
            Source::Ended => return Ok(None),
            Source::Y4m { stream, yuv } => match y4m::read_frame(&mut stream.input, &mut stream.buffer, number) {
                Ok(true) => decode(yuv, &stream.buffer)?,
                Ok(false) => return Ok(None),
                Err(error) => return Err(stream_error(error, &self.path, number, stream.buffer.len())),
            },
            Source::Ffmpeg { stream, yuv, process } => {
                match y4m::read_frame(&mut stream.input, &mut stream.buffer, number) {
                    Ok(true) => decode(yuv, &stream.buffer)?,
                    Ok(false) => {
                        process.finish(format!("after frame {}", number - 1), false)?;
                        return Ok(None);
                    }
                    Err(error) => {
                        process.finish(format!("within frame {number}"), true)?;
                        return Err(stream_error(error, &self.path, number, stream.buffer.len()));
                    }
                }
            }
            Source::Frames { pattern, max_bytes, first } => {
                let frame = match first.take() {
                    Some(frame) => *frame,
                    None => read_frame_file(pattern, number, *max_bytes)?,
                };
                if (frame.width(), frame.height()) != (width, height) {
                    return Err(VideoError::FrameMismatch {
                        frame: pattern.path(number).display().to_string(),
                        found: format!("{}×{} pixels", frame.width(), frame.height()),
                        expected: format!("{width}×{height}"),
                    });
                }
                Some(frame)
            }
        };
        self.next += 1;
        Ok(Some(frame))
    }

    /// Passes over the frames before a number.
    fn skip_to(&mut self, number: u64) -> Result<(), VideoError> {
        while self.next < number {
            if self.advance(false)?.is_none() {
                let range = Some(format!("from {number} on; there are {}", self.next - 1));
                return Err(VideoError::NoFrames { pattern: self.path.clone(), range });
            }
        }
        Ok(())
    }
}

impl Iterator for VideoReader {
    type Item = Result<Image, VideoError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.read().transpose()
    }
}

impl std::fmt::Debug for VideoReader {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("VideoReader").field("path", &self.path).field("info", &self.info).finish_non_exhaustive()
    }
}

/// Memory for a frame's bytes, if it is believable.
fn frame_buffer(path: &Path, info: &VideoInfo, options: &ReadVideoOptions) -> Result<(Vec<u8>, YuvFormat), VideoError> {
    let decode = |reason: String| VideoError::Decode { path: path.to_owned(), reason };
    let yuv = info.yuv.ok_or_else(|| decode("its header says no colour space".to_owned()))?;
    let (width, height) = (info.width, info.height);
    // What the decoded frame needs, and the bytes that it is decoded from.
    let needed = (width as u64).checked_mul(height as u64).and_then(|pixels| pixels.checked_mul(4 * 3));
    let bytes = yuv.frame_bytes(width, height);
    match (needed, bytes) {
        (Some(needed), Some(bytes)) if needed <= options.max_frame_bytes => {
            let mut buffer = Vec::new();
            buffer.try_reserve_exact(bytes).map_err(|error| decode(error.to_string()))?;
            buffer.resize(bytes, 0);
            Ok((buffer, yuv))
        }
        _ => Err(decode(format!(
            "it claims {width}×{height} pixels, which need more than the {} bytes that are allowed",
            options.max_frame_bytes
        ))),
    }
}

fn read_frame_file(pattern: &FramePattern, number: u64, max_bytes: u64) -> Result<Image, VideoError> {
    let options = ReadOptions { max_bytes, ..ReadOptions::stored() };
    Ok(Image::read_with(pattern.path(number), &options)?)
}

fn stream_error(error: StreamError, path: &Path, frame: u64, expected: usize) -> VideoError {
    let path = path.to_owned();
    match error {
        StreamError::Io(source) => VideoError::Open { path, source },
        StreamError::Empty => VideoError::Decode { path, reason: "it is empty".to_owned() },
        StreamError::Damaged(reason) => VideoError::Decode { path, reason },
        StreamError::Truncated(found) => VideoError::Truncated { path, frame, found, expected },
    }
}
