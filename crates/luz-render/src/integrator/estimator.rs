//! What estimates pixels: a sample of a pixel that may also reach other pixels.

use super::path::PathCost;
use glam::Vec2;
use luz_color::{SampledSpectrum, Sensor, Wavelengths};
use luz_sample::Samples;

/// Where a sample of a pixel begins. The numbers for it have been drawn from dimensions 0 to
/// [`CAMERA_DIMENSIONS`](super::CAMERA_DIMENSIONS).
#[derive(Clone, Copy, Debug)]
pub struct CameraStart {
    /// The position on the film, in pixels from the frame's top left corner, drawn by the pixel filter: uniformly within the
    /// pixel for a box filter of one pixel. What the sample returns is radiance at this position, in no proportion to any
    /// density of it.
    pub film: Vec2,
    /// What the point on the lens is made from.
    pub lens_u: Vec2,
    /// What the moment is made from.
    pub time_u: f32,
}

/// An estimator of pixels: bidirectional path tracing, light tracing.
///
/// One sample is one pair of subpaths. A frame of `P` pixels with `n` samples each has `N = P n` of them, and both kinds of
/// results are normalised by the engine:
///
/// * what [`sample`](Self::sample) returns estimates the radiance at the film position that it was given, as a path tracer's
///   does; the pixel's value is its mean over the pixel's `n` samples;
/// * each *splat* estimates, for the whole film at once, a density of radiance over film positions: a splat of value
///   `f(x) / p(x)` at the film position of `x`, with `p` the density of the whole path, whatever pixel the sample is of, and the
///   importance in `f` being a density in px². A pixel's value is the mean over all `N` samples of the splats that the pixel
///   filter, normalised to 1 px², gives it. Nothing is to be divided by the number of pixels or samples.
pub trait PixelEstimator: Sync {
    /// What is kept from sample to sample to spare allocations. No sample may find out what another has left there.
    type Memory: Default + Send;

    /// One sample. Light that arrives at other film positions than `start.film` is splatted; positions may lie outside of
    /// the frame. A value that is not finite is counted by the film as dropped; so are splats.
    fn sample(
        &self,
        start: &CameraStart,
        wavelengths: &mut Wavelengths,
        samples: &mut impl Samples,
        splats: &mut Splats<'_>,
        memory: &mut Self::Memory,
        cost: &mut PathCost,
    ) -> SampledSpectrum;
}

/// The splats of one sample.
#[derive(Debug)]
pub struct Splats<'a> {
    sensor: &'a Sensor,
    all: &'a mut Vec<Splat>,
}

/// Light at a film position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Splat {
    /// In pixels from the frame's top left corner.
    pub film: Vec2,
    /// In the film's RGB.
    pub rgb: [f32; 3],
}

impl<'a> Splats<'a> {
    /// Splats are appended to a list.
    pub fn new(sensor: &'a Sensor, all: &'a mut Vec<Splat>) -> Self {
        Self { sensor, all }
    }

    /// Light `value = f(x) / p(x)` at `wavelengths` arrives at `film`, in pixels from the frame's top left corner.
    #[inline]
    pub fn add(&mut self, film: Vec2, value: SampledSpectrum, wavelengths: &Wavelengths) {
        self.all.push(Splat { film, rgb: self.sensor.to_output_rgb(value, wavelengths) });
    }
}
