//! Taking noise out of renderings.

use luz_image::Image;
use luz_sample::random::hash;
use rayon::prelude::*;
use serde::Serialize;

use crate::{BilateralFilter, Border, FilterError, Filtered, Guide, Method, Progress, Range};

/// A cross-bilateral filter for renderings that know what the camera saw first (albedo, normal, depth) and the variance of
/// every pixel, as `luz render --film gbuffer` writes them.
///
/// What is filtered is light before it meets the albedo, `L = C / (a + ε)`, so that textures stay as they are. What is alike is
/// judged by albedo, shading normal, depth, and light itself, with a range as wide as its own noise. Noisy light is a bad judge
/// of itself, so there are two steps: a small filter gives a *pilot*, in which noise is low, and the filter proper is guided by
/// that. Probes of independent noise, with the deviation of each pixel and random signs, are filtered along; their squares tell
/// how much variance a step leaves, from which the next one has its range.
///
/// After Eisemann and Durand 2004, "Flash Photography Enhancement via Intrinsic Relighting" (cross-bilateral filters); Li, Wu and
/// Chuang 2012, "SURE-based Optimization for Adaptive Sampling and Reconstruction" (features as guides, ranges from variance).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RenderDenoiser {
    /// The width σ_s of the filter proper in pixels.
    pub sigma_spatial: f32,
    /// How far pixels may differ, relative to their noise: a factor on the range of light.
    pub strength: f32,
    /// σ_r of albedo, over its three components.
    pub albedo: f32,
    /// σ_r of shading normals: the distance of unit vectors.
    pub normal: f32,
    /// σ_r of depth, relative to it; wider where a surface recedes.
    pub depth: f32,
    /// How the filter is computed.
    pub method: Method,
    /// Chooses the random numbers.
    pub seed: u64,
}

impl Default for RenderDenoiser {
    fn default() -> Self {
        Self {
            sigma_spatial: 4.0,
            strength: 1.0,
            albedo: 0.15,
            normal: 0.15,
            depth: 0.02,
            method: Method::Exact,
            seed: 0,
        }
    }
}

/// The channels that are needed: colour, its variance, and the features.
const NEEDED: [&str; 13] = [
    "R",
    "G",
    "B",
    "Variance.R",
    "Variance.G",
    "Variance.B",
    "Albedo.R",
    "Albedo.G",
    "Albedo.B",
    "Ns.X",
    "Ns.Y",
    "Ns.Z",
    "Z",
];
/// Albedo below this doesn't count: black surfaces have light, too.
const LEAST_ALBEDO: f32 = 0.02;
/// The width of the pilot's filter in pixels, and its range in deviations of the noise. Wide, so that noise is no edge; what
/// exceeds it are fireflies, and edges that a range from little noise will find again.
const PILOT: (f32, f32) = (1.5, 6.0);
/// The range of the filter proper, in deviations of the pilot's noise.
const TOLERANCE: f32 = 1.5;
/// How many times a pixel's own estimate of its variance that of its surroundings may count.
const LARGEST_SHARE: f32 = 9.0;
/// Probes of noise. More tell what is left more exactly; a blur takes a mean of theirs over some pixels.
const PROBES: usize = 6;
/// Channels that are filtered: light and probes.
const VALUES: usize = 3 + PROBES;

impl RenderDenoiser {
    /// Does an image have all that is needed?
    pub fn suits(image: &Image) -> bool {
        NEEDED.iter().all(|name| image.channel(name).is_some())
    }

