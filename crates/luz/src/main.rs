//! The `luz` program.

fn main() {}
