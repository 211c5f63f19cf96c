//! Finding the sigmoid polynomial of an RGB colour.

use glam::{DMat3, DVec3};

use crate::observer::{NANOMETRES, nanometre, xyz_bar};
use crate::{DenseSpectrum, SigmoidPolynomial};

/// Fits sigmoid polynomials to the RGB colours of one colour space.
///
/// Minimises the CIELAB difference between the colour of the reflectance under the space's white and the wanted colour, as
/// Jakob & Hanika 2019 do, by the method of Levenberg and Marquardt. For every colour that some reflectance has the
/// difference is driven to zero.
#[derive(Clone, Debug)]
pub(crate) struct SigmoidFitter {
    /// The polynomial's variable at every whole nanometre.
    variable: Vec<f64>,
    /// The weights of each nanometre for X, Y and Z relative to white.
    weight: [Vec<f64>; 3],
    coarse: CoarseQuadrature,
    /// From RGB to XYZ relative to white.
    relative_xyz_from_rgb: DMat3,
}

/// How a fit trades time for accuracy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Effort {
    /// Every whole nanometre in `f64`.
    Exact,
    /// The same with few steps, for starts that are close already.
    Polish,
    /// Every ten nanometres in `f32`, about twenty times as fast: for tables, which interpolate anyway.
    Fast,
}

/// How many steps lead from grey to the wanted colour; each starts at the solution of the one before.
const CONTINUATION_STEPS: u32 = 8;

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
        Self {
            coarse: CoarseQuadrature::new(&weight),
            variable,
            weight,
            relative_xyz_from_rgb: DMat3::from_diagonal(white.recip()) * xyz_from_rgb,
        }
    }

    /// The polynomial of a colour; components are clamped to `[0, 1]`, NaN counts as zero.
    pub(crate) fn fit(&self, rgb: [f32; 3]) -> SigmoidPolynomial {
        let rgb = rgb.map(|c| if c > 0.0 { c.min(1.0) } else { 0.0 });
        if rgb[0] == rgb[1] && rgb[1] == rgb[2] {
            return SigmoidPolynomial::constant(rgb[0]);
        }
        let rgb = DVec3::from(rgb.map(f64::from));
        let (solution, _) = self.refine(rgb, self.approach(rgb), Effort::Exact);
        SigmoidPolynomial::new(solution.as_vec3().to_array())
    }

    /// A fast solution for a colour in the closed unit cube that needs no start: it follows the way from grey.
    pub(crate) fn approach(&self, rgb: DVec3) -> DVec3 {
        let grey = DVec3::splat((self.relative_xyz_from_rgb * rgb).y.clamp(1e-9, 1.0 - 1e-9));
        let mut solution = DVec3::new(0.0, 0.0, (grey.x - 0.5) / (grey.x * (1.0 - grey.x)).sqrt());
        for step in 1..=CONTINUATION_STEPS {
            let wanted = grey.lerp(rgb, f64::from(step) / f64::from(CONTINUATION_STEPS));
            (solution, _) = self.refine(wanted, solution, Effort::Fast);
        }
        solution
    }

    /// The polynomial (c₀, c₁, c₂) of a colour in the closed unit cube, by a search that begins at `start`, with
    /// the squared CIELAB difference that is left.
    pub(crate) fn refine(&self, rgb: DVec3, start: DVec3, effort: Effort) -> (DVec3, f64) {
        // The squared CIELAB difference that is good enough, and the steps at most.
        // Colours without a reflectance never get there: they are done when a step brings too little.
        let (tolerance, iterations, least_progress) = match effort {
            Effort::Exact => (1e-14, 60, 1e-6),
            Effort::Polish => (1e-6, 3, 1e-3),
            Effort::Fast => (1e-6, 20, 1e-3),
        };
        let target = lab(self.relative_xyz_from_rgb * rgb).0;
        // Steeper polynomials than this are steps within a nanometre; very dark and very bright colours need
        // large constants.
        let large = |distance: f64| 10.0 / distance.max(1e-12).sqrt();
        let limit = 200.0 + large(rgb.max_element()) + large(1.0 - rgb.min_element());
        let mut solution = start;
        let (mut residual, mut jacobian) = self.residual(solution, target, effort);
        let mut error = residual.length_squared();
        let mut damping = 1e-6;
        for _ in 0..iterations {
            if error < tolerance {
                break;
            }
            let gradient = jacobian.transpose() * residual;
            let normal = jacobian.transpose() * jacobian;
            let diagonal = DVec3::new(normal.x_axis.x, normal.y_axis.y, normal.z_axis.z);
            let damped = normal + DMat3::from_diagonal(diagonal * damping + DVec3::splat(1e-30));
            let next = (solution - damped.inverse() * gradient).clamp(DVec3::splat(-limit), DVec3::splat(limit));
            let (next_residual, next_jacobian) = self.residual(next, target, effort);
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
            if progress < least_progress {
                break;
            }
        }
        (solution, error)
    }

    /// The CIELAB difference from `target` of a polynomial's colour, with its derivatives by the coefficients.
    fn residual(&self, c: DVec3, target: DVec3, effort: Effort) -> (DVec3, DMat3) {
        let (xyz, derivative) = match effort {
            Effort::Exact | Effort::Polish => self.exact_xyz(c),
            Effort::Fast => self.coarse.xyz(c),
        };
        let (lab, lab_derivative) = lab(xyz);
        (lab - target, lab_derivative * derivative)
    }

    /// A polynomial's XYZ relative to white, with its derivatives by the coefficients.
    fn exact_xyz(&self, c: DVec3) -> (DVec3, DMat3) {
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
        (xyz, derivative)
    }
}

