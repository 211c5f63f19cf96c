//! AVX2 and FMA: eight boxes and four triangles at once.

use std::arch::x86_64::*;

use super::super::node::{LANES, Tree, TrianglePacket, WideNode};
use super::kernel::{Distances, Kernel, PacketHits, Slabs};
use super::walk::{Filter, Traversal};
use crate::shape::triangle::Shear;
use crate::{Hit, Ray, gamma};

/// [`Traversal::walk`], compiled for AVX2 as a whole.
///
/// # Safety
/// As [`Traversal::walk`] with AVX2 and FMA.
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
pub(super) unsafe fn walk<F: Filter, const ANY: bool>(
    traversal: &mut Traversal<'_, F>,
    tree: &Tree,
    ray: &Ray,
    best: &mut Hit,
) -> bool {
    // SAFETY: passed on to the caller.
    unsafe { traversal.walk::<Avx2, ANY>(tree, ray, best) }
}

struct Avx2;

struct BoxRay {
    near_reciprocal: [__m256; 3],
    far_reciprocal: [__m256; 3],
    /// `origin · reciprocal`, with the pad.
    near_offset: [__m256; 3],
    far_offset: [__m256; 3],
    near_plane: [usize; 3],
    far_plane: [usize; 3],
}

struct TriangleRay {
    axes: [usize; 3],
    origin: [__m128; 3],
    shear: [__m128; 2],
    scale: __m128,
    exact: Shear,
}

impl Kernel for Avx2 {
    type BoxRay = BoxRay;
    type TriangleRay = TriangleRay;

    #[inline(always)]
    unsafe fn box_ray(slabs: &Slabs) -> BoxRay {
        // SAFETY: the caller vouches for AVX2.
        unsafe {
            let spread = |f: &dyn Fn(usize) -> f32| [0, 1, 2].map(|axis| _mm256_set1_ps(f(axis)));
            BoxRay {
                near_reciprocal: spread(&|i| slabs.near_reciprocal[i]),
                far_reciprocal: spread(&|i| slabs.far_reciprocal[i]),
                near_offset: spread(&|i| slabs.origin[i] * slabs.near_reciprocal[i] + slabs.pad[i]),
                far_offset: spread(&|i| slabs.origin[i] * slabs.far_reciprocal[i] - slabs.pad[i]),
                near_plane: slabs.near_plane,
                far_plane: slabs.far_plane,
            }
        }
    }

    #[inline(always)]
    unsafe fn triangle_ray(shear: &Shear) -> TriangleRay {
        // SAFETY: the caller vouches for AVX2.
        unsafe {
            TriangleRay {
                axes: shear.axes,
                origin: shear.axes.map(|axis| _mm_set1_ps(shear.origin[axis])),
                shear: shear.shear.map(|s| _mm_set1_ps(s)),
                scale: _mm_set1_ps(shear.scale),
                exact: *shear,
            }
        }
    }

