//! How a scene is to be rendered, as its file says and as the caller wishes otherwise.

use crate::bsdf::CoatWeights;
use crate::film::{FilmContents, FilmKind, FilmLayers, FilmWindow, Filter, PixelBounds};
use crate::integrator::metropolis::{DirectLight, MutationProbabilities, PerturbationRanges, PrimaryEstimator};
use crate::integrator::{Integrator, IntegratorKind, Technique};
use crate::light::{LightSampler, ScaledSpectrum};
use glam::Vec2;
use luz_color::{RgbColorSpace, Sensor};
use luz_sample::SamplerKind;
use luz_sample::markov::Kernel;
use luz_sample::mis::Heuristic;
use luz_sample::roulette::Roulette;

/// How a scene is to be rendered.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Width and height of the whole frame in pixels.
    pub resolution: [u32; 2],
    /// The part of the frame that is rendered.
    pub bounds: PixelBounds,
    /// What the film measures.
    pub film: FilmKind,
    /// Does the film keep what each technique of finding direct light contributes?
    pub technique_images: bool,
    /// The pixel filter.
    pub filter: Filter,
    /// From radiance to RGB.
    pub sensor: Sensor,
    /// The colour space of that RGB.
    pub color_space: &'static RgbColorSpace,
    /// Light that the sensor sees as RGB (1, 1, 1), whatever the exposure: what reflectances are shown under.
    pub white: ScaledSpectrum,
    /// A sample's RGB is scaled down so that no component exceeds this; infinite for no limit.
    pub max_component: f32,
    /// The integrator.
    pub integrator: Integrator,
    /// The sequence that samples are drawn from.
    pub sampler: SamplerKind,
    /// Samples per pixel, for which the sampler's points are laid out.
    pub samples_per_pixel: u32,
    /// The most samples that a pixel gets: other than `samples_per_pixel` where something else says when it is enough.
    pub sample_limit: u32,
    /// The relative error at which a pixel has samples enough, for adaptive sampling; see [`adaptive`](crate::adaptive).
    pub adaptive: Option<f64>,
    /// The seed of all random numbers.
    pub seed: u64,
    /// The file that the scene wants its picture in.
    pub filename: Option<String>,
}

impl Settings {
    /// What the film keeps.
    pub fn film_contents(&self) -> FilmContents {
        FilmContents {
            layers: FilmLayers { features: self.film == FilmKind::GBuffer, techniques: self.technique_images },
            halves: self.adaptive.is_some(),
            signed: self.filter.is_signed(),
            splats: self.integrator.splat_contents(),
        }
    }

    /// The film positions that any pixel filter of the picture reaches: the pixels themselves under a box filter of one pixel, more
    /// under wider ones. Whoever draws film positions for splats draws them from here; the frame's edges would be darker otherwise.
    pub fn film_window(&self) -> FilmWindow {
        let PixelBounds { x0, y0, x1, y1 } = self.bounds;
        let beyond = self.filter.radius() - 0.5;
        let corner = |x: u32, y: u32| Vec2::new(x as f32, y as f32);
        FilmWindow { min: corner(x0, y0) - beyond, max: corner(x1, y1) + beyond }
    }
}

/// A window of the frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Crop {
    /// In fractions of the frame: x0, x1, y0, y1.
    Fraction([f32; 4]),
    /// In pixels: x0, x1, y0, y1.
    Pixels([u32; 4]),
}

/// What the caller wishes instead of what the scene says.
#[derive(Clone, Debug, Default)]
pub struct Overrides {
    /// Width and height of the whole frame in pixels.
    pub resolution: Option<[u32; 2]>,
    /// The part of the frame that is rendered.
    pub crop: Option<Crop>,
    /// Samples per pixel.
    pub samples_per_pixel: Option<u32>,
    /// The most samples that a pixel gets, if not as many as there are samples per pixel.
    pub sample_limit: Option<u32>,
    /// The seed of all random numbers.
    pub seed: Option<u64>,
    /// The sequence that samples are drawn from.
    pub sampler: Option<SamplerKind>,
    /// The longest path.
    pub max_depth: Option<u32>,
    /// The integrator.
    pub integrator: Option<IntegratorKind>,
    /// How Metropolis light transport is done.
    pub metropolis: MetropolisOverrides,
    /// How lights are chosen.
    pub light_sampler: Option<LightSampler>,
    /// Whether environment maps leave dim directions to the BSDF where both are combined (MIS compensation); so if not
    /// said.
    pub mis_compensation: Option<bool>,
    /// Whether points of surfaces that shine with an image are drawn by it; so if not said.
    pub emission_images: Option<bool>,
    /// The pixel filter.
    pub filter: Option<Filter>,
    /// What the film measures.
    pub film: Option<FilmKind>,
    /// Lets the film keep what each technique of finding direct light contributes.
    pub technique_images: bool,
    /// Which techniques look for direct light.
    pub technique: Option<Technique>,
    /// How they are combined.
    pub heuristic: Option<Heuristic>,
    /// How paths end before they are longest.
    pub roulette: Option<Roulette>,
    /// The relative error at which a pixel has samples enough.
    pub adaptive: Option<f64>,
    /// How walks within rough coats are weighted; pbrt-v4's weights make them too bright, as its pictures have them.
    pub coat_weights: CoatWeights,
}

/// What the caller wishes of Metropolis light transport. What is not said is as the scene says, or as [`Metropolis`] has it.
///
/// [`Metropolis`]: crate::integrator::metropolis::Metropolis
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MetropolisOverrides {
    /// Markov chains.
    pub chains: Option<u64>,
    /// Independent samples that the normalisation is estimated from.
    pub bootstrap_samples: Option<u64>,
    /// Groups of chains, whose spread gives every pixel its error.
    pub batches: Option<u32>,
    /// Who finds direct light.
    pub direct_light: Option<DirectLight>,
    /// Two-stage Metropolis.
    pub two_stage: bool,
    /// The estimator whose numbers primary-space Metropolis mutates.
    pub estimator: Option<PrimaryEstimator>,
    /// The probability of large steps.
    pub large_step_probability: Option<f64>,
    /// How far small steps go.
    pub kernel: Option<Kernel>,
    /// How often each mutation of path-space Metropolis is proposed.
    pub mutations: Option<MutationProbabilities>,
    /// How far its perturbations go.
    pub ranges: Option<PerturbationRanges>,
}
