//! The spectral work of one path: drawing wavelengths, evaluating spectra, and the sensor.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use luz_color::{RgbColorSpace, SampledSpectrum, Sensor, Spectrum, Wavelengths, named_spectrum};

fn spectra(c: &mut Criterion) {
    let space = RgbColorSpace::srgb();
    let w = Wavelengths::sample_visible(0.3);
    let mut group = c.benchmark_group("spectra");
    group.bench_function("sample visible wavelengths", |b| b.iter(|| Wavelengths::sample_visible(black_box(0.3))));
    let named = |name| named_spectrum(name).unwrap_or(Spectrum::Constant(1.0));
    for (name, spectrum) in [
        ("albedo", Spectrum::rgb_albedo(space, [0.6, 0.1, 0.2])),
        ("illuminant", Spectrum::rgb_illuminant(space, [17.0, 12.0, 4.0])),
        ("dense", Spectrum::Dense(named("stdillum-D65").to_dense().into())),
        ("piecewise linear", named("metal-Au-eta")),
        ("black body", Spectrum::blackbody(3000.0)),
    ] {
        group.bench_function(format!("sample {name}"), |b| b.iter(|| spectrum.sample(black_box(&w))));
    }
    let sensor = Sensor::cie1931(space);
    let radiance = SampledSpectrum::splat(0.7);
    group.bench_function("sensor", |b| b.iter(|| sensor.to_output_rgb(black_box(radiance), black_box(&w))));
    group.bench_function("fit a colour", |b| b.iter(|| space.to_sigmoid(black_box([0.6, 0.1, 0.2]))));
    let table = space.sigmoid_table();
    group.bench_function("look a colour up", |b| b.iter(|| table.lookup(black_box([0.6, 0.1, 0.2]))));
    group.finish();
}

criterion_group!(benches, spectra);
criterion_main!(benches);
