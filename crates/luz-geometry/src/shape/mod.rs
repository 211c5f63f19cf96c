//! Shapes as plain data: what they are, where they are, how to sample them.

mod bilinear;
mod cylinder;
mod disk;
mod far;
mod flat_rectangle;
mod flat_triangle;
mod parametric;
mod prepared;
mod quadric;
mod sample;
mod sphere;
pub(crate) mod triangle;

pub use bilinear::BilinearMesh;
pub use cylinder::Cylinder;
pub use disk::Disk;
pub use parametric::{NormalCone, UvFootprint, UvPoint};
pub use prepared::PreparedPrimitive;
pub use sample::{AreaSample, Reference, SolidAngleSample};
pub use sphere::Sphere;
pub use triangle::TriangleMesh;

use glam::Vec2;

use crate::{Bounds3, Hit, Ray, SurfacePoint};

/// Anything that a ray can hit.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Triangles that share vertices.
    Triangles(TriangleMesh),
    /// Bilinear patches that share vertices.
    Bilinear(BilinearMesh),
    /// A sphere or part of one.
    Sphere(Sphere),
    /// A disk, an annulus, or part of one.
    Disk(Disk),
    /// An open cylinder or part of one.
    Cylinder(Cylinder),
}

/// `t`, `u`, `v` of an intersection, as in [`Hit`].
pub(crate) type ParametricHit = (f32, f32, f32);

macro_rules! each {
    ($self:expr, $shape:ident => $body:expr) => {
        match $self {
            Shape::Triangles($shape) => $body,
            Shape::Bilinear($shape) => $body,
            Shape::Sphere($shape) => $body,
            Shape::Disk($shape) => $body,
            Shape::Cylinder($shape) => $body,
        }
    };
}

impl Shape {
    /// How many triangles or patches a mesh has; 1 for other shapes.
    pub fn primitive_count(&self) -> usize {
        match self {
            Self::Triangles(mesh) => mesh.indices.len(),
            Self::Bilinear(mesh) => mesh.indices.len(),
            _ => 1,
        }
    }

    /// Whether primitive `primitive` can be hit at all: indices in range, coordinates finite, more than a line.
    pub fn is_valid(&self, primitive: usize) -> bool {
        each!(self, shape => shape.is_valid(primitive))
    }

    /// The box around one primitive.
    pub fn bounds(&self, primitive: usize) -> Bounds3 {
        each!(self, shape => shape.bounds(primitive))
    }

    /// The surface area of one primitive, in square units of the world.
    pub fn area(&self, primitive: usize) -> f32 {
        each!(self, shape => shape.area(primitive))
    }

    /// A point of one primitive, by area; `None` where the primitive has no area.
    pub fn sample_area(&self, primitive: usize, u: Vec2) -> Option<AreaSample> {
        each!(self, shape => shape.sample_area(primitive, u))
    }

    /// The density of [`Self::sample_area`] in area at a point of this shape.
    pub fn pdf_area(&self, point: &SurfacePoint) -> f32 {
        each!(self, shape => shape.pdf_area(point))
    }

    /// A point of one primitive seen from `reference`, with its density in solid angle; `None` where the sampled point
    /// cannot be seen or has no finite density.
    pub fn sample_solid_angle(&self, reference: &Reference, primitive: usize, u: Vec2) -> Option<SolidAngleSample> {
        each!(self, shape => shape.sample_solid_angle(reference, primitive, u))
    }

    /// The density of [`Self::sample_solid_angle`] at a point of this shape, in solid angle from `reference`.
    pub fn pdf_solid_angle(&self, reference: &Reference, point: &SurfacePoint) -> f32 {
        each!(self, shape => shape.pdf_solid_angle(reference, point))
    }

    /// Where a ray first meets one primitive at `0 < t ≤ t_max`.
    pub(crate) fn intersect(&self, ray: &Ray, t_max: f32, primitive: usize) -> Option<ParametricHit> {
        each!(self, shape => shape.intersect(ray, t_max, primitive))
    }

    /// The surface at a hit; the ray is needed to find the point of a quadric precisely.
    #[inline]
    pub(crate) fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        each!(self, shape => shape.surface(ray, hit))
    }
}
