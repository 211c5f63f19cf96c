//! Chance that can be repeated.

use glam::Vec3;
use luz_sample::random;

/// A number in `[0, 1)` that is a pure function of a point, a direction and a salt: for choices that a path makes on its
/// way (a hole in an alpha mask, one material of a mix), which must come out the same when the path is traced again.
pub(crate) fn chance(point: Vec3, direction: Vec3, salt: u32) -> f32 {
    let key = |v: Vec3| u64::from(v.x.to_bits()) | (u64::from(v.y.to_bits()) << 32);
    let rest = u64::from(point.z.to_bits()) | (u64::from(direction.z.to_bits()) << 32);
    random::unit_f32((random::hash(key(point), key(direction), rest, salt) >> 32) as u32)
}
