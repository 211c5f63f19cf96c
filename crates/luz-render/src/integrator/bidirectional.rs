//! Bidirectional path tracing (Veach 1997, chapter 10), and light tracing as its column of one eye vertex.
//!
//! A sample is a walk from the light and one from the eye. All their prefixes are connected; technique `(s, t)` of `s` light
//! vertices and `t` eye vertices is weighted by the densities of all techniques that could have made the same path. With `s = 0`
//! the eye's walk comes upon the light, with `s = 1` a point on a light is drawn as seen from the eye's last vertex, and with `t = 1`
//! the light arrives at whatever pixel it may, as a splat.

use super::estimator::{CameraStart, PixelEstimator, Splats};
use super::kind::BidirectionalIntegrator;
use super::path::{CAMERA_DIMENSIONS, PathCost};
use crate::camera::Camera;
use crate::film::FilmWindow;
use crate::transport::connection::{Scratch, connect};
use crate::transport::{Bounce, PathSpace, SceneSpace, SceneVertex, Side, Subpath};
use crate::world::World;
use glam::Vec2;
use luz_color::{SampledSpectrum, Wavelengths};
use luz_sample::Samples;

/// Dimensions of one step of both walks: the eye's (4), the light's (4), a point on a light (2).
const STEP_DIMENSIONS: u32 = 10;
/// The place of the light's walk among them.
const LIGHT_DIMENSION: u32 = 4;
/// The place of the point on a light.
const DIRECT_DIMENSION: u32 = 8;
/// The place of roulette among the dimensions of a step of one walk.
const ROULETTE_DIMENSION: u32 = 3;
/// Walks of fewer vertices go on without roulette.
const ROULETTE_VERTICES: usize = 5;

/// A bidirectional path tracer at work: its settings, and where light goes.
#[derive(Clone, Copy, Debug)]
pub struct BidirectionalTracer<'a> {
    /// How paths are made.
    pub settings: BidirectionalIntegrator,
    /// What they meet.
    pub world: &'a World,
    /// Where they end.
    pub camera: &'a Camera,
    /// Where on the film they are looked for.
    pub window: FilmWindow,
}

/// The first dimension of a step.
fn step_dimension(step: usize) -> u32 {
    CAMERA_DIMENSIONS.wrapping_add(STEP_DIMENSIONS.wrapping_mul(step as u32))
}

/// Walks from the light, up to `vertices` of them.
fn walk_from_light<'w>(
    space: &SceneSpace<'w>,
    walk: &mut Subpath<SceneVertex<'w>>,
    vertices: usize,
    samples: &mut impl Samples,
) {
    samples.set_dimension(step_dimension(0) + LIGHT_DIMENSION);
    if vertices == 0 || !walk.begin(space, samples) {
        return;
    }
    while walk.len() < vertices {
        let first = step_dimension(walk.len()) + LIGHT_DIMENSION;
        if walk.len() >= ROULETTE_VERTICES {
            samples.set_dimension(first + ROULETTE_DIMENSION);
            if !walk.survives(samples.next_1d()) {
                return;
            }
        }
        samples.set_dimension(first);
        let Some((previous, at)) = walk.end() else { return };
        let Some(next) = space.extend(Side::Light, previous, at, false, samples) else { return };
        if !walk.push(space, next.vertex, next.bounce) {
            return;
        }
    }
}

/// Walks from the eye through a place on the film, up to `vertices` of them. `found` is called with every walk that has ended in
/// something that does nothing but emit: it is not part of the walk, which goes on behind it.
fn walk_from_eye<'w, S: Samples>(
    space: &SceneSpace<'w>,
    walk: &mut Subpath<SceneVertex<'w>>,
    start: &CameraStart,
    vertices: usize,
    samples: &mut S,
    mut found: impl FnMut(&Subpath<SceneVertex<'w>>, &mut S),
) {
    walk.restart(space.lens(start.lens_u), 1.0);
    while walk.len() < vertices {
        let first = step_dimension(walk.len());
        if walk.len() >= ROULETTE_VERTICES {
            samples.set_dimension(first + ROULETTE_DIMENSION);
            if !walk.survives(samples.next_1d()) {
                return;
            }
        }
        samples.set_dimension(first);
        let Some((previous, at)) = walk.end() else { return };
        let (mut next, bounce) = if previous.is_none() {
            (space.seen_through(at, start.film, true), Bounce::Spread)
        } else {
            match space.extend(Side::Eye, previous, at, true, samples) {
                Some(next) => (Some(next.vertex), next.bounce),
                None => return,
            }
        };
        loop {
            let Some(vertex) = next.take() else { return };
            if !matches!(vertex, SceneVertex::Light(_)) {
                if !walk.push(space, vertex, bounce) {
                    return;
                }
                break;
            }
            if !walk.push(space, vertex.clone(), bounce) {
                return;
            }
            found(walk, samples);
            walk.pop();
            next = walk.end().and_then(|(_, at)| space.beyond(at, &vertex));
        }
    }
}

