//! Cameras: from a point on the film, a point on the lens and a moment to a ray, and back.

mod importance;

pub use importance::{CameraEnd, CameraPlace};

use crate::sphere_map::SphereMap;
use glam::{Vec2, Vec3};
use luz_geometry::{AnimatedTransform, Ray, Transform};
use luz_sample::warp;

/// The projection of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Pinhole or thin lens; screen coordinates are tangents.
    Perspective,
    /// Parallel rays; screen coordinates are lengths.
    Orthographic,
    /// The whole sphere of directions, `y` up.
    Spherical(SphereMap),
}

/// A thin lens; radius 0 is a pinhole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Radius of the aperture in scene units.
    pub radius: f32,
    /// Distance of the plane in focus.
    pub focal_distance: f32,
}

/// The rectangle of screen space that the film covers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScreenWindow {
    /// Left and bottom.
    pub min: Vec2,
    /// Right and top.
    pub max: Vec2,
}

impl ScreenWindow {
    /// `[−1, 1]` along the shorter side of a frame, more along the longer.
    pub fn of_aspect(aspect: f32) -> Self {
        let max = if aspect > 1.0 { Vec2::new(aspect, 1.0) } else { Vec2::new(1.0, 1.0 / aspect) };
        Self { min: -max, max }
    }
}

/// A camera: looks along +z with +y up in its own space, placed by `world_from_camera`.
#[derive(Clone, Debug)]
pub struct Camera {
    projection: Projection,
    lens: Lens,
    shutter: [f32; 2],
    world_from_camera: AnimatedTransform,
    /// Camera-space x and y per pixel, on the plane z = 1 (perspective) or at the lens (orthographic).
    pixel_scale: Vec2,
    /// Camera-space position of the raster's origin.
    raster_origin: Vec2,
    resolution: Vec2,
    minimum_spread: PixelSpread,
}

/// How rays move with one pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayDifferentials {
    /// Origin and direction of the ray one pixel to the right.
    pub x: (Vec3, Vec3),
    /// Origin and direction of the ray one pixel below.
    pub y: (Vec3, Vec3),
}

/// A camera's smallest ray differentials over its film, as a bound where real ones are not known.
#[derive(Clone, Copy, Debug, PartialEq)]
struct PixelSpread {
    origin_x: Vec3,
    origin_y: Vec3,
    direction_x: Vec3,
    direction_y: Vec3,
}

impl Camera {
    /// A camera.
    ///
    /// `field_of_view` is the angle in degrees that one unit of the screen window's half height subtends, and is read
    /// by the perspective projection only; `shutter` is the interval of time over which rays are spread.
    pub fn new(
        projection: Projection,
        field_of_view: f32,
        window: ScreenWindow,
        lens: Lens,
        shutter: [f32; 2],
        resolution: [u32; 2],
        world_from_camera: AnimatedTransform,
    ) -> Self {
        let scale = match projection {
            Projection::Perspective => (0.5 * field_of_view.to_radians()).tan(),
            _ => 1.0,
        };
        let resolution = Vec2::new(resolution[0] as f32, resolution[1] as f32);
        let mut camera = Self {
            projection,
            lens,
            shutter,
            world_from_camera,
            pixel_scale: scale * Vec2::new(window.max.x - window.min.x, window.min.y - window.max.y) / resolution,
            raster_origin: scale * Vec2::new(window.min.x, window.max.y),
            resolution,
            minimum_spread: PixelSpread {
                origin_x: Vec3::ZERO,
                origin_y: Vec3::ZERO,
                direction_x: Vec3::ZERO,
                direction_y: Vec3::ZERO,
            },
        };
        camera.minimum_spread = camera.find_minimum_spread();
        camera
    }

    /// Where the camera is, as a transform over time.
    pub fn world_from_camera(&self) -> &AnimatedTransform {
        &self.world_from_camera
    }

    /// The ray through `film` (in pixels from the image's top left corner) and the lens point of `lens_u`, at the
    /// moment that `time_u` names. Its direction is a unit vector.
    #[inline]
    pub fn ray(&self, film: Vec2, lens_u: Vec2, time_u: f32) -> Ray {
        self.ray_through(film, self.on_lens(lens_u), self.time(time_u))
    }

    /// The ray through `film` and a point of the lens.
    #[inline]
    fn ray_through(&self, film: Vec2, on_lens: Vec2, time: f32) -> Ray {
        let (origin, direction) = self.local_ray(film, on_lens);
        self.with_transform(time, |transform| {
            Ray::new(transform.point(origin), transform.vector(direction).normalize(), time)
        })
    }

