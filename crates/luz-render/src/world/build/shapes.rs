//! Shapes out of a scene's descriptions of them.

use super::{Context, unsupported};
use luz_geometry::{BilinearMesh, Cylinder, Disk, Shape, Sphere, Transform, TriangleMesh, loop_subdivide};
use luz_scene::{Diagnostic, ShapeEntity};

/// The shapes of an entity, placed by `transform`: one, or two for files that mix triangles and quadrilaterals. None
/// where the entity is wrong; the diagnostics then say why.
pub(super) fn shapes(context: &mut Context<'_>, shape: &ShapeEntity, transform: &Transform) -> Vec<Shape> {
    match &*shape.entity.kind {
        "trianglemesh" => triangle_mesh(context, shape, transform),
        "plymesh" => ply_mesh(context, shape, transform),
        "bilinearmesh" => bilinear_mesh(context, shape, transform),
        "loopsubdiv" => subdivision(context, shape, transform),
        "sphere" => sphere(context, shape, transform),
        "disk" => disk(context, shape, transform),
        "cylinder" => cylinder(context, shape, transform),
        _ => {
            unsupported(context, &shape.entity, "shape");
            Vec::new()
        }
    }
}

/// Groups of `N` vertex numbers; `None`, said why, where they are not whole groups of existing vertices.
fn indices<const N: usize>(
    context: &mut Context<'_>,
    shape: &ShapeEntity,
    vertices: usize,
    default: Option<[u32; N]>,
) -> Option<Vec<[u32; N]>> {
    let parameters = &shape.entity.parameters;
    let diagnostics = &mut *context.diagnostics;
    let Some(list) = parameters.integers("indices", diagnostics) else {
        let made = default.map(|d| vec![d]).filter(|_| vertices == N);
        if made.is_none() {
            diagnostics.push(
                Diagnostic::error(shape.entity.span, format!("`{}` needs `\"integer indices\"`", shape.entity.kind))
                    .with_help(format!("without them there must be just {N} vertices, and there are {vertices}")),
            );
        }
        return made;
    };
    let span = parameters.span("indices");
    if list.len() % N != 0 {
        diagnostics.error(span, format!("{} vertex numbers do not make whole groups of {N}", list.len()));
        return None;
    }
    if let Some(bad) = list.iter().find(|&&i| i < 0 || i as usize >= vertices) {
        diagnostics.error(span, format!("vertex number {bad} is out of range: there are {vertices} vertices"));
        return None;
    }
    Some(list.chunks_exact(N).map(|group| std::array::from_fn(|k| group[k] as u32)).collect())
}

/// A per-vertex array, if it is given; an error where its length is not the number of vertices.
fn per_vertex<T: Copy>(
    context: &mut Context<'_>,
    shape: &ShapeEntity,
    name: &str,
    values: Option<&[T]>,
    vertices: usize,
) -> Option<Vec<T>> {
    let values = values?;
    if values.len() != vertices {
        let span = shape.entity.parameters.span(name);
        context.diagnostics.error(span, format!("`{name}` has {} values for {vertices} vertices", values.len()));
        return None;
    }
    Some(values.to_vec())
}

fn face_indices(context: &mut Context<'_>, shape: &ShapeEntity, faces: usize) -> Option<Vec<u32>> {
    let list = shape.entity.parameters.integers("faceIndices", context.diagnostics)?;
    if list.len() != faces {
        let span = shape.entity.parameters.span("faceIndices");
        context.diagnostics.error(span, format!("`faceIndices` has {} values for {faces} faces", list.len()));
        return None;
    }
    Some(list.iter().map(|&i| i as u32).collect())
}

fn triangle_mesh(context: &mut Context<'_>, shape: &ShapeEntity, transform: &Transform) -> Vec<Shape> {
    let parameters = &shape.entity.parameters;
    let Some(positions) = parameters.points3("P", context.diagnostics) else {
        context.diagnostics.error(shape.entity.span, "`trianglemesh` needs `\"point3 P\"`");
        return Vec::new();
    };
    let vertices = positions.len();
    let Some(indices) = indices(context, shape, vertices, Some([0, 1, 2])) else { return Vec::new() };
    let normals = parameters.normals("N", context.diagnostics);
    let tangents = parameters.vectors3("S", context.diagnostics);
    let uvs = parameters.points2("uv", context.diagnostics);
    let mut mesh = TriangleMesh {
        positions: positions.to_vec(),
        normals: per_vertex(context, shape, "N", normals, vertices),
        tangents: per_vertex(context, shape, "S", tangents, vertices),
        uvs: per_vertex(context, shape, "uv", uvs, vertices),
        face_indices: face_indices(context, shape, indices.len()),
        indices,
        reverse_orientation: shape.reverse_orientation,
        swaps_handedness: false,
    };
    mesh.transform(transform);
    vec![Shape::Triangles(mesh)]
}

