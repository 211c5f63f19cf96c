//! The current transformation: two matrices, kept in double precision, and which of them directives act on.

use crate::description::TransformSet;
use glam::{DMat3, DMat4, DVec3};

/// Start and end transformation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Transforms {
    pub matrices: [DMat4; 2],
    /// Does a directive act on the start, on the end?
    pub active: [bool; 2],
}

/// Why a matrix cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MatrixFault {
    /// It has no inverse.
    Singular,
    /// Together with what came before it leaves the range of `f32`.
    OutOfRange,
}

impl Transforms {
    pub const IDENTITY: Self = Self { matrices: [DMat4::IDENTITY; 2], active: [true; 2] };

    /// Multiplies from the right: what comes later in the file acts first.
    pub fn concatenate(&mut self, matrix: DMat4) -> Result<(), MatrixFault> {
        self.apply(matrix, |current| current * matrix)
    }

    /// Replaces.
    pub fn set(&mut self, matrix: DMat4) -> Result<(), MatrixFault> {
        self.apply(matrix, |_| matrix)
    }

    fn apply(&mut self, given: DMat4, change: impl Fn(DMat4) -> DMat4) -> Result<(), MatrixFault> {
        if !is_invertible(given) {
            return Err(MatrixFault::Singular);
        }
        let mut changed = *self;
        for (matrix, active) in changed.matrices.iter_mut().zip(self.active) {
            if active {
                *matrix = change(*matrix);
                let single = matrix.as_mat4();
                if !single.is_finite() || !is_invertible(single.as_dmat4()) {
                    return Err(MatrixFault::OutOfRange);
                }
            }
        }
        *self = changed;
        Ok(())
    }

    /// Both inverses.
    pub fn inverse(&self) -> Self {
        Self { matrices: self.matrices.map(|m| m.inverse()), ..*self }
    }

    /// Rounded to single precision.
    pub fn to_set(self) -> TransformSet {
        let [start, end] = self.matrices.map(|m| m.as_mat4());
        TransformSet { start, end }
    }
}

/// Are the columns of its linear part independent (to 12 digits) and all entries finite?
fn is_invertible(matrix: DMat4) -> bool {
    let linear = DMat3::from_mat4(matrix);
    // Lengths are divided out first, so that no scale is too small or large.
    let columns = [linear.x_axis, linear.y_axis, linear.z_axis].map(DVec3::normalize_or_zero);
    let [x, y, z] = columns;
    let determinant = DMat3::from_cols(x, y, z).determinant();
    matrix.is_finite() && determinant.abs() > 1e-12 && matrix.determinant() != 0.0
}

/// Translation.
pub(crate) fn translate(v: [f32; 3]) -> DMat4 {
    DMat4::from_translation(DVec3::from(v.map(f64::from)))
}

/// Scaling along the axes.
pub(crate) fn scale(v: [f32; 3]) -> DMat4 {
    DMat4::from_scale(DVec3::from(v.map(f64::from)))
}

/// Rotation by `degrees` about an axis; `None` for an axis of length zero.
pub(crate) fn rotate(degrees: f32, axis: [f32; 3]) -> Option<DMat4> {
    let axis = DVec3::from(axis.map(f64::from)).try_normalize()?;
    Some(DMat4::from_axis_angle(axis, f64::from(degrees).to_radians()))
}

/// From world space to the space of a camera at `eye` that looks at `target` along +z, with `up` in its y-z plane
/// and x = up × z (left-handed, as in pbrt). `None` if the three leave the orientation open.
pub(crate) fn look_at(v: [f32; 9]) -> Option<DMat4> {
    let v = v.map(f64::from);
    let vector = |i: usize| DVec3::new(v[i], v[i + 1], v[i + 2]);
    let (eye, target, up) = (vector(0), vector(3), vector(6));
    let forward = (target - eye).try_normalize()?;
    let right = up.try_normalize()?.cross(forward);
    // Below this, the direction of `right` is rounding error of the decimals.
    let right = (right.length() > 1e-10).then(|| right.normalize())?;
    let new_up = forward.cross(right);
    let world_from_camera =
        DMat4::from_cols(right.extend(0.0), new_up.extend(0.0), forward.extend(0.0), eye.extend(1.0));
    Some(world_from_camera.inverse())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn later_directives_act_first() {
        let mut t = Transforms::IDENTITY;
        t.concatenate(translate([1.0, 0.0, 0.0])).unwrap();
        t.concatenate(scale([2.0, 2.0, 2.0])).unwrap();
        assert_eq!(t.to_set().start.transform_point3(Vec3::ONE), Vec3::new(3.0, 2.0, 2.0));
    }

    #[test]
    fn rotation_is_counterclockwise_about_the_axis() {
        let m = rotate(90.0, [0.0, 0.0, 2.0]).unwrap().as_mat4();
        assert!((m.transform_vector3(Vec3::X) - Vec3::Y).length() < 1e-6);
        assert_eq!(rotate(90.0, [0.0; 3]), None);
    }

    #[test]
    fn look_at_is_left_handed() {
        // pbrt: from the origin towards +z with y up, x points to the right: nothing changes.
        let m = look_at([0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0]).unwrap();
        assert_eq!(m, DMat4::IDENTITY);
        let m = look_at([0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]).unwrap().as_mat4();
        assert!((m.transform_point3(Vec3::ZERO) - Vec3::new(0.0, 0.0, 5.0)).length() < 1e-6);
        assert!((m.transform_vector3(Vec3::X) - Vec3::NEG_X).length() < 1e-6);
        assert_eq!(look_at([0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 3.0, 0.0]), None);
        assert_eq!(look_at([1.0; 9]), None);
    }

    #[test]
    fn singular_and_overflowing_matrices_change_nothing() {
        let mut t = Transforms::IDENTITY;
        assert_eq!(t.concatenate(scale([1.0, 0.0, 1.0])), Err(MatrixFault::Singular));
        let flat =
            DMat4::from_cols_array(&[1.0, 2.0, 3.0, 0.0, 2.0, 4.0, 6.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        assert_eq!(t.set(flat), Err(MatrixFault::Singular));
        assert_eq!(t, Transforms::IDENTITY);
        t.concatenate(scale([1e30; 3])).unwrap();
        assert_eq!(t.concatenate(scale([1e30; 3])), Err(MatrixFault::OutOfRange));
        // A flat scale is no singular one.
        let mut t = Transforms::IDENTITY;
        t.concatenate(scale([1.0, 1e-20, 1.0])).unwrap();
    }

    #[test]
    fn only_active_transforms_change() {
        let mut t = Transforms::IDENTITY;
        t.active = [false, true];
        t.concatenate(translate([1.0, 0.0, 0.0])).unwrap();
        assert!(t.to_set().is_animated());
        assert_eq!(t.matrices[0], DMat4::IDENTITY);
    }
}
