//! Property and χ² tests of the tabulated distributions. The χ² tests have a family-wise significance of 0.01 (Šidák).

use glam::Vec2;
use luz_sample::ONE_MINUS_EPSILON;
use luz_sample::Samples;
use luz_sample::distribution::*;
use luz_sample::random::Random;
use luz_sample::test_support::{chi2, chi2_interval, chi2_rectangle, sidak};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Tables with many zeros, single peaks, and values of any magnitude.
fn table(len: impl Into<prop::collection::SizeRange>) -> impl Strategy<Value = Vec<f32>> {
    let value = prop_oneof![
        3 => Just(0.0f32),
        3 => 0f32..10.0,
        1 => (-100f32..88.0).prop_map(f32::exp),
        1 => prop::sample::select(vec![1e-45f32, f32::MIN_POSITIVE, f32::MAX]),
    ];
    prop::collection::vec(value, len)
}

/// Numbers of `[0, 1)`, often at its ends.
fn unit() -> impl Strategy<Value = f32> {
    prop_oneof![
        Just(0.0f32),
        Just(ONE_MINUS_EPSILON),
        Just(1e-7),
        Just(1e-38),
        (0u32..1 << 24).prop_map(|i| i as f32 / 16_777_216.0)
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn discrete(weights in table(1..40), u in unit()) {
        let distribution = Discrete::new(&weights).unwrap();
        let (index, probability, remapped) = distribution.sample(u);
        prop_assert_eq!(probability, distribution.probability(index));
        let sum: f64 = weights.iter().map(|&w| f64::from(w)).sum();
        prop_assert!((distribution.sum() - sum).abs() <= 1e-12 * sum);
        if sum > 0.0 {
            prop_assert!(probability > 0.0 && weights[index] > 0.0);
            prop_assert!((f64::from(probability) - f64::from(weights[index]) / sum).abs() <= 1e-7);
            prop_assert!((0.0..1.0).contains(&remapped));
            let total: f32 = (0..weights.len()).map(|i| distribution.probability(i)).sum();
            prop_assert!((total - 1.0).abs() < 1e-5);
            let back = distribution.invert(index, remapped).unwrap();
            // The same outcome and number, if not by the same u: where two parts of an outcome meet, u may be in either.
            let again = [back, (back - 2e-7).max(0.0), (back + 2e-7).min(ONE_MINUS_EPSILON)].map(|u| distribution.sample(u));
            let near = |r: f32| (r - remapped).abs() * probability < 2e-6;
            prop_assert!(again.iter().any(|&(i, _, r)| i == index && near(r)), "{index} {remapped} {again:?}");
        } else {
            prop_assert_eq!(probability, 0.0);
        }
    }

    #[test]
    fn one_dimension(values in table(1..70), u in unit(), start in -5f32..5.0, length in 0.01f32..100.0) {
        let d = PiecewiseConstant1D::with_domain(&values, start, start + length).unwrap();
        let (x, pdf, index) = d.sample(u);
        prop_assert_eq!(pdf.to_bits(), d.pdf(x).to_bits());
        prop_assert!(x >= start && x <= start + length);
        let width = (f64::from(start + length) - f64::from(start)) / values.len() as f64;
        let integral = values.iter().map(|&v| f64::from(v)).sum::<f64>() * width;
        prop_assert!((d.integral() - integral).abs() <= 1e-12 * integral);
        if integral > 0.0 {
            prop_assert!(pdf > 0.0 && values[index] > 0.0);
            let expected = f64::from(values[index]) / integral;
            prop_assert!((f64::from(pdf) - expected).abs() <= 1e-6 * expected + 1e-44);
            // A rounding of x is one of u, of as many times as the density is above the average.
            let tolerance = 1e-6 + 1e-6 * f64::from(pdf) * (f64::from(start.abs()) + f64::from(length));
            let back = d.invert(x).unwrap();
            prop_assert!(f64::from((back - u).abs()) <= tolerance, "{u} {back}");
        } else {
            prop_assert_eq!(pdf, 0.0);
        }
        prop_assert_eq!(d.pdf(start - 1.0), 0.0);
        prop_assert_eq!(d.invert(start + 2.0 * length), None);
    }

    #[test]
    fn two_dimensions((width, values) in (1usize..12, 1usize..12).prop_flat_map(|(w, h)| (Just(w), table(w * h))), u in unit(), v in unit()) {
        let height = values.len() / width;
        let (min, max) = (Vec2::new(-1.0, 2.0), Vec2::new(3.0, 2.5));
        let d = PiecewiseConstant2D::with_domain(&values, [width, height], min, max).unwrap();
        let (p, pdf) = d.sample(Vec2::new(u, v));
        prop_assert_eq!(pdf.to_bits(), d.pdf(p).to_bits());
        prop_assert!(p.cmpge(min).all() && p.cmple(max).all());
        let sum = values.iter().map(|&v| f64::from(v)).sum::<f64>();
        prop_assert!((d.integral() - sum * 2.0 / values.len() as f64).abs() <= 1e-12 * sum);
        if sum > 0.0 {
            prop_assert!(pdf > 0.0);
            let back = d.invert(p).unwrap();
            let tolerance = 1e-5 * (1.0 + pdf.min(1e3));
            prop_assert!((back.y - v).abs() <= tolerance, "{v} {back}");
        } else {
            prop_assert_eq!(pdf, 0.0);
        }
    }
}

#[test]
fn one_hot_and_single_tables_are_exact() {
    for n in [1usize, 2, 3, 5, 1000, 4097] {
        for hot in [0, n / 2, n - 1] {
            let mut values = vec![0.0; n];
            values[hot] = 7.0;
            let (alias, steps) = (Discrete::new(&values).unwrap(), PiecewiseConstant1D::new(&values).unwrap());
            let grid = PiecewiseConstant2D::new(&values, [n, 1]).unwrap();
            for u in [0.0, f32::MIN_POSITIVE, 0.3, 0.999, ONE_MINUS_EPSILON] {
                let (index, probability, remapped) = alias.sample(u);
                assert_eq!((index, probability), (hot, 1.0));
                assert!((0.0..1.0).contains(&remapped));
                let (x, pdf, index) = steps.sample(u);
                assert_eq!((index, pdf), (hot, n as f32));
                assert_eq!(steps.pdf(x), pdf);
                assert!((steps.invert(x).unwrap() - u).abs() <= 2e-7 * n as f32);
                let (p, pdf) = grid.sample(Vec2::new(u, u));
                assert_eq!((pdf, grid.pdf(p)), (n as f32, n as f32));
            }
        }
    }
}

#[test]
fn remapped_numbers_are_uniform_given_the_outcome() {
    let weights = [1.0, 0.0, 5.0, 0.2, 3.0, 0.7, 0.1];
    let d = Discrete::new(&weights).unwrap();
    const N: u64 = 400_000;
    let mut observed = vec![0u64; weights.len() * 10];
    for i in 0..N {
        let (index, _, remapped) = d.sample(Random::new(1, 0, i).next_1d());
        observed[index * 10 + (remapped * 10.0) as usize] += 1;
    }
    let expected: Vec<f64> = (0..observed.len()).map(|i| N as f64 * f64::from(weights[i / 10]) / 100.0).collect();
    let result = chi2(&observed, &expected);
    assert!(result.passes(sidak(0.01, 4)), "{result:?}");
}

#[test]
fn samples_have_the_density_of_the_table() {
    let values: Vec<f32> = (0..60).map(|i| if i % 7 == 3 { 0.0 } else { (i as f32 * 0.7).sin().powi(2) }).collect();
    let d = PiecewiseConstant1D::with_domain(&values, -2.0, 4.0).unwrap();
    let run = |factor: f64| {
        let pdf = |x: f32| f64::from(d.pdf(x)) * (1.0 + factor * f64::from(x - 1.0));
        chi2_interval(|u| d.sample(u).0, pdf, [-2.0, 4.0], 120, 200_000, 2)
    };
    assert!(run(0.0).passes(sidak(0.01, 4)), "{:?}", run(0.0));
    assert!(!run(0.02).passes(1e-6), "{:?}", run(0.02));

    let d = PiecewiseConstant2D::new(&values, [10, 6]).unwrap();
    let run = |factor: f64| {
        let pdf = |p: Vec2| f64::from(d.pdf(p)) * (1.0 + factor * f64::from(p.x - 0.5));
        chi2_rectangle(|u| Some(d.sample(u).0), pdf, [0.0, 1.0, 0.0, 1.0], [20, 12], 200_000, 3)
    };
    assert!(run(0.0).passes(sidak(0.01, 4)), "{:?}", run(0.0));
    assert!(!run(0.1).passes(1e-6), "{:?}", run(0.1));
}

#[test]
fn bad_tables_are_errors() {
    use DistributionError as E;
    assert_eq!(Discrete::new(&[]).err(), Some(E::Empty));
    assert_eq!(Discrete::new(&[1.0, -1.0]).err(), Some(E::Value { index: 1, value: -1.0 }));
    assert!(matches!(PiecewiseConstant1D::new(&[f32::NAN]), Err(E::Value { index: 0, .. })));
    assert!(matches!(PiecewiseConstant2D::new(&[1.0, f32::INFINITY], [2, 1]), Err(E::Value { index: 1, .. })));
    assert_eq!(PiecewiseConstant2D::new(&[1.0; 5], [2, 3]).err(), Some(E::Length { expected: 6, found: 5 }));
    assert_eq!(PiecewiseConstant2D::new(&[], [0, 3]).err(), Some(E::Empty));
    for (a, b) in [(1.0, 1.0), (1.0, 0.0), (0.0, f32::INFINITY), (f32::NAN, 1.0), (1e6, 1_000_000.1)] {
        assert_eq!(PiecewiseConstant1D::with_domain(&[1.0; 9], a, b).err(), Some(E::Domain), "{a} {b}");
    }
    assert_eq!(PiecewiseConstant1D::new(&vec![1.0; (1 << 21) + 1]).err(), Some(E::TooLarge));
}

/// A frame around texels: the values along the edges are those of the texels next to them.
fn framed(texels: &[f32], [width, height]: [usize; 2]) -> Vec<f32> {
    let at = |i: usize, n: usize| i.saturating_sub(1).min(n - 1);
    (0..height + 2)
        .flat_map(|y| (0..width + 2).map(move |x| (x, y)))
        .map(|(x, y)| texels[at(y, height) * width + at(x, width)])
        .collect()
}

#[test]
fn samples_have_the_interpolated_density() {
    for measure in [SquareMeasure::Flat, SquareMeasure::Latitudes] {
        for size @ [width, height] in [[1, 1], [1, 3], [5, 1], [8, 6]] {
            let texels: Vec<f32> =
                (0..width * height).map(|i| if i % 7 == 3 { 0.0 } else { (i % 5) as f32 + 0.2 }).collect();
            let d = PiecewiseBilinear2D::new(framed(&texels, size), size, measure).unwrap();
            let weight = |y: f32| match measure {
                SquareMeasure::Flat => 1.0,
                SquareMeasure::Latitudes => (std::f64::consts::PI * f64::from(y)).sin(),
            };
            let run = |factor: f64| {
                let pdf = |p: Vec2| f64::from(d.pdf(p)) * weight(p.y) * (1.0 + factor * f64::from(p.x - 0.5));
                chi2_rectangle(
                    |u| Some(d.sample(u).0),
                    pdf,
                    [0.0, 1.0, 0.0, 1.0],
                    [2 * width, 2 * height + 1],
                    200_000,
                    7,
                )
            };
            assert!(run(0.0).passes(sidak(0.01, 8)), "{measure:?} {size:?}: {:?}", run(0.0));
            assert!((run(0.0).pdf_integral - 1.0).abs() < 1e-3);
            assert!(!run(0.1).passes(1e-6), "{measure:?} {size:?}: a wrong density must be noticed");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, rng_seed: RngSeed::Fixed(2), ..ProptestConfig::default() })]

    #[test]
    fn interpolated_tables_of_any_kind(
        (texels, size) in (1usize..7, 1usize..6).prop_flat_map(|(w, h)| (table(w * h), Just([w, h]))),
        u in (unit(), unit()),
        latitudes in any::<bool>(),
    ) {
        let measure = if latitudes { SquareMeasure::Latitudes } else { SquareMeasure::Flat };
        let d = PiecewiseBilinear2D::new(framed(&texels, size), size, measure).unwrap();
        let (point, density) = d.sample(Vec2::new(u.0, u.1));
        prop_assert!((0.0..1.0).contains(&point.x) && (0.0..1.0).contains(&point.y));
        prop_assert_eq!(density, d.pdf(point));
        prop_assert!(density.is_finite() && density >= 0.0);
    }
}

