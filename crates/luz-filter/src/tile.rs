//! A part of the image with all that its pixels look at, as planes.

use crate::Scale;
use crate::plan::{Content, Frame, LARGEST, Opacity, Plan, Source};
use crate::simd::RowJob;

/// Marks excluded pixels in the first plane of the first guide: so far from everything that nothing weighs anything.
const EXCLUDED: f32 = 1e18;

/// How the samples of a tile are arranged.
///
/// Each plane is cut into `phases²` smaller ones of every `phases`-th column of every `phases`-th row, so that pixels with
/// the same pattern of neighbours lie next to each other, and so do their neighbours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Layout {
    /// The most pixels of a tile that are filtered along each axis; multiples of the phases.
    pub width: usize,
    pub height: usize,
    pub phases: usize,
    /// How far a tile reaches beyond the pixels that are filtered; a multiple of the phases, at least the radius.
    pub margin: usize,
    /// Samples from one row of a phase to the next.
    pub stride: usize,
    pub phase_size: usize,
    pub plane_size: usize,
    pub frame_size: usize,
    pub frames: usize,
}

impl Layout {
    /// For tiles of at most `width` × `height` filtered pixels; none if that is more than can be addressed.
    pub fn new(plan: &Plan<'_>, phases: usize, width: usize, height: usize) -> Option<Self> {
        let margin = plan.window.radius.next_multiple_of(phases);
        let (width, height) = (width.next_multiple_of(phases), height.next_multiple_of(phases));
        let stride = (width + 2 * margin) / phases;
        let phase_size = stride.checked_mul((height + 2 * margin) / phases)?;
        let plane_size = phase_size.checked_mul(phases * phases)?;
        let frame_size = plane_size.checked_mul(plan.plane_count)?;
        let frames = 2 * plan.window.frame_radius + 1;
        let layout = Self { width, height, phases, margin, stride, phase_size, plane_size, frame_size, frames };
        (layout.samples()? <= i32::MAX as usize / 2).then_some(layout)
    }

    /// The samples of a tile, with some to spare at the end: rows are read in whole blocks.
    fn samples(&self) -> Option<usize> {
        self.frame_size.checked_mul(self.frames)?.checked_add(2 * RowJob::BLOCK)
    }

    /// The bytes of a tile and what it needs for loading.
    pub fn bytes(&self, plan: &Plan<'_>) -> usize {
        let line = (self.width + 2 * self.margin) * (4 * plan.widest_source() + 1);
        let sample = if plan.precision == crate::Precision::Half { 6 } else { 4 };
        self.samples().unwrap_or(usize::MAX / 8).saturating_mul(sample).saturating_add(line)
    }

    /// Where the sample of column `x` and row `y` of the tile, margins included, is in its plane.
    #[inline]
    pub fn index(&self, x: usize, y: usize) -> usize {
        let phase = (y % self.phases) * self.phases + x % self.phases;
        phase * self.phase_size + (y / self.phases) * self.stride + x / self.phases
    }

    /// How far a neighbour's sample is from that of a pixel whose column and row have the remainders `phase`.
    pub fn offset(&self, phase: [usize; 2], [x, y, t]: [i32; 3]) -> i32 {
        let p = self.phases as i32;
        let (x, y) = (phase[0] as i32 + x, phase[1] as i32 + y);
        let from = phase[1] * self.phases + phase[0];
        let to = (y.rem_euclid(p) * p + x.rem_euclid(p)) as i64;
        let within = (to - from as i64) * self.phase_size as i64
            + i64::from(y.div_euclid(p)) * self.stride as i64
            + i64::from(x.div_euclid(p));
        (within + i64::from(t) * self.frame_size as i64) as i32
    }
}

/// The pixels of a tile that are filtered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Area {
    pub x: usize,
    pub y: usize,
    pub width: usize,
    pub height: usize,
}

/// Samples, and memory for loading them.
#[derive(Debug)]
pub(crate) struct Tile {
    pub layout: Layout,
    pub planes: Vec<f32>,
    /// Whether a pixel of the image was excluded.
    pub has_excluded: bool,
    /// The largest absolute sample that was loaded; infinite where something was excluded.
    pub largest: f32,
    /// A row of a source as planes, from the first column inside the image to the last.
    line: Vec<f32>,
    bad: Vec<bool>,
}

impl Tile {
    pub fn new(layout: Layout, plan: &Plan<'_>) -> Self {
        let columns = layout.width + 2 * layout.margin;
        Self {
            layout,
            planes: vec![0.0; layout.samples().unwrap_or(0)],
            has_excluded: false,
            largest: 0.0,
            line: vec![0.0; columns * plan.widest_source()],
            bad: vec![false; columns],
        }
    }

