//! Which techniques look for direct light.

use std::fmt;
use std::str::FromStr;

/// Which techniques look for direct light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Technique {
    /// Only points drawn on lights (and what only the BSDF can find: light seen directly or through specular chains).
    Light,
    /// Only directions drawn from the BSDF (and what only lights can find: those without extent).
    Bsdf,
    /// Both, combined by the heuristic.
    #[default]
    Both,
}

impl FromStr for Technique {
    type Err = String;
    fn from_str(name: &str) -> Result<Self, String> {
        match name {
            "light" => Ok(Self::Light),
            "bsdf" => Ok(Self::Bsdf),
            "both" => Ok(Self::Both),
            _ => Err(format!("unknown technique `{name}`; known are light, bsdf, both")),
        }
    }
}

impl fmt::Display for Technique {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Light => "light",
            Self::Bsdf => "bsdf",
            Self::Both => "both",
        })
    }
}
