use super::*;
use glam::{Vec2, Vec3};

const HEADER: &str = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
    element face 2\nproperty list uchar int vertex_indices\nend_header\n";

fn ascii(body: &str) -> Vec<u8> {
    format!("ply\nformat ascii 1.0\ncomment a\n{HEADER}{body}").into_bytes()
}

const SQUARE: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n";

fn message(bytes: &[u8]) -> String {
    parse(bytes).unwrap_err().to_string()
}

#[test]
fn ascii_triangles() {
    let mesh = parse(&ascii(SQUARE)).unwrap();
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert!(mesh.quads.is_empty() && mesh.normals.is_empty() && mesh.uvs.is_empty());
}

/// A mesh with everything, once in each form.
fn rich(format: &str, push: impl Fn(&mut Vec<u8>, f64, &str)) -> Vec<u8> {
    let mut out = format!(
        "ply\r\nformat {format} 1.0\r\nobj_info x\r\nelement edge 1\r\nproperty list short double w\r\n\
        element vertex 4\r\nproperty double x\r\nproperty float y\r\nproperty uchar red\r\nproperty short z\r\n\
        property float nx\r\nproperty float ny\r\nproperty float nz\r\nproperty float s\r\nproperty float t\r\n\
        element face 2\r\nproperty uchar flag\r\nproperty list uchar uint vertex_index\r\nproperty int face_indices\r\n\
        end_header\r\n"
    )
    .into_bytes();
    let mut add = |values: &[(f64, &str)]| values.iter().for_each(|(value, kind)| push(&mut out, *value, kind));
    add(&[(2.0, "i16"), (1.5, "f64"), (2.5, "f64")]);
    for (x, y, z) in [(0.0, 0.0, 0.0), (1.0, 0.0, -7.0), (1.0, 1.0, 0.0), (0.0, 1.0, 300.0)] {
        add(&[(x, "f64"), (y, "f32"), (9.0, "u8"), (z, "i16")]);
        add(&[(0.0, "f32"), (0.0, "f32"), (1.0, "f32"), (x, "f32"), (y / 4.0, "f32")]);
    }
    add(&[(1.0, "u8"), (4.0, "u8"), (0.0, "u32"), (1.0, "u32"), (2.0, "u32"), (3.0, "u32"), (10.0, "i32")]);
    add(&[(1.0, "u8"), (3.0, "u8"), (3.0, "u32"), (1.0, "u32"), (2.0, "u32"), (-11.0, "i32")]);
    out
}

fn rich_in_all_formats() -> [Vec<u8>; 3] {
    let binary = |out: &mut Vec<u8>, value: f64, kind: &str, big: bool| {
        let mut bytes = match kind {
            "u8" => vec![value as u8],
            "i16" => (value as i16).to_le_bytes().to_vec(),
            "i32" => (value as i32).to_le_bytes().to_vec(),
            "u32" => (value as u32).to_le_bytes().to_vec(),
            "f32" => (value as f32).to_le_bytes().to_vec(),
            _ => value.to_le_bytes().to_vec(),
        };
        if big {
            bytes.reverse();
        }
        out.extend(bytes);
    };
    [
        rich("ascii", |out, value, _| out.extend(format!("{value} ").bytes())),
        rich("binary_little_endian", |out, value, kind| binary(out, value, kind, false)),
        rich("binary_big_endian", |out, value, kind| binary(out, value, kind, true)),
    ]
}

#[test]
fn all_formats_agree() {
    for bytes in rich_in_all_formats() {
        let mesh = parse(&bytes).unwrap();
        assert_eq!(mesh.positions[3], Vec3::new(0.0, 1.0, 300.0));
        assert_eq!(mesh.positions[1], Vec3::new(1.0, 0.0, -7.0));
        assert_eq!(mesh.normals, [Vec3::Z; 4]);
        assert_eq!(mesh.uvs[2], Vec2::new(1.0, 0.25));
        assert_eq!((mesh.quads, mesh.triangles), (vec![[0, 1, 2, 3]], vec![[3, 1, 2]]));
        assert_eq!(mesh.face_indices, [-11, 10]);
    }
}

