//! What should not be there, is.

mod common;

use common::{LEVELS, Random, accelerate, soup};
use glam::Vec3;
use luz_geometry::{
    AcceleratorBuilder, BilinearMesh, Bounds3, Cylinder, Disk, Ray, Shape, ShapeId, SimdLevel, Sphere, Transform,
    TriangleMesh,
};

fn one_ray() -> Ray {
    Ray::new(Vec3::new(0.1, 0.2, -5.0), Vec3::Z, 0.0)
}

#[test]
fn nothing_is_hit_where_nothing_is() {
    for level in LEVELS {
        for shapes in
            [vec![], vec![Shape::Triangles(TriangleMesh::default())], vec![Shape::Bilinear(BilinearMesh::default())]]
        {
            let accelerator = accelerate(shapes, level);
            assert_eq!(accelerator.closest_hit(&one_ray()), None);
            assert!(!accelerator.any_hit(&one_ray()));
            assert!(accelerator.bounds().is_empty());
            assert_eq!(accelerator.report().primitives, 0);
        }
    }
    let mut builder = AcceleratorBuilder::new();
    let group = builder.add_group();
    builder.add_instance(group, Transform::IDENTITY.into());
    assert_eq!(builder.build().closest_hit(&one_ray()), None);
}

#[test]
fn broken_primitives_are_left_out_and_counted() {
    let good = [Vec3::new(-1.0, -1.0, 0.0), Vec3::new(2.0, 0.0, 0.0), Vec3::new(0.0, 2.0, 0.0)];
    let mut mesh = TriangleMesh { positions: good.to_vec(), indices: vec![[0, 1, 2]], ..TriangleMesh::default() };
    mesh.positions.extend([
        Vec3::new(f32::NAN, 0.0, 0.0),
        Vec3::new(0.0, f32::INFINITY, 0.0),
        Vec3::new(0.5, 0.5, 0.0),
    ]);
    // NaN, infinite, out of range, a point, a line, a line of three points.
    mesh.indices.extend([[0, 1, 3], [4, 1, 2], [0, 1, 99], [1, 1, 1], [0, 0, 1], [0, 1, u32::MAX]]);
    mesh.positions.push(Vec3::new(0.5, -0.5, 0.0));
    mesh.indices.push([0, 1, 6]);
    for level in LEVELS {
        let accelerator = accelerate([Shape::Triangles(mesh.clone())], level);
        assert_eq!(accelerator.report().skipped, [(ShapeId(0), 7)]);
        assert_eq!(accelerator.report().triangles, 1);
        let hit = accelerator.closest_hit(&one_ray()).unwrap();
        assert_eq!((hit.primitive, hit.t), (0, 5.0));
        assert_eq!(accelerator.bounds(), Bounds3::from_points(good));
        assert_eq!(accelerator.shape_area(ShapeId(0), 1), 0.0);
    }
    // Attributes that are too few make the whole mesh invalid.
    mesh.normals = Some(vec![Vec3::Z; 2]);
    assert_eq!(accelerate([Shape::Triangles(mesh)], SimdLevel::Auto).report().skipped, [(ShapeId(0), 8)]);

    let sphere = |radius| Shape::Sphere(Sphere::whole(Transform::IDENTITY, radius));
    let disk = Disk {
        transform: Transform::IDENTITY,
        reverse_orientation: false,
        height: 0.0,
        radius: 1.0,
        inner_radius: 2.0,
        phi_max: 6.0,
    };
    let cylinder = Cylinder {
        transform: Transform::IDENTITY,
        reverse_orientation: false,
        radius: 1.0,
        z_min: 1.0,
        z_max: 1.0,
        phi_max: 6.0,
    };
    let patch = BilinearMesh { positions: vec![Vec3::ONE; 4], indices: vec![[0, 1, 2, 3]], ..BilinearMesh::default() };
    let shapes = [
        sphere(0.0),
        sphere(-1.0),
        sphere(f32::NAN),
        sphere(f32::INFINITY),
        Shape::Disk(disk),
        Shape::Cylinder(cylinder),
        Shape::Bilinear(patch),
    ];
    let accelerator = accelerate(shapes, SimdLevel::Auto);
    assert_eq!(accelerator.report().skipped.len(), 7);
    assert_eq!(accelerator.closest_hit(&one_ray()), None);
}

#[test]
fn rays_that_are_none_hit_nothing() {
    let mut random = Random(7);
    let mesh = soup(&mut random, 500, 0.5);
    for level in LEVELS {
        let accelerator =
            accelerate([Shape::Triangles(mesh.clone()), Shape::Sphere(Sphere::whole(Transform::IDENTITY, 1.0))], level);
        let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
        for x in bad {
            for ray in [
                Ray::new(Vec3::new(x, 0.0, 0.0), Vec3::Z, 0.0),
                Ray::new(Vec3::ZERO, Vec3::new(x, 0.0, 1.0), 0.0),
                Ray { t_max: -1.0, ..one_ray() },
                Ray { t_max: 0.0, ..one_ray() },
            ] {
                let hit = accelerator.closest_hit(&ray);
                assert!(hit.is_none_or(|h| h.t > 0.0 && h.t <= ray.t_max), "{ray:?} {hit:?}");
                accelerator.any_hit(&ray);
            }
        }
        assert_eq!(accelerator.closest_hit(&Ray::new(Vec3::ZERO, Vec3::ZERO, 0.0)), None);
        assert_eq!(
            accelerator.closest_hit(&Ray { t_max: f32::NAN, ..one_ray() }).is_some(),
            accelerator.any_hit(&one_ray())
        );
    }
}

