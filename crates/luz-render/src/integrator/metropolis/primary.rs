//! What chains in primary sample space are made of: points of the unit cube, and what an estimator makes of them.

use super::{Importance, scalar_contribution};
use crate::camera::Camera;
use crate::film::FilmWindow;
use crate::integrator::{
    BidirectionalIntegrator, BidirectionalTechniques, BidirectionalTracer, CameraStart, PathCost, PathEvent,
    PathIntegrator, PathObserver, PathTracer, Technique, Unwatched,
};
use crate::light::Combination;
use crate::render::RenderCost;
use crate::settings::Settings;
use crate::transport::SceneSpace;
use crate::world::World;
use glam::Vec2;
use luz_color::{SampledSpectrum, Wavelengths};
use luz_sample::Samples;
use luz_sample::markov::PrimarySample;
use luz_sample::mis::Heuristic;
use luz_sample::roulette::Roulette;
use serde::{Deserialize, Serialize};

/// A point of primary sample space, and what the estimator made of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PrimaryState {
    pub(super) sample: PrimarySample,
    pub(super) contributions: Vec<Contribution>,
}

/// A contribution to the film.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Contribution {
    film: [f32; 2],
    /// Over the density of all that was drawn, the film position included, in the film's RGB.
    rgb: [f32; 3],
}

impl Contribution {
    /// Where on the film.
    pub fn film(&self) -> Vec2 {
        Vec2::from_array(self.film)
    }

    /// Makes it so many times as bright.
    pub fn scale(&mut self, factor: f32) {
        self.rgb = self.rgb.map(|v| v * factor);
    }

    /// The colour over a density.
    pub fn color(&self, density: f64) -> [f32; 3] {
        self.rgb.map(|v| (f64::from(v) / density) as f32)
    }

    /// Its share of the target density.
    pub fn density(&self, importance: &Importance) -> f64 {
        scalar_contribution(self.rgb) / importance.at(self.film())
    }
}

impl PrimaryState {
    /// The target density: the sum over the contributions.
    pub fn density(&self, importance: &Importance) -> f64 {
        self.contributions.iter().map(|contribution| contribution.density(importance)).sum()
    }
}

/// Estimators that draw their numbers from a point of primary sample space.
pub(super) struct Estimators<'a> {
    world: &'a World,
    camera: &'a Camera,
    settings: &'a Settings,
    window: FilmWindow,
    path: PathIntegrator,
    /// Paths that have scattered less often are left out.
    min_depth: u32,
}

/// Wavelengths and what else is drawn first, in the order of the path tracer's dimensions.
fn begin(window: FilmWindow, samples: &mut impl Samples) -> (Wavelengths, CameraStart) {
    let wavelengths = Wavelengths::sample_visible(samples.next_1d());
    let film = window.at(samples.next_2d());
    (wavelengths, CameraStart { film, lens_u: samples.next_2d(), time_u: samples.next_1d() })
}

impl<'a> Estimators<'a> {
    /// Of the paths of a world that scatter at least and at most so often.
    pub fn new(world: &'a World, camera: &'a Camera, settings: &'a Settings, depths: [u32; 2]) -> Self {
        let path = PathIntegrator {
            max_depth: depths[1],
            heuristic: Heuristic::Power(2.0),
            technique: Technique::Both,
            roulette: Roulette::default(),
            regularize: false,
        };
        Self { world, camera, settings, window: settings.film_window(), path, min_depth: depths[0] }
    }

