//! AVX-512: the AVX2 kernel, compiled with twice the registers and with mask registers. Wider vectors would bring nothing:
//! nodes have eight children.

use super::super::node::Tree;
use super::avx2::Avx2;
use super::walk::{Filter, Traversal};
use crate::{Hit, Ray};

/// [`Traversal::walk`], compiled for AVX-512 as a whole.
///
/// # Safety
/// As [`Traversal::walk`] with AVX-512 F, VL, BW and DQ, and AVX2 and FMA.
#[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
pub(super) unsafe fn walk<F: Filter, const ANY: bool>(
    traversal: &mut Traversal<'_, F>,
    tree: &Tree,
    ray: &Ray,
    best: &mut Hit,
) -> bool {
    // SAFETY: passed on to the caller.
    unsafe { traversal.walk::<Avx2, ANY>(tree, ray, best) }
}
