//! What a filter comes down to: which planes are made of which samples, and how they are compared and averaged.

use luz_image::{Image, SampleType};

use crate::pattern::Window;
use crate::simd::{Group, Level, Metric};
use crate::{Alpha, BilateralFilter, Distance, FilterError, Guide, Precision, Range, Scale, filter};

/// An image and its guides at one time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame<'a> {
    pub image: &'a Image,
    pub guides: &'a [Guide<'a>],
}

/// Which image of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Input {
    Image,
    Guide(usize),
    Widths(usize),
}

impl<'a> Frame<'a> {
    pub fn input(&self, input: Input) -> &'a Image {
        match input {
            Input::Image => self.image,
            Input::Guide(i) => self.guides[i].image,
            Input::Widths(i) => self.guides[i].widths.unwrap_or(self.guides[i].image),
        }
    }
}

/// Consecutive planes made of an image's samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source {
    pub input: Input,
    /// The first plane.
    pub plane: usize,
    /// How many planes.
    pub planes: usize,
    pub content: Content,
}

/// What planes hold.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Content {
    /// All channels on a scale, multiplied with a factor.
    Channels { scale: Scale, opacity: Opacity, factor: f32 },
    /// CIELAB of the channels R, G and B, multiplied with a factor.
    Lab { rgb: [usize; 3], factor: f32 },
    /// `(sigma / width)²` of the first channel, the factor on squared distances.
    Widths { sigma: f32 },
}

/// Where an image has its opacity, and whether its colours are multiplied with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Opacity {
    None,
    Straight(usize),
    Premultiplied(usize),
}

impl Opacity {
    fn of(image: &Image, alpha: Alpha) -> Self {
        let Some(channel) = image.channel("A").filter(|_| image.channel_count() > 1) else { return Self::None };
        match alpha {
            Alpha::Ignore => Self::None,
            Alpha::Straight => Self::Straight(channel),
            Alpha::Premultiplied => Self::Premultiplied(channel),
            Alpha::Detect => match image.metadata.sample_type {
                Some(SampleType::Unsigned(_)) | None => Self::Straight(channel),
                Some(_) => Self::Premultiplied(channel),
            },
        }
    }
}

/// Samples beyond this on the scale of the planes count as not finite: their squared differences must stay finite.
pub(crate) const LARGEST: f32 = 1e17;

/// A filter made concrete for images of a certain shape.
#[derive(Clone, Debug)]
pub(crate) struct Plan<'a> {
    pub filter: BilateralFilter,
    pub frame: Frame<'a>,
    pub window: Window,
    pub level: Level,
    pub precision: Precision,
    pub sources: Vec<Source>,
    pub plane_count: usize,
    pub groups: Vec<Group>,
    /// The first plane of values, and how many: one for each channel.
    pub values: (usize, usize),
    /// What the planes of values were multiplied with.
    pub value_factor: f32,
    pub opacity: Opacity,
}