    #[inline(always)]
    unsafe fn test_boxes(ray: &BoxRay, node: &WideNode, t_max: f32, distances: &mut Distances) -> u32 {
        // SAFETY: the caller vouches for AVX2; nodes and distances are aligned to 32 bytes; plane indices are below 6.
        unsafe {
            let planes = node.planes.as_ptr();
            let near = |axis: usize| {
                let plane = _mm256_load_ps(planes.add(ray.near_plane[axis]).cast());
                _mm256_fmsub_ps(plane, ray.near_reciprocal[axis], ray.near_offset[axis])
            };
            let far = |axis: usize| {
                let plane = _mm256_load_ps(planes.add(ray.far_plane[axis]).cast());
                _mm256_fmsub_ps(plane, ray.far_reciprocal[axis], ray.far_offset[axis])
            };
            // The second operand is taken where the first is NaN.
            let enter = _mm256_max_ps(near(0), _mm256_setzero_ps());
            let enter = _mm256_max_ps(near(1), enter);
            let enter = _mm256_max_ps(near(2), enter);
            let leave = _mm256_min_ps(far(0), _mm256_set1_ps(t_max));
            let leave = _mm256_min_ps(far(1), leave);
            let leave = _mm256_min_ps(far(2), leave);
            _mm256_store_ps(distances.0.as_mut_ptr(), enter);
            _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(enter, leave)) as u32
        }
    }

    #[inline(always)]
    unsafe fn test_packet(ray: &TriangleRay, packet: &TrianglePacket, t_max: f32, hits: &mut PacketHits) -> u32 {
        // SAFETY: the caller vouches for AVX2; packets and hits are aligned to 16 bytes; axes are below 3.
        unsafe {
            let vertex = |corner: usize| {
                let base = packet.corners.as_ptr().add(corner).cast::<f32>();
                let load = |i: usize| _mm_sub_ps(_mm_load_ps(base.add(LANES * ray.axes[i])), ray.origin[i]);
                let height = load(2);
                (
                    _mm_sub_ps(load(0), _mm_mul_ps(ray.shear[0], height)),
                    _mm_sub_ps(load(1), _mm_mul_ps(ray.shear[1], height)),
                    height,
                )
            };
            let (x0, y0, h0) = vertex(0);
            let (x1, y1, h1) = vertex(1);
            let (x2, y2, h2) = vertex(2);
            // Not fused: see Shear.
            let edge = |ax, ay, bx, by| _mm_sub_ps(_mm_mul_ps(ax, by), _mm_mul_ps(ay, bx));
            let (e0, e1, e2) = (edge(x1, y1, x2, y2), edge(x2, y2, x0, y0), edge(x0, y0, x1, y1));
            let zero = _mm_setzero_ps();
            let least = _mm_min_ps(_mm_min_ps(e0, e1), e2);
            let greatest = _mm_max_ps(_mm_max_ps(e0, e1), e2);
            let outside = _mm_and_ps(_mm_cmplt_ps(least, zero), _mm_cmpgt_ps(greatest, zero));
            let inside = !_mm_movemask_ps(outside) as u32 & 0xf;
            if inside == 0 {
                return 0;
            }
            let determinant = _mm_add_ps(_mm_add_ps(e0, e1), e2);
            let flat = _mm_movemask_ps(_mm_cmpeq_ps(determinant, zero)) as u32 & inside;

            let (z0, z1, z2) = (_mm_mul_ps(h0, ray.scale), _mm_mul_ps(h1, ray.scale), _mm_mul_ps(h2, ray.scale));
            let sum = |a, b, c| _mm_add_ps(_mm_add_ps(a, b), c);
            let t = _mm_div_ps(sum(_mm_mul_ps(e0, z0), _mm_mul_ps(e1, z1), _mm_mul_ps(e2, z2)), determinant);
            let in_range = _mm_and_ps(_mm_cmpgt_ps(t, zero), _mm_cmple_ps(t, _mm_set1_ps(t_max)));
            let mut mask = _mm_movemask_ps(in_range) as u32 & inside & !flat;
            if mask != 0 {
                let sign = _mm_set1_ps(-0.0);
                let abs = |x| _mm_andnot_ps(sign, x);
                let largest = |a, b, c| _mm_max_ps(_mm_max_ps(abs(a), abs(b)), abs(c));
                let (max_x, max_y, max_z) = (largest(x0, x1, x2), largest(y0, y1, y2), largest(z0, z1, z2));
                let max_e = largest(e0, e1, e2);
                let (mul, add, set) = (_mm_mul_ps, _mm_add_ps, |x| _mm_set1_ps(x));
                let delta_x = mul(set(gamma(5)), add(max_x, max_z));
                let delta_y = mul(set(gamma(5)), add(max_y, max_z));
                let delta_z = mul(set(gamma(3)), max_z);
                let delta_e =
                    mul(set(2.0), sum(mul(set(gamma(2)), mul(max_x, max_y)), mul(delta_y, max_x), mul(delta_x, max_y)));
                let error = _mm_div_ps(
                    mul(set(3.0), sum(mul(mul(set(gamma(3)), max_e), max_z), mul(delta_e, max_z), mul(delta_z, max_e))),
                    abs(determinant),
                );
                mask &= !_mm_movemask_ps(_mm_cmple_ps(t, error)) as u32;
                _mm_store_ps(hits.t.as_mut_ptr(), t);
                _mm_store_ps(hits.u.as_mut_ptr(), _mm_div_ps(e1, determinant));
                _mm_store_ps(hits.v.as_mut_ptr(), _mm_div_ps(e2, determinant));
            }
            if flat != 0 {
                mask |= exact(ray, packet, flat, t_max, hits);
            }
            mask
        }
    }
}

/// Lanes whose edge functions all vanish in `f32`, once more in `f64`.
#[cold]
#[inline(never)]
fn exact(ray: &TriangleRay, packet: &TrianglePacket, lanes: u32, t_max: f32, hits: &mut PacketHits) -> u32 {
    let mut mask = 0;
    for lane in (0..LANES).filter(|lane| lanes >> lane & 1 != 0) {
        if let Some((t, u, v)) = ray.exact.intersect(packet.lane(lane), t_max) {
            (hits.t[lane], hits.u[lane], hits.v[lane]) = (t, u, v);
            mask |= 1 << lane;
        }
    }
    mask
}
