//! Rays, and what they hit.

use glam::Vec3;

/// A ray `origin + t · direction` for `0 < t ≤ t_max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts, in world space.
    pub origin: Vec3,
    /// Where it goes; any length but zero. `t` counts in multiples of it.
    pub direction: Vec3,
    /// The last `t` at which a hit counts; may be infinite.
    pub t_max: f32,
    /// When it is shot, in the units of the scene's animated transforms.
    pub time: f32,
    /// The primitive that it starts on, if that is known. If it is a triangle, and rounding leaves it open whether the ray meets it
    /// again, it does not; from origins that are clearly behind the triangle it does.
    pub leaves: PrimitiveId,
}

impl Ray {
    /// A ray without an end.
    #[inline]
    pub fn new(origin: Vec3, direction: Vec3, time: f32) -> Self {
        Self { origin, direction, t_max: f32::INFINITY, time, leaves: PrimitiveId::NONE }
    }

    /// The point at `t`.
    #[inline]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }
}

/// One primitive where it stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PrimitiveId {
    /// As in [`Hit::shape`].
    pub shape: u32,
    /// As in [`Hit::primitive`].
    pub primitive: u32,
    /// As in [`Hit::instance`].
    pub instance: u32,
}

impl PrimitiveId {
    /// None at all.
    pub const NONE: Self = Self { shape: u32::MAX, primitive: u32::MAX, instance: NO_INSTANCE };
}

/// What [`Hit::instance`] says where the shape stands in the world itself.
pub const NO_INSTANCE: u32 = u32::MAX;

/// Where a ray meets a shape, as little as is needed to find it again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The ray's parameter, in multiples of its direction.
    pub t: f32,
    /// Triangles: the barycentric coordinate of the second vertex. Others: the parameter `u` in `[0, 1]`.
    pub u: f32,
    /// Triangles: the barycentric coordinate of the third vertex. Others: the parameter `v` in `[0, 1]`.
    pub v: f32,
    /// The index of the shape, as in [`crate::ShapeId`].
    pub shape: u32,
    /// The triangle or patch within the mesh; 0 for other shapes.
    pub primitive: u32,
    /// The index of the instance, as in [`crate::InstanceId`], or [`NO_INSTANCE`].
    pub instance: u32,
}
