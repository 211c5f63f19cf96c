//! What combinations of techniques promise, measured on integrands over `[0, 1]` of which the integral `μ` is known.
//!
//! Variances are measured over rounds of samples; tests have a significance of 0.01, divided among their parts (Šidák), and
//! fixed seeds.

use luz_sample::mis::{Heuristic, Optimal};
use luz_sample::random::Random;
use luz_sample::statistics::Running;
use luz_sample::test_support::{mean_z_test, normal_survival, sidak};

/// A density, and how a uniform number becomes a sample of it.
struct Technique {
    sample: fn(f64) -> f64,
    pdf: fn(f64) -> f64,
}

const TECHNIQUES: [Technique; 5] = [
    Technique { sample: |u| u, pdf: |_| 1.0 },
    Technique { sample: f64::sqrt, pdf: |x| 2.0 * x },
    Technique { sample: |u| 1.0 - (1.0 - u).sqrt(), pdf: |x| 2.0 - 2.0 * x },
    // Misses half of the domain.
    Technique { sample: |u| 0.5 * u, pdf: |x| if x < 0.5 { 2.0 } else { 0.0 } },
    // A hundredth of the domain has nine tenths of the samples.
    Technique {
        sample: |u| {
            if u < 0.9 {
                0.3 + 0.01 * (u / 0.9)
            } else if u < 0.93 {
                10.0 * (u - 0.9)
            } else {
                0.31 + (u - 0.93) * (0.69 / 0.07)
            }
        },
        pdf: |x| {
            if (0.3..0.31).contains(&x) {
                90.0
            } else if x < 0.3 {
                0.1
            } else {
                0.07 / 0.69
            }
        },
    },
];

