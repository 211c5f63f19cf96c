//! Chains in primary sample space: stationarity and detailed balance, from states drawn from the exact density; estimates
//! against known integrals; lazy evaluation; chains as plain data.
//!
//! Statistical tests have a significance of 0.01, divided among their parts (Šidák), and fixed seeds.

use luz_sample::Samples;
use luz_sample::markov::{Bootstrap, Chain, Kernel, PrimarySample, PrimarySamples, Proposal, large_step_weights};
use luz_sample::mis::Heuristic;
use luz_sample::random::Random;
use luz_sample::statistics::Running;
use luz_sample::test_support::{chi2, mean_z_test, reversibility, sidak};

/// An estimator whose integrand and number of dimensions depend on what it draws, as that of a path: the density of primary
/// samples, which integrates to [`INTEGRAL`], and a cell among [`CELLS`] that the sample falls into.
fn estimator(samples: &mut impl Samples) -> (f64, usize) {
    let lobe = samples.next_1d();
    if lobe < 0.25 {
        // A product over two dimensions.
        let u = samples.next_2d();
        (f64::from(4.0 * u.x * u.y), (u.x * 4.0) as usize * 4 + (u.y * 4.0) as usize)
    } else {
        // A step in a dimension far off, one in four of which is impossible.
        samples.set_dimension(40);
        let u = samples.next_1d();
        (if u < 0.25 { 0.0 } else { 2.0 }, 16 + (u * 8.0) as usize)
    }
}

const INTEGRAL: f64 = 0.25 + 0.75 * 1.5;
const CELLS: usize = 24;

/// The integral of the density over each cell.
fn cell_integrals() -> [f64; CELLS] {
    std::array::from_fn(|cell| {
        if cell < 16 {
            let strip = |i: usize| (((i + 1) * (i + 1)) as f64 - (i * i) as f64) / 16.0;
            0.25 * strip(cell / 4) * strip(cell % 4)
        } else if cell < 18 {
            0.0
        } else {
            0.75 * 2.0 / 8.0
        }
    })
}

/// A primary sample with its cell.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
struct State {
    sample: PrimarySample,
    cell: usize,
}

fn evaluate(sample: impl FnOnce(&mut PrimarySample) -> (f64, usize), state: &mut State) -> f64 {
    let (density, cell) = sample(&mut state.sample);
    state.cell = cell;
    density
}

/// A step of a chain with large steps of probability `large`.
fn mutate(current: &State, proposed: &mut State, random: &mut Random, large: f64, kernel: Kernel) -> Option<Proposal> {
    let density = if random.next_f64() < large {
        evaluate(|s| estimator(&mut PrimarySamples::large(s, random)), proposed)
    } else {
        evaluate(|s| estimator(&mut PrimarySamples::small(&current.sample, s, kernel, random)), proposed)
    };
    Some(Proposal::symmetric(density))
}

/// A state of the exact density, by rejection: densities are below four.
fn exact(number: u64) -> (State, f64) {
    let mut random = Random::new(7, 0, number);
    let mut state = State::default();
    for _ in 0..1000 {
        let density = evaluate(|s| estimator(&mut PrimarySamples::large(s, &mut random)), &mut state);
        if 4.0 * random.next_f64() < density {
            return (state, density);
        }
    }
    panic!("one in three samples is taken");
}

