//! The threads that everything runs on.

use super::exit::Exit;
use super::problems;
use std::num::NonZeroU32;

/// Starts so many threads; as many as the machine has, if nothing is said.
pub fn start(threads: Option<NonZeroU32>) -> Result<(), Exit> {
    let threads = threads.map_or(0, |n| n.get() as usize);
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().map_err(|error| {
        problems::error(&format!("cannot start {threads} threads: {error}"));
        Exit::Usage
    })
}
