//! Traversal by instruction set, chosen when the accelerator is built.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod kernel;
mod walk;

use self::kernel::Scalar;
pub(super) use self::walk::{All, Filter, Traversal};
use super::node::Tree;
use crate::{Hit, Ray};

/// Which instructions a traversal uses. All find the same hits, to the last bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum SimdLevel {
    /// The fastest that the machine has.
    #[default]
    Auto,
    /// Portable code.
    Scalar,
    /// AVX2 and FMA, on x86-64.
    Avx2,
    /// AVX-512 (F, VL), on x86-64.
    Avx512,
}

impl SimdLevel {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Auto, Self::Scalar, Self::Avx2, Self::Avx512];

    /// The name, as on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Scalar => "scalar",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }

    /// The instruction set of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|level| level.name() == name)
    }
}

/// An instruction set that is known to be present.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Level {
    Scalar,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Level {
    /// The best that is present and not above `wanted`.
    pub fn choose(wanted: SimdLevel) -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            use std::arch::is_x86_feature_detected as has;
            let bits = has!("bmi1") && has!("bmi2") && has!("lzcnt") && has!("popcnt");
            let avx2 = has!("avx2") && has!("fma") && bits;
            let avx512 = avx2 && has!("avx512f") && has!("avx512vl") && has!("avx512bw") && has!("avx512dq");
            match wanted {
                SimdLevel::Auto | SimdLevel::Avx512 if avx512 => return Self::Avx512,
                SimdLevel::Auto | SimdLevel::Avx512 | SimdLevel::Avx2 if avx2 => return Self::Avx2,
                _ => {}
            }
        }
        let _ = wanted;
        Self::Scalar
    }

    /// The public name.
    pub fn name(self) -> SimdLevel {
        match self {
            Self::Scalar => SimdLevel::Scalar,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => SimdLevel::Avx2,
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => SimdLevel::Avx512,
        }
    }

    /// Walks a tree that [`Tree::build`] made; see [`Traversal::walk`].
    #[inline(always)]
    pub fn walk<F: Filter, const ANY: bool>(
        self,
        traversal: &mut Traversal<'_, F>,
        tree: &Tree,
        ray: &Ray,
        best: &mut Hit,
    ) -> bool {
        match self {
            // SAFETY: the portable kernel needs nothing; the tree was built by this crate.
            Self::Scalar => unsafe { traversal.walk::<Scalar, ANY>(tree, ray, best) },
            // SAFETY: the level is chosen only where the instructions are present; the tree was built by this crate.
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => unsafe { avx2::walk::<F, ANY>(traversal, tree, ray, best) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => unsafe { avx512::walk::<F, ANY>(traversal, tree, ray, best) },
        }
    }
}
