//! Fixed points, symmetries, and independence of threads.

mod common;

use common::{picture, psnr};
use luz_filter::{Alpha, BilateralFilter, Border, Distance, Guide, Method, Precision, Sampling, Scale, Strategy};
use luz_image::Image;

const BORDERS: [Border; 3] = [Border::Mirror, Border::Clamp, Border::Renormalize];

fn methods() -> Vec<Method> {
    let mut methods = vec![Method::Exact, Method::Auto { quality: 50.0 }];
    for strategy in Strategy::ALL {
        for precision in [Precision::Full, Precision::Fast, Precision::Half] {
            methods.push(Method::Sampled(Sampling { strategy, precision, ..Sampling::default() }));
        }
    }
    methods
}

#[test]
fn constants_stay() {
    let value = [0.3f32, 7.0, 1e-3];
    let image = Image::from_data(40, 30, ["R", "G", "B"], value.repeat(1200)).unwrap();
    for method in methods() {
        for border in BORDERS {
            let mut filter = BilateralFilter::new(3.0, 0.1);
            (filter.method, filter.border) = (method, border);
            let filtered = filter.apply(&image, &[]).unwrap().image;
            for (a, b) in filtered.data().iter().zip(image.data()) {
                assert!((a - b).abs() <= 2.0 * f32::EPSILON * b, "{method:?} {border:?}: {a} {b}");
            }
        }
    }
}

#[test]
fn a_vanishing_range_is_the_identity() {
    let image = picture(50, 40, &["R", "G", "B"]);
    for method in methods() {
        let mut filter = BilateralFilter::new(3.0, 1e-6);
        filter.method = method;
        assert!(psnr(&filter.apply(&image, &[]).unwrap().image, &image) > 120.0, "{method:?}");
    }
}

/// A separable Gaussian over the window, mirrored.
fn blur(image: &Image, sigma: f64) -> Image {
    let r = (2.5 * sigma).ceil() as i64;
    let weight = |i: i64| (-0.5 * (i as f64 / sigma).powi(2)).exp();
    let total: f64 = (-r..=r).map(weight).sum();
    let at = |i: i64, n: usize| Border::Mirror.map(i, n).unwrap();
    let (w, h, n) = (image.width(), image.height(), image.channel_count());
    let mut out = image.clone();
    for x in 0..w {
        for y in 0..h {
            for c in 0..n {
                let mut sum = 0.0;
                for j in -r..=r {
                    let row = at(y as i64 + j, h);
                    for i in -r..=r {
                        sum += weight(i) * weight(j) * f64::from(image.pixel(at(x as i64 + i, w), row)[c]);
                    }
                }
                out.pixel_mut(x, y)[c] = (sum / total / total) as f32;
            }
        }
    }
    out
}

#[test]
fn an_infinite_range_is_a_gaussian_blur() {
    let image = picture(48, 40, &["R", "G", "B"]);
    let blurred = blur(&image, 2.0);
    for sigma in [1e5, 1e7, f32::INFINITY] {
        let mut filter = BilateralFilter::new(2.0, sigma);
        assert!(psnr(&filter.apply(&image, &[]).unwrap().image, &blurred) > 110.0, "{sigma}");
        filter.method =
            Method::Sampled(Sampling { samples: luz_filter::SampleCount::Count(3000), ..Sampling::default() });
        assert!(psnr(&filter.apply(&image, &[]).unwrap().image, &blurred) > 55.0, "{sigma}");
    }
    let grey = image.select(&["G"]).unwrap();
    let mut filter = BilateralFilter::new(2.0, 1e4);
    filter.method = Method::Cosines { quality: 90.0 };
    assert!(psnr(&filter.apply(&grey, &[]).unwrap().image, &blurred.select(&["G"]).unwrap()) > 90.0);
}