    /// Loads a frame's part around an area: frame `time` of the tile's. What the window doesn't reach isn't touched.
    pub fn load(&mut self, plan: &Plan<'_>, frame: &Frame<'_>, time: usize, area: &Area) {
        let (layout, border) = (self.layout, plan.filter.border);
        let (width, height) = (frame.image.width(), frame.image.height());
        let (left, top) = (area.x as i64 - layout.margin as i64, area.y as i64 - layout.margin as i64);
        let reach = plan.window.radius as i64;
        let wanted = (area.x as i64 - reach)..(area.x as i64 + area.width as i64 + reach);
        let inside = Inside {
            first: wanted.start.max(0) as usize,
            last: wanted.end.min(width as i64) as usize,
            column: (wanted.start.max(0) - left) as usize,
        };
        // The columns beyond the edges, and those that stand for them.
        let beyond: Vec<(usize, Option<usize>)> = wanted
            .filter(|x| !(0..width as i64).contains(x))
            .map(|x| ((x - left) as usize, border.map(x, width).map(|x| (x as i64 - left) as usize)))
            .collect();
        for row in (area.y as i64 - reach)..(area.y as i64 + area.height as i64 + reach) {
            let base = time * layout.frame_size + layout.index(0, (row - top) as usize);
            match border.map(row, height) {
                None => self.exclude_row(plan, base),
                Some(y) => {
                    self.load_row(plan, frame, y, base, &inside);
                    self.continue_row(plan, base, &beyond);
                }
            }
        }
    }

    /// Loads the columns of row `y` that are inside the image.
    fn load_row(&mut self, plan: &Plan<'_>, frame: &Frame<'_>, y: usize, base: usize, inside: &Inside) {
        let count = inside.last - inside.first;
        self.bad[..count].fill(false);
        let mut largest = 0.0f32;
        for source in &plan.sources {
            let image = frame.input(source.input);
            let n = image.channel_count();
            let samples = &image.data()[(y * image.width() + inside.first) * n..][..count * n];
            let factor = match source.content {
                Content::Channels {
                    scale: Scale::Linear,
                    opacity: Opacity::None | Opacity::Premultiplied(_),
                    factor,
                } => Some(factor),
                _ => None,
            };
            if let Some(factor) = factor.filter(|_| n <= 4096) {
                for c in 0..n {
                    largest = worst(
                        largest,
                        distribute(
                            plan,
                            &self.layout,
                            &mut self.planes,
                            base,
                            source.plane + c,
                            inside.column,
                            &samples[c..],
                            n,
                            factor,
                        ),
                    );
                }
            } else if let Content::Channels { scale, opacity: Opacity::None, factor } = source.content {
                for c in 0..n {
                    let line = &mut self.line[..count];
                    plan.level.spread(&samples[c..], n, 1.0, line);
                    largest = worst(largest, plan.level.rescale(scale, false, factor, line));
                    distribute(
                        plan,
                        &self.layout,
                        &mut self.planes,
                        base,
                        source.plane + c,
                        inside.column,
                        line,
                        1,
                        1.0,
                    );
                }
            } else {
                let line = &mut self.line[..source.planes * count];
                load_source(source, samples, n, line, &mut self.bad[..count]);
                for (c, line) in line.chunks_exact(count).enumerate() {
                    largest = worst(
                        largest,
                        distribute(
                            plan,
                            &self.layout,
                            &mut self.planes,
                            base,
                            source.plane + c,
                            inside.column,
                            line,
                            1,
                            1.0,
                        ),
                    );
                }
            }
        }
        if largest <= LARGEST && !self.bad[..count].contains(&true) {
            self.largest = self.largest.max(largest);
            return;
        }
        self.largest = f32::INFINITY;
        // Something can't be used, perhaps: look at each pixel.
        for source in &plan.sources {
            let image = frame.input(source.input);
            let n = image.channel_count();
            let samples = &image.data()[(y * image.width() + inside.first) * n..][..count * n];
            load_source(source, samples, n, &mut self.line[..source.planes * count], &mut self.bad[..count]);
        }
        for i in (0..count).filter(|&i| self.bad[i]) {
            self.has_excluded = true;
            exclude(plan, &self.layout, &mut self.planes, base, inside.column + i);
        }
    }

    /// Fills the columns beyond the edges of the image.
    fn continue_row(&mut self, plan: &Plan<'_>, base: usize, beyond: &[(usize, Option<usize>)]) {
        let layout = self.layout;
        for &(column, place) in beyond {
            let Some(place) = place else {
                exclude(plan, &layout, &mut self.planes, base, column);
                continue;
            };
            let (from, to) = (base + layout.index(place, 0), base + layout.index(column, 0));
            for plane in 0..plan.plane_count {
                self.planes[plane * layout.plane_size + to] = self.planes[plane * layout.plane_size + from];
            }
        }
    }

