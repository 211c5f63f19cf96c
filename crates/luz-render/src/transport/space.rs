//! What a space of paths has to offer.

use luz_color::SampledSpectrum;
use luz_sample::Samples;
use serde::{Deserialize, Serialize};

/// An end of paths.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Side {
    /// Where they begin, `x₀`.
    Light,
    /// Where they end, `x_k`.
    Eye,
}

impl Side {
    /// The other end.
    pub const fn opposite(self) -> Self {
        match self {
            Self::Light => Self::Eye,
            Self::Eye => Self::Light,
        }
    }
}

/// Which way specular scattering goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum SpecularKind {
    /// On the same side of the surface.
    Reflection,
    /// On the other side.
    Transmission,
}

/// How a path scatters at a vertex. It belongs to the path, not to the place: some surfaces scatter either way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Bounce {
    /// Into a solid angle, so that the vertex can be connected to others. The ends of paths count among these.
    Spread,
    /// Into one direction.
    Specular(SpecularKind),
}

impl Bounce {
    /// Is the direction a certain one?
    #[inline]
    pub const fn is_specular(self) -> bool {
        matches!(self, Self::Specular(_))
    }
}

/// The factors of a vertex between its two neighbours, or of an end beside its only one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scattering {
    /// The vertex's factor in a path's contribution: `f̄`, `Le` or `W`; of a specular vertex the coefficient of its `δ`.
    pub value: SampledSpectrum,
    /// The density `p⊥` with which a walk from the eye goes on from here towards the light; of a specular vertex the
    /// probability of this kind of scattering, times [`compression`](Self::compression).
    pub toward_light: f32,
    /// The density `p⊥` with which a walk from the light goes on from here towards the eye; of a specular vertex the
    /// probability of this kind of scattering.
    pub toward_eye: f32,
    /// `(n on the light's side / n on the eye's side)²` of a specular vertex; 1 of any other. It is the density towards the light of
    /// a walk that has no choice of the kind, the one towards the eye being 1.
    pub compression: f32,
}

impl Scattering {
    /// Nothing.
    pub const NONE: Self = Self { value: SampledSpectrum::ZERO, toward_light: 0.0, toward_eye: 0.0, compression: 1.0 };

    /// The density with which a walk from `side` goes on.
    #[inline]
    pub fn onward(&self, side: Side) -> f32 {
        match side {
            Side::Light => self.toward_eye,
            Side::Eye => self.toward_light,
        }
    }

    /// The density with which a walk from `side`, that must take this specular kind, goes on.
    #[inline]
    pub fn compelled(&self, side: Side) -> f32 {
        match side {
            Side::Light => 1.0,
            Side::Eye => self.compression,
        }
    }
}

/// A walk's next vertex.
#[derive(Clone, Debug)]
pub struct Extension<V> {
    /// The vertex.
    pub vertex: V,
    /// How the one before scattered to get there.
    pub bounce: Bounce,
}

/// A space of paths under fixed conditions (wavelengths, a moment).
///
/// Factors and densities are functions of the vertices alone: the same numbers come out whichever way, and how often, they are
/// asked for. Where a method takes neighbours, `light_side` is the one towards the light, `eye_side` the one towards the eye;
/// `None` stands for the end of the path.
pub trait PathSpace {
    /// A vertex, wherever in the path it may stand.
    type Vertex: Clone;

    /// Draws the first vertex of a walk. Draws at most four dimensions.
    fn begin(&self, side: Side, samples: &mut impl Samples) -> Option<Self::Vertex>;

    /// The density of [`begin`](Self::begin) at a vertex, which for `Side::Light` may be any that emits; zero where it cannot be drawn.
    fn begin_density(&self, side: Side, vertex: &Self::Vertex) -> f32;

    /// Draws the vertex after `at` of a walk from `side` that has come from `previous`. Draws at most four dimensions, the last of
    /// which is left to the caller. `as_end`: the walk, from the eye, wants `x₀` now; without, what does nothing but emit is passed.
    fn extend(
        &self,
        side: Side,
        previous: Option<&Self::Vertex>,
        at: &Self::Vertex,
        as_end: bool,
        samples: &mut impl Samples,
    ) -> Option<Extension<Self::Vertex>>;

    /// Draws an `x₀` as seen from `x₁`, for next-event estimation, with its density. Draws two dimensions.
    fn direct(&self, from: &Self::Vertex, samples: &mut impl Samples) -> Option<(Self::Vertex, f32)>;

    /// The density of [`direct`](Self::direct).
    fn direct_density(&self, from: &Self::Vertex, light: &Self::Vertex) -> f32;

    /// The vertex as an `x₀`, if it can be one.
    fn as_light(&self, vertex: &Self::Vertex) -> Option<Self::Vertex>;

    /// Can a walk from the other end come upon this end? (It cannot come upon a pinhole, or a point light.)
    fn can_be_hit(&self, end: &Self::Vertex) -> bool;

    /// Of the ends that a walk would come upon one behind the other, going on from `at`, the first of which is `found`, the one that
    /// `u ∈ [0, 1)` chooses. (There are several environments, or a light that walks pass stands before another.)
    fn choose_end(&self, at: &Self::Vertex, found: Self::Vertex, u: f32) -> Self::Vertex;

    /// The probability with which [`choose_end`](Self::choose_end) chooses this end of a walk that goes towards it from `at`; zero if it
    /// cannot be hit.
    fn end_probability(&self, at: &Self::Vertex, end: &Self::Vertex) -> f32;

    /// Can the vertex be connected to others: does it scatter into solid angles at all?
    fn is_connectable(&self, vertex: &Self::Vertex) -> bool;

    /// `G`, without visibility; zero where no light can go.
    fn geometry(&self, a: &Self::Vertex, b: &Self::Vertex) -> f32;

    /// Is nothing between the two?
    fn is_visible(&self, a: &Self::Vertex, b: &Self::Vertex) -> bool;

    /// The factors of a vertex.
    fn scattering(
        &self,
        light_side: Option<&Self::Vertex>,
        at: &Self::Vertex,
        eye_side: Option<&Self::Vertex>,
        bounce: Bounce,
    ) -> Scattering;
}

/// The factors of `at`, which a walk from `side` has reached from `previous` and left for `next`.
#[inline]
pub fn scattering_along<P: PathSpace + ?Sized>(
    space: &P,
    side: Side,
    previous: Option<&P::Vertex>,
    at: &P::Vertex,
    next: Option<&P::Vertex>,
    bounce: Bounce,
) -> Scattering {
    match side {
        Side::Light => space.scattering(previous, at, next, bounce),
        Side::Eye => space.scattering(next, at, previous, bounce),
    }
}
