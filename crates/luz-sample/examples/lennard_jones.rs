//! Chemistry: the energy of a simple liquid.
//!
//! Particles that attract and repel each other by the Lennard-Jones potential 4 (r⁻¹² − r⁻⁶), in reduced units, in a periodic
//! box at temperature 0.85 and density 0.776, cut off at distance 3 with the usual correction for what is beyond. The
//! Metropolis algorithm moves them one at a time.
//!
//! Known: the standard reference simulations of NIST (Lennard-Jones fluid, NVT Monte Carlo) give an energy of
//! −5.5121 ± 0.0005 per particle.

use luz_sample::markov::{Acceptance, Chain, Log, Proposal};
use luz_sample::random::Random;
use luz_sample::statistics::Running;

const CELLS: usize = 4;
/// Four in each cell of a face-centred cubic lattice, where they begin.
const PARTICLES: usize = 4 * CELLS * CELLS * CELLS;
const TEMPERATURE: f64 = 0.85;
const DENSITY: f64 = 0.776;
const CUTOFF: f32 = 3.0;
/// The largest move along each axis.
const MOVE: f32 = 0.14;
/// What is known, and its uncertainty.
const REFERENCE: (f64, f64) = (-5.5121, 0.0005);

/// Positions in units of the box, in `[0, 1)`, and the energy of all pairs.
#[derive(Clone)]
struct Liquid {
    positions: [Vec<f32>; 3],
    energy: f64,
}

fn box_length() -> f32 {
    (PARTICLES as f64 / DENSITY).cbrt() as f32
}

impl Liquid {
    fn crystal() -> Self {
        let mut positions = [const { Vec::new() }; 3];
        for i in 0..PARTICLES {
            let (cell, corner) = (i / 4, i % 4);
            let cell = [cell % CELLS, cell / CELLS % CELLS, cell / CELLS / CELLS];
            for (axis, positions) in positions.iter_mut().enumerate() {
                let shifted = corner > 0 && axis != corner - 1;
                positions.push((cell[axis] as f32 + if shifted { 0.5 } else { 0.0 }) / CELLS as f32);
            }
        }
        let mut liquid = Self { positions, energy: 0.0 };
        liquid.energy = 0.5 * (0..PARTICLES).map(|i| liquid.energy_of(i)).sum::<f64>();
        liquid
    }

    fn position(&self, i: usize) -> [f32; 3] {
        [0, 1, 2].map(|axis| self.positions[axis][i])
    }

    /// The energy of all pairs with particle `i`.
    fn energy_of(&self, i: usize) -> f64 {
        const LANES: usize = 8;
        let square = box_length() * box_length();
        let own = self.position(i);
        let [x, y, z] = &self.positions;
        // Eight sums side by side, which the compiler keeps in registers.
        let mut sums = [0.0f32; LANES];
        for ((x, y), z) in x.chunks_exact(LANES).zip(y.chunks_exact(LANES)).zip(z.chunks_exact(LANES)) {
            for lane in 0..LANES {
                // Positions differ by less than one; the nearest image is half a box away at most.
                let along = |a: f32, b: f32| (a - b).abs().min(1.0 - (a - b).abs());
                let d = [along(x[lane], own[0]), along(y[lane], own[1]), along(z[lane], own[2])];
                let distance = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) * square;
                // The particle itself is at no distance.
                let pair = distance > 0.0 && distance < CUTOFF * CUTOFF;
                let inverse = 1.0 / (distance * distance * distance);
                sums[lane] += if pair { 4.0 * inverse * (inverse - 1.0) } else { 0.0 };
            }
        }
        sums.iter().map(|&s| f64::from(s)).sum()
    }

    /// A particle moved at random.
    fn propose(&self, moved: &mut Self, random: &mut Random, temperature: f64) -> Proposal<Log> {
        let i = (random.next_f64() * PARTICLES as f64) as usize;
        for (to, from) in moved.positions.iter_mut().zip(&self.positions) {
            to.copy_from_slice(from);
            let step = (2.0 * random.next_f64() - 1.0) as f32 * MOVE / box_length();
            let place = (from[i] + step).rem_euclid(1.0);
            to[i] = if place < 1.0 { place } else { 0.0 };
        }
        moved.energy = self.energy + moved.energy_of(i) - self.energy_of(i);
        Proposal::symmetric(Log(-moved.energy / temperature))
    }
}

