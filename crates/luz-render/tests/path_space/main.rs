//! Paths, connections and mutations proved in a small space, all paths of which can be counted.

mod balance;
mod connections;
mod faults;
mod mutations;
mod paths;
mod proposals;
mod stationarity;
mod toy;
