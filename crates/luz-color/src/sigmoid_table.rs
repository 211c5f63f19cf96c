//! Precomputed sigmoid polynomials for textures.

use glam::DVec3;
use rayon::prelude::*;

use crate::SigmoidPolynomial;
use crate::sigmoid_fit::SigmoidFitter;

/// Nodes along each axis.
const SIZE: usize = 32;

/// Sigmoid polynomials for all colours of one RGB space, interpolated from a grid.
#[derive(Clone, Debug)]
pub struct SigmoidTable {
    /// Coefficients times √z (the fourth number pads) by largest component, z, y, x.
    nodes: Vec<[f32; 4]>,
}

impl SigmoidTable {
    /// Solves for every node, in parallel over lines of constant chromaticity.
    pub(crate) fn new(fitter: &SigmoidFitter) -> Self {
        let lines: Vec<[[f32; 4]; SIZE]> = (0..3 * SIZE * SIZE)
            .into_par_iter()
            .map(|line| {
                let (largest, y, x) = (line / (SIZE * SIZE), line / SIZE % SIZE, line % SIZE);
                solve_line(fitter, largest, node(x), node(y))
            })
            .collect();
        let mut nodes = vec![[0.0; 4]; 3 * SIZE * SIZE * SIZE];
        for (line, values) in lines.iter().enumerate() {
            let (largest, yx) = (line / (SIZE * SIZE), line % (SIZE * SIZE));
            for (z, value) in values.iter().enumerate() {
                nodes[(largest * SIZE + z) * SIZE * SIZE + yx] = *value;
            }
        }
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
        let (x0, tx) = cell(rgb[(largest + 1) % 3] / z);
        let (y0, ty) = cell(rgb[(largest + 2) % 3] / z);
        let (z0, tz) = cell(z);
        let base = ((largest * SIZE + z0) * SIZE + y0) * SIZE + x0;
        let mut sum = [0.0; 4];
        for (dz, wz) in [(0, 1.0 - tz), (1, tz)] {
            for (dy, wy) in [(0, 1.0 - ty), (1, ty)] {
                for (dx, wx) in [(0, 1.0 - tx), (1, tx)] {
                    let node = &self.nodes[base + (dz * SIZE + dy) * SIZE + dx];
                    let w = wx * wy * wz;
                    for c in 0..4 {
                        sum[c] += w * node[c];
                    }
                }
            }
        }
        let scale = 1.0 / z.sqrt();
        SigmoidPolynomial::new([sum[0] * scale, sum[1] * scale, sum[2] * scale])
    }
}

/// The coordinate of a node in `[0, 1]`.
fn node(index: usize) -> f64 {
    index as f64 / (SIZE - 1) as f64
}

/// The node before a coordinate, and the fraction of the way to the next.
fn cell(coordinate: f32) -> (usize, f32) {
    let position = coordinate * (SIZE - 1) as f32;
    let index = (position as usize).min(SIZE - 2);
    (index, position - index as f32)
}

/// The nodes of one chromaticity by rising z, each started at its neighbour's solution.
fn solve_line(fitter: &SigmoidFitter, largest: usize, x: f64, y: f64) -> [[f32; 4]; SIZE] {
    let mut direction = DVec3::ONE;
    direction[(largest + 1) % 3] = x;
    direction[(largest + 2) % 3] = y;
    let mut line = [[0.0; 4]; SIZE];
    let middle = SIZE / 3;
    let first = fitter.fit((direction * node(middle)).as_vec3().to_array());
    let start = DVec3::from(first.coefficients.map(f64::from));
    let up = middle..SIZE;
    let down = (0..middle).rev();
    let mut solution = start;
    for z in up {
        let value = node(z);
        solution = fitter.refine(direction * value, solution);
        store(&mut line[z], solution, value);
    }
    solution = start;
    let mut previous = node(middle);
    for z in down {
        // Towards black the coefficients grow like 1/√z.
        let value = node(z).max(1e-6);
        solution = fitter.refine(direction * value, solution * (previous / value).sqrt());
        previous = value;
        store(&mut line[z], solution, value);
    }
    line
}

fn store(slot: &mut [f32; 4], solution: DVec3, z: f64) {
    *slot = (solution * z.sqrt()).extend(0.0).as_vec4().to_array();
}

#[cfg(test)]
mod probe {
    use crate::*;
    #[test]
    fn probe() {
        for name in ["srgb", "rec2020"] {
            let space = RgbColorSpace::named(name).unwrap();
            let t = std::time::Instant::now();
            let table = space.sigmoid_table();
            eprintln!("table {:?}", t.elapsed());
            let mut errs = vec![];
            let mut ferrs = vec![];
            let t = std::time::Instant::now();
            let n = 4000;
            for i in 0..n {
                let f = |k: f64| ((i as f64 + 0.5) * k).fract() as f32;
                let rgb = [f(0.8191725134), f(0.6710436067), f(0.5497004779)];
                let col = |p: SigmoidPolynomial| {
                    space.from_xyz(
                        observer::integrate_xyz(|l| p.value(l) * space.illuminant().value(l))
                            .map(|v| (v / f64::from(CIE_Y_INTEGRAL)) as f32),
                    )
                };
                let e = |b: [f32; 3]| (0..3).map(|c| (b[c] - rgb[c]).abs()).fold(0.0, f32::max);
                errs.push((e(col(table.lookup(rgb))), rgb));
                ferrs.push((e(col(space.to_sigmoid(rgb))), rgb));
            }
            eprintln!("fits {:?} each", t.elapsed() / n);
            for e in [&mut errs, &mut ferrs] {
                e.sort_by(|a, b| a.0.total_cmp(&b.0));
                eprintln!(
                    "mean {} median {} 99% {} max {:?} {:?}",
                    e.iter().map(|e| e.0).sum::<f32>() / n as f32,
                    e[n as usize / 2].0,
                    e[n as usize * 99 / 100].0,
                    e[n as usize - 1],
                    e[n as usize - 2]
                );
            }
        }
    }
}
