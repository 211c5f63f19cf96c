//! Spatio-temporal filtering.

mod common;

use common::{picture, psnr};
use luz_filter::{
    BilateralFilter, Border, FilterError, Filtered, Method, SampleCount, Sampling, Strategy, VideoFilter, VideoGuide,
};
use luz_image::Image;

/// A picture that brightens and moves.
fn frames(count: usize) -> Vec<Image> {
    let whole = picture(60, 30, &["R", "G", "B"]);
    (0..count)
        .map(|t| {
            let mut frame = whole.crop(2 * t, 0, 36, 30).unwrap();
            frame.metadata = whole.metadata.clone();
            frame.data_mut().iter_mut().for_each(|v| *v += 0.01 * t as f32);
            frame
        })
        .collect()
}

fn run(filter: BilateralFilter, sigma_frames: f32, frames: &[Image]) -> Vec<Filtered> {
    let mut video = VideoFilter::new(filter, sigma_frames).unwrap();
    let mut out = Vec::new();
    for (i, frame) in frames.iter().enumerate() {
        let filtered = video.push(frame.clone(), Vec::new()).unwrap();
        assert_eq!(filtered.is_some(), i >= video.latency());
        out.extend(filtered);
    }
    while let Some(frame) = video.flush().unwrap() {
        out.push(frame);
    }
    assert_eq!(out.len(), frames.len());
    out
}

/// The definition, in `f64`, renormalised at all edges.
fn plain(sigma: f64, sigma_frames: f64, sigma_range: f64, frames: &[Image], t: usize) -> Image {
    let (r, rt) = ((2.5 * sigma).ceil() as i64, (2.5 * sigma_frames - 1e-5).ceil() as i64);
    let mut out = frames[t].clone();
    let (w, h) = (out.width() as i64, out.height() as i64);
    for y in 0..h {
        for x in 0..w {
            let centre = frames[t].pixel(x as usize, y as usize);
            let (mut sum, mut total) = ([0.0; 3], 0.0);
            for nt in (t as i64 - rt).max(0)..=(t as i64 + rt).min(frames.len() as i64 - 1) {
                for ny in (y - r).max(0)..=(y + r).min(h - 1) {
                    for nx in (x - r).max(0)..=(x + r).min(w - 1) {
                        let pixel = frames[nt as usize].pixel(nx as usize, ny as usize);
                        let d2: f64 =
                            pixel.iter().zip(centre).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum();
                        let s2 = ((nx - x).pow(2) + (ny - y).pow(2)) as f64 / sigma.powi(2);
                        let t2 = ((nt - t as i64) as f64 / sigma_frames).powi(2);
                        let weight = (-0.5 * (s2 + t2 + d2 / sigma_range.powi(2))).exp();
                        total += weight;
                        (0..3).for_each(|c| sum[c] += weight * f64::from(pixel[c]));
                    }
                }
            }
            let to = out.pixel_mut(x as usize, y as usize);
            (0..3).for_each(|c| to[c] = (sum[c] / total) as f32);
        }
    }
    out
}

#[test]
fn frames_come_out_filtered_and_in_order() {
    let frames = frames(9);
    let mut filter = BilateralFilter::new(1.5, 0.1);
    filter.border = Border::Renormalize;
    let exact = run(filter, 1.2, &frames);
    for (t, filtered) in exact.iter().enumerate() {
        let expected = plain(1.5, f64::from(1.2f32), f64::from(0.1f32), &frames, t);
        assert!(psnr(&filtered.image, &expected) > 120.0, "{t}");
        assert_eq!(filtered.report.window_frames, 7);
    }
    for strategy in Strategy::ALL {
        let few = Sampling { strategy, samples: SampleCount::Count(40), ..Sampling::default() };
        let many = Sampling { samples: SampleCount::Count(640), ..few };
        let mut quality = |sampling| {
            filter.method = Method::Sampled(sampling);
            let filtered = run(filter, 1.2, &frames);
            filtered.iter().zip(&exact).map(|(a, b)| psnr(&a.image, &b.image)).fold(f64::INFINITY, f64::min)
        };
        let (few, many) = (quality(few), quality(many));
        assert!(few > 28.0 && many > few + 8.0, "{strategy:?}: {few} {many}");
    }
}

/// A still video of noise loses more noise over time than within a frame.
#[test]
fn quality_targets_are_reached() {
    let whole = picture(300, 120, &["R", "G", "B"]);
    let frames: Vec<Image> = (0..5).map(|t| whole.crop(3 * t, 0, 280, 120).unwrap()).collect();
    let mut filter = BilateralFilter::new(4.0, 0.1);
    let exact = run(filter, 1.0, &frames);
    filter.method = Method::Auto { quality: 48.0 };
    for (filtered, exact) in run(filter, 1.0, &frames).iter().zip(&exact) {
        assert!(matches!(filtered.report.method, Method::Sampled(_)));
        assert!(psnr(&filtered.image, &exact.image) >= 48.0);
    }
}

#[test]
fn guides_travel_along() {
    let frames = frames(5);
    let filter = BilateralFilter::new(1.5, 0.1);
    let alone = run(filter, 1.0, &frames);
    let mut video = VideoFilter::new(filter, 1.0).unwrap();
    let mut out = Vec::new();
    for frame in &frames {
        let guide = VideoGuide { image: frame.clone(), range: filter.range, widths: None };
        out.extend(video.push(frame.clone(), vec![guide]).unwrap());
    }
    while let Some(frame) = video.flush().unwrap() {
        out.push(frame);
    }
    assert!(out.iter().zip(&alone).all(|(a, b)| psnr(&a.image, &b.image) > 120.0));
}

#[test]
fn frames_must_be_alike() {
    let mut video = VideoFilter::new(BilateralFilter::new(1.5, 0.1), 1.0).unwrap();
    video.push(picture(20, 10, &["Y"]), Vec::new()).unwrap();
    let error = video.push(picture(20, 11, &["Y"]), Vec::new()).unwrap_err();
    assert!(matches!(error, FilterError::FrameMismatch { frame: 1, .. }), "{error}");
    assert!(video.push(picture(20, 10, &["R"]), Vec::new()).is_err());
    assert!(video.push(picture(20, 10, &["Y"]), Vec::new()).is_ok());
}
