//! One sample of one pixel.

use super::optimal::{DirectAttempts, OptimalDirect, technique_index};
use super::pixels::RowResult;
use super::splatting::{Spread, limited};
use crate::camera::{Camera, RayDifferentials};
use crate::film::{Features, FilmContents, FilmRow, FilterSample, LayerSample, SplatSums, TechniqueShares};
use crate::integrator::efficiency::{EfficiencyGuide, Ledger, PixelRecord};
use crate::integrator::{
    FoundBy, PathCost, PathEvent, PathIntegrator, PathObserver, PathTracer, Technique, Unwatched, Vertex,
};
use crate::light::Combination;
use crate::settings::Settings;
use crate::world::World;
use glam::Vec2;
use luz_color::{SampledSpectrum, Wavelengths};
use luz_geometry::Ray;
use luz_sample::{PixelSamples, Sampler, Samples};

/// Where a sample begins.
struct Start<'a> {
    samples: PixelSamples<'a>,
    wavelengths: Wavelengths,
    filtered: FilterSample,
    ray: Ray,
    differentials: Option<RayDifferentials>,
}

/// Which sample of which pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// In the frame.
    pub pixel: [u32; 2],
    /// Which half of the pixel.
    pub half: usize,
    /// The number of the sample.
    pub sample: u32,
    /// The pixel's column in the film.
    pub column: usize,
}

/// What one thread works on: a row of the film, with what its pixels have learned.
pub(super) struct Row<'a> {
    pub film: FilmRow<'a>,
    /// Of the whole film.
    pub splats: Option<&'a SplatSums>,
    pub optimal: &'a mut [OptimalDirect],
    pub records: &'a mut [PixelRecord],
    pub guide: Option<&'a EfficiencyGuide>,
    /// Memory for splats.
    pub spread: Spread,
    pub result: RowResult,
}

/// Who draws samples of pixels.
pub(super) trait PixelSampler: Sync {
    /// Adds a sample to its pixel in the row. Returns whether it is finite.
    fn sample(&self, place: Place, row: &mut Row<'_>) -> bool;
}

/// Draws samples of pixels by path tracing.
pub(super) struct PathSampler<'a> {
    tracer: PathTracer<'a>,
    settings: &'a Settings,
    samplers: &'a [Sampler],
    contents: FilmContents,
}

impl<'a> PathSampler<'a> {
    pub fn new(
        path: &'a PathIntegrator,
        world: &'a World,
        camera: &'a Camera,
        settings: &'a Settings,
        samplers: &'a [Sampler],
    ) -> Self {
        // Pictures of light sampling alone need lights drawn as if they were alone.
        let is_combined = path.technique == Technique::Both && !settings.technique_images;
        let combination = if is_combined { Combination::WithBsdf } else { Combination::Alone };
        let tracer = PathTracer { settings: path, world, camera, combination };
        Self { tracer, settings, samplers, contents: settings.film_contents() }
    }

    /// Where a sample begins.
    fn start(&self, pixel: [u32; 2], half: usize, index: u32) -> Start<'a> {
        let mut samples = self.samplers[half].samples(pixel, index);
        let wavelengths = Wavelengths::sample_visible(samples.next_1d());
        let filtered = self.settings.filter.sample(samples.next_2d());
        let film = Vec2::new(pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5) + filtered.offset;
        let lens_u = samples.next_2d();
        let time_u = samples.next_1d();
        let PathTracer { world, camera, .. } = self.tracer;
        let ray = camera.ray(film, lens_u, time_u);
        let differentials = world.has_varying_textures().then(|| camera.differentials(film, lens_u, time_u));
        Start { samples, wavelengths, filtered, ray, differentials }
    }

    /// Traces a sample without adding it to a film. Returns its colour, before any limit of its components.
    pub fn trace(&self, pixel: [u32; 2], half: usize, index: u32, observer: &mut impl PathObserver) -> [f32; 3] {
        let Start { mut samples, mut wavelengths, ray, differentials, .. } = self.start(pixel, half, index);
        let differentials = differentials.as_ref();
        let cost = &mut PathCost::default();
        let radiance = self.tracer.radiance(ray, differentials, &mut wavelengths, &mut samples, observer, None, cost);
        self.settings.sensor.to_output_rgb(radiance, &wavelengths)
    }
}

