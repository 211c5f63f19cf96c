//! What is inside a world, in numbers.

use serde::Serialize;
use std::collections::BTreeMap;

/// How often something occurs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ShapeCount {
    /// Shapes of a kind.
    pub shapes: u64,
    /// Their primitives: triangles, patches, or the shapes themselves.
    pub primitives: u64,
}

/// What is inside a world.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct WorldStatistics {
    /// Shapes by kind.
    pub shapes: BTreeMap<String, ShapeCount>,
    /// Object instances.
    pub instances: u64,
    /// Materials by kind.
    pub materials: BTreeMap<String, u64>,
    /// Textures by kind.
    pub textures: BTreeMap<String, u64>,
    /// Lights by kind; every primitive of an area light is one.
    pub lights: BTreeMap<String, u64>,
    /// Primitives that cannot be hit: without area, or with vertices that are not finite.
    pub degenerate_primitives: u64,
    /// Bytes of the bounding volume hierarchies.
    pub hierarchy_bytes: u64,
    /// Bytes of texture images.
    pub texture_bytes: u64,
    /// Seconds that the hierarchy took to build.
    pub build_seconds: f64,
}
