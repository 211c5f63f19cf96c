//! Time per dimension of the samplers, per sample of warps and distributions, per weight and per step of a chain.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{Vec2, Vec3};
use luz_sample::distribution::{Discrete, PiecewiseConstant2D};
use luz_sample::markov::{Chain, Kernel, PrimarySample, PrimarySamples, Proposal};
use luz_sample::mis::{Heuristic, Optimal};
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

fn weights(c: &mut Criterion) {
    let heuristics = [Heuristic::Balance, Heuristic::Power(2.0), Heuristic::Power(3.0), Heuristic::Average];
    for heuristic in heuristics {
        each(c, &format!("mis/two/{heuristic}"), |u| black_box(heuristic).weight2(1.0, u.x, 1.0, u.y));
        each(c, &format!("mis/four/{heuristic}"), |u| {
            black_box(heuristic).weight(2, &[(1.0, u.x), (1.0, u.y), (1.0, u.x + u.y), (1.0, 0.5)])
        });
    }
    let mut estimator = Optimal::<2, 3>::new([1, 1]);
    each(c, "mis/optimal round", |u| {
        let (x, y) = (f64::from(u.x) + 0.1, f64::from(u.y) + 0.1);
        estimator.push(0, &[x, y], &[x, y, 1.0]);
        estimator.push(1, &[y, x], &[1.0, x, y]);
        estimator.end_round()
    });
}

fn chains(c: &mut Criterion) {
    let mut group = c.benchmark_group("chain");
    // Paths of 40 dimensions, the step of the chain included.
    group.throughput(Throughput::Elements(40));
    for (name, large_probability) in [("small steps", 0.0), ("large steps", 1.0)] {
        let mut chain = Chain::new(1, 0, PrimarySample::new(), 0.0);
        let mut spare = PrimarySample::new();
        group.bench_function(name, |b| {
            b.iter(|| {
                let step = chain.step(&mut spare, |current, proposed, random| {
                    let mut samples = if random.next_f64() < large_probability {
                        PrimarySamples::large(proposed, random)
                    } else {
                        PrimarySamples::small(current, proposed, Kernel::default(), random)
                    };
                    Some(Proposal::symmetric(f64::from(path(&mut samples))))
                });
                step.proposed_weight
            })
        });
    }
    group.finish();
}

criterion_group!(benches, samplers, warps, distributions, weights, chains);
criterion_main!(benches);
