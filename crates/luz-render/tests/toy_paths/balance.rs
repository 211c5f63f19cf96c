//! What has to hold exactly for chains to visit all paths as often as they should: every move has its way back, the moves from a path
//! are no more likely than certain, and all mutations together lead from everywhere to everywhere.

use crate::mutations::{Faulty, Kind, all, moves};
use crate::paths::Paths;
use crate::toy::Toy;
use luz_render::integrator::metropolis::path_space::Kept;

/// Vertices of the longest paths.
const MOST: usize = 5;

/// All moves from all paths.
fn all_moves(paths: &Paths, mutation: &Faulty) -> Vec<Vec<(usize, Kept, f64)>> {
    paths.paths.iter().map(|x| moves(paths, mutation, x)).collect()
}

/// Rows of the chain's matrix: the probabilities of moves, acceptance included, one mutation as likely as the other.
fn matrix(space: &Toy, paths: &Paths, kinds: &[Kind]) -> Vec<Vec<(usize, f64)>> {
    let mut rows = vec![Vec::new(); paths.len()];
    for &kind in kinds {
        let mutation = Faulty::sound(space, kind);
        for (x, moves) in all_moves(paths, &mutation).into_iter().enumerate() {
            for (y, kept, there) in moves {
                let back = mutation.probability(&paths.paths[y], &paths.paths[x], kept);
                let ratio = paths.contributions[y] * back / (paths.contributions[x] * there);
                rows[x].push((y, there * ratio.min(1.0) / kinds.len() as f64));
            }
        }
    }
    rows
}

/// Which paths can be reached from the first, in steps that have a probability.
fn reached(matrix: &[Vec<(usize, f64)>]) -> usize {
    let mut is_reached = vec![false; matrix.len()];
    let mut open = vec![0];
    while let Some(x) = open.pop() {
        if !std::mem::replace(&mut is_reached[x], true) {
            open.extend(matrix[x].iter().filter(|(_, p)| *p > 0.0).map(|&(y, _)| y));
        }
    }
    is_reached.into_iter().filter(|&reached| reached).count()
}

/// How unequal moves there and back are between paths drawn by their contribution, in relation to all moves, if proposals have the
/// densities of a sound mutation, and are accepted by those of a faulty one.
pub fn imbalance(space: &Toy, paths: &Paths, faulty: &Faulty) -> f64 {
    let sound = Faulty::sound(space, faulty.kind);
    let (mut difference, mut sum) = (0.0, 0.0);
    for (x, moves) in all_moves(paths, &sound).into_iter().enumerate() {
        for (y, kept, there) in moves.into_iter().filter(|&(y, ..)| y > x) {
            let (from, to) = (&paths.paths[x], &paths.paths[y]);
            let back = sound.probability(to, from, kept);
            let ratio = paths.contributions[y] * faulty.probability(to, from, kept)
                / (paths.contributions[x] * faulty.probability(from, to, kept));
            // A proposal without a density is declined.
            let [there_accepted, back_accepted] =
                [ratio, 1.0 / ratio].map(|ratio| if ratio.is_finite() { ratio.min(1.0) } else { 0.0 });
            let flow = paths.contributions[x] * there * there_accepted;
            let flow_back = paths.contributions[y] * back * back_accepted;
            difference += (flow - flow_back).abs();
            sum += flow + flow_back;
        }
    }
    difference / sum
}

#[test]
fn every_move_has_its_way_back() {
    for seed in 1..=3 {
        let space = Toy::new(seed);
        let paths = Paths::new(&space, MOST);
        for kind in all(MOST) {
            let mutation = Faulty::sound(&space, kind);
            let mut count = 0;
            for (x, moves) in paths.paths.iter().zip(all_moves(&paths, &mutation)) {
                let total: f64 = moves.iter().map(|&(_, _, p)| p).sum();
                assert!(total <= 1.0 + 1e-5, "{kind:?}: {total}");
                for (y, kept, _) in moves {
                    count += 1;
                    let back = mutation.probability(&paths.paths[y], x, kept);
                    assert!(back > 0.0, "{kind:?}, {kept:?}: no way back\nto {x:?}\nfrom {:?}", paths.paths[y]);
                }
            }
            assert!(count > 50, "{kind:?}: {count} moves");
        }
    }
}

#[test]
fn all_mutations_together_lead_from_everywhere_to_everywhere() {
    for seed in 1..=3 {
        let space = Toy::new(seed);
        let paths = Paths::new(&space, MOST);
        let matrix = matrix(&space, &paths, &all(MOST));
        assert_eq!(reached(&matrix), paths.len());
    }
}

/// Two steps of a chain as one.
fn squared(matrix: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let row = |row: &Vec<f64>| {
        let mut sum = vec![0.0; row.len()];
        for (&probability, row) in row.iter().zip(matrix) {
            sum.iter_mut().zip(row).for_each(|(sum, p)| *sum += probability * p);
        }
        sum
    };
    matrix.iter().map(row).collect()
}

/// Paths of up to four vertices have all kinds of mutations, too.
#[test]
fn chains_forget_where_they_started_and_settle_at_what_paths_contribute() {
    for seed in 1..=2 {
        let space = Toy::new(seed);
        let paths = Paths::new(&space, 4);
        let mut dense = vec![vec![0.0; paths.len()]; paths.len()];
        for (x, row) in matrix(&space, &paths, &all(4)).into_iter().enumerate() {
            dense[x][x] = 1.0 - row.iter().map(|(_, p)| p).sum::<f64>();
            row.into_iter().for_each(|(y, probability)| dense[x][y] += probability);
        }
        for _ in 0..20 {
            dense = squared(&dense);
        }
        for row in &dense {
            for (share, contribution) in row.iter().zip(&paths.contributions) {
                let expected = contribution / paths.total();
                assert!((share - expected).abs() < 1e-6 * expected, "{share} is not {expected}");
            }
        }
    }
}