fn moved(image: &Image, size: [usize; 2], from: impl Fn(usize, usize) -> (usize, usize)) -> Image {
    let mut out = Image::new(size[0], size[1], image.channels().iter().cloned()).unwrap();
    for y in 0..size[1] {
        for x in 0..size[0] {
            let (fx, fy) = from(x, y);
            out.pixel_mut(x, y).copy_from_slice(image.pixel(fx, fy));
        }
    }
    out
}

/// The exact filter commutes with flips, transposition and permutations of channels but for rounding; a sampled one but for
/// its error.
#[test]
fn symmetries() {
    let image = picture(53, 37, &["R", "G", "B"]);
    let (w, h) = (53, 37);
    let flip = |i: &Image| moved(i, [w, h], |x, y| (w - 1 - x, y));
    let flop = |i: &Image| moved(i, [w, h], |x, y| (x, h - 1 - y));
    let transpose = |i: &Image| moved(i, [h, w], |x, y| (y, x));
    let permute = |i: &Image| i.select(&["B", "R", "G"]).unwrap();
    let changes: [&dyn Fn(&Image) -> Image; 4] = [&flip, &flop, &transpose, &permute];
    for border in BORDERS {
        let mut filter = BilateralFilter::new(2.0, 0.1);
        filter.border = border;
        let exact = filter.apply(&image, &[]).unwrap().image;
        for (i, change) in changes.iter().enumerate() {
            filter.method = Method::Exact;
            let agreement = psnr(&filter.apply(&change(&image), &[]).unwrap().image, &change(&exact));
            assert!(agreement > 120.0, "{border:?} {i}: {agreement}");
            filter.method = Method::Sampled(Sampling::default());
            let error = psnr(&filter.apply(&image, &[]).unwrap().image, &exact);
            let changed = psnr(&filter.apply(&change(&image), &[]).unwrap().image, &change(&exact));
            assert!((changed - error).abs() < 1.0, "{border:?} {i}: {changed} {error}");
        }
    }
}

#[test]
fn threads_change_no_bit() {
    let image = picture(600, 300, &["R", "G", "B"]);
    let grey = image.select(&["G"]).unwrap();
    let mut cases: Vec<(&Image, Method)> = vec![(&grey, Method::Cosines { quality: 50.0 })];
    let regression = Method::Sampled(Sampling { regression: true, ..Sampling::default() });
    for method in [Method::Exact, Method::Sampled(Sampling::default()), regression, Method::Auto { quality: 45.0 }] {
        cases.push((&image, method));
    }
    for (image, method) in cases {
        let mut filter = BilateralFilter::new(2.0, 0.1);
        filter.method = method;
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| filter.apply(image, &[]).unwrap().image)
        };
        let one = with(1);
        assert!([2, 3, 7].into_iter().all(|threads| with(threads).data() == one.data()), "{method:?}");
    }
}

/// Seeds choose other samples.
#[test]
fn seeds_matter() {
    let image = picture(64, 64, &["Y"]);
    for strategy in Strategy::ALL {
        let mut filter = BilateralFilter::new(4.0, 0.1);
        filter.method = Method::Sampled(Sampling { strategy, ..Sampling::default() });
        let one = filter.apply(&image, &[]).unwrap().image;
        assert_eq!(filter.apply(&image, &[]).unwrap().image, one);
        filter.seed = 1;
        assert_ne!(filter.apply(&image, &[]).unwrap().image, one, "{strategy:?}");
    }
}

