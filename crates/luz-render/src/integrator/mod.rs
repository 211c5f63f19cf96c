//! Integrators: from a camera ray to the radiance that arrives along it.

pub mod efficiency;
mod observer;
mod path;
mod technique;

pub use observer::{FoundBy, LightEvent, PathEnd, PathEvent, PathObserver, Unwatched, Vertex};
pub use path::{BOUNCE_DIMENSIONS, CAMERA_DIMENSIONS, PathCost, PathIntegrator, PathTracer};
pub use technique::Technique;
