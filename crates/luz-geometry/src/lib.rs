//! Vectors, transforms, shapes and a fast watertight BVH.

mod frame;

pub use frame::Frame;