fn ply_mesh(context: &mut Context<'_>, shape: &ShapeEntity, transform: &Transform) -> Vec<Shape> {
    if shape.entity.parameters.contains("displacement") {
        let span = shape.entity.parameters.span("displacement");
        context.diagnostics.push(
            Diagnostic::error(span, "displaced meshes cannot be rendered yet")
                .with_help("a material's `displacement` tilts normals without moving the surface"),
        );
    }
    let Some(data) = &shape.mesh else { return Vec::new() };
    let optional = |given: bool| given.then_some(());
    let normals = optional(!data.normals.is_empty()).map(|()| data.normals.clone());
    let uvs = optional(!data.uvs.is_empty()).map(|()| data.uvs.clone());
    let numbers = |range: std::ops::Range<usize>| {
        data.face_indices.get(range).map(|list| list.iter().map(|&i| i as u32).collect::<Vec<_>>())
    };
    let mut made = Vec::new();
    if !data.triangles.is_empty() {
        let mut mesh = TriangleMesh {
            positions: data.positions.clone(),
            indices: data.triangles.clone(),
            normals: normals.clone(),
            tangents: None,
            uvs: uvs.clone(),
            face_indices: numbers(0..data.triangles.len()).filter(|n| !n.is_empty()),
            reverse_orientation: shape.reverse_orientation,
            swaps_handedness: false,
        };
        mesh.transform(transform);
        made.push(Shape::Triangles(mesh));
    }
    if !data.quads.is_empty() {
        let first = data.triangles.len();
        let mut mesh = BilinearMesh {
            positions: data.positions.clone(),
            // Round the rim in the file; rows in a patch.
            indices: data.quads.iter().map(|&[a, b, c, d]| [a, b, d, c]).collect(),
            normals,
            uvs,
            face_indices: numbers(first..first + data.quads.len()),
            reverse_orientation: shape.reverse_orientation,
            swaps_handedness: false,
        };
        mesh.transform(transform);
        made.push(Shape::Bilinear(mesh));
    }
    made
}

fn bilinear_mesh(context: &mut Context<'_>, shape: &ShapeEntity, transform: &Transform) -> Vec<Shape> {
    let parameters = &shape.entity.parameters;
    if let Some(name) = parameters.string("emissionfilename", context.diagnostics) {
        // In pbrt-v4 it says by which image points are drawn; here that is the one the light shines with.
        let light = shape.area_light.map(|light| &context.description.area_lights[light].parameters);
        let shown = light.and_then(|parameters| parameters.string("filename", context.diagnostics));
        if shown != Some(name) {
            context.diagnostics.push(
                Diagnostic::warning(parameters.span("emissionfilename"), "`emissionfilename` has no effect")
                    .with_help("points are drawn by the image of the `AreaLightSource` itself, its `filename`"),
            );
        }
    }
    let Some(positions) = parameters.points3("P", context.diagnostics) else {
        context.diagnostics.error(shape.entity.span, "`bilinearmesh` needs `\"point3 P\"`");
        return Vec::new();
    };
    let vertices = positions.len();
    let Some(indices) = indices(context, shape, vertices, Some([0, 1, 2, 3])) else { return Vec::new() };
    let normals = parameters.normals("N", context.diagnostics);
    let uvs = parameters.points2("uv", context.diagnostics);
    let mut mesh = BilinearMesh {
        positions: positions.to_vec(),
        normals: per_vertex(context, shape, "N", normals, vertices),
        uvs: per_vertex(context, shape, "uv", uvs, vertices),
        face_indices: face_indices(context, shape, indices.len()),
        indices,
        reverse_orientation: shape.reverse_orientation,
        swaps_handedness: false,
    };
    mesh.transform(transform);
    vec![Shape::Bilinear(mesh)]
}

