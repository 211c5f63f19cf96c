//! No ray escapes from a closed mesh, through edges and vertices neither.

mod common;

use common::{LEVELS, Random, accelerate, bumpy_sphere};
use glam::{Mat4, Vec3};
use luz_geometry::{AcceleratorBuilder, Ray, Shape, SimdLevel, Transform, TriangleMesh};

/// A point of an edge, or a vertex.
fn seam(random: &mut Random, mesh: &TriangleMesh) -> Vec3 {
    let [a, b, _] = mesh.corners(random.below(mesh.indices.len()));
    if random.below(3) == 0 { a } else { a.lerp(b, random.unit()) }
}

fn inside(random: &mut Random) -> Vec3 {
    random.direction() * random.unit() * 0.5
}

#[test]
fn rays_at_edges_and_vertices_do_not_escape() {
    let mut random = Random(3);
    let mesh = bumpy_sphere(60, 0.1);
    for (level, n) in LEVELS.into_iter().zip([100_000, 1_000_000, 1_000_000]) {
        let accelerator = accelerate([Shape::Triangles(mesh.clone())], level);
        for _ in 0..n {
            let origin = inside(&mut random);
            let direction = (seam(&mut random, &mesh) - origin) * (0.01 + random.unit() * 10.0);
            let ray = Ray::new(origin, direction, 0.0);
            assert!(accelerator.closest_hit(&ray).is_some(), "{level:?} {ray:?}");
            if random.below(4) == 0 {
                assert!(accelerator.any_hit(&ray), "{level:?} {ray:?}");
            }
        }
    }
}

#[test]
fn neither_large_nor_small_nor_far_off_meshes_leak() {
    let mut random = Random(4);
    for scale in [1e-12, 1e-6, 1e-3, 1e3, 1e6, 1e12] {
        for shift in [0.0, 1.0, 100.0] {
            let mut mesh = bumpy_sphere(24, 0.1);
            mesh.positions.iter_mut().for_each(|p| *p = (*p + Vec3::new(1.0, -0.7, 0.4) * shift) * scale);
            let center = Vec3::new(1.0, -0.7, 0.4) * shift * scale;
            for level in LEVELS {
                let accelerator = accelerate([Shape::Triangles(mesh.clone())], level);
                for _ in 0..10_000 {
                    let origin = center + inside(&mut random) * scale;
                    let ray = Ray::new(origin, seam(&mut random, &mesh) - origin, 0.0);
                    assert!(accelerator.closest_hit(&ray).is_some(), "{level:?} {scale} {shift} {ray:?}");
                }
            }
        }
    }
}

/// Squashed to slivers, whose edges nearly meet.
#[test]
fn slivers_do_not_leak() {
    let mut random = Random(5);
    for squash in [1e-3, 1e-5] {
        let mut mesh = bumpy_sphere(40, 0.0);
        mesh.positions.iter_mut().for_each(|p| p.x *= squash);
        for level in LEVELS {
            let accelerator = accelerate([Shape::Triangles(mesh.clone())], level);
            for _ in 0..50_000 {
                let mut origin = inside(&mut random);
                origin.x *= squash;
                let ray = Ray::new(origin, seam(&mut random, &mesh) - origin, 0.0);
                assert!(accelerator.closest_hit(&ray).is_some(), "{level:?} {squash} {ray:?}");
            }
        }
    }
}

#[test]
fn rays_along_axes_through_a_lattice_do_not_escape() {
    // Vertices at whole numbers and rays at whole numbers: every test is on a boundary.
    let mut mesh = TriangleMesh::default();
    let n = 8u32;
    for axis in 0..3 {
        for side in [-4.0, 4.0f32] {
            let first = mesh.positions.len() as u32;
            for j in 0..=n {
                for i in 0..=n {
                    let mut p = Vec3::ZERO;
                    p[axis] = side;
                    p[(axis + 1) % 3] = i as f32 - 4.0;
                    p[(axis + 2) % 3] = j as f32 - 4.0;
                    mesh.positions.push(p);
                }
            }
            for j in 0..n {
                for i in 0..n {
                    let a = first + j * (n + 1) + i;
                    mesh.indices.push([a, a + 1, a + n + 2]);
                    mesh.indices.push([a, a + n + 2, a + n + 1]);
                }
            }
        }
    }
    for level in LEVELS {
        let accelerator = accelerate([Shape::Triangles(mesh.clone())], level);
        for x in -3..=3i16 {
            for y in -3..=3i16 {
                for z in -3..=3i16 {
                    let origin = Vec3::new(x.into(), y.into(), z.into());
                    for direction in 0..27i16 {
                        let d = Vec3::new(
                            (direction % 3 - 1).into(),
                            (direction / 3 % 3 - 1).into(),
                            (direction / 9 - 1).into(),
                        );
                        for zero in [0.0, -0.0] {
                            let d = d.map(|c| if c == 0.0 { zero } else { c });
                            if d == Vec3::ZERO {
                                continue;
                            }
                            let hit = accelerator.closest_hit(&Ray::new(origin, d, 0.0));
                            let exact = (0..3)
                                .filter(|&i| d[i] != 0.0)
                                .map(|i| (4.0 * d[i].signum() - origin[i]) / d[i])
                                .fold(f32::INFINITY, f32::min);
                            assert_eq!(hit.map(|h| h.t), Some(exact), "{level:?} {origin} {d}");
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn instances_do_not_leak() {
    let mut random = Random(6);
    let mesh = bumpy_sphere(30, 0.1);
    for _ in 0..10 {
        let turn = glam::Quat::from_axis_angle(random.direction(), random.unit() * 6.0);
        let size = Vec3::new(0.3 + random.unit(), 0.3 + random.unit(), -0.3 - random.unit());
        let placed = Mat4::from_scale_rotation_translation(size, turn, random.cube() * 5.0);
        let transform = Transform::try_from(placed).unwrap();
        let mut builder = AcceleratorBuilder::new();
        builder.simd(SimdLevel::Auto);
        let group = builder.add_group();
        builder.add_shape_to(group, Shape::Triangles(mesh.clone()));
        builder.add_instance(group, transform.into());
        let accelerator = builder.build();
        for _ in 0..30_000 {
            let origin = transform.point(inside(&mut random));
            let ray = Ray::new(origin, transform.point(seam(&mut random, &mesh)) - origin, 0.0);
            assert!(accelerator.closest_hit(&ray).is_some(), "{ray:?}");
        }
    }
}
