//! Warps at the ends of the unit interval and on degenerate, tiny and huge domains.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};
use luz_sample::ONE_MINUS_EPSILON;
use luz_sample::warp::*;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const ENDS: [f32; 5] = [0.0, f32::MIN_POSITIVE, 0.5, 0.999_999, ONE_MINUS_EPSILON];

fn corners() -> impl Iterator<Item = Vec2> {
    ENDS.into_iter().flat_map(|x| ENDS.into_iter().map(move |y| Vec2::new(x, y)))
}

#[test]
fn every_warp_is_finite_and_has_a_density_at_the_ends() {
    for u in corners() {
        assert!(concentric_disk(u).length() <= 1.000_001);
        for w in [uniform_hemisphere(u), cosine_hemisphere(u), uniform_sphere(u)] {
            assert!((w.length() - 1.0).abs() < 1e-6, "{u} {w}");
        }
        assert!(cosine_hemisphere_pdf(cosine_hemisphere(u).z) > 0.0);
        for h in [1e-30, 1e-6, 1.0, 2.0] {
            let w = uniform_cone(u, h);
            assert!((w.length() - 1.0).abs() < 1e-6 && w.z >= 1.0 - h, "{u} {w}");
            assert!(uniform_cone_pdf(h).is_finite());
        }
        assert!(uniform_triangle(u).iter().all(|b| (0.0..=1.0).contains(b)));
        assert!(exponential(u.x, 2.0).is_finite() && exponential_pdf(exponential(u.x, 2.0), 2.0) > 0.0);
        assert!(box_muller(u).is_finite() && box_muller_pdf(box_muller(u)) > 0.0);
        assert!(normal(u.x, 1.0, 2.0).is_finite() && normal_pdf(normal(u.x, 1.0, 2.0), 1.0, 2.0) > 0.0);
        assert!(tent(u.x, 2.0).abs() < 2.0 && tent_pdf(tent(u.x, 2.0), 2.0) > 0.0);
        for w in [[0.0; 4], [0.0, 1.0, 0.0, 0.0], [1e-30; 4], [1e38; 4], [3.0, 0.0, 0.0, 1.0]] {
            let p = bilinear(u, w);
            assert!(p.cmpge(Vec2::ZERO).all() && p.cmplt(Vec2::ONE).all(), "{u} {w:?} {p}");
            assert!(bilinear_pdf(p, w).is_finite());
        }
    }
}

#[test]
fn normal_quantiles_agree_with_another_library() {
    use statrs::distribution::{ContinuousCDF, Normal};
    let reference = Normal::new(0.0, 1.0).unwrap();
    for p in [1e-300, 1e-20, 1e-7, 0.01, 0.074, 0.076, 0.3, 0.5, 0.7, 0.925, 0.99, 1.0 - 1e-9] {
        let z = normal_quantile(p);
        assert!((reference.cdf(z) - p).abs() <= 1e-9 * p, "{p}: {z}");
    }
    assert_eq!(normal_quantile(0.0), f64::NEG_INFINITY);
    assert_eq!(normal_quantile(1.0), f64::INFINITY);
    assert!(normal_quantile(-0.1).is_nan() && normal_quantile(f64::NAN).is_nan());
}

#[test]
fn solid_angles_are_exact() {
    let near = |a: f32, b: f32| assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
    near(SphericalTriangle::new(Vec3::X, Vec3::Y, Vec3::Z).unwrap().solid_angle(), PI / 2.0);
    near(SphericalTriangle::new(Vec3::X * 1e10, Vec3::Y, Vec3::Z * 1e-10).unwrap().solid_angle(), PI / 2.0);
    // A face of the cube around the reference point.
    let face =
        |size: f32| SphericalRectangle::new(Vec3::ZERO, -Vec3::splat(size), Vec3::X * 2.0 * size, Vec3::Y * 2.0 * size);
    near(face(1.0).unwrap().solid_angle(), TAU / 3.0);
    near(face(1e6).unwrap().solid_angle(), TAU / 3.0);
    // Nearly all of a hemisphere.
    let low = SphericalRectangle::new(Vec3::new(0.3, 0.6, 1e-6), Vec3::ZERO, Vec3::X, Vec3::Y).unwrap();
    assert!((low.solid_angle() - TAU).abs() < 3e-5);
    let r = |a: f32| Vec3::new(a.cos(), a.sin(), 1e-6);
    let low = SphericalTriangle::new(r(0.0), r(2.0), r(4.0)).unwrap();
    assert!((low.solid_angle() - TAU).abs() < 3e-5);
    // Far away and tiny: area over squared distance.
    for distance in [1e4f32, 1e6, 1e9] {
        let a = Vec3::new(0.0, 0.0, distance);
        near(SphericalTriangle::new(a, a + Vec3::X, a + Vec3::Y).unwrap().solid_angle(), 0.5 / distance / distance);
        let rectangle = SphericalRectangle::new(Vec3::ZERO, a, Vec3::X, Vec3::Y).unwrap();
        near(rectangle.solid_angle(), 1.0 / distance / distance);
    }
}

