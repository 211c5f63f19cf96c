//! Statistical and numerical tests of every BSDF.

mod coated;
mod degenerate;
mod density;
mod energy;
mod reciprocity;
mod specimens;