    /// The rendering with less noise: `R`, `G` and `B` are new, and `Variance.R`, `Variance.G` and `Variance.B` are estimates of
    /// the variance that is left (of the error's random part; the bias of smoothing isn't in it). Other channels stay.
    ///
    /// # Errors
    /// When channels are missing, no pixel has a variance (one sample has none), or a setting is out of its domain.
    pub fn apply(&self, image: &Image, progress: &(dyn Fn(Progress) + Sync)) -> Result<Filtered, FilterError> {
        crate::plan::check("the strength", self.strength, 1e-3, 1e3)?;
        let (width, height) = (image.width(), image.height());
        let select = |names: &[&str]| image.select(names);
        let variance = select(&NEEDED[3..6])?;
        if !variance.data().iter().any(|v| *v > 0.0) {
            let reason = "no pixel has a variance; render with at least two samples per pixel".to_owned();
            return Err(FilterError::Unsuitable { method: "the denoiser of renderings", reason });
        }
        let albedo = select(&NEEDED[6..9])?;
        let normal = select(&NEEDED[9..12])?;
        let depth = select(&NEEDED[12..])?;
        let divisor: Vec<f32> = albedo.data().par_iter().map(|a| a.max(0.0) + LEAST_ALBEDO).collect();
        let divided = |image: &Image, power: i32| {
            let data = image.data().par_iter().zip(&divisor).map(|(v, a)| v / a.powi(power)).collect();
            Image::from_data(width, height, ["R", "G", "B"], data)
        };
        let light = divided(&select(&NEEDED[..3])?, 1)?;
        // Variances are estimates, and those of few samples are bad ones. But the edge of a lamp varies a lot, and what is beside
        // it doesn't.
        let own = divided(&variance, 2)?;
        let mut noise = blur(&own, 1.5)?;
        noise.data_mut().iter_mut().zip(own.data()).for_each(|(mean, own)| *mean = mean.min(LARGEST_SHARE * own));
        let depth_widths = depth_widths(&depth, self.depth)?;
        let depth_range = Range::new(typical(depth_widths.data()));
        let features = [
            Guide::new(&albedo, self.albedo),
            Guide::new(&normal, self.normal),
            Guide { image: &depth, range: depth_range, widths: Some(&depth_widths) },
        ];
        let values = self.values(&light, &noise)?;
        let filter = |sigma: f32, guide: &Image, widths: &Image, part: u64| {
            let mut filter = BilateralFilter::new(sigma, 1.0);
            filter.method = self.method;
            filter.border = Border::Renormalize;
            filter.seed = self.seed;
            let [albedo, normal, depth] = features;
            let light = Guide { image: guide, range: Range::new(typical(widths.data())), widths: Some(widths) };
            // The pilot counts as a tenth of the work.
            let tell = |p: Progress| {
                let (start, share) = if part == 0 { (0, 1) } else { (p.total, 9) };
                progress(Progress { done: start + share * p.done, total: 10 * p.total });
            };
            filter.apply_with_progress(&values, &[albedo, normal, depth, light], &tell)
        };

        let total: Vec<f32> = noise.data().par_chunks_exact(3).map(|v| v.iter().sum()).collect();
        let raw_widths = widths(width, height, &total, PILOT.1)?;
        let Filtered { image: pilot, report: pilot_report } = filter(PILOT.0, &light, &raw_widths, 0)?;
        let (guide, left) = light_and_variance(&pilot)?;
        let pilot_widths = widths(width, height, blur(&left, 2.0)?.data(), TOLERANCE * self.strength)?;
        let Filtered { image: filtered, mut report } = filter(self.sigma_spatial, &guide, &pilot_widths, 1)?;
        report.seconds += pilot_report.seconds;
        report.scratch_bytes = report.scratch_bytes.max(pilot_report.scratch_bytes);

        let (light, left) = light_and_variance(&filtered)?;
        let left = blur(&left, 2.0)?;
        let mut result = image.clone();
        let positions: Vec<usize> = NEEDED[..6].iter().filter_map(|name| image.channel(name)).collect();
        let n = image.channel_count();
        result.data_mut().par_chunks_exact_mut(n).enumerate().for_each(|(i, pixel)| {
            for c in 0..3 {
                let at = 3 * i + c;
                let value = light.data()[at] * divisor[at];
                // What isn't finite has not been filtered.
                if !value.is_finite() {
                    continue;
                }
                pixel[positions[c]] = value;
                let share = if total[i] > 0.0 { noise.data()[at] / total[i] } else { 0.0 };
                pixel[positions[3 + c]] = left.data()[i] * share * divisor[at] * divisor[at];
            }
        });
        Ok(Filtered { image: result, report })
    }

    /// Light, and probes of its noise.
    fn values(&self, light: &Image, noise: &Image) -> Result<Image, FilterError> {
        let mut values = vec![0.0; light.width() * light.height() * VALUES];
        values.par_chunks_exact_mut(VALUES).enumerate().for_each(|(i, out)| {
            out[..3].copy_from_slice(&light.data()[3 * i..][..3]);
            let deviation = noise.data()[3 * i..][..3].iter().sum::<f32>().max(0.0).sqrt();
            let signs = hash(self.seed, i as u64, 0, 0);
            for (p, out) in out[3..].iter_mut().enumerate() {
                *out = if signs >> p & 1 == 1 { deviation } else { -deviation };
            }
        });
        let names = (0..VALUES).map(|c| format!("value {c}"));
        Ok(Image::from_data(light.width(), light.height(), names, values)?)
    }
}

/// A width that is typical for all, as the scale of widths that vary: the geometric mean.
fn typical(widths: &[f32]) -> f32 {
    let (sum, count) = widths
        .iter()
        .filter(|w| w.is_finite() && **w > 0.0)
        .fold((0.0, 0u64), |(sum, count), w| (sum + f64::from(*w).ln(), count + 1));
    ((sum / count.max(1) as f64).exp() as f32).clamp(1e-8, 1e8)
}