impl<'a> Plan<'a> {
    /// Checks settings and guides.
    pub fn new(filter: &BilateralFilter, image: &'a Image, guides: &'a [Guide<'a>]) -> Result<Self, FilterError> {
        Self::with_frames(filter, Frame { image, guides }, None)
    }

    /// As [`Self::new`], with σ_t in frames for videos.
    pub fn with_frames(
        filter: &BilateralFilter,
        frame: Frame<'a>,
        sigma_frames: Option<f32>,
    ) -> Result<Self, FilterError> {
        check("σ_s", filter.sigma_spatial, 0.1, 1000.0)?;
        if let Some(sigma) = sigma_frames {
            check("σ_t", sigma, 0.1, 100.0)?;
        }
        let window = Window {
            sigma: f64::from(filter.sigma_spatial),
            radius: filter.radius(),
            sigma_frames: sigma_frames.map_or(1.0, f64::from),
            frame_radius: sigma_frames.map_or(0, filter::window_radius),
        };
        for (index, guide) in frame.guides.iter().enumerate() {
            let size = |image: &Image| [image.width(), image.height()];
            for other in std::iter::once(guide.image).chain(guide.widths) {
                if size(other) != size(frame.image) {
                    return Err(FilterError::GuideSize { index, guide: size(other), image: size(frame.image) });
                }
            }
        }
        let mut plan = Self {
            filter: *filter,
            frame,
            window,
            level: Level::choose(filter.simd),
            precision: Precision::Full,
            sources: Vec::new(),
            plane_count: 0,
            groups: Vec::new(),
            values: (0, frame.image.channel_count()),
            value_factor: 1.0,
            opacity: Opacity::of(frame.image, filter.alpha),
        };
        plan.lay_out(Precision::Full)?;
        Ok(plan)
    }

    /// Decides on planes for a precision of the range weights.
    pub fn lay_out(&mut self, precision: Precision) -> Result<(), FilterError> {
        self.precision = precision;
        self.sources.clear();
        self.groups.clear();
        self.plane_count = 0;
        self.value_factor = 1.0;
        let (filter, frame) = (self.filter, self.frame);
        let own = frame.guides.is_empty();
        let channels = Content::Channels { scale: filter.mean_scale, opacity: self.opacity, factor: 1.0 };
        if own && filter.range.distance != Distance::DeltaE && filter.range.scale == filter.mean_scale {
            // Values and guide are the same planes.
            let factor = self.factor(&filter.range)?;
            if (1e-6..=1e6).contains(&factor) {
                let values = Content::Channels { scale: filter.mean_scale, opacity: self.opacity, factor };
                let plane = self.add(Input::Image, values);
                self.values.0 = plane;
                self.value_factor = factor;
                self.add_group(plane, self.values.1, &filter.range, None);
                return Ok(());
            }
        }
        if own {
            self.add_guide(Input::Image, &filter.range, None)?;
        }
        for (index, guide) in frame.guides.iter().enumerate() {
            self.add_guide(Input::Guide(index), &guide.range, guide.widths.map(|_| Input::Widths(index)))?;
        }
        self.values.0 = self.add(Input::Image, channels);
        Ok(())
    }

    /// What differences are multiplied with so that minus their square is the exponent to base two.
    fn factor(&self, range: &Range) -> Result<f32, FilterError> {
        check("σ_r", range.sigma, 1e-9, f32::INFINITY)?;
        let factor = (0.5 * std::f64::consts::LOG2_E * f64::from(self.precision.unit())).sqrt();
        Ok((factor / f64::from(range.sigma)) as f32)
    }

    fn add_guide(&mut self, input: Input, range: &Range, widths: Option<Input>) -> Result<(), FilterError> {
        let factor = self.factor(range)?;
        let image = self.frame.input(input);
        let (content, channels) = if range.distance == Distance::DeltaE {
            let rgb = ["R", "G", "B"].map(|name| image.channel(name));
            let [Some(r), Some(g), Some(b)] = rgb else {
                return Err(FilterError::NoColor { distance: "CIELAB ΔE", channels: image.channels().to_vec() });
            };
            (Content::Lab { rgb: [r, g, b], factor }, 3)
        } else {
            let opacity = Opacity::of(image, self.filter.alpha);
            (Content::Channels { scale: range.scale, opacity, factor }, image.channel_count())
        };
        let plane = self.add(input, content);
        let factor = widths.map(|input| self.add(input, Content::Widths { sigma: range.sigma }));
        self.add_group(plane, channels, range, factor);
        Ok(())
    }

    fn add(&mut self, input: Input, content: Content) -> usize {
        let plane = self.plane_count;
        let planes = match content {
            Content::Channels { .. } => self.frame.input(input).channel_count(),
            Content::Lab { .. } => 3,
            Content::Widths { .. } => 1,
        };
        self.sources.push(Source { input, plane, planes, content });
        self.plane_count += planes;
        plane
    }

    fn add_group(&mut self, plane: usize, channels: usize, range: &Range, factor: Option<usize>) {
        let metric = if range.distance == Distance::L1 { Metric::L1 } else { Metric::L2 };
        self.groups.push(Group { plane, channels, metric, factor });
    }

    /// The frames around the middle one of a window, without gaps, that the video has: relative to it.
    pub fn existing(&self, window: &[Option<Frame<'_>>]) -> std::ops::RangeInclusive<i32> {
        let middle = window.len() / 2;
        let exists = |t: i32| window.get((middle as i32 + t) as usize).is_some_and(Option::is_some);
        let r = self.window.frame_radius as i32;
        let first = (1..=r).take_while(|&t| exists(-t)).last().map_or(0, |t| -t);
        let last = (1..=r).take_while(|&t| exists(t)).last().unwrap_or(0);
        first..=last
    }

    /// The error of a tile that can't be addressed.
    pub fn too_large(&self) -> FilterError {
        FilterError::WindowTooLarge { window: 2 * self.window.radius + 1, channels: self.plane_count }
    }

    /// The largest number of planes that a source has.
    pub fn widest_source(&self) -> usize {
        self.sources.iter().map(|s| s.planes).max().unwrap_or(1)
    }
}

/// An error unless a width is within its domain; NaN isn't.
pub(crate) fn check(name: &'static str, value: f32, least: f32, most: f32) -> Result<(), FilterError> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(FilterError::OutOfDomain { name, value: value.into(), least: least.into(), most: most.into() })
}
