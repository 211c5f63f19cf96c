//! Data in ascii.

use super::header::{Element, Header, PropertyType, Scalar, cut};
use super::{FaceProperties, Faces, PlyError, VertexProperties};
use crate::mesh::MeshData;
use crate::pbrt::{parse_integer, parse_number};
use glam::{Vec2, Vec3};

/// Walks over the tokens.
struct Cursor<'a> {
    data: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    fn token(&mut self) -> Option<&'a [u8]> {
        let blank = |b: &u8| b.is_ascii_whitespace();
        let start = self.at + self.data[self.at..].iter().position(|b| !blank(b))?;
        let end = self.data[start..].iter().position(blank).map_or(self.data.len(), |n| start + n);
        self.at = end;
        Some(&self.data[start..end])
    }

    /// The next number; those of integer types exactly.
    fn number(&mut self, element: &Element, i: usize, scalar: Scalar) -> Result<f64, PlyError> {
        let token = self.token().ok_or_else(|| element.truncated(i))?;
        let value = match scalar {
            Scalar::F32 | Scalar::F64 => parse_number(token).map(f64::from),
            _ => parse_integer(token).map(f64::from),
        };
        // NaN and infinity are told from garbage, and judged with the mesh.
        let parsed = value.or_else(|| std::str::from_utf8(token).ok().and_then(|text| text.parse().ok()));
        parsed.ok_or_else(|| PlyError::NotANumber {
            element: element.name.clone(),
            index: i as u64,
            token: cut(&String::from_utf8_lossy(&token[..token.len().min(100)])),
        })
    }

    /// How many elements, if the rest of the file can hold so many.
    fn count(&self, element: &Element) -> Result<usize, PlyError> {
        // Each value takes a digit and a blank, but for the last.
        element.count_within(self.data.len() - self.at + 1, 2 * element.properties.len())
    }

    /// Reads one element. `see(property, k, value)` gets each number: the `k`-th of its property, lists after their
    /// length as `length(property, n)`.
    fn element(
        &mut self,
        element: &Element,
        i: usize,
        mut length: impl FnMut(usize, usize),
        mut see: impl FnMut(usize, usize, f64),
    ) -> Result<(), PlyError> {
        for (property, p) in element.properties.iter().enumerate() {
            match p.kind {
                PropertyType::Scalar(scalar) => see(property, 0, self.number(element, i, scalar)?),
                PropertyType::List { count, item } => {
                    let n = self.number(element, i, count)?.max(0.0) as usize;
                    length(property, n);
                    for k in 0..n {
                        see(property, k, self.number(element, i, item)?);
                    }
                }
            }
        }
        Ok(())
    }
}

/// A vertex index; what is none becomes one that is never in range.
pub(super) fn index_of(value: f64) -> u32 {
    if value.fract() == 0.0 && (0.0..4_294_967_295.0).contains(&value) { value as u32 } else { u32::MAX }
}

/// Reads all elements.
pub(super) fn read(data: &[u8], header: &Header) -> Result<MeshData, PlyError> {
    let mut cursor = Cursor { data, at: 0 };
    let mut mesh = MeshData::default();
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => vertices(&mut cursor, element, &mut mesh)?,
            "face" => faces(&mut cursor, element, &mut mesh)?,
            _ if element.properties.is_empty() => {}
            _ => {
                for i in 0..cursor.count(element)? {
                    cursor.element(element, i, |_, _| {}, |_, _, _| {})?;
                }
            }
        }
    }
    Ok(mesh)
}

fn vertices(cursor: &mut Cursor<'_>, element: &Element, mesh: &mut MeshData) -> Result<(), PlyError> {
    let wanted = VertexProperties::of(element)?;
    let mut values = vec![0.0f32; element.properties.len()];
    for i in 0..cursor.count(element)? {
        cursor.element(element, i, |_, _| {}, |property, _, value| values[property] = value as f32)?;
        mesh.positions.push(Vec3::from(wanted.position.map(|p| values[p])));
        mesh.normals.extend(wanted.normal.map(|n| Vec3::from(n.map(|p| values[p]))));
        mesh.uvs.extend(wanted.uv.map(|uv| Vec2::from(uv.map(|p| values[p]))));
    }
    Ok(())
}

fn faces(cursor: &mut Cursor<'_>, element: &Element, mesh: &mut MeshData) -> Result<(), PlyError> {
    let wanted = FaceProperties::of(element)?;
    let mut faces = Faces::default();
    for i in 0..cursor.count(element)? {
        let (mut corners, mut corner_count, mut face_number) = ([0; 4], 0, None);
        let length = |property: usize, n: usize| {
            if property == wanted.corners {
                corner_count = n;
            }
        };
        cursor.element(element, i, length, |property, k, value| {
            if property == wanted.corners {
                if let Some(corner) = corners.get_mut(k) {
                    *corner = index_of(value);
                }
            } else if Some(property) == wanted.number {
                face_number = Some(value as i32);
            }
        })?;
        let corners =
            corners.get(..corner_count).ok_or(PlyError::Polygon { face: i as u64, corners: corner_count as u64 })?;
        faces.push(i as u64, corners, face_number)?;
    }
    faces.into_mesh(mesh);
    Ok(())
}
