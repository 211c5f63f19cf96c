//! Vectors, transforms, shapes and a fast watertight BVH.
//!
//! Everything is in a left-handed world as in pbrt-v4, in `f32`. The way through this crate: plain [`Shape`]s go into an
//! [`AcceleratorBuilder`], whose [`Accelerator`] answers [`Accelerator::closest_hit`] and [`Accelerator::any_hit`] with a
//! compact [`Hit`]; [`Accelerator::surface`] turns a hit into a [`SurfacePoint`], and [`Accelerator::sample_area`] and
//! [`Accelerator::sample_solid_angle`] sample shapes for area lights.

mod accelerator;
mod animated;
mod bounds;
mod error_bound;
mod frame;
mod ray;
mod shape;
mod subdivide;
mod surface;
mod transform;

pub use accelerator::{
    Accelerator, AcceleratorBuilder, BuildReport, GroupId, InstanceId, InstanceTransform, ShapeId, SimdLevel,
};
pub use animated::AnimatedTransform;
pub use bounds::Bounds3;
pub use error_bound::{gamma, next_down, next_up, offset_ray_origin};
pub use frame::{Frame, renormalized};
pub use ray::{Hit, NO_INSTANCE, PrimitiveId, Ray};
pub use shape::{
    AreaSample, BilinearMesh, Cylinder, Disk, NormalCone, PreparedPrimitive, Reference, Shape, SolidAngleSample,
    Sphere, TriangleMesh, UvFootprint, UvPoint,
};
pub use subdivide::loop_subdivide;
pub use surface::SurfacePoint;
pub use transform::{Transform, TransformError};
