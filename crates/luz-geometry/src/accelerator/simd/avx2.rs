//! AVX2 and FMA: eight boxes and four triangles at once.

use std::arch::x86_64::*;

use glam::Vec3A;

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

pub(super) struct Avx2;

pub(super) struct BoxRay {
    near_reciprocal: [__m256; 3],
    far_reciprocal: [__m256; 3],
    /// `origin · reciprocal`, with the pad.
    near_offset: [__m256; 3],
    far_offset: [__m256; 3],
    near_plane: [usize; 3],
    far_plane: [usize; 3],
}

pub(super) struct TriangleRay {
    axes: [usize; 3],
    origin: [__m128; 3],
    shear: [__m128; 2],
    scale: __m128,
}

impl Kernel for Avx2 {
    type BoxRay = BoxRay;
    type TriangleRay = TriangleRay;

    #[inline(always)]
    unsafe fn box_ray(slabs: &Slabs) -> BoxRay {
        // SAFETY: the caller vouches for AVX2.
        unsafe {
            BoxRay {
                near_reciprocal: spread(slabs.near_reciprocal),
                far_reciprocal: spread(slabs.far_reciprocal),
                near_offset: spread(slabs.origin * slabs.near_reciprocal + slabs.pad),
                far_offset: spread(slabs.origin * slabs.far_reciprocal - slabs.pad),
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
                origin: [
                    _mm_set1_ps(shear.origin[shear.axes[0]]),
                    _mm_set1_ps(shear.origin[shear.axes[1]]),
                    _mm_set1_ps(shear.origin[shear.axes[2]]),
                ],
                shear: [_mm_set1_ps(shear.shear[0]), _mm_set1_ps(shear.shear[1])],
                scale: _mm_set1_ps(shear.scale),
            }
        }
    }

    #[inline(always)]
    unsafe fn test_boxes(ray: &BoxRay, node: &WideNode, t_max: f32, distances: &mut Distances) -> u32 {
        // SAFETY: the caller vouches for AVX2; nodes and distances are aligned to 32 bytes; plane indices are below 6.
        unsafe {
            // The second operand is taken where the first is NaN: an axis too many may then be left out, which is safe.
            let enter = _mm256_max_ps(
                _mm256_max_ps(near(ray, node, 0), near(ray, node, 1)),
                _mm256_max_ps(near(ray, node, 2), _mm256_setzero_ps()),
            );
            let leave = _mm256_min_ps(
                _mm256_min_ps(far(ray, node, 0), far(ray, node, 1)),
                _mm256_min_ps(far(ray, node, 2), _mm256_set1_ps(t_max)),
            );
            _mm256_store_ps(distances.0.as_mut_ptr(), enter);
            _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(enter, leave)) as u32
        }
    }

    #[inline(always)]
    unsafe fn test_packet(
        ray: &TriangleRay,
        exact_ray: &Shear,
        leaves: [u32; 2],
        packet: &TrianglePacket,
        t_max: f32,
        hits: &mut PacketHits,
    ) -> u32 {
        // SAFETY: the caller vouches for AVX2; packets and hits are aligned to 16 bytes; axes are below 3.
        unsafe {
            let (x0, y0, h0) = vertex(ray, packet, 0);
            let (x1, y1, h1) = vertex(ray, packet, 1);
            let (x2, y2, h2) = vertex(ray, packet, 2);
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
            let scaled = sum(_mm_mul_ps(e0, z0), _mm_mul_ps(e1, z1), _mm_mul_ps(e2, z2));
            let t = _mm_div_ps(scaled, determinant);
            // If all corners are behind the origin so is the hit, whatever the rounding.
            let ahead = _mm_cmpgt_ps(_mm_max_ps(_mm_max_ps(z0, z1), z2), zero);
            let possible = _mm_and_ps(ahead, _mm_cmple_ps(t, _mm_set1_ps(t_max)));
            let mut mask = _mm_movemask_ps(possible) as u32 & inside & !flat;
            if mask != 0 {
                let (max_x, max_y, max_z) = (largest(x0, x1, x2), largest(y0, y1, y2), largest(z0, z1, z2));
                let max_h = largest(h0, h1, h2);
                let error = t_error(max_x, max_y, max_h, max_z, largest(e0, e1, e2), absolute(determinant));
                let near = _mm_movemask_ps(_mm_cmple_ps(absolute(t), error)) as u32 & mask;
                mask &= _mm_movemask_ps(_mm_cmpgt_ps(t, error)) as u32;
                _mm_store_ps(hits.t.as_mut_ptr(), t);
                _mm_store_ps(hits.u.as_mut_ptr(), _mm_div_ps(e1, determinant));
                _mm_store_ps(hits.v.as_mut_ptr(), _mm_div_ps(e2, determinant));
                // Most often that is the very triangle that the ray starts on.
                if near != 0 {
                    let near = near & !lanes_of(packet, leaves);
                    if near != 0 {
                        mask |= exact_distances(exact_ray, packet, near, t_max, hits);
                    }
                }
            }
            if flat != 0 {
                mask |= exact(exact_ray, leaves, packet, flat, t_max, hits);
            }
            mask
        }
    }
}

