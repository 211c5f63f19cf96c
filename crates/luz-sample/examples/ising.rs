//! Physics: the magnet that Onsager solved.
//!
//! Spins of ±1 on a square lattice, periodic at its ends, with energy −Σ sᵢ sⱼ over neighbours, at temperature T. The Metropolis
//! algorithm flips them one by one; below the critical temperature 2 / ln(1 + √2) ≈ 2.269 the lattice is magnetic.
//!
//! Known: the magnetisation (1 − sinh(2/T)⁻⁴)^(1/8) (Yang 1952), and the energy per spin (Onsager 1944), of an infinite
//! lattice.
//!
//! Random numbers are a function of (seed, lattice, sweep, site), so that a sweep may go over the sites in any order, or all
//! white and then all black squares at once, and gives the same lattice to the last bit.

use luz_sample::Samples;
use luz_sample::markov::{Acceptance, Outcome};
use luz_sample::random::Random;
use luz_sample::statistics::Running;

const SIZE: usize = 64;
const LATTICES: u64 = 16;

/// The exact magnetisation and energy per spin of an infinite lattice, below the critical temperature.
fn exact(temperature: f64) -> (f64, f64) {
    let beta = 1.0 / temperature;
    let magnetization = (1.0 - (2.0 * beta).sinh().powi(-4)).powf(0.125);
    // The complete elliptic integral of the first kind, by the arithmetic-geometric mean.
    let k = 2.0 * (2.0 * beta).sinh() / (2.0 * beta).cosh().powi(2);
    let (mut a, mut g) = (1.0, (1.0 - k * k).sqrt());
    for _ in 0..40 {
        (a, g) = ((a + g) / 2.0, f64::sqrt(a * g));
    }
    let integral = std::f64::consts::FRAC_PI_2 / a;
    let tanh = (2.0 * beta).tanh();
    let bracket = 1.0 + std::f64::consts::FRAC_2_PI * (2.0 * tanh * tanh - 1.0) * integral;
    (magnetization, -bracket / tanh)
}

/// Magnetisation and energy per spin, each with its standard error over independent lattices, and what became of flips.
struct Measurement {
    magnetization: Running,
    energy: Running,
    acceptance: Acceptance,
}

fn measure(temperature: f64, warm_up: u64, sweeps: u64) -> Measurement {
    let mut all =
        Measurement { magnetization: Running::new(), energy: Running::new(), acceptance: Acceptance::default() };
    // What a flip is accepted with, by the sum of the neighbours times the spin.
    let probability: [f64; 9] = std::array::from_fn(|i| (-2.0 * (i as f64 - 4.0) / temperature).exp().min(1.0));
    for lattice in 0..LATTICES {
        let mut spins = vec![1i8; SIZE * SIZE];
        let (mut magnetization, mut energy) = (Running::new(), Running::new());
        for sweep in 0..warm_up + sweeps {
            for color in [0, 1] {
                for y in 0..SIZE {
                    let mut random = Random::new(7, lattice, sweep * SIZE as u64 + y as u64);
                    for x in (0..SIZE).filter(|x| (x + y) % 2 == color) {
                        random.set_dimension(x as u32);
                        let u = random.next_f64();
                        let p = probability[(alignment(&spins, x, y) + 4) as usize];
                        let flip = u < p;
                        all.acceptance.record(if flip { Outcome::Accepted } else { Outcome::Rejected }, p);
                        if flip {
                            spins[y * SIZE + x] *= -1;
                        }
                    }
                }
            }
            if sweep >= warm_up {
                let sites = (SIZE * SIZE) as f64;
                magnetization.push(spins.iter().map(|&s| f64::from(s)).sum::<f64>().abs() / sites);
                // Every bond is seen from both its ends.
                let bonds: i32 = (0..SIZE * SIZE).map(|i| i32::from(alignment(&spins, i % SIZE, i / SIZE))).sum();
                energy.push(-f64::from(bonds) / 2.0 / sites);
            }
        }
        all.magnetization.push(magnetization.mean());
        all.energy.push(energy.mean());
    }
    all
}

/// A spin times the sum of its four neighbours.
fn alignment(spins: &[i8], x: usize, y: usize) -> i8 {
    let at = |x: usize, y: usize| spins[(y % SIZE) * SIZE + x % SIZE];
    at(x, y) * (at(x + 1, y) + at(x + SIZE - 1, y) + at(x, y + 1) + at(x, y + SIZE - 1))
}

fn main() {
    println!("2D Ising model, {LATTICES} lattices of {SIZE} × {SIZE}, Metropolis\n");
    println!("   T   |m|                  exact      energy/spin            exact      accepted");
    for (temperature, sweeps) in [(1.6, 300), (1.9, 600), (2.1, 1500)] {
        let (m, e) = exact(temperature);
        let found = measure(temperature, sweeps / 2, sweeps);
        println!(
            "  {temperature:.1}  {:.5} ± {:.5}  {m:9.5}    {:9.5} ± {:.5}  {e:9.5}    {:6.2} %",
            found.magnetization.mean(),
            found.magnetization.standard_error(),
            found.energy.mean(),
            found.energy.standard_error(),
            100.0 * found.acceptance.rate()
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use luz_sample::test_support::{mean_z_test, sidak};

    #[test]
    fn the_formulas_are_right() {
        // Known to tables: T = 2 has magnetisation 0.911 319 and energy −1.745 565.
        let (m, e) = exact(2.0);
        assert!((m - 0.911_319_377_877_496).abs() < 1e-12 && (e + 1.745_564_575_1).abs() < 1e-7, "{m} {e}");
    }

    /// z-tests over lattices, at a significance of 0.01 in all; another temperature's values are rejected.
    #[test]
    fn the_lattice_agrees_with_onsager() {
        let found = measure(2.0, 200, 600);
        let p = |r: &Running, value: f64| mean_z_test(r.mean(), r.standard_error().powi(2), value, 0.0);
        let (m, e) = exact(2.0);
        assert!(p(&found.magnetization, m) > sidak(0.01, 2), "{:?} {m}", found.magnetization);
        assert!(p(&found.energy, e) > sidak(0.01, 2), "{:?} {e}", found.energy);
        let (m, e) = exact(2.05);
        assert!(p(&found.magnetization, m) < 1e-6 && p(&found.energy, e) < 1e-6);
    }
}
