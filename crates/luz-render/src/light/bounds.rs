//! How much light of a group of lights can arrive at a point, at most, roughly.
//!
//! Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting", section 4, with the
//! receiver's cosine as in pbrt-v4.

use glam::{Vec3, Vec4};
use luz_geometry::{Bounds3, Reference};
use std::f32::consts::{FRAC_PI_2, PI};

/// Where lights are, where they shine, and how strongly: a box, a cone of normals, and a cone around each normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightBounds {
    /// What the lights lie in.
    pub bounds: Bounds3,
    /// Unit axis of the cone that holds all normals.
    pub axis: Vec3,
    /// Cosine of that cone's half angle; −1 where normals point anywhere.
    pub cos_normals: f32,
    /// Cosine of the greatest angle between a normal and the light that leaves around it.
    pub cos_emission: f32,
    /// Photometric strength: at a distance `d` they give, facing and unoccluded, the irradiance `strength / d²`. Radiant
    /// intensity of a point, radiance times area of a surface.
    pub strength: f32,
    /// True if light leaves on both sides.
    pub two_sided: bool,
}

impl LightBounds {
    /// A point that shines into all directions.
    pub fn point(position: Vec3, strength: f32) -> Self {
        Self::cone(position, Vec3::Z, -1.0, strength)
    }

    /// A point that shines evenly into the cone around `axis` with half angle `acos(cos_cone)`.
    pub fn cone(position: Vec3, axis: Vec3, cos_cone: f32, strength: f32) -> Self {
        let bounds = Bounds3 { min: position, max: position };
        // A little more than the cone, for rounding.
        Self { bounds, axis, cos_normals: cos_cone.max(-1.0), cos_emission: 0.999, strength, two_sided: false }
    }

    /// The bounds of both together.
    pub fn union(&self, other: &Self) -> Self {
        // Which of two sides is the front of a two-sided light is arbitrary.
        let turned = other.two_sided && self.axis.dot(other.axis) < 0.0;
        let other_axis = if turned { -other.axis } else { other.axis };
        let (axis, cos_normals) = union_of_cones((self.axis, self.cos_normals), (other_axis, other.cos_normals));
        Self {
            bounds: self.bounds.union(other.bounds),
            axis,
            cos_normals,
            cos_emission: self.cos_emission.min(other.cos_emission),
            strength: self.strength + other.strength,
            two_sided: self.two_sided || other.two_sided,
        }
    }

    /// The cost by which splits are judged, without the box's share: strength times the measure of the directions that
    /// light leaves into (Conty Estevez and Kulla 2018, equation 1).
    pub(super) fn orientation_cost(&self) -> f32 {
        let theta_o = self.cos_normals.clamp(-1.0, 1.0).acos();
        let theta_w = (theta_o + self.cos_emission.clamp(-1.0, 1.0).acos()).min(PI);
        let (sin_o, cos_o) = theta_o.sin_cos();
        let measure = 2.0 * PI * (1.0 - cos_o)
            + FRAC_PI_2 * (2.0 * theta_w * sin_o - (theta_o - 2.0 * theta_w).cos() - 2.0 * theta_o * sin_o + cos_o);
        self.strength * measure
    }
}

/// The least cone around two, each an axis and the cosine of the half angle.
pub(super) fn union_of_cones((a, cos_a): (Vec3, f32), (b, cos_b): (Vec3, f32)) -> (Vec3, f32) {
    const WHOLE: (Vec3, f32) = (Vec3::Z, -1.0);
    // Rounding must not lose a normal.
    const SLACK: f64 = 1e-6;
    if cos_a <= -1.0 || cos_b <= -1.0 {
        return WHOLE;
    }
    let angle = |cos: f32| f64::from(cos.clamp(-1.0, 1.0)).acos();
    let (theta_a, theta_b) = (angle(cos_a), angle(cos_b));
    let (from, to) = (a.as_dvec3(), b.as_dvec3());
    let between = from.cross(to).length().atan2(from.dot(to));
    if between + theta_b <= theta_a + SLACK {
        return (a, cos_a);
    }
    if between + theta_a <= theta_b + SLACK {
        return (b, cos_b);
    }
    let theta = (theta_a + between + theta_b) / 2.0 + SLACK;
    let turn = from.cross(to);
    if theta >= std::f64::consts::PI || turn.length_squared() == 0.0 {
        return WHOLE;
    }
    let axis = glam::DQuat::from_axis_angle(turn.normalize(), theta - SLACK - theta_a) * from;
    (axis.as_vec3().normalize(), theta.cos() as f32)
}

/// How many lights or groups are asked at once.
pub(super) const LANES: usize = 8;

/// How many of them fill a register everywhere.
const QUAD: usize = 4;

