//! What a film keeps beside colour and variance: layers of further channels.

use serde::{Deserialize, Serialize};

/// Which layers a film has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FilmLayers {
    /// What the camera sees first: albedo, normals, position, depth.
    pub features: bool,
    /// What each technique of finding direct light contributes.
    pub techniques: bool,
}

impl FilmLayers {
    /// The names of the channels.
    pub fn channels(self) -> Vec<&'static str> {
        let features = if self.features { &FEATURE_CHANNELS[..] } else { &[] };
        let techniques = if self.techniques { &TECHNIQUE_CHANNELS[..] } else { &[] };
        features.iter().chain(techniques).copied().collect()
    }

    /// The number of channels.
    pub fn len(self) -> usize {
        usize::from(self.features) * FEATURES + usize::from(self.techniques) * TECHNIQUES
    }

    /// Are there none?
    pub fn is_empty(self) -> bool {
        self.len() == 0
    }
}

/// What a camera ray met first, as the `gbuffer` film keeps it; world space.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Features {
    /// Directional albedo in the film's RGB.
    pub albedo: [f32; 3],
    /// Geometric normal.
    pub normal: [f32; 3],
    /// Shading normal.
    pub shading_normal: [f32; 3],
    /// Position.
    pub position: [f32; 3],
    /// Distance from the camera's ray origin.
    pub depth: f32,
}

const FEATURES: usize = 13;

impl Features {
    fn as_array(&self) -> [f32; FEATURES] {
        let mut all = [0.0; FEATURES];
        all[0..3].copy_from_slice(&self.albedo);
        all[3..6].copy_from_slice(&self.normal);
        all[6..9].copy_from_slice(&self.shading_normal);
        all[9..12].copy_from_slice(&self.position);
        all[12] = self.depth;
        all
    }
}

const FEATURE_CHANNELS: [&str; FEATURES] =
    ["Albedo.R", "Albedo.G", "Albedo.B", "N.X", "N.Y", "N.Z", "Ns.X", "Ns.Y", "Ns.Z", "P.X", "P.Y", "P.Z", "Z"];

/// What the techniques of finding light have contributed to a sample, in the film's RGB. Their weighted shares sum to the
/// sample; each alone estimates all light that its technique can find. Light that is seen directly or through specular
/// scattering is the BSDF's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TechniqueShares {
    /// As they are combined: found by following the BSDF, and by drawing points on lights.
    pub weighted: [[f32; 3]; 2],
    /// As if each were alone.
    pub alone: [[f32; 3]; 2],
}

const TECHNIQUES: usize = 12;

const TECHNIQUE_CHANNELS: [&str; TECHNIQUES] = [
    "BsdfWeighted.R",
    "BsdfWeighted.G",
    "BsdfWeighted.B",
    "LightWeighted.R",
    "LightWeighted.G",
    "LightWeighted.B",
    "BsdfAlone.R",
    "BsdfAlone.G",
    "BsdfAlone.B",
    "LightAlone.R",
    "LightAlone.G",
    "LightAlone.B",
];

/// What a sample adds to the layers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LayerSample {
    /// What the camera saw first.
    pub features: Features,
    /// What the techniques found.
    pub techniques: TechniqueShares,
}

impl LayerSample {
    /// Adds the values of the layers that are there to their sums; `sign` is that of the pixel filter.
    pub(super) fn add_to(&self, layers: FilmLayers, sums: &mut [f64], sign: f32) {
        // Positions can be far away but not infinite; a miss adds zeros.
        let finite = |value: f32| f64::from(if value.is_finite() { value } else { 0.0 });
        let (features, techniques) = sums.split_at_mut(if layers.features { FEATURES } else { 0 });
        for (sum, value) in features.iter_mut().zip(self.features.as_array()) {
            *sum += finite(value);
        }
        let shares = self.techniques.weighted.iter().chain(&self.techniques.alone).flatten();
        for (sum, value) in techniques.iter_mut().zip(shares) {
            *sum += finite(value * sign);
        }
    }

    /// From sums to means: features are averages over the samples, shares are filtered as the pixel is.
    pub(super) fn means(layers: FilmLayers, sums: &[f64], count: f64, weight: f64) -> impl Iterator<Item = f32> {
        let features = if layers.features { FEATURES } else { 0 };
        let inverse = |divisor: f64| if divisor == 0.0 { 0.0 } else { 1.0 / divisor };
        let (of_feature, of_share) = (inverse(count), inverse(weight));
        sums.iter().enumerate().map(move |(i, sum)| (sum * if i < features { of_feature } else { of_share }) as f32)
    }
}
