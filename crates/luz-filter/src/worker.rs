//! What a thread does with a tile.

use std::ops::RangeInclusive;

use crate::pattern::Pattern;
use crate::plan::{Frame, Opacity, Plan};
#[cfg(target_arch = "x86_64")]
use crate::simd::HalfRowJob;
use crate::simd::{Metric, RowJob};
use crate::tile::{Area, Layout, Tile};
use crate::{Precision, Scale};

/// A pattern as the kernel wants it.
pub(crate) struct Compiled {
    offsets: Vec<i32>,
    exponents: Vec<f32>,
    reach: (i32, i32),
    centre_weight: f32,
    /// The exponents as halves, each twice.
    halves: Vec<u32>,
}

impl Compiled {
    /// For pixels of a phase.
    pub fn new(pattern: &Pattern, layout: &Layout, phase: [usize; 2], precision: Precision) -> Self {
        let offsets: Vec<i32> = pattern.offsets.iter().map(|&o| layout.offset(phase, o)).collect();
        let reach = offsets.iter().fold((0, 0), |(a, b), &o| (o.min(a), o.max(b)));
        // The largest weight is one, so that sums in half precision are of a known size.
        let largest = pattern.log2_weights.iter().fold(0.0f64, |a, &b| a.max(b));
        let shift = if precision == Precision::Half { largest } else { 0.0 };
        let exponents: Vec<f32> = pattern.log2_weights.iter().map(|&w| precision.exponent(w - shift)).collect();
        let twice = |v: &f32| u32::from(half::f16::from_f32(*v).to_bits()) * 0x0001_0001;
        let halves = if precision == Precision::Half { exponents.iter().map(twice).collect() } else { Vec::new() };
        let centre_weight = (pattern.centre_weight * (-shift).exp2()) as f32;
        Self { offsets, exponents, reach, centre_weight, halves }
    }
}

/// What a thread needs.
pub(crate) struct Worker<'a> {
    pub plan: &'a Plan<'a>,
    compiled: &'a [Compiled],
    pub tile: Tile,
    /// The tile in half precision, if it can be used.
    halves: Vec<u16>,
    /// The values of a row of one phase, as planes.
    row: Vec<f32>,
}

/// Where the rows of an area go: the interleaved samples of each.
pub(crate) type Rows<'r> = [&'r mut [f32]];

impl<'a> Worker<'a> {
    /// With a pattern for each phase of the layout.
    pub fn new(plan: &'a Plan<'a>, layout: Layout, compiled: &'a [Compiled]) -> Self {
        let columns = (layout.width / layout.phases).next_multiple_of(RowJob::BLOCK);
        Self {
            plan,
            compiled,
            tile: Tile::new(layout, plan),
            halves: Vec::new(),
            row: vec![0.0; columns * plan.values.1],
        }
    }

