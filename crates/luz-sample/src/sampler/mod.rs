//! The samplers of pixels, behind one type.
//!
//! A [`Sampler`] is shared by all threads. The numbers of a sample are a pure function of (seed, pixel, sample index,
//! dimension), whoever asks for them and in whichever order. A new sampler is a new file here that implements [`Points`], and
//! a line in each of the enumerations below.

mod halton;
mod order;
mod sobol;
mod stratified;
mod zsobol;

use std::fmt;
use std::str::FromStr;

use glam::Vec2;

use crate::Samples;
use crate::random::{Random, stream_key, unit_f32};
use halton::Halton;
use sobol::Sobol;
use stratified::Stratified;
use zsobol::ZSobol;

/// The kinds of [`Sampler`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum SamplerKind {
    /// Independent uniform numbers. The yardstick of the others.
    Independent,
    /// Jittered strata, in each dimension and each pair of dimensions. Needs to know the sample count; further samples start
    /// another round of strata.
    Stratified,
    /// The Halton sequence with nested random maps of digits. Any sample count; slower than the others; dimensions
    /// beyond the 128th are padded.
    Halton,
    /// Pairs of dimensions from the Owen-scrambled Sobol sequence, shuffled for each pair and pixel. Any sample count, powers
    /// of two are best.
    #[default]
    Sobol,
    /// As `Sobol`, with the sequence distributed over the pixels in shuffled Z-order, so that the errors of neighbouring
    /// pixels cancel: they look like blue noise. Rounds the sample count up to a power of two.
    ZSobol,
}

impl SamplerKind {
    /// All kinds.
    pub const ALL: [Self; 5] = [Self::Independent, Self::Stratified, Self::Halton, Self::Sobol, Self::ZSobol];

    const fn name(self) -> &'static str {
        match self {
            Self::Independent => "independent",
            Self::Stratified => "stratified",
            Self::Halton => "halton",
            Self::Sobol => "sobol",
            Self::ZSobol => "zsobol",
        }
    }
}

