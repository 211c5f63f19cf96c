//! Russian roulette and splitting: unbiased whatever is expected, and best where the formula says.
//!
//! Statistical tests have a significance of 0.01, divided among their parts (Šidák), and fixed seeds.

use luz_sample::Samples;
use luz_sample::random::Random;
use luz_sample::roulette::{Continuations, Efficiency, Limits, Outcomes, Roulette, throughput_survival};
use luz_sample::statistics::Running;
use luz_sample::test_support::{mean_z_test, sidak};

/// The mean of counts and of total weights over all numbers that `u` can be, exactly.
fn means(expected: f32) -> (f64, f64) {
    let (mut count, mut weight) = (0.0, 0.0);
    let all = 1u32 << 24;
    for i in 0..all {
        let c = Continuations::draw(expected, i as f32 / all as f32);
        count += f64::from(c.count);
        weight += f64::from(c.count) * f64::from(c.weight);
    }
    (count / f64::from(all), weight / f64::from(all))
}

#[test]
fn weights_make_up_for_numbers_exactly() {
    for expected in [1e-9, 3e-8, 0.01, 0.3, 0.999_999_9, 1.0, 1.3, 7.9] {
        let (count, weight) = means(expected);
        // In f32, a weight is off by 6e-8 of itself at most.
        assert!((weight - 1.0).abs() < 1.2e-7, "{expected}: {weight}");
        assert!((count - f64::from(expected)).abs() <= f64::powi(2.0, -24), "{expected}: {count}");
    }
    assert_eq!(Continuations::draw(0.0, 0.0), Continuations::NONE);
    assert_eq!(Continuations::draw(-1.0, 0.5), Continuations::NONE);
    assert_eq!(Continuations::draw(f32::NAN, 0.5), Continuations::ONE);
    assert_eq!(Continuations::draw(f32::INFINITY, 0.5).count, 65536);
}

/// An expected number of continuations, given a place and the throughput.
type Rule = Box<dyn Fn(usize, f64) -> f64>;

/// A random walk over 0..6 that adds something wherever it is, goes on to a random neighbour with a random factor, and ends
/// where it leaves: what a path tracer does. Returns the estimate and its cost, in steps.
fn walk(
    place: usize,
    throughput: f64,
    depth: u32,
    random: &mut Random,
    expected: &dyn Fn(usize, f64) -> f64,
) -> (f64, f64) {
    const EMITS: [f64; 6] = [0.0, 0.1, 0.0, 0.0, 0.5, 30.0];
    let (mut estimate, mut cost) = (throughput * EMITS[place], 1.0);
    if depth == 20 {
        return (estimate, cost);
    }
    let n = Continuations::draw(expected(place, throughput) as f32, random.next_1d());
    for _ in 0..n.count {
        let (up, factor) = (random.next_f64() < 0.3, 1.6 * random.next_f64());
        let next = if up { place + 1 } else { place.wrapping_sub(1) };
        if next < EMITS.len() {
            let (more, price) = walk(next, throughput * f64::from(n.weight) * factor, depth + 1, random, expected);
            estimate += more;
            cost += price;
        }
    }
    (estimate, cost)
}

/// The expectation of [`walk`], by recursion over what is to be had from each place.
fn expectation() -> f64 {
    const EMITS: [f64; 6] = [0.0, 0.1, 0.0, 0.0, 0.5, 30.0];
    let mut value = EMITS;
    for _ in 0..20 {
        let at = |i: usize| value.get(i).copied().unwrap_or(0.0);
        value = std::array::from_fn(|i| EMITS[i] + 0.8 * (0.3 * at(i + 1) + 0.7 * at(i.wrapping_sub(1))));
    }
    value[2]
}

/// Statistics of estimates and costs of many walks.
fn walks(count: u64, seed: u64, expected: &dyn Fn(usize, f64) -> f64) -> (Running, Running) {
    let each = |index| walk(2, 1.0, 0, &mut Random::new(seed, 0, index), expected);
    let (mut estimates, mut costs) = (Running::new(), Running::new());
    for (e, c) in (0..count).map(each) {
        estimates.push(e);
        costs.push(c);
    }
    (estimates, costs)
}

