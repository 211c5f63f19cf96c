//! Time per dimension of the samplers, and per sample of warps and distributions.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{Vec2, Vec3};
use luz_sample::distribution::{Discrete, PiecewiseConstant2D};
use luz_sample::random::Random;
use luz_sample::{Sampler, SamplerConfig, SamplerKind, Samples, warp};

/// A path of eight vertices with five dimensions each: 1D, 2D, 2D.
fn path(samples: &mut impl Samples) -> f32 {
    (0..8).map(|_| samples.next_1d() + samples.next_2d().element_sum() + samples.next_2d().element_sum()).sum()
}

fn samplers(c: &mut Criterion) {
    let mut group = c.benchmark_group("dimension");
    // Paths of 40 dimensions, their set-up included.
    group.throughput(Throughput::Elements(40));
    for kind in SamplerKind::ALL {
        let config = SamplerConfig { samples_per_pixel: 64, resolution: [1024, 1024], seed: 7 };
        let sampler = Sampler::new(black_box(kind), config);
        let mut i = 0u32;
        group.bench_function(BenchmarkId::from_parameter(kind), |b| {
            b.iter(|| {
                i = i.wrapping_add(1);
                path(&mut sampler.samples([i >> 6 & 1023, i >> 16], i & 63))
            })
        });
    }
    let mut i = 0;
    group.bench_function("random", |b| {
        b.iter(|| {
            i += 1;
            path(&mut Random::new(1, 2, i))
        })
    });
    group.finish();
}

fn each<T>(c: &mut Criterion, name: &str, mut sample: impl FnMut(Vec2) -> T) {
    let mut random = Random::new(3, 0, 0);
    let points: Vec<Vec2> = (0..1024).map(|_| random.next_2d()).collect();
    let mut i = 0;
    c.bench_function(name, |b| {
        b.iter(|| {
            i = (i + 1) % 1024;
            sample(black_box(points[i]))
        })
    });
}

fn warps(c: &mut Criterion) {
    each(c, "warp/concentric_disk", warp::concentric_disk);
    each(c, "warp/cosine_hemisphere", warp::cosine_hemisphere);
    each(c, "warp/uniform_sphere", warp::uniform_sphere);
    each(c, "warp/box_muller", warp::box_muller);
    each(c, "warp/normal", |u| warp::normal(u.x, 0.0, 1.0));
    let (a, b, d) = (Vec3::new(0.3, 0.1, 1.0), Vec3::new(0.1, 0.9, 1.0), Vec3::new(0.0, -0.2, 1.0));
    each(c, "warp/spherical_triangle/new", |u| warp::SphericalTriangle::new(a + u.extend(0.0), b, d));
    if let Some(triangle) = warp::SphericalTriangle::new(a, b, d) {
        each(c, "warp/spherical_triangle/sample", |u| triangle.sample(u));
    }
    each(c, "warp/spherical_rectangle/new", |u| warp::SphericalRectangle::new(u.extend(2.0), d, Vec3::X, Vec3::Y));
    if let Some(rectangle) = warp::SphericalRectangle::new(a * 2.0, d, Vec3::X, Vec3::Y) {
        each(c, "warp/spherical_rectangle/sample", |u| rectangle.sample(u));
    }
}

fn distributions(c: &mut Criterion) {
    let mut random = Random::new(4, 0, 0);
    let weights: Vec<f32> = (0..1 << 20).map(|_| random.next_1d()).collect();
    if let Ok(alias) = Discrete::new(&weights[..1000]) {
        each(c, "distribution/discrete/1000", |u| alias.sample(u.x));
    }
    if let Ok(map) = PiecewiseConstant2D::new(&weights, [1024, 1024]) {
        each(c, "distribution/2d/1024x1024", |u| map.sample(u));
    }
}

criterion_group!(benches, samplers, warps, distributions);
criterion_main!(benches);
