//! Where a path begins: a place on a light.
//!
//! Paths are numbered from the light: `x_0` is on it, `x_1` is the first point that it shines on.

use super::Target;
use glam::{Vec2, Vec3};
use luz_geometry::{SurfacePoint, offset_ray_origin};

/// The end `x_0` of a path, on a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightEnd {
    /// Which of the world's lights.
    pub light: u32,
    /// Where on it.
    pub place: Place,
    /// True where no path that is traced from the eye can meet it: a point, a single direction, or a surface that lets all rays pass.
    pub is_delta: bool,
}

/// A place on a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// On a surface that emits.
    Surface(EmittingPoint),
    /// A point in space.
    Point(Vec3),
    /// Infinitely far away, in this unit direction from the scene.
    Infinity(Vec3),
}

/// A point of a surface that emits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmittingPoint {
    /// World-space position.
    pub position: Vec3,
    /// Absolute bound of the position's error.
    pub error: Vec3,
    /// Unit geometric normal; a light of one side emits where it points to.
    pub normal: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
    /// The primitive's own parameters, as [`SurfacePoint::parametric`].
    pub parametric: Vec2,
}

/// A ray that leaves a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Departure {
    /// Where it starts: clear of the surface it leaves, or beyond all surfaces where the light is at infinity.
    pub origin: Vec3,
    /// Unit direction, into the scene.
    pub direction: Vec3,
    /// Its density: of a surface in projected solid angle, of a point in solid angle, at infinity in area of the plane
    /// perpendicular to the direction.
    pub pdf: f32,
}

/// A sphere around everything that light meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundingSphere {
    /// Its centre, in world space.
    pub center: Vec3,
    /// Its radius.
    pub radius: f32,
}

impl From<(Vec3, f32)> for BoundingSphere {
    fn from((center, radius): (Vec3, f32)) -> Self {
        Self { center, radius }
    }
}

impl LightEnd {
    /// Where a path that is traced from the eye has met a surface that emits.
    pub fn hit(light: u32, point: &SurfacePoint) -> Self {
        let place = Place::Surface(EmittingPoint {
            position: point.position,
            error: point.position_error,
            normal: point.geometric_normal,
            uv: point.uv,
            parametric: point.parametric,
        });
        Self { light, place, is_delta: false }
    }

    /// Where a path that is traced from the eye has left the scene, in the unit direction `direction`.
    pub fn escaped(light: u32, direction: Vec3) -> Self {
        Self { light, place: Place::Infinity(direction), is_delta: false }
    }

    /// True where no path that is traced from the eye can meet it.
    pub fn is_delta(&self) -> bool {
        self.is_delta
    }

    /// True where it is a direction, and not a point.
    pub fn is_infinite(&self) -> bool {
        matches!(self.place, Place::Infinity(_))
    }

    /// World-space position; `None` at infinity.
    pub fn position(&self) -> Option<Vec3> {
        match self.place {
            Place::Surface(point) => Some(point.position),
            Place::Point(position) => Some(position),
            Place::Infinity(_) => None,
        }
    }

    /// Unit geometric normal, where it is on a surface.
    pub fn normal(&self) -> Option<Vec3> {
        match self.place {
            Place::Surface(point) => Some(point.normal),
            Place::Point(_) | Place::Infinity(_) => None,
        }
    }

    /// The unit direction in which it is seen from `from`; `None` from the place itself.
    pub fn direction_from(&self, from: Vec3) -> Option<Vec3> {
        match self.place {
            Place::Infinity(towards) => Some(towards),
            Place::Surface(EmittingPoint { position, .. }) | Place::Point(position) => {
                (position - from).try_normalize()
            }
        }
    }

    /// What a shadow ray from `from` aims at.
    pub fn target_from(&self, from: Vec3) -> Target {
        match self.place {
            Place::Surface(EmittingPoint { position, error, normal, .. }) => {
                Target::Point(offset_ray_origin(position, error, normal, from - position))
            }
            Place::Point(position) => Target::Point(position),
            Place::Infinity(_) => Target::Infinity,
        }
    }
}
