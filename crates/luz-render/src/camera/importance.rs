//! Cameras as ends of paths: what they respond to.
//!
//! The last vertex `x_k` of a path lies on the lens, or is the direction in which an orthographic camera looks. The points
//! of the lens and the moments of the shutter are all alike: their density, in units of the lens' area and of the time
//! that the shutter is open, is one, whichever way a path is traced, and appears nowhere.
//!
//! What a camera responds with, `W`, is the density of the film's positions: square pixels by solid angle or, for the
//! orthographic camera, by area of a plane perpendicular to the direction; so that the integral of `W L` over what falls on a
//! pixel is the pixel's value under the box filter (Veach 1997, section 8.3.2, with the film's position as response).

use super::{Camera, Projection};
use crate::film::FilmWindow;
use crate::sphere_map::SphereMap;
use glam::{Vec2, Vec3};
use luz_geometry::{Ray, Transform};
use std::f32::consts::PI;

/// The end `x_k` of a path, on the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraEnd {
    /// The point of the lens, in camera space.
    on_lens: Vec2,
    /// The moment at which the shutter is open.
    time: f32,
    place: CameraPlace,
}

/// Where a path ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CameraPlace {
    /// At a point of the lens, in world space.
    Point(Vec3),
    /// Infinitely far away, for all that counts: the camera looks in this unit direction of the world.
    Infinity(Vec3),
}

impl CameraEnd {
    /// Where it is.
    pub fn place(&self) -> CameraPlace {
        self.place
    }

    /// The moment at which the path is seen.
    pub fn time(&self) -> f32 {
        self.time
    }

    /// World-space position; `None` for orthographic cameras.
    pub fn position(&self) -> Option<Vec3> {
        match self.place {
            CameraPlace::Point(position) => Some(position),
            CameraPlace::Infinity(_) => None,
        }
    }

    /// True where it is a direction, and not a point.
    pub fn is_infinite(&self) -> bool {
        matches!(self.place, CameraPlace::Infinity(_))
    }

    /// The unit direction in which it is seen from `from`; `None` from the place itself.
    pub fn direction_from(&self, from: Vec3) -> Option<Vec3> {
        match self.place {
            CameraPlace::Point(position) => (position - from).try_normalize(),
            CameraPlace::Infinity(looking) => Some(-looking),
        }
    }
}

impl Camera {
    /// The end of a path at the point of the lens that `lens_u` names, at the moment that `time_u` names, as
    /// [`ray`](Self::ray) has them.
    pub fn sample_end(&self, lens_u: Vec2, time_u: f32) -> CameraEnd {
        let (on_lens, time) = (self.on_lens(lens_u), self.time(time_u));
        let place = self.with_transform(time, |transform| match self.projection {
            Projection::Perspective => CameraPlace::Point(transform.point(on_lens.extend(0.0))),
            Projection::Spherical(_) => CameraPlace::Point(transform.point(Vec3::ZERO)),
            Projection::Orthographic => CameraPlace::Infinity(transform.vector(self.looking(on_lens)).normalize()),
        });
        CameraEnd { on_lens, time, place }
    }

    /// The ray that [`ray`](Self::ray) sends through `film` from the same point of the lens at the same moment.
    pub fn departure(&self, end: &CameraEnd, film: Vec2) -> Ray {
        self.ray_through(film, end.on_lens, end.time)
    }

    /// Where on the film, in pixels, light from the point `from` falls, and the camera's response `W` to it: square pixels
    /// per steradian, or per area perpendicular to the direction for orthographic cameras, all in the world's measure.
    ///
    /// `None` behind the camera and beyond `margin` pixels around the film. A panorama is whole, and positions beyond its
    /// border repeat those within: see [`repeated_films`](Self::repeated_films).
    pub fn film(&self, end: &CameraEnd, from: Vec3, margin: f32) -> Option<(Vec2, f32)> {
        let (film, response) = self.with_transform(end.time, |transform| match self.projection {
            Projection::Perspective => self.perspective_film(transform, end, from),
            Projection::Orthographic => self.orthographic_film(transform, end, from),
            Projection::Spherical(map) => self.spherical_film(transform, map, from),
        })?;
        let is_within =
            film.cmpge(Vec2::splat(-margin)).all() && film.cmple(self.resolution + Vec2::splat(margin)).all();
        (is_within && response > 0.0 && response.is_finite()).then_some((film, response))
    }

