//! Finding the sigmoid polynomial of an RGB colour.

use glam::{DMat3, DVec3};

use crate::observer::{NANOMETRES, nanometre, xyz_bar};
use crate::{DenseSpectrum, SigmoidPolynomial};

/// Fits sigmoid polynomials to the RGB colours of one colour space.
///
/// Minimises the CIELAB difference between the colour of the reflectance under the space's white and the wanted colour, as
/// Jakob & Hanika 2019 do, by the method of Levenberg and Marquardt in `f64`. For every colour that some reflectance has
/// the difference is driven to zero.
#[derive(Clone, Debug)]
pub(crate) struct SigmoidFitter {
    /// The polynomial's variable at each node of the quadrature.
    variable: Vec<f64>,
    /// The weights of each node for X, Y and Z relative to white.
    weight: [Vec<f64>; 3],
    /// From RGB to XYZ relative to white.
    relative_xyz_from_rgb: DMat3,
}

/// How many steps lead from grey to the wanted colour; each starts at the solution of the one before.
const CONTINUATION_STEPS: u32 = 8;
/// Steps of the solver at most.
const MAX_ITERATIONS: u32 = 60;
/// The solver is done at this squared CIELAB difference.
const SQUARED_TOLERANCE: f64 = 1e-14;

impl SigmoidFitter {
    /// Prepares the quadrature for a space with this white and this matrix from RGB to XYZ.
    pub(crate) fn new(illuminant: &DenseSpectrum, xyz_from_rgb: DMat3) -> Self {
        let mut weight = [const { Vec::new() }; 3];
        let mut variable = Vec::with_capacity(NANOMETRES);
        for i in 0..NANOMETRES {
            variable.push(f64::from(nanometre(i) - 595.0) / 235.0);
            for (weight, bar) in weight.iter_mut().zip(xyz_bar(i)) {
                weight.push(f64::from(bar) * f64::from(illuminant.values()[i]));
            }
        }
        for weight in &mut weight {
            let sum: f64 = weight.iter().sum();
            weight.iter_mut().for_each(|w| *w /= sum);
        }
        let white = xyz_from_rgb * DVec3::ONE;
        Self { variable, weight, relative_xyz_from_rgb: DMat3::from_diagonal(white.recip()) * xyz_from_rgb }
    }

    /// The polynomial of a colour; components are clamped to `[0, 1]`, NaN counts as zero.
    pub(crate) fn fit(&self, rgb: [f32; 3]) -> SigmoidPolynomial {
        let rgb = rgb.map(|c| if c > 0.0 { c.min(1.0) } else { 0.0 });
        if rgb[0] == rgb[1] && rgb[1] == rgb[2] {
            return SigmoidPolynomial::constant(rgb[0]);
        }
        let target = DVec3::from(rgb.map(f64::from));
        let grey = DVec3::splat((self.relative_xyz_from_rgb * target).y.clamp(1e-9, 1.0 - 1e-9));
        let mut solution = constant(grey.x);
        for step in 1..=CONTINUATION_STEPS {
            let wanted = grey.lerp(target, f64::from(step) / f64::from(CONTINUATION_STEPS));
            solution = self.refine(wanted, solution);
        }
        SigmoidPolynomial::new(solution.as_vec3().to_array())
    }

    /// The polynomial (c₀, c₁, c₂) of a colour in the open unit cube, starting the search at `start`.
    pub(crate) fn refine(&self, rgb: DVec3, start: DVec3) -> DVec3 {
        let target = lab(self.relative_xyz_from_rgb * rgb).0;
        // Steeper polynomials than this are steps within a nanometre; dark colours need large constants.
        let limit = 200.0 + 4.0 / rgb.max_element().max(1e-12).sqrt();
        let mut solution = start;
        let (mut residual, mut jacobian) = self.residual(solution, target);
        let mut error = residual.length_squared();
        let mut damping = 1e-6;
        for _ in 0..MAX_ITERATIONS {
            if error < SQUARED_TOLERANCE {
                break;
            }
            let gradient = jacobian.transpose() * residual;
            let normal = jacobian.transpose() * jacobian;
            let diagonal = DVec3::new(normal.x_axis.x, normal.y_axis.y, normal.z_axis.z);
            let damped = normal + DMat3::from_diagonal(diagonal * damping + DVec3::splat(1e-30));
            let next = (solution - damped.inverse() * gradient).clamp(DVec3::splat(-limit), DVec3::splat(limit));
            let (next_residual, next_jacobian) = self.residual(next, target);
            let next_error = next_residual.length_squared();
            if next_error.is_nan() || next_error >= error {
                damping = (damping * 8.0).max(1e-9);
                if damping > 1e12 {
                    break;
                }
                continue;
            }
            let progress = 1.0 - next_error / error;
            (solution, residual, jacobian, error) = (next, next_residual, next_jacobian, next_error);
            damping *= 0.1;
            if progress < 1e-9 {
                break;
            }
        }
        solution
    }

