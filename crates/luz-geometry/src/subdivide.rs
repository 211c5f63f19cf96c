//! Loop subdivision.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use crate::TriangleMesh;

/// Subdivides a control mesh `levels` times by Loop's rules (Loop 1987, "Smooth Subdivision Surfaces Based on
/// Triangles"; boundaries as cubic B-splines) and moves the vertices to the limit surface, with its normals.
///
/// As in pbrt-v4 the normals point to the side from which the triangles run clockwise in a right-handed drawing: against
/// `(p1 − p0) × (p2 − p0)`. Triangles with indices out of range are left out; edges of more than two triangles, or of two
/// that disagree about orientation, count as boundary. Each level has four times the triangles of the one before; levels
/// that would pass 2³² indices are not done.
pub fn loop_subdivide(levels: u32, indices: &[[u32; 3]], positions: &[Vec3]) -> TriangleMesh {
    let mut faces: Vec<[u32; 3]> =
        indices.iter().copied().filter(|f| f.iter().all(|&i| (i as usize) < positions.len())).collect();
    let mut vertices: Vec<DVec3> = positions.iter().map(|p| p.as_dvec3()).collect();
    for _ in 0..levels {
        if faces.len() > u32::MAX as usize / 16 {
            break;
        }
        (faces, vertices) = subdivide(&faces, &vertices);
    }
    let rings = Rings::new(&faces, vertices.len());
    let limit: Vec<DVec3> = (0..vertices.len()).map(|v| rings.limit(v, &vertices)).collect();
    let normals = (0..limit.len()).map(|v| rings.normal(v, &limit)).collect();
    TriangleMesh {
        positions: limit.iter().map(|p| p.as_vec3()).collect(),
        indices: faces,
        normals: Some(normals),
        ..TriangleMesh::default()
    }
}

/// The weight of each of `n` neighbours of an inner vertex.
fn beta(n: usize) -> f64 {
    if n == 3 { 3.0 / 16.0 } else { 3.0 / (8.0 * n as f64) }
}

struct Edge {
    ends: [u32; 2],
    opposite: [u32; 2],
    faces: u32,
}

fn subdivide(faces: &[[u32; 3]], vertices: &[DVec3]) -> (Vec<[u32; 3]>, Vec<DVec3>) {
    let mut edges: Vec<Edge> = Vec::with_capacity(faces.len() * 3 / 2);
    let mut index = HashMap::with_capacity(faces.len() * 3 / 2);
    let mut face_edges = Vec::with_capacity(faces.len());
    for face in faces {
        face_edges.push([0, 1, 2].map(|k| {
            let (a, b, opposite) = (face[k], face[(k + 1) % 3], face[(k + 2) % 3]);
            let id = *index.entry((a.min(b), a.max(b))).or_insert_with(|| {
                edges.push(Edge { ends: [a, b], opposite: [opposite; 2], faces: 0 });
                edges.len() - 1
            });
            let edge: &mut Edge = &mut edges[id];
            edge.opposite[edge.faces.min(1) as usize] = opposite;
            edge.faces += 1;
            id
        }));
    }

    let mut sums = vec![(DVec3::ZERO, 0usize); vertices.len()];
    let mut rims = vec![(DVec3::ZERO, 0usize); vertices.len()];
    for edge in &edges {
        for [from, to] in [edge.ends, [edge.ends[1], edge.ends[0]]] {
            let sum = &mut sums[from as usize];
            *sum = (sum.0 + vertices[to as usize], sum.1 + 1);
            if edge.faces != 2 {
                let rim = &mut rims[from as usize];
                *rim = (rim.0 + vertices[to as usize], rim.1 + 1);
            }
        }
    }
    let mut next: Vec<DVec3> = vertices
        .iter()
        .zip(sums.iter().zip(&rims))
        .map(|(&p, (&(sum, n), &(rim, rim_count)))| match (n, rim_count) {
            (0, _) => p,
            (_, 0) => p * (1.0 - n as f64 * beta(n)) + sum * beta(n),
            (_, 2) => p * 0.75 + rim * 0.125,
            // Where several boundaries meet the vertex is a corner.
            _ => p,
        })
        .collect();
    next.extend(edges.iter().map(|edge| {
        let [a, b] = edge.ends.map(|v| vertices[v as usize]);
        let [c, d] = edge.opposite.map(|v| vertices[v as usize]);
        if edge.faces == 2 { (a + b) * 0.375 + (c + d) * 0.125 } else { (a + b) * 0.5 }
    }));
    let first = vertices.len();
    let split = faces
        .iter()
        .zip(&face_edges)
        .flat_map(|(&[a, b, c], edges)| {
            let [ab, bc, ca] = edges.map(|e| (first + e) as u32);
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        })
        .collect();
    (split, next)
}

