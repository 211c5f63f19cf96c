//! Drawing points from flat shapes that are small against their distance: in proportion to what their corners contribute to the
//! irradiance of the reference point, bilinearly in between. Nearly as good as sampling by solid angle, at a fraction of the cost.

use std::ops::Range;

use glam::{Vec3, Vec4};

use super::Reference;

/// Four points as they are seen from a reference point, axis by axis, so that all are looked at together.
#[derive(Clone, Copy)]
pub(super) struct Seen {
    relative: [Vec4; 3],
    /// Their distances, squared.
    pub distances_squared: Vec4,
}

impl Seen {
    #[inline(always)]
    pub fn new(reference: &Reference, [x, y, z]: [Vec4; 3]) -> Self {
        let p = reference.position;
        let (x, y, z) = (x - Vec4::splat(p.x), y - Vec4::splat(p.y), z - Vec4::splat(p.z));
        Self { relative: [x, y, z], distances_squared: x * x + y * y + z * z }
    }

    /// What the points contribute, relative to one at `distance_squared`: with the shape's own cosine in proportion to 1 / d,
    /// cos θ / d³.
    #[inline(always)]
    pub fn irradiance_weights(&self, normal: Option<Vec3>, distance_squared: f32) -> Vec4 {
        /// Of the cosine, about, so that no point is left out.
        const LEAST: f32 = 0.01;
        let [x, y, z] = self.relative;
        let near = Vec4::splat(distance_squared) / self.distances_squared;
        match normal {
            // With d cos θ, the height above the tangent plane: cos θ / d³ is that over d⁴.
            Some(n) => {
                let height = (x * Vec4::splat(n.x) + y * Vec4::splat(n.y) + z * Vec4::splat(n.z)).abs();
                height.max(Vec4::splat(LEAST * distance_squared.sqrt())) * (near * near)
            }
            None => near * near.sqrt(),
        }
    }
}

/// Is a shape of a certain extent small against its distance?
#[inline(always)]
pub(super) fn is_far(extent_squared: f32, distance_squared: f32) -> bool {
    /// The largest ratio, squared.
    const FAR: f32 = 0.64;
    /// Of squared distances, for powers to stay in range.
    const RANGE: Range<f32> = 1e-20..1e30;
    extent_squared <= FAR * distance_squared && RANGE.contains(&distance_squared)
}
