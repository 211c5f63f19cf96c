//! Tiles in parallel.

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use luz_image::Image;

use crate::pattern::{self, Pattern};
use crate::plan::{Frame, LARGEST, Plan, check};
use crate::tile::{Area, Layout};
use crate::worker::{Compiled, Rows, Worker};
use crate::{FilterError, Filtered, Method, Progress, Report, SampleCount, auto, cosines, regression};

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
        report.measured_quality = choice.quality;
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
    if let Method::Cosines { quality } = method {
        check("the quality in dB", quality as f32, 0.0, 100.0)?;
        return cosines::filter(plan, quality, report, progress);
    }
    let Method::Sampled(sampling) = method else {
        let patterns = [pattern::window(&plan.window)];
        report.samples_per_pixel = samples_per_pixel(&patterns);
        return filter(plan, &patterns, window, report, progress);
    };
    let count = match sampling.samples {
        SampleCount::Count(n) => ("the number of samples", n as f32),
        SampleCount::Windows(c) => ("the number of samples in window widths", c),
    };
    let (least, most) = if matches!(sampling.samples, SampleCount::Count(_)) { (1.0, 1e6) } else { (1e-3, 1e3) };
    check(count.0, count.1, least, most)?;
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
        let fitted = regression::fit(plan.frame.image, &result, plan.filter.range.sigma, LARGEST / plan.value_factor);
        report.scratch_bytes = report.scratch_bytes.max(fitted.len() * 4);
        result.data_mut().copy_from_slice(&fitted);
    }
    Ok(result)
}

/// The mean number of neighbours, with the pixel itself.
fn samples_per_pixel(patterns: &[Pattern]) -> f64 {
    1.0 + patterns.iter().map(|p| p.offsets.len()).sum::<usize>() as f64 / patterns.len() as f64
}

/// Filters with given patterns. There is one for each phase of the columns and rows.
fn filter(
    plan: &Plan<'_>,
    patterns: &[Pattern],
    frames: &[Option<Frame<'_>>],
    report: &mut Report,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Image, FilterError> {
    // Whole blocks of each phase; wide enough that margins cost little.
    let side = if plan.window.radius > 60 { 512 } else { 256 };
    tiles(plan, patterns, frames, report, progress, side, |_| 0, |worker, area, out| worker.filter(area, out))
}

/// Filters tile by tile, each at most `side` pixels wide and high: `filter` does it for an area that is loaded, using
/// `extra` bytes of memory beside the tile's, and returns how many pixels were excluded.
pub(crate) fn tiles(
    plan: &Plan<'_>,
    patterns: &[Pattern],
    frames: &[Option<Frame<'_>>],
    report: &mut Report,
    progress: &(dyn Fn(Progress) + Sync),
    side: usize,
    extra: impl Fn(&Layout) -> usize,
    filter: impl Fn(&mut Worker<'_>, &Area, &mut Rows<'_>) -> u64 + Sync,
) -> Result<Image, FilterError> {
    let phases = patterns.len().isqrt();
    let image = plan.frame.image;
    let (width, height, channels) = (image.width(), image.height(), image.channel_count());
    let existing = plan.existing(frames);
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
    // Each tile's part of each row.
    let mut parts: Vec<Vec<&mut [f32]>> = (0..tiles).map(|_| Vec::with_capacity(layout.height)).collect();
    for (y, row) in samples.chunks_exact_mut(width * channels).enumerate() {
        for (column, part) in row.chunks_mut(layout.width * channels).enumerate() {
            parts[y / layout.height * across + column].push(part);
        }
    }
    let parts: Vec<Mutex<Vec<&mut [f32]>>> = parts.into_iter().map(Mutex::new).collect();
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
            // Nobody else wants it.
            if let Ok(mut rows) = parts[tile].lock() {
                excluded.fetch_add(filter(&mut worker, &area, &mut rows), Ordering::Relaxed);
            }
            let pixels = (area.width * area.height) as u64;
            let done = done.fetch_add(pixels, Ordering::Relaxed) + pixels;
            progress(Progress { done, total: (width * height) as u64 });
        }
    };
    let bytes = layout.bytes(plan) + extra(&layout);
    let budget = (2 * width * height * channels * 4 / bytes).max(1);
    let workers = rayon::current_num_threads().min(budget).min(tiles);
    if workers == 1 {
        work();
    } else {
        rayon::scope(|scope| (0..workers).for_each(|_| scope.spawn(|_| work())));
    }
    drop(parts);
    report.excluded_pixels = excluded.into_inner();
    report.scratch_bytes = report.scratch_bytes.max(workers * bytes);
    let mut result = Image::from_data(width, height, image.channels().iter().cloned(), samples)?;
    result.metadata = image.metadata.clone();
    Ok(result)
}
