//! A bulk reader of PLY meshes (Turk 1994): ascii, binary of both byte orders, gzip'd or not.
//!
//! Read are positions (`x y z`), normals (`nx ny nz`), texture coordinates (`u v`, `s t`, `texture_u texture_v` or
//! `texture_s texture_t`), triangles and quadrilaterals (`vertex_indices` or `vertex_index`), and `face_indices`. Other
//! properties and elements are skipped. Nothing is allocated for counts that the file is too short for.

mod ascii;
mod binary;
mod header;

use crate::file;
use crate::mesh::MeshData;
use header::{Element, Format, Header};
use rayon::prelude::*;
use std::path::Path;

/// Why a PLY file could not be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlyError {
    /// The file could not be read.
    #[error("{0}")]
    Unreadable(String),
    /// The header is wrong.
    #[error("PLY header, line {line}: {message}")]
    Header {
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
    /// The data end too early.
    #[error("the file is too short: {element} {index} of {count} is missing or cut off")]
    Truncated {
        /// Name of the element.
        element: String,
        /// The first one that isn't all there, from 0.
        index: u64,
        /// How many the header promises.
        count: u64,
    },
    /// The header promises more than the file can hold.
    #[error("the header promises {count} × {element}, more than the file can hold")]
    AbsurdCount {
        /// Name of the element.
        element: String,
        /// The promise.
        count: u64,
    },
    /// There is no such element, or it's empty.
    #[error("the file has no {0}")]
    Missing(&'static str),
    /// A face that is neither a triangle nor a quadrilateral.
    #[error("face {face} has {corners} corners; only triangles and quadrilaterals are supported")]
    Polygon {
        /// The face, from 0.
        face: u64,
        /// Its corners.
        corners: u64,
    },
    /// A face with a vertex that does not exist.
    #[error("face {face} uses vertex {vertex}, but there are only {count} vertices")]
    Index {
        /// The face, from 0: among all for ascii, among triangles or quadrilaterals for binary files.
        face: u64,
        /// The vertex.
        vertex: i64,
        /// How many there are.
        count: u64,
    },
    /// A vertex position that isn't finite.
    #[error("vertex {0} has a coordinate that is not a finite number")]
    NotFinite(u64),
    /// Something in an ascii file isn't a number.
    #[error("{element} {index}: `{token}` is not a number")]
    NotANumber {
        /// Name of the element.
        element: String,
        /// Which one, from 0.
        index: u64,
        /// What stands there.
        token: String,
    },
}

/// Reads a PLY file.
///
/// # Errors
/// See [`PlyError`].
pub fn read(path: &Path) -> Result<MeshData, PlyError> {
    read_within(path, u64::MAX)
}

/// As [`read`], for files of at most `limit` bytes (after decompression).
///
/// # Errors
/// See [`PlyError`].
pub fn read_within(path: &Path, limit: u64) -> Result<MeshData, PlyError> {
    let bytes = file::read_bytes(path, limit).map_err(|e| PlyError::Unreadable(file::explain(&e)))?;
    parse(&bytes)
}

/// Reads a PLY file from memory.
///
/// # Errors
/// See [`PlyError`].
pub fn parse(bytes: &[u8]) -> Result<MeshData, PlyError> {
    let header = Header::parse(bytes)?;
    let data = &bytes[header.data_start..];
    let mesh = match header.format {
        Format::Ascii => ascii::read(data, &header),
        Format::BinaryLittleEndian => binary::read::<false>(data, &header),
        Format::BinaryBigEndian => binary::read::<true>(data, &header),
    }?;
    check(mesh)
}

/// Triangles and quadrilaterals as they come.
#[derive(Default)]
struct Faces {
    triangles: Vec<[u32; 3]>,
    quads: Vec<[u32; 4]>,
    triangle_numbers: Vec<i32>,
    quad_numbers: Vec<i32>,
}

impl Faces {
    /// Adds a face. Indices beyond `u32` become `u32::MAX`, which is never in range.
    fn push(&mut self, face: u64, corners: &[u32], number: Option<i32>) -> Result<(), PlyError> {
        match *corners {
            [a, b, c] => {
                self.triangles.push([a, b, c]);
                self.triangle_numbers.extend(number);
            }
            [a, b, c, d] => {
                self.quads.push([a, b, c, d]);
                self.quad_numbers.extend(number);
            }
            _ => return Err(PlyError::Polygon { face, corners: corners.len() as u64 }),
        }
        Ok(())
    }

    fn into_mesh(self, mesh: &mut MeshData) {
        mesh.triangles = self.triangles;
        mesh.quads = self.quads;
        mesh.face_indices = self.triangle_numbers;
        mesh.face_indices.extend(self.quad_numbers);
    }
}

/// Positions must be finite, indices in range; other things that aren't finite become zero.
fn check(mut mesh: MeshData) -> Result<MeshData, PlyError> {
    if mesh.positions.is_empty() {
        return Err(PlyError::Missing("vertices"));
    }
    if mesh.triangles.is_empty() && mesh.quads.is_empty() {
        return Err(PlyError::Missing("faces"));
    }
    let bad = first_that(&mesh.positions, |p| !p.is_finite());
    if let Some(index) = bad {
        return Err(PlyError::NotFinite(index as u64));
    }
    let count = u32::try_from(mesh.positions.len()).unwrap_or(u32::MAX);
    check_indices(mesh.triangles.as_flattened(), 3, count)?;
    check_indices(mesh.quads.as_flattened(), 4, count)?;
    let replaced_normals = zero_unless(&mut mesh.normals, |n| n.is_finite());
    let replaced_uvs = zero_unless(&mut mesh.uvs, |uv| uv.is_finite());
    mesh.replaced = replaced_normals + replaced_uvs;
    Ok(mesh)
}

fn check_indices(indices: &[u32], corners: usize, count: u32) -> Result<(), PlyError> {
    match first_that(indices, |index| *index >= count) {
        None => Ok(()),
        Some(at) => Err(PlyError::Index {
            face: (at / corners) as u64,
            // What was negative in the file is told as such.
            vertex: i64::from(indices[at] as i32),
            count: u64::from(count),
        }),
    }
}

/// So many values are looked at in one go: long enough for vector instructions, short enough to be shared out.
const BLOCK: usize = 1 << 14;

/// The first value that is `bad`.
fn first_that<T: Sync>(values: &[T], bad: impl Fn(&T) -> bool + Sync + Send) -> Option<usize> {
    // Without leaving the loop early, it is vectorized.
    let any = |block: &[T]| block.iter().fold(false, |found, value| found | bad(value));
    let block = values.par_chunks(BLOCK).position_first(any)?;
    values[block * BLOCK..].iter().position(bad).map(|at| block * BLOCK + at)
}

/// Zeroes what isn't `good`, and counts it.
fn zero_unless<T: Default + Send>(values: &mut [T], good: impl Fn(&T) -> bool + Sync + Send) -> usize {
    let zero = |value: &mut T| {
        let bad = !good(value);
        if bad {
            *value = T::default();
        }
        usize::from(bad)
    };
    values.par_chunks_mut(BLOCK).map(|block| block.iter_mut().map(zero).sum::<usize>()).sum()
}

/// The names of properties that are read, by what they are.
const POSITION: [&str; 3] = ["x", "y", "z"];
const NORMAL: [&str; 3] = ["nx", "ny", "nz"];
const UVS: [[&str; 2]; 4] = [["u", "v"], ["s", "t"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]];
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];
const FACE_NUMBER: &str = "face_indices";

/// Which properties of the vertex element are read: indices into its properties.
struct VertexProperties {
    position: [usize; 3],
    normal: Option<[usize; 3]>,
    uv: Option<[usize; 2]>,
}

impl VertexProperties {
    fn of(element: &Element) -> Result<Self, PlyError> {
        let uv = UVS.iter().find_map(|names| element.scalars(*names));
        Ok(Self {
            position: element.scalars(POSITION).ok_or(PlyError::Missing("vertex positions `x y z`"))?,
            normal: element.scalars(NORMAL),
            uv,
        })
    }
}

/// Which properties of the face element are read.
struct FaceProperties {
    corners: usize,
    number: Option<usize>,
}

impl FaceProperties {
    fn of(element: &Element) -> Result<Self, PlyError> {
        let corners = CORNERS.iter().find_map(|name| element.list(name));
        Ok(Self {
            corners: corners.ok_or(PlyError::Missing("list `vertex_indices`"))?,
            number: element.scalars([FACE_NUMBER]).map(|[index]| index),
        })
    }
}

#[cfg(test)]
mod tests;
