//! Markov chains: stationarity and detailed balance, from states drawn from the exact density; estimates against known
//! integrals; chains as plain data.
//!
//! Statistical tests have a significance of 0.01, divided among their parts (Šidák), and fixed seeds.

use luz_sample::Samples;
use luz_sample::markov::{
    Acceptance, Bootstrap, Chain, Kernel, Log, Outcome, PrimarySample, PrimarySamples, Proposal, large_step_weights,
};
use luz_sample::random::Random;
use luz_sample::statistics::Running;
use luz_sample::test_support::{chi2, mean_z_test, reversibility, sidak};

/// A density on six states, and proposals that are anything but symmetric: from each to a few others.
const DENSITY: [f64; 6] = [1.0, 4.0, 0.5, 2.0, 0.0, 3.0];
const PROPOSALS: [[f64; 6]; 6] = [
    [0.0, 0.5, 0.2, 0.0, 0.2, 0.1],
    [0.1, 0.1, 0.3, 0.5, 0.0, 0.0],
    [0.3, 0.6, 0.0, 0.0, 0.1, 0.0],
    [0.0, 0.2, 0.2, 0.2, 0.0, 0.4],
    [0.5, 0.0, 0.5, 0.0, 0.0, 0.0],
    [0.7, 0.0, 0.0, 0.3, 0.0, 0.0],
];

/// The number of the interval that `u` falls into, of lengths in proportion to `weights`.
fn choose(weights: &[f64], u: f64) -> usize {
    let mut rest = u * weights.iter().sum::<f64>();
    for (i, w) in weights.iter().enumerate() {
        if rest < *w {
            return i;
        }
        rest -= w;
    }
    weights.iter().rposition(|w| *w > 0.0).expect("some weight")
}

fn propose(x: usize, y: &mut usize, random: &mut Random, honest: bool) -> Option<Proposal> {
    *y = choose(&PROPOSALS[x], random.next_f64());
    let ratio = if honest { PROPOSALS[*y][x] / PROPOSALS[x][*y] } else { 1.0 };
    Some(Proposal { density: DENSITY[*y], ratio })
}

/// χ² of where chains are after some steps from exact states, and detailed balance of the first step.
fn finite_chains(honest: bool) -> [f64; 2] {
    const CHAINS: u64 = 60_000;
    let (mut counts, mut moves) = (vec![0; 6], vec![0; 36]);
    for number in 0..CHAINS {
        let x = choose(&DENSITY, Random::new(1, 0, number).next_f64());
        let mut chain = Chain::new(2, number, x, DENSITY[x]);
        let mut spare = 0;
        chain.step(&mut spare, |&x, y, random| propose(x, y, random, honest));
        moves[x * 6 + chain.state()] += 1;
        for _ in 0..9 {
            chain.step(&mut spare, |&x, y, random| propose(x, y, random, honest));
        }
        counts[*chain.state()] += 1;
    }
    let expected = DENSITY.map(|d| d / 10.5 * CHAINS as f64);
    [chi2(&counts, &expected).p_value, reversibility(&moves, 6).p_value]
}

#[test]
fn finite_chains_are_stationary_and_reversible() {
    let p = finite_chains(true);
    assert!(p.iter().all(|&p| p > sidak(0.01, 2)), "{p:?}");
    // Neither is so without the ratio of the proposals.
    let p = finite_chains(false);
    assert!(p.iter().all(|&p| p < 1e-6), "{p:?}");
}

#[test]
fn a_single_long_chain_visits_states_by_density() {
    let mut chain = Chain::new(3, 0, 2, DENSITY[2]);
    let (mut spare, mut weights, steps) = (0, [0.0; 6], 200_000);
    let mut visits = [0.0; 6];
    for _ in 0..steps {
        let step = chain.step(&mut spare, |&x, y, random| propose(x, y, random, true));
        assert_eq!(step.current_weight + step.proposed_weight, 1.0);
        weights[*step.current] += step.current_weight;
        weights[*step.proposed] += step.proposed_weight;
        visits[*chain.state()] += 1.0;
    }
    for i in 0..6 {
        let expected = DENSITY[i] / 10.5;
        for frequency in [weights[i] / f64::from(steps), visits[i] / f64::from(steps)] {
            // Consecutive states are correlated over a few steps: a generous four standard errors.
            assert!(
                (frequency - expected).abs() <= 4.0 * (3.0 * expected / f64::from(steps)).sqrt(),
                "{i}: {frequency}"
            );
        }
    }
    // Exact acceptance, Σ π(x) T(x→y) a(x→y), and how much of it was impossible.
    let (mut rate, mut impossible) = (0.0, 0.0);
    let flow = |x: usize, y: usize| DENSITY[x] / 10.5 * PROPOSALS[x][y];
    for (x, y) in (0..36).map(|i| (i / 6, i % 6)) {
        rate += flow(x, y).min(flow(y, x));
        impossible += if flow(x, y) > 0.0 && (DENSITY[y] == 0.0 || PROPOSALS[y][x] == 0.0) { flow(x, y) } else { 0.0 };
    }
    let acceptance = chain.acceptance();
    assert!((acceptance.rate() - rate).abs() < 0.01, "{} {rate}", acceptance.rate());
    let accepted = acceptance.count(Outcome::Accepted) as f64 / f64::from(steps);
    assert!((accepted - rate).abs() < 0.01);
    assert!((acceptance.count(Outcome::Impossible) as f64 / f64::from(steps) - impossible).abs() < 0.01);
    assert_eq!((acceptance.steps(), acceptance.proposals(), acceptance.applicability()), (200_000, 200_000, 1.0));
}

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