#[test]
fn flat_bounds_are_hit_from_every_side() {
    // Triangles in coordinate planes, and rays in the other ones.
    for axis in 0..3 {
        let corner = |u: f32, v: f32| {
            let mut p = Vec3::ZERO;
            p[(axis + 1) % 3] = u;
            p[(axis + 2) % 3] = v;
            p
        };
        let mesh = TriangleMesh {
            positions: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
            indices: vec![[0, 1, 2], [0, 2, 3]],
            ..TriangleMesh::default()
        };
        for level in LEVELS {
            let accelerator = accelerate([Shape::Triangles(mesh.clone())], level);
            for sign in [-1.0, 1.0] {
                let mut origin = corner(0.25, -0.5);
                origin[axis] = -3.0 * sign;
                let mut direction = Vec3::ZERO;
                direction[axis] = sign;
                assert_eq!(accelerator.closest_hit(&Ray::new(origin, direction, 0.0)).unwrap().t, 3.0);
                // Along the edge of the bounds.
                let mut origin = corner(1.0, -0.5);
                origin[axis] = -3.0 * sign;
                assert_eq!(accelerator.closest_hit(&Ray::new(origin, direction, 0.0)).unwrap().t, 3.0);
            }
        }
    }
}

#[test]
fn equal_primitives_build_and_the_first_is_hit() {
    let triangle = [Vec3::new(-1.0, -1.0, 0.0), Vec3::new(2.0, -1.0, 0.0), Vec3::new(0.0, 2.0, 0.0)];
    let mesh =
        TriangleMesh { positions: triangle.to_vec(), indices: vec![[0, 1, 2]; 200_000], ..TriangleMesh::default() };
    for level in LEVELS {
        let accelerator = accelerate([Shape::Triangles(mesh.clone())], level);
        assert_eq!(accelerator.closest_hit(&one_ray()).unwrap().primitive, 0);
    }
    let spheres: Vec<Shape> = (0..1000).map(|_| Shape::Sphere(Sphere::whole(Transform::IDENTITY, 1.0))).collect();
    assert_eq!(accelerate(spheres, SimdLevel::Auto).closest_hit(&one_ray()).unwrap().shape, 0);
}

/// Sizes in geometric progression make the heuristic peel off one primitive at a time.
#[test]
fn nested_primitives_do_not_make_the_tree_too_deep() {
    let mut mesh = TriangleMesh::default();
    for i in 0..20_000u32 {
        // Through all the exponents that f32 has, and then again.
        let size = 2f32.powf(-100.0 + 200.0 * (i as f32 / 20_000.0));
        let base = mesh.positions.len() as u32;
        mesh.positions.extend([Vec3::ZERO, Vec3::new(size, 0.0, size), Vec3::new(0.0, size, size)]);
        mesh.indices.push([base, base + 1, base + 2]);
    }
    for level in LEVELS {
        let accelerator = accelerate([Shape::Triangles(mesh.clone())], level);
        let mut random = Random(8);
        for _ in 0..200 {
            let ray = Ray::new(random.cube() * 2f32.powf(random.unit() * 60.0 - 30.0), random.direction(), 0.0);
            let expected = (0..mesh.indices.len()).filter_map(|i| {
                let [a, b, c] = mesh.corners(i);
                // In f64, well inside: what must be found.
                let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
                let (e1, e2) = ((b - a).as_dvec3(), (c - a).as_dvec3());
                let p = d.cross(e2);
                let det = e1.dot(p);
                let s = o - a.as_dvec3();
                let (u, v) = (s.dot(p) / det, d.dot(s.cross(e1)) / det);
                let t = e2.dot(s.cross(e1)) / det;
                (u > 1e-3 && v > 1e-3 && u + v < 0.999 && t > 1e-3).then_some(t)
            });
            if let Some(t) = expected.min_by(f64::total_cmp) {
                let found = accelerator.closest_hit(&ray).map(|h| f64::from(h.t));
                assert!(found.is_some_and(|f| f <= t * 1.0001), "{found:?} {t} {ray:?}");
            }
        }
    }
}

#[test]
fn trees_are_the_same_for_any_number_of_threads() {
    let mut random = Random(9);
    let mesh = soup(&mut random, 300_000, 0.01);
    let mut answers = Vec::new();
    let rays: Vec<Ray> = (0..2_000).map(|_| common::random_ray(&mut random)).collect();
    for threads in [1, 2, 3, 7] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let accelerator = pool.install(|| accelerate([Shape::Triangles(mesh.clone())], SimdLevel::Auto));
        let hits: Vec<_> = rays.iter().map(|r| accelerator.closest_hit(r)).collect();
        answers.push((hits, accelerator.fingerprint()));
    }
    assert!(answers.windows(2).all(|w| w[0] == w[1]));
}
