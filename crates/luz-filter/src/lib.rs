//! The bilateral filter, exact and by Monte Carlo sampling, for photographs, HDR images, video and renderings.
//!
//! `BF[I](x) = 1/K(x) · Σ_{y∈Ω(x)} I(y) f_s(‖x−y‖) g_r(‖I(y)−I(x)‖)` smooths an image but keeps its edges. The exact filter
//! looks at all `k²` neighbours of a window. Seen as an expectation under the spatial Gaussian `f_s`, some multiple of `k`
//! samples suffice (Banterle, Corsini, Cignoni and Scopigno 2012, "A Low-Memory, Straightforward and Fast Bilateral Filter
//! Through Subsampling in Spatial Domain").
//!
//! Tell [`BilateralFilter`] how wide the two Gaussians are and how good the result is to be:
//!
//! ```
//! use luz_filter::{BilateralFilter, Method};
//! use luz_image::Image;
//!
//! let image = Image::from_data(96, 96, ["R", "G", "B"], (0..96 * 96 * 3).map(|i| (i % 7) as f32 / 7.0).collect())?;
//! let mut filter = BilateralFilter::new(8.0, 0.1);
//! let exact = filter.apply(&image, &[])?;
//!
//! filter.method = Method::Auto { quality: 50.0 };
//! let filtered = filter.apply(&image, &[])?;
//! assert!(filtered.report.samples_per_pixel <= exact.report.samples_per_pixel);
//! # Ok::<(), luz_filter::FilterError>(())
//! ```
//!
//! * [`Method`]: [`Exact`](Method::Exact) is the definition. [`Sampled`](Method::Sampled) draws neighbours by one of several
//!   [strategies](Strategy), in 16 patterns that repeat every four columns and rows. [`Cosines`](Method::Cosines) takes time
//!   that doesn't depend on the window, for guides of one channel. [`Auto`](Method::Auto) reaches a quality in decibels.
//! * [`Range`]: the range Gaussian, of L2, L1 or CIELAB distances on linear, encoded or logarithmic values.
//! * [`Guide`]: other images that decide what is similar, each with its own width, even one for each pixel.
//! * [`VideoFilter`]: the same over time, frame by frame.
//!
//! Images may have any channels. Opacity is respected (see [`Alpha`]); pixels that aren't finite have no part in their
//! neighbours, stay as they are, and are counted in the [`Report`]. Results don't depend on the number of threads.

mod auto;
mod border;
mod cosines;
mod error;
mod filter;
mod method;
mod pattern;
mod plan;
mod range;
mod regression;
mod report;
mod run;
mod scale;
mod simd;
mod tile;
pub mod uses;
mod video;
mod worker;

pub use border::Border;
pub use error::FilterError;
pub use filter::{Alpha, BilateralFilter};
pub use method::{Density, Method, Precision, SampleCount, Sampling, Strategy};
pub use range::{Distance, Guide, Range, Scale};
pub use report::{Filtered, Progress, Report};
pub use simd::SimdLevel;
pub use video::{VideoFilter, VideoGuide};
