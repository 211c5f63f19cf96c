//! Warps: inverses, and solid angles by other means.

use glam::{Vec2, Vec3};
use luz_sample::warp::*;

/// An even grid over the closed unit square, less one ulp at the upper ends.
fn near(u: Vec2, v: Vec2, what: &str) {
    assert!((u - v).abs().max_element() < 1e-5, "{what}: {u} {v}");
}

fn grid(n: u32) -> impl Iterator<Item = Vec2> {
    (0..n * n).map(move |i| {
        let u = Vec2::new((i % n) as f32, (i / n) as f32) / (n - 1) as f32;
        u.min(Vec2::splat(luz_sample::ONE_MINUS_EPSILON))
    })
}

#[test]
fn inverses_give_back_the_square() {
    // Away from the edges, where some maps glue points together.
    for u in grid(65).map(|u| 0.005 + 0.99 * u) {
        near(concentric_disk_inverse(concentric_disk(u)), u, "disk");
        near(uniform_hemisphere_inverse(uniform_hemisphere(u)), u, "uniform hemisphere");
        near(cosine_hemisphere_inverse(cosine_hemisphere(u)), u, "cosine hemisphere");
        near(uniform_sphere_inverse(uniform_sphere(u)), u, "sphere");
        near(uniform_triangle_inverse(uniform_triangle(u)), u, "triangle");
        for h in [1e-10, 1e-5, 0.3, 1.0, 1.9] {
            let v = uniform_cone_inverse(uniform_cone(u, h), h);
            near(v.expect("inside"), u, "cone");
        }
        for w in [[1.0, 2.0, 3.0, 4.0], [0.0, 1.0, 0.0, 0.5], [1e30, 1e30, 1e-3, 1e30], [0.0; 4]] {
            near(bilinear_inverse(bilinear(u, w), w), u, "bilinear");
        }
        near(Vec2::splat(tent_inverse(tent(u.x, 3.0), 3.0)), Vec2::splat(u.x), "tent");
        near(Vec2::splat(exponential_inverse(exponential(u.x, 3.0), 3.0)), Vec2::splat(u.x), "exponential");
    }
}

#[test]
fn spherical_polygons_map_back() {
    let p = Vec3::new(0.3, -0.2, 2.0);
    for scale in [1e-5, 1e-3, 0.1, 1.0, 10.0, 1e3] {
        let (x, y) = (scale * Vec3::new(1.0, 0.2, 0.1), scale * Vec3::new(-0.2, 1.0, 0.0));
        let r = SphericalRectangle::new(Vec3::ZERO, p, x, y).expect("not degenerate");
        let (t0, t1) = (SphericalTriangle::new(p, p + x, p + x + y), SphericalTriangle::new(p, p + x + y, p + y));
        let (t0, t1) = (t0.expect("not degenerate"), t1.expect("not degenerate"));
        let sum = t0.solid_angle() + t1.solid_angle();
        assert!((r.solid_angle() / sum - 1.0).abs() < 1e-5 + 1e-7 / scale, "{scale} {r:?} {sum}");
        // f32 points of the rectangle hold its coordinates to about 1e-7/scale only.
        for u in grid(33).map(|u| 0.01 + 0.98 * u) {
            if scale > 1e-3 {
                let v = r.inverse(r.sample(u));
                assert!((v - u).abs().max_element() < 1e-3, "{scale} {u} {v}");
                let v = t0.inverse(t0.sample(u).direction);
                assert!((v - u).abs().max_element() < 1e-3, "{scale} {u} {v}");
            }
        }
    }
}

#[test]
fn a_bilinear_point_comes_with_its_density() {
    let mut greatest = 0f32;
    for w in
        [[1.0, 2.0, 3.0, 4.0], [1e-10, 1.0, 1e-10, 0.5], [7e8, 7e8, 3e6, 1e7], [0.2; 4], [3e-13, 3e-13, 1e-14, 9e-13]]
    {
        for u in grid(32) {
            let (p, pdf) = bilinear_with_pdf(u, w);
            near(p, bilinear(u, w), "bilinear");
            greatest = greatest.max((pdf / bilinear_pdf(p, w) - 1.0).abs());
        }
    }
    assert!(greatest < 2e-6, "{greatest}");
}
