//! Scenes to shoot rays into, made by rule.

use std::f32::consts::{PI, TAU};

use glam::Vec3;
use luz_geometry::TriangleMesh;

fn hash(mut x: u32) -> f32 {
    x = (x ^ 61 ^ (x >> 16)).wrapping_mul(9);
    x = (x ^ (x >> 4)).wrapping_mul(0x27d4_eb2d);
    ((x ^ (x >> 15)) >> 8) as f32 / (1 << 24) as f32
}

/// A grid of `columns × rows` quads cut in two.
fn grid(mesh: &mut TriangleMesh, columns: u32, rows: u32, point: impl Fn(f32, f32) -> Vec3) {
    let first = mesh.positions.len() as u32;
    for j in 0..=rows {
        for i in 0..=columns {
            mesh.positions.push(point(i as f32 / columns as f32, j as f32 / rows as f32));
        }
    }
    for j in 0..rows {
        for i in 0..columns {
            let a = first + j * (columns + 1) + i;
            let (b, c, d) = (a + 1, a + columns + 1, a + columns + 2);
            mesh.indices.push([a, b, d]);
            mesh.indices.push([a, d, c]);
        }
    }
}

fn boxy(mesh: &mut TriangleMesh, min: Vec3, max: Vec3, cuts: u32) {
    let size = max - min;
    for axis in 0..3 {
        for side in [0.0, 1.0] {
            grid(mesh, cuts, cuts, |u, v| {
                let mut p = Vec3::ZERO;
                p[axis] = side;
                p[(axis + 1) % 3] = u;
                p[(axis + 2) % 3] = v;
                min + p * size
            });
        }
    }
}

fn ball(mesh: &mut TriangleMesh, center: Vec3, radius: f32, n: u32, shape: impl Fn(f32, f32) -> f32) {
    grid(mesh, 2 * n, n, |u, v| {
        let (theta, phi) = (PI * v, TAU * u);
        let direction = Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
        center + direction * radius * shape(theta, phi)
    });
}

/// A sphere of a million triangles, wrinkled at several scales, in a room of twelve.
pub fn displaced_sphere() -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    boxy(&mut mesh, Vec3::splat(-2.0), Vec3::splat(2.0), 1);
    ball(&mut mesh, Vec3::ZERO, 1.0, 500, |theta, phi| {
        1.0 + 0.08 * (6.0 * theta).sin() * (5.0 * phi).cos()
            + 0.03 * (31.0 * theta).cos() * (23.0 * phi).sin()
            + 0.006 * (160.0 * theta).sin() * (140.0 * phi).cos()
    });
    mesh
}

/// A hall with columns, tables, chairs, vases and shelves of books: large and small triangles, long thin ones too.
pub fn interior() -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    boxy(&mut mesh, Vec3::new(-2.0, -2.0, -2.0), Vec3::new(2.0, 2.0, 2.0), 4);
    for i in 0..12u32 {
        let (x, y) = (-1.6 + 0.64 * (i % 6) as f32, if i < 6 { -1.4 } else { 1.4 });
        grid(&mut mesh, 48, 12, |u, v| {
            let flute = 0.09 + 0.01 * (12.0 * TAU * u).cos() - 0.02 * (PI * v).sin();
            Vec3::new(x + flute * (TAU * u).cos(), y + flute * (TAU * u).sin(), -2.0 + 4.0 * v)
        });
    }
    for i in 0..9u32 {
        let at = Vec3::new(-1.2 + 1.2 * (i % 3) as f32, -0.9 + 0.9 * (i / 3) as f32, -2.0);
        boxy(&mut mesh, at + Vec3::new(-0.3, -0.2, 0.7), at + Vec3::new(0.3, 0.2, 0.74), 2);
        for leg in 0..4u32 {
            let foot =
                at + Vec3::new(if leg & 1 == 0 { -0.27 } else { 0.25 }, if leg & 2 == 0 { -0.17 } else { 0.15 }, 0.0);
            boxy(&mut mesh, foot, foot + Vec3::new(0.02, 0.02, 0.7), 1);
        }
        let vase = at + Vec3::new(0.2 * (hash(i) - 0.5), 0.0, 0.74);
        grid(&mut mesh, 64, 32, |u, v| {
            let r = 0.05 + 0.03 * (5.0 * v).sin() + 0.003 * (20.0 * TAU * u).sin();
            vase + Vec3::new(r * (TAU * u).cos(), r * (TAU * u).sin(), 0.25 * v)
        });
        for k in 0..4u32 {
            let seed = 100 * i + k;
            let center = at + Vec3::new(0.5 * (hash(seed) - 0.5), 0.3 * (hash(seed + 7) - 0.5), 0.78);
            ball(&mut mesh, center, 0.04, 10, |_, _| 1.0);
        }
    }
    for shelf in 0..6u32 {
        let z = -1.8 + 0.5 * shelf as f32;
        boxy(&mut mesh, Vec3::new(1.7, -1.2, z - 0.02), Vec3::new(2.0, 1.2, z), 1);
        for book in 0..60u32 {
            let seed = 1000 * shelf + 3 * book;
            let y = -1.18 + 0.039 * book as f32;
            let height = 0.2 + 0.15 * hash(seed);
            let depth = 0.15 + 0.1 * hash(seed + 1);
            boxy(&mut mesh, Vec3::new(1.98 - depth, y, z), Vec3::new(1.98, y + 0.03, z + height), 1);
        }
    }
    for i in 0..40u32 {
        let center = Vec3::new(3.4 * (hash(i + 5000) - 0.5), 3.4 * (hash(i + 6000) - 0.5), 1.2 + 0.6 * hash(i + 7000));
        ball(&mut mesh, center, 0.05 + 0.05 * hash(i + 8000), 18, |theta, phi| {
            1.0 + 0.1 * (7.0 * theta).sin() * (6.0 * phi).sin()
        });
    }
    mesh
}
