//! Points and directions drawn from shapes have the densities that are claimed.
//!
//! χ² tests at a significance of 1 % over all tests of this file (Šidák), with fixed seeds.

mod common;

use std::f32::consts::{PI, TAU};

use common::{Random, accelerate};
use glam::{DVec2, DVec3, Mat4, Quat, Vec2, Vec3};
use luz_geometry::{
    Accelerator, BilinearMesh, Cylinder, Disk, Hit, NO_INSTANCE, Ray, Reference, Shape, ShapeId, SimdLevel, Sphere,
    SurfacePoint, Transform, TriangleMesh,
};
use luz_sample::test_support::{Chi2Result, chi2_rectangle, sidak};

/// More than there are tests here.
const TESTS: usize = 128;

fn passes(result: Chi2Result) -> bool {
    result.passes(sidak(0.01, TESTS))
}

fn placed(scale: Vec3, seed: u64) -> Transform {
    let mut random = Random(seed);
    let turn = Quat::from_axis_angle(random.direction(), random.unit() * 6.0);
    Transform::try_from(Mat4::from_scale_rotation_translation(scale, turn, random.cube())).unwrap()
}

fn triangle() -> Shape {
    let positions = vec![Vec3::new(-0.5, -0.7, 0.2), Vec3::new(1.1, -0.3, 0.0), Vec3::new(0.1, 0.9, -0.4)];
    Shape::Triangles(TriangleMesh { positions, indices: vec![[0, 1, 2]], ..TriangleMesh::default() })
}

fn patch(corner: Vec3) -> Shape {
    let positions = vec![Vec3::new(-0.5, -0.7, 0.2), Vec3::new(1.1, -0.7, 0.2), Vec3::new(-0.5, 0.9, 0.2), corner];
    Shape::Bilinear(BilinearMesh { positions, indices: vec![[0, 1, 2, 3]], ..BilinearMesh::default() })
}

fn shapes() -> Vec<(&'static str, Shape)> {
    let (even, uneven) = (placed(Vec3::splat(0.8), 1), placed(Vec3::new(0.5, 1.3, 0.8), 2));
    let sphere = |transform, z_min, z_max, phi_max| {
        Shape::Sphere(Sphere { transform, reverse_orientation: false, radius: 0.9, z_min, z_max, phi_max })
    };
    let disk = |transform, inner_radius, phi_max| {
        Shape::Disk(Disk { transform, reverse_orientation: false, height: 0.1, radius: 0.8, inner_radius, phi_max })
    };
    let cylinder = |transform, phi_max| {
        Shape::Cylinder(Cylinder {
            transform,
            reverse_orientation: false,
            radius: 0.6,
            z_min: -0.4,
            z_max: 0.7,
            phi_max,
        })
    };
    vec![
        ("triangle", triangle()),
        ("rectangle", patch(Vec3::new(1.1, 0.9, 0.2))),
        ("patch", patch(Vec3::new(1.4, 1.2, 0.9))),
        ("sphere", sphere(even, -1.0, 1.0, 7.0)),
        ("ellipsoid", sphere(uneven, -1.0, 1.0, 7.0)),
        ("part of a sphere", sphere(even, -0.3, 0.6, 4.0)),
        ("part of an ellipsoid", sphere(uneven, -0.3, 0.6, 4.0)),
        ("disk", disk(even, 0.0, 7.0)),
        ("part of an elliptic annulus", disk(uneven, 0.3, 4.0)),
        ("cylinder", cylinder(even, 7.0)),
        ("part of an elliptic cylinder", cylinder(uneven, 4.0)),
    ]
}

fn only(shape: Shape) -> Accelerator {
    accelerate([shape], SimdLevel::Auto)
}

/// The surface where a ray from `origin` along `direction` first meets the shape.
fn meet(accelerator: &Accelerator, origin: Vec3, direction: Vec3) -> Option<SurfacePoint> {
    let ray = Ray::new(origin, direction, 0.0);
    accelerator.closest_hit(&ray).map(|hit| accelerator.surface(&ray, &hit))
}

