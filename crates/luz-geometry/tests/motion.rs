//! Instances, at rest and in motion.

mod common;

use common::{LEVELS, Random, random_ray, soup};
use glam::{Mat4, Quat, Vec3};
use luz_geometry::{
    AcceleratorBuilder, AnimatedTransform, Bounds3, InstanceTransform, NO_INSTANCE, Ray, Shape, Sphere, Transform,
};

fn placed(random: &mut Random, stretch: bool) -> Transform {
    let turn = Quat::from_axis_angle(random.direction(), random.unit() * 6.0);
    let size = if stretch { Vec3::new(0.5, 1.5, 0.8) * (0.5 + random.unit()) } else { Vec3::ONE };
    Transform::try_from(Mat4::from_scale_rotation_translation(size, turn, random.cube())).unwrap()
}

#[test]
fn an_instance_is_hit_where_the_moved_mesh_is() {
    let mut random = Random(31);
    let mesh = soup(&mut random, 2_000, 0.2);
    for mirrored in [false, true] {
        let mut transform = placed(&mut random, true);
        if mirrored {
            transform = transform.compose(&Transform::scale(Vec3::new(-1.0, 1.0, 1.0)).unwrap());
        }
        let mut moved = mesh.clone();
        moved.transform(&transform);
        assert_eq!(moved.swaps_handedness, mirrored);
        for level in LEVELS {
            let mut direct = AcceleratorBuilder::new();
            direct.simd(level).add_shape(Shape::Triangles(moved.clone()));
            let direct = direct.build();
            let mut builder = AcceleratorBuilder::new();
            let group = builder.simd(level).add_group();
            builder.add_shape_to(group, Shape::Triangles(mesh.clone()));
            builder.add_instance(group, transform.into());
            let instanced = builder.build();
            let (mut both, mut same) = (0, 0);
            for _ in 0..20_000 {
                let ray = random_ray(&mut random);
                let (a, b) = (direct.closest_hit(&ray), instanced.closest_hit(&ray));
                assert_eq!(b.is_some(), instanced.any_hit(&ray));
                if let (Some(a), Some(b)) = (a, b) {
                    assert_eq!(b.instance, 0);
                    both += 1;
                    if a.primitive == b.primitive {
                        same += 1;
                        assert!((a.t - b.t).abs() < 1e-4 * (1.0 + a.t), "{a:?} {b:?}");
                        let (p, q) = (direct.surface(&ray, &a), instanced.surface(&ray, &b));
                        assert!(p.position.distance(q.position) < 1e-3);
                        // A mirroring instance leaves the normal on its side; a mirrored mesh too, for it counts twice.
                        assert!(p.geometric_normal.dot(q.geometric_normal) > 0.99, "{mirrored}");
                    }
                }
                // Rays that graze an edge may differ by rounding.
            }
            assert!(both > 3_000 && same * 1000 >= both * 995, "{both} {same}");
        }
    }
}

#[test]
fn many_instances_and_a_world_beside_them() {
    let mut random = Random(32);
    let mesh = soup(&mut random, 200, 0.3);
    let placements: Vec<Transform> = (0..50).map(|_| placed(&mut random, true)).collect();
    let mut builder = AcceleratorBuilder::new();
    let world = builder.add_shape(Shape::Sphere(Sphere::whole(Transform::IDENTITY, 0.3)));
    let group = builder.add_group();
    let inner = builder.add_shape_to(group, Shape::Triangles(mesh.clone()));
    for placement in &placements {
        builder.add_instance(group, (*placement).into());
    }
    let accelerator = builder.build();
    assert_eq!((world.0, inner.0, accelerator.report().instances), (0, 1, 50));
    let singles: Vec<_> = placements
        .iter()
        .map(|placement| {
            let mut builder = AcceleratorBuilder::new();
            let group = builder.add_group();
            builder.add_shape_to(group, Shape::Triangles(mesh.clone()));
            builder.add_instance(group, (*placement).into());
            builder.build()
        })
        .collect();
    let mut sphere = AcceleratorBuilder::new();
    sphere.add_shape(Shape::Sphere(Sphere::whole(Transform::IDENTITY, 0.3)));
    let sphere = sphere.build();
    for _ in 0..3_000 {
        let ray = random_ray(&mut random);
        let brute = singles
            .iter()
            .enumerate()
            .filter_map(|(i, a)| a.closest_hit(&ray).map(|h| (h.t, i as u32)))
            .chain(sphere.closest_hit(&ray).map(|h| (h.t, NO_INSTANCE)))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let found = accelerator.closest_hit(&ray).map(|h| (h.t, h.instance));
        assert_eq!(found, brute, "{ray:?}");
    }
}

