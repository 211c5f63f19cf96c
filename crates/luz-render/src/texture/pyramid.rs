//! An image at every scale, for filtered lookups (Williams 1983, "Pyramidal Parametrics").

use super::mapping::Coordinates;
use glam::{IVec2, Vec2};
use luz_image::Image;

/// What lies beyond the border of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// The image again.
    Repeat,
    /// Zero.
    Black,
    /// The nearest texel.
    Clamp,
    /// What is beyond the border of an equal-area octahedral map.
    OctahedralSphere,
}

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
    wrap: Wrap,
    filter: TexelFilter,
}

#[derive(Clone, Debug)]
struct Level<const N: usize> {
    width: i32,
    height: i32,
    texels: Vec<[f32; N]>,
}

impl<const N: usize> Level<N> {
    fn texel(&self, at: IVec2, wrap: Wrap) -> [f32; N] {
        let (mut x, mut y) = (at.x, at.y);
        match wrap {
            Wrap::Repeat => (x, y) = (x.rem_euclid(self.width), y.rem_euclid(self.height)),
            Wrap::Clamp => (x, y) = (x.clamp(0, self.width - 1), y.clamp(0, self.height - 1)),
            Wrap::Black => {
                if x < 0 || y < 0 || x >= self.width || y >= self.height {
                    return [0.0; N];
                }
            }
            Wrap::OctahedralSphere => {
                if x < 0 || x >= self.width {
                    x = if x < 0 { -1 - x } else { 2 * self.width - 1 - x };
                    y = self.height - 1 - y;
                }
                if y < 0 || y >= self.height {
                    x = self.width - 1 - x;
                    y = if y < 0 { -1 - y } else { 2 * self.height - 1 - y };
                }
                (x, y) = (x.clamp(0, self.width - 1), y.clamp(0, self.height - 1));
            }
        }
        self.texels[(y * self.width + x) as usize]
    }

    fn nearest(&self, st: Vec2, wrap: Wrap) -> [f32; N] {
        let at = st * Vec2::new(self.width as f32, self.height as f32);
        self.texel(at.floor().as_ivec2(), wrap)
    }

    fn bilinear(&self, st: Vec2, wrap: Wrap) -> [f32; N] {
        let at = st * Vec2::new(self.width as f32, self.height as f32) - 0.5;
        let corner = at.floor();
        let d = at - corner;
        let corner = corner.as_ivec2();
        let [a, b, c, e] = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| self.texel(corner + IVec2::new(x, y), wrap));
        std::array::from_fn(|k| {
            let top = a[k] + (b[k] - a[k]) * d.x;
            let bottom = c[k] + (e[k] - c[k]) * d.x;
            top + (bottom - top) * d.y
        })
    }

    /// Each texel the mean of the texels under it; odd sizes share the texels in between by area.
    fn half(&self) -> Self {
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let columns: Vec<_> = (0..width).map(|x| coverage(x, width, self.width)).collect();
        let mut texels = Vec::with_capacity((width * height) as usize);
        for y in 0..height {
            let rows = coverage(y, height, self.height);
            for column in &columns {
                let (mut sum, mut total) = ([0.0f32; N], 0.0);
                for &(y, wy) in &rows {
                    for &(x, wx) in column {
                        let texel = self.texels[(y * self.width + x) as usize];
                        total += wx * wy;
                        for k in 0..N {
                            sum[k] += texel[k] * wx * wy;
                        }
                    }
                }
                texels.push(sum.map(|v| v / total));
            }
        }
        Self { width, height, texels }
    }
}

/// The source texels under texel `i` of `n`, out of `source`, with the share of each that it covers.
fn coverage(i: i32, n: i32, source: i32) -> Vec<(i32, f32)> {
    let scale = source as f32 / n as f32;
    let (from, to) = (i as f32 * scale, (i + 1) as f32 * scale);
    (from.floor() as i32..(to.ceil() as i32).min(source))
        .map(|x| (x, (to.min(x as f32 + 1.0) - from.max(x as f32)).max(0.0)))
        .filter(|&(_, weight)| weight > 1e-4)
        .collect()
}

impl<const N: usize> Pyramid<N> {
    /// Builds all levels over the first `N` of the channels named by `channels`, indices into the image's.
    pub fn new(image: &Image, channels: [usize; N], wrap: Wrap, filter: TexelFilter) -> Self {
        let (width, height) = (image.width() as i32, image.height() as i32);
        let stride = image.channels().len();
        let texels = image.data().chunks_exact(stride).map(|texel| channels.map(|c| texel[c])).collect();
        let mut levels = vec![Level { width, height, texels }];
        while let Some(last) = levels.last()
            && (last.width > 1 || last.height > 1)
        {
            let next = last.half();
            levels.push(next);
        }
        Self { levels, wrap, filter }
    }

    /// The filtered value; `(0, 0)` is the top left corner of the image, `(1, 1)` the bottom right one.
    pub fn lookup(&self, at: &Coordinates) -> [f32; N] {
        let last = self.levels.len() - 1;
        let width = 2.0 * at.dx.abs().max(at.dy.abs()).max_element();
        let level = last as f32 + width.max(1e-8).log2();
        if level >= last as f32 {
            return self.levels[last].texel(IVec2::ZERO, Wrap::Clamp);
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

    /// The mean over the whole image.
    pub fn mean(&self) -> [f32; N] {
        self.levels[self.levels.len() - 1].texel(IVec2::ZERO, Wrap::Clamp)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.levels.iter().map(|l| l.texels.len() * size_of::<[f32; N]>()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(width: u32, height: u32) -> Image {
        let data = (0..width * height).map(|i| (i % width) as f32 + 0.5).collect();
        Image::from_data(width, height, &["Y"], data)
    }

    fn at(st: Vec2, footprint: f32) -> Coordinates {
        Coordinates { st, dx: Vec2::new(footprint, 0.0), dy: Vec2::new(0.0, footprint) }
    }

    #[test]
    fn a_ramp_stays_a_ramp_at_every_level() {
        let pyramid = Pyramid::new(&ramp(64, 64), [0], Wrap::Clamp, TexelFilter::Trilinear);
        for footprint in [0.0, 0.01, 0.04, 0.1] {
            let [value] = pyramid.lookup(&at(Vec2::new(0.5, 0.3), footprint));
            assert!((value - 32.0).abs() < 1e-3, "{footprint}: {value}");
        }
    }

    #[test]
    fn every_level_keeps_the_mean_whatever_the_size() {
        for (width, height) in [(1, 1), (5, 3), (64, 1), (37, 91)] {
            let image = ramp(width, height);
            let pyramid = Pyramid::new(&image, [0], Wrap::Repeat, TexelFilter::Bilinear);
            assert!((pyramid.mean()[0] - width as f32 / 2.0).abs() < 1e-3 * width as f32, "{width}×{height}");
        }
    }

    #[test]
    fn borders_do_as_they_are_told() {
        let image = ramp(4, 4);
        let value =
            |wrap, x: f32| Pyramid::new(&image, [0], wrap, TexelFilter::Point).lookup(&at(Vec2::new(x, 0.5), 0.0))[0];
        assert_eq!([value(Wrap::Repeat, 1.1), value(Wrap::Black, 1.1), value(Wrap::Clamp, 1.1)], [0.5, 0.0, 3.5]);
    }
}
