//! What kind of scattering a BSDF, or one sample of it, shows.

use std::ops::{BitOr, BitOrAssign};

use glam::Vec3;
use luz_color::SampledSpectrum;

/// The quantity that is carried along a path, which decides how refraction scales it.
///
/// Radiance is compressed by `(η_t/η_i)²` when it crosses an interface, importance is not (Veach 1997, section 5.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransportMode {
    /// The path starts at the camera; `wi` points to where light comes from.
    Radiance,
    /// The path starts at a light; `wi` points to where importance comes from.
    Importance,
}

impl TransportMode {
    /// The other mode: that of the same path walked from its other end.
    #[inline(always)]
    pub const fn adjoint(self) -> Self {
        match self {
            Self::Radiance => Self::Importance,
            Self::Importance => Self::Radiance,
        }
    }

    /// Factor on a BTDF whose transmitted side has the relative index of refraction `eta` = η_i/η_o, for `wi` on the
    /// side of η_i: `1/eta²` for radiance, 1 for importance.
    #[inline(always)]
    pub fn transmission_scale(self, eta: f32) -> f32 {
        match self {
            Self::Radiance => 1.0 / (eta * eta),
            Self::Importance => 1.0,
        }
    }
}

/// A set of scattering kinds: on which side (`REFLECTION`, `TRANSMISSION`) and how concentrated (`DIFFUSE`, `GLOSSY`,
/// `SPECULAR`; the last is a delta distribution).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Lobe(u8);

impl Lobe {
    /// No scattering at all.
    pub const NONE: Self = Self(0);
    /// `wi` on the side of `wo`.
    pub const REFLECTION: Self = Self(1);
    /// `wi` on the side opposite to `wo`.
    pub const TRANSMISSION: Self = Self(2);
    /// Spread over the whole hemisphere.
    pub const DIFFUSE: Self = Self(4);
    /// Concentrated, but with a finite density.
    pub const GLOSSY: Self = Self(8);
    /// A delta distribution: `f` and `pdf` are zero, only `sample` finds it.
    pub const SPECULAR: Self = Self(16);
    /// Both sides.
    pub const BOTH_SIDES: Self = Self(1 | 2);

    /// True where every kind in `other` is in this set.
    #[inline(always)]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// True where the two sets share a kind.
    #[inline(always)]
    pub const fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// The union, usable in constants.
    #[inline(always)]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// True where the set is empty.
    #[inline(always)]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Has a reflected part.
    #[inline(always)]
    pub const fn is_reflection(self) -> bool {
        self.intersects(Self::REFLECTION)
    }

    /// Has a transmitted part.
    #[inline(always)]
    pub const fn is_transmission(self) -> bool {
        self.intersects(Self::TRANSMISSION)
    }

    /// Has a diffuse part.
    #[inline(always)]
    pub const fn is_diffuse(self) -> bool {
        self.intersects(Self::DIFFUSE)
    }

    /// Has a glossy part.
    #[inline(always)]
    pub const fn is_glossy(self) -> bool {
        self.intersects(Self::GLOSSY)
    }

    /// Has a specular (delta) part.
    #[inline(always)]
    pub const fn is_specular(self) -> bool {
        self.intersects(Self::SPECULAR)
    }

    /// Has a part with a finite density.
    #[inline(always)]
    pub const fn has_non_specular(self) -> bool {
        self.intersects(Self(4 | 8))
    }
}

impl BitOr for Lobe {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        self.union(other)
    }
}

impl BitOrAssign for Lobe {
    #[inline(always)]
    fn bitor_assign(&mut self, other: Self) {
        *self = self.union(other);
    }
}

/// A sampled direction, with the BSDF's value and the density of the direction.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Value of the BSDF, sr⁻¹, without the cosine. For a specular lobe the weight of the delta distribution over the
    /// cosine, so that `f·|cosθ_i|/pdf` is the throughput of every sample.
    pub f: SampledSpectrum,
    /// The sampled direction, in local shading space, away from the surface.
    pub wi: Vec3,
    /// Density of `wi` in solid angle; the discrete probability of the lobe where it is specular.
    pub pdf: f32,
    /// The one lobe that was sampled.
    pub flags: Lobe,
    /// Index of refraction on the side of `wi` relative to the side of `wo` if transmitted, else 1.
    pub eta: f32,
    /// True where `f` and `pdf` are only right as a ratio: `f/pdf` is an unbiased estimate of the lobe's throughput, but
    /// a density to be compared with that of another technique must come from [`Bsdf::pdf`](super::Bsdf::pdf).
    pub pdf_is_proportional: bool,
}

impl BsdfSample {
    /// A sample on the side of `wo` or, specular or not, with an exact density.
    #[inline(always)]
    pub fn new(f: SampledSpectrum, wi: Vec3, pdf: f32, flags: Lobe) -> Self {
        Self { f, wi, pdf, flags, eta: 1.0, pdf_is_proportional: false }
    }
}
