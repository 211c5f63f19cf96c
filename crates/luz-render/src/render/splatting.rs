//! Samples of pixels whose light may arrive at others, too.

use super::sample::{PixelSampler, Place, Row};
use crate::film::{Footprint, SplatSums};
use crate::integrator::{CameraStart, PathCost, PixelEstimator, Splat, Splats};
use crate::settings::Settings;
use glam::Vec2;
use luz_color::{SampledSpectrum, Wavelengths};
use luz_sample::{PixelSamples, Sampler, Samples};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Draws samples of pixels by an estimator that splats.
pub(super) struct SplattingSampler<'a> {
    pub estimator: &'a dyn SplattingEstimator,
    pub settings: &'a Settings,
    pub samplers: &'a [Sampler],
    pub footprint: &'a Footprint,
}

/// A [`PixelEstimator`] whose type is known only when the program runs, with memory for those who sample at the same time.
pub(super) trait SplattingEstimator: Send + Sync {
    /// [`PixelEstimator::sample`].
    fn sample(
        &self,
        start: &CameraStart,
        wavelengths: &mut Wavelengths,
        samples: &mut PixelSamples<'_>,
        splats: &mut Splats<'_>,
        cost: &mut PathCost,
    ) -> SampledSpectrum;
}

/// An estimator, and the memory that no thread is using now.
pub(super) struct WithMemory<E: PixelEstimator> {
    estimator: E,
    unused: Mutex<Vec<Box<E::Memory>>>,
}

impl<E: PixelEstimator> WithMemory<E> {
    pub fn new(estimator: E) -> Self {
        Self { estimator, unused: Mutex::default() }
    }

    fn unused(&self) -> MutexGuard<'_, Vec<Box<E::Memory>>> {
        // What a thread has left that panicked is a list, whole as ever.
        self.unused.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<E: PixelEstimator + Send> SplattingEstimator for WithMemory<E> {
    fn sample(
        &self,
        start: &CameraStart,
        wavelengths: &mut Wavelengths,
        samples: &mut PixelSamples<'_>,
        splats: &mut Splats<'_>,
        cost: &mut PathCost,
    ) -> SampledSpectrum {
        let mut memory = self.unused().pop().unwrap_or_default();
        let radiance = self.estimator.sample(start, wavelengths, samples, splats, &mut memory, cost);
        self.unused().push(memory);
        radiance
    }
}

/// What a sample gives to pixels.
#[derive(Default)]
pub(super) struct Spread {
    splats: Vec<Splat>,
    /// Pixels and what they receive, of each splat.
    received: Vec<(usize, [f64; 3])>,
}

impl Spread {
    /// Adds what the splats give to each pixel, all that one pixel gets at once: they are of one sample, and its square is that of
    /// their sum. Leaves the list of splats empty. Returns whether all could be held.
    fn add_to(&mut self, sums: &SplatSums, footprint: &Footprint) -> bool {
        let mut all_held = true;
        for Splat { film, rgb } in self.splats.drain(..) {
            let rgb = rgb.map(f64::from);
            if !film.is_finite() || !SplatSums::can_hold(rgb) {
                sums.drop_one();
                all_held = false;
                continue;
            }
            footprint.spread(film, |pixel, weight| self.received.push((pixel, rgb.map(|v| v * weight))));
        }
        // Stable, so that sums within a pixel run in the order of the splats.
        self.received.sort_by_key(|(pixel, _)| *pixel);
        let mut received = self.received.drain(..).peekable();
        while let Some((pixel, mut rgb)) = received.next() {
            while let Some((_, more)) = received.next_if(|(next, _)| *next == pixel) {
                rgb.iter_mut().zip(more).for_each(|(sum, value)| *sum += value);
            }
            if SplatSums::can_hold(rgb) {
                sums.add_path(pixel, rgb);
            } else {
                sums.drop_one();
                all_held = false;
            }
        }
        all_held
    }
}

impl PixelSampler for SplattingSampler<'_> {
    fn sample(&self, place: Place, row: &mut Row<'_>) -> bool {
        let Place { pixel, half, sample, column } = place;
        let settings = self.settings;
        let mut samples = self.samplers[half].samples(pixel, sample);
        let mut wavelengths = Wavelengths::sample_visible(samples.next_1d());
        let filtered = settings.filter.sample(samples.next_2d());
        let film = Vec2::new(pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5) + filtered.offset;
        let start = CameraStart { film, lens_u: samples.next_2d(), time_u: samples.next_1d() };

        let Row { film, splats: sums, spread, result, .. } = row;
        // What a sample that panicked has left.
        spread.splats.clear();
        spread.received.clear();
        // A sample is one of those that splats are averaged over, whatever becomes of it.
        result.cost.paths += 1;
        let mut path_cost = PathCost::default();
        let mut splats = Splats::new(&settings.sensor, &mut spread.splats);
        let radiance = self.estimator.sample(&start, &mut wavelengths, &mut samples, &mut splats, &mut path_cost);
        result.cost.rays += u64::from(path_cost.rays);
        result.cost.shadow_rays += u64::from(path_cost.shadow_rays);

        spread.splats.iter_mut().for_each(|splat| splat.rgb = limited(splat.rgb, settings.max_component));
        let all_held = sums.is_none_or(|sums| spread.add_to(sums, self.footprint));
        let rgb = limited(settings.sensor.to_output_rgb(radiance, &wavelengths), settings.max_component);
        film.add(column, half, rgb, filtered.sign) && all_held
    }
}

