//! `luz filter`, `luz tonemap`, `luz enhance`, `luz denoise`: an image or the frames of a video in, filtered ones out.

pub mod arguments;
mod denoise;
mod enhance;
mod failure;
mod filter;
mod guides;
mod job;
mod selection;
pub mod ticker;
mod tonemap;
pub mod values;

pub use denoise::run as denoise;
pub use enhance::run as enhance;
pub use filter::run as filter;
pub use tonemap::run as tonemap;
