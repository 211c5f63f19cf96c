//! Videos: one frame in, one frame out, some frames later.

use std::collections::VecDeque;
use std::time::Instant;

use luz_image::Image;

use crate::plan::{Frame, Plan, check};
use crate::{BilateralFilter, FilterError, Filtered, Guide, Method, Progress, Range, filter, run};

/// A [`Guide`] that a video keeps for as long as it needs it.
#[derive(Clone, Debug)]
pub struct VideoGuide {
    /// As [`Guide::image`].
    pub image: Image,
    /// As [`Guide::range`].
    pub range: Range,
    /// As [`Guide::widths`].
    pub widths: Option<Image>,
}

/// The spatio-temporal bilateral filter of a video: a Gaussian of width σ_t over frames beside that over pixels, and the
/// same range Gaussian between all of them. Before the first and after the last frame there is nothing.
///
/// [`Method::Auto`] chooses anew every 16 frames, and where windows have more or fewer frames.
///
/// Frames are pushed one by one; each that comes out is filtered with `R_t = ⌈5/2 σ_t⌉` frames before and after it. Only
/// those are kept in memory.
///
/// ```
/// use luz_filter::{BilateralFilter, VideoFilter};
/// use luz_image::Image;
///
/// let mut video = VideoFilter::new(BilateralFilter::new(2.0, 0.1), 1.0)?;
/// let mut frames = Vec::new();
/// for _ in 0..5 {
///     frames.extend(video.push(Image::new(16, 16, ["Y"])?, Vec::new())?);
/// }
/// while let Some(frame) = video.flush()? {
///     frames.push(frame);
/// }
/// assert_eq!(frames.len(), 5);
/// # Ok::<(), luz_filter::FilterError>(())
/// ```
#[derive(Debug)]
pub struct VideoFilter {
    filter: BilateralFilter,
    sigma_frames: f32,
    radius: usize,
    /// The frames that are needed yet.
    kept: VecDeque<(Image, Vec<VideoGuide>)>,
    /// The number of the first frame in `kept`.
    first: usize,
    /// The number of the frame that comes out next.
    next: usize,
    /// What [`Method::Auto`] chose last.
    chosen: Option<Chosen>,
}

/// What [`Method::Auto`] chose for a frame.
#[derive(Clone, Copy, Debug)]
struct Chosen {
    method: Method,
    quality: Option<f64>,
    /// The frame.
    at: usize,
    /// How many frames its window had.
    frames: usize,
}

/// A choice holds for this many frames, if their windows have as many frames.
const CHOICE_HOLDS: usize = 16;

impl VideoFilter {
    /// A filter with σ_t in frames, from 0.1 to 100.
    ///
    /// # Errors
    /// When σ_t is out of its domain.
    pub fn new(filter: BilateralFilter, sigma_frames: f32) -> Result<Self, FilterError> {
        check("σ_t", sigma_frames, 0.1, 100.0)?;
        let radius = filter::window_radius(sigma_frames);
        Ok(Self { filter, sigma_frames, radius, kept: VecDeque::new(), first: 0, next: 0, chosen: None })
    }

    /// How many frames are pushed after a frame before it comes out: `R_t`.
    pub fn latency(&self) -> usize {
        self.radius
    }

    /// Takes the next frame, with its guides if there are any, and gives the frame that is complete by that.
    ///
    /// # Errors
    /// As [`BilateralFilter::apply`], and when the frame differs from the one before in size, channels or guides.
    pub fn push(&mut self, image: Image, guides: Vec<VideoGuide>) -> Result<Option<Filtered>, FilterError> {
        self.push_with_progress(image, guides, &|_| {})
    }