/// Widths of the range from variances, with a floor that only what has no noise at all is below.
fn widths(width: usize, height: usize, variances: &[f32], factor: f32) -> Result<Image, FilterError> {
    let data = variances.par_iter().map(|v| factor * v.max(1e-12).sqrt()).collect();
    Ok(Image::from_data(width, height, ["Y"], data)?)
}

/// Light out of filtered values, and the variance, over all components, that their probes say is left.
fn light_and_variance(values: &Image) -> Result<(Image, Image), FilterError> {
    let pixels = || values.data().par_chunks_exact(VALUES);
    let light = pixels().flat_map_iter(|p| p[..3].iter().copied()).collect();
    let left = pixels().map(|p| p[3..].iter().map(|v| v * v).sum::<f32>() / PROBES as f32).collect();
    let (width, height) = (values.width(), values.height());
    Ok((Image::from_data(width, height, ["R", "G", "B"], light)?, Image::from_data(width, height, ["Y"], left)?))
}

/// A Gaussian blur.
fn blur(image: &Image, sigma: f32) -> Result<Image, FilterError> {
    let mut filter = BilateralFilter::new(sigma, f32::INFINITY);
    filter.border = Border::Renormalize;
    Ok(filter.apply(image, &[])?.image)
}

/// σ_r of depth: relative to it, or what it changes by within four pixels, on the smoother side of the pixel.
fn depth_widths(depth: &Image, relative: f32) -> Result<Image, FilterError> {
    let (width, height) = (depth.width(), depth.height());
    let z = |x: usize, y: usize| depth.data()[y * width + x];
    let smoother = |a: f32, b: f32, c: f32| (a - b).abs().min((b - c).abs());
    let data = (0..width * height)
        .into_par_iter()
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let dx = if x > 0 && x + 1 < width { smoother(z(x - 1, y), z(x, y), z(x + 1, y)) } else { 0.0 };
            let dy = if y > 0 && y + 1 < height { smoother(z(x, y - 1), z(x, y), z(x, y + 1)) } else { 0.0 };
            (relative * z(x, y).abs()).max(4.0 * dx.hypot(dy)).max(1e-6)
        })
        .collect();
    Ok(Image::from_data(width, height, ["Y"], data)?)
}

#[cfg(test)]
mod tests {
    use super::super::noise::tests::normal;
    use super::*;

    const SIZE: usize = 96;
    /// The deviation of the noise, relative to the light.
    const NOISE: f32 = 0.25;

    /// A floor with a checkered albedo, lit with a gradient, before a wall; a shadow falls on both. And the same without noise.
    fn renderings() -> [Image; 2] {
        [NOISE, 0.0].map(|noise| {
            let mut data = Vec::new();
            for i in 0..SIZE * SIZE {
                let (x, y) = (i % SIZE, i / SIZE);
                let is_wall = y < SIZE / 2;
                let checker = if (x / 8 + y / 8) % 2 == 0 { 0.8 } else { 0.15 };
                let albedo = if is_wall { [0.7, 0.4, 0.3] } else { [checker; 3] };
                let shadow = if x > SIZE / 2 { 0.15 } else { 1.0 };
                let light = shadow * (1.0 + 0.004 * x as f32) * if is_wall { 0.4 } else { 1.0 };
                let normal_vector = if is_wall { [0.0, 0.0, -1.0] } else { [0.0, 1.0, 0.0] };
                let depth = if is_wall { 9.0 } else { 9.0 - 0.05 * (y - SIZE / 2) as f32 };
                let color = |c: usize| light * albedo[c] * (1.0 + noise * normal(c as u64, i as u64));
                data.extend((0..3).map(color));
                data.extend((0..3).map(|c| (light * albedo[c] * NOISE).powi(2)));
                data.extend(albedo);
                data.extend(normal_vector);
                data.push(depth);
            }
            Image::from_data(SIZE, SIZE, NEEDED, data).unwrap()
        })
    }

    fn denoise(image: &Image) -> Image {
        RenderDenoiser::default().apply(image, &|_| {}).unwrap().image
    }

    /// The mean over some pixels of the squared error, relative to the light.
    fn error(image: &Image, truth: &Image, is_wanted: impl Fn(usize, usize) -> bool) -> f32 {
        let (mut sum, mut count) = (0.0, 0);
        for i in (0..SIZE * SIZE).filter(|i| is_wanted(i % SIZE, i / SIZE)) {
            let (p, q) = (image.pixel(i % SIZE, i / SIZE), truth.pixel(i % SIZE, i / SIZE));
            sum += (0..3).map(|c| ((p[c] - q[c]) / q[c]).powi(2)).sum::<f32>() / 3.0;
            count += 1;
        }
        sum / count as f32
    }

