//! Maps between directions and the unit square, for environment maps and panoramic cameras.

use glam::{IVec2, Vec2, Vec3};
use luz_image::WrapMode;
use std::f32::consts::{FRAC_PI_4, PI, TAU};

/// How a square picture covers the sphere of directions. `z` is up: it is at the centre of an equal-area map and along
/// the top edge of a latitude–longitude map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SphereMap {
    /// The equal-area octahedral map of Clarberg 2008, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD".
    EqualArea,
    /// Longitude along u from +x towards +y, polar angle along v.
    LatitudeLongitude,
}

impl SphereMap {
    /// The unit direction at `uv`; coordinates beyond `[0, 1]` go on across the border.
    pub fn direction(self, uv: Vec2) -> Vec3 {
        match self {
            Self::EqualArea => equal_area_direction(wrap_equal_area(uv)),
            Self::LatitudeLongitude => {
                let (sin_theta, cos_theta) = (uv.y * PI).sin_cos();
                let (sin_phi, cos_phi) = (uv.x * TAU).sin_cos();
                Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
            }
        }
    }

    /// The index, row by row, of a texel of an image of `size` that may lie beyond its border: on a map of latitudes and
    /// longitudes columns go round, and the first and last row go on.
    pub fn texel(self, at: IVec2, [width, height]: [usize; 2]) -> usize {
        let (x, y) = (i64::from(at.x), i64::from(at.y));
        let (x, y) = match self {
            Self::EqualArea => WrapMode::Octahedral.apply(x, y, width, height).unwrap_or_default(),
            Self::LatitudeLongitude => (x.rem_euclid(width as i64) as usize, y.clamp(0, height as i64 - 1) as usize),
        };
        y * width + x
    }

    /// The coordinates in `[0, 1]²` of a unit direction.
    pub fn coordinates(self, direction: Vec3) -> Vec2 {
        match self {
            Self::EqualArea => equal_area_coordinates(direction),
            Self::LatitudeLongitude => {
                let phi = direction.y.atan2(direction.x) / TAU;
                // atan2 over acos: full precision at the poles.
                let theta = direction.truncate().length().atan2(direction.z) / PI;
                Vec2::new(if phi < 0.0 { (phi + 1.0).min(1.0) } else { phi }, theta.clamp(0.0, 1.0))
            }
        }
    }
}

fn equal_area_direction(uv: Vec2) -> Vec3 {
    let p = uv * 2.0 - 1.0;
    let a = p.abs();
    // Distance from the square's diagonals |u| + |v| = 1, which map to the equator.
    let to_equator = 1.0 - (a.x + a.y);
    let r = 1.0 - to_equator.abs();
    let phi = if r == 0.0 { FRAC_PI_4 } else { ((a.y - a.x) / r + 1.0) * FRAC_PI_4 };
    let radius = r * (2.0 - r * r).max(0.0).sqrt();
    let (sin, cos) = phi.sin_cos();
    Vec3::new((cos * radius).copysign(p.x), (sin * radius).copysign(p.y), (1.0 - r * r).copysign(to_equator))
}

fn equal_area_coordinates(direction: Vec3) -> Vec2 {
    let a = direction.abs();
    let r = (1.0 - a.z).max(0.0).sqrt();
    let phi = if a.x == 0.0 && a.y == 0.0 { 0.0 } else { a.y.atan2(a.x) * (2.0 / PI) };
    let mut v = phi * r;
    let mut u = r - v;
    if direction.z < 0.0 {
        (u, v) = (1.0 - v, 1.0 - u);
    }
    (Vec2::new(u.copysign(direction.x), v.copysign(direction.y)) * 0.5 + 0.5).clamp(Vec2::ZERO, Vec2::ONE)
}

/// Folds coordinates a little beyond the square back into it: edges of the octahedral map are glued to themselves.
fn wrap_equal_area(mut uv: Vec2) -> Vec2 {
    if uv.x < 0.0 {
        uv = Vec2::new(-uv.x, 1.0 - uv.y);
    } else if uv.x > 1.0 {
        uv = Vec2::new(2.0 - uv.x, 1.0 - uv.y);
    }
    if uv.y < 0.0 {
        uv = Vec2::new(1.0 - uv.x, -uv.y);
    } else if uv.y > 1.0 {
        uv = Vec2::new(1.0 - uv.x, 2.0 - uv.y);
    }
    uv
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_invert_each_other() {
        for map in [SphereMap::EqualArea, SphereMap::LatitudeLongitude] {
            for i in 0..64 {
                for j in 0..64 {
                    let uv = Vec2::new((i as f32 + 0.5) / 64.0, (j as f32 + 0.5) / 64.0);
                    let direction = map.direction(uv);
                    assert!((direction.length() - 1.0).abs() < 1e-5);
                    assert!(map.coordinates(direction).distance(uv) < 1e-4, "{map:?} {uv}");
                }
            }
        }
    }

    /// Cells of equal area in the square subtend equal solid angles: the mean of z over octants and of |z| are exact.
    #[test]
    fn the_octahedral_map_keeps_areas() {
        let n = 512;
        let (mut above, mut z_abs) = (0, 0.0f64);
        for i in 0..n {
            for j in 0..n {
                let d =
                    SphereMap::EqualArea.direction(Vec2::new((i as f32 + 0.5) / n as f32, (j as f32 + 0.5) / n as f32));
                above += i32::from(d.z > 0.5);
                z_abs += f64::from(d.z.abs());
            }
        }
        let total = f64::from(n * n);
        assert!((f64::from(above) / total - 0.25).abs() < 2e-3);
        assert!((z_abs / total - 0.5).abs() < 1e-4);
    }

    #[test]
    fn axes_and_their_signed_zeros_stay_in_the_square() {
        for map in [SphereMap::EqualArea, SphereMap::LatitudeLongitude] {
            for axis in [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z, Vec3::new(-1.0, -0.0, 0.0)] {
                let uv = map.coordinates(axis);
                assert!(uv.cmpge(Vec2::ZERO).all() && uv.cmple(Vec2::ONE).all());
                assert!(map.direction(uv).distance(axis) < 1e-3, "{map:?} {axis}");
            }
        }
    }
}