/// The neighbours of each vertex in order.
struct Rings {
    rings: Vec<Vec<u32>>,
    closed: Vec<bool>,
}

impl Rings {
    /// Closed rings run against the orientation of the triangles, open ones with it.
    fn new(faces: &[[u32; 3]], vertices: usize) -> Self {
        // For each directed edge, the third vertex of its triangle.
        let mut third = HashMap::with_capacity(faces.len() * 3);
        let mut start = vec![None; vertices];
        for face in faces {
            for k in 0..3 {
                let (a, b, c) = (face[k], face[(k + 1) % 3], face[(k + 2) % 3]);
                third.entry((a, b)).or_insert(c);
                start[a as usize].get_or_insert(b);
            }
        }
        let mut rings = Vec::with_capacity(vertices);
        let mut closed = Vec::with_capacity(vertices);
        for (v, &start) in start.iter().enumerate() {
            let v = v as u32;
            let mut ring = Vec::with_capacity(6);
            let mut is_closed = false;
            if let Some(first) = start {
                // From the triangle (v, a, ·) across its edge to the one that comes before.
                let mut at = first;
                loop {
                    ring.push(at);
                    match third.get(&(at, v)) {
                        Some(&next) if next == first => {
                            is_closed = true;
                            break;
                        }
                        Some(&next) if ring.len() <= faces.len() && !ring.contains(&next) => at = next,
                        _ => break,
                    }
                }
                if !is_closed {
                    // At the boundary: all the way back.
                    ring = vec![at];
                    while let Some(&next) = third.get(&(v, at)) {
                        if ring.contains(&next) {
                            break;
                        }
                        ring.push(next);
                        at = next;
                    }
                }
            }
            rings.push(ring);
            closed.push(is_closed);
        }
        Self { rings, closed }
    }

    fn limit(&self, v: usize, vertices: &[DVec3]) -> DVec3 {
        let (ring, p) = (&self.rings[v], vertices[v]);
        let n = ring.len();
        match (self.closed[v], &ring[..]) {
            (true, _) => {
                let weight = 1.0 / (n as f64 + 3.0 / (8.0 * beta(n)));
                let sum: DVec3 = ring.iter().map(|&i| vertices[i as usize]).sum();
                p * (1.0 - n as f64 * weight) + sum * weight
            }
            (false, [first, .., last]) => p * 0.6 + (vertices[*first as usize] + vertices[*last as usize]) * 0.2,
            _ => p,
        }
    }

