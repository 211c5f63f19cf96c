//! Holes in images, odd sizes, and settings that make no sense.

mod common;

use common::{picture, psnr};
use luz_filter::{
    BilateralFilter, Border, Distance, FilterError, Guide, Method, Precision, SampleCount, Sampling, Strategy,
    VideoFilter,
};
use luz_image::Image;

fn methods() -> [Method; 5] {
    [
        Method::Sampled(Sampling { precision: Precision::Half, ..Sampling::default() }),
        Method::Exact,
        Method::Sampled(Sampling::default()),
        Method::Sampled(Sampling { regression: true, ..Sampling::default() }),
        Method::Auto { quality: 50.0 },
    ]
}

/// Pixels that aren't finite stay, are counted, and their neighbours are what they would be if the holes didn't exist.
#[test]
fn holes_are_left_out() {
    let clean = picture(48, 40, &["R", "G", "B"]);
    let holes = [(0, 0), (20, 20), (21, 20), (47, 39), (10, 33)];
    let mut image = clean.clone();
    for (i, &(x, y)) in holes.iter().enumerate() {
        image.pixel_mut(x, y)[i % 3] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e38, f32::NAN][i];
    }
    // The same picture with an opacity that hides the holes.
    let mut hidden = Image::new(48, 40, ["R", "G", "B", "A"]).unwrap();
    for y in 0..40 {
        for x in 0..48 {
            let open = if holes.contains(&(x, y)) { 0.0 } else { 1.0 };
            let [r, g, b] = clean.pixel(x, y) else { unreachable!() };
            hidden.pixel_mut(x, y).copy_from_slice(&[*r, *g, *b, open]);
        }
    }
    for border in [Border::Mirror, Border::Clamp, Border::Renormalize] {
        for method in methods() {
            let mut filter = BilateralFilter::new(2.0, 0.3);
            (filter.method, filter.border) = (method, border);
            let filtered = filter.apply(&image, &[]).unwrap();
            assert_eq!(filtered.report.excluded_pixels, 5, "{method:?}");
            for y in 0..40 {
                for x in 0..48 {
                    let finite = filtered.image.pixel(x, y).iter().all(|v| v.is_finite() && *v < 10.0);
                    assert_eq!(finite, !holes.contains(&(x, y)), "{method:?} {border:?} {x} {y}");
                }
            }
        }
        // Against the plain filter: guided by the clean picture, hidden pixels have no colour.
        let mut filter = BilateralFilter::new(2.0, 0.3);
        filter.border = border;
        let guides = [Guide::new(&clean, 0.3)];
        let expected = filter.apply(&hidden, &guides).unwrap().image.select(&["R", "G", "B"]).unwrap();
        let mut filtered = filter.apply(&image, &[]).unwrap().image;
        holes.iter().for_each(|&(x, y)| filtered.pixel_mut(x, y).copy_from_slice(expected.pixel(x, y)));
        assert!(psnr(&filtered, &expected) > 120.0, "{border:?}");
    }
}

#[test]
fn holes_in_guides_are_left_out() {
    let image = picture(40, 30, &["R", "G", "B"]);
    let mut guide = picture(40, 30, &["Y"]);
    guide.pixel_mut(5, 6)[0] = f32::NAN;
    for method in [Method::Exact, Method::Sampled(Sampling::default()), Method::Cosines { quality: 50.0 }] {
        let mut filter = BilateralFilter::new(2.0, 0.3);
        filter.method = method;
        let filtered = filter.apply(&image, &[Guide::new(&guide, 0.1)]).unwrap();
        assert_eq!(filtered.report.excluded_pixels, 1);
        assert_eq!(filtered.image.pixel(5, 6), image.pixel(5, 6));
        assert_eq!(filtered.image.non_finite_count(), 0);
    }
}