/// Spacing of the coarse nodes in nm.
const SPACING: usize = 10;
/// How many coarse nodes there are: 350, 360 … 840 nm.
const COARSE: usize = 50;
/// SIMD lanes of the coarse sums.
const WIDTH: usize = 4;
/// Groups of lanes that hold all nodes.
const GROUPS: usize = COARSE.div_ceil(WIDTH);

/// The same integrals with nodes every ten nanometres.
///
/// The weights of the whole nanometres are moved to the four nodes around them by cubic Lagrange interpolation, so the
/// sums are exact for reflectances that are cubic between nodes.
#[derive(Clone, Debug)]
struct CoarseQuadrature {
    variable: [[f32; WIDTH]; GROUPS],
    weight: [[[f32; WIDTH]; 3]; GROUPS],
}

impl CoarseQuadrature {
    fn new(weight: &[Vec<f64>; 3]) -> Self {
        let mut coarse = [[0.0; 3]; GROUPS * WIDTH];
        for i in 0..NANOMETRES {
            // The cell of four nodes whose middle holds the nanometre; node n is at 350 + 10n nm.
            let first = (i / SPACING).min(COARSE - 4);
            let s = (i + SPACING - first * SPACING) as f64 / SPACING as f64;
            for node in 0..4 {
                let lagrange: f64 =
                    (0..4).filter(|&k| k != node).map(|k| (s - k as f64) / (node as f64 - k as f64)).product();
                for (c, weight) in weight.iter().enumerate() {
                    coarse[first + node][c] += weight[i] * lagrange;
                }
            }
        }
        Self {
            variable: std::array::from_fn(|g| {
                std::array::from_fn(|l| (((g * WIDTH + l) * SPACING) as f32 + 350.0 - 595.0) / 235.0)
            }),
            weight: std::array::from_fn(|g| {
                std::array::from_fn(|c| std::array::from_fn(|l| coarse[g * WIDTH + l][c] as f32))
            }),
        }
    }

    /// A polynomial's XYZ relative to white, with its derivatives by the coefficients.
    fn xyz(&self, c: DVec3) -> (DVec3, DMat3) {
        let [c0, c1, c2] = c.as_vec3().to_array();
        // By channel: the sums of value, slope·t², slope·t, slope.
        let mut sums = [[[0.0f32; WIDTH]; 4]; 3];
        for (variable, weight) in self.variable.iter().zip(&self.weight) {
            let mut terms = [[0.0f32; WIDTH]; 4];
            for l in 0..WIDTH {
                let t = variable[l];
                let p = (c0 * t + c1) * t + c2;
                let r = 1.0 / (1.0 + p * p).sqrt();
                let slope = 0.5 * r * r * r;
                terms[0][l] = 0.5 + 0.5 * p * r;
                terms[1][l] = slope * t * t;
                terms[2][l] = slope * t;
                terms[3][l] = slope;
            }
            for (sums, weight) in sums.iter_mut().zip(weight) {
                for (sum, term) in sums.iter_mut().zip(&terms) {
                    for l in 0..WIDTH {
                        sum[l] += weight[l] * term[l];
                    }
                }
            }
        }
        let total = |term: usize| DVec3::from(sums.map(|s| f64::from(s[term].iter().sum::<f32>())));
        (total(0), DMat3::from_cols(total(1), total(2), total(3)))
    }
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
    pub(crate) fn colour(space: &RgbColorSpace, p: SigmoidPolynomial) -> [f32; 3] {
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
        let n = 9;
        for i in 0..n * n * n {
            let rgb = [i % n, i / n % n, i / n / n].map(|k| k as f32 / (n - 1) as f32);
            let error = roundtrip_error(space, rgb);
            assert!(error < 1e-5, "{rgb:?}: {error}");
        }
    }

