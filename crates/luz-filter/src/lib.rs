//! The bilateral filter, exact and by Monte Carlo sampling, for photographs, HDR images, video and renderings.
//!
//! `BF[I](x) = 1/K(x) · Σ_{y∈Ω(x)} I(y) f_s(‖x−y‖) g_r(‖I(y)−I(x)‖)` smooths an image but keeps its edges. The exact filter
//! looks at all `k²` neighbours of a window. Seen as an expectation under the spatial Gaussian `f_s`, some multiple of `k`
//! samples suffice (Banterle, Corsini, Cignoni and Scopigno 2012, "A Low-Memory, Straightforward and Fast Bilateral Filter
//! Through Subsampling in Spatial Domain").
//!
//! ```
//! use luz_filter::BilateralFilter;
//! use luz_image::Image;
//!
//! let image = Image::new(32, 32, ["R", "G", "B"])?;
//! let filtered = BilateralFilter::new(4.0, 0.1).apply(&image, &[])?;
//! assert_eq!(filtered.image.data(), image.data());
//! # Ok::<(), luz_filter::FilterError>(())
//! ```

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