impl PixelSampler for PathSampler<'_> {
    fn sample(&self, place: Place, row: &mut Row<'_>) -> bool {
        let Place { pixel, half, sample: index, column } = place;
        let Row { film, optimal, records, guide, result, .. } = row;
        let optimal = optimal.get_mut(column * self.samplers.len() + half);
        let ledger = guide.zip(records.get_mut(column)).map(|(g, record)| Ledger::new(g, record, &mut result.findings));
        let cost = &mut result.cost;
        let settings = self.settings;
        let Start { mut samples, mut wavelengths, filtered, ray, differentials } = self.start(pixel, half, index);
        let differentials = differentials.as_ref();

        let mut path_cost = PathCost::default();
        let mut direct = [0.0; 3];
        let radiance = if self.contents.layers.is_empty() && optimal.is_none() {
            let observer = &mut Unwatched;
            self.tracer.radiance(ray, differentials, &mut wavelengths, &mut samples, observer, ledger, &mut path_cost)
        } else {
            let mut observer = SampleObserver::new(settings, self.contents, optimal.is_some());
            let observed = &mut observer;
            let radiance = self.tracer.radiance(
                ray,
                differentials,
                &mut wavelengths,
                &mut samples,
                observed,
                ledger,
                &mut path_cost,
            );
            if !self.contents.layers.is_empty() {
                film.add_layers(column, &observer.layers(&wavelengths), filtered.sign);
            }
            if let (Some(attempts), Some(optimal)) = (observer.attempts, optimal) {
                direct = attempts.end_round(optimal, |f| settings.sensor.to_output_rgb(f, &wavelengths));
            }
            radiance
        };
        cost.paths += 1;
        cost.rays += u64::from(path_cost.rays);
        cost.shadow_rays += u64::from(path_cost.shadow_rays);

        let mut rgb = settings.sensor.to_output_rgb(radiance, &wavelengths);
        rgb.iter_mut().zip(direct).for_each(|(sum, direct)| *sum += direct);
        let rgb = limited(rgb, settings.max_component);
        film.add(column, half, rgb, filtered.sign)
    }
}

/// Takes down what a film and its pixels want to know of a path.
struct SampleObserver<'a> {
    settings: &'a Settings,
    contents: FilmContents,
    features: Option<Features>,
    /// Spectra of the techniques' shares, weighted and alone.
    shares: [[SampledSpectrum; 2]; 2],
    attempts: Option<DirectAttempts>,
}

impl<'a> SampleObserver<'a> {
    fn new(settings: &'a Settings, contents: FilmContents, takes_direct: bool) -> Self {
        let attempts = takes_direct.then(DirectAttempts::default);
        Self { settings, contents, features: None, shares: [[SampledSpectrum::ZERO; 2]; 2], attempts }
    }

    fn layers(&self, wavelengths: &Wavelengths) -> LayerSample {
        let rgb = |shares: [SampledSpectrum; 2]| shares.map(|s| self.settings.sensor.to_output_rgb(s, wavelengths));
        let [weighted, alone] = self.shares.map(rgb);
        LayerSample { features: self.features.unwrap_or_default(), techniques: TechniqueShares { weighted, alone } }
    }

    fn see(&self, vertex: &Vertex<'_>, wavelengths: &Wavelengths) -> Features {
        let Vertex { ray, surface, shading, outgoing, .. } = *vertex;
        // A reflectance is shown as the colour that it gives white light.
        let albedo = shading.bsdf.albedo(shading.frame.to_local(outgoing));
        let white = self.settings.white.sample(wavelengths);
        Features {
            albedo: self.settings.sensor.to_output_rgb(albedo * white, wavelengths),
            normal: surface.geometric_normal.to_array(),
            shading_normal: shading.frame.n.to_array(),
            position: surface.position.to_array(),
            depth: surface.position.distance(ray.origin),
        }
    }
}

impl PathObserver for SampleObserver<'_> {
    #[inline]
    fn wants_vertex(&self) -> bool {
        self.contents.layers.features && self.features.is_none()
    }

    #[inline]
    fn observe(&mut self, event: PathEvent<'_>, wavelengths: &Wavelengths) {
        match event {
            PathEvent::Vertex(vertex) => {
                if self.wants_vertex() {
                    self.features = Some(self.see(&vertex, wavelengths));
                }
                if let Some(attempts) = &mut self.attempts
                    && vertex.depth == 0
                {
                    attempts.meet(&vertex);
                }
            }
            PathEvent::Light(light) if self.contents.layers.techniques => {
                let technique = technique_index(light.found_by);
                self.shares[0][technique] += light.alone * light.weight;
                self.shares[1][technique] += light.alone;
            }
            _ => {}
        }
    }

    #[inline]
    fn take_direct(&mut self, found_by: FoundBy, f: SampledSpectrum, light_pdf: f32, bsdf_pdf: f32) -> bool {
        let Some(attempts) = &mut self.attempts else { return false };
        attempts.add(found_by, f, light_pdf, bsdf_pdf);
        true
    }
}