    #[test]
    fn dark_bright_and_nearly_grey_colours_are_reproduced() {
        let space = RgbColorSpace::srgb();
        for rgb in [
            [1e-3, 0.0, 0.0],
            [0.0, 1e-4, 2e-4],
            [1e-8, 0.0, 1e-9],
            [0.5, 0.5, 0.500_001],
            [0.0, 0.0, 0.999_999],
            [1.0, 1.0, 0.999],
            [0.999, 1.0, 1.0],
            [1.0, 0.001, 0.001],
        ] {
            let error = roundtrip_error(space, rgb);
            assert!(error < 1e-5, "{rgb:?}: {error}");
        }
    }

    #[test]
    fn the_color_checker_is_reproduced() {
        // The published 8-bit sRGB values of the chart's coloured patches (X-Rite).
        let patches = [
            [115, 82, 68],
            [194, 150, 130],
            [98, 122, 157],
            [87, 108, 67],
            [133, 128, 177],
            [103, 189, 170],
            [214, 126, 44],
            [80, 91, 166],
            [193, 90, 99],
            [94, 60, 108],
            [157, 188, 64],
            [224, 163, 46],
            [56, 61, 150],
            [70, 148, 73],
            [175, 54, 60],
            [231, 199, 31],
            [187, 86, 149],
            [8, 133, 161],
        ];
        let space = RgbColorSpace::srgb();
        for patch in patches {
            let p = space.to_sigmoid(patch.map(crate::encoding::srgb8_to_linear));
            assert_eq!(colour(space, p).map(crate::encoding::linear_to_srgb8), patch);
            // Natural colours have spectra without steep flanks.
            let steepest = (360..830).map(|l| (p.value(l as f32 + 1.0) - p.value(l as f32)).abs()).fold(0.0, f32::max);
            assert!(steepest < 0.02, "{patch:?}: {steepest} per nm");
        }
    }

    #[test]
    fn moderate_colours_of_wide_spaces_are_reproduced() {
        for name in RgbColorSpace::NAMES {
            let space = RgbColorSpace::named(name).unwrap();
            for rgb in [[0.3, 0.4, 0.5], [0.6, 0.3, 0.25], [0.2, 0.5, 0.2], [0.9, 0.85, 0.8]] {
                let error = roundtrip_error(space, rgb);
                assert!(error < 1e-5, "{name} {rgb:?}: {error}");
            }
        }
    }

    #[test]
    fn colours_that_no_reflectance_has_come_close() {
        // Pure BT.2020 red is a monochromatic light; as a reflectance it can't be that bright.
        for (name, rgb) in
            [("rec2020", [1.0, 0.0, 0.0]), ("aces2065-1", [0.0, 0.0, 1.0]), ("aces2065-1", [0.0, 1.0, 0.0])]
        {
            let space = RgbColorSpace::named(name).unwrap();
            let p = space.to_sigmoid(rgb);
            assert!(p.coefficients.iter().all(|c| c.is_finite()), "{p:?}");
            let back = colour(space, p);
            let largest = (0..3).max_by(|&a, &b| back[a].total_cmp(&back[b])).unwrap();
            assert_eq!(rgb[largest], 1.0, "{name} {rgb:?}: {back:?}");
        }
    }

    #[test]
    fn greys_are_exact_constants_and_odd_input_is_clamped() {
        let space = RgbColorSpace::srgb();
        for v in [0.0, 0.2, 1.0] {
            assert_eq!(space.to_sigmoid([v; 3]), SigmoidPolynomial::constant(v));
        }
        assert_eq!(space.to_sigmoid([f32::NAN, -1.0, -0.0]), SigmoidPolynomial::constant(0.0));
        assert_eq!(space.to_sigmoid([f32::INFINITY, 2.0, 1.0]), SigmoidPolynomial::constant(1.0));
    }

    #[test]
    fn polynomials_change_continuously_with_the_colour() {
        // Were there several solutions, neighbours could fall into different ones.
        let space = RgbColorSpace::srgb();
        for i in 0..200 {
            let f = |k: f32| 0.02 + 0.96 * ((i as f32 + 0.5) * k).fract();
            let rgb = [f(0.8191725), f(0.671_043_6), f(0.549_700_5)];
            let a = space.to_sigmoid(rgb);
            let b = space.to_sigmoid(rgb.map(|c| c + 1e-4));
            for lambda in (360..=830).step_by(10) {
                let change = (a.value(lambda as f32) - b.value(lambda as f32)).abs();
                assert!(change < 5e-3, "{rgb:?} at {lambda} nm: {change}");
            }
        }
    }
}
