//! What counts as similar: range distances, the scale of values, guides.

use luz_image::Image;
use serde::Serialize;

/// The distance of two colours in the range Gaussian `g_r`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
pub enum Distance {
    /// The root of the sum of squared differences over all channels.
    #[default]
    L2,
    /// The sum of absolute differences over all channels.
    L1,
    /// The colour difference ΔE*₇₆ of CIELAB under white D65, for linear R, G and B with sRGB's primaries; white has
    /// L* = 100. A just noticeable difference is about 2.3.
    DeltaE,
}

/// The scale on which values are compared, or averaged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
pub enum Scale {
    /// As they are.
    #[default]
    Linear,
    /// Encoded with sRGB's transfer function, for linear values that are to be treated as one sees them.
    Encoded,
    /// Their natural logarithm, for high dynamic range: a difference of `σ` is a ratio of `e^σ`. Values below
    /// [`Scale::LOG_FLOOR`] count as that.
    Log,
}

impl Scale {
    /// The least value whose logarithm is taken.
    pub const LOG_FLOOR: f32 = 1e-6;
}

/// The range Gaussian `g_r(d) = exp(−d² / 2σ²)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Range {
    /// Its width σ_r, in the unit of the distance: from 10⁻⁹ to infinity, where the filter is a Gaussian blur.
    pub sigma: f32,
    /// Of what.
    pub distance: Distance,
    /// On which scale distances are taken; [`Distance::DeltaE`] has its own, and ignores it.
    pub scale: Scale,
}

impl Range {
    /// L2 distances of values as they are.
    pub fn new(sigma: f32) -> Self {
        Self { sigma, distance: Distance::L2, scale: Scale::Linear }
    }
}

/// An image of the same size that says what is similar.
#[derive(Clone, Copy, Debug)]
pub struct Guide<'a> {
    /// Its channels, all of which enter the distance.
    pub image: &'a Image,
    /// The range Gaussian of this guide. Those of several guides are multiplied.
    pub range: Range,
    /// Widths of their own for the neighbourhoods of each pixel, in the unit of the distance: the first channel of an
    /// image of the same size. Where it is given, `range.sigma` only sets the scale; widths are clamped to
    /// `range.sigma · [10⁻³, 10³]`.
    pub widths: Option<&'a Image>,
}

impl<'a> Guide<'a> {
    /// A guide with L2 distances of values as they are.
    pub fn new(image: &'a Image, sigma: f32) -> Self {
        Self { image, range: Range::new(sigma), widths: None }
    }
}
