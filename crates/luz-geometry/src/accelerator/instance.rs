//! Groups placed in the world.

use glam::Vec3;

use crate::{AnimatedTransform, Bounds3, Ray, Transform};

/// Where a group stands.
#[derive(Clone, Debug, PartialEq)]
pub enum InstanceTransform {
    /// At rest.
    Static(Transform),
    /// In motion.
    Animated(Box<AnimatedTransform>),
}

impl From<Transform> for InstanceTransform {
    fn from(transform: Transform) -> Self {
        Self::Static(transform)
    }
}

impl From<AnimatedTransform> for InstanceTransform {
    fn from(transform: AnimatedTransform) -> Self {
        if transform.is_animated() {
            Self::Animated(Box::new(transform))
        } else {
            Self::Static(transform.interpolate(0.0))
        }
    }
}

impl InstanceTransform {
    /// From the group to the world at `time`.
    #[inline]
    pub fn at(&self, time: f32) -> Transform {
        match self {
            Self::Static(transform) => *transform,
            Self::Animated(transform) => transform.interpolate(time),
        }
    }

    /// The ray in the space of the group, and how much of it was skipped, in units of `t`: as far as the rounding of its
    /// origin may have moved it back.
    #[inline]
    pub(super) fn to_object(&self, ray: &Ray) -> (Ray, f32) {
        match self {
            Self::Static(transform) => to_object(transform, ray),
            Self::Animated(transform) => to_object(&transform.interpolate(ray.time), ray),
        }
    }
}

#[inline]
fn to_object(transform: &Transform, ray: &Ray) -> (Ray, f32) {
    let inverse = transform.inverse();
    let (origin, error) = inverse.point_with_error(ray.origin, Vec3::ZERO);
    let direction = inverse.vector(ray.direction);
    let skipped = direction.abs().dot(error) / direction.length_squared();
    let skipped = if skipped.is_finite() { skipped } else { 0.0 };
    (Ray { origin: origin + direction * skipped, direction, ..*ray }, skipped)
}

/// A group and where it stands.
#[derive(Clone, Debug)]
pub(super) struct Instance {
    pub group: u32,
    pub placement: InstanceTransform,
}

impl Instance {
    pub fn new(group: u32, placement: InstanceTransform) -> Self {
        Self { group, placement }
    }

    /// The box around it at all times.
    pub fn bounds(&self, group: &Bounds3) -> Bounds3 {
        match &self.placement {
            InstanceTransform::Static(transform) => transform.bounds(group),
            InstanceTransform::Animated(transform) => transform.motion_bounds(group),
        }
    }
}
