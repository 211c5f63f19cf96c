//! The importance of film positions: a coarse first image, by which the target density is divided.
//!
//! "Two-stage Metropolis" (Veach 1997, section 11.3.3): a chain that follows the luminance has few samples in the dark parts of a picture,
//! whose relative errors are large. Divided by a coarse image of the luminance, the density is about the same everywhere.

use crate::film::FilmWindow;
use glam::Vec2;

/// A positive function of film positions, constant within the cells of a grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Importance {
    window: FilmWindow,
    columns: u32,
    rows: u32,
    /// Row by row; one cell where all positions are alike.
    cells: Vec<f32>,
}

/// Where the first image is darker than this share of its mean, nothing is gained by looking even more often.
const DARKEST: f64 = 0.05;

impl Importance {
    /// All positions alike: one.
    pub fn uniform(window: FilmWindow) -> Self {
        Self { window, columns: 1, rows: 1, cells: vec![1.0] }
    }

    /// The importance at a film position, in pixels from the frame's top left corner; beyond the window, that at its edge.
    #[inline]
    pub fn at(&self, film: Vec2) -> f64 {
        if self.cells.len() == 1 {
            return f64::from(self.cells[0]);
        }
        f64::from(self.cells[cell_at(self.window, [self.columns, self.rows], film)])
    }

    /// From the sums of weights in each cell of a grid over a window: about the cells' luminance relative to its mean. Uniform if
    /// there is no light, or the numbers do not fit.
    pub fn of_sums(window: FilmWindow, [columns, rows]: [u32; 2], sums: &[f64]) -> Self {
        let total: f64 = sums.iter().sum();
        let count = columns as usize * rows as usize;
        if count == 0 || sums.len() != count || !(total > 0.0 && total.is_finite()) {
            return Self::uniform(window);
        }
        // Few samples make a noisy image: averaged over each cell's neighbours.
        let smooth = |cell: usize| {
            let (x, y) = (cell % columns as usize, cell / columns as usize);
            let (mut sum, mut weights) = (0.0, 0.0);
            for row in y.saturating_sub(1)..(y + 2).min(rows as usize) {
                for column in x.saturating_sub(1)..(x + 2).min(columns as usize) {
                    let weight = if row == y { 2.0 } else { 1.0 } * if column == x { 2.0 } else { 1.0 };
                    sum += weight * sums[row * columns as usize + column];
                    weights += weight;
                }
            }
            sum / weights
        };
        let mean = total / count as f64;
        let cells = (0..count).map(|cell| (smooth(cell) / mean).max(DARKEST) as f32).collect();
        Self { window, columns, rows, cells }
    }
}

/// The cell of a grid over a window that a film position lies in.
pub(crate) fn cell_at(window: FilmWindow, [columns, rows]: [u32; 2], film: Vec2) -> usize {
    let place = (film - window.min) / window.size();
    // A NaN becomes 0.
    let index = |place: f32, count: u32| ((place * count as f32) as usize).min(count.saturating_sub(1) as usize);
    index(place.y, rows) * columns as usize + index(place.x, columns)
}
