//! Lights: what they emit, and how points on them are drawn.

mod area;
mod bounds;
mod distant;
mod distortion;
mod emission;
mod end;
mod environment;
mod goniometric;
mod hierarchy;
mod infinite;
mod parametric;
mod point;
mod portal;
mod projection;
mod screen;
mod selection;

pub use area::{AreaLight, Emission};
pub(crate) use area::{brightness, shown};
pub use bounds::LightBounds;
pub use distant::DistantLight;
pub use end::{BoundingSphere, Departure, EmittingPoint, LightEnd, Place};
pub use environment::ImageInfiniteLight;
pub(crate) use environment::SphereTexels;
pub use goniometric::GoniometricLight;
pub use hierarchy::LightHierarchy;
pub use infinite::UniformInfiniteLight;
pub use point::{PointLight, SpotLight};
pub use portal::{Portal, PortalInfiniteLight};
pub use projection::{ProjectionLight, Throw};
pub use selection::{LightSampler, LightSelection};

use crate::texture::Textures;
use glam::{Vec2, Vec3};
use luz_color::{SampledSpectrum, Spectrum, Wavelengths};
use luz_geometry::{Accelerator, Reference};
use std::cell::Cell;

/// A spectral distribution with a factor.
#[derive(Clone, Debug)]
pub struct ScaledSpectrum {
    /// The distribution.
    pub spectrum: Spectrum,
    /// The factor.
    pub scale: f32,
}

impl ScaledSpectrum {
    /// The values at a path's wavelengths.
    #[inline]
    pub fn sample(&self, wavelengths: &Wavelengths) -> SampledSpectrum {
        self.spectrum.sample(wavelengths) * self.scale
    }

    /// The photometric weight ∫ y(λ) s(λ) dλ, by which lights are chosen.
    pub fn weight(&self) -> f64 {
        f64::from(luz_color::spectrum_to_y(&self.spectrum)) * f64::from(self.scale)
    }
}

/// Light that arrives at a point from a sampled direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Incident radiance, unoccluded; of a delta light the integral over its delta (irradiance at normal incidence).
    pub radiance: SampledSpectrum,
    /// Unit direction towards the light.
    pub direction: Vec3,
    /// What the shadow ray aims at.
    pub target: Target,
    /// Density in solid angle; 1 for delta lights.
    pub pdf: f32,
    /// True where no other technique can find this light.
    pub is_delta: bool,
}

/// Where a shadow ray ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// Nowhere: the light is infinitely far away.
    Infinity,
    /// A point in space, clear of the surface that it may lie on ([`luz_geometry::offset_ray_origin`]).
    Point(Vec3),
}

/// One light.
#[derive(Clone, Debug)]
pub enum Light {
    /// Radiates from a point.
    Point(PointLight),
    /// Radiates from a point into a cone.
    Spot(SpotLight),
    /// Radiates from a point as an image of all directions says.
    Goniometric(Box<GoniometricLight>),
    /// Throws an image from a point.
    Projection(Box<ProjectionLight>),
    /// Shines along one direction from infinitely far away.
    Distant(DistantLight),
    /// The same radiance from all around.
    UniformInfinite(UniformInfiniteLight),
    /// An environment map.
    ImageInfinite(Box<ImageInfiniteLight>),
    /// An environment map that is seen through a portal.
    Portal(Box<PortalInfiniteLight>),
    /// A primitive that emits.
    Area(AreaLight),
}

/// What lights need to know of the world around them.
#[derive(Clone, Copy)]
pub struct LightContext<'a> {
    /// The geometry that area lights are part of.
    pub accelerator: &'a Accelerator,
    /// The emissions that area lights refer to.
    pub emissions: &'a [Emission],
    /// The textures that their coverage refers to.
    pub textures: &'a Textures,
    /// What the path has already evaluated of them.
    pub emitted: &'a EmittedSpectrum,
    /// What drawn directions are combined with.
    pub combination: Combination,
}

/// What the directions that are drawn towards lights are combined with: it decides whether a light may leave to another
/// technique what that one finds well.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Combination {
    /// Nothing: lights draw every direction from which light comes.
    #[default]
    Alone,
    /// Directions drawn from the BSDF or phase function, weighted by multiple importance sampling. Lights may then leave
    /// dim directions to them (MIS compensation), with density zero.
    WithBsdf,
}

impl LightContext<'_> {
    /// The radiance of an area light towards `outgoing`, from a point with the given normal and parameters.
    #[inline(always)]
    pub fn radiance(
        &self,
        light: &AreaLight,
        normal: Vec3,
        uv: Vec2,
        outgoing: Vec3,
        wavelengths: &Wavelengths,
    ) -> SampledSpectrum {
        let emission = &self.emissions[light.emission as usize];
        if !emission.shines(normal, outgoing) {
            return SampledSpectrum::ZERO;
        }
        match &emission.image {
            None => self.emitted.get(light.emission, || emission.radiance.sample(wavelengths)) * light.scale,
            Some(image) => emission.image_radiance(image, uv, wavelengths) * light.scale,
        }
    }
}

/// The last emission that a path has evaluated at its wavelengths: most paths meet but one lamp, many times.
#[derive(Debug)]
pub struct EmittedSpectrum {
    /// Which, or [`u32::MAX`].
    emission: Cell<u32>,
    spectrum: Cell<SampledSpectrum>,
}

