//! The tests of mutations find what is wrong with one: they fail with each of several faults.

use crate::balance::imbalance;
use crate::mutations::{Fault, Faulty, Kind, all};
use crate::paths::Paths;
use crate::proposals::are_distributed_as_claimed;
use crate::stationarity::chains;
use crate::toy::Toy;

/// Vertices of the longest paths.
const MOST: usize = 5;

/// The faults that a mutation can have, and whether chains betray them soon.
fn faults(kind: Kind) -> &'static [(Fault, bool)] {
    use Fault::*;
    match kind {
        Kind::Bidirectional(_) => &[
            (ForgetsHits, false),
            (ForgetsDirect, true),
            (ForgetsChoices, false),
            (ForgetsDeletion, true),
            (ForgetsGeometry, false),
        ],
        // Most of its proposals are declined.
        Kind::Renewal(_) => {
            &[(ForgetsHits, false), (ForgetsDirect, false), (ForgetsChoices, false), (ForgetsLens, false)]
        }
        Kind::LensSubpath(_) => &[(ForgetsLens, false), (ForgetsGeometry, true)],
        Kind::Lens(_) => &[(ForgetsKernels, true), (ForgetsCompulsion, false), (ForgetsGeometry, false)],
        Kind::MultiChain(_) => &[(ForgetsKernels, true), (ForgetsCompulsion, false), (ForgetsGeometry, true)],
        Kind::Caustic(_) => {
            &[(ForgetsKernels, true), (ForgetsRanges, true), (ForgetsCompulsion, false), (ForgetsGeometry, false)]
        }
    }
}

/// The tests of sound mutations are at significance 0.01 for all parts; chains reject these at 10⁻⁶.
#[test]
fn faults_are_found() {
    let space = Toy::new(1);
    let paths = Paths::new(&space, MOST);
    for kind in all(MOST) {
        for &(fault, is_soon_seen) in faults(kind) {
            let mutation = Faulty::new(&space, kind, fault);
            assert!(!are_distributed_as_claimed(&space, &paths, &mutation), "{kind:?} {fault:?}");
            let imbalance = imbalance(&space, &paths, &mutation);
            assert!(imbalance > 3e-3, "{kind:?} {fault:?}: {imbalance}");
            if is_soon_seen {
                let [p, _] = chains(&space, &paths, std::slice::from_ref(&mutation), 200_000);
                assert!(p < 1e-6, "{kind:?} {fault:?}: p = {p}");
            }
        }
    }
}
