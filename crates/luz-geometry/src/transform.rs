//! Affine transforms, kept with their inverse.

use glam::{DMat4, DVec3, Mat4, Vec3};

use crate::{Bounds3, SurfacePoint, gamma};

/// Why a matrix is not a transform.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TransformError {
    /// An entry is NaN or infinite.
    NotFinite,
    /// The matrix has no inverse, or none that `f32` can hold.
    Singular,
    /// The last row is not `(0, 0, 0, w)` with `w ≠ 0`.
    NotAffine,
}

impl std::fmt::Display for TransformError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "the matrix has entries that are not finite",
            Self::Singular => "the matrix is not invertible",
            Self::NotAffine => "the matrix is not affine",
        })
    }
}

impl std::error::Error for TransformError {}

/// An invertible affine map of space, with its inverse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    matrix: Mat4,
    inverse: Mat4,
}

impl Default for Transform {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl TryFrom<Mat4> for Transform {
    type Error = TransformError;

    fn try_from(matrix: Mat4) -> Result<Self, TransformError> {
        Self::try_from_f64(matrix.as_dmat4())
    }
}

impl Transform {
    /// Leaves everything as it is.
    pub const IDENTITY: Self = Self { matrix: Mat4::IDENTITY, inverse: Mat4::IDENTITY };

    /// From a matrix that acts on column vectors, its inverse computed in `f64`.
    pub fn try_from_f64(matrix: DMat4) -> Result<Self, TransformError> {
        if !matrix.is_finite() || !matrix.as_mat4().is_finite() {
            return Err(TransformError::NotFinite);
        }
        let last = matrix.row(3);
        if last.truncate() != DVec3::ZERO {
            return Err(TransformError::NotAffine);
        }
        if last.w == 0.0 {
            return Err(TransformError::Singular);
        }
        let matrix = matrix * (1.0 / last.w);
        // The determinant's size says nothing (it scales with the cube of lengths): compare it to the columns' lengths.
        let linear = glam::DMat3::from_mat4(matrix);
        let volume = linear.x_axis.length() * linear.y_axis.length() * linear.z_axis.length();
        if volume == 0.0 || linear.determinant().abs() < 1e-14 * volume {
            return Err(TransformError::Singular);
        }
        let inverse = matrix.inverse().as_mat4();
        let rounded = matrix.as_mat4();
        if !inverse.is_finite() || !rounded.is_finite() {
            return Err(TransformError::Singular);
        }
        Ok(Self { matrix: rounded, inverse })
    }

    /// From a matrix and its inverse, which the caller knows to belong together.
    pub fn from_parts(matrix: Mat4, inverse: Mat4) -> Self {
        Self { matrix, inverse }
    }

    /// Whether `matrix` can be made a transform.
    pub fn is_invertible(matrix: &Mat4) -> bool {
        Self::try_from(*matrix).is_ok()
    }

    /// Moves by `by`.
    pub fn translate(by: Vec3) -> Self {
        Self { matrix: Mat4::from_translation(by), inverse: Mat4::from_translation(-by) }
    }

    /// Scales the axes by `by`.
    ///
    /// # Errors
    /// [`TransformError::Singular`] where a factor is zero.
    pub fn scale(by: Vec3) -> Result<Self, TransformError> {
        Self::try_from(Mat4::from_scale(by))
    }

    /// Turns by `angle` radians around `axis` (any length), counterclockwise when looking against the axis in a
    /// right-handed drawing, as in pbrt.
    ///
    /// # Errors
    /// [`TransformError::Singular`] where the axis is zero, [`TransformError::NotFinite`] where it or the angle is not finite.
    pub fn rotate(angle: f32, axis: Vec3) -> Result<Self, TransformError> {
        let axis = axis.as_dvec3();
        if !axis.is_finite() || !angle.is_finite() {
            return Err(TransformError::NotFinite);
        }
        let axis = axis.try_normalize().ok_or(TransformError::Singular)?;
        let matrix = DMat4::from_axis_angle(axis, f64::from(angle));
        Ok(Self { matrix: matrix.as_mat4(), inverse: matrix.transpose().as_mat4() })
    }

    /// From the world to a camera at `eye` that looks along +z to `target`, with +y towards `up` and +x to the right
    /// (left-handed, as pbrt's `LookAt`).
    ///
    /// # Errors
    /// [`TransformError::Singular`] where `eye = target` or `up` is parallel to the view.
    pub fn look_at(eye: Vec3, target: Vec3, up: Vec3) -> Result<Self, TransformError> {
        let (eye, target, up) = (eye.as_dvec3(), target.as_dvec3(), up.as_dvec3());
        let forward = (target - eye).try_normalize().ok_or(TransformError::Singular)?;
        let up = up.try_normalize().ok_or(TransformError::Singular)?;
        let right = up.cross(forward).try_normalize().ok_or(TransformError::Singular)?;
        let true_up = forward.cross(right);
        let world_from_camera =
            DMat4::from_cols(right.extend(0.0), true_up.extend(0.0), forward.extend(0.0), eye.extend(1.0));
        Ok(Self::try_from_f64(world_from_camera)?.inverse())
    }

    /// The matrix, for column vectors.
    #[inline]
    pub fn matrix(&self) -> &Mat4 {
        &self.matrix
    }

    /// The matrix of the inverse.
    #[inline]
    pub fn inverse_matrix(&self) -> &Mat4 {
        &self.inverse
    }

    /// The other way.
    #[inline]
    pub fn inverse(&self) -> Self {
        Self { matrix: self.inverse, inverse: self.matrix }
    }

