//! Precomputed sigmoid polynomials for textures.

use glam::DVec3;
use rayon::prelude::*;

use crate::SigmoidPolynomial;
use crate::sigmoid_fit::{Effort, SigmoidFitter};

/// Nodes along the two ratios of components.
const SIZE: usize = 48;
/// Nodes along the largest component.
const DEPTH: usize = 48;
/// Scaled polynomials whose slope exceeds this need the exact quadrature.
const STEEP: f64 = 16.0;
/// The largest component that stands for zero.
const BLACK: f64 = 1e-4;

/// Sigmoid polynomials for all colours of one RGB space, interpolated from a grid over the largest component and the two
/// others' ratios to it (Jakob & Hanika 2019, section 4).
///
/// In sRGB the colour of the interpolated reflectance is off by 0.00016 on average, by less than 0.001 for 99 % of the cube, and
/// by at most 0.005 close to white. Building takes about 0.2 s on two cores (several times as long for wide
/// spaces, in which many colours have no reflectance).
#[derive(Clone, Debug)]
pub struct SigmoidTable {
    /// Coefficients times [`regular_scale`] (the fourth number pads) by largest component, y, x, z.
    nodes: Vec<[f32; 4]>,
}

impl SigmoidTable {
    /// Solves for every node; rows of constant y are independent of each other, so they go in parallel.
    pub(crate) fn new(fitter: &SigmoidFitter) -> Self {
        let mut nodes = vec![[0.0; 4]; 3 * SIZE * SIZE * DEPTH];
        nodes.par_chunks_exact_mut(SIZE * DEPTH).enumerate().for_each(|(row, nodes)| {
            solve_row(fitter, row / SIZE, (row % SIZE) as f64 / (SIZE - 1) as f64, nodes);
        });
        Self { nodes }
    }

    /// The polynomial of an RGB colour; components are clamped to `[0, 1]`, NaN counts as zero. Grey gives an exact constant.
    pub fn lookup(&self, rgb: [f32; 3]) -> SigmoidPolynomial {
        let rgb = rgb.map(|c| if c > 0.0 { c.min(1.0) } else { 0.0 });
        if rgb[0] == rgb[1] && rgb[1] == rgb[2] {
            return SigmoidPolynomial::constant(rgb[0]);
        }
        let largest = if rgb[0] > rgb[1] && rgb[0] > rgb[2] {
            0
        } else if rgb[1] > rgb[2] {
            1
        } else {
            2
        };
        let z = rgb[largest];
        let inverse = 1.0 / z;
        let (x0, tx) = cell(rgb[(largest + 1) % 3] * inverse, SIZE);
        let (y0, ty) = cell(rgb[(largest + 2) % 3] * inverse, SIZE);
        let (z0, tz) = cell(1.0 - (1.0 - z).sqrt(), DEPTH);
        let along_z = |y: usize, x: usize| {
            let first = ((largest * SIZE + y) * SIZE + x) * DEPTH + z0;
            match self.nodes.get(first..first + 2) {
                Some([a, b]) => mix(*a, *b, tz),
                _ => [0.0; 4],
            }
        };
        let low = mix(along_z(y0, x0), along_z(y0, x0 + 1), tx);
        let high = mix(along_z(y0 + 1, x0), along_z(y0 + 1, x0 + 1), tx);
        let mean = (rgb[0] + rgb[1] + rgb[2]) * (1.0 / 3.0);
        let scale = 1.0 / (mean * (1.0 - mean)).max(1e-12).sqrt();
        let [c0, c1, c2, _] = mix(low, high, ty);
        SigmoidPolynomial::new([c0 * scale, c1 * scale, c2 * scale])
    }
}

/// The largest component z at a node: denser towards one, where polynomials change fast.
fn depth(index: usize) -> f64 {
    let u = index as f64 / (DEPTH - 1) as f64;
    u * (2.0 - u)
}

