//! The differential geometry of surfaces, held against finite differences, and the orientation of normals.

mod common;

use std::f32::consts::TAU;

use common::{Random, accelerate};
use glam::{Mat4, Quat, Vec2, Vec3};
use luz_geometry::{
    Accelerator, BilinearMesh, Cylinder, Disk, Ray, Shape, SimdLevel, Sphere, SurfacePoint, Transform, TriangleMesh,
};

fn meet(accelerator: &Accelerator, origin: Vec3, direction: Vec3) -> Option<SurfacePoint> {
    let ray = Ray::new(origin, direction, 0.0);
    accelerator.closest_hit(&ray).map(|hit| accelerator.surface(&ray, &hit))
}

fn shapes(transform: Transform) -> Vec<(&'static str, Shape)> {
    let mut mesh = common::bumpy_sphere(12, 0.05);
    mesh.normals = Some(mesh.positions.iter().map(|p| p.normalize()).collect());
    mesh.uvs = Some(mesh.positions.iter().map(|p| Vec2::new(p.x + 0.3 * p.y, p.y - 0.2 * p.z + 0.1 * p.x)).collect());
    mesh.transform(&transform);
    let mut patch = BilinearMesh {
        positions: vec![
            Vec3::new(-1.0, -1.0, 0.0),
            Vec3::new(1.0, -0.8, 0.3),
            Vec3::new(-0.9, 1.0, 0.2),
            Vec3::new(1.2, 1.0, -0.4),
        ],
        indices: vec![[0, 1, 2, 3]],
        uvs: Some(vec![Vec2::new(0.1, 0.0), Vec2::new(2.0, 0.3), Vec2::new(-0.1, 1.0), Vec2::new(1.5, 1.4)]),
        ..BilinearMesh::default()
    };
    patch.transform(&transform);
    vec![
        ("mesh", Shape::Triangles(mesh)),
        ("patch", Shape::Bilinear(patch)),
        (
            "sphere",
            Shape::Sphere(Sphere {
                transform,
                reverse_orientation: false,
                radius: 0.9,
                z_min: -0.5,
                z_max: 0.8,
                phi_max: 5.0,
            }),
        ),
        (
            "disk",
            Shape::Disk(Disk {
                transform,
                reverse_orientation: false,
                height: 0.2,
                radius: 1.0,
                inner_radius: 0.1,
                phi_max: 5.0,
            }),
        ),
        (
            "cylinder",
            Shape::Cylinder(Cylinder {
                transform,
                reverse_orientation: false,
                radius: 0.7,
                z_min: -0.8,
                z_max: 0.9,
                phi_max: 5.0,
            }),
        ),
    ]
}

#[test]
fn derivatives_are_those_of_position_and_normal() {
    let mut random = Random(41);
    let turn = Quat::from_axis_angle(random.direction(), 2.0);
    let transform =
        Transform::try_from(Mat4::from_scale_rotation_translation(Vec3::splat(1.3), turn, Vec3::new(0.3, 0.2, -0.1)))
            .unwrap();
    for (name, shape) in shapes(transform) {
        let accelerator = accelerate([shape], SimdLevel::Auto);
        let mut compared = 0;
        for _ in 0..4_000 {
            let eye = random.direction() * 4.0;
            let to = random.cube() * 0.8 - eye;
            let Some(p) = meet(&accelerator, eye, to) else { continue };
            assert!(p.geometric_normal.is_normalized() && p.shading_normal.is_normalized(), "{name}");
            assert!(p.geometric_normal.dot(p.dpdu).abs() < 1e-4 * p.dpdu.length(), "{name}");
            assert!(p.shading_normal.dot(p.shading_dpdu).abs() < 1e-4 * p.shading_dpdu.length(), "{name}");
            // A neighbour on the same piece of the surface.
            let step = 3e-3;
            let Some(q) = meet(&accelerator, eye, to + random.direction() * step * to.length()) else { continue };
            if q.primitive != p.primitive
                || q.geometric_normal.dot(p.geometric_normal) < 0.9
                || to.normalize().dot(p.geometric_normal).abs() < 0.3
            {
                continue;
            }
            let (du, moved) = (q.uv - p.uv, q.position - p.position);
            // To second order at the midpoint, with derivatives of both ends.
            let linear = 0.5 * ((p.dpdu + q.dpdu) * du.x + (p.dpdv + q.dpdv) * du.y);
            assert!((moved - linear).length() < 0.02 * moved.length() + 1e-4, "{name} {moved} {linear} {p:?}");
            let turned = q.shading_normal - p.shading_normal;
            let linear = 0.5 * ((p.dndu + q.dndu) * du.x + (p.dndv + q.dndv) * du.y);
            // Vertex normals are interpolated and then normalised: the derivative is that before.
            if name != "mesh" {
                assert!((turned - linear).length() < 0.05 * turned.length() + 2e-4, "{name} {turned} {linear}");
            } else {
                let tangent = linear - p.shading_normal * linear.dot(p.shading_normal);
                assert!((turned - tangent).length() < 0.1 * turned.length() + 2e-3, "{name} {turned} {tangent}");
            }
            compared += 1;
        }
        assert!(compared > 200, "{name} {compared}");
    }
}

