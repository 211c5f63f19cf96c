//! Light as it leaves: ends of paths on every kind of light, and rays that leave from them.
//!
//! A path that begins on a light begins with its end `x_0` ([`Light::sample_end`]) and goes on along a ray
//! ([`Light::sample_departure`]); one that looks for light at a vertex draws an end from there
//! ([`Light::sample_end_from`]). Each comes with its density on its own. Ends have densities in area (on surfaces), in
//! solid angle (at infinity), or one where there is no choice; see [`Departure`] for those of rays.

use super::{BoundingSphere, Combination, Departure, EmittingPoint, Light, LightContext, LightEnd, Place};
use glam::{Vec2, Vec3};
use luz_color::{SampledSpectrum, Wavelengths};
use luz_geometry::{Frame, Reference};
use luz_sample::warp;
use std::f32::consts::PI;

impl Light {
    /// True if no ray meets it by chance: only a single point or direction of it emits, or its surface lets all rays pass.
    pub fn is_delta(&self) -> bool {
        match self {
            Self::Point(_) | Self::Spot(_) | Self::Goniometric(_) | Self::Projection(_) | Self::Distant(_) => true,
            Self::UniformInfinite(_) | Self::ImageInfinite(_) | Self::Portal(_) => false,
            Self::Area(light) => light.is_unseen,
        }
    }

    fn end(&self, number: u32, place: Place) -> LightEnd {
        LightEnd { light: number, place, is_delta: self.is_delta() }
    }

    /// Draws where on the light, which is the world's `number`, a path begins; `None` where nothing is emitted.
    pub fn sample_end(&self, number: u32, context: LightContext<'_>, u: Vec2) -> Option<(LightEnd, f32)> {
        let (place, pdf) = match self {
            Self::Area(light) => {
                let (point, pdf) = light.sample_point(context, u)?;
                (Place::Surface(point), pdf)
            }
            Self::UniformInfinite(light) => light.sample_direction(Combination::Alone, u).map(at_infinity)?,
            Self::ImageInfinite(light) => light.sample_direction(Combination::Alone, u).map(at_infinity)?,
            Self::Portal(light) => light.sample_outward(u).map(at_infinity)?,
            _ => (self.only_place()?, 1.0),
        };
        (pdf > 0.0 && pdf.is_finite()).then(|| (self.end(number, place), pdf))
    }

    /// The density with which [`sample_end`](Self::sample_end) draws an end of this light: in area, in solid angle, or 1.
    pub fn end_pdf(&self, context: LightContext<'_>, end: &LightEnd) -> f32 {
        match (self, &end.place) {
            (Self::Area(light), Place::Surface(point)) => light.point_pdf(context, point),
            (Self::UniformInfinite(light), Place::Infinity(_)) => light.pdf(Combination::Alone),
            (Self::ImageInfinite(light), Place::Infinity(towards)) => light.pdf(Combination::Alone, *towards),
            (Self::Portal(light), Place::Infinity(towards)) => light.outward_pdf(*towards),
            _ => f32::from(end.is_delta),
        }
    }

    /// Draws an end as it is seen from `reference`, as [`sample`](Self::sample) draws it. Unlike there, the light may turn
    /// out not to shine on the reference point.
    pub fn sample_end_from(
        &self,
        number: u32,
        context: LightContext<'_>,
        reference: &Reference,
        u: Vec2,
    ) -> Option<(LightEnd, f32)> {
        let (place, pdf) = match self {
            Self::Area(light) => {
                let (point, pdf) = light.sample_point_from(context, reference, u)?;
                (Place::Surface(point), pdf)
            }
            Self::UniformInfinite(light) => light.sample_direction(context.combination, u).map(at_infinity)?,
            Self::ImageInfinite(light) => light.sample_direction(context.combination, u).map(at_infinity)?,
            Self::Portal(light) => light.sample_direction(reference, u).map(at_infinity)?,
            _ => (self.only_place()?, 1.0),
        };
        (pdf > 0.0 && pdf.is_finite()).then(|| (self.end(number, place), pdf))
    }

    /// The density with which [`sample_end_from`](Self::sample_end_from) draws an end of this light, in the measures of
    /// [`end_pdf`](Self::end_pdf).
    pub fn end_pdf_from(&self, context: LightContext<'_>, reference: &Reference, end: &LightEnd) -> f32 {
        match (self, &end.place) {
            (Self::Area(light), Place::Surface(point)) => light.point_pdf_from(context, reference, point),
            (_, Place::Infinity(towards)) if !end.is_delta => self.pdf_infinite(context, reference, *towards),
            _ => f32::from(end.is_delta),
        }
    }

    /// Draws a ray that leaves the light from an end of it; `None` where nothing leaves.
    pub fn sample_departure(
        &self,
        context: LightContext<'_>,
        sphere: BoundingSphere,
        end: &LightEnd,
        u: Vec2,
    ) -> Option<Departure> {
        match (self, &end.place) {
            (Self::Area(light), Place::Surface(point)) => light.sample_departure(context, point, u),
            (Self::Portal(light), Place::Infinity(towards)) => light.sample_departure(sphere, *towards, u),
            (_, Place::Infinity(towards)) => sphere.sample_departure(*towards, u),
            (_, Place::Point(position)) => {
                let (direction, pdf) = match self {
                    Self::Point(_) => (warp::uniform_sphere(u), warp::uniform_sphere_pdf()),
                    Self::Spot(light) => light.sample_direction(u)?,
                    Self::Goniometric(light) => light.sample_direction(u)?,
                    Self::Projection(light) => light.sample_direction(u)?,
                    _ => return None,
                };
                (pdf > 0.0 && pdf.is_finite()).then_some(Departure { origin: *position, direction, pdf })
            }
            _ => None,
        }
    }

