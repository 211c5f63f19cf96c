//! Primitives prepared for drawing points from them again and again.

use glam::{Vec2, Vec3};

use super::disk::FlatDisk;
use super::flat_rectangle::FlatRectangle;
use super::flat_triangle::FlatTriangle;
use super::{Reference, Shape, SolidAngleSample};
use crate::SurfacePoint;

/// A primitive with all that is the same for every point that is drawn from it. It draws the same points with the same
/// densities as its shape, faster.
#[derive(Clone, Debug, PartialEq)]
pub struct PreparedPrimitive(Kind);

#[derive(Clone, Debug, PartialEq)]
enum Kind {
    Triangle(FlatTriangle),
    Rectangle(FlatRectangle),
    Disk(FlatDisk),
}

impl PreparedPrimitive {
    /// `None` for primitives that are not valid, and for shapes of which nothing is worth keeping.
    pub(crate) fn new(shape: &Shape, primitive: usize) -> Option<Self> {
        if !shape.is_valid(primitive) {
            return None;
        }
        match shape {
            Shape::Triangles(mesh) => Some(Self(Kind::Triangle(mesh.flat(primitive)))),
            Shape::Disk(disk) => Some(Self(Kind::Disk(disk.flat()))),
            Shape::Bilinear(mesh) => mesh.flat(primitive).map(|rectangle| Self(Kind::Rectangle(rectangle))),
            Shape::Sphere(_) | Shape::Cylinder(_) => None,
        }
    }

    /// Whether the geometric normals of all points are turned away from `position`.
    #[inline(always)]
    pub fn faces_away(&self, position: Vec3) -> bool {
        match &self.0 {
            Kind::Triangle(triangle) => triangle.faces_away(position),
            Kind::Rectangle(rectangle) => rectangle.faces_away(position),
            Kind::Disk(disk) => disk.faces_away(position),
        }
    }

    /// As [`Shape::sample_solid_angle`].
    #[inline(always)]
    pub fn sample_solid_angle(&self, reference: &Reference, u: Vec2) -> Option<SolidAngleSample> {
        match &self.0 {
            Kind::Triangle(triangle) => triangle.sample_solid_angle(reference, u),
            Kind::Rectangle(rectangle) => rectangle.sample_solid_angle(reference, u),
            Kind::Disk(disk) => disk.sample_solid_angle(reference, u),
        }
    }

    /// As [`Shape::pdf_solid_angle`].
    #[inline]
    pub fn pdf_solid_angle(&self, reference: &Reference, point: &SurfacePoint) -> f32 {
        match &self.0 {
            Kind::Triangle(triangle) => triangle.pdf_solid_angle(reference, point),
            Kind::Rectangle(rectangle) => rectangle.pdf_solid_angle(reference, point),
            Kind::Disk(disk) => disk.pdf_solid_angle(reference, point),
        }
    }
}
