//! Binary data. Vertices without lists and faces that are all triangles (or all quadrilaterals) have a fixed stride and
//! are decoded in bulk, in parallel; everything else goes value by value.

use super::header::{Element, Header, PropertyType, Scalar};
use super::{FaceProperties, Faces, PlyError, VertexProperties};
use crate::mesh::MeshData;
use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// Fewer elements than this are not worth another thread.
const GRAIN: usize = 1 << 15;

/// A scalar at an offset of an element with a fixed stride.
#[derive(Clone, Copy)]
struct Field {
    offset: usize,
    scalar: Scalar,
}

/// Reads all elements.
pub(super) fn read<const BIG: bool>(mut data: &[u8], header: &Header) -> Result<MeshData, PlyError> {
    let mut mesh = MeshData::default();
    for element in &header.elements {
        let used = match element.name.as_str() {
            "vertex" => vertices::<BIG>(data, element, &mut mesh)?,
            "face" => faces::<BIG>(data, element, &mut mesh)?,
            _ => skip::<BIG>(data, element)?,
        };
        data = &data[used..];
    }
    Ok(mesh)
}

fn bytes<const N: usize, const BIG: bool>(data: &[u8], at: usize) -> [u8; N] {
    let mut bytes = [0; N];
    // Callers have checked the length; a short slice would read as zero.
    if let Some(source) = data.get(at..at + N) {
        bytes.copy_from_slice(source);
    }
    if BIG {
        bytes.reverse();
    }
    bytes
}

/// A number as `f64`, which holds all of PLY's exactly.
fn number<const BIG: bool>(data: &[u8], at: usize, scalar: Scalar) -> f64 {
    match scalar {
        Scalar::I8 => f64::from(i8::from_le_bytes(bytes::<1, BIG>(data, at))),
        Scalar::U8 => f64::from(u8::from_le_bytes(bytes::<1, BIG>(data, at))),
        Scalar::I16 => f64::from(i16::from_le_bytes(bytes::<2, BIG>(data, at))),
        Scalar::U16 => f64::from(u16::from_le_bytes(bytes::<2, BIG>(data, at))),
        Scalar::I32 => f64::from(i32::from_le_bytes(bytes::<4, BIG>(data, at))),
        Scalar::U32 => f64::from(u32::from_le_bytes(bytes::<4, BIG>(data, at))),
        Scalar::F32 => f64::from(f32::from_le_bytes(bytes::<4, BIG>(data, at))),
        Scalar::F64 => f64::from_le_bytes(bytes::<8, BIG>(data, at)),
    }
}

/// A number as a vertex index; what is none becomes one that is never in range.
fn index<const BIG: bool>(data: &[u8], at: usize, scalar: Scalar) -> u32 {
    match scalar {
        Scalar::I32 | Scalar::U32 => u32::from_le_bytes(bytes::<4, BIG>(data, at)),
        _ => super::ascii::index_of(number::<BIG>(data, at, scalar)),
    }
}

/// The length of a list; negative ones are none.
fn length<const BIG: bool>(data: &[u8], at: usize, scalar: Scalar) -> usize {
    number::<BIG>(data, at, scalar).max(0.0) as usize
}

fn vertices<const BIG: bool>(data: &[u8], element: &Element, mesh: &mut MeshData) -> Result<usize, PlyError> {
    let wanted = VertexProperties::of(element)?;
    let count = element.count_within(data.len(), element.least_bytes())?;
    let Some(stride) = element.stride() else {
        return vertices_with_lists::<BIG>(data, element, &wanted, count, mesh);
    };
    let mut offset = 0;
    let fields: Vec<Field> = element
        .properties
        .iter()
        .map(|p| {
            let PropertyType::Scalar(scalar) = p.kind else { return Field { offset, scalar: Scalar::U8 } };
            let field = Field { offset, scalar };
            offset += scalar.size();
            field
        })
        .collect();
    let used = &data[..count * stride];
    let pick = |indices: [usize; 3]| indices.map(|i| fields[i]);
    mesh.positions = vectors3::<BIG>(used, stride, pick(wanted.position));
    if let Some(normal) = wanted.normal {
        mesh.normals = vectors3::<BIG>(used, stride, pick(normal));
    }
    if let Some([u, v]) = wanted.uv {
        let [u, v] = [fields[u], fields[v]];
        let all_f32 = [u, v].iter().all(|f| f.scalar == Scalar::F32);
        mesh.uvs = if all_f32 {
            let f32_at = |data: &[u8], f: Field| f32::from_le_bytes(bytes::<4, BIG>(data, f.offset));
            gather(used, stride, |data| Vec2::new(f32_at(data, u), f32_at(data, v)))
        } else {
            let f32_at = |data: &[u8], f: Field| number::<BIG>(data, f.offset, f.scalar) as f32;
            gather(used, stride, |data| Vec2::new(f32_at(data, u), f32_at(data, v)))
        };
    }
    Ok(used.len())
}

