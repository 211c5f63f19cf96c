//! Which light to ask.

use super::bounds::LightBounds;
use super::hierarchy::LightHierarchy;
use super::{Combination, Light, LightContext};
use luz_geometry::Reference;
use luz_sample::ONE_MINUS_EPSILON;
use luz_sample::distribution::{Discrete, DistributionError};
use std::fmt;
use std::str::FromStr;

/// The share of choices that is spread evenly. By power alone, a weak light near a surface that a strong one hardly
/// reaches would be asked too rarely: little of the picture's error, but pixels full of fireflies.
const EVEN_SHARE: f64 = 0.25;

/// The share of choices that is spread evenly over the lights at infinity and those in the scene: which of the two
/// something stands in the way of, no estimate knows.
const EVEN_SIDES: f32 = 0.5;

/// How a light is chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum LightSampler {
    /// Each light as likely as any other.
    Uniform,
    /// In proportion to power, a quarter of the choices evenly.
    Power,
    /// By a tree over the lights, in proportion to about what each gives where it is asked from; where there is but one
    /// lamp, of a primitive or two, as [`Power`](Self::Power).
    #[default]
    Bvh,
}

impl LightSampler {
    /// All, by the names of scene files.
    pub const ALL: [(&'static str, Self); 3] = [("uniform", Self::Uniform), ("power", Self::Power), ("bvh", Self::Bvh)];
}

impl FromStr for LightSampler {
    type Err = String;
    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL
            .iter()
            .find(|(known, _)| *known == name)
            .map(|(_, sampler)| *sampler)
            .ok_or_else(|| format!("unknown light sampler `{name}`; known are bvh, power, uniform"))
    }
}

impl fmt::Display for LightSampler {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Self::ALL.iter().find(|(_, sampler)| sampler == self).map_or(Ok(()), |(name, _)| f.write_str(name))
    }
}

/// Chooses a light, with a known probability. Lights that give nothing, or leave all to the BSDF where they may, are
/// never chosen.
#[derive(Clone, Debug)]
pub struct LightSelection {
    choice: Choice,
    /// The choice of where paths begin that are traced from lights.
    emitters: Discrete,
}

/// How a light is chosen from a point.
#[derive(Clone, Debug)]
enum Choice {
    /// With the same probabilities from everywhere.
    Fixed(ByCombination<Discrete>),
    /// As it matters where it is asked from.
    Hierarchy(Box<HierarchySelection>),
}

/// One for each [`Combination`].
#[derive(Clone, Debug)]
pub struct ByCombination<T> {
    alone: T,
    with_bsdf: T,
}

impl<T> ByCombination<T> {
    #[inline]
    fn get(&self, combination: Combination) -> &T {
        match combination {
            Combination::Alone => &self.alone,
            Combination::WithBsdf => &self.with_bsdf,
        }
    }

    fn try_new<E>(mut make: impl FnMut(Combination) -> Result<T, E>) -> Result<Self, E> {
        Ok(Self { alone: make(Combination::Alone)?, with_bsdf: make(Combination::WithBsdf)? })
    }
}

impl LightSelection {
    /// The choice among `lights` of a world in a sphere of `scene_radius`.
    ///
    /// # Errors
    /// If a light's power is negative or not finite.
    pub fn new(
        sampler: LightSampler,
        lights: &[Light],
        context: LightContext<'_>,
        scene_radius: f32,
    ) -> Result<Self, DistributionError> {
        let powers = |combination| {
            let context = LightContext { combination, ..context };
            lights.iter().map(move |light| light.power(context, scene_radius))
        };
        let by_power = |combination| {
            let powers: Vec<f64> = powers(combination).collect();
            table(&mostly_by_power(&powers))
        };
        let choice = match sampler {
            LightSampler::Uniform => Choice::Fixed(ByCombination::try_new(|combination| {
                let weights: Vec<f32> = powers(combination).map(|p| if p > 0.0 { 1.0 } else { 0.0 }).collect();
                table(&weights)
            })?),
            LightSampler::Bvh if is_hierarchy_of_use(lights) => {
                Choice::Hierarchy(Box::new(HierarchySelection::new(lights, context)?))
            }
            LightSampler::Power | LightSampler::Bvh => Choice::Fixed(ByCombination::try_new(by_power)?),
        };
        Ok(Self { choice, emitters: by_power(Combination::Alone)? })
    }

    /// A light's number as seen from `reference`, the probability of choosing it, and a fresh number in `[0, 1)` made of
    /// what choosing has left of `u`; `None` if no light is to be asked.
    #[inline(always)]
    pub fn sample(&self, combination: Combination, reference: &Reference, u: f32) -> Option<(usize, f32, f32)> {
        match &self.choice {
            Choice::Fixed(tables) => {
                Some(tables.get(combination).sample(u)).filter(|(_, probability, _)| *probability > 0.0)
            }
            Choice::Hierarchy(hierarchy) => hierarchy.sample(combination, reference, u),
        }
    }

    /// The probability of choosing a light from `reference`.
    #[inline]
    pub fn probability(&self, combination: Combination, reference: &Reference, light: usize) -> f32 {
        match &self.choice {
            Choice::Fixed(tables) => tables.get(combination).probability(light),
            Choice::Hierarchy(hierarchy) => hierarchy.probability(combination, reference, light),
        }
    }

