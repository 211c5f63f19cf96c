//! The walks from both ends of a path that bidirectional path tracing, and Metropolis light transport in primary sample space, are made
//! of: how they go, where their numbers come from, and what they find.

use super::estimator::CameraStart;
use super::path::CAMERA_DIMENSIONS;
use crate::film::FilmWindow;
use crate::transport::connection::{Scratch, connect};
use crate::transport::{Bounce, PathSpace, SceneSpace, SceneVertex, Side, Subpath};
use glam::Vec2;
use luz_color::{SampledSpectrum, Sensor};
use luz_sample::Samples;
use luz_sample::markov::PrimarySamples;
use luz_sample::mis::Heuristic;

/// Walks of fewer vertices go on without roulette.
const ROULETTE_VERTICES: usize = 5;

/// What numbers are drawn for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// The vertex after so many of a walk: up to three numbers.
    Step(Side, usize),
    /// Roulette before it: one.
    Roulette(Side, usize),
    /// A point on a light as seen from the last of so many vertices of the eye's walk: two.
    Direct(usize),
}

/// Numbers for a pair of walks, each of which keeps its place whatever else is drawn.
pub(crate) trait WalkSamples: Samples {
    /// Goes to the numbers for a purpose.
    fn go_to(&mut self, purpose: Purpose);
}

/// Numbers of one sequence: steps of both walks in turn, so that the first dimensions, the best ones, are those of the first steps.
pub(crate) struct Interleaved<'a, S>(pub &'a mut S);

/// Dimensions of one step of both walks: the eye's (4), the light's (4), a point on a light (2).
const STEP_DIMENSIONS: u32 = 10;
/// The place of the light's walk among them.
const LIGHT_DIMENSION: u32 = 4;
/// The place of the point on a light.
const DIRECT_DIMENSION: u32 = 8;
/// The place of roulette among the dimensions of a step of one walk.
const ROULETTE_DIMENSION: u32 = 3;

impl<S: Samples> Samples for Interleaved<'_, S> {
    #[inline]
    fn next_1d(&mut self) -> f32 {
        self.0.next_1d()
    }

    #[inline]
    fn next_2d(&mut self) -> Vec2 {
        self.0.next_2d()
    }

    fn set_dimension(&mut self, dimension: u32) {
        self.0.set_dimension(dimension);
    }
}

impl<S: Samples> WalkSamples for Interleaved<'_, S> {
    fn go_to(&mut self, purpose: Purpose) {
        let place = |side| match side {
            Side::Eye => 0,
            Side::Light => LIGHT_DIMENSION,
        };
        let (step, place) = match purpose {
            Purpose::Step(side, step) => (step, place(side)),
            Purpose::Roulette(side, step) => (step, place(side) + ROULETTE_DIMENSION),
            Purpose::Direct(step) => (step, DIRECT_DIMENSION),
        };
        let step = CAMERA_DIMENSIONS.wrapping_add(STEP_DIMENSIONS.wrapping_mul(step as u32));
        self.0.set_dimension(step.wrapping_add(place));
    }
}

/// The streams of a point of primary sample space that walks take their numbers from. Stream 0 is left to what both walks share.
const EYE_STREAM: usize = 1;
const LIGHT_STREAM: usize = 2;
const DIRECT_STREAM: usize = 3;
const ROULETTE_STREAM: usize = 4;

impl WalkSamples for PrimarySamples<'_> {
    fn go_to(&mut self, purpose: Purpose) {
        let stream = |side| match side {
            Side::Eye => EYE_STREAM,
            Side::Light => LIGHT_STREAM,
        };
        let (stream, dimension) = match purpose {
            Purpose::Step(side, step) => (stream(side), 3 * step),
            Purpose::Roulette(side, step) => (ROULETTE_STREAM, 2 * step + usize::from(side == Side::Light)),
            Purpose::Direct(step) => (DIRECT_STREAM, 2 * step),
        };
        self.set_stream(stream);
        self.set_dimension(dimension as u32);
    }
}