    /// The density of [`sample_departure`](Self::sample_departure) for the ray from an end of this light to the point
    /// `to`; see [`Departure`] for its measure.
    pub fn departure_pdf(&self, context: LightContext<'_>, sphere: BoundingSphere, end: &LightEnd, to: Vec3) -> f32 {
        match (self, &end.place) {
            (Self::Area(light), Place::Surface(point)) => light.departure_pdf(context, point, to),
            (Self::Portal(light), Place::Infinity(towards)) => light.departure_pdf(*towards, to),
            (_, Place::Infinity(_)) => sphere.departure_pdf(),
            (_, Place::Point(position)) => {
                let Some(direction) = (to - *position).try_normalize() else { return 0.0 };
                match self {
                    Self::Point(_) => warp::uniform_sphere_pdf(),
                    Self::Spot(light) => light.direction_pdf(direction),
                    Self::Goniometric(light) => light.direction_pdf(direction),
                    Self::Projection(light) => light.direction_pdf(direction),
                    _ => 0.0,
                }
            }
            _ => 0.0,
        }
    }

    /// What an end of this light emits towards the point `to`, unoccluded: of a surface and from infinity the radiance, of
    /// a point the radiant intensity, of a distant light the irradiance at normal incidence.
    pub fn emitted(
        &self,
        context: LightContext<'_>,
        end: &LightEnd,
        to: Vec3,
        wavelengths: &Wavelengths,
    ) -> SampledSpectrum {
        match (self, &end.place) {
            (Self::Area(light), Place::Surface(point)) => {
                context.radiance(light, point.normal, point.uv, to - point.position, wavelengths)
            }
            (Self::Distant(light), Place::Infinity(_)) => light.irradiance.sample(wavelengths),
            (_, Place::Infinity(towards)) => self.radiance_infinite(&Reference::point(to), *towards, wavelengths),
            (_, Place::Point(position)) => {
                let Some(direction) = (to - *position).try_normalize() else { return SampledSpectrum::ZERO };
                match self {
                    Self::Point(light) => light.intensity.sample(wavelengths),
                    Self::Spot(light) => light.intensity.sample(wavelengths) * light.falloff(light.axis.dot(direction)),
                    Self::Goniometric(light) => light.intensity.sample(wavelengths) * light.factor(direction),
                    Self::Projection(light) => light.intensity(direction, wavelengths).unwrap_or_default(),
                    _ => SampledSpectrum::ZERO,
                }
            }
            _ => SampledSpectrum::ZERO,
        }
    }

    /// The place of a light that has but one.
    fn only_place(&self) -> Option<Place> {
        match self {
            Self::Point(light) => Some(Place::Point(light.position)),
            Self::Spot(light) => Some(Place::Point(light.position)),
            Self::Goniometric(light) => Some(Place::Point(light.position())),
            Self::Projection(light) => Some(Place::Point(light.position())),
            Self::Distant(light) => Some(Place::Infinity(light.towards)),
            Self::UniformInfinite(_) | Self::ImageInfinite(_) | Self::Portal(_) | Self::Area(_) => None,
        }
    }
}

fn at_infinity((towards, pdf): (Vec3, f32)) -> (Place, f32) {
    (Place::Infinity(towards), pdf)
}

impl BoundingSphere {
    /// A ray from infinity that meets the sphere: uniform on the disk that the sphere shows to the direction `towards`.
    fn sample_departure(&self, towards: Vec3, u: Vec2) -> Option<Departure> {
        let frame = Frame::from_z(towards);
        let on_disk = warp::concentric_disk(u) * self.radius;
        let origin = self.center + frame.s * on_disk.x + frame.t * on_disk.y + towards * self.beyond();
        let pdf = self.departure_pdf();
        (pdf > 0.0).then_some(Departure { origin, direction: -towards, pdf })
    }

    /// 1 / πR², per area of the disk.
    fn departure_pdf(&self) -> f32 {
        let pdf = 1.0 / (PI * self.radius * self.radius);
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    /// A distance from the centre that is beyond everything.
    pub(super) fn beyond(&self) -> f32 {
        1.001 * self.radius
    }
}

impl EmittingPoint {
    /// From a density in solid angle as seen from `reference` to one in area: cos θ / d².
    pub(super) fn area_density(&self, pdf: f32, reference: Vec3) -> f32 {
        let to = (self.position - reference).as_dvec3();
        let distance_squared = to.length_squared();
        let cos = to.dot(self.normal.as_dvec3()).abs() / distance_squared.sqrt();
        let density = (f64::from(pdf) * cos / distance_squared) as f32;
        if density.is_finite() { density } else { 0.0 }
    }
}
