//! Spectral Monte Carlo light transport.
//!
//! A [`luz_scene::Description`] becomes a [`world::World`] ([`world::build`]), which a [`Renderer`] turns into a
//! [`film::Film`], pass by pass.

pub mod bsdf;
pub mod camera;
mod chance;
pub mod film;
pub mod integrator;
pub mod light;
pub mod material;
mod render;
mod settings;
mod sphere_map;
pub mod texture;
pub mod transport;
pub mod world;

pub use render::{
    ChainReport, Failure, Incident, Incidents, PASS_TIME, Part, PartError, PartHeader, RenderCost, Renderer, Shard,
    adaptive,
};
pub use settings::{Crop, MetropolisOverrides, Overrides, Settings};
pub use sphere_map::SphereMap;
