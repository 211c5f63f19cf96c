//! Markov chains: stationarity and detailed balance on states that can be counted; what they count and say; bootstrap.
//!
//! Statistical tests have a significance of 0.01, divided among their parts (Šidák), and fixed seeds.

use luz_sample::Samples;
use luz_sample::markov::{Acceptance, Bootstrap, Chain, Log, Outcome, Proposal};
use luz_sample::random::Random;
use luz_sample::test_support::{chi2, reversibility, sidak};

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
