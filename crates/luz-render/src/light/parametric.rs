//! The parameters of a point of a primitive, from its position.

use glam::{DVec2, DVec3, Vec2, Vec3};
use luz_geometry::Shape;

/// The parameters, as `SurfacePoint::parametric` has them, of the point of a primitive at `position` with the texture
/// coordinates `uv`.
pub(super) fn parametric_at(shape: &Shape, primitive: usize, position: Vec3, uv: Vec2) -> Vec2 {
    let corner = |mesh: &[Vec3], index: u32| mesh[index as usize].as_dvec3();
    let position = position.as_dvec3();
    match shape {
        Shape::Triangles(mesh) => {
            let [a, b, c] = mesh.indices[primitive].map(|i| corner(&mesh.positions, i));
            solve(b - a, c - a, position - a).clamp(DVec2::ZERO, DVec2::ONE).as_vec2()
        }
        Shape::Bilinear(mesh) => {
            let [p00, p10, p01, p11] = mesh.indices[primitive].map(|i| corner(&mesh.positions, i));
            let (along, up, twist) = (p10 - p00, p01 - p00, p00 - p10 - p01 + p11);
            // Newton's method, on a map that is linear or nearly so.
            let mut p = DVec2::splat(0.5);
            for _ in 0..16 {
                let off = position - (p00 + along * p.x + up * p.y + twist * (p.x * p.y));
                let step = solve(along + twist * p.y, up + twist * p.x, off);
                p = (p + step).clamp(DVec2::splat(-0.5), DVec2::splat(1.5));
                if twist == DVec3::ZERO || step.abs().max_element() < 1e-9 {
                    break;
                }
            }
            p.clamp(DVec2::ZERO, DVec2::ONE).as_vec2()
        }
        // Of quadrics both are the same.
        Shape::Sphere(_) | Shape::Disk(_) | Shape::Cylinder(_) => uv,
    }
}

/// The `x` for which `x.x · a + x.y · b` comes nearest to `target`; zero where `a` and `b` are parallel.
fn solve(a: DVec3, b: DVec3, target: DVec3) -> DVec2 {
    let (aa, ab, bb) = (a.length_squared(), a.dot(b), b.length_squared());
    let (at, bt) = (a.dot(target), b.dot(target));
    let x = DVec2::new(at * bb - bt * ab, bt * aa - at * ab) / (aa * bb - ab * ab);
    if x.is_finite() { x } else { DVec2::ZERO }
}
