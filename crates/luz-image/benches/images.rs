//! Files and metrics of a picture of half a megapixel.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use luz_image::metrics::{CompareOptions, compare};
use luz_image::{Format, Image, ImageError, MipFilter, ReadOptions, WrapMode, WriteOptions};

fn picture() -> Result<Image, ImageError> {
    let (width, height) = (960, 540);
    let data = (0..width * height * 3).map(|i| (i as f32 * 0.013).sin().abs()).collect();
    Image::from_data(width, height, ["R", "G", "B"], data)
}

fn images(c: &mut Criterion) {
    let Ok(image) = picture() else { return };
    let mut group = c.benchmark_group("images");
    group.sample_size(10);
    for format in [Format::Exr, Format::Png, Format::Pfm] {
        group.bench_function(format!("encode {format}"), |b| {
            b.iter(|| image.encode(format, &WriteOptions::default()).map(|file| file.len()));
        });
        let Ok(file) = image.encode(format, &WriteOptions::default()) else { continue };
        group.bench_function(format!("decode {format}"), |b| {
            b.iter(|| Image::decode(black_box(&file), None, &ReadOptions::default()).map(|image| image.width()));
        });
    }
    group.bench_function("compare", |b| b.iter(|| compare(&image, black_box(&image), &CompareOptions::default())));
    group.bench_function("halve", |b| b.iter(|| black_box(&image).resize_half(MipFilter::Box, WrapMode::Repeat)));
    group.finish();
}

criterion_group!(benches, images);
criterion_main!(benches);
