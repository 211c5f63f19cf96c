//! Random numbers and meshes for the tests of this crate.
#![allow(dead_code)]

use glam::Vec3;
use luz_geometry::{Accelerator, AcceleratorBuilder, Ray, Shape, SimdLevel, TriangleMesh};

/// SplitMix64.
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u64 << 24) as f32
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    pub fn cube(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.cube();
            if (1e-4..=1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }

    pub fn square(&mut self) -> glam::Vec2 {
        glam::Vec2::new(self.unit(), self.unit())
    }
}

/// Small triangles all over the cube [−1, 1]³.
pub fn soup(random: &mut Random, n: usize, size: f32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for i in 0..n as u32 {
        let c = random.cube();
        for _ in 0..3 {
            mesh.positions.push(c + random.cube() * size);
        }
        mesh.indices.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    mesh
}

/// A closed sphere of `2 n²` quads cut in two, moved in and out by waves.
pub fn bumpy_sphere(n: u32, bumps: f32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let columns = 2 * n;
    let point = |theta: f32, phi: f32| {
        let r = 1.0 + bumps * (9.0 * theta).sin() * (7.0 * phi).cos();
        Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()) * r
    };
    mesh.positions.push(point(0.0, 0.0));
    for i in 1..n {
        for j in 0..columns {
            let (theta, phi) =
                (std::f32::consts::PI * i as f32 / n as f32, std::f32::consts::TAU * j as f32 / columns as f32);
            mesh.positions.push(point(theta, phi));
        }
    }
    mesh.positions.push(Vec3::new(0.0, 0.0, -1.0));
    let last = mesh.positions.len() as u32 - 1;
    let at = |i: u32, j: u32| match i {
        0 => 0,
        i if i == n => last,
        i => 1 + (i - 1) * columns + j % columns,
    };
    for i in 0..n {
        for j in 0..columns {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            if i + 1 < n {
                mesh.indices.push([a, b, c]);
            }
            if i > 0 {
                mesh.indices.push([a, c, d]);
            }
        }
    }
    mesh
}

pub fn accelerate(shapes: impl IntoIterator<Item = Shape>, level: SimdLevel) -> Accelerator {
    let mut builder = AcceleratorBuilder::new();
    builder.simd(level);
    for shape in shapes {
        builder.add_shape(shape);
    }
    builder.build()
}

/// A ray through the cube, sometimes along an axis or a plane.
pub fn random_ray(random: &mut Random) -> Ray {
    let origin = random.cube() * 2.0;
    let mut direction = (random.cube() - origin) * (0.1 + random.unit() * 5.0);
    if random.below(4) == 0 {
        direction[random.below(3)] = 0.0;
    }
    if random.below(8) == 0 {
        direction[random.below(3)] = -0.0;
    }
    if direction == Vec3::ZERO {
        direction = Vec3::X;
    }
    Ray::new(origin, direction, 0.0)
}

pub const LEVELS: [SimdLevel; 3] = [SimdLevel::Scalar, SimdLevel::Avx2, SimdLevel::Avx512];
