//! Bidirectional path tracing (Veach 1997, chapter 10), and light tracing as its column of one eye vertex.
//!
//! A sample is a walk from the light and one from the eye. All their prefixes are connected; technique `(s, t)` of `s` light
//! vertices and `t` eye vertices is weighted by the densities of all techniques that could have made the same path. With `s = 0`
//! the eye's walk comes upon the light, with `s = 1` a point on a light is drawn as seen from the eye's last vertex, and with `t = 1`
//! the light arrives at whatever pixel it may, as a splat.

use super::estimator::{CameraStart, PixelEstimator, Splats};
use super::kind::{BidirectionalIntegrator, BidirectionalTechniques};
use super::path::PathCost;
use super::walks::{Bounds, Found, Interleaved, WalkSamples, Walks, disperses, walk_from_light};
use crate::camera::Camera;
use crate::film::FilmWindow;
use crate::transport::SceneSpace;
use crate::world::World;
use glam::Vec2;
use luz_color::{SampledSpectrum, Wavelengths};
use luz_sample::Samples;

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

impl<'w> BidirectionalTracer<'w> {
    /// Calls `visit` with all paths of a sample. Returns whether any vertex of its walks disperses.
    pub(crate) fn visit(
        &self,
        space: &SceneSpace<'w>,
        start: &CameraStart,
        walks: &mut Walks<'w>,
        samples: &mut impl WalkSamples,
        mut visit: impl FnMut(Found<'_, 'w>),
    ) -> bool {
        let settings = self.settings;
        // A path of n vertices scatters n − 2 times.
        let vertices = (settings.max_depth as usize).saturating_add(2);
        let shortest_end = match settings.techniques {
            BidirectionalTechniques::All => 2,
            BidirectionalTechniques::One { s: 0, t } => t as usize,
            BidirectionalTechniques::One { .. } | BidirectionalTechniques::Light => usize::MAX,
        };
        let bounds = |vertices| Bounds { vertices, has_roulette: true, shortest_end };
        let mut weighted = |found: Found<'_, 'w>, weight: f32| {
            visit(Found { value: found.value * settings.weight(weight), ..found });
        };
        let light_vertices = if settings.uses_light_walks() { vertices - 1 } else { 0 };
        walk_from_light(space, &mut walks.light, &bounds(light_vertices), samples);
        let eye_vertices = if settings.uses_eye_walks() { vertices } else { 1 };
        walks.walk_from_eye(space, start, &bounds(eye_vertices), settings.heuristic, samples, |found, weight| {
            if settings.uses(0, found.eye.1) {
                weighted(found, weight);
            }
        });
        for t in 1..=walks.eye.len() {
            for s in 0..=(vertices - t).min(walks.light.len().max(1)) {
                if settings.uses(s, t) && (s, t) != (0, 1) {
                    walks.connect(space, (s, t), settings.heuristic, samples, &mut weighted);
                }
            }
        }
        disperses(&walks.light, walks.light.len()) || disperses(&walks.eye, walks.eye.len())
    }
}

/// What a [`BidirectionalTracer`] keeps from sample to sample.
#[derive(Debug, Default)]
pub struct BidirectionalMemory<'w> {
    walks: Walks<'w>,
    /// What has arrived where on the film.
    arrived: Vec<(Vec2, SampledSpectrum)>,
}

impl<'w> PixelEstimator for BidirectionalTracer<'w> {
    type Memory = BidirectionalMemory<'w>;

    fn sample(
        &self,
        start: &CameraStart,
        wavelengths: &mut Wavelengths,
        samples: &mut impl Samples,
        splats: &mut Splats<'_>,
        BidirectionalMemory { walks, arrived }: &mut BidirectionalMemory<'w>,
        cost: &mut PathCost,
    ) -> SampledSpectrum {
        let space = SceneSpace::new(self.world, self.camera, self.window, *wavelengths, start.time_u);
        let mut radiance = SampledSpectrum::ZERO;
        arrived.clear();
        let disperses = self.visit(&space, start, walks, &mut Interleaved(samples), |found| {
            if found.eye.1 > 1 {
                radiance += found.value;
            } else if let Some(film) = found.arrival(&space) {
                arrived.push((film, found.value));
            }
        });
        if disperses {
            wavelengths.terminate_secondary();
        }
        for (film, value) in arrived.drain(..) {
            space.all_films(film).for_each(|film| splats.add(film, value, wavelengths));
        }
        let (rays, shadow_rays) = space.rays();
        cost.rays += rays;
        cost.shadow_rays += shadow_rays;
        // What a walk through a place on the film finds is the radiance there: the choice of the place does not count.
        radiance * space.film_density()
    }
}
