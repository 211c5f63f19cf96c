//! Paths per second of each scene in `scenes/`, and what loading one costs.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec2;
use luz_geometry::SimdLevel;
use luz_render::film::Filter;
use luz_render::world::build;
use luz_render::{Overrides, Renderer};
use luz_scene::Diagnostics;
use std::path::PathBuf;

fn scenes() -> Vec<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let mut scenes: Vec<PathBuf> = std::fs::read_dir(folder)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|e| e == "pbrt"))
        .collect();
    scenes.sort();
    scenes
}

fn wishes() -> Overrides {
    Overrides {
        resolution: Some([128, 128]),
        samples_per_pixel: Some(4),
        filter: Some(Filter::new(luz_render::film::FilterKind::Box, Vec2::splat(0.5))),
        ..Overrides::default()
    }
}

fn paths(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("paths");
    group.sample_size(10);
    for scene in scenes() {
        let Ok((description, _)) = luz_scene::read(&scene) else { continue };
        let Some(loaded) = build(&description, &wishes(), SimdLevel::Auto, &mut Diagnostics::default()) else {
            continue;
        };
        group.throughput(Throughput::Elements(128 * 128 * 4));
        let name = scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        group.bench_function(BenchmarkId::from_parameter(name), |bencher| {
            bencher.iter(|| {
                let mut renderer = Renderer::new(&loaded.world, &loaded.camera, &loaded.settings);
                renderer.pass(4);
                renderer.cost().rays
            });
        });
    }
    group.finish();
}

fn loading(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("load");
    group.sample_size(10);
    for scene in scenes() {
        let name = scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        group.bench_function(BenchmarkId::from_parameter(name), |bencher| {
            bencher.iter(|| {
                let read = luz_scene::read(&scene);
                read.ok().and_then(|(d, _)| build(&d, &wishes(), SimdLevel::Auto, &mut Diagnostics::default()))
            });
        });
    }
    group.finish();
}

criterion_group!(benches, paths, loading);
criterion_main!(benches);