/// Several [`LightBounds`] as they are asked, side by side: the sphere around the box instead of the box.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Beacons([Quad; LANES / QUAD]);

/// Four of them.
#[derive(Clone, Debug, PartialEq)]
struct Quad {
    center: [Vec4; 3],
    radius_squared: Vec4,
    axis: [Vec4; 3],
    cos_normals: Vec4,
    sin_normals: Vec4,
    cos_emission: Vec4,
    /// Zero where there is nothing.
    strength: Vec4,
    /// One where light leaves on one side, minus one where on both: the greater of the cosine and this times it counts.
    mirror: Vec4,
}

impl Default for Quad {
    fn default() -> Self {
        Self {
            center: [Vec4::ZERO; 3],
            radius_squared: Vec4::ZERO,
            axis: [Vec4::ZERO; 3],
            cos_normals: Vec4::NEG_ONE,
            sin_normals: Vec4::ZERO,
            cos_emission: Vec4::ZERO,
            strength: Vec4::ZERO,
            mirror: Vec4::ONE,
        }
    }
}

/// What grazes is not left out, lest rounding decide whether it can be chosen at all.
const LEAST_COSINE: Vec4 = Vec4::splat(1e-4);
/// Finite, so that sums and quotients are.
const GREATEST_IMPORTANCE: Vec4 = Vec4::splat(1e30);
/// The square of a distance that counts as one.
const LEAST_SQUARED: Vec4 = Vec4::splat(1e-30);

/// Cosine and sine of `max(0, a − b)`, of angles given by their cosines and sines.
#[inline(always)]
fn difference((cos_a, sin_a): (Vec4, Vec4), (cos_b, sin_b): (Vec4, Vec4)) -> (Vec4, Vec4) {
    let within = cos_a.cmpgt(cos_b);
    let (cos, sin) = (cos_a * cos_b + sin_a * sin_b, sin_a * cos_b - cos_a * sin_b);
    (Vec4::select(within, Vec4::ONE, cos), Vec4::select(within, Vec4::ZERO, sin))
}

#[inline(always)]
fn with_sine(cos: Vec4) -> (Vec4, Vec4) {
    (cos, (Vec4::ONE - cos * cos).max(Vec4::ZERO).sqrt())
}

#[inline(always)]
fn dot(a: [Vec4; 3], b: [Vec4; 3]) -> Vec4 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Beacons {
    /// Puts bounds into a lane. Lanes are filled from the first on.
    pub fn set(&mut self, lane: usize, bounds: &LightBounds) {
        let (quad, lane) = (&mut self.0[lane / QUAD], lane % QUAD);
        let center = bounds.bounds.center();
        for k in 0..3 {
            quad.center[k][lane] = center[k];
            quad.axis[k][lane] = bounds.axis[k];
        }
        quad.radius_squared[lane] = 0.25 * bounds.bounds.diagonal().length_squared();
        quad.cos_normals[lane] = bounds.cos_normals;
        quad.sin_normals[lane] = (1.0 - bounds.cos_normals * bounds.cos_normals).max(0.0).sqrt();
        quad.cos_emission[lane] = bounds.cos_emission;
        quad.strength[lane] = bounds.strength;
        quad.mirror[lane] = if bounds.two_sided { -1.0 } else { 1.0 };
    }

    /// Whether a lane holds anything.
    pub fn has(&self, lane: usize) -> bool {
        self.0[lane / QUAD].strength[lane % QUAD] > 0.0
    }

    /// Of each lane about the irradiance at `reference`, as bright as it can be for any light in the box; 0 only where
    /// none arrives.
    #[inline]
    pub fn importances(&self, reference: &Reference) -> [f32; LANES] {
        let mut importances = [0.0; LANES];
        for (quad, importances) in self.0.iter().zip(importances.chunks_exact_mut(QUAD)) {
            if quad.strength.x > 0.0 {
                importances.copy_from_slice(&quad.importances(reference).to_array());
            }
        }
        importances
    }
}