/// The point of a shape at parameters in the unit square, without the crate's help: texture coordinates, but for the
/// triangle, of which the second is divided by the first.
fn at(shape: &Shape, p: DVec2) -> DVec3 {
    let (u, v) = (p.x, p.y);
    let world = |t: &Transform, p: DVec3| t.matrix().as_dmat4().transform_point3(p);
    let turned = |phi_max: f32, r: f64, z: f64| {
        let (sin, cos) = (f64::from(phi_max.min(TAU)) * u).sin_cos();
        DVec3::new(r * cos, r * sin, z)
    };
    match shape {
        Shape::Triangles(mesh) => {
            let [a, b, c] = mesh.corners(0).map(|p| p.as_dvec3());
            a * (1.0 - u) + b * (u * (1.0 - v)) + c * (u * v)
        }
        Shape::Bilinear(mesh) => {
            let [a, b, c, d] = mesh.indices[0].map(|i| mesh.positions[i as usize].as_dvec3());
            a.lerp(b, u).lerp(c.lerp(d, u), v)
        }
        Shape::Sphere(s) => {
            let r = f64::from(s.radius);
            let polar = |z: f32| (f64::from(z) / r).clamp(-1.0, 1.0).acos();
            let theta = polar(s.z_min) + v * (polar(s.z_max) - polar(s.z_min));
            world(&s.transform, turned(s.phi_max, r * theta.sin(), r * theta.cos()))
        }
        Shape::Disk(s) => {
            let r = f64::from(s.radius) * (1.0 - v) + f64::from(s.inner_radius) * v;
            world(&s.transform, turned(s.phi_max, r, s.height.into()))
        }
        Shape::Cylinder(s) => {
            let z = f64::from(s.z_min) * (1.0 - v) + f64::from(s.z_max) * v;
            world(&s.transform, turned(s.phi_max, s.radius.into(), z))
        }
    }
}

/// The parameters of a sample.
fn parameters(shape: &Shape, uv: Vec2) -> Vec2 {
    let p = if let Shape::Triangles(_) = shape { Vec2::new(uv.x, uv.y / uv.x.max(1e-12)) } else { uv };
    p.clamp(Vec2::ZERO, Vec2::ONE)
}

/// The area that a unit of parameters fills, and the surface as far as densities need it.
fn surface_at(shape: &Shape, p: DVec2) -> (f64, SurfacePoint) {
    const STEP: f64 = 1e-5;
    let p = p.clamp(DVec2::splat(STEP), DVec2::splat(1.0 - STEP));
    let slope = |d: DVec2| (at(shape, p + d * STEP) - at(shape, p - d * STEP)) / (2.0 * STEP);
    let cross = slope(DVec2::X).cross(slope(DVec2::Y));
    let normal = cross.normalize_or(DVec3::Z).as_vec3();
    let none = Vec3::ZERO;
    let parametric = if let Shape::Triangles(_) = shape { DVec2::new(p.x * (1.0 - p.y), p.x * p.y) } else { p };
    let point = SurfacePoint {
        position: at(shape, p).as_vec3(),
        position_error: none,
        geometric_normal: normal,
        shading_normal: normal,
        uv: p.as_vec2(),
        dpdu: none,
        dpdv: none,
        shading_dpdu: none,
        shading_dpdv: none,
        dndu: none,
        dndv: none,
        parametric: parametric.as_vec2(),
        face_index: 0,
        time: 0.0,
        shape: 0,
        primitive: 0,
        instance: NO_INSTANCE,
    };
    (cross.length(), point)
}

/// `wrong` tilts the claimed density.
fn area_test(accelerator: &Accelerator, wrong: f64) -> Chi2Result {
    let shape = &accelerator.shapes()[0];
    chi2_rectangle(
        |u| Some(parameters(shape, accelerator.sample_area(ShapeId(0), 0, u)?.uv)),
        |p| {
            let (area, point) = surface_at(shape, p.as_dvec2());
            area * f64::from(accelerator.pdf_area(&point)) * (1.0 + wrong * (f64::from(p.x) - 0.5))
        },
        [0.0, 1.0, 0.0, 1.0],
        [16, 16],
        100_000,
        1,
    )
}

#[test]
fn points_have_the_density_in_area() {
    for (name, shape) in shapes() {
        let result = area_test(&only(shape), 0.0);
        assert!(passes(result), "{name} {result:?}");
        assert!((result.pdf_integral - 1.0).abs() < 1e-3, "{name} {result:?}");
    }
}

