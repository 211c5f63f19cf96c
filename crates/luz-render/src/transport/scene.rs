//! The paths of a scene.

use super::scene_vertex::{Anchor, SceneVertex, SurfaceVertex, cosine, direction};
use super::space::{Bounce, Extension, PathSpace, Scattering, Side, SpecularKind};
use crate::bsdf::TransportMode;
use crate::camera::Camera;
use crate::film::FilmWindow;
use crate::light::{
    BoundingSphere, Combination, EmittedSpectrum, EmittingPoint, LightContext, LightEnd, Place, Target,
};
use crate::material::Shading;
use crate::world::World;
use glam::{Vec2, Vec3};
use luz_color::{SampledSpectrum, Wavelengths};
use luz_geometry::{PrimitiveId, Ray, Reference, offset_ray_origin};
use luz_sample::Samples;
use std::cell::Cell;

/// How often a walk may pass through surfaces that do not scatter, between two vertices.
const MAX_PASSAGES: u32 = 1000;

/// A scene as a space of paths, at certain wavelengths and a moment.
pub struct SceneSpace<'w> {
    world: &'w World,
    camera: &'w Camera,
    window: FilmWindow,
    sphere: BoundingSphere,
    wavelengths: Wavelengths,
    time_u: f32,
    time: f32,
    emitted: EmittedSpectrum,
    rays: Cell<u32>,
    shadow_rays: Cell<u32>,
}

impl<'w> SceneSpace<'w> {
    /// The paths through a world at some wavelengths, at the moment of the shutter that `time_u` names, that are seen anywhere
    /// within `window`.
    pub fn new(
        world: &'w World,
        camera: &'w Camera,
        window: FilmWindow,
        wavelengths: Wavelengths,
        time_u: f32,
    ) -> Self {
        let emitted = EmittedSpectrum::default();
        Self {
            world,
            camera,
            window,
            sphere: world.bounding_sphere().into(),
            wavelengths,
            time_u,
            time: camera.time(time_u),
            emitted,
            rays: Cell::new(0),
            shadow_rays: Cell::new(0),
        }
    }

    /// The wavelengths.
    pub fn wavelengths(&self) -> &Wavelengths {
        &self.wavelengths
    }

    /// The number that names the moment.
    pub fn time_u(&self) -> f32 {
        self.time_u
    }

    /// The rays traced so far: for the closest hit, and for any.
    pub fn rays(&self) -> (u32, u32) {
        (self.rays.get(), self.shadow_rays.get())
    }

    /// The film positions at which paths are seen.
    pub fn window(&self) -> FilmWindow {
        self.window
    }

    /// The radius of a sphere around all surfaces.
    pub(super) fn radius(&self) -> f32 {
        self.sphere.radius
    }

    /// The density with which walks from the eye choose a place on the film, per pixel's area.
    pub fn film_density(&self) -> f32 {
        1.0 / self.window.area()
    }

    /// The place on the film where light that comes from `next` arrives; `None` if it does not.
    pub fn film(&self, end: &SceneVertex<'_>, next: &SceneVertex<'_>) -> Option<Vec2> {
        self.importance(end, next).map(|(film, _)| film)
    }

