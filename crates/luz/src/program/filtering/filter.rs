//! `luz filter`

use super::arguments::{FilterArguments, MethodArguments};
use super::failure::Failure;
use super::guides::{Guides, prepare};
use super::job::{Outcome, Start, Work};
use super::selection::{Rest, Selection};
use super::ticker::Ticker;
use super::values::{GuideArgument, MethodName};
use crate::program::exit::Exit;
use luz::filter::{BilateralFilter, Filtered, Guide, Method, Progress, Sampling, VideoFilter, VideoGuide};
use luz::image::Image;
use serde::Serialize;
use std::collections::VecDeque;

/// The quality that is aimed at where nothing is said, in dB.
const QUALITY: f64 = 50.0;

/// Filters an image or a video.
pub fn run(arguments: &FilterArguments) -> Exit {
    match start(arguments) {
        Ok(exit) | Err(exit) => exit,
    }
}

fn start(arguments: &FilterArguments) -> Result<Exit, Exit> {
    let filter = settings(arguments).map_err(|failure| failure.report())?;
    let start = Start::new(&arguments.files)?;
    if arguments.sigma_temporal.is_some() && start.video().is_none() {
        return Err(Failure::Usage("--sigma-temporal is for videos; the input is one image".to_owned()).report());
    }
    let guides = Guides::open(arguments, start.video().is_some()).map_err(|failure| failure.report())?;
    if let Some(sigma) = arguments.sigma_temporal {
        // Its domain is checked before anything is read.
        VideoFilter::new(filter, sigma).map_err(|error| Failure::from(error).report())?;
    }
    #[derive(Serialize)]
    struct Settings<'a> {
        filter: BilateralFilter,
        sigma_temporal: Option<f32>,
        guides: &'a [GuideArgument],
        channels: &'a [String],
    }
    let settings = Settings {
        filter,
        sigma_temporal: arguments.sigma_temporal,
        guides: &arguments.guide,
        channels: &arguments.channels,
    };
    let mut work = FilterWork { arguments, filter, guides, video: None, rests: VecDeque::new() };
    Ok(start.run("filter", &arguments.files, &settings, &mut work))
}

/// The filter that the arguments describe, but for the scales, which depend on the image.
fn settings(arguments: &FilterArguments) -> Result<BilateralFilter, Failure> {
    let mut filter = BilateralFilter::new(arguments.sigma_spatial, arguments.sigma_range);
    filter.range.distance = arguments.distance.into();
    filter.border = arguments.border.into();
    filter.seed = arguments.method.seed;
    filter.method = method(&arguments.method)?;
    Ok(filter)
}

fn method(arguments: &MethodArguments) -> Result<Method, Failure> {
    let MethodArguments { method, quality, strategy, samples, density, regression, .. } = *arguments;
    let is_sampled = strategy.is_some() || samples.is_some() || density.is_some() || regression;
    let chosen = method.unwrap_or(if is_sampled { MethodName::Sampled } else { MethodName::Auto });
    if is_sampled && chosen != MethodName::Sampled {
        let problem = "--strategy, --samples, --density and --regression belong to --method sampled";
        return Err(Failure::Usage(problem.to_owned()));
    }
    if quality.is_some() && matches!(chosen, MethodName::Exact | MethodName::Sampled) {
        let problem = "--quality belongs to the methods auto and cosines; the others are as good as their samples";
        return Err(Failure::Usage(problem.to_owned()));
    }
    let quality = quality.unwrap_or(QUALITY);
    Ok(match chosen {
        MethodName::Auto => Method::Auto { quality },
        MethodName::Cosines => Method::Cosines { quality },
        MethodName::Exact => Method::Exact,
        MethodName::Sampled => {
            let usual = Sampling::default();
            Method::Sampled(Sampling {
                strategy: strategy.map_or(usual.strategy, Into::into),
                samples: samples.map_or(usual.samples, |s| s.0),
                density: density.map_or(usual.density, Into::into),
                regression,
                ..usual
            })
        }
    })
}

struct FilterWork<'a> {
    arguments: &'a FilterArguments,
    filter: BilateralFilter,
    guides: Guides,
    video: Option<VideoFilter>,
    /// What the frames that are being filtered have beside the channels that are filtered.
    rests: VecDeque<Rest>,
}

impl FilterWork<'_> {
    fn complete(&mut self, filtered: Filtered) -> Option<Outcome> {
        let rest = self.rests.pop_front()?;
        Some(Outcome { image: rest.put_back(filtered.image), report: filtered.report, is_display: false })
    }
}

impl Work for FilterWork<'_> {
    fn push(&mut self, image: Image, ticker: &Ticker) -> Result<Option<Outcome>, Failure> {
        let guides = self.guides.next(&image)?;
        let (mut image, rest) = Selection::new(image, &self.arguments.channels)?.into_parts();
        self.rests.push_back(rest);
        let mut filter = self.filter;
        (filter.range.scale, filter.mean_scale) = prepare(&mut image, self.arguments.scale, filter.range.distance);
        let progress = |p: Progress| ticker.update(p.done, p.total);
        let filtered = match self.arguments.sigma_temporal {
            Some(sigma) => {
                // The first frame says on which scales.
                if self.video.is_none() {
                    self.video = Some(VideoFilter::new(filter, sigma)?);
                }
                let video = self.video.as_mut();
                video.map(|video| video.push_with_progress(image, guides, &progress)).transpose()?.flatten()
            }
            None => Some(filter.apply_with_progress(&image, &borrow(&guides), &progress)?),
        };
        Ok(filtered.and_then(|filtered| self.complete(filtered)))
    }

    fn flush(&mut self, _: &Ticker) -> Result<Option<Outcome>, Failure> {
        let filtered = self.video.as_mut().map(VideoFilter::flush).transpose()?.flatten();
        Ok(filtered.and_then(|filtered| self.complete(filtered)))
    }
}

fn borrow(guides: &[VideoGuide]) -> Vec<Guide<'_>> {
    guides.iter().map(|g| Guide { image: &g.image, range: g.range, widths: g.widths.as_ref() }).collect()
}
