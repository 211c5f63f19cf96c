//! Polygon meshes as files hold them.

use glam::{Vec2, Vec3};

/// A mesh of triangles and quadrilaterals with shared vertices. All per-vertex arrays are empty or as long as
/// `positions`; every index is in range.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshData {
    /// Vertex positions in object space.
    pub positions: Vec<Vec3>,
    /// Vertex normals as given, not normalized; empty if there are none.
    pub normals: Vec<Vec3>,
    /// Texture coordinates; empty if there are none.
    pub uvs: Vec<Vec2>,
    /// Three vertex indices per triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Four vertex indices per quadrilateral, counter-clockwise round its rim as the file has them. (pbrt-v4 makes a
    /// bilinear patch of each.)
    pub quads: Vec<[u32; 4]>,
    /// The file's own number of each face, triangles first, then quadrilaterals; empty if the file has none.
    pub face_indices: Vec<i32>,
    /// How many normals and texture coordinates were not finite in the file; they are zero here.
    pub replaced: usize,
}

impl MeshData {
    /// Bytes of memory that the arrays take.
    #[must_use]
    pub fn memory(&self) -> usize {
        size_of_val(&*self.positions)
            + size_of_val(&*self.normals)
            + size_of_val(&*self.uvs)
            + size_of_val(&*self.triangles)
            + size_of_val(&*self.quads)
            + size_of_val(&*self.face_indices)
    }
}