type Integrand = (&'static str, fn(f64) -> f64, f64);
const INTEGRANDS: [Integrand; 5] = [
    ("linear", |x| 1.0 + 2.0 * x, 2.0),
    ("square", |x| x * x, 1.0 / 3.0),
    ("step", |x| if x < 0.3 { 1.0 } else { 0.0 }, 0.3),
    ("spike", |x| if (0.3..0.31).contains(&x) { 70.0 } else { 0.3 }, 0.7 + 0.297),
    ("wave", |x| 1.0 + (10.0 * x).sin(), 1.0 + 0.1 * (1.0 - -0.839_071_529_076_452_5)),
];

/// Techniques by number, each with its count.
type Mixture = &'static [(usize, u32)];
const MIXTURES: [Mixture; 5] =
    [&[(0, 1), (1, 1)], &[(0, 1), (4, 1)], &[(1, 3), (2, 1)], &[(1, 1), (2, 2), (3, 4), (4, 1)], &[(0, 4), (3, 2)]];

/// The samples of a round, with their technique's place in the mixture.
fn round(mixture: Mixture, seed: u64, index: u64) -> impl Iterator<Item = (usize, f64)> {
    let mut random = Random::new(seed, 0, index);
    mixture.iter().enumerate().flat_map(move |(place, &(technique, count))| {
        let mut draw = random;
        random.next_u64();
        (0..count).map(move |i| {
            let u = if i == 0 {
                draw.next_f64()
            } else {
                Random::new(seed, 1 + u64::from(i) + 100 * place as u64, index).next_f64()
            };
            (place, (TECHNIQUES[technique].sample)(u))
        })
    })
}

/// Counts and densities at a point.
fn counts_and_pdfs(mixture: Mixture, x: f64) -> Vec<(f32, f32)> {
    mixture.iter().map(|&(t, n)| (n as f32, (TECHNIQUES[t].pdf)(x) as f32)).collect()
}

/// The estimates of rounds, each with `weight(technique, x)`.
fn estimates(mixture: Mixture, f: fn(f64) -> f64, rounds: u64, weight: impl Fn(usize, f64) -> f64) -> Vec<f64> {
    let estimate = |index| {
        let terms = round(mixture, 7, index).map(|(place, x)| {
            let (technique, count) = mixture[place];
            weight(place, x) * f(x) / (f64::from(count) * (TECHNIQUES[technique].pdf)(x))
        });
        terms.sum::<f64>()
    };
    (0..rounds).map(estimate).collect()
}

/// The variance of numbers, with its squared standard error.
fn variance(numbers: &[f64]) -> (f64, f64) {
    let mean = numbers.iter().copied().collect::<Running>().mean();
    let squares: Running = numbers.iter().map(|x| (x - mean).powi(2)).collect();
    (squares.mean(), squares.standard_error().powi(2))
}

/// The p-value of the hypothesis that `a ≤ b`, given squared errors.
fn at_most((a, a_error): (f64, f64), (b, b_error): (f64, f64)) -> f64 {
    let (difference, error) = (a - b, (a_error + b_error).sqrt());
    // What differs by rounding only is equal.
    if difference <= 1e-9 * b + 1e-20 { 1.0 } else { normal_survival(difference / error) }
}

const HEURISTICS: [Heuristic; 8] = [
    Heuristic::Balance,
    Heuristic::Power(2.0),
    Heuristic::Power(8.0),
    Heuristic::Power(0.5),
    Heuristic::Cutoff(0.1),
    Heuristic::Maximum,
    Heuristic::Average,
    Heuristic::Optimal,
];

/// Weights that sum to one and are drawn at random for each of ten parts of the domain.
fn arbitrary(mixture: Mixture, seed: u64) -> impl Fn(usize, f64) -> f64 {
    move |place, x| {
        let part = (10.0 * x) as u64;
        let q = |k: usize| {
            let possible = (TECHNIQUES[mixture[k].0].pdf)(x) > 0.0;
            let weight = Random::new(seed, part, k as u64).next_f64();
            if possible { weight } else { 0.0 }
        };
        q(place) / (0..mixture.len()).map(q).sum::<f64>()
    }
}

#[test]
fn every_heuristic_is_unbiased() {
    let p = sidak(0.01, HEURISTICS.len() * MIXTURES.len() * INTEGRANDS.len());
    for mixture in MIXTURES {
        for (name, f, mu) in INTEGRANDS {
            for heuristic in HEURISTICS {
                let weight = |place, x| f64::from(heuristic.weight(place, &counts_and_pdfs(mixture, x)));
                let r: Running = estimates(mixture, f, 5000, weight).into_iter().collect();
                let value = mean_z_test(r.mean(), r.standard_error().powi(2).max(1e-12), mu, 0.0);
                assert!(value > p, "{mixture:?} {name} {heuristic}: {} ± {}, not {mu}", r.mean(), r.standard_error());
            }
        }
    }
}

/// Veach 1997, theorem 9.2: no combination has a variance lower than the balance heuristic's by more than
/// `(1/min nⱼ − 1/Σ nⱼ) μ²`. Returns the least p-value, and the largest fraction of the allowance that a combination used.
fn guarantee(balance: impl Fn(Mixture, usize, f64) -> f64, rounds: u64) -> (f64, f64) {
    let (mut least, mut used) = (1.0f64, 0.0f64);
    for mixture in MIXTURES {
        let counts = || mixture.iter().map(|&(_, n)| f64::from(n));
        let factor = 1.0 / counts().fold(f64::INFINITY, f64::min) - 1.0 / counts().sum::<f64>();
        for (_, f, mu) in INTEGRANDS {
            let bound = factor * mu * mu;
            let own = variance(&estimates(mixture, f, rounds, |place, x| balance(mixture, place, x)));
            let mut compare = |other: (f64, f64)| {
                least = least.min(at_most(own, (other.0 + bound, other.1)));
                used = used.max((own.0 - other.0) / bound);
            };
            for heuristic in HEURISTICS {
                let weight = |place, x| f64::from(heuristic.weight(place, &counts_and_pdfs(mixture, x)));
                compare(variance(&estimates(mixture, f, rounds, weight)));
            }
            for seed in 0..4 {
                compare(variance(&estimates(mixture, f, rounds, arbitrary(mixture, seed))));
            }
        }
    }
    (least, used)
}

#[test]
fn the_balance_heuristic_keeps_its_guarantee() {
    let balance = |mixture, place, x| f64::from(Heuristic::Balance.weight(place, &counts_and_pdfs(mixture, x)));
    let (p, used) = guarantee(balance, 4000);
    assert!(p > sidak(0.01, MIXTURES.len() * INTEGRANDS.len() * (HEURISTICS.len() + 4)), "{p}");
    // Some do better than it, or nothing would have been tested.
    assert!(used > 0.02, "{used}");
}

#[test]
fn other_weights_do_not_keep_the_guarantee() {
    // Weights against the densities, and the mean of the techniques.
    let contrary = |mixture: Mixture, place: usize, x: f64| {
        let q = |k: usize| {
            let (technique, count) = mixture[k];
            let p = (TECHNIQUES[technique].pdf)(x) * f64::from(count);
            if p > 0.0 { 1.0 / p } else { 0.0 }
        };
        q(place) / (0..mixture.len()).map(q).sum::<f64>()
    };
    assert!(guarantee(contrary, 1000).0 < 1e-6);
    let average = |mixture, place, x| f64::from(Heuristic::Average.weight(place, &counts_and_pdfs(mixture, x)));
    assert!(guarantee(average, 1000).0 < 1e-6);
}

/// An estimator over the rounds from `first` on, with the integrand and its negative as channels.
fn optimal<const K: usize>(mixture: Mixture, f: fn(f64) -> f64, first: u64, rounds: u64) -> Optimal<K, 2> {
    let mut estimator = Optimal::new(std::array::from_fn(|k| mixture[k].1));
    for index in first..first + rounds {
        for (place, x) in round(mixture, 11, index) {
            let pdfs: [f64; K] = std::array::from_fn(|k| (TECHNIQUES[mixture[k].0].pdf)(x));
            estimator.push(place, &pdfs, &[f(x), -f(x)]);
        }
        estimator.end_round();
    }
    estimator
}

/// Direct, progressive and balanced estimates of many short runs.
fn runs(mixture: Mixture, f: fn(f64) -> f64, runs: u64, rounds: u64) -> [Vec<f64>; 3] {
    fn some<const K: usize>(mixture: Mixture, f: fn(f64) -> f64, run: u64, rounds: u64) -> [f64; 3] {
        let e = optimal::<K>(mixture, f, run * rounds, rounds);
        assert_eq!(e.invalid(), 0);
        let opposite = |a: [f64; 2]| assert!((a[0] + a[1]).abs() < 1e-9, "channels are alike: {a:?}");
        opposite(e.direct());
        opposite(e.progressive());
        [e.direct()[0], e.progressive()[0], e.balance()[0]]
    }
    let mut all = [vec![], vec![], vec![]];
    for run in 0..runs {
        let estimates = match mixture.len() {
            2 => some::<2>(mixture, f, run, rounds),
            4 => some::<4>(mixture, f, run, rounds),
            _ => unreachable!("no such mixture"),
        };
        all.iter_mut().zip(estimates).for_each(|(all, e)| all.push(e));
    }
    all
}

/// Quadratures over the domain.
struct Exact {
    /// `A`, `b` and the `α` that solves `A α = b`.
    matrix: Vec<Vec<f64>>,
    contributions: Vec<f64>,
    alpha: Vec<f64>,
    /// Variances of a round's estimate with balanced and with optimal weights.
    balance: f64,
    optimal: f64,
}

fn exact(mixture: Mixture, f: fn(f64) -> f64) -> Exact {
    const CELLS: u32 = 20_000;
    let k = mixture.len();
    let (mut matrix, mut contributions, mut square) = (vec![vec![0.0; k]; k], vec![0.0; k], 0.0);
    for i in 0..CELLS {
        let x = (f64::from(i) + 0.5) / f64::from(CELLS);
        let p: Vec<f64> = mixture.iter().map(|t| (TECHNIQUES[t.0].pdf)(x)).collect();
        let d = p.iter().zip(mixture).map(|(p, t)| p * f64::from(t.1)).sum::<f64>() * f64::from(CELLS);
        for i in 0..k {
            for j in 0..k {
                matrix[i][j] += p[i] * p[j] / d;
            }
            contributions[i] += f(x) * p[i] / d;
        }
        square += f(x) * f(x) / d;
    }
    // Gauss and Jordan; these matrices are regular.
    let mut rows: Vec<Vec<f64>> = matrix.iter().zip(&contributions).map(|(a, &b)| [&a[..], &[b]].concat()).collect();
    for column in 0..k {
        let pivot = (column..k).max_by(|&a, &b| rows[a][column].abs().total_cmp(&rows[b][column].abs()));
        rows.swap(column, pivot.expect("rows are left"));
        let pivot = rows[column].clone();
        for (i, row) in rows.iter_mut().enumerate() {
            let factor = if i == column { 1.0 - 1.0 / pivot[column] } else { row[column] / pivot[column] };
            row.iter_mut().zip(&pivot).for_each(|(x, p)| *x -= factor * p);
        }
    }
    let alpha: Vec<f64> = rows.iter().map(|row| row[k]).collect();
    let balance = square - contributions.iter().zip(mixture).map(|(b, t)| f64::from(t.1) * b * b).sum::<f64>();
    let optimal = square - contributions.iter().zip(&alpha).map(|(b, a)| a * b).sum::<f64>();
    Exact { matrix, contributions, alpha, balance, optimal }
}

#[test]
fn optimal_weights_are_unbiased_and_as_good_as_can_be() {
    const RUNS: u64 = 600;
    const ROUNDS: u64 = 128;
    let p = sidak(0.01, MIXTURES.len() * INTEGRANDS.len() * 4);
    let mut gain = 1.0;
    for mixture in MIXTURES {
        for (name, f, mu) in INTEGRANDS {
            let [direct, progressive, balance] = runs(mixture, f, RUNS, ROUNDS);
            let r: Running = progressive.iter().copied().collect();
            let error = r.standard_error().powi(2);
            assert!(mean_z_test(r.mean(), error.max(1e-20), mu, 0.0) > p, "{mixture:?} {name}: {} {mu}", r.mean());
            // The direct estimator's bias is small against the error of one run.
            let d: Running = direct.iter().copied().collect();
            let least = 0.01 * variance(&balance).0.sqrt() + 1e-12;
            assert!((d.mean() - mu).abs() < 4.0 * d.standard_error() + least, "{mixture:?} {name}: {} {mu}", d.mean());

            let exact = exact(mixture, f);
            let [optimum, balanced] = [exact.optimal, exact.balance].map(|v| v.max(0.0) / ROUNDS as f64);
            assert!(optimum < balanced + 1e-12);
            let measured = variance(&balance);
            assert!(mean_z_test(measured.0, measured.1.max(1e-20), balanced, 0.0) > p, "{measured:?} {balanced}");
            // What learning costs: some hundredths of all samples, and the rounds before there is any α.
            let own = variance(&direct);
            assert!(at_most(own, (1.05 * optimum + 1e-4 * balanced, 0.0)) > p, "{mixture:?} {name}: {own:?} {optimum}");
            let own = variance(&progressive);
            let limit = 1.05 * optimum + 0.08 * balanced;
            assert!(at_most(own, (limit, 0.0)) > p, "{mixture:?} {name}: {own:?} {limit}");
            gain *= ((own.0 + 1e-9) / (balanced + 1e-9)).powf(1.0 / 25.0);
        }
    }
    // All in all, far better than the balance heuristic.
    assert!(gain < 0.6, "{gain}");
}

/// `A`, `b` and `α`, against quadrature.
#[test]
fn the_technique_matrix_converges() {
    let mixture = MIXTURES[3];
    let (_, f, mu) = INTEGRANDS[4];
    let e = optimal::<4>(mixture, f, 0, 100_000);
    let exact = exact(mixture, f);
    let estimated = (e.technique_matrix(), e.contribution_vectors(), e.alpha());
    for i in 0..4 {
        for j in 0..4 {
            assert!((estimated.0[i][j] - exact.matrix[i][j]).abs() < 0.01 * exact.matrix[i][i]);
        }
        assert!((estimated.1[i][0] - exact.contributions[i]).abs() < 0.01);
        // Up to a multiple of the counts, which is fixed by the first.
        let relative = |alpha: &dyn Fn(usize) -> f64| alpha(i) - alpha(0) * f64::from(mixture[i].1 / mixture[0].1);
        let (own, true_one) = (relative(&|k| estimated.2[k][0]), relative(&|k| exact.alpha[k]));
        assert!((own - true_one).abs() < 0.03, "{own} {true_one}");
        // A α = b for the estimated ones.
        let left: f64 = (0..4).map(|j| estimated.0[i][j] * estimated.2[j][0]).sum();
        assert!((left - estimated.1[i][0]).abs() < 1e-9);
    }
    assert!((e.direct()[0] - mu).abs() < 0.01);
    assert!(e.standard_error()[0] < 0.01);
}

#[test]
fn failures_and_empty_rounds_are_part_of_the_domain() {
    // The integral of 3x from 0.5 on, where a third of the rounds have nothing to integrate, and the rising technique fails for small numbers.
    let estimate = |honest: bool| {
        let mut e = Optimal::<2, 1>::new([1, 2]);
        for index in 0..60_000 {
            let mut random = Random::new(5, 0, index);
            if random.next_f64() < 1.0 / 3.0 {
                e.end_empty_round();
                continue;
            }
            let f = |x: f64| [if x < 0.5 { 0.0 } else { 3.0 * x }];
            // Density 2x, of which one quarter, below x = 0.5, is lost.
            let rising = |x: f64| if x < 0.5 { 0.0 } else { 2.0 * x };
            let x = random.next_f64();
            e.push(0, &[1.0, rising(x)], &f(x));
            for _ in 0..2 {
                let x = random.next_f64().sqrt();
                if x < 0.5 {
                    if honest {
                        e.push_failure(1);
                    }
                } else {
                    e.push(1, &[1.0, rising(x)], &f(x));
                }
            }
            e.end_round();
        }
        e
    };
    let truth = 1.125 * 2.0 / 3.0;
    let right = estimate(true);
    let p = |e: &Optimal<2, 1>, value: f64| mean_z_test(value, e.standard_error()[0].powi(2), truth, 0.0);
    assert!(p(&right, right.progressive()[0]) > 0.01, "{right:?}");
    assert!(p(&right, right.direct()[0]) > 0.001, "{right:?}");
    // It is noticed when failures are kept secret.
    let wrong = estimate(false);
    assert!(p(&wrong, wrong.progressive()[0]) < 1e-4, "{wrong:?}");
}

#[test]
fn hidden_points_are_failures() {
    // Rays at random directions x, and points on a light at directions of density 2x, of which those below one half are
    // hidden by something black.
    let estimate = |hidden_fails: bool| {
        let mut e = Optimal::<2, 1>::new([1, 1]);
        let f = |x: f64| [if x < 0.5 { 0.0 } else { x * x }];
        for index in 0..60_000 {
            let mut random = Random::new(8, 0, index);
            let (ray, point) = (random.next_f64(), random.next_f64().sqrt());
            // What a ray hits is not the light there.
            let seen = if ray < 0.5 { 0.0 } else { 2.0 * ray };
            e.push(0, &[1.0, seen], &f(ray));
            if point < 0.5 && hidden_fails {
                e.push_failure(1);
            } else {
                e.push(1, &[1.0, 2.0 * point], &f(point));
            }
            e.end_round();
        }
        mean_z_test(e.progressive()[0], e.standard_error()[0].powi(2), 0.875 / 3.0, 0.0)
    };
    assert!(estimate(true) > 0.01);
    assert!(estimate(false) < 1e-6);
}

#[test]
fn any_densities_give_finite_estimates() {
    for case in 0..2000 {
        let mut random = Random::new(9, 0, case);
        let mut e = Optimal::<3, 2>::new([1, 1 + case as u32 % 3, 1]);
        for _ in 0..random.next_u64() % 60 {
            for technique in 0..3 {
                // From 1e-60 to 1e60, often zero, often equal.
                let pdfs: [f64; 3] = std::array::from_fn(|_| match random.next_u64() % 4 {
                    0 => 0.0,
                    1 => 1.0,
                    _ => 10f64.powf(120.0 * random.next_f64() - 60.0),
                });
                e.push(technique, &pdfs, &[random.next_f64(), 1e30]);
            }
            e.end_round();
        }
        let all = [e.direct(), e.progressive(), e.balance()];
        assert!(all.as_flattened().iter().all(|x| x.is_finite()), "{e:?}");
    }
}

#[test]
fn degenerate_techniques_give_the_balance_heuristic() {
    // Equal densities: no control variate is to be had.
    let mut e = Optimal::<3, 1>::new([1, 2, 1]);
    let mut sum = 0.0;
    for index in 0..100 {
        for k in [0, 1, 1, 2] {
            let x = Random::new(6, k as u64, index).next_f64();
            e.push(k, &[1.0, 1.0, 1.0], &[x]);
            sum += x / 400.0;
        }
        e.end_round();
        let expected = sum * 100.0 / (index + 1) as f64;
        for estimate in [e.direct()[0], e.progressive()[0], e.balance()[0]] {
            assert!((estimate - expected).abs() < 1e-6 || index < 99 && estimate.is_finite(), "{estimate} {expected}");
        }
    }
    // A technique that never draws, one that fails always, no samples at all.
    let mut e = Optimal::<2, 1>::new([1, 0]);
    assert_eq!((e.direct(), e.progressive(), e.balance()), ([0.0], [0.0], [0.0]));
    for _ in 0..50 {
        e.push(0, &[2.0, 0.0], &[1.0]);
        e.end_round();
    }
    assert_eq!((e.direct(), e.progressive()), ([0.5], [0.5]));
    let mut e = Optimal::<2, 1>::new([1, 1]);
    for _ in 0..50 {
        e.push(0, &[2.0, 0.0], &[1.0]);
        e.push_failure(1);
        e.end_round();
    }
    assert!((e.direct()[0] - 0.5).abs() < 1e-12 && (e.progressive()[0] - 0.5).abs() < 1e-12);
    let mut e = Optimal::<2, 1>::new([0, 0]);
    e.push(0, &[1.0, 1.0], &[1.0]);
    e.end_empty_round();
    assert_eq!((e.direct(), e.progressive(), e.invalid()), ([0.0], [0.0], 1));
}

#[test]
fn impossible_samples_are_counted() {
    let mut e = Optimal::<2, 1>::new([1, 1]);
    for (technique, pdfs, value) in [
        (0, [0.0, 1.0], 1.0),
        (1, [1.0, f64::NAN], 1.0),
        (1, [-1.0, 1.0], 1.0),
        (0, [f64::INFINITY, 1.0], 1.0),
        (0, [1.0, 1.0], f64::INFINITY),
        (5, [1.0, 1.0], 1.0),
        (0, [1e-320, 0.0], 1.0),
    ] {
        e.push(technique, &pdfs, &[value]);
    }
    e.end_round();
    assert_eq!(e.invalid(), 7);
    assert_eq!(e.progressive(), [0.0]);
}

#[test]
fn estimators_merge_and_are_written_down() {
    let mixture = MIXTURES[0];
    let (_, f, mu) = INTEGRANDS[4];
    let whole = optimal::<2>(mixture, f, 0, 300);
    let mut parts = optimal::<2>(mixture, f, 0, 100);
    parts.merge(&optimal(mixture, f, 100, 200));
    assert_eq!(parts.rounds(), 300);
    assert!((parts.direct()[0] - whole.direct()[0]).abs() < 1e-12);
    assert!((parts.progressive()[0] - mu).abs() < 4.0 * parts.standard_error()[0]);
    let text = serde_json::to_string(&whole).expect("plain numbers");
    assert_eq!(serde_json::from_str::<Optimal<2, 2>>(&text).expect("what was written"), whole);
    assert!(serde_json::from_str::<Optimal<3, 2>>(&text).is_err());
}
