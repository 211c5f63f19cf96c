//! Taking noise out of renderings.

use luz_image::Image;
use luz_sample::random::hash;
use rayon::prelude::*;
use serde::Serialize;

use crate::{BilateralFilter, Border, FilterError, Filtered, Guide, Method, Progress, Range, Report, Scale};

/// A cross-bilateral filter for renderings that know what the camera saw first (albedo, normal, depth) and the variance of
/// every pixel, as `luz render --film gbuffer` writes them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RenderDenoiser {
    /// The width σ_s of the last pass in pixels.
    pub sigma_spatial: f32,
    /// How many standard deviations of the guide's noise two pixels may differ by.
    pub tolerance: f32,
    pub strength: f32,
    /// σ_r of albedo.
    pub albedo: f32,
    /// σ_r of shading normals.
    pub normal: f32,
    /// σ_r of depth, relative.
    pub depth: f32,
    pub passes: usize,
    pub pilot_sigma: f32,
    pub pilot_tolerance: f32,
    /// How the filter is computed.
    pub method: Method,
    /// Chooses the random numbers.
    pub seed: u64,
}

impl Default for RenderDenoiser {
    fn default() -> Self {
        Self {
            sigma_spatial: 6.0,
            tolerance: 1.0,
            strength: 1.0,
            albedo: 0.1,
            normal: 0.15,
            depth: 0.02,
            passes: 2,
            pilot_sigma: 1.5,
            pilot_tolerance: 3.0,
            method: Method::Exact,
            seed: 0,
        }
    }
}

/// The channels of a rendering that knows what it needs.
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

const PROBES: usize = 6;

impl RenderDenoiser {
    /// Does an image have what is needed?
    pub fn suits(image: &Image) -> bool {
        NEEDED.iter().all(|name| image.channel(name).is_some())
    }

    pub fn apply(&self, image: &Image, progress: &(dyn Fn(Progress) + Sync)) -> Result<Filtered, FilterError> {
        let color = image.select(&["R", "G", "B"])?;
        let variance = image.select(&["Variance.R", "Variance.G", "Variance.B"])?;
        let albedo = image.select(&["Albedo.R", "Albedo.G", "Albedo.B"])?;
        let normal = image.select(&["Ns.X", "Ns.Y", "Ns.Z"])?;
        let depth = image.select(&["Z"])?;
        let (w, h) = (image.width(), image.height());
        let divisor: Vec<f32> =
            albedo.data().iter().map(|a| if a.is_finite() { a.max(0.0) + 0.02 } else { 1.0 }).collect();
        let light =
            Image::from_data(w, h, ["R", "G", "B"], color.data().iter().zip(&divisor).map(|(c, a)| c / a).collect())?;
        let noise = Image::from_data(
            w,
            h,
            ["R", "G", "B"],
            variance.data().iter().zip(&divisor).map(|(v, a)| v / (a * a)).collect(),
        )?;
        // Variances are estimates of few samples.
        let noise = blur(&noise, 1.5)?;
        let depth_widths = depth_widths(&depth, self.depth, 1.0)?;

        // Values: light and probes.
        let mut values = vec![0.0; w * h * (3 + PROBES)];
        for (i, out) in values.chunks_exact_mut(3 + PROBES).enumerate() {
            out[..3].copy_from_slice(&light.data()[3 * i..][..3]);
            let deviation = total(&noise.data()[3 * i..][..3]).sqrt();
            for (p, out) in out[3..].iter_mut().enumerate() {
                let bits = hash(self.seed, i as u64, p as u64, 0);
                *out = if bits & 1 == 1 { deviation } else { -deviation };
            }
        }
        let names: Vec<String> = (0..3 + PROBES).map(|c| format!("c{c}")).collect();
        let values = Image::from_data(w, h, names, values)?;

        let features = |scale: f32| {
            [
                Guide::new(&albedo, self.albedo * scale),
                Guide::new(&normal, self.normal * scale),
                Guide {
                    image: &depth,
                    range: Range::new(geometric_mean(depth_widths.data()) * scale),
                    widths: Some(&depth_widths),
                },
            ]
        };
        let mut filter = BilateralFilter::new(self.pilot_sigma, 1.0);
        filter.method = self.method;
        filter.border = Border::Renormalize;
        filter.mean_scale = Scale::Linear;
        // The pilot.
        let raw_widths =
            widths(w, h, &noise.data().chunks_exact(3).map(total).collect::<Vec<_>>(), self.pilot_tolerance)?;
        let mut guides = features(1.0).to_vec();
        guides.push(Guide {
            image: &light,
            range: Range::new(geometric_mean(raw_widths.data())),
            widths: Some(&raw_widths),
        });
        let Filtered { image: mut pilot, mut report } = filter.apply_with_progress(&values, &guides, progress)?;
        for _ in 0..self.passes {
            let (guide, left) = split(&pilot)?;
            let left = blur(&left, 2.0)?;
            let pilot_widths = widths(w, h, left.data(), self.tolerance)?;
            let mut guides = features(1.0).to_vec();
            guides.push(Guide {
                image: &guide,
                range: Range::new(geometric_mean(pilot_widths.data())),
                widths: Some(&pilot_widths),
            });
            filter.sigma_spatial = self.sigma_spatial;
            let filtered = filter.apply_with_progress(&values, &guides, progress)?;
            let seconds = report.seconds + filtered.report.seconds;
            report = filtered.report;
            report.seconds = seconds;
            pilot = filtered.image;
        }
        let mut out = image.clone();
        let n = out.channel_count();
        let rgb = ["R", "G", "B"].map(|c| out.channel(c).unwrap_or(0));
        for (i, p) in out.data_mut().chunks_exact_mut(n).enumerate() {
            for c in 0..3 {
                p[rgb[c]] = pilot.data()[i * (3 + PROBES) + c] * divisor[3 * i + c];
            }
        }
        Ok(Filtered { image: out, report })
    }
}

