//! Statistical and numerical tests of every BSDF.

mod adjoint;
mod coated;
mod degenerate;
mod density;
mod energy;
mod proposal;
mod reciprocity;
mod specimens;
