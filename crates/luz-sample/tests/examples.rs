//! The tests of the examples, each in its file.

#[path = "../examples/asian_option.rs"]
#[allow(dead_code)]
mod asian_option;
#[path = "../examples/ising.rs"]
#[allow(dead_code)]
mod ising;
#[path = "../examples/lennard_jones.rs"]
#[allow(dead_code)]
mod lennard_jones;
#[path = "../examples/posterior.rs"]
#[allow(dead_code)]
mod posterior;
#[path = "../examples/stratification.rs"]
#[allow(dead_code)]
mod stratification;
#[path = "../examples/ten_dimensions.rs"]
#[allow(dead_code)]
mod ten_dimensions;
