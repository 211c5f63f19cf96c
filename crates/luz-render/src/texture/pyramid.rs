//! An image at every scale, for filtered lookups (Williams 1983, "Pyramidal Parametrics").

use super::mapping::Coordinates;
use glam::{IVec2, Vec2};
use luz_image::{Image, MipFilter, WrapMode};

/// How texels are combined.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TexelFilter {
    /// The nearest texel of the level that fits the footprint.
    Point,
    /// Four texels of that level.
    Bilinear,
    /// Four texels each of the two levels around it.
    Trilinear,
}

/// The levels of an image of `N` channels, each half as wide and high as the one before.
#[derive(Clone, Debug)]
pub struct Pyramid<const N: usize> {
    levels: Vec<Level<N>>,
    wrap: WrapMode,
    filter: TexelFilter,
}

#[derive(Clone, Debug)]
struct Level<const N: usize> {
    width: usize,
    height: usize,
    texels: Vec<[f32; N]>,
}

impl<const N: usize> Level<N> {
    fn texel(&self, at: IVec2, wrap: WrapMode) -> [f32; N] {
        match wrap.apply(i64::from(at.x), i64::from(at.y), self.width, self.height) {
            Some((x, y)) => self.texels[y * self.width + x],
            None => [0.0; N],
        }
    }

    fn nearest(&self, st: Vec2, wrap: WrapMode) -> [f32; N] {
        let at = st * Vec2::new(self.width as f32, self.height as f32);
        self.texel(at.floor().as_ivec2(), wrap)
    }

    /// The texels at a place, right of it, below it, and below that on the right.
    #[inline]
    fn square(&self, mut at: IVec2, wrap: WrapMode) -> [[f32; N]; 4] {
        let size = IVec2::new(self.width as i32, self.height as i32);
        if wrap == WrapMode::Repeat {
            at = IVec2::new(at.x.rem_euclid(size.x), at.y.rem_euclid(size.y));
        }
        // Most are inside.
        if at.x >= 0 && at.y >= 0 && at.x + 1 < size.x && at.y + 1 < size.y {
            let first = at.y as usize * self.width + at.x as usize;
            let (upper, lower) = (&self.texels[first..first + 2], &self.texels[first + self.width..][..2]);
            return [upper[0], upper[1], lower[0], lower[1]];
        }
        let texel = |x: i32, y: i32| self.texel(at + IVec2::new(x, y), wrap);
        [texel(0, 0), texel(1, 0), texel(0, 1), texel(1, 1)]
    }

    fn bilinear(&self, st: Vec2, wrap: WrapMode) -> [f32; N] {
        let at = st * Vec2::new(self.width as f32, self.height as f32) - 0.5;
        let corner = at.floor();
        let d = at - corner;
        let [a, b, c, e] = self.square(corner.as_ivec2(), wrap);
        std::array::from_fn(|k| {
            let top = a[k] + (b[k] - a[k]) * d.x;
            let bottom = c[k] + (e[k] - c[k]) * d.x;
            top + (bottom - top) * d.y
        })
    }
}

impl<const N: usize> Pyramid<N> {
    /// Builds all levels over the first `N` of the channels named by `channels`, indices into the image's.
    pub fn new(image: &Image, channels: [usize; N], wrap: WrapMode, filter: TexelFilter) -> Self {
        let levels = image
            .clone()
            .pyramid(MipFilter::Box, wrap)
            .iter()
            .map(|level| Level {
                width: level.width(),
                height: level.height(),
                texels: level
                    .data()
                    .chunks_exact(level.channel_count())
                    .map(|texel| channels.map(|c| texel[c]))
                    .collect(),
            })
            .collect();
        Self { levels, wrap, filter }
    }

    /// The filtered value; `(0, 0)` is the top left corner of the image, `(1, 1)` the bottom right one.
    pub fn lookup(&self, at: &Coordinates) -> [f32; N] {
        let last = self.levels.len() - 1;
        let width = 2.0 * at.dx.abs().max(at.dy.abs()).max_element();
        let level = last as f32 + width.max(1e-8).log2();
        if level >= last as f32 {
            return self.levels[last].texel(IVec2::ZERO, WrapMode::Clamp);
        }
        let below = level.max(0.0) as usize;
        match self.filter {
            TexelFilter::Point => self.levels[below].nearest(at.st, self.wrap),
            TexelFilter::Bilinear => self.levels[below].bilinear(at.st, self.wrap),
            TexelFilter::Trilinear => {
                let fine = self.levels[below].bilinear(at.st, self.wrap);
                if level <= 0.0 {
                    return fine;
                }
                let coarse = self.levels[below + 1].bilinear(at.st, self.wrap);
                let t = level - below as f32;
                std::array::from_fn(|k| fine[k] + (coarse[k] - fine[k]) * t)
            }
        }
    }

    /// The unfiltered image, interpolated bilinearly.
    pub fn finest(&self, st: Vec2) -> [f32; N] {
        self.levels[0].bilinear(st, self.wrap)
    }

    /// The texel of the unfiltered image that contains `st`.
    pub fn nearest(&self, st: Vec2) -> [f32; N] {
        self.levels[0].nearest(st, self.wrap)
    }

    /// The texels of the unfiltered image, row by row.
    pub fn texels(&self) -> &[[f32; N]] {
        &self.levels[0].texels
    }

    /// Width and height of the unfiltered image.
    pub fn size(&self) -> [usize; 2] {
        [self.levels[0].width, self.levels[0].height]
    }

    /// The mean over the whole image.
    pub fn mean(&self) -> [f32; N] {
        self.levels[self.levels.len() - 1].texel(IVec2::ZERO, WrapMode::Clamp)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.levels.iter().map(|l| l.texels.len() * size_of::<[f32; N]>()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(width: usize, height: usize) -> Image {
        let data = (0..width * height).map(|i| (i % width) as f32 + 0.5).collect();
        Image::from_data(width, height, ["Y"], data).expect("sizes fit")
    }

    fn at(st: Vec2, footprint: f32) -> Coordinates {
        Coordinates { st, dx: Vec2::new(footprint, 0.0), dy: Vec2::new(0.0, footprint) }
    }

    #[test]
    fn a_ramp_stays_a_ramp_at_every_level() {
        let pyramid = Pyramid::new(&ramp(64, 64), [0], WrapMode::Clamp, TexelFilter::Trilinear);
        for footprint in [0.0, 0.01, 0.04, 0.1] {
            let [value] = pyramid.lookup(&at(Vec2::new(0.5, 0.3), footprint));
            assert!((value - 32.0).abs() < 1e-3, "{footprint}: {value}");
        }
    }

    #[test]
    fn every_level_keeps_the_mean_whatever_the_size() {
        for (width, height) in [(1, 1), (5, 3), (64, 1), (37, 91)] {
            let image = ramp(width, height);
            let pyramid = Pyramid::new(&image, [0], WrapMode::Repeat, TexelFilter::Bilinear);
            assert!((pyramid.mean()[0] - width as f32 / 2.0).abs() < 1e-3 * width as f32, "{width}×{height}");
        }
    }

    #[test]
    fn borders_do_as_they_are_told() {
        let image = ramp(4, 4);
        let value = |wrap: WrapMode, x: f32| {
            Pyramid::new(&image, [0], wrap, TexelFilter::Point).lookup(&at(Vec2::new(x, 0.5), 0.0))[0]
        };
        assert_eq!(
            [value(WrapMode::Repeat, 1.1), value(WrapMode::Black, 1.1), value(WrapMode::Clamp, 1.1)],
            [0.5, 0.0, 3.5]
        );
    }
}
