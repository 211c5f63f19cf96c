//! χ² tests of every warp against its density, with a family-wise significance of 0.01 (Šidák), and proof that they reject
//! densities which are wrong.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};
use luz_sample::test_support::{Chi2Result, chi2_interval, chi2_rectangle, chi2_sphere, sidak};
use luz_sample::warp::*;

const SAMPLES: u64 = 200_000;
/// Upper bound of the number of χ² tests in this file.
const TESTS: usize = 100;

fn accept(result: Chi2Result, what: &str) {
    assert!(result.passes(sidak(0.01, TESTS)), "{what}: {result:?}");
}

fn reject(result: Chi2Result, what: &str) {
    assert!(!result.passes(1e-6), "{what}: {result:?}");
}

fn indicator(inside: bool, density: f32) -> f64 {
    if inside { f64::from(density) } else { 0.0 }
}

#[test]
fn disk() {
    let run = |pdf: fn(Vec2) -> f64| {
        let square = [-1.0, 1.0, -1.0, 1.0];
        chi2_rectangle(|u| Some(concentric_disk(u)), pdf, square, [24, 24], SAMPLES, 1)
    };
    accept(run(|p| indicator(p.length_squared() <= 1.000_001, concentric_disk_pdf())), "disk");
    reject(run(|p| indicator(p.length_squared() <= 1.000_001, (0.9 + 0.15 * p.length()) / PI)), "disk");
}

#[test]
fn hemispheres_and_sphere() {
    let above = |w: Vec3| w.z >= 0.0;
    accept(
        chi2_sphere(|u| Some(uniform_hemisphere(u)), |w| indicator(above(w), uniform_hemisphere_pdf()), SAMPLES, 2),
        "uniform hemisphere",
    );
    accept(
        chi2_sphere(|u| Some(cosine_hemisphere(u)), |w| f64::from(cosine_hemisphere_pdf(w.z)), SAMPLES, 3),
        "cosine hemisphere",
    );
    accept(chi2_sphere(|u| Some(uniform_sphere(u)), |_| f64::from(uniform_sphere_pdf()), SAMPLES, 4), "uniform sphere");
    // A cosine that is two per cent off at its ends, of the right integral.
    let tilted = |w: Vec3| f64::from(cosine_hemisphere_pdf(w.z)) * (1.0 + 0.03 * f64::from(w.x));
    reject(chi2_sphere(|u| Some(cosine_hemisphere(u)), tilted, 5 * SAMPLES, 3), "tilted cosine");
    // A density of the wrong integral, and one that is zero where samples fall.
    reject(
        chi2_sphere(|u| Some(cosine_hemisphere(u)), |w| 1.02 * f64::from(cosine_hemisphere_pdf(w.z)), SAMPLES, 3),
        "two per cent too much",
    );
    reject(chi2_sphere(|u| Some(uniform_sphere(u)), |w| indicator(above(w), 0.159), SAMPLES, 3), "impossible");
}

#[test]
fn narrow_lobes_are_seen() {
    // Lobes exp(κ (cos θ − 1)) around tilted axes, down to a width of half a degree, as a rough BSDF's are.
    for (seed, kappa) in [(80, 3.0f64), (81, 100.0), (82, 1e4)] {
        let axis = Vec3::new(0.5, -0.3, 0.6).normalize();
        let (s, t) = axis.any_orthonormal_pair();
        let sample = |u: Vec2| {
            let h = -(-f64::from(u.x) * -f64::exp_m1(-2.0 * kappa)).ln_1p() / kappa;
            let r = (h * (2.0 - h)).sqrt() as f32;
            let (sin, cos) = (u.y * 2.0 * PI).sin_cos();
            Some((axis * (1.0 - h) as f32 + s * (r * cos) + t * (r * sin)).normalize())
        };
        let density = |w: Vec3, kappa: f64| {
            let h = 0.5 * (w - axis).as_dvec3().length_squared();
            kappa / (2.0 * f64::from(PI) * -f64::exp_m1(-2.0 * kappa)) * (-kappa * h).exp()
        };
        accept(chi2_sphere(sample, |w| density(w, kappa), SAMPLES, seed), "lobe");
        reject(chi2_sphere(sample, |w| density(w, 1.05 * kappa), SAMPLES, seed), "narrower lobe");
        reject(chi2_sphere(sample, |w| 0.98 * density(w, kappa), SAMPLES, seed), "two per cent missing");
    }
}

#[test]
fn failures_take_the_missing_density() {
    // The part of the sphere above z = −0.5; the rest fails.
    let sample = |u| Some(uniform_sphere(u)).filter(|w| w.z > -0.5);
    accept(chi2_sphere(sample, |w| indicator(w.z > -0.5, uniform_sphere_pdf()), SAMPLES, 5), "cut sphere");
    reject(chi2_sphere(sample, |w| indicator(w.z > -0.5, 1.0 / (3.0 * PI)), SAMPLES, 5), "renormalised");
}