#[test]
fn primary_space_chains_are_stationary_and_reversible() {
    const CHAINS: u64 = 40_000;
    let integrals = cell_integrals();
    assert!((integrals.iter().sum::<f64>() - INTEGRAL).abs() < 1e-12);
    let expected = integrals.map(|i| i / INTEGRAL * CHAINS as f64);
    let wide = Kernel::new(0.01, 0.5).expect("in range");
    let cases = [(0.0, 12, wide), (0.3, 6, Kernel::default()), (1.0, 2, wide)];
    let p = sidak(0.01, 2 * cases.len());
    for (large, steps, kernel) in cases {
        let (mut counts, mut moves) = (vec![0; CELLS], vec![0; CELLS * CELLS]);
        let mut spare = State::default();
        for number in 0..CHAINS {
            let (state, density) = exact(number);
            let first = state.cell;
            let mut chain = Chain::new(8, number, state, density);
            chain.step(&mut spare, |x, y, random| mutate(x, y, random, large, kernel));
            moves[first * CELLS + chain.state().cell] += 1;
            for _ in 0..steps {
                chain.step(&mut spare, |x, y, random| mutate(x, y, random, large, kernel));
            }
            counts[chain.state().cell] += 1;
        }
        let (stationary, reversible) = (chi2(&counts, &expected), reversibility(&moves, CELLS));
        assert!(stationary.passes(p), "{large}: {stationary:?}");
        assert!(reversible.passes(p) && reversible.degrees_of_freedom > 20.0, "{large}: {reversible:?}");
    }
}

#[test]
fn small_steps_have_their_density() {
    for kernel in [Kernel::default(), Kernel::new(0.1, 0.5).expect("in range")] {
        let (draws, cells) = (200_000, 400usize);
        let mut counts = vec![0; cells];
        let start = 0.8f32;
        let at = |c: f32, start: f32| ((c - start).rem_euclid(1.0) * cells as f32) as usize % cells;
        let (mut sample, mut origin) = (PrimarySample::new(), PrimarySample::new());
        for i in 0..draws {
            // A coordinate of its own for every draw, and back and forth about it.
            let mut random = Random::new(9, 0, i);
            let x = PrimarySamples::large(&mut origin, &mut random).next_1d();
            let y = PrimarySamples::small(&origin, &mut sample, kernel, &mut random).next_1d();
            assert!(kernel.pdf(x, y) > 0.0 || ((x - y).abs() * 64.0 - 1.0).abs() < 1e-4, "{x} {y}");
            counts[at(y - x + start, start)] += 1;
        }
        // The density integrated over cells by their midpoints, many of them.
        let fine = 400;
        let expected: Vec<f64> = (0..cells * fine)
            .map(|i| kernel.pdf(0.0, (i as f32 + 0.5) / (cells * fine) as f32))
            .collect::<Vec<_>>()
            .chunks(fine)
            .map(|c| c.iter().map(|&d| f64::from(d)).sum::<f64>() / (cells * fine) as f64 * draws as f64)
            .collect();
        assert!((expected.iter().sum::<f64>() / draws as f64 - 1.0).abs() < 1e-3);
        assert!(chi2(&counts, &expected).passes(0.005), "{kernel:?} {:?}", chi2(&counts, &expected));
    }
    for (smallest, largest) in [(0.0, 0.1), (1e-7, 0.1), (0.2, 0.1), (0.1, 0.6), (f32::NAN, 0.1), (0.1, f32::NAN)] {
        assert_eq!(Kernel::new(smallest, largest), None);
    }
}

/// Estimates of the integrals of all cells from short chains that begin at bootstrapped states.
fn chain_estimates(combine_large: bool, biased_start: bool) -> Vec<Running> {
    const RUNS: u64 = 1500;
    const CHAINS: u64 = 4;
    const STEPS: u64 = 8;
    let large = 0.25;
    let mut cells = vec![Running::new(); CELLS];
    for run in 0..RUNS {
        let candidate = |i: u64| {
            let mut state = State::default();
            let density =
                evaluate(|s| estimator(&mut PrimarySamples::large(s, &mut Random::new(10, run, i))), &mut state);
            (state, density)
        };
        let bootstrap: Bootstrap = (0..64).map(|i| candidate(i).1).collect();
        let mut sums = [0.0; CELLS];
        for number in 0..CHAINS {
            let start = bootstrap.start(number, CHAINS, Random::new(11, run, 0).next_f64()).expect("possible");
            let (state, density) = candidate(if biased_start { number } else { start as u64 });
            let mut chain = Chain::new(12, run * CHAINS + number, state, density);
            let mut spare = State::default();
            let b = if combine_large { INTEGRAL } else { bootstrap.normalization() };
            for _ in 0..STEPS {
                let mut is_large = false;
                let step = chain.step(&mut spare, |x, y, random| {
                    let mut peek = *random;
                    is_large = peek.next_f64() < large;
                    mutate(x, y, random, large, Kernel::default())
                });
                let p = if combine_large { large } else { 0.0 };
                let weights = large_step_weights(
                    step.proposed_weight,
                    is_large && combine_large,
                    step.current_density,
                    step.proposed_density,
                    b,
                    p,
                );
                for ((state, density), weight) in
                    [(step.current, step.current_density), (step.proposed, step.proposed_density)]
                        .into_iter()
                        .zip(weights)
                {
                    sums[state.cell] += weight * density / (CHAINS * STEPS) as f64;
                }
            }
        }
        cells.iter_mut().zip(sums).for_each(|(cell, sum)| cell.push(sum));
    }
    cells
}

