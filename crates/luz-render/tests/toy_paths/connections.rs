//! Connections of walks from both ends: each technique alone, and all of them weighted, find what paths contribute.

use crate::paths::{Paths, contribution, deltas};
use crate::toy::{Kind, Toy, kind};
use glam::Vec2;
use luz_render::transport::connection::{Connection, Scratch, connect};
use luz_render::transport::{Path, PathSpace, Side, Subpath};
use luz_sample::Samples;
use luz_sample::mis::Heuristic;
use luz_sample::random::Random;
use luz_sample::statistics::Running;
use luz_sample::test_support::{mean_z_test, sidak};

/// Vertices of the longest paths.
const MOST: usize = 5;
/// Vertices of the longest paths that are drawn: rarer ones would be found too seldom.
const SAMPLED: usize = 4;
/// Walks of so many vertices end by chance.
const ROULETTE_FROM: usize = 2;

const HEURISTICS: [Heuristic; 5] =
    [Heuristic::Balance, Heuristic::Power(2.0), Heuristic::Cutoff(0.1), Heuristic::Maximum, Heuristic::Average];

/// Always the same number.
struct Number(f32);

impl Samples for Number {
    fn next_1d(&mut self) -> f32 {
        self.0
    }

    fn next_2d(&mut self) -> Vec2 {
        Vec2::splat(self.0)
    }

    fn set_dimension(&mut self, _: u32) {}
}

/// The walk from one side that makes some vertices of a path, and the probability of that, the `δ` of specular vertices left out.
/// `None` if it cannot make them.
fn walk(space: &Toy, side: Side, path: &Path<usize>, vertices: usize) -> Option<(Subpath<usize>, f64)> {
    let n = path.len();
    let mut walk = Subpath::new(side);
    let mut probability = 1.0;
    for i in 0..vertices {
        let node = |i: usize| &path.nodes()[if side == Side::Light { i } else { n - 1 - i }];
        if i == 0 {
            let density = space.begin_density(side, &node(0).vertex);
            if density <= 0.0 {
                return None;
            }
            walk.restart(node(0).vertex, density);
            probability *= f64::from(density);
        } else {
            let (before, at) = (node(i - 1), node(i).vertex);
            if !walk.push(space, at, before.bounce) {
                return None;
            }
            let geometry = f64::from(space.geometry(&before.vertex, &at));
            probability *= f64::from(before.scattering.onward(side)) * geometry;
        }
    }
    Some((walk, probability))
}

/// The connection that makes a path with `s` vertices from the light, and the probability with which technique (s, t) makes that path,
/// the `δ` of specular vertices left out.
fn make(space: &Toy, path: &Path<usize>, s: usize, heuristic: Heuristic) -> Option<(Connection<usize>, f64)> {
    let n = path.len();
    let t = n - s;
    let bounces_at = |i: usize| path.nodes()[i].bounce.is_specular();
    if s > 0 && (bounces_at(s - 1) || bounces_at(s)) || s == 0 && !space.can_be_hit(&path.nodes()[0].vertex) {
        return None;
    }
    let (eye, from_eye) = walk(space, Side::Eye, path, t)?;
    let draws_light = s == 1 && t > 1;
    let (light, from_light) = if draws_light {
        let (x1, x0) = (path.nodes()[1].vertex, path.nodes()[0].vertex);
        (Subpath::new(Side::Light), f64::from(space.direct_density(&x1, &x0)))
    } else {
        walk(space, Side::Light, path, s)?
    };
    let number =
        if draws_light { space.number_for_direct(path.nodes()[1].vertex, path.nodes()[0].vertex) } else { 0.0 };
    let found = connect(space, (&light, s), (&eye, t), heuristic, &mut Number(number), &mut Scratch::default())?;
    Some((found, from_light * from_eye))
}

/// For every path and technique: `f` over the probability is what the connection gives. The techniques' weights sum to one.
#[test]
fn techniques_give_every_path_its_contribution() {
    for seed in 1..=3 {
        let space = Toy::new(seed);
        let paths = Paths::new(&space, MOST);
        let mut made = 0;
        for path in &paths.paths {
            for heuristic in HEURISTICS {
                let mut weights = 0.0;
                for s in 0..path.len() {
                    let Some((found, probability)) = make(&space, path, s, heuristic) else { continue };
                    let (value, expected) = (f64::from(found.value[0]) * probability, contribution(path));
                    assert!(
                        (value - expected).abs() < 1e-5 * expected,
                        "{path:?} by {s} from the light: {value} is not {expected}"
                    );
                    weights += f64::from(found.weight);
                    made += 1;
                }
                assert!((weights - 1.0).abs() < 1e-5, "{path:?}: {heuristic:?} weights sum to {weights}");
            }
        }
        assert!(made > 5 * 2 * paths.len());
    }
}

