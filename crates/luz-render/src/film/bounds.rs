//! Rectangles of pixels.

use serde::{Deserialize, Serialize};

/// A rectangle of pixels: `x0 ≤ x < x1`, `y0 ≤ y < y1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PixelBounds {
    /// Left edge, included.
    pub x0: u32,
    /// Top edge, included.
    pub y0: u32,
    /// Right edge, excluded.
    pub x1: u32,
    /// Bottom edge, excluded.
    pub y1: u32,
}

impl PixelBounds {
    /// Columns.
    pub fn width(&self) -> u32 {
        self.x1 - self.x0
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.y1 - self.y0
    }

    /// Pixels.
    pub fn area(&self) -> usize {
        (self.width() as usize).saturating_mul(self.height() as usize)
    }
}