#[test]
fn positions_lie_within_their_error_of_the_ray() {
    let mut random = Random(42);
    for (name, shape) in shapes(Transform::translate(Vec3::new(30.0, -20.0, 10.0))) {
        let accelerator = accelerate([shape], SimdLevel::Auto);
        for _ in 0..2_000 {
            let eye = Vec3::new(30.0, -20.0, 10.0) + random.direction() * 4.0;
            let ray = Ray::new(eye, Vec3::new(30.0, -20.0, 10.0) + random.cube() * 0.5 - eye, 0.0);
            let Some(hit) = accelerator.closest_hit(&ray) else { continue };
            let p = accelerator.surface(&ray, &hit);
            assert!(p.position.distance(ray.at(hit.t)) < 1e-4, "{name}");
            assert!(
                p.position_error.max_element() < 1e-4 && p.position_error.min_element() >= 0.0,
                "{name} {}",
                p.position_error
            );
        }
    }
}

/// pbrt-v4's rules: the normal is ∂p/∂u × ∂p/∂v of the object, turned where exactly one of `ReverseOrientation` and a
/// mirroring transform is given; with vertex normals, on their side.
#[test]
fn normals_are_on_the_side_that_orientation_says() {
    let mirror = Transform::scale(Vec3::new(-1.0, 1.0, 1.0)).unwrap();
    for (transform, mirrored) in [(Transform::IDENTITY, false), (mirror, true)] {
        for reverse in [false, true] {
            let flips = reverse != mirrored;
            let sign = if flips { -1.0 } else { 1.0 };
            let sphere = Sphere { reverse_orientation: reverse, ..Sphere::whole(transform, 1.0) };
            let cylinder = Cylinder {
                transform,
                reverse_orientation: reverse,
                radius: 1.0,
                z_min: -1.0,
                z_max: 1.0,
                phi_max: TAU,
            };
            for (name, shape) in [("sphere", Shape::Sphere(sphere)), ("cylinder", Shape::Cylinder(cylinder))] {
                let n = meet(&accelerate([shape], SimdLevel::Auto), Vec3::new(3.0, 0.1, 0.2), -Vec3::X)
                    .unwrap()
                    .geometric_normal;
                assert!(n.x * sign > 0.9, "{name} {mirrored} {reverse} {n}");
            }
            let disk = Disk {
                transform,
                reverse_orientation: reverse,
                height: 0.0,
                radius: 1.0,
                inner_radius: 0.0,
                phi_max: TAU,
            };
            let n = meet(&accelerate([Shape::Disk(disk)], SimdLevel::Auto), Vec3::new(0.1, 0.1, 2.0), -Vec3::Z)
                .unwrap()
                .geometric_normal;
            assert!(n.z * sign > 0.9, "disk {n}");

            let corners = vec![
                Vec3::new(-1.0, -1.0, 0.0),
                Vec3::new(1.0, -1.0, 0.0),
                Vec3::new(-1.0, 1.0, 0.0),
                Vec3::new(1.0, 1.0, 0.0),
            ];
            let mut patch = BilinearMesh {
                positions: corners.clone(),
                indices: vec![[0, 1, 2, 3]],
                reverse_orientation: reverse,
                ..BilinearMesh::default()
            };
            patch.transform(&transform);
            // The mirrored corners run the other way round, so that the cross product is turned already.
            let expected = if mirrored { -sign } else { sign };
            let n = meet(
                &accelerate([Shape::Bilinear(patch.clone())], SimdLevel::Auto),
                Vec3::new(0.1, 0.2, 2.0),
                -Vec3::Z,
            )
            .unwrap()
            .geometric_normal;
            assert!(n.z * expected > 0.9, "patch {n}");

            for with_normals in [None, Some(Vec3::new(0.3, 0.1, -1.0))] {
                let mut mesh = TriangleMesh {
                    positions: corners.clone(),
                    indices: vec![[0, 1, 2], [1, 3, 2]],
                    normals: with_normals.map(|n| vec![n; 4]),
                    reverse_orientation: reverse,
                    ..TriangleMesh::default()
                };
                mesh.transform(&transform);
                let accelerator = accelerate([Shape::Triangles(mesh)], SimdLevel::Auto);
                let p = meet(&accelerator, Vec3::new(0.1, 0.2, 2.0), -Vec3::Z).unwrap();
                let expected = match with_normals {
                    None => expected,
                    Some(_) if reverse => 1.0,
                    Some(_) => -1.0,
                };
                assert!(p.geometric_normal.z * expected > 0.9, "mesh {mirrored} {reverse} {with_normals:?} {p:?}");
                assert!(p.shading_normal.dot(p.geometric_normal) > 0.0);
                assert_eq!(p.shading_normal == p.geometric_normal, with_normals.is_none());
                let sample = accelerator.sample_area(luz_geometry::ShapeId(0), 0, Vec2::splat(0.3)).unwrap();
                assert!(sample.normal.dot(p.geometric_normal) > 0.99);
            }
        }
    }
}