    /// The CIELAB difference from `target` of a polynomial's colour, with its derivatives by the coefficients.
    fn residual(&self, c: DVec3, target: DVec3) -> (DVec3, DMat3) {
        let mut xyz = DVec3::ZERO;
        let mut derivative = DMat3::ZERO;
        let [wx, wy, wz] = &self.weight;
        for (((&t, &x), &y), &z) in self.variable.iter().zip(wx).zip(wy).zip(wz) {
            let p = (c.x * t + c.y) * t + c.z;
            let r = 1.0 / (1.0 + p * p).sqrt();
            let value = 0.5 + 0.5 * p * r;
            let slope = 0.5 * r * r * r;
            let weight = DVec3::new(x, y, z);
            xyz += weight * value;
            derivative.x_axis += weight * (slope * t * t);
            derivative.y_axis += weight * (slope * t);
            derivative.z_axis += weight * slope;
        }
        let (lab, lab_derivative) = lab(xyz);
        (lab - target, lab_derivative * derivative)
    }
}

/// The constant polynomial of a grey in (0, 1).
fn constant(value: f64) -> DVec3 {
    DVec3::new(0.0, 0.0, (value - 0.5) / (value * (1.0 - value)).sqrt())
}

/// CIELAB of XYZ relative to white, with its derivatives.
fn lab(xyz: DVec3) -> (DVec3, DMat3) {
    const DELTA: f64 = 6.0 / 29.0;
    let compress = |t: f64| {
        if t > DELTA * DELTA * DELTA {
            let root = t.cbrt();
            (root, root / (3.0 * t))
        } else {
            (t / (3.0 * DELTA * DELTA) + 4.0 / 29.0, 1.0 / (3.0 * DELTA * DELTA))
        }
    };
    let ((x, dx), (y, dy), (z, dz)) = (compress(xyz.x), compress(xyz.y), compress(xyz.z));
    let value = DVec3::new(116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z));
    let derivative = DMat3::from_cols(
        DVec3::new(0.0, 500.0 * dx, 0.0),
        DVec3::new(116.0 * dy, -500.0 * dy, 200.0 * dy),
        DVec3::new(0.0, 0.0, -200.0 * dz),
    );
    (value, derivative)
}

#[cfg(test)]
mod tests {
    use crate::{RgbColorSpace, SigmoidPolynomial};

    /// The RGB colour of a reflectance under its space's white.
    fn colour(space: &RgbColorSpace, p: SigmoidPolynomial) -> [f32; 3] {
        let xyz = crate::observer::integrate_xyz(|l| p.value(l) * space.illuminant().value(l))
            .map(|v| (v / f64::from(crate::CIE_Y_INTEGRAL)) as f32);
        space.from_xyz(xyz)
    }

    fn roundtrip_error(space: &RgbColorSpace, rgb: [f32; 3]) -> f32 {
        let back = colour(space, space.to_sigmoid(rgb));
        (0..3).map(|c| (back[c] - rgb[c]).abs()).fold(0.0, f32::max)
    }

    #[test]
    fn the_whole_srgb_cube_is_reproduced() {
        let space = RgbColorSpace::srgb();
        let steps = 8;
        let mut worst: (f32, [f32; 3]) = (0.0, [0.0; 3]);
        for i in 0..(steps + 1) * (steps + 1) * (steps + 1) {
            let rgb = [i % (steps + 1), i / (steps + 1) % (steps + 1), i / (steps + 1) / (steps + 1)]
                .map(|k| k as f32 / steps as f32);
            let error = roundtrip_error(space, rgb);
            if error > 1e-4 {
                eprintln!("{rgb:?} {error} {:?}", space.to_sigmoid(rgb));
            }
            worst = if error > worst.0 { (error, rgb) } else { worst };
        }
        assert!(worst.0 < 1e-3, "{worst:?}");
    }
}
