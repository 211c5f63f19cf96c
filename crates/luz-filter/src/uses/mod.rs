//! What the bilateral filter is good for: tone mapping, enhancing detail, taking noise out of videos and renderings.

mod denoise_render;
mod denoise_video;

mod detail;
mod noise;
mod tone_map;

pub use denoise_render::RenderDenoiser;
pub use denoise_video::{NoiseFilter, VideoDenoiser};
pub use detail::DetailEnhancement;
pub use noise::noise_level;
pub use tone_map::LocalToneMap;

use luz_image::Image;

use crate::FilterError;

/// The positions of R, G and B; of Y three times for grey.
fn color(image: &Image) -> Result<[usize; 3], FilterError> {
    let single = (image.channel_count() == 1).then_some([0; 3]);
    image
        .rgb()
        .or(single)
        .ok_or_else(|| FilterError::NoColor { distance: "luminance", channels: image.channels().to_vec() })
}

/// The weights of R, G and B in luminance, for sRGB's primaries.
const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];