fn vectors3<const BIG: bool>(data: &[u8], stride: usize, fields: [Field; 3]) -> Vec<Vec3> {
    let [x, y, z] = fields;
    let all_f32 = fields.iter().all(|f| f.scalar == Scalar::F32);
    if all_f32 && y.offset == x.offset + 4 && z.offset == y.offset + 4 {
        let at = x.offset;
        return gather(data, stride, |data| {
            let data = &data[at..at + 12];
            let component = |i: usize| f32::from_le_bytes(bytes::<4, BIG>(data, 4 * i));
            Vec3::new(component(0), component(1), component(2))
        });
    }
    let component = |data: &[u8], f: Field| number::<BIG>(data, f.offset, f.scalar) as f32;
    gather(data, stride, |data| Vec3::new(component(data, x), component(data, y), component(data, z)))
}

/// One value out of every `stride` bytes.
fn gather<T: Send>(data: &[u8], stride: usize, value: impl Fn(&[u8]) -> T + Sync + Send) -> Vec<T> {
    data.par_chunks_exact(stride).with_min_len(GRAIN).map(value).collect()
}

/// Walks over one element value by value. `see(property, data, at, scalar, length)` gets every scalar (`length` 1) and
/// every list. Returns the position behind it, `None` if the data end.
fn walk<const BIG: bool>(
    data: &[u8],
    mut at: usize,
    element: &Element,
    mut see: impl FnMut(usize, usize, Scalar, usize),
) -> Option<usize> {
    for (property, p) in element.properties.iter().enumerate() {
        let (scalar, count) = match p.kind {
            PropertyType::Scalar(scalar) => (scalar, 1),
            PropertyType::List { count, item } => {
                let end = at.checked_add(count.size()).filter(|end| *end <= data.len())?;
                let n = length::<BIG>(data, at, count);
                at = end;
                (item, n)
            }
        };
        let end = scalar.size().checked_mul(count).and_then(|size| at.checked_add(size))?;
        if end > data.len() {
            return None;
        }
        see(property, at, scalar, count);
        at = end;
    }
    Some(at)
}

fn vertices_with_lists<const BIG: bool>(
    data: &[u8],
    element: &Element,
    wanted: &VertexProperties,
    count: usize,
    mesh: &mut MeshData,
) -> Result<usize, PlyError> {
    let mut at = 0;
    let mut values = vec![0.0f32; element.properties.len()];
    for i in 0..count {
        at = walk::<BIG>(data, at, element, |property, at, scalar, length| {
            if length > 0 {
                values[property] = number::<BIG>(data, at, scalar) as f32;
            }
        })
        .ok_or_else(|| element.truncated(i))?;
        mesh.positions.push(Vec3::from(wanted.position.map(|p| values[p])));
        mesh.normals.extend(wanted.normal.map(|n| Vec3::from(n.map(|p| values[p]))));
        mesh.uvs.extend(wanted.uv.map(|uv| Vec2::from(uv.map(|p| values[p]))));
    }
    Ok(at)
}

