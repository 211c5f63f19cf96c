//! Why a command that filters ends early, and with which exit code.

use crate::program::exit::Exit;
use crate::program::problems;
use luz::filter::FilterError;
use luz::image::ImageError;
use luz::image::video::VideoError;
use std::fmt;

/// Why a command ends early.
#[derive(Debug)]
pub enum Failure {
    /// The filter can't do what is asked for.
    Filter(FilterError),
    /// An image can't be read or written.
    Image(ImageError),
    /// A video can't be read or written.
    Video(VideoError),
    /// What was asked for makes no sense together.
    Usage(String),
    /// The inputs don't belong together, or lack what is needed.
    Input(String),
}

impl Failure {
    /// Says it, and gives the exit code.
    pub fn report(&self) -> Exit {
        problems::error(&self.to_string());
        match self {
            Self::Usage(_) => Exit::Usage,
            Self::Filter(
                FilterError::OutOfDomain { .. } | FilterError::Unsuitable { .. } | FilterError::WindowTooLarge { .. },
            ) => Exit::Usage,
            Self::Filter(_) | Self::Input(_) => Exit::Image,
            Self::Image(error) => image_exit(error),
            Self::Video(error) if error.is_ffmpeg() => Exit::Ffmpeg,
            Self::Video(error) if error.is_output() => Exit::Output,
            Self::Video(VideoError::Image(error)) => image_exit(error),
            Self::Video(_) => Exit::Image,
        }
    }
}

fn image_exit(error: &ImageError) -> Exit {
    match error {
        ImageError::Write { .. }
        | ImageError::Encode { .. }
        | ImageError::MissingFolder { .. }
        | ImageError::UnknownExtension { .. } => Exit::Output,
        _ => Exit::Image,
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Filter(error) => error.fmt(f),
            Self::Image(error) => error.fmt(f),
            Self::Video(error) => error.fmt(f),
            Self::Usage(text) | Self::Input(text) => f.write_str(text),
        }
    }
}

impl From<FilterError> for Failure {
    fn from(error: FilterError) -> Self {
        Self::Filter(error)
    }
}

impl From<ImageError> for Failure {
    fn from(error: ImageError) -> Self {
        Self::Image(error)
    }
}

impl From<VideoError> for Failure {
    fn from(error: VideoError) -> Self {
        Self::Video(error)
    }
}