impl fmt::Display for SamplerKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A text that names no [`SamplerKind`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParseSamplerKindError {
    text: String,
}

impl fmt::Display for ParseSamplerKindError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}` is no sampler: expected one of", self.text)?;
        SamplerKind::ALL.iter().try_for_each(|kind| write!(f, " `{kind}`"))
    }
}

impl std::error::Error for ParseSamplerKindError {}

impl FromStr for SamplerKind {
    type Err = ParseSamplerKindError;

    /// Reads `independent`, `stratified`, `halton`, `sobol` or `zsobol`.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let found = Self::ALL.into_iter().find(|kind| kind.name() == text);
        found.ok_or_else(|| ParseSamplerKindError { text: text.to_owned() })
    }
}

/// What a [`Sampler`] needs to know.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SamplerConfig {
    /// How many samples a pixel is going to have; zero counts as one. More may be asked for, with less stratification between
    /// these and the further ones where the kind says so.
    pub samples_per_pixel: u32,
    /// Width and height of the image in pixels. Pixels beyond have numbers as good as any.
    pub resolution: [u32; 2],
    /// Different seeds give independent numbers.
    pub seed: u64,
}

/// The points of one pixel's sample, as a function of the dimension.
trait Points {
    /// The number of a dimension, as 32 bits.
    fn point_1d(&self, dimension: u32) -> u32;

    /// The numbers of a dimension and the next one, stratified together, as 32 bits each.
    fn point_2d(&self, dimension: u32) -> [u32; 2];
}

/// The source of the numbers of all samples of all pixels.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    kind: SamplerKind,
    config: SamplerConfig,
}

impl Sampler {
    /// A sampler of the given kind.
    pub fn new(kind: SamplerKind, config: SamplerConfig) -> Self {
        Self { kind, config: SamplerConfig { samples_per_pixel: config.samples_per_pixel.max(1), ..config } }
    }

    /// Its kind.
    pub fn kind(&self) -> SamplerKind {
        self.kind
    }

    /// What it was made from; at least one sample per pixel.
    pub fn config(&self) -> &SamplerConfig {
        &self.config
    }

    /// The numbers of a sample of a pixel, from dimension 0.
    #[inline]
    pub fn samples(&self, pixel: [u32; 2], sample_index: u32) -> PixelSamples<'_> {
        let SamplerConfig { samples_per_pixel, seed, .. } = self.config;
        let key = stream_key(seed, u64::from(pixel[1]) << 32 | u64::from(pixel[0]));
        let state = match self.kind {
            SamplerKind::Independent => State::Independent(Random::of_stream(key, u64::from(sample_index))),
            SamplerKind::Stratified => State::Stratified(Stratified::new(key, samples_per_pixel, sample_index)),
            SamplerKind::Halton => State::Halton(Halton::new(key, samples_per_pixel, sample_index)),
            SamplerKind::Sobol => State::Sobol(Sobol::new(key, samples_per_pixel, sample_index)),
            SamplerKind::ZSobol => State::ZSobol(ZSobol::new(seed, pixel, samples_per_pixel, sample_index)),
        };
        PixelSamples { state, dimension: 0, sampler: self }
    }
}

#[derive(Clone, Copy, Debug)]
enum State {
    Independent(Random),
    Stratified(Stratified),
    Halton(Halton),
    Sobol(Sobol),
    ZSobol(ZSobol),
}

impl State {
    /// [`Points::point_1d`] of the kinds that are not inlined everywhere.
    #[inline(never)]
    fn other_1d(&self, dimension: u32) -> u32 {
        match self {
            Self::Independent(points) => points.point_1d(dimension),
            Self::Stratified(points) => points.point_1d(dimension),
            Self::Halton(points) => points.point_1d(dimension),
            Self::Sobol(points) => points.point_1d(dimension),
            Self::ZSobol(points) => points.point_1d(dimension),
        }
    }

    /// [`Points::point_2d`] of the kinds that are not inlined everywhere.
    #[inline(never)]
    fn other_2d(&self, dimension: u32) -> [u32; 2] {
        match self {
            Self::Independent(points) => points.point_2d(dimension),
            Self::Stratified(points) => points.point_2d(dimension),
            Self::Halton(points) => points.point_2d(dimension),
            Self::Sobol(points) => points.point_2d(dimension),
            Self::ZSobol(points) => points.point_2d(dimension),
        }
    }
}

/// The numbers of one sample of one pixel.
///
/// What is drawn at a dimension depends on the dimension and on whether one or two are drawn together, on nothing else.
#[derive(Clone, Copy, Debug)]
pub struct PixelSamples<'a> {
    state: State,
    dimension: u32,
    sampler: &'a Sampler,
}

impl PixelSamples<'_> {
    /// The dimension to be drawn next.
    #[inline]
    pub fn dimension(&self) -> u32 {
        self.dimension
    }

    /// The sampler that it belongs to.
    #[inline]
    pub fn sampler(&self) -> &Sampler {
        self.sampler
    }
}

impl Samples for PixelSamples<'_> {
    #[inline]
    fn next_1d(&mut self) -> f32 {
        let d = self.dimension;
        self.dimension = d.wrapping_add(1);
        unit_f32(match &self.state {
            State::Sobol(points) => points.point_1d(d),
            other => other.other_1d(d),
        })
    }

    #[inline]
    fn next_2d(&mut self) -> Vec2 {
        let d = self.dimension;
        self.dimension = d.wrapping_add(2);
        let [x, y] = match &self.state {
            State::Sobol(points) => points.point_2d(d),
            other => other.other_2d(d),
        };
        Vec2::new(unit_f32(x), unit_f32(y))
    }

    #[inline]
    fn set_dimension(&mut self, dimension: u32) {
        self.dimension = dimension;
    }
}

impl Points for Random {
    #[inline(always)]
    fn point_1d(&self, dimension: u32) -> u32 {
        (self.at(dimension) >> 32) as u32
    }

    #[inline(always)]
    fn point_2d(&self, dimension: u32) -> [u32; 2] {
        let bits = self.at(dimension);
        [(bits >> 32) as u32, bits as u32]
    }
}
