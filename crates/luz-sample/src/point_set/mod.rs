//! Point sets: finitely many points that fill a cube evenly, or follow a normal distribution.
//!
//! A [`PointSet`] is randomised by a seed such that the expected number of points in any region is a known
//! [count](Points::expected_count) times the region's probability. So a sum over the points with the weight
//! `1 / (count · density)` is an unbiased estimate of an integral; strategies differ in its variance.
//!
//! ```
//! use luz_sample::point_set::{PointSet, Request, Vogel};
//!
//! let request = Request { dimensions: 2, count: 64, seed: 1, member: 0, members: 1 };
//! let normal = Vogel.normal(&request, [3.0, 3.0, 0.0]);
//! let variance = normal.points.iter().map(|p| p[0] * p[0]).sum::<f64>() / 64.0;
//! assert!((variance - 1.0).abs() < 0.1);
//! ```

mod cells;
mod poisson_disk;
mod random;
mod sobol;
mod vogel;

pub use cells::{Grid, Stratified};
pub use poisson_disk::PoissonDisk;
pub use random::Random;
pub use sobol::Sobol;
pub use vogel::Vogel;

use crate::test_support::normal_survival;
use crate::warp::normal_quantile;

/// Which points are wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    /// Two or three. Of points in the plane, the third coordinate is zero.
    pub dimensions: usize,
    /// About how many points.
    pub count: usize,
    /// Chooses the random numbers.
    pub seed: u64,
    /// Which of several sets that are to be different; those of some strategies complement each other.
    pub member: u32,
    /// How many such sets there are.
    pub members: u32,
}

impl Request {
    /// A random number in `[0, 1)` of this set.
    fn random(&self, index: u64, dimension: u32) -> f64 {
        crate::random::unit_f64(crate::random::hash(self.seed, u64::from(self.member), index, dimension))
    }

    /// A random number in `[0, 1)` that all members share.
    fn common_random(&self, dimension: u32) -> f64 {
        crate::random::unit_f64(crate::random::hash(self.seed, u64::MAX, 0, dimension))
    }
}

/// A point set.
#[derive(Clone, Debug, PartialEq)]
pub struct Points {
    /// The points, in no particular order.
    pub points: Vec<[f64; 3]>,
    /// How many points are expected, over all seeds.
    pub expected_count: f64,
}

/// A way to spread points.
pub trait PointSet: Sync {
    /// Points in `[0, 1)ᵈ`.
    fn uniform(&self, request: &Request) -> Points;

    /// Points of the standard normal distribution, restricted to coordinates of an absolute value up to `limits`, which are
    /// positive.
    fn normal(&self, request: &Request, limits: [f64; 3]) -> Points {
        let mut set = self.uniform(request);
        let normals = limits.map(TruncatedNormal::new);
        for point in &mut set.points {
            for (v, normal) in point.iter_mut().zip(&normals).take(request.dimensions) {
                *v = normal.quantile(*v);
            }
        }
        set
    }
}

/// A standard normal number that is restricted to `[−limit, limit]`.
#[derive(Clone, Copy, Debug)]
pub struct TruncatedNormal {
    limit: f64,
    /// The probability below `−limit` of the unrestricted number.
    tail: f64,
}

impl TruncatedNormal {
    /// With a positive limit.
    pub fn new(limit: f64) -> Self {
        Self { limit, tail: normal_survival(limit) }
    }

    /// The value below which the number lies with the probability `u`.
    pub fn quantile(&self, u: f64) -> f64 {
        normal_quantile(self.tail + u * (1.0 - 2.0 * self.tail)).clamp(-self.limit, self.limit)
    }
}

/// The probability that a standard normal number lies between `a` and `b`, `a ≤ b`.
pub fn normal_probability(a: f64, b: f64) -> f64 {
    // On the side where nothing is lost by subtraction.
    if a + b > 0.0 { normal_survival(a) - normal_survival(b) } else { normal_survival(-b) - normal_survival(-a) }
}

/// The part of the unrestricted normal distribution that lies within the limits.
fn mass_within(dimensions: usize, limits: [f64; 3]) -> f64 {
    limits[..dimensions].iter().map(|&l| normal_probability(-l, l)).product()
}

fn is_within(point: &[f64; 3], dimensions: usize, limits: [f64; 3]) -> bool {
    point.iter().zip(limits).take(dimensions).all(|(v, l)| v.abs() <= l)
}

#[cfg(test)]
mod tests;