#[test]
fn estimates_are_unbiased_from_the_first_step_on() {
    let least = |cells: &[Running]| {
        let integrals = cell_integrals();
        let p = |(r, i): (&Running, f64)| mean_z_test(r.mean(), r.standard_error().powi(2), i, 0.0);
        cells.iter().zip(integrals).map(p).fold(1.0, f64::min)
    };
    let (plain, combined) = (chain_estimates(false, false), chain_estimates(true, false));
    let p = sidak(0.01, 2 * CELLS);
    assert!(least(&plain) > p && least(&combined) > p, "{} {}", least(&plain), least(&combined));
    // It is noticed if chains begin anywhere.
    assert!(least(&chain_estimates(false, true)) < 1e-6);
}

#[test]
fn coordinates_are_drawn_when_asked_for_and_kept() {
    let mut random = Random::new(20, 0, 0);
    let (mut a, mut b) = (PrimarySample::new(), PrimarySample::new());
    let mut samples = PrimarySamples::large(&mut a, &mut random);
    let first = samples.next_1d();
    samples.set_dimension(5);
    let pair = samples.next_2d();
    assert_eq!(samples.dimension(), 7);
    samples.set_dimension(0);
    assert_eq!(samples.next_1d(), first, "the same when asked for again");
    samples.set_stream(2);
    let other = samples.next_1d();
    assert!(other != first);
    samples.set_stream(0);
    samples.set_dimension((1 << 20) + 6);
    assert_eq!(samples.next_1d(), pair.y, "dimensions wrap around");
    assert_eq!(a.known(), 4);
    assert_eq!(a.coordinate(0, 5), Some(pair.x));
    assert_eq!((a.coordinate(0, 1), a.coordinate(1, 0), a.coordinate(9, 0)), (None, None, None));
    // A small step moves what is known, and draws what is not; whatever the order.
    let kernel = Kernel::default();
    let draw = |dimensions: &[u32], b: &mut PrimarySample| {
        let mut samples = PrimarySamples::small(&a, b, kernel, &mut Random::new(21, 0, 0));
        for &d in dimensions {
            samples.set_dimension(d);
            samples.next_1d();
        }
        [0, 1, 5, 6, 9].map(|d| b.coordinate(0, d))
    };
    let forth = draw(&[0, 1, 5], &mut b);
    let back = draw(&[5, 1, 0], &mut b);
    assert_eq!(forth, back);
    let near = |x: f32, y: Option<f32>| y.is_some_and(|y| kernel.pdf(x, y) > 0.0);
    assert!(near(first, forth[0]) && near(pair.x, forth[2]) && forth[1].is_some());
    assert_eq!((forth[3], forth[4], b.known()), (None, None, 3));
}

#[test]
fn chains_are_plain_data_and_advance_in_any_order() {
    let advance = |chain: &mut Chain<State>, steps: u64| {
        let mut spare = State::default();
        for _ in 0..steps {
            chain.step(&mut spare, |x, y, random| mutate(x, y, random, 0.2, Kernel::default()));
        }
    };
    let begin = |number| {
        let (state, density) = exact(number);
        Chain::new(30, number, state, density)
    };
    let mut whole: Vec<_> = (0..3).map(begin).collect();
    whole.iter_mut().for_each(|c| advance(c, 100));
    let mut parts: Vec<_> = (0..3).map(begin).collect();
    for round in 0..10 {
        parts.iter_mut().rev().for_each(|c| advance(c, 10));
        if round % 3 == 0 {
            let text = serde_json::to_string(&parts).expect("plain data");
            parts = serde_json::from_str(&text).expect("what was written");
        }
    }
    assert_eq!(whole, parts);
    assert!(whole[0].state() != whole[1].state());
    assert_eq!((whole[2].number(), whole[2].steps()), (2, 100));
}

