//! From a point on a surface to texture coordinates, with their derivatives over one pixel.

use super::SurfaceContext;
use glam::{Vec2, Vec3};
use luz_geometry::Transform;
use std::f32::consts::{PI, TAU};

/// Texture coordinates and how they change from one pixel to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coordinates {
    /// The coordinates.
    pub st: Vec2,
    /// Change over one pixel to the right.
    pub dx: Vec2,
    /// Change over one pixel down.
    pub dy: Vec2,
}

/// How a 2D texture is laid over a surface.
#[derive(Clone, Debug)]
pub enum Mapping {
    /// The surface's own parameters, scaled and shifted.
    Uv {
        /// Scale along u and v.
        scale: Vec2,
        /// Shift along u and v.
        shift: Vec2,
    },
    /// Projection along two vectors, in texture space.
    Planar {
        /// From world to texture space.
        texture_from_world: Transform,
        /// The vectors.
        axes: [Vec3; 2],
        /// Shift along both.
        shift: Vec2,
    },
    /// Polar angle and longitude around the texture's origin.
    Spherical(Transform),
    /// Longitude and height around the texture's z axis.
    Cylindrical(Transform),
}

impl Mapping {
    /// The surface's own parameters, as they are.
    pub const IDENTITY: Self = Self::Uv { scale: Vec2::ONE, shift: Vec2::ZERO };

    /// Coordinates and derivatives at a point.
    pub fn map(&self, context: &SurfaceContext) -> Coordinates {
        match self {
            Self::Uv { scale, shift } => Coordinates {
                st: context.uv * *scale + *shift,
                dx: context.duv_dx * *scale,
                dy: context.duv_dy * *scale,
            },
            Self::Planar { texture_from_world, axes, shift } => {
                let project = |v: Vec3| Vec2::new(v.dot(axes[0]), v.dot(axes[1]));
                Coordinates {
                    st: project(texture_from_world.point(context.position)) + *shift,
                    dx: project(texture_from_world.vector(context.dp_dx)),
                    dy: project(texture_from_world.vector(context.dp_dy)),
                }
            }
            Self::Spherical(texture_from_world) => by_longitude(
                texture_from_world,
                context,
                |p| {
                    let theta = p.truncate().length().atan2(p.z);
                    Vec2::new(theta / PI, longitude(p))
                },
                1,
            ),
            Self::Cylindrical(texture_from_world) => {
                by_longitude(texture_from_world, context, |p| Vec2::new(longitude(p), p.z), 0)
            }
        }
    }
}

/// φ / 2π in `[0, 1)`.
fn longitude(p: Vec3) -> f32 {
    let turn = p.y.atan2(p.x) / TAU;
    if turn < 0.0 { turn + 1.0 } else { turn }
}

/// Maps by differences over one pixel; `periodic` is the coordinate that wraps around.
fn by_longitude(
    transform: &Transform,
    context: &SurfaceContext,
    map: impl Fn(Vec3) -> Vec2,
    periodic: usize,
) -> Coordinates {
    let at = |p: Vec3| map(transform.point(p));
    let st = at(context.position);
    let difference = |dp: Vec3| {
        let mut d = at(context.position + dp) - st;
        if d[periodic] > 0.5 {
            d[periodic] -= 1.0;
        } else if d[periodic] < -0.5 {
            d[periodic] += 1.0;
        }
        d
    };
    Coordinates { st, dx: difference(context.dp_dx), dy: difference(context.dp_dy) }
}