    /// As [`Self::push`]; `progress` is told how far the frame that comes out is.
    ///
    /// # Errors
    /// As [`Self::push`].
    pub fn push_with_progress(
        &mut self,
        image: Image,
        guides: Vec<VideoGuide>,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<Option<Filtered>, FilterError> {
        if let Some((before, before_guides)) = self.kept.back() {
            let frame = self.first + self.kept.len();
            same_shape(before, &image).map_err(|reason| FilterError::FrameMismatch { frame, reason })?;
            let mismatch = |reason: String| FilterError::FrameMismatch { frame, reason };
            if before_guides.len() != guides.len() {
                return Err(mismatch(format!("it has {} guides, not {}", guides.len(), before_guides.len())));
            }
            for (a, b) in before_guides.iter().zip(&guides) {
                same_shape(&a.image, &b.image).map_err(|reason| mismatch(format!("of its guide, {reason}")))?;
                if a.range != b.range || a.widths.is_some() != b.widths.is_some() {
                    return Err(mismatch("its guides have other ranges or widths".to_owned()));
                }
            }
        }
        self.kept.push_back((image, guides));
        if self.first + self.kept.len() > self.next + self.radius {
            self.filter_next(progress).map(Some)
        } else {
            Ok(None)
        }
    }

    /// After the last frame was pushed: the next of those that haven't come out, or none.
    ///
    /// # Errors
    /// As [`BilateralFilter::apply`].
    pub fn flush(&mut self) -> Result<Option<Filtered>, FilterError> {
        if self.next < self.first + self.kept.len() { self.filter_next(&|_| {}).map(Some) } else { Ok(None) }
    }

    /// Filters the frame `next`, which exists, and forgets those that aren't needed any more.
    fn filter_next(&mut self, progress: &(dyn Fn(Progress) + Sync)) -> Result<Filtered, FilterError> {
        let start = Instant::now();
        let guides: Vec<Vec<Guide<'_>>> = self
            .kept
            .iter()
            .map(|(_, guides)| {
                guides.iter().map(|g| Guide { image: &g.image, range: g.range, widths: g.widths.as_ref() }).collect()
            })
            .collect();
        let frames: Vec<Option<Frame<'_>>> = (0..=2 * self.radius)
            .map(|t| {
                let index = (self.next + t).checked_sub(self.radius + self.first)?;
                let (image, _) = self.kept.get(index)?;
                Some(Frame { image, guides: &guides[index] })
            })
            .collect();
        let Some(frame) = frames[self.radius] else {
            return Err(FilterError::FrameMismatch { frame: self.next, reason: "it is missing".to_owned() });
        };
        let existing = frames.iter().flatten().count();
        let holds = |c: &Chosen| c.frames == existing && self.next < c.at + CHOICE_HOLDS;
        let mut filter = self.filter;
        let automatic = matches!(filter.method, Method::Auto { .. });
        let chosen = self.chosen.filter(|c| automatic && holds(c));
        if let Some(chosen) = chosen {
            filter.method = chosen.method;
        }
        let plan = Plan::with_frames(&filter, frame, Some(self.sigma_frames))?;
        let mut filtered = run::video(&plan, &frames, progress)?;
        match chosen {
            Some(chosen) => filtered.report.measured_quality = chosen.quality,
            None if automatic => {
                let (method, quality) = (filtered.report.method, filtered.report.measured_quality);
                self.chosen = Some(Chosen { method, quality, at: self.next, frames: existing });
            }
            None => {}
        }
        filtered.report.seconds = start.elapsed().as_secs_f64();
        self.next += 1;
        while self.first + self.radius < self.next {
            self.kept.pop_front();
            self.first += 1;
        }
        Ok(filtered)
    }
}

/// How an image differs from another in size or channels.
fn same_shape(a: &Image, b: &Image) -> Result<(), String> {
    if (a.width(), a.height()) != (b.width(), b.height()) {
        return Err(format!("it has {}×{} pixels, not {}×{}", b.width(), b.height(), a.width(), a.height()));
    }
    if a.channels() != b.channels() {
        return Err(format!("it has the channels {}, not {}", b.channels().join(", "), a.channels().join(", ")));
    }
    Ok(())
}
