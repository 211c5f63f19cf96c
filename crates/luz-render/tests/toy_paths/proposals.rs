//! The density that each mutation takes its proposals to have against a histogram of the proposals that it makes.

use crate::mutations::{Faulty, Kind, all, moves};
use crate::paths::{Paths, contribution};
use crate::toy::Toy;
use luz_render::integrator::metropolis::path_space::{Attempt, Kept};
use luz_render::transport::Path;
use luz_sample::random::Random;
use luz_sample::test_support::{chi2, sidak};
use std::collections::HashMap;

/// Vertices of the longest paths.
const MOST: usize = 5;

/// The p-value of the proposals made from a path. Those that fail, or that carry no light, are one cell of the histogram.
fn histogram(space: &Toy, paths: &Paths, mutation: &Faulty, x: &Path<usize>, proposals: u64) -> f64 {
    let expected_moves = moves(paths, mutation, x);
    let cells: HashMap<(usize, Kept), usize> =
        expected_moves.iter().enumerate().map(|(i, &(y, kept, _))| ((y, kept), i)).collect();
    let mut expected: Vec<f64> = expected_moves.iter().map(|&(_, _, p)| p * proposals as f64).collect();
    let failures = proposals as f64 - expected.iter().sum::<f64>();
    // Numbers in single precision.
    if failures < -1e-5 * proposals as f64 {
        return 0.0;
    }
    expected.push(failures.max(0.0));
    let mut observed = vec![0; expected.len()];
    let mut y = Path::default();
    for i in 0..proposals {
        let attempt = mutation.kind.propose(space, x, &mut y, &mut Random::new(1, 0, i));
        let cell = match attempt {
            Attempt::Inapplicable => return 0.0,
            Attempt::Proposed(kept) if contribution(&y) > 0.0 => {
                match paths.find(&y).and_then(|y| cells.get(&(y, kept))) {
                    Some(&cell) => cell,
                    None => return 0.0,
                }
            }
            Attempt::Proposed(_) | Attempt::Failed => expected.len() - 1,
        };
        observed[cell] += 1;
    }
    chi2(&observed, &expected).p_value
}

/// Some of the paths to which a mutation applies, evenly.
fn subjects<'a>(space: &Toy, paths: &'a Paths, kind: Kind, count: usize) -> Vec<&'a Path<usize>> {
    let all: Vec<_> = paths.paths.iter().filter(|path| kind.applies(space, path)).collect();
    let stride = all.len().div_ceil(count).max(1);
    all.into_iter().step_by(stride).collect()
}

/// Do the proposals made from some paths have the densities that the mutation takes them to have? The test, of significance 0.01, is
/// divided among the paths.
pub fn are_distributed_as_claimed(space: &Toy, paths: &Paths, mutation: &Faulty) -> bool {
    let subjects = subjects(space, paths, mutation.kind, 60);
    assert!(subjects.len() >= 30, "{:?} applies to {} paths", mutation.kind, subjects.len());
    let significance = sidak(0.01, subjects.len());
    subjects.iter().all(|x| histogram(space, paths, mutation, x, 30_000) > significance)
}

#[test]
fn proposals_have_the_densities_that_mutations_take_them_to_have() {
    let space = Toy::new(1);
    let paths = Paths::new(&space, MOST);
    for kind in all(MOST) {
        assert!(are_distributed_as_claimed(&space, &paths, &Faulty::sound(&space, kind)), "{kind:?}");
    }
}