#[test]
fn cones() {
    for (seed, h) in [(6, 0.01f32), (7, 0.3), (8, 1.0), (9, 1.99)] {
        let pdf = |w: Vec3| indicator(1.0 - w.z <= h * 1.000_01, uniform_cone_pdf(h));
        accept(chi2_sphere(|u| Some(uniform_cone(u, h)), pdf, SAMPLES, seed), "cone");
    }
    // Cones too small for the bins: in the plane, divided by their radius.
    for (seed, h) in [(10, 1e-12f32), (11, 1e-7)] {
        let radius = one_minus_cos_of_sin_squared(2.0 * h).sqrt() * std::f32::consts::SQRT_2;
        let sample = |u| Some(uniform_cone(u, h).truncate() / radius);
        let pdf = |p: Vec2| indicator(p.length() <= 1.00001, uniform_cone_pdf(h) * radius * radius);
        accept(chi2_rectangle(sample, pdf, [-1.001, 1.001, -1.001, 1.001], [24, 24], SAMPLES, seed), "tiny cone");
    }
}

#[test]
fn triangle() {
    let sample = |u| {
        let [b0, b1, b2] = uniform_triangle(u);
        assert!(b0 >= 0.0 && b1 >= 0.0 && b2 >= 0.0 && (b0 + b1 + b2 - 1.0).abs() < 1e-6);
        Some(Vec2::new(b0, b1))
    };
    let pdf = |p: Vec2| indicator(p.x + p.y <= 1.000_001, uniform_triangle_pdf(0.5));
    accept(chi2_rectangle(sample, pdf, [0.0, 1.0, 0.0, 1.0], [20, 20], SAMPLES, 12), "triangle");
}

/// Whether `w` passes through the triangle `a`, `b`, `c`.
fn through(w: Vec3, [a, b, c]: [Vec3; 3]) -> bool {
    let side = |p: Vec3, q: Vec3| w.dot(p.cross(q));
    let sign = a.dot(b.cross(c)).signum();
    let slack = -1e-6 * a.length() * b.length();
    sign * side(a, b) >= slack && sign * side(b, c) >= slack && sign * side(c, a) >= slack
}

#[test]
fn spherical_triangles() {
    let triangles = [
        [Vec3::X, Vec3::Y, Vec3::Z],
        [Vec3::new(1.0, 0.2, 0.1), Vec3::new(0.3, 2.0, 0.1), Vec3::new(-0.2, 0.1, -3.0)],
        // Nearly a hemisphere.
        [Vec3::new(1.0, 0.0, 0.01), Vec3::new(-0.5, 0.8, 0.01), Vec3::new(-0.5, -0.8, 0.01)],
        // A sliver.
        [Vec3::new(1.0, 0.0, 0.1), Vec3::new(0.0, 1.0, 0.0), Vec3::new(1.0, 0.0, -0.1)],
        [Vec3::new(0.3, 0.1, 1.0), Vec3::new(0.1, 0.2, 1.0), Vec3::new(0.0, -0.2, 1.0)],
    ];
    for (seed, [a, b, c]) in (20..).zip(triangles) {
        let t = SphericalTriangle::new(a, b, c).expect("not degenerate");
        let pdf = |w| indicator(through(w, [a, b, c]), t.pdf());
        accept(chi2_sphere(|u| Some(t.sample(u).direction), pdf, SAMPLES, seed), "spherical triangle");
        // Other orders of the corners are other maps, of the same density.
        let t = SphericalTriangle::new(b, a, c).expect("not degenerate");
        accept(chi2_sphere(|u| Some(t.sample(u).direction), pdf, SAMPLES, seed + 10), "spherical triangle");
        let sample = |u| {
            let b = t.sample(u).barycentric;
            assert!(b.iter().all(|&b| b >= 0.0) && (b.iter().sum::<f32>() - 1.0).abs() < 1e-6);
            Some(Vec2::new(b[0], b[1]))
        };
        // dω = |n·p| / |p|³ dA for the point p and the normal n; barycentric area is A/2.
        let normal = (b - a).cross(c - a).as_dvec3();
        let pdf = |p: Vec2| {
            let inside = p.x + p.y <= 1.000_001;
            let point = (p.x * b + p.y * a + (1.0 - p.x - p.y) * c).as_dvec3();
            indicator(inside, t.pdf()) * normal.dot(point).abs() / point.length().powi(3)
        };
        accept(chi2_rectangle(sample, pdf, [0.0, 1.0, 0.0, 1.0], [20, 20], SAMPLES, seed + 20), "barycentrics");
    }
}

