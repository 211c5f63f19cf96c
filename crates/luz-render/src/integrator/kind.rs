//! Which integrator, and what it is to know.

use super::metropolis::{Metropolis, MultiplexedIntegrator, PathSpaceIntegrator, PrimarySpaceIntegrator};
use super::path::PathIntegrator;
use crate::film::SplatContents;
use luz_sample::mis::Heuristic;
use std::fmt;
use std::str::FromStr;

/// How light is transported, with the settings of each way.
#[derive(Clone, Debug, PartialEq)]
pub enum Integrator {
    /// Unidirectional path tracing.
    Path(PathIntegrator),
    /// Light tracing: paths from the lights, connected to the camera.
    Light(BidirectionalIntegrator),
    /// Bidirectional path tracing.
    Bidirectional(BidirectionalIntegrator),
    /// Metropolis light transport over the numbers that an estimator draws.
    PrimarySpace(PrimarySpaceIntegrator),
    /// Multiplexed Metropolis light transport.
    Multiplexed(MultiplexedIntegrator),
    /// Metropolis light transport over paths.
    PathSpace(PathSpaceIntegrator),
}

/// Integrators without their settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum IntegratorKind {
    /// `path`
    Path,
    /// `light`: light tracing.
    Light,
    /// `bdpt`: bidirectional path tracing (Veach 1997, chapter 10).
    Bidirectional,
    /// `pssmlt`: primary-space Metropolis (Kelemen et al. 2002).
    PrimarySpace,
    /// `mmlt`: multiplexed Metropolis (Hachisuka et al. 2014), which pbrt-v4 calls `mlt`.
    Multiplexed,
    /// `mlt`: path-space Metropolis (Veach and Guibas 1997).
    PathSpace,
}

/// The settings of light tracing and of bidirectional path tracing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BidirectionalIntegrator {
    /// The longest path: how many times light may scatter before it reaches the camera.
    pub max_depth: u32,
    /// Which techniques are used.
    pub techniques: BidirectionalTechniques,
    /// How they are weighted.
    pub heuristic: Heuristic,
}

/// Which of the techniques `(s, t)`, of `s` vertices from the light and `t` from the eye, are used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BidirectionalTechniques {
    /// All, weighted.
    #[default]
    All,
    /// Those of one eye vertex, each of which makes paths of another length: light tracing.
    Light,
    /// A single one, to be compared with others.
    One {
        /// Vertices from the light.
        s: u32,
        /// Vertices from the eye, at least one.
        t: u32,
    },
}

impl BidirectionalIntegrator {
    /// Is technique `(s, t)` used?
    #[inline]
    pub(crate) fn uses(&self, s: usize, t: usize) -> bool {
        match self.techniques {
            // The light in front of the camera is seen without any noise.
            BidirectionalTechniques::All => (s, t) != (1, 1),
            BidirectionalTechniques::Light => t == 1,
            BidirectionalTechniques::One { s: only_s, t: only_t } => (s, t) == (only_s as usize, only_t as usize),
        }
    }

    /// Are vertices made from the light?
    pub(crate) fn uses_light_walks(&self) -> bool {
        !matches!(self.techniques, BidirectionalTechniques::One { s: 0, .. })
    }

    /// Is more than one vertex made from the eye?
    pub(crate) fn uses_eye_walks(&self) -> bool {
        match self.techniques {
            BidirectionalTechniques::All => true,
            BidirectionalTechniques::Light => false,
            BidirectionalTechniques::One { t, .. } => t > 1,
        }
    }

    /// The weight of a technique, given the one that it has among all.
    #[inline]
    pub(crate) fn weight(&self, among_all: f32) -> f32 {
        if self.techniques == BidirectionalTechniques::All { among_all } else { 1.0 }
    }
}