#[test]
fn texture_coordinates_default_as_in_pbrt() {
    let mesh = TriangleMesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        indices: vec![[0, 1, 2]],
        face_indices: Some(vec![17]),
        ..TriangleMesh::default()
    };
    let accelerator = accelerate([Shape::Triangles(mesh)], SimdLevel::Auto);
    let p = meet(&accelerator, Vec3::new(0.25, 0.5, 1.0), -Vec3::Z).unwrap();
    assert!(p.uv.distance(Vec2::new(0.75, 0.5)) < 1e-6 && p.face_index == 17);
    assert!(p.parametric.distance(Vec2::new(0.25, 0.5)) < 1e-6);
    // Degenerate texture coordinates still give a frame.
    let mesh = TriangleMesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        indices: vec![[0, 1, 2]],
        uvs: Some(vec![Vec2::ONE; 3]),
        ..TriangleMesh::default()
    };
    let p = meet(&accelerate([Shape::Triangles(mesh)], SimdLevel::Auto), Vec3::new(0.25, 0.5, 1.0), -Vec3::Z).unwrap();
    assert!(p.dpdu.cross(p.dpdv).length() > 0.99);
    let sphere = accelerate([Shape::Sphere(Sphere::whole(Transform::IDENTITY, 2.0))], SimdLevel::Auto);
    // v runs from the south pole to the north.
    let p = meet(&sphere, Vec3::new(0.0, 5.0, 0.0), -Vec3::Y).unwrap();
    assert!(p.uv.distance(Vec2::new(0.25, 0.5)) < 1e-6, "{}", p.uv);
    let pole = meet(&sphere, Vec3::new(0.0, 0.0, 5.0), -Vec3::Z).unwrap();
    assert!(pole.uv.y > 0.999 && pole.geometric_normal.z > 0.999 && pole.dpdu.is_finite() && pole.dndu.is_finite());
}