/// Where walks begin on the side of the eye, by numbers of primary sample space. `has_film`: they go through a place on the film.
pub(crate) fn camera_start(window: FilmWindow, has_film: bool, samples: &mut PrimarySamples<'_>) -> CameraStart {
    let time_u = samples.next_1d();
    samples.go_to(Purpose::Step(Side::Eye, 0));
    let lens_u = samples.next_2d();
    let mut film = Vec2::ZERO;
    if has_film {
        samples.go_to(Purpose::Step(Side::Eye, 1));
        film = window.at(samples.next_2d());
    }
    CameraStart { film, lens_u, time_u }
}

/// How a walk goes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    /// The most vertices.
    pub vertices: usize,
    /// Can it end before, by roulette?
    pub has_roulette: bool,
    /// How many vertices walks from the eye must have to end in something that does nothing but emit; shorter ones take no notice of it.
    pub shortest_end: usize,
}

/// Plays roulette where it is time. False if the walk is over.
fn survives(walk: &mut Subpath<SceneVertex<'_>>, bounds: &Bounds, samples: &mut impl WalkSamples) -> bool {
    if !bounds.has_roulette || walk.len() < ROULETTE_VERTICES {
        return true;
    }
    samples.go_to(Purpose::Roulette(walk.side(), walk.len()));
    walk.survives(samples.next_1d())
}

/// Walks from the light.
pub(crate) fn walk_from_light<'w>(
    space: &SceneSpace<'w>,
    walk: &mut Subpath<SceneVertex<'w>>,
    bounds: &Bounds,
    samples: &mut impl WalkSamples,
) {
    walk.clear();
    samples.go_to(Purpose::Step(Side::Light, 0));
    if bounds.vertices == 0 || !walk.begin(space, samples) {
        return;
    }
    while walk.len() < bounds.vertices {
        if !survives(walk, bounds, samples) {
            return;
        }
        samples.go_to(Purpose::Step(Side::Light, walk.len()));
        let Some((previous, at)) = walk.end() else { return };
        let Some(next) = space.extend(Side::Light, previous, at, false, samples) else { return };
        if !walk.push(space, next.vertex, next.bounce) {
            return;
        }
    }
}