#[test]
fn a_wrong_density_in_area_is_found_out() {
    for (name, shape) in shapes() {
        let result = area_test(&only(shape), 0.2);
        assert!(!passes(result), "{name} {result:?}");
    }
}

#[test]
fn areas_are_those_of_the_densities() {
    let mut random = Random(21);
    for (name, shape) in shapes() {
        let accelerator = only(shape);
        // The mean of 1/pdf is the area.
        let n = 40_000;
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..n {
            let x = 1.0 / f64::from(accelerator.sample_area(ShapeId(0), 0, random.square()).unwrap().pdf_area);
            sum += x;
            squares += x * x;
        }
        let mean = sum / f64::from(n);
        let error = ((squares / f64::from(n) - mean * mean).max(0.0) / f64::from(n)).sqrt();
        let area = f64::from(accelerator.shape_area(ShapeId(0), 0));
        // 4.5 standard errors, and what rounding and quadrature may cost.
        assert!((mean - area).abs() < 4.5 * error + 1e-4 * area, "{name} {mean} {area} {error}");
    }
    let whole = only(Shape::Sphere(Sphere::whole(Transform::IDENTITY, 2.0)));
    assert!((whole.shape_area(ShapeId(0), 0) / (16.0 * PI) - 1.0).abs() < 1e-6);
}

fn references() -> Vec<Reference> {
    vec![
        Reference::point(Vec3::new(0.7, -2.5, 1.3)),
        Reference::surface(Vec3::new(0.2, 0.1, 2.4), Vec3::new(0.3, 0.2, -1.0).normalize()),
        // Far away: small solid angles.
        Reference::surface(Vec3::new(-90.0, 50.0, 120.0), Vec3::new(0.5, -0.4, -0.6).normalize()),
    ]
}

/// `wrong` tilts the claimed density.
fn solid_angle_test(accelerator: &Accelerator, reference: &Reference, wrong: f64) -> Chi2Result {
    let shape = &accelerator.shapes()[0];
    // Whole round spheres are sampled where they are seen, others on both sides.
    let seen_only = matches!(shape, Shape::Sphere(s) if s.phi_max > 6.3 && s.z_max >= s.radius && round(&s.transform));
    chi2_rectangle(
        |u| Some(parameters(shape, accelerator.sample_solid_angle(reference, ShapeId(0), 0, u)?.uv)),
        |p| {
            let (area, point) = surface_at(shape, p.as_dvec2());
            let to = point.position.as_dvec3() - reference.position.as_dvec3();
            let cosine = to.normalize().dot(point.geometric_normal.as_dvec3());
            if seen_only && cosine > 0.0 {
                return 0.0;
            }
            let tilt = 1.0 + wrong * (f64::from(p.x) - 0.5);
            area * cosine.abs() / to.length_squared() * f64::from(accelerator.pdf_solid_angle(reference, &point)) * tilt
        },
        [0.0, 1.0, 0.0, 1.0],
        [16, 16],
        100_000,
        2,
    )
}

/// Whether lengths are scaled alike along all axes.
fn round(transform: &Transform) -> bool {
    let lengths = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| transform.vector(axis).length());
    lengths.iter().all(|l| (l / lengths[0] - 1.0).abs() < 1e-5)
}

#[test]
fn directions_have_the_density_in_solid_angle() {
    for (name, shape) in shapes() {
        let accelerator = only(shape);
        for (i, reference) in references().iter().enumerate() {
            let result = solid_angle_test(&accelerator, reference, 0.0);
            assert!(passes(result), "{name} {i} {result:?}");
            assert!((result.pdf_integral - 1.0).abs() < 2e-3, "{name} {i} {result:?}");
        }
    }
}

#[test]
fn a_wrong_density_in_solid_angle_is_found_out() {
    for (name, shape) in shapes() {
        let result = solid_angle_test(&only(shape), &references()[0], 0.25);
        assert!(!passes(result), "{name} {result:?}");
    }
}