    /// What `with` makes of the camera's place at `time`. A camera at rest spares the copy.
    #[inline]
    fn with_transform<T>(&self, time: f32, with: impl FnOnce(&Transform) -> T) -> T {
        if self.world_from_camera.is_animated() {
            with(&self.world_from_camera.interpolate(time))
        } else {
            with(self.world_from_camera.ends().0)
        }
    }

    /// The point of the lens that `u` names, in camera space.
    #[inline]
    fn on_lens(&self, u: Vec2) -> Vec2 {
        if self.has_lens() { warp::concentric_disk(u) * self.lens.radius } else { Vec2::ZERO }
    }

    /// The rays one pixel to the right of and below [`ray`](Self::ray).
    pub fn differentials(&self, film: Vec2, lens_u: Vec2, time_u: f32) -> RayDifferentials {
        let right = self.ray(film + Vec2::X, lens_u, time_u);
        let below = self.ray(film + Vec2::Y, lens_u, time_u);
        RayDifferentials { x: (right.origin, right.direction), y: (below.origin, below.direction) }
    }

    /// True if rays start from more than one place, so that the lens' dimensions matter.
    pub fn has_lens(&self) -> bool {
        self.lens.radius > 0.0
    }

    /// How far `position` on a plane of normal `normal` moves with one pixel, judged from the camera's narrowest pixel:
    /// the footprint of texture lookups on paths without differentials of their own.
    pub fn approximate_footprint(&self, position: Vec3, normal: Vec3, time: f32) -> (Vec3, Vec3) {
        self.with_transform(time, |transform| self.footprint_under(transform, position, normal))
    }

    fn footprint_under(&self, transform: &Transform, position: Vec3, normal: Vec3) -> (Vec3, Vec3) {
        let p = transform.inverse().point(position);
        let n = transform.inverse().normal(normal);
        let distance = p.length();
        if distance == 0.0 || !distance.is_finite() {
            return (Vec3::ZERO, Vec3::ZERO);
        }
        // In a frame that looks at the point, the pixel nearest to the axis stands for the one that saw it.
        let frame = look_frame(p / distance);
        let down = |v: Vec3| Vec3::new(v.dot(frame[0]), v.dot(frame[1]), v.dot(frame[2]));
        let (p, n) = (down(p), down(n));
        let plane = n.z * p.z;
        let hit = |origin: Vec3, spread: Vec3| {
            let direction = Vec3::Z + spread;
            let t = -(n.dot(origin) - plane) / n.dot(direction);
            origin + direction * t - p
        };
        let up = |v: Vec3| transform.vector(frame[0] * v.x + frame[1] * v.y + frame[2] * v.z);
        let spread = &self.minimum_spread;
        (up(hit(spread.origin_x, spread.direction_x)), up(hit(spread.origin_y, spread.direction_y)))
    }

    /// The moment that a number in `[0, 1)` names.
    pub(crate) fn time(&self, u: f32) -> f32 {
        self.shutter[0] + (self.shutter[1] - self.shutter[0]) * u
    }

    fn local_ray(&self, film: Vec2, on_lens: Vec2) -> (Vec3, Vec3) {
        let screen = self.raster_origin + film * self.pixel_scale;
        match self.projection {
            Projection::Perspective => self.through_lens(Vec3::ZERO, screen.extend(1.0).normalize(), on_lens),
            Projection::Orthographic => self.through_lens(screen.extend(0.0), Vec3::Z, on_lens),
            Projection::Spherical(map) => {
                let d = map.direction(film / self.resolution);
                (Vec3::ZERO, Vec3::new(d.x, d.z, d.y))
            }
        }
    }

    /// Bends a ray so that it starts on the lens and meets the unbent one in the plane of focus.
    fn through_lens(&self, origin: Vec3, direction: Vec3, on_lens: Vec2) -> (Vec3, Vec3) {
        if !self.has_lens() {
            return (origin, direction);
        }
        let focus = origin + direction * (self.lens.focal_distance / direction.z);
        let on_lens = origin + on_lens.extend(0.0);
        (on_lens, (focus - on_lens).normalize())
    }

