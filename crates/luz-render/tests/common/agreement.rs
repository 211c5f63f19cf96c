//! Do two ways to render the same scene have the same mean?
//!
//! Both are rendered with many independent seeds. What is compared are means over 4 × 4 tiles of the picture, and over all of it,
//! per channel, by Welch's t-test over the seeds: of estimates whose neighbouring pixels hang together (splats, chains), the
//! variances of pixels do not add up to those of tiles, but means of seeds are independent all the same.

use luz_render::Renderer;
use luz_render::film::Film;
use luz_render::integrator::Integrator;
use luz_render::world::Loaded;
use luz_sample::statistics::Running;
use luz_sample::test_support::{sidak, two_sample_t_test};
use std::ops::Range;

/// Tiles along each side of a picture.
const TILES: usize = 4;
/// Tiles, and the whole picture, in three channels.
const MEANS: usize = 3 * (TILES * TILES + 1);
/// Means of `f32` numbers that differ relatively by less are the same but for rounding.
const ROUNDING: f64 = 1e-5;

/// Means over tiles and over the whole picture, of independent renders.
#[derive(Clone, Debug)]
pub struct Means([Running; MEANS]);

impl Default for Means {
    fn default() -> Self {
        Self([Running::default(); MEANS])
    }
}

/// A picture with another seed and integrator; its scene is loaded but once.
pub fn render_by(loaded: &Loaded, integrator: &Integrator, samples: u32, seed: u64) -> Film {
    let mut settings = loaded.settings.clone();
    settings.integrator = integrator.clone();
    (settings.samples_per_pixel, settings.sample_limit) = (samples, samples);
    settings.seed = seed;
    let mut renderer = Renderer::new(&loaded.world, &loaded.camera, &settings);
    renderer.finish();
    assert_eq!(renderer.film().dropped(), 0, "there are samples that are not finite");
    assert!(renderer.incidents().is_empty(), "{:?}", renderer.incidents());
    renderer.film().clone()
}

/// The means of a picture, per tile and channel, those of the whole last.
fn means_of(film: &Film) -> [f64; MEANS] {
    let (width, height) = (film.bounds().width() as usize, film.bounds().height() as usize);
    let mut sums = [(0.0, 0.0f64); MEANS];
    for (i, pixel) in film.estimates().enumerate() {
        let (x, y) = (i % width, i / width);
        for tile in [y * TILES / height * TILES + x * TILES / width, TILES * TILES] {
            for (sum, value) in sums[3 * tile..].iter_mut().zip(pixel.mean) {
                sum.0 += value;
                sum.1 += 1.0;
            }
        }
    }
    sums.map(|(sum, count)| sum / count.max(1.0))
}

impl Means {
    /// Of renders by an integrator, with each of the seeds.
    pub fn of(loaded: &Loaded, integrator: &Integrator, samples: u32, seeds: Range<u64>) -> Self {
        let mut means = Self::default();
        for seed in seeds {
            means.push(means_of(&render_by(loaded, integrator, samples, seed)));
        }
        means
    }

    /// Of the differences between renders of the same seed: what `more` finds that `less` does not, where both draw the same numbers.
    pub fn of_difference(loaded: &Loaded, [more, less]: [&Integrator; 2], samples: u32, seeds: Range<u64>) -> Self {
        let mut means = Self::default();
        for seed in seeds {
            let [more, less] = [more, less].map(|integrator| means_of(&render_by(loaded, integrator, samples, seed)));
            means.push(std::array::from_fn(|i| more[i] - less[i]));
        }
        means
    }

    fn push(&mut self, values: [f64; MEANS]) {
        for (mean, value) in self.0.iter_mut().zip(values) {
            mean.push(value);
        }
    }

    /// The same, all multiplied.
    pub fn scaled(&self, factor: f64) -> Self {
        let mut scaled = self.clone();
        for mean in &mut scaled.0 {
            // Running statistics scale by being made anew from two values of the same mean and standard error.
            let (center, count) = (mean.mean() * factor, mean.count());
            let spread = (mean.variance() * (count - 1) as f64 / count as f64).sqrt() * factor;
            *mean = Running::default();
            for i in 0..count {
                mean.push(center + if i % 2 == 0 { spread } else { -spread });
            }
        }
        scaled
    }