fn skip<const BIG: bool>(data: &[u8], element: &Element) -> Result<usize, PlyError> {
    let least = element.least_bytes();
    if least == 0 {
        return Ok(0);
    }
    let count = element.count_within(data.len(), least)?;
    if let Some(stride) = element.stride() {
        return Ok(count * stride);
    }
    let mut at = 0;
    for i in 0..count {
        at = walk::<BIG>(data, at, element, |_, _, _, _| {}).ok_or_else(|| element.truncated(i))?;
    }
    Ok(at)
}

fn faces<const BIG: bool>(data: &[u8], element: &Element, mesh: &mut MeshData) -> Result<usize, PlyError> {
    let wanted = FaceProperties::of(element)?;
    let count = element.count_within(data.len(), element.least_bytes())?;
    if let Some(used) = faces_of_one_kind::<BIG, 3>(data, element, &wanted, count, |m| &mut m.triangles, mesh) {
        return Ok(used);
    }
    if let Some(used) = faces_of_one_kind::<BIG, 4>(data, element, &wanted, count, |m| &mut m.quads, mesh) {
        return Ok(used);
    }
    let mut faces = Faces::default();
    let mut at = 0;
    for i in 0..count {
        let (mut corners, mut corner_count, mut face_number) = ([0; 4], 0, None);
        at = walk::<BIG>(data, at, element, |property, at, scalar, length| {
            if property == wanted.corners {
                corner_count = length;
                for (k, corner) in corners.iter_mut().enumerate().take(length) {
                    *corner = index::<BIG>(data, at + k * scalar.size(), scalar);
                }
            } else if Some(property) == wanted.number {
                face_number = Some(number::<BIG>(data, at, scalar) as i32);
            }
        })
        .ok_or_else(|| element.truncated(i))?;
        let corners =
            corners.get(..corner_count).ok_or(PlyError::Polygon { face: i as u64, corners: corner_count as u64 })?;
        faces.push(i as u64, corners, face_number)?;
    }
    faces.into_mesh(mesh);
    Ok(at)
}

/// Faces that all have `N` corners and no other list: the usual case. `None` if they are not so.
fn faces_of_one_kind<const BIG: bool, const N: usize>(
    data: &[u8],
    element: &Element,
    wanted: &FaceProperties,
    count: usize,
    target: impl Fn(&mut MeshData) -> &mut Vec<[u32; N]>,
    mesh: &mut MeshData,
) -> Option<usize> {
    let (mut stride, mut list, mut face_number) = (0, None, None);
    for (i, property) in element.properties.iter().enumerate() {
        match property.kind {
            PropertyType::Scalar(scalar) => {
                if Some(i) == wanted.number {
                    face_number = Some(Field { offset: stride, scalar });
                }
                stride += scalar.size();
            }
            PropertyType::List { count, item } if i == wanted.corners => {
                list = Some((stride, count, item));
                stride += count.size() + N * item.size();
            }
            PropertyType::List { .. } => return None,
        }
    }
    let (offset, count_type, item) = list?;
    let used = data.get(..count.checked_mul(stride)?)?;
    // Two passes, the second of them over what is in the cache or not much slower than the first: this way a file of
    // another kind is recognised before anything is allocated, usually at its first faces.
    let right = |block: &[u8]| {
        let faces = block.chunks_exact(stride);
        match count_type {
            Scalar::U8 | Scalar::I8 => faces.fold(true, |right, face| right & (face[offset] == N as u8)),
            _ => faces.fold(true, |right, face| right & (length::<BIG>(face, offset, count_type) == N)),
        }
    };
    if !used.par_chunks(stride * super::BLOCK).all(right) {
        return None;
    }
    let first = offset + count_type.size();
    *target(mesh) = if matches!(item, Scalar::I32 | Scalar::U32) {
        gather(used, stride, |face| {
            let corners = &face[first..first + 4 * N];
            std::array::from_fn(|k| u32::from_le_bytes(bytes::<4, BIG>(corners, 4 * k)))
        })
    } else {
        gather(used, stride, |face| std::array::from_fn(|k| index::<BIG>(face, first + k * item.size(), item)))
    };
    if let Some(field) = face_number {
        mesh.face_indices = gather(used, stride, |face| number::<BIG>(face, field.offset, field.scalar) as i32);
    }
    Some(used.len())
}
