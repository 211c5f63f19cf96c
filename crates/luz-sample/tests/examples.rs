//! The tests of the examples, each in its file.

#[path = "../examples/ising.rs"]
#[allow(dead_code)]
mod ising;
#[path = "../examples/lennard_jones.rs"]
#[allow(dead_code)]
mod lennard_jones;
#[path = "../examples/posterior.rs"]
#[allow(dead_code)]
mod posterior;