    /// Looks for the smallest differentials along the film's diagonal.
    fn find_minimum_spread(&self) -> PixelSpread {
        let mut best = PixelSpread {
            origin_x: Vec3::INFINITY,
            origin_y: Vec3::INFINITY,
            direction_x: Vec3::INFINITY,
            direction_y: Vec3::INFINITY,
        };
        const STEPS: usize = 512;
        let shorter = |best: &mut Vec3, candidate: Vec3| {
            if candidate.length_squared() < best.length_squared() {
                *best = candidate;
            }
        };
        for step in 0..STEPS {
            let film = self.resolution * (step as f32 / (STEPS - 1) as f32);
            let centre = Vec2::ZERO;
            let (origin, direction) = self.local_ray(film, centre);
            let frame = look_frame(direction);
            let local = |v: Vec3| Vec3::new(v.dot(frame[0]), v.dot(frame[1]), v.dot(frame[2]));
            let (right_origin, right) = self.local_ray(film + Vec2::X, centre);
            let (below_origin, below) = self.local_ray(film + Vec2::Y, centre);
            shorter(&mut best.origin_x, right_origin - origin);
            shorter(&mut best.origin_y, below_origin - origin);
            shorter(&mut best.direction_x, local(right) - local(direction));
            shorter(&mut best.direction_y, local(below) - local(direction));
        }
        best
    }
}

/// An orthonormal basis whose third vector is `z`, turned from the camera's axes by the least rotation (that of Rodrigues'
/// formula).
fn look_frame(z: Vec3) -> [Vec3; 3] {
    // Half a turn, or nearly: about any axis.
    if z.z < -0.9999 {
        let rotation = glam::Quat::from_rotation_arc(Vec3::Z, z);
        return [rotation * Vec3::X, rotation * Vec3::Y, z];
    }
    let (x, y) = (z.x / (1.0 + z.z), z.y / (1.0 + z.z));
    [Vec3::new(1.0 - z.x * x, -z.x * y, -z.x), Vec3::new(-z.y * x, 1.0 - z.y * y, -z.y), z]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(projection: Projection, lens: Lens) -> Camera {
        Camera::new(
            projection,
            90.0,
            ScreenWindow::of_aspect(2.0),
            lens,
            [0.0, 1.0],
            [200, 100],
            AnimatedTransform::new(Transform::IDENTITY, 0.0, Transform::IDENTITY, 1.0),
        )
    }

    const PINHOLE: Lens = Lens { radius: 0.0, focal_distance: 1e6 };

    #[test]
    fn the_field_of_view_spans_the_shorter_side() {
        let camera = camera(Projection::Perspective, PINHOLE);
        let top = camera.ray(Vec2::new(100.0, 0.0), Vec2::ZERO, 0.0).direction;
        assert!(top.distance(Vec3::new(0.0, 1.0, 1.0).normalize()) < 1e-6, "{top}");
        let right = camera.ray(Vec2::new(200.0, 50.0), Vec2::ZERO, 0.0).direction;
        assert!(right.distance(Vec3::new(2.0, 0.0, 1.0).normalize()) < 1e-6, "{right}");
    }

    #[test]
    fn a_lens_keeps_the_plane_of_focus_sharp() {
        let camera = camera(Projection::Perspective, Lens { radius: 0.3, focal_distance: 4.0 });
        let film = Vec2::new(31.0, 77.0);
        let mut focus: Option<Vec3> = None;
        for i in 0..50 {
            let u = Vec2::new((i as f32 * 0.618) % 1.0, (i as f32 * 0.381) % 1.0);
            let ray = camera.ray(film, u, 0.0);
            let point = ray.origin + ray.direction * ((4.0 - ray.origin.z) / ray.direction.z);
            assert!(point.distance(*focus.get_or_insert(point)) < 1e-4);
        }
    }

    #[test]
    fn orthographic_rays_are_parallel() {
        let camera = camera(Projection::Orthographic, PINHOLE);
        let ray = camera.ray(Vec2::new(0.0, 100.0), Vec2::ZERO, 0.0);
        assert_eq!((ray.origin, ray.direction), (Vec3::new(-2.0, -1.0, 0.0), Vec3::Z));
    }

    #[test]
    fn a_panorama_looks_up_at_y() {
        for map in [SphereMap::EqualArea, SphereMap::LatitudeLongitude] {
            let camera = camera(Projection::Spherical(map), PINHOLE);
            let film = if map == SphereMap::EqualArea { Vec2::new(100.0, 50.0) } else { Vec2::new(100.0, 0.0) };
            let up = camera.ray(film, Vec2::ZERO, 0.0).direction;
            assert!(up.distance(Vec3::Y) < 1e-4, "{map:?} {up}");
        }
    }

    #[test]
    fn the_approximate_footprint_is_a_pixel_wide() {
        let camera = camera(Projection::Perspective, PINHOLE);
        let (dx, dy) = camera.approximate_footprint(Vec3::new(0.0, 0.0, 10.0), Vec3::NEG_Z, 0.0);
        // At distance 10 the screen is 20 high over 100 pixels; the narrowest pixel is at the corner.
        assert!(dx.length() > 0.02 && dx.length() < 0.21, "{dx}");
        assert!(dy.length() > 0.02 && dy.length() < 0.21, "{dy}");
    }
}
