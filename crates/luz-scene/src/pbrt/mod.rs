//! The reader of pbrt-v4 scene files.
//!
//! The format is that of pbrt-v4 (<https://pbrt.org/fileformat-v4>): directives with quoted names, numbers and parameter
//! lists, which act on a graphics state. [`read`] accepts what pbrt-v4 accepts, with these differences:
//!
//! * quoted booleans (`"true"`) and `"none"` materials are accepted with a warning;
//! * named coordinate systems are known inside `Import`ed files, too (pbrt-v4 forgets them there);
//! * all problems are reported, not only the first.

mod attributes;
mod builder;
mod directives;
mod include;
pub(crate) mod legacy;
mod lexer;
mod number;
mod objects;
mod parser;
mod resolve;
mod state;
mod transforms;
mod values;

use crate::description::Description;
use crate::diagnostic::{Diagnostics, SceneErrors};
use std::path::Path;

/// Bounds on what a scene may make the reader do. The defaults are far beyond real scenes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// The biggest file, in bytes, after decompression.
    pub file_bytes: u64,
    /// All scene files together, in bytes, each as often as it's included.
    pub total_bytes: u64,
    /// How many files, each as often as it's included.
    pub files: usize,
    /// How deep `Include`s and `Import`s nest.
    pub include_depth: usize,
    /// How deep `AttributeBegin` nests.
    pub attribute_depth: usize,
    /// How many `Attribute` parameters can be in force at once for each kind of target.
    pub attribute_parameters: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            file_bytes: 16 << 30,
            total_bytes: 64 << 30,
            files: 100_000,
            include_depth: 64,
            attribute_depth: 4096,
            attribute_parameters: 256,
        }
    }
}

/// How to read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadOptions {
    /// Bounds.
    pub limits: Limits,
    /// Load the meshes of `plymesh` shapes? Without, their `mesh` stays `None`; that the files exist is checked anyway.
    pub load_meshes: bool,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self { limits: Limits::default(), load_meshes: true }
    }
}

/// Reads a scene file and everything it includes, spectra and meshes as well. (Images are only looked for.)
///
/// # Errors
/// All problems that were found, missing files among them.
pub fn read(path: impl AsRef<Path>) -> Result<(Description, Diagnostics), SceneErrors> {
    read_with(path, &ReadOptions::default())
}

/// As [`read`], with options.
///
/// # Errors
/// All problems that were found.
pub fn read_with(path: impl AsRef<Path>, options: &ReadOptions) -> Result<(Description, Diagnostics), SceneErrors> {
    parser::read_file(path.as_ref(), options)
}

/// Reads a scene from text. Relative file names start from the working directory.
///
/// # Errors
/// All problems that were found.
pub fn read_str(name: &str, text: &str) -> Result<(Description, Diagnostics), SceneErrors> {
    read_bytes(name, text.as_bytes().to_vec(), Path::new(""), &ReadOptions::default())
}

/// Reads a scene from bytes, which need not be UTF-8. Relative file names start from `directory`.
///
/// # Errors
/// All problems that were found.
pub fn read_bytes(
    name: &str,
    text: Vec<u8>,
    directory: &Path,
    options: &ReadOptions,
) -> Result<(Description, Diagnostics), SceneErrors> {
    parser::read_text(name, text, directory, options)
}

/// Does this byte separate numbers?
pub(crate) fn is_number_delimiter(byte: u8) -> bool {
    number::is_delimiter(byte)
}

/// An integer that is the whole of `token`.
pub(crate) fn parse_integer(token: &[u8]) -> Option<i32> {
    number::parse_i32(token, 0).ok().filter(|(_, end)| *end == token.len()).map(|(value, _)| value)
}

/// A number that is the whole of `token`.
pub(crate) fn parse_number(token: &[u8]) -> Option<f32> {
    number::parse_f32(token, 0).ok().filter(|(_, end)| *end == token.len()).map(|(value, _)| value)
}