/// Outcomes of every place, from walks that begin there, given the roulette.
fn outcomes(count: u64, seed: u64, expected: &dyn Fn(usize, f64) -> f64) -> [Outcomes<1>; 6] {
    std::array::from_fn(|place| {
        let mut outcomes = Outcomes::default();
        for index in 0..count {
            // One continuation: a step and what follows.
            let mut random = Random::new(seed, 1 + place as u64, index);
            let (up, factor) = (random.next_f64() < 0.3, 1.6 * random.next_f64());
            let next = if up { place + 1 } else { place.wrapping_sub(1) };
            let (estimate, cost) = if next < 6 { walk(next, factor, 1, &mut random, expected) } else { (0.0, 0.0) };
            outcomes.push(&[estimate], cost + 0.1);
        }
        outcomes
    })
}

#[test]
fn walks_are_unbiased_whatever_is_expected() {
    const WALKS: u64 = 100_000;
    let truth = expectation();
    let measure = Efficiency::new(4.0, 10.0).expect("positive");
    let known = outcomes(200, 9, &|_, _| 1.0);
    let rules: [(&str, Rule); 6] = [
        ("none", Box::new(|_, _| 1.0)),
        ("throughput", Box::new(|_, t| f64::from(throughput_survival(t as f32, &Limits::ROULETTE)))),
        ("half", Box::new(|_, _| 0.5)),
        ("one and a half", Box::new(|_, _| 1.5)),
        ("by place", Box::new(|place, _| 0.3 + 0.4 * place as f64)),
        (
            "efficiency",
            Box::new(move |place, t| f64::from(Limits::SPLITTING.clamp(measure.expected(&[t], &known[place]) as f32))),
        ),
    ];
    let p = sidak(0.01, rules.len());
    for (name, rule) in &rules {
        let count = if *name == "one and a half" { WALKS / 10 } else { WALKS };
        let (r, _) = walks(count, 1, rule);
        assert!(
            mean_z_test(r.mean(), r.standard_error().powi(2), truth, 0.0) > p,
            "{name}: {} ± {}, not {truth}",
            r.mean(),
            r.standard_error()
        );
    }
    // The test notices weights that do not fit.
    let (r, _) = walks(WALKS, 1, &|place, _| if place == 3 { 0.0 } else { 1.0 });
    assert!(mean_z_test(r.mean(), r.standard_error().powi(2), truth, 0.0) < 1e-6);
}

#[test]
fn the_formula_finds_the_most_efficient_number() {
    // A first step leads, evenly, to places of outcomes (T, M, V, C); everything is known exactly, equations (1) and (2).
    let places = [(1.0, 1.0, 25.0, 1.0), (0.1, 1.0, 0.1, 5.0), (0.5, 2.0, 0.05, 0.2), (0.3, 0.01, 400.0, 3.0)];
    let product = |n: &[f64; 4]| {
        let means = places.map(|(t, m, _, _)| t * m);
        let mean = means.iter().sum::<f64>() / 4.0;
        let mut variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / 4.0;
        let mut cost = 1.0;
        for (&(t, m, v, c), n) in places.iter().zip(n) {
            let s = if *n >= 1.0 { v / n } else { (v + m * m) / n - m * m };
            variance += t * t * s / 4.0;
            cost += c * n / 4.0;
        }
        (variance, cost)
    };
    let mut n = [1.0; 4];
    for _ in 0..60 {
        let (variance, cost) = product(&n);
        let efficiency = Efficiency::new(cost, variance).expect("positive");
        n = std::array::from_fn(|k| {
            let (t, m, v, c) = places[k];
            efficiency.expected_of(t * t * (v + m * m), t * t * v, c)
        });
    }
    let best = {
        let (v, c) = product(&n);
        v * c
    };
    // No other numbers are better: one at a time, pairs, and far away.
    for i in 0..4 {
        for j in 0..4 {
            for a in [0.3, 0.7, 0.97, 1.03, 1.5, 4.0] {
                for b in [0.3, 0.7, 0.97, 1.0, 1.03, 1.5, 4.0] {
                    let mut other = n;
                    other[i] *= a;
                    other[j] *= b;
                    let (v, c) = product(&other);
                    assert!(v * c >= best * (1.0 - 1e-9), "{n:?} {other:?}: {} {best}", v * c);
                }
            }
        }
    }
    // It splits, it ends, and it leaves alone.
    assert!(n[0] > 2.0 && n[1] < 0.5 && n[2] == 1.0 && n[3] > 1.0, "{n:?}");
    let (v, c) = product(&[1.0; 4]);
    assert!(best < 0.8 * v * c);
}

