//! How fast scenes and meshes are read: bytes per second of text, faces per second of meshes, from memory.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use luz_scene::ReadOptions;
use std::fmt::Write;
use std::hint::black_box;
use std::path::Path;

/// A grid of `n × n` vertices, displaced; two triangles per cell.
fn grid(n: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let vertex = |i: u32| {
        let (x, y) = ((i % n) as f32 / n as f32, (i / n) as f32 / n as f32);
        [x, y, (40.0 * x).sin() * (30.0 * y).cos() * 0.01]
    };
    let cells = (0..n - 1).flat_map(|y| (0..n - 1).map(move |x| y * n + x));
    let triangles = cells.flat_map(|a| [[a, a + 1, a + n], [a + 1, a + n + 1, a + n]]);
    ((0..n * n).map(vertex).collect(), triangles.collect())
}

fn ply(n: u32, format: &str) -> Vec<u8> {
    let (vertices, triangles) = grid(n);
    let mut out = format!(
        "ply\nformat {format} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
        element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        vertices.len(),
        triangles.len()
    )
    .into_bytes();
    match format {
        "ascii" => {
            let mut text = String::new();
            vertices.iter().for_each(|[x, y, z]| writeln!(text, "{x} {y} {z}").unwrap());
            triangles.iter().for_each(|[a, b, c]| writeln!(text, "3 {a} {b} {c}").unwrap());
            out.extend(text.bytes());
        }
        "binary_big_endian" => {
            vertices.iter().flatten().for_each(|x| out.extend(x.to_be_bytes()));
            for triangle in &triangles {
                out.push(3);
                triangle.iter().for_each(|i| out.extend(i.to_be_bytes()));
            }
        }
        _ => {
            vertices.iter().flatten().for_each(|x| out.extend(x.to_le_bytes()));
            for triangle in &triangles {
                out.push(3);
                triangle.iter().for_each(|i| out.extend(i.to_le_bytes()));
            }
        }
    }
    out
}

/// A scene with one big mesh.
fn mesh_scene(n: u32) -> String {
    let (vertices, triangles) = grid(n);
    let mut text = "WorldBegin\nShape \"trianglemesh\"\n  \"point3 P\" [\n".to_owned();
    vertices.iter().for_each(|[x, y, z]| writeln!(text, "    {x} {y} {z}").unwrap());
    text += "  ]\n  \"integer indices\" [\n";
    triangles.iter().for_each(|[a, b, c]| writeln!(text, "    {a} {b} {c}").unwrap());
    text + "  ]\n"
}

/// A scene with many small things.
fn small_scene(count: usize) -> String {
    let mut text = "WorldBegin\n".to_owned();
    for i in 0..count {
        let x = i as f32 * 0.37;
        writeln!(
            text,
            "AttributeBegin\n  Translate {x} 1.5 -{x}\n  Material \"coateddiffuse\" \"rgb reflectance\" [ 0.{i} 0.5 0.25 ] \
             \"float roughness\" [ 0.02 ]\n  Shape \"sphere\" \"float radius\" [ 0.5 ]\nAttributeEnd"
        )
        .unwrap();
    }
    text
}

fn read(text: &str) {
    let scene = luz_scene::read_bytes("scene", text.as_bytes().to_vec(), Path::new(""), &ReadOptions::default());
    black_box(scene.is_ok());
}

fn scenes(c: &mut Criterion) {
    let mut group = c.benchmark_group("scene");
    group.sample_size(10);
    for (name, text) in [("one mesh of 2 M triangles", mesh_scene(1000)), ("100 k spheres", small_scene(100_000))] {
        group.throughput(Throughput::Bytes(text.len() as u64));
        group.bench_function(name, |b| b.iter(|| read(&text)));
    }
    group.finish();
}

fn meshes(c: &mut Criterion) {
    let mut group = c.benchmark_group("ply");
    group.sample_size(10);
    for (format, n) in [("binary_little_endian", 2237), ("binary_big_endian", 2237), ("ascii", 708)] {
        let bytes = ply(n, format);
        let faces = 2 * u64::from(n - 1) * u64::from(n - 1);
        let name = format!("{format}, {faces} triangles, {} MB", bytes.len() / 1_000_000);
        group.throughput(Throughput::Elements(faces));
        group.bench_function(name, |b| b.iter(|| black_box(luz_scene::ply::parse(&bytes).is_ok())));
    }
    group.finish();
    // From disk (in fact: from the page cache).
    let path = std::env::temp_dir().join(format!("luz-bench-{}.ply", std::process::id()));
    let bytes = ply(2237, "binary_little_endian");
    std::fs::write(&path, &bytes).unwrap();
    let mut group = c.benchmark_group("file");
    group.sample_size(10);
    group.throughput(Throughput::Bytes(bytes.len() as u64));
    group.bench_function("read and parse a binary mesh", |b| b.iter(|| black_box(luz_scene::ply::read(&path).is_ok())));
    group.bench_function("only read it", |b| b.iter(|| black_box(std::fs::read(&path).is_ok())));
    group.finish();
    std::fs::remove_file(&path).unwrap();
}

criterion_group!(benches, scenes, meshes);
criterion_main!(benches);
