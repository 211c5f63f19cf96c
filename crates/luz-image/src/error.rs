//! What can go wrong with images and their files.

use std::io;
use std::path::PathBuf;

use crate::Format;

/// Why an image couldn't be read, written or made. The message names the file, the cause and a way out.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The file couldn't be opened or read.
    #[error("cannot read `{}`: {source}", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file's contents are of no known format, and its extension doesn't help.
    #[error(
        "cannot read {}: neither its contents nor its extension belong to a known image format ({})",
        named(path),
        Format::known_names()
    )]
    UnknownContents {
        /// The file; none for bytes in memory.
        path: Option<PathBuf>,
    },
    /// The file is damaged, ends early, or uses a feature that isn't supported.
    #[error("cannot read {} as {format}: {reason}", named(path))]
    Decode {
        /// The file; none for bytes in memory.
        path: Option<PathBuf>,
        /// The format it was taken for.
        format: Format,
        /// What is wrong.
        reason: String,
    },
    /// The image's declared size isn't believable or exceeds the reader's limit.
    #[error("cannot read {}: it claims {width}×{height} pixels with {channels} channels, {reason}", named(path))]
    TooLarge {
        /// The file; none for bytes in memory.
        path: Option<PathBuf>,
        /// The width that it claims, in pixels.
        width: u64,
        /// The height that it claims, in pixels.
        height: u64,
        /// The channels that it claims.
        channels: u64,
        /// Why that is too much.
        reason: String,
    },
    /// The name of a file to write has no extension of a known format.
    #[error("cannot write `{}`: {} is no known image format; use one of {}", path.display(), extension(path), Format::known_extensions())]
    UnknownExtension {
        /// The file.
        path: PathBuf,
    },
    /// The folder of a file to write doesn't exist.
    #[error("cannot write `{}`: there is no folder `{}`; create it first", path.display(), folder.display())]
    MissingFolder {
        /// The file.
        path: PathBuf,
        /// The folder.
        folder: PathBuf,
    },
    /// The file couldn't be written.
    #[error("cannot write `{}`: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The format can't hold this image.
    #[error("cannot write this image as {format}: {reason}")]
    Encode {
        /// The format.
        format: Format,
        /// What doesn't fit.
        reason: String,
    },
    /// A new image's sizes are zero, overflow, or don't fit its data.
    #[error("not an image: {0}")]
    Invalid(String),
    /// A channel was asked for that the image doesn't have.
    #[error("the image has no channel `{name}`; its channels are {}", known.join(", "))]
    NoSuchChannel {
        /// The channel.
        name: String,
        /// The channels there are.
        known: Vec<String>,
    },
    /// Two images that belong together differ in size or channels.
    #[error("the images don't match: {0}")]
    Mismatch(String),
}

/// A file's name in quotation marks, or what stands for it.
fn named(path: &Option<PathBuf>) -> String {
    match path {
        Some(path) => format!("`{}`", path.display()),
        None => "the image".to_owned(),
    }
}

/// A file's extension in quotation marks, or what to say where there is none.
fn extension(path: &std::path::Path) -> String {
    match path.extension() {
        Some(extension) => format!("`.{}`", extension.to_string_lossy()),
        None => "a name without extension".to_owned(),
    }
}

impl ImageError {
    /// The same error, about this file.
    pub(crate) fn with_path(mut self, file: &std::path::Path) -> Self {
        match &mut self {
            Self::UnknownContents { path } | Self::Decode { path, .. } | Self::TooLarge { path, .. } => {
                *path = Some(file.to_owned());
            }
            _ => {}
        }
        self
    }
}
