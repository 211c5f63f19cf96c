//! What a traversal needs from an instruction set, and the portable version of it.

use glam::Vec3A;

use super::super::node::{LANES, TrianglePacket, WIDTH, WideNode};
use crate::Ray;
use crate::shape::triangle::Shear;

/// A ray prepared for conservative box tests.
///
/// A plane `x` is met at `t = (x − o) / d`. Rounding moves that by at most a few `ε |o / d|` and `ε t`, which is made up for
/// beforehand: entries are computed with a slightly smaller reciprocal and less a pad, exits with a larger one and plus a
/// pad. So the tests cost nothing more and never miss a box that the exact ray touches (in the spirit of Ize 2013,
/// "Robust BVH Ray Traversal").
#[derive(Clone, Copy, Debug)]
pub(super) struct Slabs {
    pub origin: Vec3A,
    pub near_reciprocal: Vec3A,
    pub far_reciprocal: Vec3A,
    /// Units of `t`, not negative.
    pub pad: Vec3A,
    /// Which of [`WideNode::planes`] the ray enters through, for each axis; it leaves through the other one.
    pub near_plane: [usize; 3],
    pub far_plane: [usize; 3],
}

impl Slabs {
    /// `reach` is the largest absolute coordinate of the boxes.
    #[inline(always)]
    pub fn new(ray: &Ray, reach: f32) -> Self {
        const MARGIN: f32 = 1.0 / (1u32 << 22) as f32;
        let (origin, direction) = (Vec3A::from(ray.origin), Vec3A::from(ray.direction));
        let size = direction.abs();
        // Components this small count as this: over the scene the ray strays by less than the pad below allows for.
        let least = Vec3A::splat(size.max_element() * 2f32.powi(-60));
        let scale = 2f32.powi(-50) * (reach + origin.abs().max_element());
        let reciprocal = Vec3A::ONE / Vec3A::select(size.cmplt(least), least.copysign(direction), direction);
        let negative = reciprocal.is_negative_bitmask() as usize;
        let [x, y, z] = [negative & 1, negative >> 1 & 1, negative >> 2 & 1];
        Self {
            origin,
            near_reciprocal: reciprocal * (1.0 - MARGIN),
            far_reciprocal: reciprocal * (1.0 + MARGIN),
            pad: (origin.abs() * MARGIN + scale) * reciprocal.abs(),
            near_plane: [3 * x, 1 + 3 * y, 2 + 3 * z],
            far_plane: [3 - 3 * x, 4 - 3 * y, 5 - 3 * z],
        }
    }
}

/// What a packet test finds, lane by lane; meaningless where the mask says no hit.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub(super) struct PacketHits {
    pub t: [f32; LANES],
    pub u: [f32; LANES],
    pub v: [f32; LANES],
}

/// The entry distances of a node's children.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Distances(pub [f32; WIDTH]);

/// The two tests of a traversal. Both return a mask with a bit for each child or lane that the ray may meet within
/// `[0, t_max]`.
///
/// # Safety
/// The methods may be called only where the instruction set of the implementation is present. They do the same arithmetic
/// on triangles everywhere, so that all kernels find the same hits to the last bit.
pub(super) trait Kernel {
    /// A ray, as the box test wants it.
    type BoxRay;
    /// A ray, as the triangle test wants it; it gets the [`Shear`] that this is made from, too.
    type TriangleRay;

    unsafe fn box_ray(slabs: &Slabs) -> Self::BoxRay;
    unsafe fn triangle_ray(shear: &Shear) -> Self::TriangleRay;
    unsafe fn test_boxes(ray: &Self::BoxRay, node: &WideNode, t_max: f32, distances: &mut Distances) -> u32;
    /// `leaves` are shape and primitive of the triangle that the ray starts on.
    unsafe fn test_packet(
        ray: &Self::TriangleRay,
        shear: &Shear,
        leaves: [u32; 2],
        packet: &TrianglePacket,
        t_max: f32,
        hits: &mut PacketHits,
    ) -> u32;
}

/// The portable kernel.
pub(super) struct Scalar;

impl Kernel for Scalar {
    type BoxRay = Slabs;
    type TriangleRay = ();

    #[inline(always)]
    unsafe fn box_ray(slabs: &Slabs) -> Slabs {
        *slabs
    }

    #[inline(always)]
    unsafe fn triangle_ray(_: &Shear) {}

    #[inline(always)]
    unsafe fn test_boxes(ray: &Slabs, node: &WideNode, t_max: f32, distances: &mut Distances) -> u32 {
        let mut enter = [0f32; WIDTH];
        let mut leave = [t_max; WIDTH];
        let origin = ray.origin.to_array();
        let (near_reciprocal, far_reciprocal) = (ray.near_reciprocal.to_array(), ray.far_reciprocal.to_array());
        let pad = ray.pad.to_array();
        for axis in 0..3 {
            let (near, far) = (&node.planes[ray.near_plane[axis]], &node.planes[ray.far_plane[axis]]);
            for i in 0..WIDTH {
                let t0 = (near[i] - origin[axis]) * near_reciprocal[axis] - pad[axis];
                let t1 = (far[i] - origin[axis]) * far_reciprocal[axis] + pad[axis];
                // NaN, which only overflow makes, leaves the axis out.
                enter[i] = if t0 > enter[i] { t0 } else { enter[i] };
                leave[i] = if t1 < leave[i] { t1 } else { leave[i] };
            }
        }
        distances.0 = enter;
        (0..WIDTH).fold(0, |mask, i| mask | u32::from(enter[i] <= leave[i]) << i)
    }

    #[inline(always)]
    unsafe fn test_packet(
        _: &(),
        ray: &Shear,
        leaves: [u32; 2],
        packet: &TrianglePacket,
        t_max: f32,
        hits: &mut PacketHits,
    ) -> u32 {
        let mut mask = 0;
        for lane in 0..LANES {
            if let Some((t, u, v)) = ray.intersect(packet.lane(lane), t_max, packet.is(lane, leaves)) {
                (hits.t[lane], hits.u[lane], hits.v[lane]) = (t, u, v);
                mask |= 1 << lane;
            }
        }
        mask
    }
}
