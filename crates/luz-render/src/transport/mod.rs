//! Light paths: what bidirectional and Metropolis transport are made of.
//!
//! A path is a sequence of vertices `x₀ x₁ … x_k`, `x₀` on a light, `x_k` on the camera (Veach 1997, chapter 8). Its
//! contribution to a measurement is a product over its vertices and edges,
//!
//! ```text
//! (1)   f(x) = Le(x₀→x₁) G(x₀,x₁) f̄(x₀→x₁→x₂) G(x₁,x₂) … f̄(x_{k−2}→x_{k−1}→x_k) G(x_{k−1},x_k) W(x_{k−1}→x_k),
//! ```
//!
//! and so is the density with which any technique makes it: `s` vertices by a walk from the light, `t = k + 1 − s` by a walk
//! from the eye. This module has the vertices and the factors ([`PathSpace`]), walks ([`Subpath`]), connections and the
//! densities of all techniques ([`connection`], [`technique`]), and whole paths ([`Path`]). It is written once for bidirectional path
//! tracing and for every mutation of Metropolis light transport, and for any space of paths: a [`scene`], or a small
//! enumerable one, by which what is built on it can be proved.
//!
//! # Measures
//!
//! Densities of directions are in *projected* solid angle, so that one rule gives the density of the next vertex in its own
//! measure: `p(b) = p⊥(a→b) · G(a, b)`. Of what stands at an end of an edge this asks:
//!
//! * a point of a surface has the cosine of its geometric normal;
//! * a bare point (a point light, a lens) has a cosine of one, its densities and radiant intensities are in solid angle;
//! * what is infinitely far away (an environment, a distant light, an orthographic camera) is a direction. `G` is the cosine
//!   at the other end. Its own measure is solid angle, and its density of going on is one over areas perpendicular to it.
//!
//! The BSDF's value is always taken in one orientation, radiance towards the eye, times `|ωᵢ·n_s| / |ωᵢ·n_g|` (Veach's
//! eq. 5.20), which makes (1) the path tracer's integrand, shading normals and refraction included, whichever way a path was
//! found. A specular vertex's `δ` is taken in the measure `n² dσ⊥`, which refraction leaves as it is; it is a factor of every
//! density that can make the path and of (1), and is left out of all.

pub mod connection;
pub mod path;
pub mod perturbation;
pub mod scene;
mod scene_perturbation;
mod scene_vertex;
pub mod space;
pub mod subpath;
pub mod technique;

pub use connection::{Connection, connect};
pub use path::{Contribution, Node, Path};
pub use perturbation::{PerturbationSpace, Range};
pub use scene::SceneSpace;
pub use scene_vertex::{SceneVertex, SurfaceVertex};
pub use space::{Bounce, Extension, PathSpace, Scattering, Side, SpecularKind};
pub use subpath::Subpath;
