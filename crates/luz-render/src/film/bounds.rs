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
    /// Films of more pixels are taken for a slip of the keyboard.
    pub const MOST_PIXELS: usize = 1 << 30;

    /// Is this no window of a frame of such a size, or one that no film has?
    pub fn is_absurd(&self, [width, height]: [u32; 2]) -> bool {
        self.x0 >= self.x1
            || self.y0 >= self.y1
            || self.x1 > width
            || self.y1 > height
            || self.area() > Self::MOST_PIXELS
    }

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