/// The node before a coordinate, and the fraction of the way to the next.
fn cell(coordinate: f32, size: usize) -> (usize, f32) {
    let position = coordinate * (size - 1) as f32;
    let index = (position as usize).min(size - 2);
    (index, position - index as f32)
}

impl SigmoidTable {
    /// A scale and a polynomial whose product has an RGB colour of any size, as for a texel of an environment map.
    ///
    /// The polynomial is that of a colour at most ½, as in [`crate::Spectrum::rgb_illuminant`]. Negative components and NaN
    /// count as zero; black has the scale zero.
    #[inline]
    pub fn lookup_scaled(&self, rgb: [f32; 3]) -> (f32, SigmoidPolynomial) {
        let scale = 2.0 * rgb[0].max(rgb[1]).max(rgb[2]).max(0.0);
        if scale == 0.0 {
            return (0.0, SigmoidPolynomial::constant(0.0));
        }
        (scale, self.lookup(rgb.map(|c| c / scale)))
    }
}

/// Linear interpolation of nodes.
#[inline(always)]
fn mix(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    std::array::from_fn(|i| a[i] + t * (b[i] - a[i]))
}

/// The nodes of one y, for all x and z: along x at a middle z, and from there up and down.
fn solve_row(fitter: &SigmoidFitter, largest: usize, y: f64, nodes: &mut [[f32; 4]]) {
    let middle = DEPTH / 3;
    let mut direction = DVec3::ONE;
    direction[(largest + 2) % 3] = y;
    let mut start = None;
    for x in (0..SIZE).rev() {
        direction[(largest + 1) % 3] = x as f64 / (SIZE - 1) as f64;
        let rgb = direction * depth(middle);
        let scale = regular_scale(rgb);
        let start = start.insert(match start {
            None => fitter.approach(rgb) * scale,
            Some(neighbour) => fitter.refine(rgb, neighbour / scale, Effort::Fast).0 * scale,
        });
        let line = &mut nodes[x * DEPTH..(x + 1) * DEPTH];
        line[middle] = start.extend(0.0).as_vec4().to_array();
        let above = solve_towards(fitter, direction, *start, *start, middle + 1..DEPTH, line);
        // The first step down continues the first step up backwards.
        solve_towards(fitter, direction, *start, above, (0..middle).rev(), line);
    }
}

/// Solves the nodes `zs` of one chromaticity one after the other; each search starts where the two solutions before point to.
/// Returns the first solution, scaled as the nodes are.
fn solve_towards(
    fitter: &SigmoidFitter,
    direction: DVec3,
    mut last: DVec3,
    mut before: DVec3,
    zs: impl Iterator<Item = usize>,
    line: &mut [[f32; 4]],
) -> DVec3 {
    let mut first = None;
    for z in zs {
        let rgb = direction * depth(z).max(BLACK);
        let scale = regular_scale(rgb);
        let next = if scale < 1e-6 {
            // White: the limit of greys.
            DVec3::new(0.0, 0.0, 0.5)
        } else {
            let (solution, error) = fitter.refine(rgb, (last * 2.0 - before) / scale, Effort::Fast);
            // The coarse quadrature doesn't resolve steep flanks. Where no reflectance has the colour it doesn't matter.
            let is_steep = (2.0 * solution.x.abs() + solution.y.abs()) * scale > STEEP;
            let polished = is_steep && error < 1e-2;
            (if polished { fitter.refine(rgb, solution, Effort::Polish).0 } else { solution }) * scale
        };
        (before, last) = (last, next);
        line[z] = next.extend(0.0).as_vec4().to_array();
        first.get_or_insert(next);
    }
    first.unwrap_or(last)
}

