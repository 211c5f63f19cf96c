//! Tiles in parallel.

use std::ops::RangeInclusive;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use luz_image::Image;

use crate::pattern::{self, Pattern};
use crate::plan::{Frame, Opacity, Plan, check};
use crate::simd::RowJob;
use crate::tile::{Area, Layout, Tile};
use crate::{FilterError, Filtered, Method, Precision, Progress, Report, Scale, auto, regression};

/// Filters the plan's image.
pub(crate) fn image(plan: &Plan<'_>, progress: &(dyn Fn(Progress) + Sync)) -> Result<Filtered, FilterError> {
    video(plan, &[Some(plan.frame)], progress)
}

/// Filters the middle one of the frames of a window, which is the plan's; those that the video doesn't have are none.
pub(crate) fn video(
    plan: &Plan<'_>,
    window: &[Option<Frame<'_>>],
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Filtered, FilterError> {
    let mut report = Report {
        method: plan.filter.method,
        window: 2 * plan.window.radius + 1,
        window_frames: 2 * plan.window.frame_radius + 1,
        samples_per_pixel: 0.0,
        excluded_pixels: 0,
        measured_quality: None,
        scratch_bytes: 0,
        simd: plan.level.name(),
        seconds: 0.0,
    };
    let mut method = plan.filter.method;
    if let Method::Auto { quality } = method {
        check("the quality in dB", quality as f32, 0.0, 200.0)?;
        let choice = auto::choose(plan, window, quality)?;
        report.measured_quality = Some(choice.quality);
        method = choice.method;
    }
    let image = by_method(plan, method, window, &mut report, progress)?;
    Ok(Filtered { image, report })
}

/// Filters the plan's frame by a method that isn't to be chosen any more.
fn by_method(
    plan: &Plan<'_>,
    method: Method,
    window: &[Option<Frame<'_>>],
    report: &mut Report,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Image, FilterError> {
    report.method = method;
    let Method::Sampled(sampling) = method else {
        let patterns = [pattern::window(&plan.window)];
        report.samples_per_pixel = samples_per_pixel(&patterns);
        return filter(plan, &patterns, window, report, progress);
    };
    if sampling.regression && !plan.frame.guides.is_empty() {
        let reason = "results are fitted to the image, but guides decide here; switch the regression off".to_owned();
        return Err(FilterError::Unsuitable { method: "the sampled filter with regression", reason });
    }
    let mut plan = plan.clone();
    plan.lay_out(sampling.precision)?;
    let patterns = pattern::sampled(&plan.window, &sampling, plan.filter.seed);
    report.samples_per_pixel = samples_per_pixel(&patterns);
    let mut result = filter(&plan, &patterns, window, report, progress)?;
    if sampling.regression {
        let fitted = regression::fit(plan.frame.image, &result, plan.filter.range.sigma);
        report.scratch_bytes = report.scratch_bytes.max(fitted.len() * 4);
        result.data_mut().copy_from_slice(&fitted);
    }
    Ok(result)
}

/// The mean number of neighbours, with the pixel itself.
fn samples_per_pixel(patterns: &[Pattern]) -> f64 {
    1.0 + patterns.iter().map(|p| p.offsets.len()).sum::<usize>() as f64 / patterns.len() as f64
}

/// A pattern as the kernel wants it.
pub(crate) struct Compiled {
    offsets: Vec<i32>,
    exponents: Vec<f32>,
    reach: (i32, i32),
    centre_weight: f32,
}

impl Compiled {
    pub fn new(pattern: &Pattern, layout: &Layout, phase: [usize; 2], precision: Precision) -> Self {
        let offsets: Vec<i32> = pattern.offsets.iter().map(|&o| layout.offset(phase, o)).collect();
        let reach = offsets.iter().fold((0, 0), |(a, b), &o| (o.min(a), o.max(b)));
        let exponents = pattern.log2_weights.iter().map(|&w| precision.exponent(w)).collect();
        Self { offsets, exponents, reach, centre_weight: pattern.centre_weight as f32 }
    }
}

/// Filters with given patterns. There is one for each phase of the
/// columns and rows.
fn filter(
    plan: &Plan<'_>,
    patterns: &[Pattern],
    frames: &[Option<Frame<'_>>],
    report: &mut Report,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Image, FilterError> {
    let phases = patterns.len().isqrt();
    let image = plan.frame.image;
    let (width, height, channels) = (image.width(), image.height(), image.channel_count());
    let existing = plan.existing(frames);
    let side = (4 * plan.window.radius).clamp(256, 512);
    let layout = Layout::new(plan, phases, side.min(width), side.min(height)).ok_or_else(|| plan.too_large())?;
    let compiled: Vec<Compiled> = patterns
        .iter()
        .enumerate()
        .map(|(i, pattern)| {
            Compiled::new(&pattern.within_frames(&existing), &layout, [i % phases, i / phases], plan.precision)
        })
        .collect();

    let (across, down) = (width.div_ceil(layout.width), height.div_ceil(layout.height));
    let tiles = across * down;
    let mut samples = vec![0.0f32; width * height * channels];
    let bands: Vec<Mutex<&mut [f32]>> = samples.chunks_mut(layout.height * width * channels).map(Mutex::new).collect();
    let (next, done, excluded) = (AtomicUsize::new(0), AtomicU64::new(0), AtomicU64::new(0));

    let work = || {
        let mut worker = Worker::new(plan, layout, &compiled);
        loop {
            let tile = next.fetch_add(1, Ordering::Relaxed);
            if tile >= tiles {
                break;
            }
            let (x, y) = (tile % across * layout.width, tile / across * layout.height);
            let area = Area { x, y, width: layout.width.min(width - x), height: layout.height.min(height - y) };
            worker.load(frames, &existing, &area);
            excluded.fetch_add(worker.filter(&area), Ordering::Relaxed);
            let row = area.width * channels;
            if let Ok(mut band) = bands[tile / across].lock() {
                for (from, to) in worker.result.chunks_exact(row).zip(band.chunks_exact_mut(width * channels)) {
                    to[x * channels..][..row].copy_from_slice(from);
                }
            }
            let pixels = (area.width * area.height) as u64;
            let done = done.fetch_add(pixels, Ordering::Relaxed) + pixels;
            progress(Progress { done, total: (width * height) as u64 });
        }
    };
    let bytes = layout.bytes(plan) + layout.width * layout.height * channels * 4;
    let budget = (2 * width * height * channels * 4 / bytes).max(1);
    let workers = rayon::current_num_threads().min(budget).min(tiles);
    if workers == 1 {
        work();
    } else {
        rayon::scope(|scope| (0..workers).for_each(|_| scope.spawn(|_| work())));
    }
    drop(bands);
    report.excluded_pixels = excluded.into_inner();
    report.scratch_bytes = report.scratch_bytes.max(workers * bytes);
    let mut result = Image::from_data(width, height, image.channels().iter().cloned(), samples)?;
    result.metadata = image.metadata.clone();
    Ok(result)
}

/// What a thread needs.
pub(crate) struct Worker<'a> {
    plan: &'a Plan<'a>,
    compiled: &'a [Compiled],
    tile: Tile,
    /// The values of a row of one phase, as planes.
    row: Vec<f32>,
    /// The area's filtered pixels.
    pub result: Vec<f32>,
}

impl<'a> Worker<'a> {
    pub fn new(plan: &'a Plan<'a>, layout: Layout, compiled: &'a [Compiled]) -> Self {
        let columns = (layout.width / layout.phases).next_multiple_of(RowJob::BLOCK);
        Self {
            plan,
            compiled,
            tile: Tile::new(layout, plan),
            row: vec![0.0; columns * plan.values.1],
            result: Vec::new(),
        }
    }

    /// Loads an area with the frames of a window that exist.
    pub fn load(&mut self, window: &[Option<Frame<'_>>], existing: &RangeInclusive<i32>, area: &Area) {
        self.tile.has_excluded = false;
        let (middle, r) = ((window.len() / 2) as i32, self.plan.window.frame_radius as i32);
        for t in existing.clone() {
            if let Some(frame) = &window[(middle + t) as usize] {
                self.tile.load(self.plan, frame, (r + t) as usize, area);
            }
        }
    }

    /// Filters the area of the loaded tile into [`Self::result`]. Returns how many pixels were excluded.
    pub fn filter(&mut self, area: &Area) -> u64 {
        let (plan, layout) = (self.plan, self.tile.layout);
        let (channels, phases, image) = (plan.values.1, layout.phases, plan.frame.image);
        self.result.resize(area.width * area.height * channels, 0.0);
        let middle = plan.window.frame_radius * layout.frame_size;
        let linear = plan.filter.mean_scale == Scale::Linear && !matches!(plan.opacity, Opacity::Straight(_));
        let plain = linear && !self.tile.has_excluded;
        let mut excluded = 0;
        for y in 0..area.height {
            for x in 0..phases.min(area.width) {
                let columns = (area.width - x).div_ceil(phases);
                let pattern = &self.compiled[y % phases * phases + x];
                let centre = middle + layout.index(layout.margin + x, layout.margin + y);
                let job = RowJob {
                    planes: &self.tile.planes,
                    plane_size: layout.plane_size,
                    plane_count: plan.plane_count,
                    centre,
                    columns,
                    groups: &plan.groups,
                    values: plan.values,
                    offsets: &pattern.offsets,
                    exponents: &pattern.exponents,
                    reach: pattern.reach,
                    centre_weight: pattern.centre_weight,
                    precision: plan.precision,
                    unscale: 1.0 / plan.value_factor,
                };
                plan.level.filter_row(&job, &mut self.row);
                let stride = columns.next_multiple_of(RowJob::BLOCK);
                let out = &mut self.result[y * area.width * channels..][..area.width * channels];
                for c in 0..channels {
                    let to = out[x * channels + c..].iter_mut().step_by(phases * channels);
                    to.zip(&self.row[c * stride..]).for_each(|(to, &v)| *to = v);
                }
                if !plain {
                    for i in 0..columns {
                        let to = &mut out[(x + i * phases) * channels..][..channels];
                        let original = image.pixel(area.x + x + i * phases, area.y + y);
                        if self.tile.has_excluded && self.tile.is_excluded(plan, centre + i) {
                            to.copy_from_slice(original);
                            excluded += 1;
                        } else {
                            restore(plan, to, original);
                        }
                    }
                }
            }
        }
        excluded
    }
}

/// Takes a pixel from the scale of the planes back to that of the image.
fn restore(plan: &Plan<'_>, pixel: &mut [f32], original: &[f32]) {
    let scale = plan.filter.mean_scale;
    match plan.opacity {
        Opacity::None => pixel.iter_mut().for_each(|v| *v = scale.backward(*v)),
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