impl Quad {
    #[inline(always)]
    fn importances(&self, reference: &Reference) -> Vec4 {
        let p = reference.position.to_array();
        let from: [Vec4; 3] = [0, 1, 2].map(|k| Vec4::splat(p[k]) - self.center[k]);
        let distance_squared = dot(from, from);
        // Within the sphere light may come from anywhere; the distance is its radius at least.
        let far_squared = distance_squared.max(self.radius_squared).max(LEAST_SQUARED);
        let inverse = Vec4::ONE / distance_squared.max(LEAST_SQUARED).sqrt();
        // The angle under which the sphere is seen, and by which all others may be less.
        let sin_squared = self.radius_squared / far_squared;
        let seen = ((Vec4::ONE - sin_squared).sqrt(), sin_squared.sqrt());
        let cos = dot(from, self.axis) * inverse;
        let cos = cos.max(cos * self.mirror).max(Vec4::NEG_ONE).min(Vec4::ONE);
        let beyond = difference(with_sine(cos), (self.cos_normals, self.sin_normals));
        let (emitted, _) = difference(beyond, seen);
        let received = match reference.normal {
            Some(n) => {
                let cos = (dot(from, n.to_array().map(Vec4::splat)) * inverse).abs().min(Vec4::ONE);
                difference(with_sine(cos), seen).0
            }
            None => Vec4::ONE,
        };
        let inside = distance_squared.cmple(self.radius_squared);
        let cosines = Vec4::select(inside, Vec4::ONE, (emitted * received).max(LEAST_COSINE));
        let arrives = inside | emitted.cmpge(self.cos_emission);
        let importance = (self.strength * cosines / far_squared).min(GREATEST_IMPORTANCE);
        Vec4::select(arrives, importance, Vec4::ZERO)
    }
}

#[cfg(test)]
impl LightBounds {
    /// About the irradiance at `reference`: [`Beacons::importances`] of one.
    pub(super) fn importance(&self, reference: &Reference) -> f32 {
        let mut beacons = Beacons::default();
        beacons.set(0, self);
        beacons.importances(reference)[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use luz_geometry::Frame;
    use luz_sample::Samples;
    use luz_sample::random::Random;
    use luz_sample::warp::{uniform_cone, uniform_sphere};

    /// No light within the bounds gives more than their importance says, wherever it is and however it is turned.
    #[test]
    fn importance_is_an_upper_bound() {
        for i in 0..20_000 {
            let mut random = Random::new(5, 0, i);
            let corner =
                |random: &mut Random| Vec3::new(random.next_1d(), random.next_1d(), random.next_1d()) * 2.0 - 1.0;
            let bounds = Bounds3::from_points([corner(&mut random), corner(&mut random)]);
            let axis = uniform_sphere(random.next_2d());
            let cos_normals = 1.0 - random.next_1d();
            let two_sided = random.next_1d() < 0.3;
            let group = LightBounds { bounds, axis, cos_normals, cos_emission: 0.0, strength: 1.0, two_sided };
            let reference = Reference::surface(corner(&mut random) * 3.0, uniform_sphere(random.next_2d()));
            let importance = group.importance(&reference);
            let fraction = Vec3::new(random.next_1d(), random.next_1d(), random.next_1d());
            let position = bounds.min + fraction * bounds.diagonal();
            let normal = Frame::from_z(axis).to_world(uniform_cone(random.next_2d(), 1.0 - cos_normals));
            let from = reference.position - position;
            let direction = from.normalize();
            let cos = if two_sided { normal.dot(direction).abs() } else { normal.dot(direction) };
            if cos <= 1e-3 {
                continue;
            }
            // But for the distance, of which the centre's stands for all.
            let received = reference.normal.map_or(1.0, |n| n.dot(direction).abs());
            let radius = 0.5 * bounds.diagonal().length();
            let nearest = ((reference.position - bounds.center()).length()).max(radius);
            assert!(
                cos * received <= importance * nearest * nearest * 1.001 + 1e-5,
                "{i}: {} {importance}",
                cos * received
            );
        }
    }

    #[test]
    fn a_union_holds_both_cones() {
        for i in 0..5_000 {
            let mut random = Random::new(6, 0, i);
            let mut cone = || (uniform_sphere(random.next_2d()), 1.0 - 1.5 * random.next_1d());
            let (a, b) = (cone(), cone());
            let (axis, cos) = union_of_cones(a, b);
            for (inner, cos_inner) in [a, b] {
                for k in 0..16 {
                    let u = glam::Vec2::new(1.0 - f32::EPSILON, k as f32 / 16.0);
                    let rim = Frame::from_z(inner).to_world(uniform_cone(u, 1.0 - cos_inner));
                    assert!(rim.dot(axis) >= cos - 1e-5, "{i}: {rim} {axis} {cos}");
                }
            }
        }
    }

    #[test]
    fn lights_that_face_away_have_no_importance() {
        let floor = Bounds3 { min: Vec3::new(-1.0, -1.0, 0.0), max: Vec3::new(1.0, 1.0, 0.0) };
        let mut up = LightBounds {
            bounds: floor,
            axis: Vec3::Z,
            cos_normals: 1.0,
            cos_emission: 0.0,
            strength: 1.0,
            two_sided: false,
        };
        let below = Reference::point(Vec3::new(0.0, 0.0, -9.0));
        assert_eq!(up.importance(&below), 0.0);
        up.two_sided = true;
        assert!(up.importance(&below) > 0.0);
    }
}