/// What can't be seen bleeds no colour, and doesn't change itself.
#[test]
fn opacity_is_respected() {
    let mut image = Image::new(24, 24, ["R", "G", "B", "A"]).unwrap();
    for y in 0..24 {
        for x in 0..24 {
            let hidden = x >= 12;
            let color = if hidden { [0.0, 5.0, 0.0, 0.0] } else { [0.5, 0.4, 0.3, 1.0] };
            image.pixel_mut(x, y).copy_from_slice(&color);
        }
    }
    for sigma_range in [0.1, 100.0] {
        for method in [Method::Exact, Method::Sampled(Sampling::default())] {
            let mut filter = BilateralFilter::new(2.0, sigma_range);
            (filter.alpha, filter.method) = (Alpha::Straight, method);
            let filtered = filter.apply(&image, &[]).unwrap().image;
            for y in 0..24 {
                for x in 0..24 {
                    let [r, g, b, a] = filtered.pixel(x, y) else { unreachable!() };
                    if *a > 1e-3 {
                        let close = |v: f32, w: f32| (v - w).abs() < 1e-3;
                        assert!(close(*r, 0.5) && close(*g, 0.4) && close(*b, 0.3), "{x} {y}: {r} {g} {b} {a}");
                    }
                }
            }
            assert_eq!(filtered.pixel(23, 5)[1], 5.0);
        }
    }
    // Premultiplied colours give the same picture.
    let mut premultiplied = image.clone();
    premultiplied.data_mut().chunks_exact_mut(4).for_each(|p| (0..3).for_each(|c| p[c] *= p[3]));
    let mut filter = BilateralFilter::new(2.0, 1.0);
    filter.alpha = Alpha::Premultiplied;
    let a = filter.apply(&premultiplied, &[]).unwrap().image;
    filter.alpha = Alpha::Straight;
    let mut b = filter.apply(&image, &[]).unwrap().image;
    b.data_mut().chunks_exact_mut(4).for_each(|p| (0..3).for_each(|c| p[c] *= p[3]));
    assert!(psnr(&a, &b) > 120.0);
}

/// A filter on another scale is the filter of the image on that scale.
#[test]
fn scales() {
    let image = picture(40, 30, &["R", "G", "B"]);
    for scale in [Scale::Encoded, Scale::Log] {
        let mut filter = BilateralFilter::new(2.0, 0.1);
        (filter.range.scale, filter.mean_scale) = (scale, scale);
        let filtered = filter.apply(&image, &[]).unwrap().image;
        let map = |image: &Image, f: &dyn Fn(f32) -> f32| {
            let mut image = image.clone();
            image.data_mut().iter_mut().for_each(|v| *v = f(*v));
            image
        };
        let plain = BilateralFilter::new(2.0, 0.1);
        let expected = plain.apply(&map(&image, &|v| scale.forward(v)), &[]).unwrap().image;
        assert!(psnr(&filtered, &map(&expected, &|v| scale.backward(v))) > 110.0, "{scale:?}");
        // Distances on one scale, means on another.
        filter.mean_scale = Scale::Linear;
        let mixed = filter.apply(&image, &[]).unwrap().image;
        let guide = map(&image, &|v| scale.forward(v));
        let expected = plain.apply(&image, &[Guide::new(&guide, 0.1)]).unwrap().image;
        assert!(psnr(&mixed, &expected) > 110.0, "{scale:?}");
    }
}

/// ΔE is the L2 distance of CIELAB.
#[test]
fn delta_e_is_the_distance_in_lab() {
    let image = picture(40, 30, &["R", "G", "B"]);
    let mut lab = image.clone();
    let matrix =
        [[0.4124564f32, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]];
    let xyz = |rgb: &[f32]| matrix.map(|row| row[0] * rgb[0] + row[1] * rgb[1] + row[2] * rgb[2]);
    for pixel in lab.data_mut().chunks_exact_mut(3) {
        let color = luz_color::lab::xyz_to_lab(xyz(pixel), xyz(&[1.0; 3]));
        pixel.copy_from_slice(&color);
    }
    let mut filter = BilateralFilter::new(2.0, 7.0);
    let expected = filter.apply(&image, &[Guide::new(&lab, 7.0)]).unwrap().image;
    filter.range.distance = Distance::DeltaE;
    assert!(psnr(&filter.apply(&image, &[]).unwrap().image, &expected) > 110.0);
}
