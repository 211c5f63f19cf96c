//! Spectra as a scene file gives them.

use std::path::PathBuf;
use std::sync::Arc;

/// An RGB colour space that pbrt-v4 knows by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ColorSpace {
    /// `srgb`: ITU-R BT.709 primaries, D65.
    #[default]
    Srgb,
    /// `dci-p3`: DCI-P3 primaries with a D65 white (Display P3).
    DciP3,
    /// `rec2020`: ITU-R BT.2020 primaries, D65.
    Rec2020,
    /// `aces2065-1`: ACES AP0 primaries, ACES D60 white.
    Aces2065,
}

impl ColorSpace {
    /// All of them, as scene files name them.
    pub const NAMES: [&'static str; 4] = ["srgb", "dci-p3", "rec2020", "aces2065-1"];

    /// The colour space that pbrt-v4 calls so; case does not matter.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        match name.to_ascii_lowercase().as_str() {
            "srgb" => Some(Self::Srgb),
            "dci-p3" => Some(Self::DciP3),
            "rec2020" => Some(Self::Rec2020),
            "aces2065-1" => Some(Self::Aces2065),
            _ => None,
        }
    }

    /// Its name in scene files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Srgb => "srgb",
            Self::DciP3 => "dci-p3",
            Self::Rec2020 => "rec2020",
            Self::Aces2065 => "aces2065-1",
        }
    }
}

/// A spectrum as the scene file gives it. Whether an RGB triple is an albedo, an illuminant or unbounded is the
/// business of whoever reads the parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum SpectrumParameter {
    /// `"rgb …" [r g b]`: linear, in the colour space that was current.
    Rgb {
        /// Red, green, blue; finite, may be negative.
        rgb: [f32; 3],
        /// The colour space of the triple.
        color_space: ColorSpace,
    },
    /// `"blackbody …" [T]`: a temperature in kelvin.
    Blackbody(f32),
    /// `"spectrum …" [λ₀ v₀ λ₁ v₁ …]`: wavelengths in nm, strictly increasing, and values; linear in between. Not empty.
    Samples(Arc<[(f32, f32)]>),
    /// `"spectrum …" "metal-Au-eta"`: one of [`crate::schema::NAMED_SPECTRA`].
    Named(Arc<str>),
    /// `"spectrum …" "file.spd"`: as `Samples`, from a file.
    File {
        /// The file.
        path: PathBuf,
        /// Its contents, as in `Samples`. Not empty.
        samples: Arc<[(f32, f32)]>,
    },
}

impl SpectrumParameter {
    /// The tabulated samples (nm, value), where it is tabulated in the scene or in a file.
    #[must_use]
    pub fn samples(&self) -> Option<&[(f32, f32)]> {
        match self {
            Self::Samples(samples) | Self::File { samples, .. } => Some(samples),
            _ => None,
        }
    }
}
