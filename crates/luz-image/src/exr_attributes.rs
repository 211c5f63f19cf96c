//! What an OpenEXR file says beside its pixels and their colours.

use std::collections::BTreeMap;
use std::fmt;

use ::exr::meta::header::{ImageAttributes, LayerAttributes};

use crate::SampleType;

/// The attributes of an OpenEXR file (exposure, camera, time code and so on, with those of unknown names), and how it stores
/// each channel: for writing them again.
#[derive(Clone, PartialEq)]
pub struct ExrAttributes {
    pub(crate) image: Box<ImageAttributes>,
    pub(crate) layer: Box<LayerAttributes>,
    /// By the channel's name.
    pub(crate) types: BTreeMap<String, SampleType>,
}

impl ExrAttributes {
    /// How the file that the image came from stored a channel.
    pub fn sample_type(&self, channel: &str) -> Option<SampleType> {
        self.types.get(channel).copied()
    }

    /// The names of the attributes beyond those that the format defines, in alphabetical order.
    pub fn custom_names(&self) -> Vec<String> {
        let mut names: Vec<String> =
            self.image.other.keys().chain(self.layer.other.keys()).map(ToString::to_string).collect();
        names.sort();
        names
    }
}

impl fmt::Debug for ExrAttributes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ExrAttributes").field("custom", &self.custom_names()).field("types", &self.types).finish()
    }
}