impl Default for EmittedSpectrum {
    #[inline]
    fn default() -> Self {
        Self { emission: Cell::new(u32::MAX), spectrum: Cell::default() }
    }
}

impl EmittedSpectrum {
    #[inline(always)]
    fn get(&self, emission: u32, evaluate: impl FnOnce() -> SampledSpectrum) -> SampledSpectrum {
        if self.emission.get() != emission {
            self.spectrum.set(evaluate());
            self.emission.set(emission);
        }
        self.spectrum.get()
    }
}

impl Light {
    /// Draws a direction towards the light from `reference`; `None` if nothing can arrive along it.
    #[inline(always)]
    pub fn sample(
        &self,
        context: LightContext<'_>,
        reference: &Reference,
        u: Vec2,
        wavelengths: &Wavelengths,
    ) -> Option<LightSample> {
        match self {
            Self::Area(light) => light.sample(context, reference, u, wavelengths),
            other => other.sample_other(context, reference, u, wavelengths),
        }
    }

    /// [`sample`](Self::sample) of the kinds that are not inlined everywhere.
    #[inline(never)]
    fn sample_other(
        &self,
        context: LightContext<'_>,
        reference: &Reference,
        u: Vec2,
        wavelengths: &Wavelengths,
    ) -> Option<LightSample> {
        match self {
            Self::Area(light) => light.sample(context, reference, u, wavelengths),
            Self::Point(light) => light.sample(reference.position, wavelengths),
            Self::Spot(light) => light.sample(reference.position, wavelengths),
            Self::Goniometric(light) => light.sample(reference.position, wavelengths),
            Self::Projection(light) => light.sample(reference.position, wavelengths),
            Self::Distant(light) => Some(light.sample(wavelengths)),
            Self::UniformInfinite(light) => light.sample(context.combination, u, wavelengths),
            Self::ImageInfinite(light) => light.sample(context.combination, u, wavelengths),
            Self::Portal(light) => light.sample(reference, u, wavelengths),
        }
    }

    /// The density in solid angle with which [`sample`](Self::sample) draws `direction`, for the lights at infinity.
    /// (An area light is asked with the point that was hit: [`AreaLight::pdf`].)
    pub fn pdf_infinite(&self, context: LightContext<'_>, reference: &Reference, direction: Vec3) -> f32 {
        match self {
            Self::UniformInfinite(light) => light.pdf(context.combination),
            Self::Portal(light) => light.pdf(reference, direction),
            Self::ImageInfinite(light) => light.pdf(context.combination, direction),
            _ => 0.0,
        }
    }

    /// The radiance that arrives from infinity at `reference` against `direction` (which points away from the scene).
    pub fn radiance_infinite(
        &self,
        reference: &Reference,
        direction: Vec3,
        wavelengths: &Wavelengths,
    ) -> SampledSpectrum {
        match self {
            Self::UniformInfinite(light) => light.radiance(wavelengths),
            Self::Portal(light) => light.radiance(reference, direction, wavelengths),
            Self::ImageInfinite(light) => light.radiance(direction, wavelengths),
            _ => SampledSpectrum::ZERO,
        }
    }

    /// True for lights that rays which leave the scene meet.
    pub fn is_infinite(&self) -> bool {
        matches!(self, Self::UniformInfinite(_) | Self::ImageInfinite(_) | Self::Portal(_))
    }

    /// An estimate of the emitted power in photometric units, for choosing among lights. What a light leaves to another
    /// technique does not count.
    pub fn power(&self, context: LightContext<'_>, scene_radius: f32) -> f64 {
        match self {
            Self::Point(light) => light.power(),
            Self::Spot(light) => light.power(),
            Self::Goniometric(light) => light.power(),
            Self::Projection(light) => light.power(),
            Self::Distant(light) => light.power(scene_radius),
            Self::UniformInfinite(light) => light.power(context.combination, scene_radius),
            Self::ImageInfinite(light) => light.power(context.combination, scene_radius),
            Self::Portal(light) => light.power(),
            Self::Area(light) => light.power(context),
        }
    }

    /// Where the light is and how it shines; `None` for lights at infinity.
    pub fn bounds(&self, context: LightContext<'_>) -> Option<LightBounds> {
        match self {
            Self::Point(light) => Some(light.bounds()),
            Self::Spot(light) => Some(light.bounds()),
            Self::Goniometric(light) => Some(light.bounds()),
            Self::Projection(light) => Some(light.bounds()),
            Self::Portal(light) => Some(light.bounds()),
            Self::Area(light) => Some(light.bounds(context)),
            Self::Distant(_) | Self::UniformInfinite(_) | Self::ImageInfinite(_) => None,
        }
    }

    /// The irradiance of a surface that faces a light at infinity, about, in photometric units; for choosing among
    /// lights.
    pub fn far_irradiance(&self, context: LightContext<'_>) -> f64 {
        match self {
            Self::Distant(light) => light.irradiance.weight(),
            // What falls on a disk of area π r² in a scene of radius r = 1, over that area.
            _ => self.power(context, 1.0) / std::f64::consts::PI,
        }
    }

    /// The name that scene files use for this kind of light.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Point(_) => "point",
            Self::Spot(_) => "spot",
            Self::Goniometric(_) => "goniometric",
            Self::Projection(_) => "projection",
            Self::Distant(_) => "distant",
            Self::UniformInfinite(_) | Self::ImageInfinite(_) | Self::Portal(_) => "infinite",
            Self::Area(_) => "diffuse",
        }
    }
}