    /// The end of walks from the eye, at a point of the lens.
    pub fn lens(&self, lens_u: Vec2) -> SceneVertex<'w> {
        SceneVertex::Camera(self.camera.sample_end(lens_u, self.time_u), lens_u)
    }

    /// What is seen from an eye's end through a place on the film. `as_end` as in [`PathSpace::extend`].
    pub fn seen_through(&self, end: &SceneVertex<'_>, film: Vec2, as_end: bool) -> Option<SceneVertex<'w>> {
        let SceneVertex::Camera(end, _) = end else { return None };
        let ray = self.camera.departure(end, film);
        self.trace(ray.origin, ray.direction, as_end)
    }

    /// What a walk finds after `end`, an `x₀` that it has come upon from `at`, if it takes no notice of it: behind a surface that
    /// only emits, or in the next of several environments.
    pub fn beyond(&self, at: &SceneVertex<'_>, end: &SceneVertex<'_>) -> Option<SceneVertex<'w>> {
        let SceneVertex::Light(end) = end else { return None };
        match end.place {
            Place::Infinity(towards) => {
                let mut lights = self.world.infinite_lights().iter();
                lights.find(|&&light| light == end.light)?;
                lights.next().map(|&light| SceneVertex::Light(LightEnd::escaped(light, towards)))
            }
            Place::Surface(EmittingPoint { position, error, normal, .. }) => {
                let (direction, _) = direction(at.anchor(), Anchor::Point { position, error, normal: None })?;
                self.trace(offset_ray_origin(position, error, normal, direction), direction, true)
            }
            Place::Point(_) => None,
        }
    }

    /// Can a walk come upon several ends, one behind the other?
    fn has_ends_in_rows(&self) -> bool {
        self.world.has_passable_lights || self.world.infinite_lights().len() > 1
    }

    /// All ends that a walk from `at` comes upon, the first thing there being `next`.
    fn ends_from<'a>(
        &'a self,
        at: &'a SceneVertex<'w>,
        mut next: Option<SceneVertex<'w>>,
    ) -> impl Iterator<Item = SceneVertex<'w>> + 'a {
        std::iter::from_fn(move || {
            let end = next.take()?;
            if matches!(end, SceneVertex::Light(_)) {
                next = self.beyond(at, &end);
            }
            Some(end)
        })
        .filter(|end| self.as_light(end).is_some())
    }

    /// Finds a vertex again by the ray that found it.
    pub fn find_again(&self, (origin, direction): (Vec3, Vec3)) -> Option<SceneVertex<'w>> {
        self.trace(origin, direction, false)
    }

    fn lights(&self) -> LightContext<'_> {
        self.world.light_context(&self.emitted, Combination::Alone)
    }

    pub(super) fn trace(&self, origin: Vec3, direction: Vec3, as_end: bool) -> Option<SceneVertex<'w>> {
        let mut ray = Ray::new(origin, direction, self.time);
        for _ in 0..MAX_PASSAGES {
            self.rays.set(self.rays.get() + 1);
            let Some(hit) = self.world.intersect(&ray) else {
                let first = self.world.infinite_lights().first().filter(|_| as_end)?;
                return Some(SceneVertex::Light(LightEnd::escaped(*first, direction)));
            };
            let interaction = self.world.interaction(&ray, &hit);
            let surface = &interaction.surface;
            let light = interaction.light.filter(|&number| self.world.area_light(number).is_some());
            let mut wavelengths = self.wavelengths;
            let shading = Shading::at(self.world, self.camera, &interaction, None, &mut wavelengths);
            let Some(Shading { frame, bsdf }) = shading else {
                if let Some(light) = light
                    && as_end
                {
                    return Some(SceneVertex::Light(LightEnd::hit(light, surface)));
                }
                ray.origin = surface.offset_origin(direction);
                continue;
            };
            return Some(SceneVertex::Surface(SurfaceVertex {
                position: surface.position,
                error: surface.position_error,
                normal: surface.geometric_normal,
                frame,
                bsdf,
                uv: surface.uv,
                parametric: surface.parametric,
                light,
                disperses: wavelengths.secondary_terminated() && !self.wavelengths.secondary_terminated(),
                found_by: (ray.origin, direction),
            }));
        }
        None
    }

    /// A point that stands for a vertex as seen from another, for those who ask for points.
    fn aim(&self, from: &SceneVertex<'_>, at: &SceneVertex<'_>) -> Option<Vec3> {
        match (from.anchor(), at.anchor()) {
            (_, Anchor::Point { position, .. }) => Some(position),
            (Anchor::Point { position, .. }, Anchor::Far(towards)) => {
                Some(position + towards * (2.0 * self.sphere.radius))
            }
            (Anchor::Far(_), Anchor::Far(_)) => None,
        }
    }

    /// Where light from one vertex to the other arrives, if that is an orthographic camera.
    fn film_plane(&self, a: &SceneVertex<'_>, b: &SceneVertex<'_>) -> Option<Vec3> {
        let (camera, end, seen) = match (a, b) {
            (camera @ SceneVertex::Camera(end, _), seen) | (seen, camera @ SceneVertex::Camera(end, _)) => {
                (camera, end, seen)
            }
            _ => return None,
        };
        if matches!(camera.anchor(), Anchor::Point { .. }) {
            return None;
        }
        self.film(camera, seen).map(|film| self.camera.departure(end, film).origin)
    }

    /// All places on the film at which what is seen at one of them is seen: several, where a panorama's border repeats what is within.
    pub fn all_films(&self, film: Vec2) -> impl Iterator<Item = Vec2> {
        std::iter::once(film).chain(self.camera.repeated_films(film, f32::INFINITY))
    }

    /// The place on the film that a vertex is seen at, and `W`.
    pub(super) fn importance(&self, end: &SceneVertex<'_>, seen: &SceneVertex<'_>) -> Option<(Vec2, f32)> {
        let SceneVertex::Camera(camera_end, _) = end else { return None };
        let found = self.camera.film(camera_end, self.aim(end, seen)?, f32::INFINITY)?;
        self.window.contains(found.0).then_some(found)
    }

    fn reference(vertex: &SceneVertex<'_>) -> Option<Reference> {
        match vertex {
            SceneVertex::Surface(surface) => Some(Reference::surface(surface.position, surface.frame.n)),
            SceneVertex::Camera(end, _) => end.position().map(Reference::point),
            SceneVertex::Light(_) => None,
        }
    }
}