    #[test]
    fn noise_goes_and_textures_geometry_and_shadows_stay() {
        let [noisy, truth] = renderings();
        let clean = denoise(&noisy);
        let gain = |is_wanted: &dyn Fn(usize, usize) -> bool| {
            error(&noisy, &truth, is_wanted) / error(&clean, &truth, is_wanted)
        };
        assert!(gain(&|_, _| true) > 15.0, "{}", gain(&|_, _| true));
        // Along the checkers, the foot of the wall, and the shadow, all of which blurs would smear.
        let checkers = gain(&|x, y| y > SIZE / 2 + 1 && x % 8 == 0 && x != SIZE / 2);
        let foot = gain(&|x, y| y.abs_diff(SIZE / 2) <= 1 && x.abs_diff(SIZE / 2) > 2);
        let shadow = gain(&|x, _| x.abs_diff(SIZE / 2) <= 1);
        assert!(checkers > 8.0 && foot > 4.0 && shadow > 4.0, "{checkers} {foot} {shadow}");
        // Energy is kept: over 9216 pixels, the mean has an error of 0.3 %.
        let mean = |image: &Image| image.data().chunks(13).map(|p| p[1]).sum::<f32>();
        assert!((mean(&clean) / mean(&noisy) - 1.0).abs() < 0.01);
        assert_eq!(clean.select(&NEEDED[6..]).unwrap(), noisy.select(&NEEDED[6..]).unwrap());
    }

    #[test]
    fn the_variance_that_is_left_is_that_of_the_error() {
        let [noisy, truth] = renderings();
        let clean = denoise(&noisy);
        // Where light is nearly flat, error is noise. The estimate is independent of the colours, whose noise shapes the
        // weights as well: that leaves a little more.
        let inside = |x: usize, y: usize| (4..40).contains(&x) && (4..40).contains(&y);
        let (mut left, mut found) = (0.0, 0.0);
        for i in (0..SIZE * SIZE).filter(|i| inside(i % SIZE, i / SIZE)) {
            let (p, q) = (clean.pixel(i % SIZE, i / SIZE), truth.pixel(i % SIZE, i / SIZE));
            left += p[3..6].iter().sum::<f32>();
            found += (0..3).map(|c| (p[c] - q[c]).powi(2)).sum::<f32>();
        }
        assert!((0.4..1.3).contains(&(left / found)), "{left} {found}");
    }

    #[test]
    fn a_rendering_without_noise_stays() {
        let [_, truth] = renderings();
        let mut exact = truth.clone();
        exact.data_mut().chunks_exact_mut(13).for_each(|p| p[3..6].fill(1e-10));
        assert!(error(&denoise(&exact), &truth, |_, _| true) < 1e-6);
    }

    #[test]
    fn odd_pixels_stay_and_touch_nobody() {
        let [mut noisy, truth] = renderings();
        noisy.pixel_mut(20, 20)[0] = f32::NAN;
        noisy.pixel_mut(60, 70)[3] = f32::INFINITY;
        noisy.pixel_mut(70, 20)[12] = f32::NAN;
        let clean = denoise(&noisy);
        assert!(clean.pixel(20, 20)[0].is_nan());
        let odd = [(20, 20), (60, 70), (70, 20)];
        assert!(
            (0..SIZE * SIZE)
                .map(|i| (i % SIZE, i / SIZE))
                .filter(|p| !odd.contains(p))
                .all(|(x, y)| { clean.pixel(x, y)[..3].iter().all(|v| v.is_finite()) })
        );
        assert!(error(&clean, &truth, |x, y| !odd.contains(&(x, y))) < NOISE * NOISE / 10.0);
    }

    #[test]
    fn what_is_missing_is_named() {
        let [noisy, _] = renderings();
        let without = noisy.select(&NEEDED[..9]).unwrap();
        assert!(!RenderDenoiser::suits(&without) && RenderDenoiser::suits(&noisy));
        let error = RenderDenoiser::default().apply(&without, &|_| {}).unwrap_err().to_string();
        assert!(error.contains("Ns.X"), "{error}");
        let mut single = noisy;
        single.data_mut().chunks_exact_mut(13).for_each(|p| p[3..6].fill(0.0));
        let error = RenderDenoiser::default().apply(&single, &|_| {}).unwrap_err().to_string();
        assert!(error.contains("two samples"), "{error}");
    }
}