/// The lanes where a packet has a certain triangle.
#[inline(always)]
unsafe fn lanes_of(packet: &TrianglePacket, [shape, primitive]: [u32; 2]) -> u32 {
    // SAFETY: the caller vouches for AVX2; packets are aligned.
    unsafe {
        let shapes = _mm_load_si128(packet.shape.as_ptr().cast());
        let primitives = _mm_load_si128(packet.primitive.as_ptr().cast());
        let same = _mm_and_si128(
            _mm_cmpeq_epi32(shapes, _mm_set1_epi32(shape as i32)),
            _mm_cmpeq_epi32(primitives, _mm_set1_epi32(primitive as i32)),
        );
        _mm_movemask_ps(_mm_castsi128_ps(same)) as u32
    }
}

#[inline(always)]
unsafe fn spread(v: Vec3A) -> [__m256; 3] {
    // SAFETY: the caller vouches for AVX2.
    unsafe { [_mm256_set1_ps(v.x), _mm256_set1_ps(v.y), _mm256_set1_ps(v.z)] }
}

/// Where the ray enters the slabs of all children along an axis.
#[inline(always)]
unsafe fn near(ray: &BoxRay, node: &WideNode, axis: usize) -> __m256 {
    // SAFETY: the caller vouches for AVX2 and FMA; nodes are aligned; plane indices are below 6.
    unsafe {
        let plane = _mm256_load_ps(node.planes.as_ptr().add(ray.near_plane[axis]).cast());
        _mm256_fmsub_ps(plane, ray.near_reciprocal[axis], ray.near_offset[axis])
    }
}

/// Where the ray leaves them.
#[inline(always)]
unsafe fn far(ray: &BoxRay, node: &WideNode, axis: usize) -> __m256 {
    // SAFETY: the caller vouches for AVX2 and FMA; nodes are aligned; plane indices are below 6.
    unsafe {
        let plane = _mm256_load_ps(node.planes.as_ptr().add(ray.far_plane[axis]).cast());
        _mm256_fmsub_ps(plane, ray.far_reciprocal[axis], ray.far_offset[axis])
    }
}

/// One corner of all triangles in ray space: x, y, and z not yet scaled.
#[inline(always)]
unsafe fn vertex(ray: &TriangleRay, packet: &TrianglePacket, corner: usize) -> (__m128, __m128, __m128) {
    // SAFETY: the caller vouches for AVX2; packets are aligned; axes are below 3.
    unsafe {
        let base = packet.corners.as_ptr().add(corner).cast::<f32>();
        let height = _mm_sub_ps(_mm_load_ps(base.add(LANES * ray.axes[2])), ray.origin[2]);
        let x = _mm_sub_ps(_mm_load_ps(base.add(LANES * ray.axes[0])), ray.origin[0]);
        let y = _mm_sub_ps(_mm_load_ps(base.add(LANES * ray.axes[1])), ray.origin[1]);
        (_mm_sub_ps(x, _mm_mul_ps(ray.shear[0], height)), _mm_sub_ps(y, _mm_mul_ps(ray.shear[1], height)), height)
    }
}