#[test]
fn images_of_any_size() {
    for (width, height) in [(1, 1), (1, 2), (1, 57), (57, 1), (3, 2), (33, 5)] {
        for border in [Border::Mirror, Border::Clamp, Border::Renormalize] {
            for channels in [&["Y"][..], &["R", "G", "B"]] {
                let image = picture(width, height, channels);
                for method in methods() {
                    let mut filter = BilateralFilter::new(4.0, 0.1);
                    (filter.method, filter.border) = (method, border);
                    let filtered = filter.apply(&image, &[]).unwrap().image;
                    assert!(psnr(&filtered, &image) > 20.0, "{width}×{height} {method:?}");
                }
                if channels.len() == 1 {
                    let mut filter = BilateralFilter::new(4.0, 0.1);
                    filter.border = border;
                    let exact = filter.apply(&image, &[]).unwrap().image;
                    filter.method = Method::Cosines { quality: 50.0 };
                    assert!(psnr(&filter.apply(&image, &[]).unwrap().image, &exact) > 50.0, "{width}×{height}");
                }
            }
        }
    }
}

#[test]
fn nonsense_is_refused() {
    let image = picture(8, 8, &["R", "G", "B"]);
    let message =
        |filter: &BilateralFilter, guides: &[Guide<'_>]| filter.apply(&image, guides).unwrap_err().to_string();
    for sigma in [0.0, -1.0, f32::NAN, f32::INFINITY, 1e9] {
        let message = message(&BilateralFilter::new(sigma, 0.1), &[]);
        assert_eq!(
            message,
            format!("σ_s must be a number from 0.1 to 1000, not {sigma}")
                .replace("0.1", &format!("{}", f64::from(0.1f32)))
        );
        assert!(VideoFilter::new(BilateralFilter::new(1.0, 0.1), sigma).is_err());
    }
    for sigma in [0.0, -1.0, f32::NAN] {
        assert!(message(&BilateralFilter::new(1.0, sigma), &[]).starts_with("σ_r must be a number from "));
    }
    let other = picture(8, 9, &["Y"]);
    assert_eq!(
        message(&BilateralFilter::new(1.0, 0.1), &[Guide::new(&image, 0.1), Guide::new(&other, 0.1)]),
        "guide 1 has 8×9 pixels, but the image has 8×8; resize the guide first"
    );
    let mut filter = BilateralFilter::new(1.0, 0.1);
    filter.method = Method::Cosines { quality: 50.0 };
    assert!(matches!(filter.apply(&image, &[]), Err(FilterError::Unsuitable { .. })));
    filter.method = Method::Auto { quality: f64::NAN };
    assert!(matches!(filter.apply(&image, &[]), Err(FilterError::OutOfDomain { .. })));
    let regression = Sampling { regression: true, ..Sampling::default() };
    filter.method = Method::Sampled(regression);
    assert!(matches!(filter.apply(&image, &[Guide::new(&image, 0.1)]), Err(FilterError::Unsuitable { .. })));
    for samples in
        [SampleCount::Count(0), SampleCount::Windows(f32::NAN), SampleCount::Windows(-1.0), SampleCount::Windows(1e9)]
    {
        filter.method = Method::Sampled(Sampling { samples, ..Sampling::default() });
        assert!(matches!(filter.apply(&image, &[]), Err(FilterError::OutOfDomain { .. })), "{samples:?}");
    }
    filter.method = Method::Exact;
    filter.range.distance = Distance::DeltaE;
    let error = filter.apply(&other, &[]);
    assert!(matches!(error, Err(FilterError::GuideSize { .. } | FilterError::NoColor { .. })));
    assert_eq!(Strategy::parse("poisson"), None);
}

/// Scratch memory stays below twice the image, for images larger than a few windows.
#[test]
fn scratch_is_small() {
    let image = picture(1400, 1000, &["R", "G", "B"]);
    let size = image.data().len() * 4;
    for (sigma, samples) in [(2.0, 10), (16.0, 10), (32.0, 10)] {
        let mut filter = BilateralFilter::new(sigma, 0.1);
        for regression in [false, true] {
            let samples = SampleCount::Count(samples);
            filter.method = Method::Sampled(Sampling { samples, regression, ..Sampling::default() });
            let pool = rayon::ThreadPoolBuilder::new().num_threads(8).build().unwrap();
            let report = pool.install(|| filter.apply(&image, &[]).unwrap().report);
            assert!(report.scratch_bytes <= 2 * size, "{sigma}: {} of {size}", report.scratch_bytes);
        }
    }
}
