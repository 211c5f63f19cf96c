//! Points found by texture coordinates are those that rays hit there.

use glam::{Vec2, Vec3};
use luz_geometry::{AcceleratorBuilder, BilinearMesh, Cylinder, Disk, Ray, Shape, Sphere, Transform, TriangleMesh};
use luz_sample::Samples;
use luz_sample::random::Random;

fn turned() -> Transform {
    Transform::rotate(0.8, Vec3::new(1.0, 2.0, 3.0)).expect("an axis")
}

fn shapes() -> Vec<Shape> {
    let uvs = || Some(vec![Vec2::new(0.1, 0.2), Vec2::new(0.9, 0.1), Vec2::new(0.2, 0.8), Vec2::new(1.1, 0.9)]);
    let positions = || vec![Vec3::ZERO, Vec3::new(2.0, 0.1, 0.0), Vec3::new(0.0, 1.5, 0.3), Vec3::new(2.2, 1.7, 0.9)];
    vec![
        Shape::Sphere(Sphere { z_max: 0.7, phi_max: 4.0, ..Sphere::whole(turned(), 1.3) }),
        Shape::Disk(Disk {
            transform: turned(),
            reverse_orientation: true,
            height: 0.4,
            radius: 1.5,
            inner_radius: 0.3,
            phi_max: 5.0,
        }),
        Shape::Cylinder(Cylinder {
            transform: turned(),
            reverse_orientation: false,
            radius: 0.8,
            z_min: -0.5,
            z_max: 1.0,
            phi_max: 6.0,
        }),
        Shape::Triangles(TriangleMesh {
            positions: positions(),
            indices: vec![[0, 1, 2]],
            uvs: uvs(),
            ..TriangleMesh::default()
        }),
        Shape::Bilinear(BilinearMesh {
            positions: positions(),
            indices: vec![[0, 1, 2, 3]],
            uvs: uvs(),
            reverse_orientation: true,
            ..BilinearMesh::default()
        }),
        Shape::Bilinear(BilinearMesh {
            positions: positions(),
            indices: vec![[0, 1, 2, 3]],
            ..BilinearMesh::default()
        }),
    ]
}

#[test]
fn points_by_texture_coordinates_are_hit_there() {
    for shape in shapes() {
        let mut builder = AcceleratorBuilder::new();
        builder.add_shape(shape.clone());
        let accelerator = builder.build();
        let footprint = shape.uv_footprint(0).expect("one-to-one");
        let corners = footprint.corners();
        let (mut area, mut hits) = (0.0, 0);
        for i in 0..400 {
            let mut random = Random::new(1, 0, i);
            // A mean of the corners with random weights lies within.
            let weights: Vec<f32> = corners.iter().map(|_| 0.02 + random.next_1d()).collect();
            let sum: f32 = weights.iter().sum();
            let uv = corners.iter().zip(&weights).map(|(c, w)| *c * (w / sum)).sum::<Vec2>();
            let point = shape.at_uv(0, uv).expect("within the footprint");
            let origin = point.position + point.normal * 0.01;
            let ray = Ray::new(origin, -point.normal, 0.0);
            let Some(hit) = accelerator.closest_hit(&ray) else { continue };
            hits += 1;
            let surface = accelerator.surface(&ray, &hit);
            assert!(surface.position.distance(point.position) < 1e-4, "{shape:?}");
            assert!(surface.uv.distance(uv) < 1e-3, "{shape:?}: {} {uv}", surface.uv);
            assert!(surface.geometric_normal.dot(point.normal) > 0.999, "{shape:?}");
            let stretch = surface.dpdu.cross(surface.dpdv).length();
            assert!((stretch / point.area_by_uv - 1.0).abs() < 2e-3, "{shape:?}: {stretch} {}", point.area_by_uv);
            let again = shape.area_by_uv(0, surface.parametric).expect("one-to-one");
            assert!((again / point.area_by_uv - 1.0).abs() < 2e-3, "{shape:?}");
            if let Some(cone) = shape.normal_cone(0) {
                assert!(surface.geometric_normal.dot(cone.axis) >= cone.cos_angle - 1e-5, "{shape:?}");
            }
            area += f64::from(point.area_by_uv);
        }
        assert!(hits > 350 && area > 0.0, "{shape:?}: {hits}");
    }
}

/// The area by texture coordinates adds up to the area, for those that cover the unit square.
#[test]
fn area_is_the_integral_of_its_density() {
    for shape in shapes().into_iter().filter(|s| s.uv_footprint(0).is_some_and(|f| f.corners().contains(&Vec2::ONE))) {
        let n = 200;
        let sum: f64 = (0..n * n)
            .map(|i| Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32)
            .map(|uv| f64::from(shape.at_uv(0, uv).expect("within").area_by_uv))
            .sum::<f64>()
            / f64::from(n * n);
        assert!((sum / f64::from(shape.area(0)) - 1.0).abs() < 1e-3, "{shape:?}: {sum} {}", shape.area(0));
    }
}

#[test]
fn degenerate_texture_coordinates_have_no_footprint() {
    let mesh = TriangleMesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        indices: vec![[0, 1, 2]],
        uvs: Some(vec![Vec2::ZERO, Vec2::ONE, Vec2::splat(2.0)]),
        ..TriangleMesh::default()
    };
    assert!(Shape::Triangles(mesh).uv_footprint(0).is_none());
}
