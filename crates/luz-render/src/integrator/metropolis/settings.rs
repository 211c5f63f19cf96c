//! What Metropolis light transport is to know.

use luz_sample::markov::Kernel;
use std::fmt;
use std::str::FromStr;

/// What all kinds of Metropolis light transport have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metropolis {
    /// Markov chains.
    pub chains: u64,
    /// Independent samples that the normalisation is estimated from, and chains are started at.
    pub bootstrap_samples: u64,
    /// Groups of chains, whose spread gives every pixel its error; at least [`Self::FEWEST_BATCHES`].
    pub batches: u32,
    /// Who finds direct light.
    pub direct_light: DirectLight,
    /// Is the target density divided by a coarse first image, so that dark parts of the picture get as many mutations as
    /// bright ones?
    pub two_stage: bool,
}

impl Metropolis {
    /// An error bar from fewer batches would itself have too large an error.
    pub const FEWEST_BATCHES: u32 = 16;
    /// More batches cost memory for little.
    pub const MOST_BATCHES: u32 = 1024;
    /// More chains are a slip of the keyboard.
    pub const MOST_CHAINS: u64 = 1 << 24;
    /// More candidates are a slip of the keyboard.
    pub const MOST_BOOTSTRAP_SAMPLES: u64 = 1 << 30;
}

impl Default for Metropolis {
    fn default() -> Self {
        Self {
            chains: 1024,
            bootstrap_samples: 100_000,
            batches: Self::FEWEST_BATCHES,
            direct_light: DirectLight::Inside,
            two_stage: false,
        }
    }
}

/// Who finds direct light, and light that is seen without scattering.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DirectLight {
    /// The chains.
    #[default]
    Inside,
    /// A path tracer with low-discrepancy samples; the chains are of paths of at least two scatterings.
    Separate,
}

impl DirectLight {
    /// The fewest scatterings of the paths that chains are made of.
    pub const fn min_depth(self) -> u32 {
        match self {
            Self::Inside => 0,
            Self::Separate => 2,
        }
    }
}

impl FromStr for DirectLight {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        match name {
            "inside" => Ok(Self::Inside),
            "separate" => Ok(Self::Separate),
            _ => Err(format!("unknown way of finding direct light `{name}`; known are inside, separate")),
        }
    }
}

impl fmt::Display for DirectLight {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Inside => "inside",
            Self::Separate => "separate",
        })
    }
}

/// The estimator whose numbers primary-space Metropolis mutates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PrimaryEstimator {
    /// Unidirectional path tracing.
    #[default]
    Path,
    /// Bidirectional path tracing.
    Bidirectional,
}

impl FromStr for PrimaryEstimator {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        match name {
            "path" => Ok(Self::Path),
            "bdpt" => Ok(Self::Bidirectional),
            _ => Err(format!("unknown estimator `{name}`; known are path, bdpt")),
        }
    }
}

impl fmt::Display for PrimaryEstimator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Path => "path",
            Self::Bidirectional => "bdpt",
        })
    }
}

/// The settings of primary-space Metropolis light transport (Kelemen et al. 2002).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrimarySpaceIntegrator {
    /// The longest path: how many times light may scatter before it reaches the camera.
    pub max_depth: u32,
    /// What all kinds have in common.
    pub metropolis: Metropolis,
    /// The estimator whose numbers are mutated.
    pub estimator: PrimaryEstimator,
    /// The probability of large steps, which draw all numbers afresh.
    pub large_step_probability: f64,
    /// How far small steps go.
    pub kernel: Kernel,
}

/// The settings of multiplexed Metropolis light transport (Hachisuka et al. 2014).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MultiplexedIntegrator {
    /// The longest path: how many times light may scatter before it reaches the camera.
    pub max_depth: u32,
    /// What all kinds have in common.
    pub metropolis: Metropolis,
    /// The probability of large steps, which draw all numbers afresh.
    pub large_step_probability: f64,
    /// How far small steps go.
    pub kernel: Kernel,
}

/// The settings of path-space Metropolis light transport (Veach and Guibas 1997).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathSpaceIntegrator {
    /// The longest path: how many times light may scatter before it reaches the camera.
    pub max_depth: u32,
    /// What all kinds have in common.
    pub metropolis: Metropolis,
    /// How often each mutation is proposed.
    pub mutations: MutationProbabilities,
    /// How far perturbations go.
    pub ranges: PerturbationRanges,
}

/// How often each mutation of path-space Metropolis is proposed, in proportion to their sum; none is negative, and their sum is
/// positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MutationProbabilities {
    /// Bidirectional mutations (Veach 1997, section 11.4.1), which make chains ergodic.
    pub bidirectional: f64,
    /// Lens subpath mutations (section 11.4.4).
    pub lens_subpath: f64,
    /// Lens perturbations (section 11.4.3).
    pub lens: f64,
    /// Caustic perturbations (section 11.4.3).
    pub caustic: f64,
    /// Multi-chain perturbations (section 11.4.3).
    pub multi_chain: f64,
    /// Mutations of the wavelengths alone.
    pub wavelength: f64,
}