/// Walks from the eye through a place on the film. `found` is called with every walk that has ended in something that does
/// nothing but emit: it is not part of the walk, which goes on behind it.
pub(crate) fn walk_from_eye<'w, S: WalkSamples>(
    space: &SceneSpace<'w>,
    walk: &mut Subpath<SceneVertex<'w>>,
    start: &CameraStart,
    bounds: &Bounds,
    samples: &mut S,
    mut found: impl FnMut(&Subpath<SceneVertex<'w>>, &mut S),
) {
    walk.restart(space.lens(start.lens_u), 1.0);
    while walk.len() < bounds.vertices {
        if !survives(walk, bounds, samples) {
            return;
        }
        samples.go_to(Purpose::Step(Side::Eye, walk.len()));
        let as_end = walk.len() + 1 >= bounds.shortest_end;
        let Some((previous, at)) = walk.end() else { return };
        let (mut next, bounce) = if previous.is_none() {
            (space.seen_through(at, start.film, as_end), Bounce::Spread)
        } else {
            match space.extend(Side::Eye, previous, at, as_end, samples) {
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
pub(crate) fn disperses(walk: &Subpath<SceneVertex<'_>>, vertices: usize) -> bool {
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
    /// Where on the film the path ends, if that is not where its walk from the eye has set out to.
    pub fn arrival(&self, space: &SceneSpace<'w>) -> Option<Vec2> {
        let (light, s) = self.light;
        let last = self.x0.or_else(|| light.vertex(s.checked_sub(1)?))?;
        space.film(self.eye.0.vertex(0)?, last)
    }

    /// Where on the film the path ends, its walk from the eye having begun at `start`.
    pub fn film(&self, space: &SceneSpace<'w>, start: &CameraStart) -> Option<Vec2> {
        if self.eye.1 > 1 { Some(start.film) } else { self.arrival(space) }
    }

    /// Its colour, in the film's RGB.
    pub fn rgb(&self, space: &SceneSpace<'w>, sensor: &Sensor) -> [f32; 3] {
        let mut wavelengths = *space.wavelengths();
        if self.disperses() {
            wavelengths.terminate_secondary();
        }
        sensor.to_output_rgb(self.value, &wavelengths)
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

/// A pair of walks, and the memory that they are connected in; to be used again from sample to sample.
#[derive(Clone, Debug)]
pub(crate) struct Walks<'w> {
    pub light: Subpath<SceneVertex<'w>>,
    pub eye: Subpath<SceneVertex<'w>>,
    /// A walk of no vertices.
    none: Subpath<SceneVertex<'w>>,
    scratch: Scratch,
}

impl Default for Walks<'_> {
    fn default() -> Self {
        Self {
            light: Subpath::new(Side::Light),
            eye: Subpath::new(Side::Eye),
            none: Subpath::new(Side::Light),
            scratch: Scratch::default(),
        }
    }
}

impl<'w> Walks<'w> {
    /// Walks from the eye, and calls `found` with those that have ended in something that does nothing but emit: technique `(0, t)`.
    pub fn walk_from_eye<S: WalkSamples>(
        &mut self,
        space: &SceneSpace<'w>,
        start: &CameraStart,
        bounds: &Bounds,
        heuristic: Heuristic,
        samples: &mut S,
        mut found: impl FnMut(Found<'_, 'w>, f32),
    ) {
        let Self { eye, none, scratch, .. } = self;
        walk_from_eye(space, eye, start, bounds, samples, |walk, samples| {
            let t = walk.len();
            if let Some(path) = connect(space, (none, 0), (walk, t), heuristic, samples, scratch) {
                let all = Found { light: (none, 0), eye: (walk, t), x0: path.light.as_ref(), value: path.value };
                found(all, path.weight);
            }
        });
    }

    /// Connects the first `s` vertices of the walk from the light with the first `t` of that from the eye; calls `found` with the
    /// path, if there is one, and its weight.
    pub fn connect(
        &mut self,
        space: &SceneSpace<'w>,
        (s, t): (usize, usize),
        heuristic: Heuristic,
        samples: &mut impl WalkSamples,
        found: impl FnOnce(Found<'_, 'w>, f32),
    ) {
        let Self { light, eye, scratch, .. } = self;
        samples.go_to(Purpose::Direct(t));
        if let Some(path) = connect(space, (light, s), (eye, t), heuristic, samples, scratch) {
            found(Found { light: (light, s), eye: (eye, t), x0: path.light.as_ref(), value: path.value }, path.weight);
        }
    }

    /// Makes paths by the one technique `(s, t)`, `t ≥ 1`, without roulette: walks of exactly that many vertices, and the one connection.
    /// Calls `found` with what it has found and its weight: at most one path, unless `s = 0`, where one walk may come upon several
    /// lights that let it pass.
    pub fn one_technique(
        &mut self,
        space: &SceneSpace<'w>,
        start: &CameraStart,
        (s, t): (usize, usize),
        heuristic: Heuristic,
        samples: &mut impl WalkSamples,
        mut found: impl FnMut(Found<'_, 'w>, f32),
    ) {
        // Next-event estimation draws its own end, unless there is nothing to draw it from.
        let needs_light = s > 1 || (s, t) == (1, 1);
        if needs_light {
            let bounds = Bounds { vertices: s, has_roulette: false, shortest_end: usize::MAX };
            walk_from_light(space, &mut self.light, &bounds, samples);
            if self.light.len() < s {
                return;
            }
        }
        let shortest_end = if s == 0 { t } else { usize::MAX };
        let bounds = Bounds { vertices: t, has_roulette: false, shortest_end };
        self.walk_from_eye(space, start, &bounds, heuristic, samples, &mut found);
        if self.eye.len() == t && (s, t) != (0, 1) {
            self.connect(space, (s, t), heuristic, samples, found);
        }
    }
}
