//! Distributions given by tables of non-negative values, which need not be normalised.
//!
//! Each has `sample`, the density on its own, and `invert`. What `sample` returns as density is, bit for bit, what the
//! density of the returned point is, and it is positive, unless all values are zero: such a table has density zero
//! everywhere and integral zero, and its samples are to be discarded.

mod cumulative;
mod discrete;
mod error;
mod piecewise_bilinear_2d;
mod piecewise_constant_1d;
mod piecewise_constant_2d;
mod polygon;
mod texel_tree;
mod windowed_2d;

pub use discrete::Discrete;
pub use error::DistributionError;
pub use piecewise_bilinear_2d::{PiecewiseBilinear2D, SquareMeasure};
pub use piecewise_constant_1d::PiecewiseConstant1D;
pub use piecewise_constant_2d::PiecewiseConstant2D;
pub use texel_tree::{Steering, TexelTree};
pub use windowed_2d::{Window, WindowedPiecewiseConstant2D};
