//! `luz enhance`

use super::arguments::EnhanceArguments;
use super::failure::Failure;
use super::job::{Outcome, Start, Work};
use super::ticker::Ticker;
use crate::program::exit::Exit;
use luz::filter::uses::DetailEnhancement;
use luz::filter::{Method, Progress, Scale};
use luz::image::Image;

/// Enhances the detail of an image or a video.
pub fn run(arguments: &EnhanceArguments) -> Exit {
    let enhancement = DetailEnhancement {
        strength: arguments.strength,
        sigma_spatial: arguments.sigma_spatial,
        sigma_range: arguments.sigma_range,
        method: Method::Auto { quality: arguments.quality },
        scale: Scale::Linear,
    };
    match Start::new(&arguments.files) {
        Ok(start) => start.run("enhance", &arguments.files, &enhancement, &mut Enhancing(enhancement)),
        Err(exit) => exit,
    }
}

struct Enhancing(DetailEnhancement);

impl Work for Enhancing {
    fn push(&mut self, image: Image, ticker: &Ticker) -> Result<Option<Outcome>, Failure> {
        // Encoded values are nearly logarithms of light already.
        let scale = if image.metadata.stored_encoding.is_some() { Scale::Linear } else { Scale::Log };
        let enhancement = DetailEnhancement { scale, ..self.0 };
        let (image, report) = enhancement.apply(&image, &|p: Progress| ticker.update(p.done, p.total))?;
        Ok(Some(Outcome { image, report, is_display: false }))
    }
}