/// Is some vertex's scattering, of the first so many, different at each wavelength?
fn disperses(walk: &Subpath<SceneVertex<'_>>, vertices: usize) -> bool {
    (0..vertices).any(|i| walk.vertex(i).and_then(SceneVertex::surface).is_some_and(|surface| surface.disperses))
}

/// A path that a sample has found.
pub(crate) struct Found<'a, 'w> {
    /// The walk from the light, and how many of its vertices the path has.
    pub light: (&'a Subpath<SceneVertex<'w>>, usize),
    /// The walk from the eye, and how many of its vertices the path has.
    pub eye: (&'a Subpath<SceneVertex<'w>>, usize),
    /// The `x₀` that stands for the first vertex of all, see [`Connection::light`](crate::transport::Connection::light).
    pub x0: Option<&'a SceneVertex<'w>>,
    /// Contribution over density, times the technique's weight; the density of the film position is one over the window's area.
    pub value: SampledSpectrum,
}

impl<'w> Found<'_, 'w> {
    /// Where on the film the path ends, other than where its walk from the eye has set out to.
    pub fn arrival(&self, space: &SceneSpace<'w>) -> Option<Vec2> {
        let (light, s) = self.light;
        let last = self.x0.or_else(|| light.vertex(s.checked_sub(1)?))?;
        space.film(self.eye.0.vertex(0)?, last)
    }

    /// How many vertices the path has.
    pub fn vertices(&self) -> usize {
        self.light.1 + self.eye.1
    }

    /// Does the path scatter each wavelength elsewhere?
    pub fn disperses(&self) -> bool {
        disperses(self.light.0, self.light.1.min(self.light.0.len())) || disperses(self.eye.0, self.eye.1)
    }
}

impl<'w> BidirectionalTracer<'w> {
    /// Calls `visit` with all paths of a sample. Returns whether any vertex of its walks disperses.
    pub(crate) fn visit<S: Samples>(
        &self,
        space: &SceneSpace<'w>,
        start: &CameraStart,
        samples: &mut S,
        mut visit: impl FnMut(Found<'_, 'w>),
    ) -> bool {
        let settings = self.settings;
        // A path of n vertices scatters n − 2 times.
        let vertices = (settings.max_depth as usize).saturating_add(2);
        let mut scratch = Scratch::default();
        let mut light = Subpath::new(Side::Light);
        let mut eye = Subpath::new(Side::Eye);
        let none = Subpath::new(Side::Light);
        if settings.uses_light_walks() {
            walk_from_light(space, &mut light, vertices - 1, samples);
        }
        let eye_vertices = if settings.uses_eye_walks() { vertices } else { 1 };
        walk_from_eye(space, &mut eye, start, eye_vertices, samples, |walk, samples| {
            let t = walk.len();
            if settings.uses(0, t)
                && let Some(found) = connect(space, (&none, 0), (walk, t), settings.heuristic, samples, &mut scratch)
            {
                let value = found.value * settings.weight(found.weight);
                visit(Found { light: (&none, 0), eye: (walk, t), x0: found.light.as_ref(), value });
            }
        });
        for t in 1..=eye.len() {
            for s in 0..=(vertices - t).min(light.len().max(1)) {
                if !settings.uses(s, t) || (t == 1 && s == 0) {
                    continue;
                }
                samples.set_dimension(step_dimension(t) + DIRECT_DIMENSION);
                let found = connect(space, (&light, s), (&eye, t), settings.heuristic, samples, &mut scratch);
                if let Some(found) = found {
                    let value = found.value * settings.weight(found.weight);
                    visit(Found { light: (&light, s), eye: (&eye, t), x0: found.light.as_ref(), value });
                }
            }
        }
        disperses(&light, light.len()) || disperses(&eye, eye.len())
    }
}

impl PixelEstimator for BidirectionalTracer<'_> {
    fn sample(
        &self,
        start: &CameraStart,
        wavelengths: &mut Wavelengths,
        samples: &mut impl Samples,
        splats: &mut Splats<'_>,
        cost: &mut PathCost,
    ) -> SampledSpectrum {
        let space = SceneSpace::new(self.world, self.camera, self.window, *wavelengths, start.time_u);
        let mut radiance = SampledSpectrum::ZERO;
        let mut arrived: Vec<(Vec2, SampledSpectrum)> = Vec::new();
        let disperses = self.visit(&space, start, samples, |found| {
            if found.eye.1 > 1 {
                radiance += found.value;
            } else if let Some(film) = found.arrival(&space) {
                arrived.push((film, found.value));
            }
        });
        if disperses {
            wavelengths.terminate_secondary();
        }
        for (film, value) in arrived {
            space.all_films(film).for_each(|film| splats.add(film, value, wavelengths));
        }
        let (rays, shadow_rays) = space.rays();
        cost.rays += rays;
        cost.shadow_rays += shadow_rays;
        // What a walk through a place on the film finds is the radiance there: the choice of the place does not count.
        radiance * space.film_density()
    }
}
