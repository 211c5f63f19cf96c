//! What a space of paths has to offer for paths to be perturbed: moved a little.
//!
//! Lengths and angles are drawn as `r = r₂ exp(−ln(r₂ / r₁) u)` between the smallest `r₁` and the largest `r₂` (Veach 1997, eq. 11.8),
//! in a direction uniform around the old place: all scales are as likely. The density of the new place, per area of the plane,
//! is `1 / (2π r² ln(r₂ / r₁))`, and of a new direction, per solid angle, `1 / (2π θ sin θ ln(θ₂ / θ₁))`.

use super::path::Node;
use super::space::{PathSpace, Side, SpecularKind};
use luz_sample::Samples;
use std::f64::consts::TAU;

/// The smallest and the largest of the lengths or angles that a perturbation draws.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Positive.
    pub smallest: f64,
    /// Larger than the smallest.
    pub largest: f64,
}

/// How far beyond its ends a range is taken to reach, relatively: lengths are found again but for rounding.
const SLACK: f64 = 1e-2;

impl Range {
    /// A length for `u ∈ [0, 1)`.
    pub fn draw(&self, u: f32) -> f64 {
        self.largest * (-(self.largest / self.smallest).ln() * f64::from(u)).exp()
    }

    /// The density of a place at distance `r` on a plane.
    pub fn density_on_plane(&self, r: f64) -> f64 {
        self.density(r, r)
    }

    /// The density of a direction at an angle, per solid angle.
    pub fn density_of_turn(&self, angle: f64) -> f64 {
        self.density(angle, angle.sin())
    }

    /// `circumference` over 2π is what the circle at `r` measures.
    fn density(&self, r: f64, circumference: f64) -> f64 {
        if !(self.smallest * (1.0 - SLACK)..=self.largest * (1.0 + SLACK)).contains(&r) || circumference <= 0.0 {
            return 0.0;
        }
        1.0 / (TAU * r * circumference * (self.largest / self.smallest).ln())
    }

    /// All lengths times a factor; `None` if nothing sensible is left.
    pub fn scaled(&self, factor: f64) -> Option<Self> {
        let scaled = Self { smallest: self.smallest * factor, largest: self.largest * factor };
        (scaled.smallest > 0.0 && scaled.largest.is_finite() && scaled.largest > scaled.smallest).then_some(scaled)
    }
}

/// A space whose paths can be perturbed. Densities are `p⊥`, as those of walks.
pub trait PerturbationSpace: PathSpace {
    /// What is seen from the eye at a place on the film near the one at which `seen` is; lengths are pixels. `as_end` as in
    /// [`extend`](PathSpace::extend). Draws two dimensions.
    fn shift(
        &self,
        eye: &Self::Vertex,
        seen: &Self::Vertex,
        range: Range,
        as_end: bool,
        samples: &mut impl Samples,
    ) -> Option<Self::Vertex>;

    /// The density with which [`shift`](Self::shift) leads from one to the other.
    fn shift_density(&self, eye: &Self::Vertex, from: &Self::Vertex, to: &Self::Vertex, range: Range) -> f32;

    /// What is met from `at` in a direction near that in which `old.1` lies as seen from `old.0`, which may be another point on the
    /// way; angles are radians. From a light at infinity it is the ray that moves, by lengths of the scene. Draws two dimensions.
    fn turn(
        &self,
        at: &Self::Vertex,
        old: (&Self::Vertex, &Self::Vertex),
        range: Range,
        samples: &mut impl Samples,
    ) -> Option<Self::Vertex>;

    /// The density with which [`turn`](Self::turn) leads from one edge to another.
    fn turn_density(
        &self,
        old: (&Self::Vertex, &Self::Vertex),
        new: (&Self::Vertex, &Self::Vertex),
        range: Range,
    ) -> f32;

    /// What is met behind `at`, which a walk from `side` has reached from `previous`, by specular scattering of one kind.
    fn follow(
        &self,
        side: Side,
        previous: &Self::Vertex,
        at: &Self::Vertex,
        kind: SpecularKind,
        as_end: bool,
    ) -> Option<Self::Vertex>;

    /// The range of turns at the first of `nodes`, that end with `x_k`, which move its last vertex but one by about so many pixels.
    fn turns_by_pixels(&self, nodes: &[Node<Self::Vertex>], pixels: Range) -> Option<Range>;
}
