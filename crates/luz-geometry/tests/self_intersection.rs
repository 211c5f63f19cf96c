//! Rays that leave a surface do not find it again.

mod common;

use common::{LEVELS, Random, accelerate};
use glam::{Mat4, Quat, Vec3};
use luz_geometry::{
    Accelerator, AcceleratorBuilder, BilinearMesh, Cylinder, Disk, NO_INSTANCE, PrimitiveId, Ray, Shape, SimdLevel,
    Sphere, Transform, TriangleMesh,
};

/// A convex closed mesh.
fn convex_mesh() -> TriangleMesh {
    common::bumpy_sphere(16, 0.0)
}

fn flat_patch() -> BilinearMesh {
    BilinearMesh {
        positions: vec![
            Vec3::new(-1.0, -1.0, 0.0),
            Vec3::new(1.0, -1.0, 0.0),
            Vec3::new(-1.0, 1.0, 0.0),
            Vec3::new(1.0, 1.0, 0.0),
        ],
        indices: vec![[0, 1, 2, 3]],
        ..BilinearMesh::default()
    }
}

/// Convex or flat shapes of about unit size around the origin, moved by `transform`.
fn shapes(transform: Transform) -> Vec<(&'static str, Shape)> {
    let mut mesh = convex_mesh();
    mesh.transform(&transform);
    let mut patch = flat_patch();
    patch.transform(&transform);
    let sphere = Sphere::whole(transform, 1.0);
    vec![
        ("mesh", Shape::Triangles(mesh)),
        ("patch", Shape::Bilinear(patch)),
        ("sphere", Shape::Sphere(sphere)),
        (
            "disk",
            Shape::Disk(Disk {
                transform,
                reverse_orientation: false,
                height: 0.3,
                radius: 1.0,
                inner_radius: 0.0,
                phi_max: 7.0,
            }),
        ),
        (
            "cylinder",
            Shape::Cylinder(Cylinder {
                transform,
                reverse_orientation: false,
                radius: 0.7,
                z_min: -1.0,
                z_max: 1.0,
                phi_max: 7.0,
            }),
        ),
    ]
}

/// Shoots rays at the shape around `center`, and from where they hit shoots others away, on the outside; counts how many
/// were shot.
fn leave(accelerator: &Accelerator, random: &mut Random, center: Vec3, size: f32, label: &str) -> usize {
    let mut shot = 0;
    for _ in 0..1_500 {
        let origin = center + random.direction() * (1.2 + 3.0 * random.unit()) * size;
        let target = center + random.cube() * 0.7 * size;
        let ray = Ray::new(origin, (target - origin) * (0.1 + 3.0 * random.unit()), 0.0);
        let Some(hit) = accelerator.closest_hit(&ray) else { continue };
        let point = accelerator.surface(&ray, &hit);
        let n = point.geometric_normal;
        assert!(n.is_normalized(), "{label} {n}");
        let outside = if n.dot(ray.direction) > 0.0 { -n } else { n };
        // From within, the other side is met.
        let from_within =
            outside.dot(point.position - center) < 0.0 && !label.starts_with("patch") && !label.starts_with("disk");
        for k in 0..4 {
            let mut direction = random.direction();
            if k == 0 {
                // Grazing.
                direction = (direction - n * direction.dot(n)).normalize_or(Vec3::X) + outside * 1e-4;
            }
            if direction.dot(outside) < 0.0 {
                direction = -direction;
            }
            if from_within || direction.dot(outside) < 1e-5 {
                continue;
            }
            let away = Ray::new(point.offset_origin(direction), direction * (0.1 + random.unit()), 0.0);
            let again = accelerator.closest_hit(&away);
            assert_eq!(again, None, "{label} {direction} {point:?}");
            assert!(!accelerator.any_hit(&away));
            shot += 1;
        }
    }
    shot
}

#[test]
fn rays_that_leave_convex_shapes_miss_them() {
    let mut random = Random(11);
    for scale in [1e-6, 1e-3, 1.0, 1e3, 1e6] {
        for shift in [0.0, 1.0, 300.0] {
            let turn = Quat::from_axis_angle(random.direction(), random.unit() * 6.0);
            let center = random.direction() * shift * scale;
            let matrix = Mat4::from_scale_rotation_translation(Vec3::splat(scale), turn, center);
            for (name, shape) in shapes(Transform::try_from(matrix).unwrap()) {
                let level = LEVELS[random.below(3)];
                let accelerator = accelerate([shape], level);
                let shot =
                    leave(&accelerator, &mut random, center, scale, &format!("{name} {scale} {shift} {level:?}"));
                assert!(shot > 100, "{name} {shot}");
            }
        }
    }
}

#[test]
fn rays_that_leave_stretched_shapes_miss_them() {
    let mut random = Random(12);
    for _ in 0..10 {
        let turn = Quat::from_axis_angle(random.direction(), random.unit() * 6.0);
        let size = Vec3::new(0.2 + random.unit(), -0.2 - random.unit(), 0.2 + random.unit());
        let center = random.cube() * 10.0;
        let matrix = Mat4::from_scale_rotation_translation(size, turn, center);
        for (name, shape) in shapes(Transform::try_from(matrix).unwrap()) {
            let accelerator = accelerate([shape], SimdLevel::Auto);
            leave(&accelerator, &mut random, center, 1.0, name);
        }
    }
}