/// Energy per particle of independent liquids, and how often particles moved.
fn measure(liquids: u64, warm_up: u64, sweeps: u64) -> (Running, Acceptance) {
    // The pairs beyond the cutoff, as if they were evenly spread: 8/3 π ρ (r⁻⁹/3 − r⁻³).
    let cube = f64::from(CUTOFF).powi(-3);
    let tail = 8.0 / 3.0 * std::f64::consts::PI * DENSITY * (cube.powi(3) / 3.0 - cube);
    let (mut energies, mut acceptance) = (Running::new(), Acceptance::default());
    for number in 0..liquids {
        let mut spare = Liquid::crystal();
        let mut sweep = |chain: &mut Chain<Liquid, Log>, temperature| {
            for _ in 0..PARTICLES {
                chain.step(&mut spare, |x, y, random| Some(x.propose(y, random, temperature)));
            }
        };
        // It melts in great heat.
        let mut hot = Chain::new(11, number, Liquid::crystal(), Log(f64::NEG_INFINITY));
        (0..120).for_each(|_| sweep(&mut hot, 10.0));
        let start = hot.state().clone();
        let density = Log(-start.energy / TEMPERATURE);
        let mut chain = Chain::new(12, number, start, density);
        let mut mean = Running::new();
        for i in 0..warm_up + sweeps {
            sweep(&mut chain, TEMPERATURE);
            if i >= warm_up {
                mean.push(chain.state().energy / PARTICLES as f64 + tail);
            }
        }
        energies.push(mean.mean());
        acceptance.merge(chain.acceptance());
    }
    (energies, acceptance)
}

fn main() {
    println!("Lennard-Jones liquid, {PARTICLES} particles, T = {TEMPERATURE}, density {DENSITY}, Metropolis\n");
    let (energy, acceptance) = measure(16, 150, 250);
    println!("  energy per particle   {:.4} ± {:.4}", energy.mean(), energy.standard_error());
    println!("  NIST                  {:.4} ± {:.4}", REFERENCE.0, REFERENCE.1);
    println!("\n  {:.0} % of moves accepted", 100.0 * acceptance.rate());
}

#[cfg(test)]
mod tests {
    use super::*;
    use luz_sample::test_support::mean_z_test;

    #[test]
    fn energies_add_up() {
        // A perfect crystal has the same energy at each of its places, and a moved particle changes the sum as it should.
        let crystal = Liquid::crystal();
        let energies: Vec<f64> = (0..PARTICLES).map(|i| crystal.energy_of(i)).collect();
        assert!(energies.iter().all(|e| (e - energies[0]).abs() < 1e-3), "{energies:?}");
        let mut moved = crystal.clone();
        moved.positions[1][17] += 0.01;
        let total = |l: &Liquid| 0.5 * (0..PARTICLES).map(|i| l.energy_of(i)).sum::<f64>();
        let change = moved.energy_of(17) - crystal.energy_of(17);
        assert!((total(&moved) - total(&crystal) - change).abs() < 1e-3);
    }

    /// A z-test over independent liquids at a significance of 0.01.
    #[test]
    fn the_energy_is_that_of_the_reference() {
        let (energy, _) = measure(16, 150, 250);
        let squared_error = energy.standard_error().powi(2);
        assert!(mean_z_test(energy.mean(), squared_error, REFERENCE.0, REFERENCE.1.powi(2)) > 0.01, "{energy:?}");
        assert!(squared_error.sqrt() < 0.015, "{energy:?}");
    }
}
