//! Scenes as plain data, and readers for them.
//!
//! [`read`] turns a pbrt-v4 scene file into a [`Description`]: everything the file says, with transforms multiplied
//! out and names looked up, but not interpreted: what a `"sphere"` or a `"conductor"` is, is not known here. Every
//! parameter knows its place in the text ([`Span`]), so that whoever does interpret it can point there.
//!
//! Readers never panic, and report all problems at once ([`SceneErrors`]).

pub mod description;
pub mod diagnostic;
pub mod file;
mod files;
pub mod mesh;
pub mod parameter;
pub mod parameters;
pub mod pbrt;
pub mod ply;
pub mod schema;
pub mod source;
pub mod spd;
pub mod spectrum;

pub use description::{
    CameraEntity, Description, Entity, Instance, LightEntity, MaterialEntity, MediumEntity, ObjectDefinition,
    RenderOptions, ShapeEntity, Spanned, TextureEntity, TextureType, TransformSet,
};
pub use diagnostic::{Diagnostic, Diagnostics, SceneErrors, Severity};
pub use mesh::MeshData;
pub use parameter::{Parameter, ParameterType, Values};
pub use parameters::{FloatOrTexture, ParameterList, SpectrumOrTexture};
pub use pbrt::{Limits, ReadOptions, read, read_bytes, read_str, read_with};
pub use source::{FileId, Location, Locator, SourceMap, Span};
pub use spectrum::{ColorSpace, SpectrumParameter};