impl<'w> PathSpace for SceneSpace<'w> {
    type Vertex = SceneVertex<'w>;

    fn begin(&self, side: Side, samples: &mut impl Samples) -> Option<SceneVertex<'w>> {
        let u = samples.next_2d();
        match side {
            Side::Eye => Some(self.lens(u)),
            Side::Light => {
                let (number, _, x) = self.world.light_selection().sample_emitter(u.x)?;
                let u = Vec2::new(x, u.y);
                let (end, _) = self.world.lights()[number].sample_end(number as u32, self.lights(), u)?;
                Some(SceneVertex::Light(end))
            }
        }
    }

    fn begin_density(&self, side: Side, vertex: &SceneVertex<'w>) -> f32 {
        match (side, vertex) {
            (Side::Eye, SceneVertex::Camera(..)) => 1.0,
            (Side::Light, SceneVertex::Light(end)) => {
                let number = end.light as usize;
                let probability = self.world.light_selection().emitter_probability(number);
                probability * self.world.lights()[number].end_pdf(self.lights(), end)
            }
            _ => 0.0,
        }
    }

    fn extend(
        &self,
        side: Side,
        previous: Option<&SceneVertex<'w>>,
        at: &SceneVertex<'w>,
        as_end: bool,
        samples: &mut impl Samples,
    ) -> Option<Extension<SceneVertex<'w>>> {
        let spread = |vertex| Extension { vertex, bounce: Bounce::Spread };
        match at {
            SceneVertex::Camera(..) => {
                let u = samples.next_2d();
                self.seen_through(at, self.window.at(u), as_end).map(spread)
            }
            SceneVertex::Light(end) => {
                let light = &self.world.lights()[end.light as usize];
                let departure = light.sample_departure(self.lights(), self.sphere, end, samples.next_2d())?;
                self.trace(departure.origin, departure.direction, false).map(spread)
            }
            SceneVertex::Surface(surface) => {
                let (from, _) = direction(at.anchor(), previous?.anchor())?;
                let mode = match side {
                    Side::Light => TransportMode::Importance,
                    Side::Eye => TransportMode::Radiance,
                };
                let (lobe_u, direction_u) = (samples.next_1d(), samples.next_2d());
                let sample = surface.bsdf.propose(surface.frame.to_local(from), lobe_u, direction_u, mode)?;
                let direction = surface.frame.to_world(sample.wi).normalize();
                let vertex = self.trace(surface.offset_origin(direction), direction, as_end)?;
                let bounce = match (sample.flags.is_specular(), sample.flags.is_transmission()) {
                    (false, _) => Bounce::Spread,
                    (true, false) => Bounce::Specular(SpecularKind::Reflection),
                    (true, true) => Bounce::Specular(SpecularKind::Transmission),
                };
                Some(Extension { vertex, bounce })
            }
        }
    }

    fn direct(&self, from: &SceneVertex<'w>, samples: &mut impl Samples) -> Option<(SceneVertex<'w>, f32)> {
        let u = samples.next_2d();
        let reference = Self::reference(from)?;
        let context = self.lights();
        let (number, probability, x) = self.world.light_selection().sample(context.combination, &reference, u.x)?;
        let light = &self.world.lights()[number];
        let (end, pdf) = light.sample_end_from(number as u32, context, &reference, Vec2::new(x, u.y))?;
        Some((SceneVertex::Light(end), probability * pdf))
    }

    fn direct_density(&self, from: &SceneVertex<'w>, light: &SceneVertex<'w>) -> f32 {
        let (Some(reference), SceneVertex::Light(end)) = (Self::reference(from), light) else { return 0.0 };
        let context = self.lights();
        let number = end.light as usize;
        self.world.light_selection().probability(context.combination, &reference, number)
            * self.world.lights()[number].end_pdf_from(context, &reference, end)
    }

    fn as_light(&self, vertex: &SceneVertex<'w>) -> Option<SceneVertex<'w>> {
        match vertex {
            SceneVertex::Light(end) => Some(SceneVertex::Light(*end)),
            SceneVertex::Camera(..) => None,
            SceneVertex::Surface(surface) => surface.light.map(|light| {
                let SurfaceVertex { position, error, normal, uv, parametric, .. } = *surface;
                let place = Place::Surface(EmittingPoint { position, error, normal, uv, parametric });
                SceneVertex::Light(LightEnd { light, place, is_delta: false })
            }),
        }
    }

    fn can_be_hit(&self, end: &SceneVertex<'w>) -> bool {
        matches!(end, SceneVertex::Light(end) if !end.is_delta())
    }

    fn choose_end(&self, at: &SceneVertex<'w>, found: SceneVertex<'w>, u: f32) -> SceneVertex<'w> {
        if !self.has_ends_in_rows() {
            return found;
        }
        let count = self.ends_from(at, Some(found.clone())).count();
        let chosen = (u * count as f32) as usize;
        self.ends_from(at, Some(found.clone())).nth(chosen.min(count.saturating_sub(1))).unwrap_or(found)
    }

    fn end_probability(&self, at: &SceneVertex<'w>, end: &SceneVertex<'w>) -> f32 {
        if !self.can_be_hit(end) {
            return 0.0;
        }
        if !self.has_ends_in_rows() {
            return 1.0;
        }
        let first = match at {
            SceneVertex::Camera(..) => self.film(at, end).and_then(|film| self.seen_through(at, film, true)),
            _ => direction(at.anchor(), end.anchor())
                .and_then(|(towards, _)| self.trace(at.anchor().offset_origin(towards)?, towards, true)),
        };
        match self.ends_from(at, first).count() {
            0 => 0.0,
            count => 1.0 / count as f32,
        }
    }

    fn is_connectable(&self, vertex: &SceneVertex<'w>) -> bool {
        match vertex {
            SceneVertex::Surface(surface) => surface.bsdf.has_non_specular(),
            SceneVertex::Camera(..) | SceneVertex::Light(_) => true,
        }
    }

    #[inline]
    fn geometry(&self, a: &SceneVertex<'w>, b: &SceneVertex<'w>) -> f32 {
        let (a, b) = (a.anchor(), b.anchor());
        let Some((direction, squared)) = direction(a, b) else { return 0.0 };
        let geometry = cosine(a, direction) * cosine(b, direction) / squared;
        if geometry.is_finite() { geometry } else { 0.0 }
    }

    fn is_visible(&self, a: &SceneVertex<'w>, b: &SceneVertex<'w>) -> bool {
        let (from, to) = match (a.anchor(), b.anchor()) {
            (from @ Anchor::Point { .. }, to) | (to, from) => (from, to),
        };
        let Some((direction, _)) = direction(from, to) else { return false };
        let Some(origin) = from.offset_origin(direction) else { return false };
        let target = match to {
            // An orthographic camera is infinitely far away for all but what stands behind it.
            Anchor::Far(_) => match self.film_plane(a, b) {
                Some(on_plane) => Target::Point(on_plane),
                None => Target::Infinity,
            },
            Anchor::Point { position, normal: None, .. } => Target::Point(position),
            Anchor::Point { position, error, normal: Some(normal) } => {
                Target::Point(offset_ray_origin(position, error, normal, origin - position))
            }
        };
        self.shadow_rays.set(self.shadow_rays.get() + 1);
        self.world.is_clear(origin, direction, target, self.time, PrimitiveId::NONE)
    }

    fn scattering(
        &self,
        light_side: Option<&SceneVertex<'w>>,
        at: &SceneVertex<'w>,
        eye_side: Option<&SceneVertex<'w>>,
        bounce: Bounce,
    ) -> Scattering {
        match (light_side, at, eye_side) {
            (None, SceneVertex::Light(end), Some(next)) => {
                let Some(to) = self.aim(at, next) else { return Scattering::NONE };
                let light = &self.world.lights()[end.light as usize];
                let context = self.lights();
                Scattering {
                    value: light.emitted(context, end, to, &self.wavelengths),
                    toward_light: 0.0,
                    toward_eye: light.departure_pdf(context, self.sphere, end, to),
                    compression: 1.0,
                }
            }
            (Some(seen), SceneVertex::Camera(..), None) => match self.importance(at, seen) {
                Some((_, importance)) => Scattering {
                    value: SampledSpectrum::splat(importance),
                    toward_light: importance * self.film_density(),
                    toward_eye: 0.0,
                    compression: 1.0,
                },
                None => Scattering::NONE,
            },
            (Some(light_side), SceneVertex::Surface(surface), Some(eye_side)) => {
                let here = at.anchor();
                let towards = |side: &SceneVertex<'w>| direction(here, side.anchor()).map(|(direction, _)| direction);
                match (towards(light_side), towards(eye_side)) {
                    (Some(wi), Some(wo)) => surface.scattering(wi, wo, bounce),
                    _ => Scattering::NONE,
                }
            }
            _ => Scattering::NONE,
        }
    }
}