#[test]
fn tiny_triangles_are_sampled_all_over() {
    // Seen under 10⁻⁸ sr, the points still fill the triangle evenly: each quarter of it gets a quarter of a 16 × 16 grid.
    let a = Vec3::new(2000.0, -1000.0, 9000.0);
    let t = SphericalTriangle::new(a, a + Vec3::X, a + Vec3::Y).unwrap();
    let mut counts = [0; 4];
    for i in 0..256 {
        let u = Vec2::new((i % 16) as f32 + 0.5, (i / 16) as f32 + 0.5) / 16.0;
        let b = t.sample(u).barycentric;
        counts[b.iter().position(|&b| b > 0.5).unwrap_or(3)] += 1;
        assert!((t.inverse(t.sample(u).direction) - u).abs().max_element() < 0.2, "within what f32 directions hold");
    }
    assert!(counts.iter().all(|c| (56..=72).contains(c)), "{counts:?}");
}

#[test]
fn degenerate_polygons_are_none() {
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    for [a, b, c] in [
        [x, x, y],
        [x, y, y],
        [x, y, x + y],
        [x, -x, y],
        [Vec3::ZERO, x, y],
        [x, y, Vec3::NAN],
        [x, y, Vec3::INFINITY],
        [z * 1e30, z * 1e30 + x, z * 1e30 + y],
    ] {
        assert!(SphericalTriangle::new(a, b, c).is_none(), "{a} {b} {c}");
    }
    for [p, corner, ex, ey] in [
        [z, Vec3::ZERO, Vec3::ZERO, y],
        [z, Vec3::ZERO, x, x],
        [Vec3::ZERO, x, x, y],
        [z, Vec3::ZERO, x, Vec3::NAN],
        [z * 1e30, Vec3::ZERO, x, y],
        [Vec3::NAN, Vec3::ZERO, x, y],
    ] {
        assert!(SphericalRectangle::new(p, corner, ex, ey).is_none(), "{p} {corner} {ex} {ey}");
    }
}

fn vector() -> impl Strategy<Value = Vec3> {
    let number = || prop_oneof![-1f32..1.0, Just(0.0f32), -1e4f32..1e4, -1e-4f32..1e-4];
    (number(), number(), number()).prop_map(Vec3::from)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 10_000, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn triangles_never_fail(a in vector(), b in vector(), c in vector(), i in 0usize..25) {
        let u = corners().nth(i).unwrap();
        if let Some(t) = SphericalTriangle::new(a, b, c) {
            prop_assert!(t.solid_angle() > 0.0 && t.solid_angle() <= TAU && t.pdf() > 0.0 && t.pdf().is_finite());
            let s = t.sample(u);
            prop_assert!((s.direction.length() - 1.0).abs() < 1e-5, "{s:?}");
            prop_assert!(s.barycentric.iter().all(|b| (0.0..=1.0).contains(b)), "{s:?}");
            prop_assert!((s.barycentric.iter().sum::<f32>() - 1.0).abs() < 1e-5, "{s:?}");
            let v = t.inverse(s.direction);
            prop_assert!(v.is_finite());
        }
    }

    #[test]
    fn rectangles_never_fail(p in vector(), corner in vector(), x in vector(), y in vector(), i in 0usize..25) {
        let u = corners().nth(i).unwrap();
        if let Some(r) = SphericalRectangle::new(p, corner, x, y) {
            prop_assert!(r.solid_angle() > 0.0 && r.solid_angle() <= TAU && r.pdf() > 0.0 && r.pdf().is_finite());
            let s = r.sample(u);
            prop_assert!(s.is_finite());
            let along = (s - corner).dot(x.normalize());
            prop_assert!(along >= -0.01 && along <= x.length() * 1.000_01 + 0.01, "{along} {}", x.length());
            prop_assert!(r.inverse(s).is_finite());
        }
    }
}
