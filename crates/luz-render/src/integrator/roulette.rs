//! How paths end before they are longest.

use luz_color::SampledSpectrum;
use std::fmt;
use std::str::FromStr;

/// How paths end before they are longest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Roulette {
    /// They don't.
    None,
    /// From the fifth vertex on, with the probability that their throughput falls short of one.
    #[default]
    Throughput,
}

impl Roulette {
    /// All kinds.
    pub const ALL: [Self; 2] = [Self::None, Self::Throughput];

    const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Throughput => "throughput",
        }
    }

    /// The probability with which a path of the given throughput survives its `depth`-th scattering; `None` where it does
    /// so for certain.
    #[inline]
    pub fn survival(self, depth: u32, throughput: SampledSpectrum) -> Option<f32> {
        match self {
            Self::None => None,
            Self::Throughput => (depth >= THROUGHPUT_DEPTH).then(|| throughput.max_component().min(MAX_SURVIVAL)),
        }
    }
}

/// Paths shorter than this go on without roulette: what it saves early costs more in noise, stratified samples above all.
const THROUGHPUT_DEPTH: u32 = 5;
/// Even a path that has lost nothing ends at some time.
const MAX_SURVIVAL: f32 = 0.95;

impl fmt::Display for Roulette {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Roulette {
    type Err = String;

    /// Reads `none` or `throughput`.
    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|kind| kind.name() == text);
        found.ok_or_else(|| format!("`{text}` is no roulette: expected `none` or `throughput`"))
    }
}