/// Both walks of a sample, all connections of which are handed out with the number of vertices from the light and the path.
fn sample(space: &Toy, random: &mut Random, mut found: impl FnMut(usize, &Connection<usize>, &Path<usize>)) {
    let (mut light, mut eye) = (Subpath::new(Side::Light), Subpath::new(Side::Eye));
    let (mut scratch, mut path) = (Scratch::default(), Path::default());
    light.begin(space, random);
    while !light.is_empty() && light.len() < SAMPLED - 1 {
        if light.len() >= ROULETTE_FROM && !light.survives(random.next_1d()) {
            break;
        }
        let Some((previous, at)) = light.end() else { break };
        let Some(next) = space.extend(Side::Light, previous, at, false, random) else { break };
        if !light.push(space, next.vertex, next.bounce) {
            break;
        }
    }
    let mut connect_all = |eye: &Subpath<usize>, numbers: std::ops::RangeInclusive<usize>, random: &mut Random| {
        let t = eye.len();
        for s in numbers.filter(|&s| (2..=SAMPLED).contains(&(s + t))) {
            if s > light.len() && (s > 1 || t == 1) {
                continue;
            }
            let ends = ((&light, s), (eye, t));
            if let Some(connection) = connect(space, ends.0, ends.1, Heuristic::default(), random, &mut scratch) {
                path.join(ends.0, ends.1, connection.light.as_ref());
                path.evaluate(space, 0..path.len());
                found(s, &connection, &path);
            }
        }
    };
    if !eye.begin(space, random) {
        return;
    }
    connect_all(&eye, 1..=SAMPLED, random);
    while eye.len() < SAMPLED {
        if eye.len() >= ROULETTE_FROM && !eye.survives(random.next_1d()) {
            return;
        }
        let Some((previous, &at)) = eye.end() else { return };
        let Some(next) = space.extend(Side::Eye, previous, &at, true, random) else { return };
        let mut vertex = next.vertex;
        // Lights that walks pass are no part of the walk.
        while matches!(kind(vertex), Kind::Light) {
            if !eye.push(space, vertex, next.bounce) {
                return;
            }
            connect_all(&eye, 0..=0, random);
            eye.pop();
            match space.beyond(at, vertex) {
                Some(behind) => vertex = behind,
                None => return,
            }
        }
        if !eye.push(space, vertex, next.bounce) {
            return;
        }
        connect_all(&eye, 0..=SAMPLED, random);
    }
}

/// z-tests of significance 0.01, divided among techniques, the combination and seeds. Where a technique makes a path too rarely for its
/// values to have a normal mean, they do not count: such paths are left out of both sides.
#[test]
fn each_technique_alone_finds_what_it_can_and_all_together_everything() {
    let (seeds, samples) = (2, 400_000);
    for seed in 1..=seeds {
        let space = Toy::new(seed);
        let paths = Paths::new(&space, SAMPLED);
        // What techniques alone and all of them weighted are to find, by vertices from the light and from the eye.
        let mut expected = [[0.0; SAMPLED + 1]; SAMPLED + 1];
        let mut all_expected = 0.0;
        let mut is_frequent = vec![[false; SAMPLED + 1]; paths.len()];
        for (i, (path, contribution)) in paths.paths.iter().zip(&paths.contributions).enumerate() {
            for s in 0..path.len() {
                let Some((found, probability)) = make(&space, path, s, Heuristic::default()) else { continue };
                if probability * deltas(&space, path, 0..=path.len()) > 30.0 / samples as f64 {
                    is_frequent[i][s] = true;
                    expected[s][path.len() - s] += contribution;
                    all_expected += contribution * f64::from(found.weight);
                }
            }
        }
        assert!(all_expected > 0.7 * paths.total(), "{all_expected} of {}", paths.total());
        let mut alone = vec![Running::default(); (SAMPLED + 1) * (SAMPLED + 1)];
        let mut together = Running::default();
        for i in 0..samples {
            let mut values = [[0.0; SAMPLED + 1]; SAMPLED + 1];
            let mut weighted = 0.0;
            sample(&space, &mut Random::new(4, seed, i), |s, connection, path| {
                let number = paths.find(path).expect("every path that is found is one of them");
                if is_frequent[number][s] {
                    let value = f64::from(connection.value[0]);
                    values[s][path.len() - s] += value;
                    weighted += value * f64::from(connection.weight);
                }
            });
            values.as_flattened().iter().zip(&mut alone).for_each(|(&value, running)| running.push(value));
            together.push(weighted);
        }
        let expected = expected.as_flattened();
        let tests = expected.iter().filter(|&&sum| sum > 0.0).count() + 1;
        assert_eq!(tests, 9 + 1);
        let significance = sidak(0.01, tests * seeds as usize);
        for (i, (running, expected)) in alone.iter().zip(expected).chain([(&together, &all_expected)]).enumerate() {
            let p = mean_z_test(running.mean(), running.standard_error().powi(2), *expected, 0.0);
            let (s, t) = (i / (SAMPLED + 1), i % (SAMPLED + 1));
            assert!(p > significance, "s = {s}, t = {t}: p = {p}, {} is not {expected}", running.mean());
        }
    }
}