/// An edge function; not fused, see [`Shear`].
#[inline(always)]
unsafe fn edge(ax: __m128, ay: __m128, bx: __m128, by: __m128) -> __m128 {
    // SAFETY: the caller vouches for AVX2.
    unsafe { _mm_sub_ps(_mm_mul_ps(ax, by), _mm_mul_ps(ay, bx)) }
}

#[inline(always)]
unsafe fn sum(a: __m128, b: __m128, c: __m128) -> __m128 {
    // SAFETY: the caller vouches for AVX2.
    unsafe { _mm_add_ps(_mm_add_ps(a, b), c) }
}

#[inline(always)]
unsafe fn absolute(x: __m128) -> __m128 {
    // SAFETY: the caller vouches for AVX2.
    unsafe { _mm_andnot_ps(_mm_set1_ps(-0.0), x) }
}

#[inline(always)]
unsafe fn largest(a: __m128, b: __m128, c: __m128) -> __m128 {
    // SAFETY: the caller vouches for AVX2.
    unsafe { _mm_max_ps(_mm_max_ps(absolute(a), absolute(b)), absolute(c)) }
}

/// As [`crate::shape::triangle`]'s bound of the error of `t`.
#[inline(always)]
unsafe fn t_error(
    max_x: __m128,
    max_y: __m128,
    max_h: __m128,
    max_z: __m128,
    max_e: __m128,
    determinant: __m128,
) -> __m128 {
    // SAFETY: the caller vouches for AVX2.
    unsafe {
        let gamma_2 = _mm_set1_ps(gamma(2));
        let gamma_3 = _mm_set1_ps(gamma(3));
        let gamma_5 = _mm_set1_ps(gamma(5));
        let delta_x = _mm_mul_ps(gamma_5, _mm_add_ps(max_x, max_h));
        let delta_y = _mm_mul_ps(gamma_5, _mm_add_ps(max_y, max_h));
        let delta_z = _mm_mul_ps(gamma_3, max_z);
        let delta_e = _mm_mul_ps(
            _mm_set1_ps(2.0),
            sum(_mm_mul_ps(gamma_2, _mm_mul_ps(max_x, max_y)), _mm_mul_ps(delta_y, max_x), _mm_mul_ps(delta_x, max_y)),
        );
        let error =
            sum(_mm_mul_ps(_mm_mul_ps(gamma_3, max_e), max_z), _mm_mul_ps(delta_e, max_z), _mm_mul_ps(delta_z, max_e));
        _mm_div_ps(_mm_mul_ps(_mm_set1_ps(3.0), error), determinant)
    }
}

/// The distances of lanes whose `t` may have either sign.
#[cold]
#[inline(never)]
fn exact_distances(ray: &Shear, packet: &TrianglePacket, lanes: u32, t_max: f32, hits: &mut PacketHits) -> u32 {
    let mut mask = 0;
    for lane in (0..LANES).filter(|lane| lanes >> lane & 1 != 0) {
        if let Some(t) = ray.plane_distance(packet.lane(lane))
            && t > 0.0
            && t <= t_max
        {
            hits.t[lane] = t;
            mask |= 1 << lane;
        }
    }
    mask
}

/// Lanes whose edge functions all vanish in `f32`.
#[cold]
#[inline(never)]
fn exact(ray: &Shear, leaves: [u32; 2], packet: &TrianglePacket, lanes: u32, t_max: f32, hits: &mut PacketHits) -> u32 {
    let mut mask = 0;
    for lane in (0..LANES).filter(|lane| lanes >> lane & 1 != 0) {
        if let Some((t, u, v)) = ray.intersect(packet.lane(lane), t_max, packet.is(lane, leaves)) {
            (hits.t[lane], hits.u[lane], hits.v[lane]) = (t, u, v);
            mask |= 1 << lane;
        }
    }
    mask
}
