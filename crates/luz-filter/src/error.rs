//! What can be wrong with a request.

use luz_image::ImageError;

/// Why an image couldn't be filtered. The message says what was wrong and what would be right.
#[derive(Debug, thiserror::Error)]
pub enum FilterError {
    /// A width isn't a positive number within its domain.
    #[error("{name} must be a number from {least} to {most}, not {value}")]
    OutOfDomain {
        /// Which width or setting.
        name: &'static str,
        /// What it was.
        value: f64,
        /// The least that is possible.
        least: f64,
        /// The most that is possible.
        most: f64,
    },
    /// A guide, or its widths, has another size than the image.
    #[error(
        "guide {index} has {}×{} pixels, but the image has {}×{}; resize the guide first",
        guide[0], guide[1], image[0], image[1]
    )]
    GuideSize {
        /// Which guide, from 0.
        index: usize,
        /// Its width and height.
        guide: [usize; 2],
        /// Those of the image.
        image: [usize; 2],
    },
    /// A distance is between colours, but there are none.
    #[error("{distance} is a distance of colours, and needs the channels R, G and B; there are {}", channels.join(", "))]
    NoColor {
        /// The distance.
        distance: &'static str,
        /// The channels that exist.
        channels: Vec<String>,
    },
    /// The method can't do what is asked for.
    #[error("{method} can't filter this: {reason}")]
    Unsuitable {
        /// The method.
        method: &'static str,
        /// Why not, and what can.
        reason: String,
    },
    /// A frame of a video differs from the first one in size or channels, or in its number of guides.
    #[error("frame {frame} differs from the first one: {reason}")]
    FrameMismatch {
        /// Which frame, from 0.
        frame: usize,
        /// How.
        reason: String,
    },
    /// The window and the image together are too large to be worked on.
    #[error("a window of {window}×{window} pixels is too large for {channels} channels; use a smaller σ_s")]
    WindowTooLarge {
        /// The window's width in pixels.
        window: usize,
        /// Channels of image and guides together.
        channels: usize,
    },
    /// The result couldn't be made an image.
    #[error(transparent)]
    Image(#[from] ImageError),
}