#[test]
fn rays_that_leave_instances_miss_them() {
    let mut random = Random(13);
    for shift in [0.0, 10.0, 1000.0] {
        for _ in 0..5 {
            let turn = Quat::from_axis_angle(random.direction(), random.unit() * 6.0);
            let size = Vec3::new(0.5 + random.unit(), 0.5 + random.unit(), 0.5 + random.unit());
            let center = random.direction() * shift;
            let placed = Transform::try_from(Mat4::from_scale_rotation_translation(size, turn, center)).unwrap();
            for (name, shape) in shapes(Transform::IDENTITY) {
                let mut builder = AcceleratorBuilder::new();
                let group = builder.add_group();
                builder.add_shape_to(group, shape);
                builder.add_instance(group, placed.into());
                leave(&builder.build(), &mut random, center, 1.7, &format!("{name} in an instance {shift}"));
            }
        }
    }
}

/// From inside a sphere, every ray must find the far side: exactly one more hit, not at the origin.
#[test]
fn rays_inside_a_sphere_find_the_other_side() {
    let mut random = Random(14);
    for scale in [1e-6, 1.0, 1e6] {
        let center = random.direction() * 10.0 * scale;
        let sphere = Sphere::whole(Transform::translate(center), scale);
        let accelerator = accelerate([Shape::Sphere(sphere)], SimdLevel::Auto);
        for _ in 0..20_000 {
            let ray = Ray::new(center, random.direction(), 0.0);
            let hit = accelerator.closest_hit(&ray).unwrap();
            let point = accelerator.surface(&ray, &hit);
            let mut direction = random.direction();
            if direction.dot(point.geometric_normal) > 0.0 {
                direction = -direction;
            }
            let chord = 2.0 * scale * -direction.dot(point.geometric_normal);
            // Shorter chords than the rounding of positions are none.
            if chord < 1e-4 * scale {
                continue;
            }
            let inside = Ray::new(point.offset_origin(direction), direction, 0.0);
            let t = accelerator.closest_hit(&inside).unwrap().t;
            // The origin is off by some 1e-6 of the size, along the normal.
            let cosine = chord / (2.0 * scale);
            assert!((t - chord).abs() < 1e-4 * chord + 1e-5 * scale / cosine, "{scale} {t} {chord}");
        }
    }
}

/// Rays that know the primitive that they leave find the same as those that do not, at the same places to the last bit; on their own
/// and in an instance, in all instruction sets.
#[test]
fn knowing_what_is_left_changes_nothing() {
    for level in LEVELS {
        let mut builder = AcceleratorBuilder::new();
        builder.simd(level);
        builder.add_shape(Shape::Triangles(common::bumpy_sphere(16, 0.4)));
        let group = builder.add_group();
        builder.add_shape_to(group, Shape::Triangles(common::bumpy_sphere(12, 0.3)));
        let turn = Quat::from_axis_angle(Vec3::new(0.6, 0.0, 0.8), 1.0);
        let placed = Mat4::from_scale_rotation_translation(Vec3::splat(0.7), turn, Vec3::new(1.5, 0.5, 0.0));
        builder.add_instance(group, Transform::from_parts(placed, placed.inverse()).into());
        let accelerator = builder.build();
        let mut random = Random(41);
        let (mut met, mut of_instance) = (0, 0);
        for _ in 0..20_000 {
            let origin = random.direction() * 4.0;
            let ray = Ray::new(origin, Vec3::new(0.7, 0.2, 0.0) + random.cube() - origin, 0.0);
            let Some(hit) = accelerator.closest_hit(&ray) else { continue };
            let point = accelerator.surface(&ray, &hit);
            let direction = random.direction();
            let knowing = point.leave(direction);
            let unknowing = Ray { leaves: PrimitiveId::NONE, ..knowing };
            let found = accelerator.closest_hit(&knowing);
            assert_eq!(found, accelerator.closest_hit(&unknowing));
            assert_eq!(found.is_some(), accelerator.any_hit(&knowing));
            met += usize::from(found.is_some());
            of_instance += usize::from(point.instance != NO_INSTANCE);
        }
        assert!(met > 1000 && of_instance > 1000, "{met} {of_instance}");
    }
}

/// A ray that starts behind its triangle by the rounding of its origin meets it, but not so where `f32` cannot tell and the ray is said to
/// leave it.
#[test]
fn what_may_be_left_is_not_met_again() {
    for level in LEVELS {
        let accelerator = accelerate([Shape::Triangles(common::bumpy_sphere(16, 0.0))], level);
        let mut random = Random(42);
        let (mut met, mut met_knowing) = (0, 0);
        for _ in 0..5_000 {
            let origin = random.direction() * 3.0;
            let ray = Ray::new(origin, 0.3 * random.cube() - origin, 0.0);
            let Some(hit) = accelerator.closest_hit(&ray) else { continue };
            let point = accelerator.surface(&ray, &hit);
            let outside =
                if point.geometric_normal.dot(ray.direction) > 0.0 { -1.0 } else { 1.0 } * point.geometric_normal;
            let knowing = Ray { origin: point.position, ..point.leave(outside) };
            let [found, found_knowing] =
                [PrimitiveId::NONE, knowing.leaves].map(|leaves| accelerator.closest_hit(&Ray { leaves, ..knowing }));
            assert!(found_knowing.is_none() || found_knowing == found);
            assert_eq!(found_knowing.is_some(), accelerator.any_hit(&knowing));
            met += u32::from(found.is_some());
            met_knowing += u32::from(found_knowing.is_some());
        }
        assert!(met > 500 && met_knowing < met / 2, "{met} {met_knowing}");
    }
}
