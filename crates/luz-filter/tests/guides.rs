//! Joint filtering by several guides.

mod common;

use common::{picture, psnr};
use luz_filter::{BilateralFilter, Distance, Guide, Method, SampleCount, Sampling};
use luz_image::Image;

/// The definition with any guides, in `f64`, renormalised at the edges.
fn plain(sigma: f32, image: &Image, guides: &[Guide<'_>]) -> Image {
    let r = (2.5 * sigma).ceil() as i64;
    let (w, h, n) = (image.width() as i64, image.height() as i64, image.channel_count());
    let mut out = image.clone();
    for y in 0..h {
        for x in 0..w {
            let (mut sum, mut total) = (vec![0.0; n], 0.0);
            for ny in (y - r).max(0)..=(y + r).min(h - 1) {
                for nx in (x - r).max(0)..=(x + r).min(w - 1) {
                    let square = ((nx - x).pow(2) + (ny - y).pow(2)) as f64;
                    let mut exponent = -0.5 * square / f64::from(sigma).powi(2);
                    for guide in guides {
                        let pair = guide
                            .image
                            .pixel(x as usize, y as usize)
                            .iter()
                            .zip(guide.image.pixel(nx as usize, ny as usize));
                        let differences = pair.map(|(a, b)| f64::from(*a) - f64::from(*b));
                        let distance = match guide.range.distance {
                            Distance::L1 => differences.map(f64::abs).sum::<f64>(),
                            _ => differences.map(|d| d * d).sum::<f64>().sqrt(),
                        };
                        let width = guide.widths.map_or(guide.range.sigma, |w| w.pixel(x as usize, y as usize)[0]);
                        exponent -= 0.5 * (distance / f64::from(width)).powi(2);
                    }
                    let weight = exponent.exp();
                    total += weight;
                    let pixel = image.pixel(nx as usize, ny as usize);
                    sum.iter_mut().zip(pixel).for_each(|(s, &v)| *s += weight * f64::from(v));
                }
            }
            let to = out.pixel_mut(x as usize, y as usize);
            to.iter_mut().zip(&sum).for_each(|(to, s)| *to = (s / total) as f32);
        }
    }
    out
}

#[test]
fn several_guides_with_widths_of_their_own() {
    let image = picture(44, 31, &["R", "G", "B"]);
    let normals = picture(31, 44, &["X", "Y", "Z"]);
    let normals = {
        let mut turned = Image::new(44, 31, ["X", "Y", "Z"]).unwrap();
        for y in 0..31 {
            (0..44).for_each(|x| turned.pixel_mut(x, y).copy_from_slice(normals.pixel(y, x)));
        }
        turned
    };
    let depth = picture(44, 31, &["Z"]);
    let mut widths = depth.clone();
    widths.data_mut().iter_mut().enumerate().for_each(|(i, v)| *v = 0.05 + 0.3 * (i % 7) as f32 / 7.0);
    let mut by_normal = Guide::new(&normals, 0.3);
    by_normal.range.distance = Distance::L1;
    let by_depth = Guide { widths: Some(&widths), ..Guide::new(&depth, 0.2) };
    let mut filter = BilateralFilter::new(2.0, 1.0);
    filter.border = luz_filter::Border::Renormalize;
    for guides in [&[by_normal][..], &[by_depth], &[by_normal, by_depth, Guide::new(&image, 0.2)]] {
        let expected = plain(2.0, &image, guides);
        filter.method = Method::Exact;
        let agreement = psnr(&filter.apply(&image, guides).unwrap().image, &expected);
        assert!(agreement > 120.0, "{agreement}");
        let sampling = Sampling { samples: SampleCount::Count(3000), ..Sampling::default() };
        filter.method = Method::Sampled(sampling);
        let agreement = psnr(&filter.apply(&image, guides).unwrap().image, &expected);
        assert!(agreement > 45.0, "{agreement}");
    }
}

#[test]
fn a_single_channel_guides_many() {
    let image = picture(90, 70, &["R", "G", "B"]);
    let guide = picture(90, 70, &["Y"]);
    let guides = [Guide::new(&guide, 0.1)];
    let mut filter = BilateralFilter::new(4.0, 1.0);
    let exact = filter.apply(&image, &guides).unwrap().image;
    filter.method = Method::Cosines { quality: 60.0 };
    assert!(psnr(&filter.apply(&image, &guides).unwrap().image, &exact) > 60.0);
    filter.method = Method::Auto { quality: 50.0 };
    assert!(psnr(&filter.apply(&image, &guides).unwrap().image, &exact) > 50.0);
}

/// The image as a guide is the image alone.
#[test]
fn the_image_can_be_named_as_a_guide() {
    let image = picture(40, 30, &["R", "G", "B"]);
    let filter = BilateralFilter::new(2.0, 0.1);
    let alone = filter.apply(&image, &[]).unwrap().image;
    assert!(psnr(&filter.apply(&image, &[Guide::new(&image, 0.1)]).unwrap().image, &alone) > 120.0);
}
