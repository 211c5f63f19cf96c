//! The filter on real photographs, HDR images and video.
//!
//! The folder that `LUZ_DATA` names holds `images/` and `video/`.

mod common;

use std::path::PathBuf;

use common::psnr;
use luz_filter::{BilateralFilter, Method, SampleCount, Sampling, Scale, Strategy, VideoFilter};
use luz_image::Image;

fn data() -> PathBuf {
    std::env::var_os("LUZ_DATA").expect("LUZ_DATA must name the folder of images and videos").into()
}

/// A photograph as it is encoded.
fn photograph(name: &str) -> Image {
    let mut image = Image::read(data().join("images").join(name)).unwrap();
    image.data_mut().iter_mut().for_each(|v| *v = Scale::Encoded.forward(*v));
    image
}

const PHOTOGRAPHS: [&str; 13] = [
    "kodak/01.png",
    "kodak/03.png",
    "kodak/05.png",
    "kodak/07.png",
    "kodak/09.png",
    "kodak/13.png",
    "kodak/15.png",
    "kodak/19.png",
    "kodak/21.png",
    "kodak/23.png",
    "astronaut.png",
    "chelsea.png",
    "coffee.png",
];

/// What `auto` promises is true, for all photographs.
#[test]
fn quality_targets_are_reached() {
    let mut failures = Vec::new();
    for name in PHOTOGRAPHS {
        let color = photograph(name).select(&["R", "G", "B"]).unwrap();
        let grey = color.select(&["G"]).unwrap();
        for image in [&color, &grey] {
            for (sigma_spatial, sigma_range) in [(4.0, 0.1), (10.0, 0.05)] {
                let mut filter = BilateralFilter::new(sigma_spatial, sigma_range);
                let exact = filter.apply(image, &[]).unwrap().image;
                for target in [45.0, 50.0, 60.0] {
                    filter.method = Method::Auto { quality: target };
                    let filtered = filter.apply(image, &[]).unwrap();
                    let reached = psnr(&filtered.image, &exact);
                    if reached < target {
                        let channels = image.channel_count();
                        failures.push(format!("{name} ({channels}) σ_s {sigma_spatial}: {reached:.2} of {target}"));
                    }
                }
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

/// Sobol, Poisson-disk, stratified and Vogel points beat random ones on every photograph; twice the window's width is
/// enough for 44 dB everywhere.
#[test]
fn strategies_on_photographs() {
    for name in ["kodak/05.png", "kodak/13.png", "kodak/23.png", "astronaut.png"] {
        let image = photograph(name).select(&["R", "G", "B"]).unwrap();
        let mut filter = BilateralFilter::new(8.0, 0.1);
        let exact = filter.apply(&image, &[]).unwrap().image;
        let mut quality = |strategy| {
            filter.method = Method::Sampled(Sampling { strategy, ..Sampling::default() });
            psnr(&filter.apply(&image, &[]).unwrap().image, &exact)
        };
        let random = quality(Strategy::Random);
        for strategy in [Strategy::Stratified, Strategy::PoissonDisk, Strategy::Sobol, Strategy::Vogel] {
            let even = quality(strategy);
            assert!(even > random + 1.0 && even > 44.0, "{name} {strategy:?}: {even}, random {random}");
        }
    }
}

/// HDR images, on a logarithmic scale.
#[test]
fn high_dynamic_range() {
    for name in ["Desk.exr", "StillLife.exr"] {
        let whole = Image::read(data().join("images/hdr").join(name)).unwrap();
        let size = [whole.width().min(400), whole.height().min(300)];
        let image = whole.select(&["R", "G", "B"]).unwrap().crop(0, 0, size[0], size[1]).unwrap();
        let mut filter = BilateralFilter::new(6.0, 0.4);
        (filter.range.scale, filter.mean_scale) = (Scale::Log, Scale::Log);
        let exact = filter.apply(&image, &[]).unwrap().image;
        assert_eq!(exact.non_finite_count(), 0);
        let log = |image: &Image| {
            let mut image = image.clone();
            image.data_mut().iter_mut().for_each(|v| *v = Scale::Log.forward(*v));
            image
        };
        let mut quality = |windows| {
            filter.method = Method::Sampled(Sampling { samples: SampleCount::Windows(windows), ..Sampling::default() });
            psnr(&log(&filter.apply(&image, &[]).unwrap().image), &log(&exact))
        };
        // Four times as many independent samples would bring 6 dB. The unfiltered image is worse than a few samples.
        let (few, many, unfiltered) = (quality(2.0), quality(8.0), psnr(&log(&image), &log(&exact)));
        assert!(few > unfiltered + 1.0 && many > few + 5.0, "{name}: {unfiltered} {few} {many}");
    }
}

/// A video of luma, 160×96 in planar YUV 4:2:0: filtered over time, a target is reached, and noise goes.
#[test]
fn video() {
    let bytes = std::fs::read(data().join("video/CiscoVT2people_160x96_6fps.yuv")).unwrap();
    let frames: Vec<Image> = bytes
        .chunks_exact(160 * 96 * 3 / 2)
        .take(7)
        .map(|frame| {
            let luma = frame[..160 * 96].iter().map(|&v| f32::from(v) / 255.0).collect();
            Image::from_data(160, 96, ["Y"], luma).unwrap()
        })
        .collect();
    let run = |method| {
        let mut filter = BilateralFilter::new(3.0, 0.1);
        filter.method = method;
        let mut video = VideoFilter::new(filter, 1.0).unwrap();
        let mut out = Vec::new();
        for frame in &frames {
            out.extend(video.push(frame.clone(), Vec::new()).unwrap());
        }
        while let Some(frame) = video.flush().unwrap() {
            out.push(frame);
        }
        out
    };
    let exact = run(Method::Exact);
    for (sampled, exact) in run(Method::Auto { quality: 48.0 }).iter().zip(&exact) {
        let quality = psnr(&sampled.image, &exact.image);
        assert!(quality >= 47.0, "{quality}");
    }
}
