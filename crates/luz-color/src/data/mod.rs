//! Measured tables: facts published by the CIE and collected by refractiveindex.info.

// Measured numbers may come close to mathematical constants.
#![allow(clippy::approx_constant)]

pub(crate) mod cie1931;
pub(crate) mod daylight;
pub(crate) mod glasses;
pub(crate) mod illuminants;
pub(crate) mod metals;