impl MutationProbabilities {
    /// Their names on the command line.
    pub const NAMES: [&'static str; 6] =
        ["bidirectional", "lens-subpath", "lens", "caustic", "multi-chain", "wavelength"];

    /// In the order of [`Self::NAMES`].
    pub fn as_array(&self) -> [f64; 6] {
        [self.bidirectional, self.lens_subpath, self.lens, self.caustic, self.multi_chain, self.wavelength]
    }

    /// Why no mutation could be chosen by these, if so.
    pub fn problem(&self) -> Option<String> {
        let all = self.as_array();
        let is_sound = all.iter().all(|p| (0.0..f64::INFINITY).contains(p)) && all.iter().sum::<f64>() > 0.0;
        if !is_sound {
            return Some("probabilities of mutations must not be negative, nor all zero".to_owned());
        }
        let finds_paths = self.bidirectional > 0.0;
        (!finds_paths).then(|| {
            "without bidirectional mutations, chains never leave the kind of path that they begin with: their probability must \
             be positive"
                .to_owned()
        })
    }

    /// In the order of [`Self::NAMES`].
    pub fn from_array(all: [f64; 6]) -> Self {
        let [bidirectional, lens_subpath, lens, caustic, multi_chain, wavelength] = all;
        Self { bidirectional, lens_subpath, lens, caustic, multi_chain, wavelength }
    }
}

impl Default for MutationProbabilities {
    fn default() -> Self {
        Self { bidirectional: 0.25, lens_subpath: 0.15, lens: 0.2, caustic: 0.15, multi_chain: 0.15, wavelength: 0.1 }
    }
}

/// How far perturbations of path-space Metropolis go: lengths are drawn as `r₂ exp(−ln(r₂ / r₁) u)` between the smallest `r₁`
/// and the largest `r₂` (Veach 1997, section 11.4.3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PerturbationRanges {
    /// The smallest move of the film position by lens and multi-chain perturbations, in pixels.
    pub lens_smallest: f64,
    /// The largest, as the share of the film's area that a disk of that radius has.
    pub lens_area: f64,
    /// The smallest turn of directions by caustic perturbations, as the move on the film that it would be, in pixels.
    pub caustic_smallest: f64,
    /// The largest, as the share of the film's area that a disk of that radius has.
    pub caustic_area: f64,
    /// The smallest turn of the directions in which multi-chain perturbations go on from one chain to the next, in radians.
    pub multi_chain_smallest: f64,
    /// The largest, in radians.
    pub multi_chain_largest: f64,
}

impl PerturbationRanges {
    /// Their names on the command line.
    pub const NAMES: [&'static str; 6] = [
        "lens-smallest",
        "lens-area",
        "caustic-smallest",
        "caustic-area",
        "multi-chain-smallest",
        "multi-chain-largest",
    ];

    /// In the order of [`Self::NAMES`].
    pub fn as_array(&self) -> [f64; 6] {
        [
            self.lens_smallest,
            self.lens_area,
            self.caustic_smallest,
            self.caustic_area,
            self.multi_chain_smallest,
            self.multi_chain_largest,
        ]
    }

    /// In the order of [`Self::NAMES`].
    pub fn from_array(all: [f64; 6]) -> Self {
        let [lens_smallest, lens_area, caustic_smallest, caustic_area, multi_chain_smallest, multi_chain_largest] = all;
        Self { lens_smallest, lens_area, caustic_smallest, caustic_area, multi_chain_smallest, multi_chain_largest }
    }

    /// Why nothing could be drawn from these, if so.
    pub fn problem(&self) -> Option<String> {
        let all = self.as_array();
        if let Some(place) = all.iter().position(|v| !(*v > 0.0 && v.is_finite())) {
            return Some(format!(
                "the range `{}` of perturbations must be positive, not {}",
                Self::NAMES[place],
                all[place]
            ));
        }
        for (name, area) in [("lens-area", self.lens_area), ("caustic-area", self.caustic_area)] {
            if area > 1.0 {
                return Some(format!("the range `{name}` is a share of the film's area, which {area} is none of"));
            }
        }
        if self.multi_chain_smallest >= self.multi_chain_largest
            || self.multi_chain_largest > std::f64::consts::FRAC_PI_2
        {
            return Some(
                "the range of multi-chain perturbations must go from a smaller angle to a larger one, at most π/2"
                    .to_owned(),
            );
        }
        None
    }
}

impl Default for PerturbationRanges {
    /// The thesis's.
    fn default() -> Self {
        Self {
            lens_smallest: 0.1,
            lens_area: 0.05,
            caustic_smallest: 0.1,
            caustic_area: 0.05,
            multi_chain_smallest: 0.0001,
            multi_chain_largest: 0.1,
        }
    }
}