/// A technique among two, and a point that it draws from a stream of its own, with the density of both (2x and 1) there.
fn multiplexed(samples: &mut PrimarySamples<'_>) -> (usize, f64) {
    let technique = (samples.next_1d() * 2.0) as usize;
    samples.set_stream(1 + technique);
    let u = f64::from(samples.next_1d());
    (technique, if technique == 0 { u.sqrt() } else { u })
}

/// The integrals of 3x² over ten intervals, by chains that choose their technique as they go (Hachisuka et al. 2014,
/// "Multiplexed Metropolis Light Transport"), weighted by a heuristic.
fn multiplexed_estimates(weight: impl Fn(usize, f64) -> f64) -> Vec<Running> {
    const STEPS: u64 = 100;
    let density = |(technique, x): (usize, f64)| {
        let pdf = if technique == 0 { 2.0 * x } else { 1.0 };
        // Each technique is chosen with probability one half.
        if pdf > 0.0 { 2.0 * weight(technique, x) * 3.0 * x * x / pdf } else { 0.0 }
    };
    let mut cells = vec![Running::new(); 10];
    for run in 0..1000 {
        let candidate = |i: u64| {
            let mut state = (PrimarySample::new(), 0.0);
            let drawn = multiplexed(&mut PrimarySamples::large(&mut state.0, &mut Random::new(50, run, i)));
            state.1 = drawn.1;
            (state, density(drawn))
        };
        let bootstrap: Bootstrap = (0..32).map(|i| candidate(i).1).collect();
        let start = bootstrap.start(0, 1, Random::new(51, run, 0).next_f64()).expect("possible");
        let (state, first) = candidate(start as u64);
        let mut chain = Chain::new(52, run, state, first);
        let mut spare = (PrimarySample::new(), 0.0);
        let mut sums = [0.0; 10];
        for _ in 0..STEPS {
            let step = chain.step(&mut spare, |x, y, random| {
                let drawn = if random.next_f64() < 0.2 {
                    multiplexed(&mut PrimarySamples::large(&mut y.0, random))
                } else {
                    multiplexed(&mut PrimarySamples::small(&x.0, &mut y.0, Kernel::default(), random))
                };
                y.1 = drawn.1;
                Some(Proposal::symmetric(density(drawn)))
            });
            for (state, weight) in [(step.current, step.current_weight), (step.proposed, step.proposed_weight)] {
                sums[((state.1 * 10.0) as usize).min(9)] += weight * bootstrap.normalization() / STEPS as f64;
            }
        }
        cells.iter_mut().zip(sums).for_each(|(cell, sum)| cell.push(sum));
    }
    cells
}

#[test]
fn chains_over_several_techniques_are_unbiased() {
    let least = |cells: &[Running]| {
        let p = |(i, r): (usize, &Running)| {
            let exact = (f64::from(i as u32 + 1).powi(3) - f64::from(i as u32).powi(3)) / 1000.0;
            mean_z_test(r.mean(), r.standard_error().powi(2), exact, 0.0)
        };
        cells.iter().enumerate().map(p).fold(1.0, f64::min)
    };
    let balanced = |technique: usize, x: f64| {
        f64::from(Heuristic::Balance.weight(technique, &[(1.0, 2.0 * x as f32), (1.0, 1.0)]))
    };
    let cells = multiplexed_estimates(balanced);
    assert!(least(&cells) > sidak(0.01, 10), "{cells:?}");
    // Weights that do not sum to one are noticed.
    assert!(least(&multiplexed_estimates(|t, x| balanced(t, x).sqrt())) < 1e-6);
}