/// What `sample` says about its point, `pdf` says too, of the point that a ray finds there.
#[test]
fn sample_and_pdf_agree() {
    let mut random = Random(22);
    for (name, shape) in shapes() {
        let accelerator = only(shape);
        for reference in references() {
            let mut compared = 0;
            for _ in 0..2_000 {
                let Some(sample) = accelerator.sample_solid_angle(&reference, ShapeId(0), 0, random.square()) else {
                    continue;
                };
                let Some(point) = meet(&accelerator, reference.position, sample.position - reference.position) else {
                    continue;
                };
                // Not hidden by another part of the shape, nor at its rim, where normals change fast.
                let size = accelerator.bounds().diagonal().length();
                let away = (sample.position - reference.position).normalize();
                if point.position.distance(sample.position) > 1e-4 * size
                    || point.geometric_normal.dot(away).abs() < 0.05
                {
                    continue;
                }
                let pdf = accelerator.pdf_solid_angle(&reference, &point);
                assert!((pdf / sample.pdf - 1.0).abs() < 1e-2, "{name} {pdf} {} {reference:?}", sample.pdf);
                assert!(point.geometric_normal.dot(sample.normal) > 0.999, "{name}");
                let seam = (point.uv - sample.uv).abs().max_element();
                assert!(!(2e-3..=0.99).contains(&seam), "{name} {} {}", point.uv, sample.uv);
                compared += 1;
            }
            assert!(compared > 300, "{name} {compared}");
        }
    }
}

/// References on, in, and in the plane of a shape: no NaN, no infinite density.
#[test]
fn degenerate_references_give_finite_densities() {
    let mut random = Random(23);
    for (name, shape) in shapes() {
        let accelerator = only(shape);
        for _ in 0..500 {
            let on = accelerator.sample_area(ShapeId(0), 0, random.square()).unwrap();
            let along = (random.direction() - on.normal * random.direction().dot(on.normal)).normalize_or(Vec3::X);
            for position in
                [on.position, on.position + along * 0.1, on.position - on.normal * 1e-6, on.position + on.normal * 1e-3]
            {
                let reference = Reference::surface(position, on.normal);
                for u in [random.square(), Vec2::ZERO, Vec2::splat(luz_sample::ONE_MINUS_EPSILON)] {
                    if let Some(s) = accelerator.sample_solid_angle(&reference, ShapeId(0), 0, u) {
                        assert!(
                            s.pdf > 0.0 && s.pdf.is_finite() && s.position.is_finite() && s.normal.is_normalized(),
                            "{name} {s:?}"
                        );
                    }
                }
                if let Some(point) = meet(&accelerator, position, random.direction()) {
                    let pdf = accelerator.pdf_solid_angle(&reference, &point);
                    assert!(pdf >= 0.0 && pdf.is_finite(), "{name} {pdf}");
                }
            }
        }
    }
    let hit = Hit { t: 1.0, u: 0.2, v: 0.3, shape: 0, primitive: 0, instance: NO_INSTANCE };
    assert!(only(triangle()).surface(&Ray::new(Vec3::Z, -Vec3::Z, 0.0), &hit).position.is_finite());
}

/// What is prepared draws the points of its shape with their densities, and is dark where it says so.
#[test]
fn prepared_primitives_are_those_of_the_shape() {
    let (mut prepared_shapes, mut turned_away) = (0, 0);
    for (name, shape) in shapes() {
        let accelerator = only(shape);
        let Some(prepared) = accelerator.prepare(ShapeId(0), 0) else { continue };
        prepared_shapes += 1;
        let mut random = Random(51);
        for i in 0..3_000 {
            let (position, normal) = (random.cube() * 5.0, random.direction());
            let reference = if i % 3 == 0 { Reference::point(position) } else { Reference::surface(position, normal) };
            let u = random.square();
            let found = prepared.sample_solid_angle(&reference, u);
            assert_eq!(found, accelerator.sample_solid_angle(&reference, ShapeId(0), 0, u), "{name}");
            if prepared.faces_away(position)
                && let Some(point) = found
            {
                turned_away += 1;
                assert!(point.normal.dot(position - point.position) <= 1e-5, "{name} {point:?}");
            }
        }
    }
    assert!(prepared_shapes >= 2 && turned_away > 1_000, "{prepared_shapes} {turned_away}");
}