/// A big mesh in the usual layout goes through the bulk path.
#[test]
fn bulk_triangles() {
    let count = 100_000u32;
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty float x\nproperty float y\n\
        property float z\nelement face {count}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes();
    for i in 0..count {
        for value in [i as f32, 0.5, -1.0] {
            bytes.extend(value.to_le_bytes());
        }
    }
    for i in 0..count {
        bytes.push(3);
        for corner in [i, (i + 1) % count, 0] {
            bytes.extend(corner.to_le_bytes());
        }
    }
    let mesh = parse(&bytes).unwrap();
    assert_eq!(mesh.positions[77_777], Vec3::new(77_777.0, 0.5, -1.0));
    assert_eq!(mesh.triangles[77_777], [77_777, 77_778, 0]);
    assert_eq!(mesh.triangles.len(), count as usize);
    // The same with one quadrilateral in the middle.
    let face = bytes.len() - 13 * 5;
    let mut mixed = bytes[..face].to_vec();
    mixed.push(4);
    (0..4u32).for_each(|corner| mixed.extend(corner.to_le_bytes()));
    mixed.extend(&bytes[face + 13..]);
    let mesh = parse(&mixed).unwrap();
    assert_eq!((mesh.triangles.len(), mesh.quads.len()), (count as usize - 1, 1));
    // Cut anywhere.
    for cut in [1, 13, 14, 13 * 100, 13 * 100_000 + 1, 13 * 100_000 + 12 * 100_000] {
        assert!(parse(&bytes[..bytes.len() - cut]).is_err());
    }
}

#[test]
fn truncated_data() {
    let all = ascii(SQUARE);
    for length in 0..all.len() - 2 {
        assert!(parse(&all[..length]).is_err(), "{length}");
    }
    for bytes in rich_in_all_formats() {
        for length in 0..bytes.len() - 4 {
            assert!(parse(&bytes[..length]).is_err(), "{length}");
        }
    }
    assert_eq!(
        message(&ascii("0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n9 0 ")),
        "the file is too short: face 1 of 2 is missing or cut off"
    );
}

#[test]
fn absurd_counts_are_refused_without_allocating() {
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for (vertices, faces) in [(u64::MAX, 1), (1 << 60, 1), (1_000_000_000_000, 1), (1, u64::MAX), (0, 1 << 50)] {
            let text = format!(
                "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
                element face {faces}\nproperty list uchar int vertex_indices\nend_header\n0 0 0 \n3 0 0 0 "
            );
            let error = parse(text.as_bytes()).unwrap_err();
            assert!(matches!(error, PlyError::AbsurdCount { .. }), "{error}");
        }
        let text = format!("ply\nformat {format} 1.0\nelement nothing 18446744073709551615\nend_header\n");
        assert_eq!(message(text.as_bytes()), "the file has no vertices");
    }
    // A list that is longer than the file.
    let text = "ply\nformat binary_little_endian 1.0\nelement x 1\nproperty list uint double y\nend_header\n\u{7f}\u{7f}\u{7f}\u{7f}";
    assert_eq!(message(text.as_bytes()), "the file is too short: x 0 of 1 is missing or cut off");
}

#[test]
fn what_is_wrong_is_said() {
    assert_eq!(message(b""), "PLY header, line 1: this is not a PLY file");
    assert_eq!(message(b"OFF\n"), "PLY header, line 1: this is not a PLY file");
    assert_eq!(message(b"ply\nformat ascii 1.0\n"), "PLY header, line 3: there is no `end_header`");
    assert_eq!(message(b"ply\nend_header\n"), "PLY header, line 2: there is no `format`");
    assert_eq!(message(b"ply\nformat text 1.0\n"), "PLY header, line 2: unknown format `text`");
    assert_eq!(message(b"ply\nproperty float x\n"), "PLY header, line 2: a property before any element");
    assert_eq!(message(b"ply\nelement vertex -1\n"), "PLY header, line 2: `-1` is not a count");
    assert_eq!(
        message(b"ply\nelement vertex 1\nproperty quaternion x\n"),
        "PLY header, line 3: unknown type `quaternion`"
    );
    assert_eq!(
        message(&ascii("0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 4\n")),
        "face 1 uses vertex 4, but there are only 4 vertices"
    );
    assert_eq!(
        message(&ascii("0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 -1\n")),
        "face 1 uses vertex -1, but there are only 4 vertices"
    );
    assert_eq!(
        message(&ascii("0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n2 0 2\n")),
        "face 1 has 2 corners; only triangles and quadrilaterals are supported"
    );
    assert_eq!(
        message(&ascii("0 0 0\n1 nan 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n")),
        "vertex 1 has a coordinate that is not a finite number"
    );
    assert_eq!(
        message(&ascii("0 0 0\n1 zero 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n")),
        "vertex 1: `zero` is not a number"
    );
    assert_eq!(read(Path::new("/nowhere.ply")).unwrap_err().to_string(), "no such file");
}
