//! Parts of a frame that are rendered apart: on several machines, or one after the other.
//!
//! A frame is cut into tiles, and the tiles are dealt out to the shards like cards, so that each shard has some of everything. No
//! pixel is in two shards; so each pixel's sums run in the order of its samples, as if there were one shard, and putting
//! shards together is copying.

use super::adaptive::TILE;
use crate::film::PixelBounds;
use luz_sample::random::hash;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::Range;
use std::str::FromStr;

/// One of several parts of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Shard {
    /// Which, from 0.
    pub index: u32,
    /// Of how many.
    pub count: u32,
}

impl Default for Shard {
    fn default() -> Self {
        Self::WHOLE
    }
}

impl Shard {
    /// More shards than this are a slip of the keyboard.
    pub const MOST: u32 = 1 << 16;

    /// The whole frame.
    pub const WHOLE: Self = Self { index: 0, count: 1 };

    /// Is this the whole frame?
    pub fn is_whole(self) -> bool {
        self.count == 1
    }

    /// Is it a shard that may have so many pixels of a frame? False for numbers that no shard has, and for frames so large that a
    /// shard of them has more: each tile has at least one pixel, and each shard as many tiles as any other, or one less.
    pub(super) fn can_have(self, pixels: usize, bounds: PixelBounds) -> bool {
        let tiles = bounds.area() / (TILE * TILE) as usize;
        (1..=Self::MOST).contains(&self.count)
            && self.index < self.count
            && bounds.area() <= PixelBounds::MOST_PIXELS
            && tiles <= (self.count as usize).saturating_mul(pixels.saturating_add(1))
    }

    /// The pixels of this shard, as runs of neighbours in the order of the film's pixels.
    pub fn runs(self, bounds: PixelBounds) -> Vec<Range<usize>> {
        if self.is_whole() {
            return std::iter::once(0..bounds.area()).collect();
        }
        let is_ours = self.tiles(bounds);
        let width = bounds.width() as usize;
        let mut runs: Vec<Range<usize>> = Vec::new();
        for y in bounds.y0..bounds.y1 {
            let row = (y - bounds.y0) as usize * width;
            let mut x = bounds.x0;
            while x < bounds.x1 {
                let end = ((x / TILE + 1) * TILE).min(bounds.x1);
                if is_ours[tile_of(bounds, [x, y]) as usize] {
                    let run = row + (x - bounds.x0) as usize..row + (end - bounds.x0) as usize;
                    match runs.last_mut() {
                        Some(last) if last.end == run.start => last.end = run.end,
                        _ => runs.push(run),
                    }
                }
                x = end;
            }
        }
        runs
    }

    /// For each tile, whether it belongs to this shard.
    fn tiles(self, bounds: PixelBounds) -> Vec<bool> {
        let [columns, rows] = tile_counts(bounds);
        let mut order: Vec<u32> = (0..columns * rows).collect();
        order.sort_by_key(|&tile| (hash(0, u64::from(tile), 0, 0), tile));
        let mut is_ours = vec![false; order.len()];
        for (place, &tile) in order.iter().enumerate() {
            is_ours[tile as usize] = place as u32 % self.count == self.index;
        }
        is_ours
    }
}

fn tile_counts(bounds: PixelBounds) -> [u32; 2] {
    [(bounds.x0, bounds.x1), (bounds.y0, bounds.y1)].map(|(from, to)| to.div_ceil(TILE) - from / TILE)
}

/// The tile that a pixel of the frame lies in, numbered row by row over the tiles of `bounds`.
fn tile_of(bounds: PixelBounds, pixel: [u32; 2]) -> u32 {
    let (column, row) = (pixel[0] / TILE - bounds.x0 / TILE, pixel[1] / TILE - bounds.y0 / TILE);
    row * tile_counts(bounds)[0] + column
}

impl fmt::Display for Shard {
    /// As `2/4`: the second of four.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index + 1, self.count)
    }
}

impl FromStr for Shard {
    type Err = String;

    /// Reads `I/N` with `1 ≤ I ≤ N`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (index, count) = text.split_once('/').ok_or("expected I/N, 2/4 say for the second of four")?;
        let number =
            |text: &str| text.trim().parse::<u32>().map_err(|_| format!("`{text}` is not a number of a shard"));
        let (index, count) = (number(index)?, number(count)?);
        if !(1..=Self::MOST).contains(&count) || !(1..=count).contains(&index) {
            return Err(format!("shards are numbered from 1 to their number, which is at most {}", Self::MOST));
        }
        Ok(Self { index: index - 1, count })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_numbered_row_by_row() {
        let bounds = PixelBounds { x0: 5, y0: 20, x1: 40, y1: 50 };
        assert_eq!(tile_of(bounds, [5, 20]), 0);
        assert_eq!(tile_of(bounds, [39, 20]), 2);
        assert_eq!(tile_of(bounds, [15, 32]), 3);
        assert_eq!(tile_of(bounds, [39, 49]), 8);
    }

    #[test]
    fn shards_are_a_partition() {
        let bounds = PixelBounds { x0: 5, y0: 20, x1: 140, y1: 97 };
        for count in [1, 2, 3, 7, 64, 1000] {
            let mut owners = vec![0; bounds.area()];
            for index in 0..count {
                for run in (Shard { index, count }).runs(bounds) {
                    owners[run].iter_mut().for_each(|n| *n += 1);
                }
            }
            assert!(owners.iter().all(|&n| n == 1), "{count} shards");
        }
        let sizes: Vec<usize> =
            (0..4).map(|index| Shard { index, count: 4 }.runs(bounds).iter().map(Range::len).sum()).collect();
        assert!(sizes.iter().all(|&size| size > bounds.area() / 6), "{sizes:?}");
    }

    #[test]
    fn names_are_read_back() {
        assert_eq!("2/4".parse(), Ok(Shard { index: 1, count: 4 }));
        assert_eq!(Shard { index: 1, count: 4 }.to_string(), "2/4");
        for text in ["", "2", "0/4", "5/4", "1/0", "1/99999999", "a/b", "-1/2"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
