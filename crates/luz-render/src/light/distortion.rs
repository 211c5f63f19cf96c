//! What the transform of a light's space does to angles.

use glam::Vec3;
use luz_geometry::Transform;

/// True for rotations, reflections, and scales that are the same along all axes.
pub(super) fn keeps_angles(transform: &Transform) -> bool {
    let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| transform.vector(axis));
    let scale = x.length_squared().max(y.length_squared()).max(z.length_squared());
    let skew = x.dot(y).abs().max(y.dot(z).abs()).max(z.dot(x).abs());
    let least = x.length_squared().min(y.length_squared()).min(z.length_squared());
    skew <= 1e-4 * scale && scale - least <= 1e-4 * scale
}

/// The solid angle in a light's space by that in the world, about the unit direction `direction` in the world: 1 for
/// transforms that keep angles.
pub(super) fn local_solid_angle(world_from_light: &Transform, direction: Vec3) -> f32 {
    // Of a linear map M, dω' = |det M| dω / |M ω|³.
    let length = world_from_light.inverse().vector(direction).length();
    let factor = world_from_light.inverse_matrix().determinant().abs() / (length * length * length);
    if factor.is_finite() { factor } else { 0.0 }
}
