//! Chains that start from paths drawn by their contribution, and go on as chains of a rendering do, stay so distributed.

use crate::mutations::{Faulty, all};
use crate::paths::{Paths, contribution};
use crate::toy::Toy;
use luz_render::transport::Path;
use luz_sample::markov::{Chain, Log};
use luz_sample::random::Random;
use luz_sample::test_support::{chi2, reversibility, sidak};

/// Vertices of the longest paths.
const MOST: usize = 5;
/// The states that moves are counted between: single paths, of those with the largest contributions, and all others by their numbers.
const SINGLE: usize = 40;
const CELLS: usize = 60;

/// Draws a number in proportion to shares, given their running sums.
fn draw(sums: &[f64], u: f64) -> usize {
    let total = sums.last().copied().unwrap_or(0.0);
    sums.partition_point(|&sum| sum <= u * total).min(sums.len() - 1)
}

/// The p-values of where chains are after 1 to 8 steps of some mutations, one as likely as the other, and of detailed balance of their
/// first step. With one mutation alone, chains are on paths that it is for.
pub fn chains(space: &Toy, paths: &Paths, mutations: &[Faulty], chains: u64) -> [f64; 2] {
    let share = |i: usize| {
        let is_moved = mutations.iter().any(|mutation| mutation.kind.applies(space, &paths.paths[i]));
        if is_moved { paths.contributions[i] } else { 0.0 }
    };
    let shares: Vec<f64> = (0..paths.len()).map(share).collect();
    let mut sums = shares.clone();
    (1..sums.len()).for_each(|i| sums[i] += sums[i - 1]);
    let mut order: Vec<usize> = (0..paths.len()).collect();
    order.sort_by(|&a, &b| shares[b].total_cmp(&shares[a]));
    let mut cells = vec![0; paths.len()];
    for (rank, &i) in order.iter().enumerate() {
        cells[i] = if rank < SINGLE { rank } else { SINGLE + i % (CELLS - SINGLE) };
    }
    let (mut counts, mut moves) = (vec![0; paths.len() + 1], vec![0; CELLS * CELLS]);
    let mut spare = Path::default();
    for number in 0..chains {
        let begin = draw(&sums, Random::new(2, 0, number).next_f64());
        let x = paths.paths[begin].clone();
        let density = Log(contribution(&x).ln());
        let mut chain = Chain::new(3, number, x, density);
        for i in 0..=number % 8 {
            chain.step(&mut spare, |x, y, random| {
                let choice = (random.next_f64() * mutations.len() as f64) as usize;
                mutations[choice.min(mutations.len() - 1)].propose(space, x, y, random)
            });
            // What is no path of the space has a count of its own.
            let here = paths.find(chain.state());
            if i == 0
                && let Some(here) = here
            {
                moves[cells[begin] * CELLS + cells[here]] += 1;
            }
            if i == number % 8 {
                counts[here.unwrap_or(paths.len())] += 1;
            }
        }
    }
    let total: f64 = shares.iter().sum();
    let expected: Vec<f64> = shares.iter().map(|share| share / total * chains as f64).chain([0.0]).collect();
    [chi2(&counts, &expected).p_value, reversibility(&moves, CELLS).p_value]
}

/// Significance 0.01 for all, divided among mutations and seeds.
#[test]
fn chains_stay_distributed_as_paths_contribute() {
    for seed in 1..=2 {
        let space = Toy::new(seed);
        let paths = Paths::new(&space, MOST);
        let mutations = all(MOST).map(|kind| Faulty::sound(&space, kind));
        let significance = sidak(0.01, 2 * 2 * 7);
        for mutation in &mutations {
            let p = chains(&space, &paths, std::slice::from_ref(mutation), 100_000);
            assert!(p.iter().all(|&p| p > significance), "{:?}: {p:?}", mutation.kind);
        }
        let p = chains(&space, &paths, &mutations, 200_000);
        assert!(p.iter().all(|&p| p > significance), "all: {p:?}");
    }
}