#[test]
fn motion_goes_through_its_ends_and_turns_evenly() {
    let mut random = Random(33);
    for _ in 0..50 {
        let (a, b) = (placed(&mut random, true), placed(&mut random, true));
        let animated = AnimatedTransform::new(a, 1.0, b, 3.0);
        assert_eq!(animated.interpolate(0.0), a);
        assert_eq!(animated.interpolate(1.0), a);
        assert_eq!(animated.interpolate(9.0), b);
        let p = random.cube();
        // Continuous up to the ends.
        for (time, end) in [(1.0 + 1e-5, a), (3.0 - 1e-5, b)] {
            assert!(animated.point(p, time).distance(end.point(p)) < 1e-3);
        }
    }
    // A quarter turn at constant speed.
    let quarter = Transform::rotate(std::f32::consts::FRAC_PI_2, Vec3::Z).unwrap();
    let animated = AnimatedTransform::new(Transform::IDENTITY, 0.0, quarter, 1.0);
    for i in 0..=10 {
        let s = i as f32 / 10.0;
        let (sin, cos) = (std::f32::consts::FRAC_PI_2 * s).sin_cos();
        assert!(animated.point(Vec3::X, s).distance(Vec3::new(cos, sin, 0.0)) < 1e-6);
    }
    // Scale and mirroring are interpolated, not turned.
    let mirror = Transform::scale(Vec3::new(-1.0, 1.0, 1.0)).unwrap();
    let grown = Transform::scale(Vec3::new(-3.0, 3.0, 3.0)).unwrap();
    let animated = AnimatedTransform::new(mirror, 0.0, grown, 1.0);
    assert!(animated.point(Vec3::ONE, 0.5).distance(Vec3::new(-2.0, 2.0, 2.0)) < 1e-6);
    // Through a singular matrix: never NaN.
    let through = AnimatedTransform::new(Transform::IDENTITY, 0.0, mirror, 1.0);
    for i in 0..=20 {
        assert!(through.interpolate(i as f32 / 20.0).matrix().is_finite());
    }
    assert!(!AnimatedTransform::new(quarter, 0.0, quarter, 1.0).is_animated());
}

#[test]
fn motion_bounds_hold_every_moment() {
    let mut random = Random(34);
    for _ in 0..100 {
        let (a, b) = (placed(&mut random, true), placed(&mut random, true));
        let animated = AnimatedTransform::new(a, 0.0, b, 1.0);
        let corner = random.cube();
        let bounds = Bounds3::from_points([corner, corner + random.cube()]);
        let all = animated.motion_bounds(&bounds);
        let mut tight = Bounds3::EMPTY;
        for _ in 0..500 {
            let at = animated.interpolate(random.unit());
            for p in bounds.corners() {
                assert!(all.contains(at.point(p)));
                tight = tight.with_point(at.point(p));
            }
        }
        assert!(all.diagonal().length() < 1.2 * tight.diagonal().length() + 0.05, "{all:?} {tight:?}");
    }
}

#[test]
fn a_moving_instance_is_where_it_is_at_the_rays_time() {
    let mut random = Random(35);
    let mesh = soup(&mut random, 500, 0.3);
    let animated = AnimatedTransform::new(placed(&mut random, false), 0.0, placed(&mut random, true), 1.0);
    let mut builder = AcceleratorBuilder::new();
    let group = builder.add_group();
    builder.add_shape_to(group, Shape::Triangles(mesh.clone()));
    builder.add_instance(group, InstanceTransform::from(animated.clone()));
    let moving = builder.build();
    for time in [-1.0, 0.0, 0.2, 0.5, 0.99, 1.0, 2.0] {
        let mut builder = AcceleratorBuilder::new();
        let group = builder.add_group();
        builder.add_shape_to(group, Shape::Triangles(mesh.clone()));
        builder.add_instance(group, animated.interpolate(time).into());
        let still = builder.build();
        let mut hits = 0;
        for _ in 0..3_000 {
            let ray = Ray { time, ..random_ray(&mut random) };
            let (a, b) = (moving.closest_hit(&ray), still.closest_hit(&ray));
            assert_eq!(a, b, "{time}");
            hits += usize::from(a.is_some());
            if let Some(hit) = a {
                let point = moving.surface(&ray, &hit);
                assert_eq!((point.instance, point.time), (0, time));
                assert!(point.position.distance(ray.at(hit.t)) < 1e-4 * (1.0 + hit.t * ray.direction.length()));
            }
        }
        assert!(hits > 300, "{hits}");
    }
}

#[test]
fn filters_are_asked_about_their_shapes_alone() {
    let mut random = Random(36);
    let mut builder = AcceleratorBuilder::new();
    let filtered = builder.add_shape(Shape::Triangles(soup(&mut random, 300, 0.4)));
    let plain = builder.add_shape(Shape::Triangles(soup(&mut random, 300, 0.4)));
    let ball = builder.add_shape(Shape::Sphere(Sphere::whole(Transform::IDENTITY, 0.5)));
    builder.set_filtered(filtered, true);
    builder.set_filtered(ball, true);
    let accelerator = builder.build();
    let mut without = AcceleratorBuilder::new();
    without.add_shape(accelerator.shape(plain).clone());
    let without = without.build();
    for _ in 0..5_000 {
        let ray = random_ray(&mut random);
        let nothing_passes = accelerator.closest_hit_filtered(&ray, |hit| {
            assert!(hit.shape != plain.0);
            false
        });
        let expected = without.closest_hit(&ray);
        assert_eq!(nothing_passes.map(|h| (h.t, h.primitive)), expected.map(|h| (h.t, h.primitive)));
        assert_eq!(accelerator.any_hit_filtered(&ray, |_| false), expected.is_some());
        let everything_passes = accelerator.closest_hit_filtered(&ray, |_| true);
        assert_eq!(everything_passes, accelerator.closest_hit(&ray));
        // Holes: what is behind them is found.
        let odd = accelerator.closest_hit_filtered(&ray, |hit| hit.primitive % 2 == 1);
        assert!(odd.is_none_or(|h| h.shape == plain.0 || h.primitive % 2 == 1));
        assert!(odd.map_or(f32::INFINITY, |h| h.t) >= everything_passes.map_or(f32::INFINITY, |h| h.t));
    }
}