    /// The positions up to `margin` pixels beyond the film whose rays are the same as that of `film`, within it, with the
    /// same response: what falls near one border of a panorama falls near another, too. None for other cameras.
    pub fn repeated_films(&self, film: Vec2, margin: f32) -> Vec<Vec2> {
        let Projection::Spherical(map) = self.projection else { return Vec::new() };
        let margin = Vec2::splat(margin) / self.resolution;
        let Vec2 { x: u, y: v } = film / self.resolution;
        let candidates = match map {
            // Around the axis, and over the poles to the other side.
            SphereMap::LatitudeLongitude => {
                [(u - 1.0, v), (u + 1.0, v), (u - 0.5, -v), (u + 0.5, -v), (u - 0.5, 2.0 - v), (u + 0.5, 2.0 - v)]
                    .to_vec()
            }
            // Edges are glued to themselves, and all corners are one point.
            SphereMap::EqualArea => [
                (-u, 1.0 - v),
                (2.0 - u, 1.0 - v),
                (1.0 - u, -v),
                (1.0 - u, 2.0 - v),
                (u - 1.0, v - 1.0),
                (u - 1.0, v + 1.0),
                (u + 1.0, v - 1.0),
                (u + 1.0, v + 1.0),
            ]
            .to_vec(),
        };
        let is_beyond = |uv: &Vec2| {
            (uv.cmplt(Vec2::ZERO).any() || uv.cmpgt(Vec2::ONE).any())
                && uv.cmpge(-margin).all()
                && uv.cmple(Vec2::ONE + margin).all()
        };
        candidates.into_iter().map(Vec2::from).filter(is_beyond).map(|uv| uv * self.resolution).collect()
    }

    /// The film positions of different paths within a window: not those beyond the border of a panorama, which
    /// [repeat](Self::repeated_films) others.
    pub fn window_of_paths(&self, window: FilmWindow) -> FilmWindow {
        match self.projection {
            Projection::Spherical(_) => {
                FilmWindow { min: window.min.max(Vec2::ZERO), max: window.max.min(self.resolution) }
            }
            Projection::Perspective | Projection::Orthographic => window,
        }
    }

    /// Square pixels by area of the screen.
    fn pixels_by_area(&self) -> f32 {
        1.0 / (self.pixel_scale.x * self.pixel_scale.y).abs()
    }

    /// The direction in camera space in which an orthographic camera looks from a point of the lens.
    fn looking(&self, on_lens: Vec2) -> Vec3 {
        self.through_lens(Vec3::ZERO, Vec3::Z, on_lens).1
    }

    fn perspective_film(&self, transform: &Transform, end: &CameraEnd, from: Vec3) -> Option<(Vec2, f32)> {
        let to = transform.inverse().point(from) - end.on_lens.extend(0.0);
        if to.z <= 0.0 {
            return None;
        }
        // Rays from all over the lens meet in the plane of focus.
        let focus = if self.has_lens() { end.on_lens / self.lens.focal_distance } else { Vec2::ZERO };
        let screen = focus + to.truncate() / to.z;
        // On the screen at distance 1, cos³θ dA = dω; and of a linear map M, dω_world = |det M| dω / |M ω|³.
        let cos = to.z / to.length();
        let response = self.pixels_by_area() / (cos * cos * cos) * local_solid_angle(transform, to);
        Some(((screen - self.raster_origin) / self.pixel_scale, response))
    }

    fn orthographic_film(&self, transform: &Transform, end: &CameraEnd, from: Vec3) -> Option<(Vec2, f32)> {
        let local = transform.inverse().point(from);
        if local.z <= 0.0 {
            return None;
        }
        let looking = self.looking(end.on_lens);
        let screen = local.truncate() - end.on_lens - looking.truncate() * (local.z / looking.z);
        // Of a linear map M, the area perpendicular to M ω is |det M| / |M ω| times that perpendicular to ω.
        let stretch = transform.vector(looking).length() / transform.matrix().determinant().abs();
        let response = self.pixels_by_area() / looking.z * stretch;
        Some(((screen - self.raster_origin) / self.pixel_scale, response))
    }

    fn spherical_film(&self, transform: &Transform, map: SphereMap, from: Vec3) -> Option<(Vec2, f32)> {
        let to = transform.inverse().point(from);
        let direction = to.try_normalize()?;
        let film = map.coordinates(Vec3::new(direction.x, direction.z, direction.y));
        let by_solid_angle = match map {
            SphereMap::EqualArea => 1.0 / (4.0 * PI),
            // A pixel is du dv = dφ dθ / 2π².
            SphereMap::LatitudeLongitude => 1.0 / (2.0 * PI * PI * direction.x.hypot(direction.z)),
        };
        let response = by_solid_angle * self.resolution.x * self.resolution.y * local_solid_angle(transform, to);
        Some((film * self.resolution, response))
    }
}

/// The solid angle in camera space by that in the world, about the direction `to` in camera space: 1 for transforms that
/// keep angles.
fn local_solid_angle(world_from_camera: &Transform, to: Vec3) -> f32 {
    let stretch = world_from_camera.vector(to).length() / to.length();
    stretch * stretch * stretch / world_from_camera.matrix().determinant().abs()
}