fn total(v: &[f32]) -> f32 {
    v.iter().sum()
}

fn geometric_mean(v: &[f32]) -> f32 {
    let logs: Vec<f64> = v.iter().filter(|v| **v > 0.0 && v.is_finite()).map(|v| f64::from(*v).ln()).collect();
    ((logs.iter().sum::<f64>() / logs.len().max(1) as f64).exp() as f32).clamp(1e-9, 1e9)
}

fn widths(w: usize, h: usize, variance: &[f32], tolerance: f32) -> Result<Image, FilterError> {
    let data = variance.iter().map(|v| tolerance * v.max(1e-12).sqrt()).collect();
    Ok(Image::from_data(w, h, ["Y"], data)?)
}

/// The light of filtered values, and the variance that is left.
fn split(values: &Image) -> Result<(Image, Image), FilterError> {
    let n = 3 + PROBES;
    let light = values.data().chunks_exact(n).flat_map(|p| [p[0], p[1], p[2]]).collect();
    let left =
        values.data().chunks_exact(n).map(|p| p[3..].iter().map(|v| v * v).sum::<f32>() / PROBES as f32).collect();
    Ok((
        Image::from_data(values.width(), values.height(), ["R", "G", "B"], light)?,
        Image::from_data(values.width(), values.height(), ["Y"], left)?,
    ))
}

fn blur(image: &Image, sigma: f32) -> Result<Image, FilterError> {
    let mut filter = BilateralFilter::new(sigma, f32::INFINITY);
    filter.border = Border::Renormalize;
    Ok(filter.apply(image, &[])?.image)
}

fn depth_widths(depth: &Image, relative: f32, slope: f32) -> Result<Image, FilterError> {
    let (w, h) = (depth.width(), depth.height());
    let z = |x: usize, y: usize| depth.data()[y * w + x];
    let data = (0..w * h)
        .into_par_iter()
        .map(|i| {
            let (x, y) = (i % w, i / w);
            let near = |a: f32, b: f32, c: f32| (a - b).abs().min((b - c).abs());
            let dx = if x > 0 && x + 1 < w { near(z(x - 1, y), z(x, y), z(x + 1, y)) } else { 0.0 };
            let dy = if y > 0 && y + 1 < h { near(z(x, y - 1), z(x, y), z(x, y + 1)) } else { 0.0 };
            (relative * z(x, y).abs()).max(slope * 4.0 * dx.hypot(dy)).max(1e-6)
        })
        .collect();
    Ok(Image::from_data(w, h, ["Y"], data)?)
}