#[test]
fn tiny_spherical_polygons_are_nearly_uniform_in_area() {
    for (seed, scale) in [(60, 1e-2f32), (61, 1e-4), (62, 1e-6)] {
        let (corner, x, y) = (Vec3::new(-0.3, 0.4, 5.0), scale * Vec3::new(1.0, 0.0, 0.0), scale * Vec3::Y);
        let t = SphericalTriangle::new(corner, corner + x * 1024.0, corner + y * 1024.0).expect("not degenerate");
        let small = SphericalTriangle::new(corner * 1024.0, corner * 1024.0 + x, corner * 1024.0 + y);
        if let Some(small) = small.filter(|_| scale >= 1e-2) {
            assert!(small.solid_angle() < 1e-11 && t.solid_angle() > small.solid_angle());
        }
        let r = SphericalRectangle::new(-corner, Vec3::ZERO, x, y).expect("not degenerate");
        let sample = |u| {
            let p = r.sample(u) / scale;
            Some(Vec2::new(p.x, p.y))
        };
        let size = [-0.000_001, 1.000_001, -0.000_001, 1.000_001];
        let pdf = |p: Vec2| {
            let p = (corner + p.x * x + p.y * y).as_dvec3();
            f64::from(r.pdf()) * f64::from(scale).powi(2) * p.z / p.length().powi(3)
        };
        accept(chi2_rectangle(sample, pdf, size, [10, 10], SAMPLES, seed), "tiny rectangle");
    }
}

#[test]
fn spherical_rectangles() {
    let (x, y) = (Vec3::new(2.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0));
    // In front, at the side, close above the middle, grazing, far away.
    let references =
        [[1.0, 0.5, 1.0], [-2.0, 3.0, -0.5], [0.7, 0.4, 0.001], [-1.0, 0.3, 1e-4], [200.0, -100.0, 3000.0]];
    for (seed, reference) in (40..).zip(references) {
        let r = SphericalRectangle::new(Vec3::from(reference), Vec3::ZERO, x, y).expect("not degenerate");
        let pdf = |p: Vec2| {
            let d = (Vec3::new(p.x, p.y, 0.0) - Vec3::from(reference)).as_dvec3();
            f64::from(r.pdf()) * d.z.abs() / d.length().powi(3)
        };
        let sample = |u| Some(r.sample(u).truncate());
        let rectangle = [-1e-6, 2.0 + 1e-6, -1e-6, 1.0 + 1e-6];
        accept(chi2_rectangle(sample, pdf, rectangle, [20, 20], SAMPLES, seed), "spherical rectangle");
    }
}

#[test]
fn numbers() {
    let run = |sample: &dyn Fn(f32) -> f32, pdf: &dyn Fn(f32) -> f32, ends, seed| {
        chi2_interval(sample, |x| f64::from(pdf(x)), ends, 100, SAMPLES, seed)
    };
    accept(run(&|u| exponential(u, 2.5), &|x| exponential_pdf(x, 2.5), [0.0, 3.0], 50), "exponential");
    reject(run(&|u| exponential(u, 2.5), &|x| exponential_pdf(x, 2.6), [0.0, 3.0], 50), "exponential");
    accept(run(&|u| normal(u, 1.0, 2.0), &|x| normal_pdf(x, 1.0, 2.0), [-5.0, 7.0], 51), "normal");
    reject(run(&|u| normal(u, 1.0, 2.0), &|x| normal_pdf(x, 1.05, 2.0), [-5.0, 7.0], 51), "normal");
    accept(run(&|u| tent(u, 1.5), &|x| tent_pdf(x, 1.5), [-1.5, 1.5], 52), "tent");
    reject(run(&|u| tent(u, 1.5), &|x| tent_pdf(x, 1.6), [-1.6, 1.6], 52), "tent");
    for (seed, (a, b)) in (53..).zip([(0.0, 1.0), (1.0, 0.0), (2.0, 3.0), (0.0, 0.0), (1e38, 3e38)]) {
        accept(run(&|u| linear(u.max(1e-7), a, b), &|x| linear_pdf(x, a, b), [0.0, 1.0], seed), "linear");
    }
}

#[test]
fn pairs() {
    let square = [-4.0, 4.0, -4.0, 4.0];
    let sample = |u| Some(box_muller(u)).filter(|p| p.abs().max_element() <= 4.0);
    accept(chi2_rectangle(sample, |p| f64::from(box_muller_pdf(p)), square, [30, 30], SAMPLES, 70), "Box–Muller");
    let skewed = |p: Vec2| f64::from(box_muller_pdf(p)) * (1.0 + 0.05 * f64::from(p.x * p.y));
    reject(chi2_rectangle(sample, skewed, square, [30, 30], SAMPLES, 70), "Box–Muller");
    let unit = [0.0, 1.0, 0.0, 1.0];
    for (seed, w) in (71..).zip([[1.0, 2.0, 3.0, 4.0], [0.0, 0.0, 1.0, 0.0], [5.0, 1.0, 0.0, 2.0], [0.0; 4]]) {
        let sample = |u: Vec2| Some(bilinear(u.max(Vec2::splat(1e-7)), w));
        accept(chi2_rectangle(sample, |p| f64::from(bilinear_pdf(p, w)), unit, [20, 20], SAMPLES, seed), "bilinear");
    }
}