    fn normal(&self, v: usize, vertices: &[DVec3]) -> Vec3 {
        let p = vertices[v];
        let ring: Vec<DVec3> = self.rings[v].iter().map(|&i| vertices[i as usize]).collect();
        let n = ring.len();
        if n < 2 {
            return Vec3::ZERO;
        }
        let (mut s, mut t) = (DVec3::ZERO, DVec3::ZERO);
        if self.closed[v] {
            for (j, &q) in ring.iter().enumerate() {
                let (sin, cos) = (TAU * j as f64 / n as f64).sin_cos();
                s += q * cos;
                t += q * sin;
            }
        } else {
            s = ring[n - 1] - ring[0];
            t = match n {
                2 => ring[0] + ring[1] - p * 2.0,
                3 => ring[1] - p,
                4 => -ring[0] + ring[1] * 2.0 + ring[2] * 2.0 - ring[3] - p * 2.0,
                _ => {
                    let theta = PI / (n - 1) as f64;
                    let inner: DVec3 = ring[1..n - 1]
                        .iter()
                        .enumerate()
                        .map(|(k, &q)| q * ((2.0 * theta.cos() - 2.0) * ((k + 1) as f64 * theta).sin()))
                        .sum();
                    -((ring[0] + ring[n - 1]) * theta.sin() + inner)
                }
            };
        }
        s.cross(t).normalize_or_zero().as_vec3()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn octahedron() -> (Vec<[u32; 3]>, Vec<Vec3>) {
        let positions = vec![Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
        let faces = vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
        (faces, positions)
    }

    #[test]
    fn a_closed_mesh_becomes_round_and_keeps_its_topology() {
        let (faces, positions) = octahedron();
        let mesh = loop_subdivide(4, &faces, &positions);
        assert_eq!(mesh.indices.len(), 8 << 8);
        assert_eq!(mesh.positions.len() as i64 - (mesh.indices.len() * 3 / 2) as i64 + mesh.indices.len() as i64, 2);
        let radii: Vec<f32> = mesh.positions.iter().map(|p| p.length()).collect();
        let (least, most) = radii.iter().fold((f32::MAX, 0f32), |(a, b), &r| (a.min(r), b.max(r)));
        // The corners, of valence 4, go half way to the centre of their neighbours: γ = 1/8.
        assert!((mesh.positions[0].x - 0.5).abs() < 1e-6 && (most - 0.5).abs() < 1e-6);
        assert!(most / least < 1.25, "{least} {most}");
        for (p, n) in mesh.positions.iter().zip(mesh.normals.as_ref().unwrap()) {
            // Against the orientation of the triangles, which look outwards.
            assert!(n.dot(p.normalize()) < -0.95, "{p} {n}");
        }
    }

    #[test]
    fn subdividing_more_does_not_move_the_limit() {
        let (faces, positions) = octahedron();
        let coarse = loop_subdivide(1, &faces, &positions);
        let fine = loop_subdivide(3, &faces, &positions);
        for (a, b) in coarse.positions.iter().zip(&fine.positions) {
            assert!(a.distance(*b) < 1e-6, "{a} {b}");
        }
    }

    #[test]
    fn a_flat_sheet_stays_flat_with_one_normal() {
        let positions: Vec<Vec3> = (0..25).map(|i| Vec3::new((i % 5) as f32, (i / 5) as f32, 2.0)).collect();
        let faces: Vec<[u32; 3]> = (0..16u32)
            .flat_map(|i| {
                let a = i / 4 * 5 + i % 4;
                [[a, a + 1, a + 6], [a, a + 6, a + 5]]
            })
            .collect();
        let mesh = loop_subdivide(2, &faces, &positions);
        for (p, n) in mesh.positions.iter().zip(mesh.normals.as_ref().unwrap()) {
            assert!((p.z - 2.0).abs() < 1e-6);
            assert!(n.distance(-Vec3::Z) < 1e-5, "{p} {n}");
        }
    }

    #[test]
    fn broken_meshes_are_survived() {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE];
        let faces = [[0, 1, 2], [0, 1, 3], [0, 1, 4], [1, 0, 2], [9, 0, 1], [0, 0, 0]];
        let mesh = loop_subdivide(2, &faces, &positions);
        assert_eq!(mesh.indices.len(), 5 * 16);
        assert!(mesh.positions.iter().all(|p| p.is_finite()));
        assert!(loop_subdivide(3, &[], &[]).indices.is_empty());
    }
}
