//! The differential geometry at a point of a surface.

use glam::{Vec2, Vec3};

use crate::{PrimitiveId, Ray, offset_ray_origin};

/// A point on a surface, with everything that shading needs, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The point.
    pub position: Vec3,
    /// The point is known up to ± this on each axis.
    pub position_error: Vec3,
    /// The unit normal of the surface itself, on the side that the shape's orientation says; where a mesh has vertex
    /// normals, on their side.
    pub geometric_normal: Vec3,
    /// The unit normal interpolated from the vertices, or the geometric one.
    pub shading_normal: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
    /// The derivative of position by the texture's u.
    pub dpdu: Vec3,
    /// The derivative of position by the texture's v.
    pub dpdv: Vec3,
    /// As `dpdu`, perpendicular to the shading normal.
    pub shading_dpdu: Vec3,
    /// As `dpdv`, perpendicular to the shading normal.
    pub shading_dpdv: Vec3,
    /// The derivative of the (shading) normal by u.
    pub dndu: Vec3,
    /// The derivative of the (shading) normal by v.
    pub dndv: Vec3,
    /// [`crate::Hit`]'s `u` and `v`.
    pub parametric: Vec2,
    /// The mesh's face index of the primitive; 0 where it has none.
    pub face_index: u32,
    /// The ray's time.
    pub time: f32,
    /// The index of the shape.
    pub shape: u32,
    /// The triangle or patch within the mesh.
    pub primitive: u32,
    /// The index of the instance, or [`crate::NO_INSTANCE`].
    pub instance: u32,
}

impl SurfacePoint {
    /// Where a ray that leaves towards `direction` starts; see [`offset_ray_origin`].
    #[inline]
    pub fn offset_origin(&self, direction: Vec3) -> Vec3 {
        offset_ray_origin(self.position, self.position_error, self.geometric_normal, direction)
    }

    /// The primitive that it is a point of.
    #[inline]
    pub fn primitive_id(&self) -> PrimitiveId {
        PrimitiveId { shape: self.shape, primitive: self.primitive, instance: self.instance }
    }

    /// The ray without an end that leaves towards `direction`.
    #[inline]
    pub fn leave(&self, direction: Vec3) -> Ray {
        Ray { leaves: self.primitive_id(), ..Ray::new(self.offset_origin(direction), direction, self.time) }
    }
}
