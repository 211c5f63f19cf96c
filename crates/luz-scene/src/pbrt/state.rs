//! The graphics state: what directives set and shapes, lights and materials take along.

use super::transforms::Transforms;
use crate::parameter::Parameter;
use crate::spectrum::ColorSpace;
use std::sync::Arc;

/// An index of something defined, or, from [`PENDING`] on, of something that was named before it was defined.
pub(super) type Reference = usize;

/// The first reference that stands for a name; see [`PendingNames`].
pub(super) const PENDING: Reference = 1 << 62;

/// The targets of `Attribute`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AttributeTarget {
    Shape,
    Light,
    Material,
    Medium,
    Texture,
}

impl AttributeTarget {
    pub const NAMES: [&'static str; 5] = ["shape", "light", "material", "medium", "texture"];

    pub fn named(name: &str) -> Option<Self> {
        use AttributeTarget::*;
        let all = [Shape, Light, Material, Medium, Texture];
        Self::NAMES.iter().position(|n| *n == name).map(|index| all[index])
    }
}

/// See the module.
#[derive(Clone)]
pub(super) struct GraphicsState {
    pub transforms: Transforms,
    pub color_space: ColorSpace,
    pub reverse_orientation: bool,
    pub material: Reference,
    pub area_light: Option<usize>,
    pub inside_medium: Option<Reference>,
    pub outside_medium: Option<Reference>,
    /// By [`AttributeTarget`].
    pub attributes: [Arc<Vec<Arc<Parameter>>>; 5],
}

impl GraphicsState {
    pub fn new() -> Self {
        Self {
            transforms: Transforms::IDENTITY,
            color_space: ColorSpace::Srgb,
            reverse_orientation: false,
            material: 0,
            area_light: None,
            inside_medium: None,
            outside_medium: None,
            attributes: Default::default(),
        }
    }

    pub fn attributes(&self, target: AttributeTarget) -> Arc<Vec<Arc<Parameter>>> {
        self.attributes[target as usize].clone()
    }
}
