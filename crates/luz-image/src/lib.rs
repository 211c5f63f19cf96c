//! Float images, their file formats, tone mapping and image metrics.
//!
//! ```
//! use luz_image::{Image, Format, WriteOptions};
//!
//! let mut image = Image::new(4, 2, ["R", "G", "B"])?;
//! image.pixel_mut(0, 0).copy_from_slice(&[1.0, 0.5, 0.25]);
//! let file = image.encode(Format::Exr, &WriteOptions::default())?;
//! let back = Image::decode(&file, None, &Default::default())?;
//! assert_eq!(back.pixel(0, 0), [1.0, 0.5, 0.25]);
//! # Ok::<(), luz_image::ImageError>(())
//! ```
//!
//! Images are scene-referred and linear: files with encoded integers are decoded on reading and encoded on writing, through a
//! tone map. Who wants to change a file rather than to show a picture reads stored values ([`ReadOptions::stored`]) and writes
//! them back ([`WriteOptions::as_read`]): what was not changed comes back bit by bit, in the same depth, with its metadata.

mod error;
mod exr_attributes;
mod format;
mod image;
mod jpeg_quality;
mod metadata;
pub mod metrics;
mod png_chunks;
mod read;
pub mod tonemap;
pub mod video;
mod wrap;
mod write;

pub use error::ImageError;
pub use exr_attributes::ExrAttributes;
pub use format::Format;
pub use image::Image;
pub use luz_color::encoding::Encoding;
pub use metadata::{Chromaticities, Density, ImageMetadata, LengthUnit, Placement, SampleType};
pub use read::ReadOptions;
pub use tonemap::{ToneMap, ToneOperator};
pub use wrap::{MipFilter, WrapMode};
pub use write::{BitDepth, ExrPrecision, WriteOptions, check_folder, write_atomically};