impl IntegratorKind {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Path, Self::Light, Self::Bidirectional, Self::PrimarySpace, Self::Multiplexed, Self::PathSpace];

    /// Its name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Light => "light",
            Self::Bidirectional => "bdpt",
            Self::PrimarySpace => "pssmlt",
            Self::Multiplexed => "mmlt",
            Self::PathSpace => "mlt",
        }
    }

    /// The one that a scene file of pbrt-v4 means by a name: there, `mlt` is multiplexed and in primary space, and `lightpath`
    /// is light tracing. `None` for those that luz has nothing alike of.
    pub fn of_pbrt(name: &str) -> Option<Self> {
        match name {
            "path" | "volpath" => Some(Self::Path),
            "lightpath" => Some(Self::Light),
            "bdpt" => Some(Self::Bidirectional),
            "mlt" => Some(Self::Multiplexed),
            _ => None,
        }
    }

    /// Is it made of Markov chains?
    pub const fn is_metropolis(self) -> bool {
        matches!(self, Self::PrimarySpace | Self::Multiplexed | Self::PathSpace)
    }
}

impl fmt::Display for IntegratorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for IntegratorKind {
    type Err = String;

    /// Reads `path`, `light`, `bdpt`, `pssmlt`, `mmlt` or `mlt`.
    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|kind| kind.name() == text);
        found.ok_or_else(|| format!("`{text}` is no integrator: expected path, light, bdpt, pssmlt, mmlt or mlt"))
    }
}

impl Integrator {
    /// Which one it is.
    pub fn kind(&self) -> IntegratorKind {
        match self {
            Self::Path(_) => IntegratorKind::Path,
            Self::Light(_) => IntegratorKind::Light,
            Self::Bidirectional(_) => IntegratorKind::Bidirectional,
            Self::PrimarySpace(_) => IntegratorKind::PrimarySpace,
            Self::Multiplexed(_) => IntegratorKind::Multiplexed,
            Self::PathSpace(_) => IntegratorKind::PathSpace,
        }
    }

    /// The longest path: how many times light may scatter before it reaches the camera.
    pub fn max_depth(&self) -> u32 {
        match self {
            Self::Path(path) => path.max_depth,
            Self::Light(settings) | Self::Bidirectional(settings) => settings.max_depth,
            Self::PrimarySpace(settings) => settings.max_depth,
            Self::Multiplexed(settings) => settings.max_depth,
            Self::PathSpace(settings) => settings.max_depth,
        }
    }

    /// The path tracer's settings, for what only path tracing can do.
    pub fn path(&self) -> Option<&PathIntegrator> {
        if let Self::Path(path) = self { Some(path) } else { None }
    }

    /// As [`path`](Self::path), to be changed.
    pub fn path_mut(&mut self) -> Option<&mut PathIntegrator> {
        if let Self::Path(path) = self { Some(path) } else { None }
    }

    /// What all integrators of Markov chains have in common.
    pub fn metropolis(&self) -> Option<&Metropolis> {
        match self {
            Self::Path(_) | Self::Light(_) | Self::Bidirectional(_) => None,
            Self::PrimarySpace(settings) => Some(&settings.metropolis),
            Self::Multiplexed(settings) => Some(&settings.metropolis),
            Self::PathSpace(settings) => Some(&settings.metropolis),
        }
    }

    /// As [`metropolis`](Self::metropolis), to be changed.
    pub fn metropolis_mut(&mut self) -> Option<&mut Metropolis> {
        match self {
            Self::Path(_) | Self::Light(_) | Self::Bidirectional(_) => None,
            Self::PrimarySpace(settings) => Some(&mut settings.metropolis),
            Self::Multiplexed(settings) => Some(&mut settings.metropolis),
            Self::PathSpace(settings) => Some(&mut settings.metropolis),
        }
    }

    /// What the film keeps of splats.
    pub fn splat_contents(&self) -> SplatContents {
        match (self.metropolis(), self) {
            (Some(metropolis), _) => SplatContents::Batches(metropolis.batches),
            (None, Self::Path(_)) => SplatContents::None,
            (None, _) => SplatContents::Paths,
        }
    }
}