    /// A light's number for a path that is traced from it, mostly by power and the same from everywhere, with its
    /// probability and a fresh number as from [`sample`](Self::sample).
    #[inline]
    pub fn sample_emitter(&self, u: f32) -> Option<(usize, f32, f32)> {
        Some(self.emitters.sample(u)).filter(|(_, probability, _)| *probability > 0.0)
    }

    /// The probability of [`sample_emitter`](Self::sample_emitter).
    #[inline]
    pub fn emitter_probability(&self, light: usize) -> f32 {
        self.emitters.probability(light)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let choice = match &self.choice {
            Choice::Fixed(tables) => 48 * tables.alone.len(),
            Choice::Hierarchy(hierarchy) => hierarchy.tree.bytes() + hierarchy.far_index.len() * size_of::<u32>(),
        };
        choice + 24 * self.emitters.len()
    }
}

/// Whether it matters where the choice among lights is made from: not for one lamp of a primitive or two.
fn is_hierarchy_of_use(lights: &[Light]) -> bool {
    match lights {
        [] | [_] => false,
        [Light::Area(a), Light::Area(b)] => a.shape != b.shape,
        _ => true,
    }
}

/// A table of weights; of none, one that chooses nothing.
fn table(weights: &[f32]) -> Result<Discrete, DistributionError> {
    Discrete::new(if weights.is_empty() { &[0.0] } else { weights })
}

/// Weights of which most follow power and a share is even, among all that have any.
fn mostly_by_power(powers: &[f64]) -> Vec<f32> {
    let total: f64 = powers.iter().sum();
    let even = EVEN_SHARE / powers.iter().filter(|p| **p > 0.0).count() as f64;
    powers.iter().map(|&p| if p > 0.0 { ((1.0 - EVEN_SHARE) * p / total + even) as f32 } else { p as f32 }).collect()
}

/// The choice by a tree over the lights that have a place, and by a table over those at infinity.
#[derive(Clone, Debug)]
pub struct HierarchySelection {
    tree: LightHierarchy,
    /// The lights at infinity.
    far: Vec<u32>,
    far_tables: ByCombination<FarTable>,
    /// For every light its index in `far`, or [`NEAR`].
    far_index: Vec<u32>,
}

const NEAR: u32 = u32::MAX;

#[derive(Clone, Debug)]
struct FarTable {
    table: Discrete,
    /// The irradiance of all together.
    irradiance: f32,
}

impl HierarchySelection {
    fn new(lights: &[Light], context: LightContext<'_>) -> Result<Self, DistributionError> {
        let bounds: Vec<Option<LightBounds>> = lights.iter().map(|light| light.bounds(context)).collect();
        let mut far = Vec::new();
        let far_index = bounds
            .iter()
            .enumerate()
            .map(|(light, bounds)| match bounds {
                Some(_) => NEAR,
                None => {
                    far.push(light as u32);
                    far.len() as u32 - 1
                }
            })
            .collect();
        let far_tables = ByCombination::try_new(|combination| {
            let context = LightContext { combination, ..context };
            let powers: Vec<f64> = far.iter().map(|&light| lights[light as usize].far_irradiance(context)).collect();
            let irradiance = powers.iter().sum::<f64>() as f32;
            Ok(FarTable { table: table(&mostly_by_power(&powers))?, irradiance })
        })?;
        let near = bounds.iter().enumerate().filter_map(|(light, bounds)| Some((light as u32, (*bounds)?)));
        let tree = LightHierarchy::new(near, lights.len());
        Ok(Self { tree, far, far_tables, far_index })
    }

    /// The probability of choosing among the lights at infinity, where those in the scene give about `near`.
    #[inline]
    fn far_share(far: &FarTable, near: f32) -> f32 {
        if far.irradiance <= 0.0 {
            return 0.0;
        }
        if near <= 0.0 {
            return 1.0;
        }
        let estimate = far.irradiance / (far.irradiance + near);
        EVEN_SIDES * 0.5 + (1.0 - EVEN_SIDES) * estimate
    }

    #[inline(never)]
    fn sample(&self, combination: Combination, reference: &Reference, u: f32) -> Option<(usize, f32, f32)> {
        let far = self.far_tables.get(combination);
        let near = self.tree.seen_from(reference);
        let share = Self::far_share(far, near.importance());
        let rescaled = |u: f32| u.min(ONE_MINUS_EPSILON);
        if u < share {
            let (index, probability, u) = far.table.sample(rescaled(u / share));
            return (probability > 0.0).then(|| (self.far[index] as usize, probability * share, u));
        }
        let (light, probability, u) = near.sample(rescaled((u - share) / (1.0 - share)))?;
        Some((light, probability * (1.0 - share), u))
    }

    #[inline]
    fn probability(&self, combination: Combination, reference: &Reference, light: usize) -> f32 {
        let far = self.far_tables.get(combination);
        let near = self.tree.seen_from(reference);
        let share = Self::far_share(far, near.importance());
        match self.far_index[light] {
            NEAR if share < 1.0 => (1.0 - share) * near.probability(light),
            NEAR => 0.0,
            index => share * far.table.probability(index as usize),
        }
    }
}
