//! Chance that can be repeated.

use glam::Vec3;
use luz_sample::random;

/// A number in `[0, 1)` that is a pure function of a ray: for choices on its way (a hole in an alpha mask), which must
/// come out the same when the path is traced again.
pub(crate) fn chance_of_ray(origin: Vec3, direction: Vec3) -> f32 {
    of_vectors(origin, direction, 0)
}

/// A number in `[0, 1)` that is a pure function of a point and a salt: for what stands there (one material of a mix),
/// which must be the same whichever way a path goes through it.
pub(crate) fn chance_at(point: Vec3, salt: u32) -> f32 {
    of_vectors(point, Vec3::ZERO, salt)
}

/// A seed that is a pure function of a point: for values there that are estimates themselves, whose errors would otherwise be
/// the same all over a surface.
pub(crate) fn seed_at(point: Vec3) -> u64 {
    hash_of_vectors(point, Vec3::ZERO, 0)
}

fn of_vectors(point: Vec3, direction: Vec3, salt: u32) -> f32 {
    random::unit_f32((hash_of_vectors(point, direction, salt) >> 32) as u32)
}

fn hash_of_vectors(point: Vec3, direction: Vec3, salt: u32) -> u64 {
    let key = |v: Vec3| u64::from(v.x.to_bits()) | (u64::from(v.y.to_bits()) << 32);
    let rest = u64::from(point.z.to_bits()) | (u64::from(direction.z.to_bits()) << 32);
    random::hash(key(point), key(direction), rest, salt)
}
