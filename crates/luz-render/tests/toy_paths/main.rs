//! Paths, connections and mutations proved in a small space, all paths of which can be counted.
//!
//! * `toy`: the space; `paths`: its paths, and what they contribute; `mutations`: all mutations as one type, and their faults.
//! * `connections`: every technique of bidirectional path tracing gives every path its contribution.
//! * `proposals`: the density `T(x→y)` that each mutation states is that of the proposals that it makes.
//! * `balance`: each move has its way back; all mutations together lead everywhere, and chains settle at what paths contribute.
//! * `stationarity`: chains as they are run stay distributed as paths contribute, move by move.
//! * `faults`: these tests fail with mutations that are wrong.
//!
//! Statistical tests have a significance of 0.01 each, divided among their parts (Šidák), and fixed seeds.

mod balance;
mod connections;
mod faults;
mod mutations;
mod paths;
mod proposals;
mod stationarity;
mod toy;