#[test]
fn walks_become_more_efficient() {
    let inefficiency = |(r, c): &(Running, Running)| r.variance() * c.mean();
    let none = walks(40_000, 3, &|_, _| 1.0);
    let classic = walks(40_000, 3, &|_, t| f64::from(throughput_survival(t as f32, &Limits::ROULETTE)));
    // Three rounds of learning, each from walks of the rule before.
    let mut rule: Rule = Box::new(|_, _| 1.0);
    for seed in 0..3 {
        let (r, c) = walks(4000, 20 + seed, &rule);
        let known = outcomes(1000, 30 + seed, &rule);
        let efficiency = Efficiency::new(c.mean(), r.variance()).expect("positive");
        rule = Box::new(move |place, t| {
            f64::from(Limits::SPLITTING.clamp(efficiency.expected(&[t], &known[place]) as f32))
        });
    }
    let aware = walks(40_000, 3, &rule);
    let [none, classic, aware] = [none, classic, aware].map(|x| inefficiency(&x));
    assert!(aware < 0.5 * none && aware < 0.5 * classic, "{none} {classic} {aware}");
}

#[test]
fn outcomes_that_make_no_sense_change_nothing() {
    let efficiency = Efficiency::new(1.0, 1.0).expect("positive");
    let mut outcomes = Outcomes::<2>::default();
    assert_eq!(efficiency.expected(&[1.0, 1.0], &outcomes), 1.0);
    outcomes.push(&[f64::NAN, 1.0], 1.0);
    outcomes.push(&[1.0, 1.0], f64::INFINITY);
    assert_eq!(outcomes.count(), 0);
    outcomes.push(&[0.0, 0.0], 1.0);
    outcomes.push(&[0.0, 0.0], 3.0);
    assert_eq!((outcomes.count(), outcomes.cost(), outcomes.variance(1)), (2, 2.0, 0.0));
    assert_eq!(efficiency.expected(&[1.0, 1.0], &outcomes), 0.0);
    // Certain ones, of mean 0.3 and 0.1 and cost 4: the root of the mean of 0.3² · 1 and 0.1² · 4, over that of the cost.
    let mut certain = Outcomes::<2>::default();
    (0..2).for_each(|_| certain.push(&[0.3, 0.1], 4.0));
    assert!((efficiency.expected(&[1.0, 2.0], &certain) - (0.065f64 / 4.0).sqrt()).abs() < 1e-12);
    assert_eq!(Limits::SPLITTING.clamp(0.0), 0.05);
    assert_eq!(Limits::SPLITTING.clamp(f32::NAN), 1.0);
    for (cost, variance) in [(0.0, 1.0), (1.0, 0.0), (f64::NAN, 1.0), (1.0, f64::INFINITY), (-1.0, 1.0)] {
        assert_eq!(Efficiency::new(cost, variance), None);
    }
    let mut half = Outcomes::<1>::default();
    let mut whole = half;
    for i in 0..10 {
        if i < 5 {
            half.push(&[f64::from(i)], 1.0)
        }
        whole.push(&[f64::from(i)], 1.0);
    }
    let mut rest = Outcomes::<1>::default();
    (5..10).for_each(|i| rest.push(&[f64::from(i)], 1.0));
    half.merge(&rest);
    assert!((half.variance(0) - whole.variance(0)).abs() < 1e-12 && half.mean(0) == whole.mean(0));
    assert_eq!((half.mean(7), half.variance(7)), (0.0, f64::INFINITY));
    let text = serde_json::to_string(&half).expect("plain numbers");
    assert_eq!(serde_json::from_str::<Outcomes<1>>(&text).expect("what was written"), half);
    assert!(serde_json::from_str::<Outcomes<2>>(&text).is_err());
}

#[test]
fn names_are_read_back() {
    for kind in Roulette::ALL {
        assert_eq!(kind.to_string().parse(), Ok(kind));
    }
    let error = "russian".parse::<Roulette>().expect_err("no such name");
    assert_eq!(error.to_string(), "`russian` is no Russian roulette: expected one of `none` `throughput` `efficiency`");
}
