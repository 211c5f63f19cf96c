//! The filter's definition, as plain as it gets, and images to try it on.
#![allow(dead_code)] // Not every test needs everything.

use luz_filter::{BilateralFilter, Border};
use luz_image::Image;

/// An image with smooth parts, edges and texture, in `[0, 1]`.
pub fn picture(width: usize, height: usize, channels: &[&str]) -> Image {
    let n = channels.len();
    let mut data = Vec::new();
    for y in 0..height {
        for x in 0..width {
            for c in 0..n {
                let (fx, fy, fc) = (x as f32, y as f32, c as f32);
                let smooth = 0.4 + 0.2 * (fx * 0.05 + fc).sin() * (fy * 0.07 - fc).cos();
                let edge = if fx + 0.6 * fy > 0.7 * width as f32 { 0.3 } else { 0.0 };
                let texture = 0.04 * (fx * 1.9 + fc * 0.7).sin() * (fy * 2.3).sin();
                let bits = (x * 7919 + y * 104_729 + c * 1_299_709) as u32;
                let noise = (bits.wrapping_mul(2_654_435_761) >> 16) as f32 / 65536.0 - 0.5;
                data.push(smooth + edge + texture + 0.06 * noise);
            }
        }
    }
    Image::from_data(width, height, channels.iter().copied(), data).unwrap()
}

/// The definition for L2 distances, in `f64`, of finite images without opacity.
pub fn plain(filter: &BilateralFilter, image: &Image) -> Image {
    let r = filter.radius() as i64;
    let (sigma_s, sigma_r) = (f64::from(filter.sigma_spatial), f64::from(filter.range.sigma));
    let (width, height, n) = (image.width(), image.height(), image.channel_count());
    let mut out = Vec::new();
    for y in 0..height as i64 {
        for x in 0..width as i64 {
            let centre = image.pixel(x as usize, y as usize);
            let (mut sum, mut total) = (vec![0.0; n], 0.0);
            for dy in -r..=r {
                for dx in -r..=r {
                    let place = (border(filter.border, x + dx, width), border(filter.border, y + dy, height));
                    let (Some(px), Some(py)) = place else { continue };
                    let pixel = image.pixel(px, py);
                    let d2: f64 = pixel.iter().zip(centre).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum();
                    let s2 = (dx * dx + dy * dy) as f64;
                    let w = (-0.5 * s2 / (sigma_s * sigma_s) - 0.5 * d2 / (sigma_r * sigma_r)).exp();
                    total += w;
                    sum.iter_mut().zip(pixel).for_each(|(s, &v)| *s += w * f64::from(v));
                }
            }
            out.extend(sum.iter().map(|s| (s / total) as f32));
        }
    }
    Image::from_data(width, height, image.channels().iter().cloned(), out).unwrap()
}

fn border(border: Border, i: i64, size: usize) -> Option<usize> {
    let n = size as i64;
    match border {
        Border::Clamp => Some(i.clamp(0, n - 1) as usize),
        Border::Renormalize => (0..n).contains(&i).then_some(i as usize),
        Border::Mirror => {
            let mut i = i;
            while n > 1 && !(0..n).contains(&i) {
                i = if i < 0 { -i } else { 2 * (n - 1) - i };
            }
            Some(if n == 1 { 0 } else { i as usize })
        }
    }
}

/// Peak signal-to-noise ratio in dB for a peak of 1, over all channels.
pub fn psnr(a: &Image, b: &Image) -> f64 {
    assert_eq!((a.width(), a.height(), a.channels()), (b.width(), b.height(), b.channels()));
    let squares: f64 = a.data().iter().zip(b.data()).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum();
    -10.0 * (squares / a.data().len() as f64).log10()
}
