//! Rectangles of pixels.

use glam::Vec2;
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

/// A rectangle of film positions, in pixels from the frame's top left corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmWindow {
    /// Left and top.
    pub min: Vec2,
    /// Right and bottom.
    pub max: Vec2,
}

impl FilmWindow {
    /// Width and height in pixels.
    #[inline]
    pub fn size(&self) -> Vec2 {
        self.max - self.min
    }

    /// In px².
    #[inline]
    pub fn area(&self) -> f32 {
        self.size().element_product()
    }

    /// The position that a point of the unit square is mapped to; its density is 1 / [`area`](Self::area) per px².
    #[inline]
    pub fn at(&self, u: Vec2) -> Vec2 {
        self.min + u * self.size()
    }

    /// Does a position lie within? (Right and bottom edges do not.)
    #[inline]
    pub fn contains(&self, film: Vec2) -> bool {
        film.cmpge(self.min).all() && film.cmplt(self.max).all()
    }
}