    /// Loads an area with the frames of a window that exist.
    pub fn load(&mut self, window: &[Option<Frame<'_>>], existing: &RangeInclusive<i32>, area: &Area) {
        (self.tile.has_excluded, self.tile.largest) = (false, 0.0);
        let (middle, r) = ((window.len() / 2) as i32, self.plan.window.frame_radius as i32);
        for t in existing.clone() {
            if let Some(frame) = &window[(middle + t) as usize] {
                self.tile.load(self.plan, frame, (r + t) as usize, area);
            }
        }
    }

    /// Filters the area of the loaded tile. Returns how many pixels were excluded.
    pub fn filter(&mut self, area: &Area, out: &mut Rows<'_>) -> u64 {
        let phases = self.tile.layout.phases;
        let mut row = std::mem::take(&mut self.row);
        let halves = self.use_halves();
        let mut excluded = 0;
        for y in 0..area.height {
            for x in 0..phases.min(area.width) {
                let columns = (area.width - x).div_ceil(phases);
                let pattern = &self.compiled[y % phases * phases + x];
                if halves {
                    self.filter_half_row(pattern, [x, y], columns, &mut row);
                } else {
                    self.plan.level.filter_row(&self.job(pattern, [x, y], columns), &mut row);
                }
                let stride = columns.next_multiple_of(RowJob::BLOCK);
                excluded += self.put_row(area, [x, y], phases, &mut row, stride, out);
            }
        }
        self.row = row;
        excluded
    }

    /// Converts the tile to half precision if that is wanted and can be used.
    fn use_halves(&mut self) -> bool {
        /// Sums of squares may overflow, differences and sums of products not.
        const LARGEST_SCALED: f32 = 5000.0;
        const LARGEST_VALUE: f32 = 2.0;
        let plan = self.plan;
        let alone = plan.groups.len() == 1 && plan.groups[0].metric == Metric::L2 && plan.groups[0].factor.is_none();
        let usable = plan.precision == Precision::Half
            && plan.level.has_half_precision()
            && alone
            && (plan.groups[0].plane, plan.groups[0].channels) == plan.values
            && plan.values.1 <= 3
            && self.tile.largest <= LARGEST_SCALED.min(LARGEST_VALUE * plan.value_factor);
        if usable {
            self.halves.resize(self.tile.planes.len(), 0);
            plan.level.convert_to_half(&self.tile.planes, &mut self.halves);
        }
        usable
    }

    #[cfg(target_arch = "x86_64")]
    fn filter_half_row(&self, pattern: &Compiled, [x, y]: [usize; 2], columns: usize, row: &mut [f32]) {
        let (plan, plane_size) = (self.plan, self.tile.layout.plane_size);
        let job = HalfRowJob {
            planes: &self.halves,
            plane_size,
            channels: plan.values.1,
            centre: self.place(x, y) + plan.values.0 * plane_size,
            columns,
            offsets: &pattern.offsets,
            exponents: &pattern.halves,
            reach: pattern.reach,
            centre_weight: pattern.centre_weight,
            unscale: 1.0 / plan.value_factor,
        };
        plan.level.filter_half_row(&job, row);
    }

    #[cfg(not(target_arch = "x86_64"))]
    fn filter_half_row(&self, pattern: &Compiled, pixel: [usize; 2], columns: usize, row: &mut [f32]) {
        self.plan.level.filter_row(&self.job(pattern, pixel, columns), row);
    }

    /// Filters [`RowJob::BLOCK`] pixels from a pixel of the area on, with the first pattern: plane by plane.
    pub fn filter_block(&self, pixel: [usize; 2], out: &mut [f32]) {
        self.plan.level.filter_row(&self.job(&self.compiled[0], pixel, RowJob::BLOCK), out);
    }

    /// The job for a pixel of the area and the next of its phase.
    fn job<'b>(&'b self, pattern: &'b Compiled, [x, y]: [usize; 2], columns: usize) -> RowJob<'b> {
        let (plan, layout) = (self.plan, self.tile.layout);
        RowJob {
            planes: &self.tile.planes,
            plane_size: layout.plane_size,
            plane_count: plan.plane_count,
            centre: self.place(x, y),
            columns,
            groups: &plan.groups,
            values: plan.values,
            offsets: &pattern.offsets,
            exponents: &pattern.exponents,
            reach: pattern.reach,
            centre_weight: pattern.centre_weight,
            precision: plan.precision,
            unscale: 1.0 / plan.value_factor,
        }
    }

    /// Where a pixel of the area is in the first plane of its frame.
    fn place(&self, x: usize, y: usize) -> usize {
        let layout = &self.tile.layout;
        self.plan.window.frame_radius * layout.frame_size + layout.index(layout.margin + x, layout.margin + y)
    }

    /// Puts every `step`-th pixel from a pixel of the area on where it belongs: from planes whose rows are `stride` apart.
    /// Returns how many pixels were excluded.
    pub fn put_row(
        &self,
        area: &Area,
        [x, y]: [usize; 2],
        step: usize,
        row: &mut [f32],
        stride: usize,
        out: &mut Rows<'_>,
    ) -> u64 {
        let plan = self.plan;
        let (channels, image) = (plan.values.1, plan.frame.image);
        let columns = (area.width - x).div_ceil(step);
        let out = &mut *out[y];
        let scale = plan.filter.mean_scale;
        let simple = plan.opacity == Opacity::None;
        if simple && scale != Scale::Linear {
            (0..channels).for_each(|c| {
                plan.level.rescale(scale, true, 1.0, &mut row[c * stride..][..columns]);
            });
        }
        for c in 0..channels {
            let to = out[x * channels + c..].iter_mut().step_by(step * channels);
            to.zip(&row[c * stride..][..columns]).for_each(|(to, &v)| *to = v);
        }
        let done = simple || scale == Scale::Linear && !matches!(plan.opacity, Opacity::Straight(_));
        if done && !self.tile.has_excluded {
            return 0;
        }
        let mut excluded = 0;
        for column in (x..area.width).step_by(step) {
            let original = image.pixel(area.x + column, area.y + y);
            let to = &mut out[column * channels..][..channels];
            if self.tile.has_excluded && self.tile.is_excluded(plan, self.place(column, y)) {
                to.copy_from_slice(original);
                excluded += 1;
            } else if !done {
                restore(plan, to, original);
            }
        }
        excluded
    }
}

/// Takes a pixel with opacity from the scale of the planes back to that of the image.
fn restore(plan: &Plan<'_>, pixel: &mut [f32], original: &[f32]) {
    let scale = plan.filter.mean_scale;
    match plan.opacity {
        Opacity::None => {}
        Opacity::Premultiplied(_) if scale == Scale::Linear => {}
        Opacity::Straight(a) | Opacity::Premultiplied(a) => {
            let alpha = pixel[a];
            for c in (0..pixel.len()).filter(|&c| c != a) {
                pixel[c] = match plan.opacity {
                    Opacity::Straight(_) if alpha > 0.0 => scale.backward(pixel[c] / alpha),
                    // What can't be seen keeps its colour.
                    Opacity::Straight(_) => original[c],
                    _ if alpha > 0.0 => scale.backward(pixel[c] / alpha) * alpha,
                    _ => original[c],
                };
            }
        }
    }
}