    /// First `inner`, then this.
    pub fn compose(&self, inner: &Self) -> Self {
        let product = |a: &Mat4, b: &Mat4| (a.as_dmat4() * b.as_dmat4()).as_mat4();
        Self { matrix: product(&self.matrix, &inner.matrix), inverse: product(&inner.inverse, &self.inverse) }
    }

    /// Whether it turns left hands into right ones (negative determinant).
    pub fn swaps_handedness(&self) -> bool {
        glam::DMat3::from_mat4(self.matrix.as_dmat4()).determinant() < 0.0
    }

    /// Whether it leaves everything exactly as it is.
    pub fn is_identity(&self) -> bool {
        self.matrix == Mat4::IDENTITY
    }

    /// Maps a point.
    #[inline(always)]
    pub fn point(&self, p: Vec3) -> Vec3 {
        self.matrix.transform_point3(p)
    }

    /// Maps a point known up to ±`error` on each axis; returns the new point and its error bound.
    #[inline]
    pub fn point_with_error(&self, p: Vec3, error: Vec3) -> (Vec3, Vec3) {
        let m = &self.matrix;
        let (x, y, z, w) = (m.x_axis.truncate(), m.y_axis.truncate(), m.z_axis.truncate(), m.w_axis.truncate());
        let magnitude = (x * p.x).abs() + (y * p.y).abs() + (z * p.z).abs() + w.abs();
        let carried = x.abs() * error.x + y.abs() * error.y + z.abs() * error.z;
        (self.point(p), gamma(3) * magnitude + (gamma(3) + 1.0) * carried)
    }

    /// Maps a vector: no translation.
    #[inline(always)]
    pub fn vector(&self, v: Vec3) -> Vec3 {
        self.matrix.transform_vector3(v)
    }

    /// Maps a normal by the transposed inverse; not normalised.
    #[inline(always)]
    pub fn normal(&self, n: Vec3) -> Vec3 {
        let i = &self.inverse;
        Vec3::new(i.x_axis.truncate().dot(n), i.y_axis.truncate().dot(n), i.z_axis.truncate().dot(n))
    }

    /// The least box around the image of `b`, rounded outwards.
    pub fn bounds(&self, b: &Bounds3) -> Bounds3 {
        if b.is_empty() {
            return Bounds3::EMPTY;
        }
        let mut out = Bounds3::EMPTY;
        for corner in b.corners() {
            let (p, error) = self.point_with_error(corner, Vec3::ZERO);
            out = out.with_point(p - error).with_point(p + error);
        }
        out.expanded(0.0)
    }

    /// Maps everything that a surface point knows, normals again of length one.
    pub fn surface(&self, s: &SurfacePoint) -> SurfacePoint {
        let (position, position_error) = self.point_with_error(s.position, s.position_error);
        let geometric_normal = self.normal(s.geometric_normal).normalize_or_zero();
        let unscaled = self.normal(s.shading_normal);
        let shading_normal = unscaled.normalize_or(geometric_normal);
        // The derivative of a normal that is then brought back to length one.
        let per_length = unscaled.length().max(f32::MIN_POSITIVE).recip();
        let normal_derivative = |d: Vec3| {
            let d = self.normal(d) * per_length;
            d - shading_normal * shading_normal.dot(d)
        };
        SurfacePoint {
            position,
            position_error,
            geometric_normal,
            shading_normal: if shading_normal.dot(geometric_normal) < 0.0 { -shading_normal } else { shading_normal },
            dpdu: self.vector(s.dpdu),
            dpdv: self.vector(s.dpdv),
            shading_dpdu: self.vector(s.shading_dpdu),
            shading_dpdv: self.vector(s.shading_dpdv),
            dndu: normal_derivative(s.dndu),
            dndv: normal_derivative(s.dndv),
            ..*s
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn look_at_is_left_handed_with_z_forward() {
        let camera = Transform::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, 2.0, 8.0), Vec3::Y).unwrap();
        assert!(camera.point(Vec3::new(1.0, 2.0, 8.0)).distance(Vec3::new(0.0, 0.0, 5.0)) < 1e-6);
        assert!(camera.point(Vec3::new(2.0, 2.0, 3.0)).distance(Vec3::X) < 1e-6);
        assert!(!camera.swaps_handedness());
    }

    #[test]
    fn what_is_not_invertible_is_refused() {
        assert_eq!(Transform::scale(Vec3::new(1.0, 0.0, 1.0)), Err(TransformError::Singular));
        assert_eq!(Transform::try_from(Mat4::from_scale(Vec3::splat(f32::NAN))), Err(TransformError::NotFinite));
        let flat = Mat4::from_cols_array(&[1., 2., 3., 0., 2., 4., 6., 0., 0., 0., 1., 0., 0., 0., 0., 1.]);
        assert!(!Transform::is_invertible(&flat));
        assert!(Transform::scale(Vec3::splat(1e-9)).is_ok());
        assert!(Transform::scale(Vec3::new(-1.0, 1.0, 1.0)).unwrap().swaps_handedness());
        assert_eq!(Transform::look_at(Vec3::ZERO, Vec3::Y, Vec3::Y), Err(TransformError::Singular));
    }

    #[test]
    fn normals_stay_perpendicular() {
        let t = Transform::scale(Vec3::new(3.0, 0.5, 1.0))
            .unwrap()
            .compose(&Transform::rotate(0.7, Vec3::new(1.0, 2.0, -0.3)).unwrap());
        let (a, b) = (Vec3::new(1.0, 0.2, -0.4), Vec3::new(-0.3, 0.9, 0.5));
        let n = t.normal(a.cross(b));
        assert!(n.dot(t.vector(a)).abs() < 1e-5 && n.dot(t.vector(b)).abs() < 1e-5);
        assert!(t.inverse().point(t.point(a)).distance(a) < 1e-6);
    }
}