/// A colour scaled down so that no component exceeds a limit.
pub(super) fn limited(rgb: [f32; 3], most: f32) -> [f32; 3] {
    let largest = rgb.into_iter().fold(f32::NEG_INFINITY, f32::max);
    if largest > most { rgb.map(|v| v * (most / largest)) } else { rgb }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::film::{Film, FilmContents, FilmWindow, Filter, FilterKind, SplatContents};
    use crate::integrator::{PathIntegrator, PathTracer, Technique, Unwatched};
    use crate::light::Combination;
    use crate::render::RenderCost;
    use crate::render::incident::Incidents;
    use crate::render::pixels::{Estimator, PixelRounds};
    use crate::settings::Overrides;
    use crate::world::{Loaded, World, build};
    use luz_geometry::SimdLevel;
    use luz_sample::mis::Heuristic;
    use luz_sample::random::Random;
    use luz_sample::roulette::Roulette;
    use luz_scene::Diagnostics;

    /// Returns half of the light at the film position that it is given, and splats half of that at another, drawn evenly from all.
    struct Scattered<'a> {
        world: &'a World,
        camera: &'a Camera,
        path: PathIntegrator,
        window: FilmWindow,
        /// What splats are scaled by: 1, unless the test is to fail.
        scale: f32,
    }

    impl Scattered<'_> {
        fn radiance(
            &self,
            film: Vec2,
            wavelengths: &mut Wavelengths,
            samples: &mut impl Samples,
            cost: &mut PathCost,
        ) -> SampledSpectrum {
            let (world, camera) = (self.world, self.camera);
            let tracer = PathTracer { settings: &self.path, world, camera, combination: Combination::WithBsdf };
            let ray = camera.ray(film, Vec2::splat(0.5), 0.5);
            tracer.radiance(ray, None, wavelengths, samples, &mut Unwatched, None, cost)
        }
    }

    impl PixelEstimator for Scattered<'_> {
        type Memory = ();

        fn sample(
            &self,
            start: &CameraStart,
            wavelengths: &mut Wavelengths,
            samples: &mut impl Samples,
            splats: &mut Splats<'_>,
            _memory: &mut (),
            cost: &mut PathCost,
        ) -> SampledSpectrum {
            let mut random = Random::new(7, start.film.x.to_bits().into(), start.film.y.to_bits().into());
            let elsewhere = self.window.at(random.next_2d());
            let there = self.radiance(elsewhere, wavelengths, &mut random, cost);
            // In two parts, which must be seen as one by the variance.
            let value = there * (0.25 * self.scale * self.window.area());
            splats.add(elsewhere, value, wavelengths);
            splats.add(elsewhere, value, wavelengths);
            self.radiance(start.film, wavelengths, samples, cost) * 0.5
        }
    }

    const SCENE: &str = r#"
        LookAt 0 3 5  0 0 0  0 1 0
        Camera "perspective" "float fov" 40
        Film "rgb" "integer xresolution" 12 "integer yresolution" 10
        WorldBegin
        AttributeBegin
            AreaLightSource "diffuse" "rgb L" [8 7 5]
            Translate 1 3 1
            Shape "sphere" "float radius" 0.5
        AttributeEnd
        Material "diffuse" "rgb reflectance" [0.6 0.3 0.2]
        Shape "sphere" "float radius" 1
        Material "diffuse" "rgb reflectance" [0.5 0.5 0.5]
        Shape "trianglemesh" "point3 P" [-9 -1 -9  9 -1 -9  9 -1 9  -9 -1 9] "integer indices" [0 1 2 0 2 3]"#;

    fn loaded(filter: Filter, samples: u32) -> Loaded {
        let (description, _) = luz_scene::read_str("test.pbrt", SCENE).expect("it can be read");
        let wishes = Overrides { filter: Some(filter), samples_per_pixel: Some(samples), ..Overrides::default() };
        build(&description, &wishes, SimdLevel::Auto, &mut Diagnostics::default()).expect("it can be built")
    }

    fn render(loaded: &Loaded, scale: Option<f32>) -> Film {
        let Loaded { world, camera, settings, .. } = loaded;
        let path = PathIntegrator {
            max_depth: 3,
            heuristic: Heuristic::Power(2.0),
            technique: Technique::Both,
            roulette: Roulette::None,
            regularize: false,
        };
        let (estimator, splats) = match scale {
            Some(scale) => {
                let window = settings.film_window();
                (Estimator::splatting(Scattered { world, camera, path, window, scale }), SplatContents::Paths)
            }
            None => (Estimator::Path(path), SplatContents::None),
        };
        let mut pixels = PixelRounds::new(estimator, world, camera, settings);
        let mut film = Film::new(FilmContents { splats, ..settings.film_contents() }, settings.bounds);
        let (mut cost, mut incidents) = (RenderCost::default(), Incidents::default());
        pixels.pass(0..settings.samples_per_pixel, &mut film, &mut cost, &mut incidents);
        assert!(incidents.is_empty());
        film
    }

    /// The sum over pixels of the squared differences in units of their standard errors, less its expectation, in units of its
    /// standard deviation: normal for many pixels, if they are independent.
    fn z_of_squares(a: &Film, b: &Film) -> f64 {
        let squares: Vec<f64> = a
            .estimates()
            .zip(b.estimates())
            .filter(|(a, b)| a.variance[1] + b.variance[1] > 0.0)
            .map(|(a, b)| (a.mean[1] - b.mean[1]).powi(2) / (a.variance[1] + b.variance[1]))
            .collect();
        let n = squares.len() as f64;
        (squares.iter().sum::<f64>() - n) / (2.0 * n).sqrt()
    }

    /// χ² over 120 pixels at a significance of 10⁻⁴, with splats and pixels estimated by independent numbers; splats too
    /// bright by 6 % are noticed.
    #[test]
    fn splats_and_samples_add_up_to_the_picture() {
        for filter in [Filter::unit_box(), Filter::new(FilterKind::Gaussian { sigma: 0.5 }, Vec2::splat(1.5))] {
            let is_box = filter.kind() == FilterKind::Box;
            let loaded = loaded(filter, 2048);
            let path = render(&loaded, None);
            let scattered = render(&loaded, Some(1.0));
            // Splats of neighbouring pixels are of the same paths under a wider filter: fewer independent pixels.
            let limit = if is_box { 4.0 } else { 8.0 };
            let z = z_of_squares(&path, &scattered);
            assert!(z.abs() < limit, "{z}");
            let broken = z_of_squares(&path, &render(&loaded, Some(1.06)));
            assert!(broken > limit, "{broken}: the test must be able to fail");
        }
    }

    #[test]
    fn what_cannot_be_held_is_dropped_and_said() {
        let loaded = loaded(Filter::unit_box(), 1);
        let film = render_nothing(&loaded);
        let sums = film.splats().expect("it keeps splats");
        let footprint = Footprint::new(&loaded.settings.filter, loaded.settings.bounds);
        let mut spread = Spread::default();
        let splat = |x: f32, value: f32| Splat { film: Vec2::new(x, 0.5), rgb: [value; 3] };
        spread.splats.extend([splat(0.5, 1.0), splat(0.7, 2.0)]);
        assert!(spread.add_to(sums, &footprint));
        spread.splats.extend([splat(0.5, f32::NAN), splat(f32::NAN, 1.0), splat(1.5, f32::INFINITY), splat(2.5, 1e30)]);
        assert!(!spread.add_to(sums, &footprint));
        assert_eq!(film.dropped(), 4);
        let mut film = film;
        film.splats_mut().expect("it keeps splats").count_paths(2);
        let first = film.estimates().next().expect("there are pixels");
        // One path gave 3, another nothing.
        assert_eq!((first.mean, first.variance), ([1.5; 3], [2.25; 3]));
    }

    fn render_nothing(loaded: &Loaded) -> Film {
        Film::new(
            FilmContents { splats: SplatContents::Paths, ..loaded.settings.film_contents() },
            loaded.settings.bounds,
        )
    }
}