    fn exclude_row(&mut self, plan: &Plan<'_>, base: usize) {
        let layout = self.layout;
        for plane in 0..plan.plane_count {
            let outside = if plane == plan.groups[0].plane { EXCLUDED } else { 0.0 };
            for phase in 0..layout.phases {
                let to = base + plane * layout.plane_size + phase * layout.phase_size;
                self.planes[to..to + layout.stride].fill(outside);
            }
        }
    }

    /// Whether the pixel at a place of the first plane of the first guide is excluded.
    #[inline]
    pub fn is_excluded(&self, plan: &Plan<'_>, place: usize) -> bool {
        self.planes[plan.groups[0].plane * self.layout.plane_size + place] == EXCLUDED
    }
}

/// The columns of a row that are inside the image.
struct Inside {
    /// The first in the image, and the one after the last.
    first: usize,
    last: usize,
    /// The first in the tile.
    column: usize,
}

/// Distributes a row of samples, one in `stride`, to the phases of a plane, from a column of the tile on. Returns as
/// [`Level::spread`](crate::simd::Level::spread).
fn distribute(
    plan: &Plan<'_>,
    layout: &Layout,
    planes: &mut [f32],
    base: usize,
    plane: usize,
    column: usize,
    samples: &[f32],
    stride: usize,
    factor: f32,
) -> f32 {
    let phases = layout.phases;
    let count = samples.len().div_ceil(stride);
    let mut largest = 0.0;
    for phase in 0..phases.min(count) {
        let to = base + plane * layout.plane_size + layout.index(column + phase, 0);
        let to = &mut planes[to..][..(count - phase).div_ceil(phases)];
        largest = worst(largest, plan.level.spread(&samples[phase * stride..], phases * stride, factor, to));
    }
    largest
}

/// The larger of two numbers that aren't negative; NaN if one of them is.
fn worst(a: f32, b: f32) -> f32 {
    if b <= a { a } else { b + 0.0 * a }
}

/// Excludes the pixel of a column.
fn exclude(plan: &Plan<'_>, layout: &Layout, planes: &mut [f32], base: usize, column: usize) {
    let place = base + layout.index(column, 0);
    for plane in 0..plan.plane_count {
        planes[plane * layout.plane_size + place] = if plane == plan.groups[0].plane { EXCLUDED } else { 0.0 };
    }
}

/// Turns `samples` of `channels` channels into planes, and marks pixels that can't be used.
fn load_source(source: &Source, samples: &[f32], channels: usize, planes: &mut [f32], bad: &mut [bool]) {
    let count = bad.len();
    match source.content {
        Content::Channels { scale, opacity, factor } => {
            for (i, pixel) in samples.chunks_exact(channels).enumerate() {
                for (c, &v) in pixel.iter().enumerate() {
                    bad[i] |= !v.is_finite();
                    let v = match opacity {
                        Opacity::None => scale.forward(v),
                        Opacity::Straight(a) | Opacity::Premultiplied(a) if c == a => v,
                        Opacity::Straight(a) => scale.forward(v) * pixel[a],
                        Opacity::Premultiplied(_) if scale == Scale::Linear => v,
                        Opacity::Premultiplied(a) if pixel[a] > 0.0 => scale.forward(v / pixel[a]) * pixel[a],
                        Opacity::Premultiplied(_) => v.min(0.0) * 0.0,
                    } * factor;
                    planes[c * count + i] = v;
                    bad[i] |= !usable(v);
                }
            }
        }
        Content::Lab { rgb, factor } => {
            for (i, pixel) in samples.chunks_exact(channels).enumerate() {
                let lab = lab(rgb.map(|c| pixel[c]));
                for (c, v) in lab.into_iter().enumerate() {
                    let v = v * factor;
                    planes[c * count + i] = v;
                    bad[i] |= !usable(v);
                }
            }
        }
        Content::Widths { sigma } => {
            for (i, pixel) in samples.chunks_exact(channels).enumerate() {
                let width = pixel[0].clamp(sigma * 1e-3, sigma * 1e3);
                planes[i] = (sigma / width).powi(2);
                bad[i] |= !width.is_finite();
            }
        }
    }
}

/// Whether a sample's squared differences stay finite; NaN isn't.
#[inline]
fn usable(v: f32) -> bool {
    v.abs() <= LARGEST
}

/// CIELAB of linear sRGB (IEC 61966-2-1).
fn lab([r, g, b]: [f32; 3]) -> [f32; 3] {
    const XYZ: [[f32; 3]; 3] = [
        [0.412_456_4, 0.357_576_1, 0.180_437_5],
        [0.212_672_9, 0.715_152_2, 0.072_175],
        [0.019_333_9, 0.119_192, 0.950_304_1],
    ];
    let xyz = XYZ.map(|row| row[0] * r + row[1] * g + row[2] * b);
    luz_color::lab::xyz_to_lab(xyz, XYZ.map(|row| row.iter().sum()))
}