/// What coefficients are multiplied by in the table. They grow without bound towards black and white; the products don't,
/// and for greys (v − ½) / √(v (1 − v)) they are linear.
fn regular_scale(rgb: DVec3) -> f64 {
    let mean = rgb.element_sum() / 3.0;
    (mean * (1.0 - mean)).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use crate::{CIE_Y_INTEGRAL, RgbColorSpace, SigmoidPolynomial, observer};

    fn roundtrip_error(space: &RgbColorSpace, rgb: [f32; 3]) -> f32 {
        let p = space.sigmoid_table().lookup(rgb);
        let xyz = observer::integrate_xyz(|l| p.value(l) * space.illuminant().value(l))
            .map(|v| (v / f64::from(CIE_Y_INTEGRAL)) as f32);
        let back = space.from_xyz(xyz);
        (0..3).map(|c| (back[c] - rgb[c]).abs()).fold(0.0, f32::max)
    }

    #[test]
    fn srgb_is_reproduced() {
        let space = RgbColorSpace::srgb();
        let n = 4096;
        let mut errors: Vec<f32> = (0..n)
            .map(|i| {
                // Korobov points fill the cube evenly.
                let f = |k: f64| ((f64::from(i) + 0.5) * k).fract() as f32;
                roundtrip_error(space, [f(0.819_172_513_4), f(0.671_043_606_7), f(0.549_700_477_9)])
            })
            .collect();
        errors.sort_by(f32::total_cmp);
        let mean = errors.iter().sum::<f32>() / n as f32;
        assert!(mean < 2e-4, "{mean}");
        assert!(errors[n as usize * 99 / 100] < 1e-3);
        assert!(errors[n as usize - 1] < 6e-3);
    }

    #[test]
    fn dark_colours_and_corners_are_reproduced() {
        let space = RgbColorSpace::srgb();
        for (rgb, tolerance) in [
            ([1e-3, 2e-3, 0.0], 1e-4),
            ([1e-5, 0.0, 0.0], 1e-5),
            ([0.0, 0.0, 1.0], 1e-3),
            ([1.0, 0.0, 0.0], 1e-3),
            ([1.0, 1.0, 0.0], 1e-3),
            ([0.63, 0.065, 0.05], 1e-3),
        ] {
            let error = roundtrip_error(space, rgb);
            assert!(error < tolerance, "{rgb:?}: {error}");
        }
    }

    #[test]
    fn every_space_has_a_finite_table() {
        for name in RgbColorSpace::NAMES {
            let table = RgbColorSpace::named(name).unwrap().sigmoid_table();
            assert!(table.nodes.iter().flatten().all(|c| c.is_finite()), "{name}");
            for rgb in [[0.3, 0.4, 0.5], [0.6, 0.3, 0.25]] {
                let error = roundtrip_error(RgbColorSpace::named(name).unwrap(), rgb);
                assert!(error < 5e-4, "{name} {rgb:?}: {error}");
            }
        }
    }

    #[test]
    fn unbounded_colours_split_into_scale_and_shape() {
        let table = RgbColorSpace::srgb().sigmoid_table();
        let (scale, polynomial) = table.lookup_scaled([17.0, 12.0, 4.0]);
        assert_eq!((scale, polynomial), (34.0, table.lookup([0.5, 12.0 / 34.0, 4.0 / 34.0])));
        assert_eq!(table.lookup_scaled([0.0, -1.0, f32::NAN]).0, 0.0);
        assert_eq!(table.lookup_scaled([3.0; 3]), (6.0, SigmoidPolynomial::constant(0.5)));
    }

    #[test]
    fn greys_are_exact_and_odd_input_is_clamped() {
        let table = RgbColorSpace::srgb().sigmoid_table();
        assert_eq!(table.lookup([0.3; 3]), SigmoidPolynomial::constant(0.3));
        assert_eq!(table.lookup([f32::NAN, -1.0, 0.0]), SigmoidPolynomial::constant(0.0));
        assert_eq!(table.lookup([f32::INFINITY; 3]), SigmoidPolynomial::constant(1.0));
        for rgb in [[1.0, 1.0, 0.999_999_94], [1e-38, 0.0, 0.0], [1.0, 0.0, 1.0]] {
            assert!(table.lookup(rgb).coefficients.iter().all(|c| c.is_finite()), "{rgb:?}");
        }
    }
}
