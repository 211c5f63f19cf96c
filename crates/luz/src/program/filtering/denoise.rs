//! `luz denoise`

use super::arguments::DenoiseArguments;
use super::failure::Failure;
use super::job::{Outcome, Start, Work};
use super::selection::{Rest, Selection};
use super::ticker::Ticker;
use crate::program::exit::Exit;
use luz::filter::uses::{NoiseFilter, RenderDenoiser, VideoDenoiser};
use luz::filter::{Filtered, Progress};
use luz::image::Image;
use std::collections::VecDeque;

/// Takes noise out of a rendering, an image or a video.
pub fn run(arguments: &DenoiseArguments) -> Exit {
    let start = match Start::new(&arguments.files) {
        Ok(start) => start,
        Err(exit) => return exit,
    };
    if start.image().is_some_and(RenderDenoiser::suits) && arguments.noise.is_none() {
        let usual = RenderDenoiser::default();
        let denoiser = RenderDenoiser {
            sigma_spatial: arguments.sigma_spatial.unwrap_or(usual.sigma_spatial),
            strength: arguments.strength,
            seed: arguments.seed,
            ..usual
        };
        return start.run("denoise", &arguments.files, &denoiser, &mut Rendering(denoiser));
    }
    let usual = NoiseFilter::default();
    let settings = NoiseFilter {
        strength: arguments.strength,
        sigma_spatial: arguments.sigma_spatial.unwrap_or(if start.video().is_some() { 1.2 } else { 2.0 }),
        sigma_temporal: arguments.sigma_temporal,
        noise: arguments.noise,
        seed: arguments.seed,
        ..usual
    };
    if start.video().is_some() {
        return match settings.video() {
            Ok(video) => {
                let mut work = Video { video, rests: VecDeque::new() };
                start.run("denoise", &arguments.files, &settings, &mut work)
            }
            Err(error) => Failure::from(error).report(),
        };
    }
    start.run("denoise", &arguments.files, &settings, &mut Still(settings))
}

struct Rendering(RenderDenoiser);

impl Work for Rendering {
    fn push(&mut self, image: Image, ticker: &Ticker) -> Result<Option<Outcome>, Failure> {
        let Filtered { image, report } = self.0.apply(&image, &|p: Progress| ticker.update(p.done, p.total))?;
        Ok(Some(Outcome { image, report, is_display: false }))
    }
}

struct Still(NoiseFilter);

impl Work for Still {
    fn push(&mut self, image: Image, ticker: &Ticker) -> Result<Option<Outcome>, Failure> {
        let (image, rest) = Selection::new(image, &[])?.into_parts();
        let filtered = self.0.image(&image, &|p: Progress| ticker.update(p.done, p.total))?;
        Ok(Some(Outcome { image: rest.put_back(filtered.image), report: filtered.report, is_display: false }))
    }
}

struct Video {
    video: VideoDenoiser,
    rests: VecDeque<Rest>,
}

impl Video {
    fn complete(&mut self, filtered: Option<Filtered>) -> Option<Outcome> {
        let Filtered { image, report } = filtered?;
        let rest = self.rests.pop_front()?;
        Some(Outcome { image: rest.put_back(image), report, is_display: false })
    }
}

impl Work for Video {
    fn push(&mut self, image: Image, ticker: &Ticker) -> Result<Option<Outcome>, Failure> {
        let (image, rest) = Selection::new(image, &[])?.into_parts();
        self.rests.push_back(rest);
        let filtered = self.video.push(image, &|p: Progress| ticker.update(p.done, p.total))?;
        Ok(self.complete(filtered))
    }

    fn flush(&mut self, _: &Ticker) -> Result<Option<Outcome>, Failure> {
        let filtered = self.video.flush()?;
        Ok(self.complete(filtered))
    }
}