/// More levels than this make more triangles than memory holds, whatever the mesh.
const MAX_SUBDIVISION: i32 = 10;

fn subdivision(context: &mut Context<'_>, shape: &ShapeEntity, transform: &Transform) -> Vec<Shape> {
    let parameters = &shape.entity.parameters;
    let Some(positions) = parameters.points3("P", context.diagnostics) else {
        context.diagnostics.error(shape.entity.span, "`loopsubdiv` needs `\"point3 P\"`");
        return Vec::new();
    };
    let levels = parameters.one_integer("levels", 3, context.diagnostics);
    if !(0..=MAX_SUBDIVISION).contains(&levels) {
        let span = parameters.span("levels");
        context.diagnostics.error(span, format!("a mesh is subdivided 0 to {MAX_SUBDIVISION} times, not {levels}"));
        return Vec::new();
    }
    if let Some(scheme) = parameters.string("scheme", context.diagnostics)
        && scheme != "loop"
    {
        context.diagnostics.error(parameters.span("scheme"), format!("unknown subdivision scheme `{scheme}`"));
    }
    let Some(indices) = indices(context, shape, positions.len(), None) else { return Vec::new() };
    let mut mesh = loop_subdivide(levels as u32, &indices, positions);
    mesh.reverse_orientation = shape.reverse_orientation;
    mesh.transform(transform);
    vec![Shape::Triangles(mesh)]
}

fn positive(context: &mut Context<'_>, shape: &ShapeEntity, name: &str, default: f32) -> Option<f32> {
    let value = shape.entity.parameters.one_float(name, default, context.diagnostics);
    if value > 0.0 && value.is_finite() {
        return Some(value);
    }
    let span = shape.entity.parameters.span(name);
    context.diagnostics.error(span, format!("the {name} of a {} must be positive, not {value}", shape.entity.kind));
    None
}

fn phi_max(context: &mut Context<'_>, shape: &ShapeEntity) -> f32 {
    shape.entity.parameters.one_float("phimax", 360.0, context.diagnostics).clamp(0.0, 360.0).to_radians()
}

fn sphere(context: &mut Context<'_>, shape: &ShapeEntity, transform: &Transform) -> Vec<Shape> {
    let Some(radius) = positive(context, shape, "radius", 1.0) else { return Vec::new() };
    let parameters = &shape.entity.parameters;
    let z_min = parameters.one_float("zmin", -radius, context.diagnostics);
    let z_max = parameters.one_float("zmax", radius, context.diagnostics);
    vec![Shape::Sphere(Sphere {
        transform: *transform,
        reverse_orientation: shape.reverse_orientation,
        radius,
        z_min: z_min.min(z_max).clamp(-radius, radius),
        z_max: z_min.max(z_max).clamp(-radius, radius),
        phi_max: phi_max(context, shape),
    })]
}

fn disk(context: &mut Context<'_>, shape: &ShapeEntity, transform: &Transform) -> Vec<Shape> {
    let Some(radius) = positive(context, shape, "radius", 1.0) else { return Vec::new() };
    let parameters = &shape.entity.parameters;
    let inner_radius = parameters.one_float("innerradius", 0.0, context.diagnostics);
    if !(0.0..radius).contains(&inner_radius) {
        let span = parameters.span("innerradius");
        context.diagnostics.error(span, format!("the hole of a disk lies within it: {inner_radius} of {radius}"));
        return Vec::new();
    }
    vec![Shape::Disk(Disk {
        transform: *transform,
        reverse_orientation: shape.reverse_orientation,
        height: parameters.one_float("height", 0.0, context.diagnostics),
        radius,
        inner_radius,
        phi_max: phi_max(context, shape),
    })]
}

fn cylinder(context: &mut Context<'_>, shape: &ShapeEntity, transform: &Transform) -> Vec<Shape> {
    let Some(radius) = positive(context, shape, "radius", 1.0) else { return Vec::new() };
    let parameters = &shape.entity.parameters;
    let ends = [
        parameters.one_float("zmin", -1.0, context.diagnostics),
        parameters.one_float("zmax", 1.0, context.diagnostics),
    ];
    vec![Shape::Cylinder(Cylinder {
        transform: *transform,
        reverse_orientation: shape.reverse_orientation,
        radius,
        z_min: ends[0].min(ends[1]),
        z_max: ends[0].max(ends[1]),
        phi_max: phi_max(context, shape),
    })]
}
