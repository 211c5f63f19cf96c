//! `luz tonemap`

use super::arguments::TonemapArguments;
use super::failure::Failure;
use super::job::{Outcome, Start, Work};
use super::ticker::Ticker;
use crate::program::exit::Exit;
use luz::filter::uses::LocalToneMap;
use luz::filter::{Method, Progress};
use luz::image::Image;

/// Tone maps an image.
pub fn run(arguments: &TonemapArguments) -> Exit {
    let map = LocalToneMap {
        contrast: arguments.contrast,
        detail: arguments.detail,
        saturation: arguments.saturation,
        exposure: arguments.exposure,
        sigma_spatial: arguments.sigma_spatial,
        sigma_range: arguments.sigma_range,
        method: Method::Auto { quality: arguments.quality },
    };
    match Start::new(&arguments.files) {
        Ok(start) => start.run("tonemap", &arguments.files, &map, &mut Mapping(map)),
        Err(exit) => exit,
    }
}

struct Mapping(LocalToneMap);

impl Work for Mapping {
    fn push(&mut self, mut image: Image, ticker: &Ticker) -> Result<Option<Outcome>, Failure> {
        image.decode_stored();
        let (image, report) = self.0.apply(&image, &|p: Progress| ticker.update(p.done, p.total))?;
        Ok(Some(Outcome { image, report, is_display: true }))
    }
}
