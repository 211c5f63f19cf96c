//! Integrators: from a camera ray to the radiance that arrives along it.

mod bidirectional;
pub mod efficiency;
mod estimator;
mod kind;
pub mod metropolis;
mod observer;
mod path;
mod technique;
pub(crate) mod walks;

pub use bidirectional::BidirectionalTracer;
pub use estimator::{CameraStart, PixelEstimator, Splat, Splats};
pub use kind::{BidirectionalIntegrator, BidirectionalTechniques, Integrator, IntegratorKind};
pub use observer::{FoundBy, LightEvent, PathEnd, PathEvent, PathObserver, Unwatched, Vertex};
pub use path::{BOUNCE_DIMENSIONS, CAMERA_DIMENSIONS, PathCost, PathIntegrator, PathTracer};
pub use technique::Technique;