    /// One sample of a path tracer.
    pub fn path(&self, samples: &mut impl Samples, found: &mut Vec<Contribution>, cost: &mut RenderCost) {
        let (mut wavelengths, start) = begin(self.window, samples);
        let CameraStart { film, lens_u, time_u } = start;
        let ray = self.camera.ray(film, lens_u, time_u);
        let differentials = self.world.has_varying_textures().then(|| self.camera.differentials(film, lens_u, time_u));
        let tracer = PathTracer {
            settings: &self.path,
            world: self.world,
            camera: self.camera,
            combination: Combination::WithBsdf,
        };
        let mut path_cost = PathCost::default();
        let (differentials, rays) = (differentials.as_ref(), &mut path_cost);
        let radiance = if self.min_depth == 0 {
            tracer.radiance(ray, differentials, &mut wavelengths, samples, &mut Unwatched, None, rays)
        } else {
            let mut deep = Deep { min_depth: self.min_depth, radiance: SampledSpectrum::ZERO };
            let all = tracer.radiance(ray, differentials, &mut wavelengths, samples, &mut deep, None, rays);
            if all.is_finite() { deep.radiance } else { all }
        };
        cost.paths += 1;
        cost.rays += u64::from(path_cost.rays);
        cost.shadow_rays += u64::from(path_cost.shadow_rays);
        found.clear();
        self.add(film, radiance * self.window.area(), &wavelengths, found);
    }

    /// One sample of a bidirectional path tracer, with all its techniques.
    pub fn bidirectional(&self, samples: &mut impl Samples, found: &mut Vec<Contribution>, cost: &mut RenderCost) {
        self.both_sides(None, samples, found, cost);
    }

    /// One path by technique `(s, t)`, weighted among all that can make it.
    pub fn technique(
        &self,
        technique: (usize, usize),
        samples: &mut impl Samples,
        found: &mut Vec<Contribution>,
        cost: &mut RenderCost,
    ) {
        self.both_sides(Some(technique), samples, found, cost);
    }

    fn both_sides(
        &self,
        technique: Option<(usize, usize)>,
        samples: &mut impl Samples,
        found: &mut Vec<Contribution>,
        cost: &mut RenderCost,
    ) {
        let (mut wavelengths, start) = begin(self.window, samples);
        let space = SceneSpace::new(self.world, self.camera, self.window, wavelengths, start.time_u);
        let settings = BidirectionalIntegrator {
            max_depth: self.path.max_depth,
            techniques: BidirectionalTechniques::All,
            heuristic: Heuristic::default(),
        };
        let tracer = BidirectionalTracer { settings, world: self.world, camera: self.camera, window: self.window };
        let mut seen = SampledSpectrum::ZERO;
        let mut arrived: Vec<(Vec2, SampledSpectrum)> = Vec::new();
        let fewest = self.min_depth as usize + 2;
        let visit = |path: crate::integrator::bidirectional::Found<'_, '_>| {
            if path.vertices() < fewest {
            } else if path.eye.1 > 1 {
                seen += path.value;
            } else if let Some(film) = path.arrival(&space) {
                arrived.push((film, path.value));
            }
        };
        let disperses = match technique {
            Some(technique) => tracer.visit_one(&space, &start, technique, samples, visit),
            None => tracer.visit(&space, &start, samples, visit),
        };
        if disperses {
            wavelengths.terminate_secondary();
        }
        let (rays, shadow_rays) = space.rays();
        cost.paths += 1;
        cost.rays += u64::from(rays);
        cost.shadow_rays += u64::from(shadow_rays);
        found.clear();
        self.add(start.film, seen, &wavelengths, found);
        for (film, value) in arrived {
            if self.window.contains(film) {
                self.add(film, value, &wavelengths, found);
            }
        }
    }

    fn add(&self, film: Vec2, value: SampledSpectrum, wavelengths: &Wavelengths, found: &mut Vec<Contribution>) {
        if !value.is_black() {
            found.push(Contribution {
                film: film.to_array(),
                rgb: self.settings.sensor.to_output_rgb(value, wavelengths),
            });
        }
    }
}

/// Light of paths that have scattered often enough.
struct Deep {
    min_depth: u32,
    radiance: SampledSpectrum,
}

impl PathObserver for Deep {
    #[inline]
    fn wants_vertex(&self) -> bool {
        false
    }

    #[inline]
    fn observe(&mut self, event: PathEvent<'_>, _: &Wavelengths) {
        if let PathEvent::Light(light) = event
            && light.depth >= self.min_depth
        {
            self.radiance += light.alone * light.weight;
        }
    }
}
