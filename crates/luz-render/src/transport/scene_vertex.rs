//! The vertices of a scene's paths, and what an edge knows of its ends.

use super::space::{Bounce, Scattering, SpecularKind};
use crate::bsdf::{Bsdf, Lobe, TransportMode};
use crate::camera::{CameraEnd, CameraPlace};
use crate::light::{EmittingPoint, LightEnd, Place};
use glam::{Vec2, Vec3};
use luz_geometry::{Frame, offset_ray_origin};

/// A vertex of a path through a scene.
#[derive(Clone, Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "nearly all vertices are on surfaces, and are to be made without allocating"
)]
pub enum SceneVertex<'w> {
    /// On the lens, or, of an orthographic camera, infinitely far behind it; with the numbers that name the point of the lens.
    Camera(CameraEnd, Vec2),
    /// On a light, as an end of the path.
    Light(LightEnd),
    /// On a surface that scatters.
    Surface(SurfaceVertex<'w>),
}

/// A vertex on a surface that scatters.
#[derive(Clone, Debug)]
pub struct SurfaceVertex<'w> {
    /// World-space position.
    pub position: Vec3,
    /// Absolute bound of the position's error.
    pub error: Vec3,
    /// Unit geometric normal.
    pub normal: Vec3,
    /// Local space of the BSDF.
    pub frame: Frame,
    /// How it scatters.
    pub bsdf: Bsdf<'w>,
    /// Texture coordinates.
    pub uv: Vec2,
    /// The primitive's own parameters.
    pub parametric: Vec2,
    /// The light that the surface is, if it emits.
    pub light: Option<u32>,
    /// Whether the surface scatters each wavelength elsewhere, so that only the first is followed.
    pub disperses: bool,
    /// Origin and direction of the ray that has found it: what it takes to find it again.
    pub found_by: (Vec3, Vec3),
}

/// What an edge knows of one of its ends.
#[derive(Clone, Copy)]
pub(super) enum Anchor {
    /// A point, with the normal of its surface, if it is on one.
    Point { position: Vec3, error: Vec3, normal: Option<Vec3> },
    /// A direction from the scene.
    Far(Vec3),
}

impl Anchor {
    /// Where a ray from a point starts, to be clear of the surface; `None` at infinity.
    pub(super) fn offset_origin(&self, direction: Vec3) -> Option<Vec3> {
        match *self {
            Self::Point { position, error, normal: Some(normal) } => {
                Some(offset_ray_origin(position, error, normal, direction))
            }
            Self::Point { position, normal: None, .. } => Some(position),
            Self::Far(_) => None,
        }
    }
}

impl<'w> SceneVertex<'w> {
    #[inline]
    pub(super) fn anchor(&self) -> Anchor {
        match self {
            Self::Surface(SurfaceVertex { position, error, normal, .. }) => {
                Anchor::Point { position: *position, error: *error, normal: Some(*normal) }
            }
            Self::Light(end) => match end.place {
                Place::Surface(EmittingPoint { position, error, normal, .. }) => {
                    Anchor::Point { position, error, normal: Some(normal) }
                }
                Place::Point(position) => Anchor::Point { position, error: Vec3::ZERO, normal: None },
                Place::Infinity(towards) => Anchor::Far(towards),
            },
            Self::Camera(end, _) => match end.place() {
                CameraPlace::Point(position) => Anchor::Point { position, error: Vec3::ZERO, normal: None },
                CameraPlace::Infinity(looking) => Anchor::Far(-looking),
            },
        }
    }

    /// The surface's vertex, if it is on a surface that scatters.
    pub fn surface(&self) -> Option<&SurfaceVertex<'w>> {
        match self {
            Self::Surface(surface) => Some(surface),
            Self::Camera(..) | Self::Light(_) => None,
        }
    }

    /// The world-space position, if it is not at infinity.
    pub fn position(&self) -> Option<Vec3> {
        match self.anchor() {
            Anchor::Point { position, .. } => Some(position),
            Anchor::Far(_) => None,
        }
    }
}

/// The unit direction from one to another, and the squared distance, which is one to what is infinitely far away. `None` for the
/// same point, or between two that are both at infinity.
#[inline]
pub(super) fn direction(from: Anchor, to: Anchor) -> Option<(Vec3, f32)> {
    let (direction, squared) = match (from, to) {
        (Anchor::Point { position: a, .. }, Anchor::Point { position: b, .. }) => {
            let squared = a.distance_squared(b);
            ((b - a) / squared.sqrt(), squared)
        }
        (Anchor::Point { .. }, Anchor::Far(towards)) => (towards, 1.0),
        (Anchor::Far(towards), Anchor::Point { .. }) => (-towards, 1.0),
        (Anchor::Far(_), Anchor::Far(_)) => return None,
    };
    direction.is_finite().then_some((direction, squared))
}

/// Of a point of a surface `|cos θ|`, of all else one.
#[inline]
pub(super) fn cosine(at: Anchor, direction: Vec3) -> f32 {
    match at {
        Anchor::Point { normal: Some(normal), .. } => normal.dot(direction).abs(),
        Anchor::Point { normal: None, .. } | Anchor::Far(_) => 1.0,
    }
}

impl SpecularKind {
    pub(super) const fn lobe(self) -> Lobe {
        match self {
            Self::Reflection => Lobe::REFLECTION,
            Self::Transmission => Lobe::TRANSMISSION,
        }
    }
}

impl SurfaceVertex<'_> {
    /// Where a ray that leaves towards `direction` starts.
    pub(super) fn offset_origin(&self, direction: Vec3) -> Vec3 {
        offset_ray_origin(self.position, self.error, self.normal, direction)
    }

    /// The factors between the unit directions towards the light and towards the eye.
    pub(super) fn scattering(&self, toward_light: Vec3, toward_eye: Vec3, bounce: Bounce) -> Scattering {
        let (wi, wo) = (self.frame.to_local(toward_light), self.frame.to_local(toward_eye));
        // By the geometric normal, to which densities refer.
        let (cos_i, cos_o) = (self.normal.dot(toward_light).abs(), self.normal.dot(toward_eye).abs());
        if cos_i == 0.0 || cos_o == 0.0 {
            return Scattering::NONE;
        }
        match bounce {
            Bounce::Spread => {
                let (f, pdf) = self.bsdf.evaluate(wo, wi, TransportMode::Radiance);
                if f.is_black() {
                    return Scattering::NONE;
                }
                Scattering {
                    value: f * (wi.z.abs() / cos_i),
                    toward_light: pdf / cos_i,
                    toward_eye: self.bsdf.proposal_pdf(wi, wo, TransportMode::Importance) / cos_o,
                    compression: 1.0,
                }
            }
            Bounce::Specular(kind) => {
                let side = kind.lobe();
                let from_eye = self.bsdf.specular(wo, side, TransportMode::Radiance);
                let from_light = self.bsdf.specular(wi, side, TransportMode::Importance);
                let (Some(from_eye), Some(from_light)) = (from_eye, from_light) else { return Scattering::NONE };
                let eta_squared = from_eye.eta * from_eye.eta;
                // How the walk's own measure, by the shading normal, and that of densities, by the geometric one, differ.
                let tilt = (cos_o * wi.z.abs()) / (cos_i * wo.z.abs());
                let value = from_eye.f * (from_eye.wi.z.abs() * eta_squared * tilt);
                if !value.is_finite() {
                    return Scattering::NONE;
                }
                Scattering {
                    value,
                    toward_light: from_eye.pdf * eta_squared * tilt,
                    toward_eye: from_light.pdf,
                    compression: eta_squared * tilt,
                }
            }
        }
    }
}