/// A way to step from one coordinate to another, given a uniform number.
type Move = fn(f32, f32) -> f32;

#[test]
fn wrong_steps_are_noticed() {
    // Steps that are clamped to the interval instead of going around, and ones in proportion to the coordinate, taken for
    // symmetric: the uniform density does not survive ten of them.
    let moves: [Move; 3] = [
        |x, u| (x + u - 0.5).rem_euclid(1.0),
        |x, u| (x + u - 0.5).clamp(0.0, 0.999),
        |x, u| (x * (0.5 + u)).min(0.999),
    ];
    let p = moves.map(|step| {
        let mut counts = vec![0; 20];
        for number in 0..20_000 {
            let x = Random::new(5, 0, number).next_1d();
            let (mut chain, mut spare) = (Chain::new(6, number, x, 1.0), 0.0);
            for _ in 0..10 {
                chain.step(&mut spare, |&x, y, random| {
                    *y = step(x, random.next_1d());
                    Some(Proposal::symmetric(1.0))
                });
            }
            counts[(chain.state() * 20.0) as usize] += 1;
        }
        chi2(&counts, &[1000.0; 20]).p_value
    });
    assert!(p[0] > 0.01 && p[1] < 1e-9 && p[2] < 1e-9, "{p:?}");
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
    for (smallest, largest) in [(0.0, 0.1), (0.2, 0.1), (0.1, 0.6), (f32::NAN, 0.1), (0.1, f32::NAN)] {
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

#[test]
fn chains_that_are_stuck_say_so() {
    // A peak that small steps cannot leave, in logarithms, for a number would not hold it.
    let density = |x: f64| Log(if x.abs() < 0.001 { 2000.0 } else { -x.abs() });
    let (mut chain, mut spare) = (Chain::new(40, 0, 3.0, density(3.0)), 0.0);
    let step = |chain: &mut Chain<f64, Log>, spare: &mut f64| {
        chain.step(spare, |&x, y, random| {
            *y = x + random.next_f64() - 0.5;
            Some(Proposal::symmetric(density(*y)))
        });
    };
    let arrived = (0..1_000_000).any(|_| {
        step(&mut chain, &mut spare);
        chain.density().0 > 0.0
    });
    assert!(arrived);
    assert!(!chain.is_stuck(100));
    (0..200).for_each(|_| step(&mut chain, &mut spare));
    assert!(chain.is_stuck(100) && chain.longest_stay() >= chain.stay());
}

#[test]
fn proposals_that_make_no_sense_are_counted_and_declined() {
    let mut chain = Chain::new(50, 0, 1u8, 1.0);
    let mut spare = 2;
    let cases = [
        (Some((f64::NAN, 1.0)), Outcome::Invalid),
        (Some((f64::INFINITY, 1.0)), Outcome::Invalid),
        (Some((-1.0, 1.0)), Outcome::Invalid),
        (Some((1.0, f64::NAN)), Outcome::Invalid),
        (Some((1.0, -1.0)), Outcome::Invalid),
        (Some((1.0, f64::INFINITY)), Outcome::Invalid),
        (Some((0.0, 1.0)), Outcome::Impossible),
        (Some((1.0, 0.0)), Outcome::Impossible),
        (Some((1e-300, 1e-300)), Outcome::Rejected),
        (None, Outcome::Inapplicable),
    ];
    for (proposal, outcome) in cases {
        let step = chain.step(&mut spare, |_, y, _| {
            *y = 2;
            proposal.map(|(density, ratio)| Proposal { density, ratio })
        });
        assert_eq!((step.outcome, *step.current, step.current_weight, step.proposed_weight), (outcome, 1, 1.0, 0.0));
        assert_eq!((*chain.state(), chain.density()), (1, 1.0));
    }
    let mut twice = *chain.acceptance();
    twice.merge(chain.acceptance());
    let counts = |a: &Acceptance| {
        [Outcome::Invalid, Outcome::Impossible, Outcome::Rejected, Outcome::Inapplicable].map(|o| a.count(o))
    };
    assert_eq!(counts(&twice), [12, 4, 2, 2]);
    assert_eq!((twice.rate(), twice.applicability()), (0.0, 0.9));
    // From where it cannot be, a chain goes to wherever it can.
    let mut chain = Chain::new(50, 1, 1u8, 0.0);
    let step = chain.step(&mut spare, |_, y, _| {
        *y = 2;
        Some(Proposal::symmetric(1e-300))
    });
    assert_eq!((step.outcome, *step.proposed, step.proposed_weight), (Outcome::Accepted, 2, 1.0));
}

#[test]
fn bootstraps_share_out_chains_by_weight() {
    let weights = [0.0, 1.0, f64::NAN, 3.0, -1.0, 0.0, 4.0, 0.0];
    let bootstrap: Bootstrap = weights.into_iter().collect();
    assert_eq!((bootstrap.count(), bootstrap.invalid(), bootstrap.normalization()), (8, 2, 1.0));
    for u in [0.0, 0.3, 0.999] {
        let mut counts = [0; 8];
        (0..800).for_each(|c| counts[bootstrap.start(c, 800, u).expect("possible")] += 1);
        assert_eq!(counts, [0, 100, 0, 300, 0, 0, 400, 0]);
    }
    assert_eq!((bootstrap.start(3, 3, 0.5), bootstrap.start(0, 0, 0.5)), (None, None));
    let black: Bootstrap = [0.0; 5].into_iter().collect();
    assert_eq!((black.start(0, 1, 0.5), black.normalization()), (None, 0.0));
    assert_eq!(Bootstrap::default().start(0, 1, 0.0), None);
}