#[test]
fn samples_of_a_window_have_its_density() {
    let size @ [width, height] = [9, 7];
    let values: Vec<f32> = (0..width * height).map(|i| if i % 5 == 2 { 0.0 } else { (i % 7) as f32 }).collect();
    let d = WindowedPiecewiseConstant2D::new(values.clone(), size).unwrap();
    assert!((d.integral(&Window::ALL) - values.iter().map(|&v| f64::from(v)).sum::<f64>() / 63.0).abs() < 1e-12);
    let windows = [
        Window::ALL,
        Window { min: Vec2::new(0.13, 0.4), max: Vec2::new(0.77, 0.95) },
        // Within one cell, and across the border of two.
        Window { min: Vec2::new(0.46, 0.45), max: Vec2::new(0.52, 0.54) },
        Window { min: Vec2::new(0.5, 0.2), max: Vec2::new(0.6, 0.21) },
    ];
    for window in windows {
        let Window { min, max } = window;
        let rectangle = [min.x, max.x, min.y, max.y].map(f64::from);
        let run = |factor: f64| {
            let middle = 0.5 * (min.x + max.x);
            let pdf =
                |p: Vec2| f64::from(d.pdf(&window, p)) * (1.0 + factor * f64::from((p.x - middle) / (max.x - min.x)));
            chi2_rectangle(|u| d.sample(&window, u).map(|s| s.0), pdf, rectangle, [18, 14], 200_000, 5)
        };
        assert!(run(0.0).passes(sidak(0.01, 4)), "{window:?}: {:?}", run(0.0));
        assert!(!run(0.1).passes(1e-6), "{window:?}");
    }
    let nothing = Window { min: Vec2::new(0.3, 0.01), max: Vec2::new(0.3, 0.02) };
    assert!(d.sample(&nothing, Vec2::splat(0.5)).is_none());
    let beside = WindowedPiecewiseConstant2D::new(vec![0.0, 1.0], [2, 1]).unwrap();
    assert!(beside.sample(&Window { min: Vec2::ZERO, max: Vec2::new(0.5, 1.0) }, Vec2::splat(0.5)).is_none());
}
