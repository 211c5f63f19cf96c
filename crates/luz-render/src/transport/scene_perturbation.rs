//! Perturbations of the paths of a scene.

use super::path::Node;
use super::perturbation::{PerturbationSpace, Range};
use super::scene::SceneSpace;
use super::scene_vertex::{Anchor, SceneVertex, cosine, direction};
use super::space::{Side, SpecularKind};
use crate::bsdf::TransportMode;
use glam::{DVec3, Vec2, Vec3};
use luz_geometry::Frame;
use luz_sample::Samples;
use std::f32::consts::TAU;

/// The angle between two unit vectors, exact for small ones.
fn angle(a: Vec3, b: Vec3) -> f64 {
    let (a, b): (DVec3, DVec3) = (a.into(), b.into());
    a.cross(b).length().atan2(a.dot(b))
}

/// A point at distance `r` in the plane perpendicular to a direction.
fn beside(direction: Vec3, r: f64, u: f32) -> Vec3 {
    let frame = Frame::from_z(direction);
    let (sin, cos) = (TAU * u).sin_cos();
    (frame.s * cos + frame.t * sin) * r as f32
}

/// The part of a vector that is perpendicular to a direction.
fn perpendicular(v: Vec3, direction: Vec3) -> f64 {
    let (v, direction): (DVec3, DVec3) = (v.into(), direction.into());
    (v - direction * v.dot(direction)).length()
}

impl<'w> PerturbationSpace for SceneSpace<'w> {
    fn shift(
        &self,
        eye: &SceneVertex<'w>,
        seen: &SceneVertex<'w>,
        range: Range,
        as_end: bool,
        samples: &mut impl Samples,
    ) -> Option<SceneVertex<'w>> {
        let u = samples.next_2d();
        let r = range.draw(u.x) as f32;
        let film = self.film(eye, seen)? + r * Vec2::from_angle(TAU * u.y);
        if self.window().contains(film) { self.seen_through(eye, film, as_end) } else { None }
    }

    fn shift_density(&self, eye: &SceneVertex<'w>, from: &SceneVertex<'w>, to: &SceneVertex<'w>, range: Range) -> f32 {
        let (Some((from, _)), Some((to, importance))) = (self.importance(eye, from), self.importance(eye, to)) else {
            return 0.0;
        };
        (range.density_on_plane(f64::from(from.distance(to))) * f64::from(importance)) as f32
    }

    fn turn(
        &self,
        at: &SceneVertex<'w>,
        old: (&SceneVertex<'w>, &SceneVertex<'w>),
        range: Range,
        samples: &mut impl Samples,
    ) -> Option<SceneVertex<'w>> {
        let u = samples.next_2d();
        let r = range.draw(u.x);
        match at.anchor() {
            Anchor::Far(towards) => {
                let origin = old.1.position()? + beside(towards, r, u.y) + towards * (2.0 * self.radius());
                self.trace(origin, -towards, false)
            }
            here @ Anchor::Point { .. } => {
                let (old, _) = direction(old.0.anchor(), old.1.anchor())?;
                // Turning by θ: cos θ along, sin θ beside.
                let (sin, cos) = r.sin_cos();
                let turned = (old * cos as f32 + beside(old, sin, u.y)).normalize();
                self.trace(here.offset_origin(turned)?, turned, false)
            }
        }
    }

    fn turn_density(
        &self,
        old: (&SceneVertex<'w>, &SceneVertex<'w>),
        new: (&SceneVertex<'w>, &SceneVertex<'w>),
        range: Range,
    ) -> f32 {
        match (new.0.anchor(), old.1.position(), new.1.position()) {
            (Anchor::Far(towards), Some(from), Some(to)) => {
                range.density_on_plane(perpendicular(to - from, towards)) as f32
            }
            (here @ Anchor::Point { .. }, ..) => {
                let (Some((from, _)), Some((to, _))) =
                    (direction(old.0.anchor(), old.1.anchor()), direction(here, new.1.anchor()))
                else {
                    return 0.0;
                };
                let cos = cosine(here, to);
                if cos > 0.0 { (range.density_of_turn(angle(from, to)) / f64::from(cos)) as f32 } else { 0.0 }
            }
            _ => 0.0,
        }
    }

    fn follow(
        &self,
        side: Side,
        previous: &SceneVertex<'w>,
        at: &SceneVertex<'w>,
        kind: SpecularKind,
        as_end: bool,
    ) -> Option<SceneVertex<'w>> {
        let surface = at.surface()?;
        let (from, _) = direction(at.anchor(), previous.anchor())?;
        let mode = match side {
            Side::Light => TransportMode::Importance,
            Side::Eye => TransportMode::Radiance,
        };
        let sample = surface.bsdf.specular(surface.frame.to_local(from), kind.lobe(), mode)?;
        let onward = surface.frame.to_world(sample.wi).normalize();
        self.trace(surface.offset_origin(onward), onward, as_end)
    }

    fn turns_by_pixels(&self, nodes: &[Node<SceneVertex<'w>>], pixels: Range) -> Option<Range> {
        let [first, .., seen, eye] = nodes else { return None };
        let (_, importance) = self.importance(&eye.vertex, &seen.vertex)?;
        // The size of a pixel where the path is seen.
        let distance = match (eye.vertex.position(), seen.vertex.position()) {
            (Some(eye), Some(seen)) => f64::from(eye.distance(seen)),
            _ => 1.0,
        };
        let pixel = distance / f64::from(importance).sqrt();
        if first.vertex.position().is_none() {
            return pixels.scaled(pixel);
        }
        let way: f64 = nodes[..nodes.len() - 1]
            .windows(2)
            .map(|pair| match (pair[0].vertex.position(), pair[1].vertex.position()) {
                (Some(a), Some(b)) => f64::from(a.distance(b)),
                _ => 0.0,
            })
            .sum();
        // No turn is more than half of one.
        let scaled = pixels.scaled(pixel / way)?;
        let largest = scaled.largest.min(std::f64::consts::FRAC_PI_2);
        Range { largest, ..scaled }.scaled(1.0)
    }
}
