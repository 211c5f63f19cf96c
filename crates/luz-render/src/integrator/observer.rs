//! Watching a path while it is traced.
//!
//! Everything that wants to know more of a path than its radiance listens to the same events: the `gbuffer` film, pictures of
//! single techniques, and traces for people to read. Whoever listens to nothing ([`Unwatched`]) costs nothing.

use crate::bsdf::BsdfSample;
use crate::material::Shading;
use glam::Vec3;
use luz_color::{SampledSpectrum, Wavelengths};
use luz_geometry::{Ray, SurfacePoint};

/// Something that happens while a path is traced.
#[derive(Clone, Copy, Debug)]
pub enum PathEvent<'a> {
    /// A ray sets out, from the camera or the last vertex; what it finds counts `throughput` times.
    Ray {
        /// The ray.
        ray: &'a Ray,
        /// How often light scatters between its origin and the camera, the origin included.
        depth: u32,
        /// Product of all cos θ · f / pdf so far.
        throughput: SampledSpectrum,
    },
    /// The ray goes on behind a surface where nothing scatters.
    Passage {
        /// The surface.
        surface: &'a SurfacePoint,
    },
    /// The path has met a surface that scatters.
    Vertex(Vertex<'a>),
    /// A technique has looked for direct light and found some, or might have.
    Light(LightEvent),
    /// The BSDF has scattered the path into a new direction.
    Scatter {
        /// What the BSDF drew, in local space.
        sample: BsdfSample,
        /// The direction in world space.
        direction: Vec3,
        /// Product of all cos θ · f / pdf, this one included.
        throughput: SampledSpectrum,
    },
    /// Russian roulette or splitting has decided how often the path goes on.
    Roulette {
        /// The expected number of continuations.
        expected: f32,
        /// The number drawn.
        continuations: u32,
    },
    /// This branch of the path ends.
    End(PathEnd),
}

/// A surface that a path has met.
#[derive(Clone, Copy, Debug)]
pub struct Vertex<'a> {
    /// How often light scatters between here and the camera.
    pub depth: u32,
    /// The ray that has met it.
    pub ray: &'a Ray,
    /// Where.
    pub surface: &'a SurfacePoint,
    /// How it scatters.
    pub shading: &'a Shading<'a>,
    /// Unit direction to where the path comes from, in world space.
    pub outgoing: Vec3,
}

/// How light was looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FoundBy {
    /// By following the BSDF (or the camera) to it.
    Bsdf,
    /// By drawing a point on it.
    Light,
}

/// One technique's attempt at direct light.
#[derive(Clone, Copy, Debug)]
pub struct LightEvent {
    /// Which technique.
    pub found_by: FoundBy,
    /// How often the light scatters on its way to the camera; 0 for light that is seen directly.
    pub depth: u32,
    /// What the technique would contribute if it were alone: throughput · f · Le / pdf. Zero if the light was hidden.
    pub alone: SampledSpectrum,
    /// The factor that combines it with the other technique.
    pub weight: f32,
    /// Density of drawing the point on the light, in solid angle; `None` where light sampling could not have done it.
    pub light_pdf: Option<f32>,
    /// Density of the BSDF, in solid angle; `None` where no BSDF could have drawn the direction, or light is seen directly or
    /// through specular scattering only.
    pub bsdf_pdf: Option<f32>,
}

/// Why a branch of a path ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathEnd {
    /// The ray left the scene.
    Escaped,
    /// The longest path was reached.
    MaxDepth,
    /// The BSDF reflects nothing in the direction drawn.
    Absorbed,
    /// Roulette.
    Roulette,
    /// More surfaces without scattering than are followed.
    TooManyPassages,
    /// The throughput is infinite or not a number.
    NotFinite,
}

/// Something that watches a path.
pub trait PathObserver {
    /// Is the next surface to be looked at, though the path is as long as it may be, and nothing scatters there any more?
    fn wants_vertex(&self) -> bool;

    /// Something has happened.
    fn observe(&mut self, event: PathEvent<'_>, wavelengths: &Wavelengths);

    /// Takes over an attempt at direct light at the first vertex, which the integrator then leaves out of the radiance.
    ///
    /// `f` is what arrives at the camera, not divided by a density; the densities are in solid angle. Each technique makes one
    /// attempt, unless the camera's ray meets nothing that scatters other than specularly or whose densities are not exact;
    /// attempts that find nothing, or light that the other technique cannot find, are not offered.
    #[inline]
    fn take_direct(&mut self, _found_by: FoundBy, _f: SampledSpectrum, _light_pdf: f32, _bsdf_pdf: f32) -> bool {
        false
    }
}

/// No one watches.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unwatched;

impl PathObserver for Unwatched {
    #[inline(always)]
    fn wants_vertex(&self) -> bool {
        false
    }

    #[inline(always)]
    fn observe(&mut self, _: PathEvent<'_>, _: &Wavelengths) {}
}