    /// Mean and standard error of the whole picture in a channel.
    pub fn whole(&self, channel: usize) -> (f64, f64) {
        let mean = &self.0[3 * TILES * TILES + channel];
        (mean.mean(), mean.standard_error())
    }
}

/// What was compared, and how improbable it is.
#[derive(Clone, Debug)]
struct Comparison {
    what: String,
    p: f64,
}

/// Comparisons of which none may fail.
#[derive(Clone, Debug, Default)]
pub struct Family {
    all: Vec<Comparison>,
    /// The deviations of whole pictures' green channels, of all that were compared with the same.
    z: Vec<(Running, Vec<f64>)>,
}

impl Family {
    /// Compares two ways to render, tile by tile and as a whole.
    pub fn compare(&mut self, what: &str, a: &Means, b: &Means) {
        self.compare_from(0, what, a, b);
    }

    /// Compares two ways to render by the whole picture alone: for estimators so uneven that in a tile's few samples the rare ones
    /// that carry much of the mean may all be missing, of which its estimated error would know nothing.
    pub fn compare_whole(&mut self, what: &str, a: &Means, b: &Means) {
        self.compare_from(3 * TILES * TILES, what, a, b);
    }

    fn compare_from(&mut self, first: usize, what: &str, a: &Means, b: &Means) {
        for (i, (a, b)) in a.0.iter().zip(&b.0).enumerate().skip(first) {
            let difference = (a.mean() - b.mean()).abs();
            // Where nothing is random, rounding remains.
            let is_rounding = difference <= ROUNDING * (a.mean().abs() + b.mean().abs());
            let p = if is_rounding { 1.0 } else { two_sample_t_test(a, b) };
            let (tile, channel) = (i / 3, i % 3);
            let place = if tile < TILES * TILES { format!("tile {tile}") } else { "whole picture".to_owned() };
            let z = (b.mean() - a.mean()) / a.standard_error().hypot(b.standard_error());
            self.all.push(Comparison {
                what: format!(
                    "{what}, {place}, channel {channel}: {:.5} ± {:.5} and {:.5} ± {:.5}, t = {z:.2}",
                    a.mean(),
                    a.standard_error(),
                    b.mean(),
                    b.standard_error(),
                ),
                p,
            });
            if i == 3 * TILES * TILES + 1 && z.is_finite() && !is_rounding {
                match self.z.last_mut() {
                    Some((shared, deviations)) if shared == a => deviations.push(z),
                    _ => self.z.push((*a, vec![z])),
                }
            }
        }
        if std::env::var_os("LUZ_VERBOSE").is_some() {
            let last = &self.all[self.all.len() - 2];
            let worst = self.all[self.all.len() - (MEANS - first)..].iter().map(|c| c.p).fold(1.0, f64::min);
            println!("{} worst p {worst:.1e}", last.what);
        }
    }

    /// What contradicts that all compared have the same means, at a significance for all of them: by Šidák's correction half of
    /// it is for the comparisons, and half for what all whole pictures have in common, the sum of their deviations.
    pub fn contradictions(&self, significance: f64) -> Vec<String> {
        let each = sidak(0.5 * significance, self.all.len());
        let mut found: Vec<String> =
            self.all.iter().filter(|c| c.p < each).map(|c| format!("{}, p = {:.1e}", c.what, c.p)).collect();
        // The mean of deviations from the same has a variance of one at most.
        let mean = |deviations: &[f64]| deviations.iter().sum::<f64>() / deviations.len() as f64;
        let sum: f64 = self.z.iter().map(|(_, deviations)| mean(deviations)).sum();
        let common = sum / (self.z.len().max(1) as f64).sqrt();
        if luz_sample::test_support::z_test(common) < 0.5 * significance {
            found.push(format!("all together: z = {common:.2}"));
        }
        found
    }

    /// How many comparisons.
    pub fn len(&self) -> usize {
        self.all.len()
    }

    /// Panics where there are contradictions.
    pub fn assert_agrees(&self, significance: f64) {
        let found = self.contradictions(significance);
        assert!(found.is_empty(), "{} of {} comparisons:\n{}", found.len(), self.len(), found.join("\n"));
    }
}
