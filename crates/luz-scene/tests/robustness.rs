//! Whatever the bytes are, reading ends soon, in a description or in errors.

use luz_scene::ReadOptions;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::path::Path;

/// Something of everything.
const SCENE: &str = r#"
Option "seed" 3
LookAt 0 1 2.35  0 1 0  0 1 0
Camera "perspective" "float fov" [90]
ColorSpace "rec2020"
Film "rgb" "integer xresolution" [800] "string filename" "a.exr"
Sampler "halton" "integer pixelsamples" [256]
MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_a" [1 2 3]
WorldBegin # comment [ " ]
Attribute "shape" "float radius" 2
AttributeBegin
  CoordSysTransform "camera" ActiveTransform StartTime Rotate 30 0 1 0 ActiveTransform All
  MakeNamedMaterial "m" "string type" "diffuse" "spectrum reflectance" [400 1 500 .5]
  Texture "t" "float" "scale" "float tex" 0.25
  Material "mix" "string materials" ["m" "m"] "texture amount" "t"
  AreaLightSource "diffuse" "blackbody L" 6500 "bool twosided" true
  MediumInterface "fog" "" ReverseOrientation
  Shape "trianglemesh" "point3 P" [ 0 0 0 1 0 0 1e0 1 .5 ] "integer indices" [ 0 1 2 ]
AttributeEnd
ObjectBegin "o" Transform [1 0 0 0  0 1 0 0  0 0 1 0  1 2 3 1] Shape "sphere" ObjectEnd
ObjectInstance "o"
LightSource "point" "rgb I" [1 1 1] "point3 from" [0 0 0]
Import "no such file" Include "none.pbrt"
"#;

fn read(bytes: &[u8]) {
    let result = luz_scene::read_bytes("scene.pbrt", bytes.to_vec(), Path::new("/nowhere"), &ReadOptions::default());
    match result {
        // All places must be good for a rendering.
        Ok((scene, warnings)) => drop(warnings.render(&scene.sources)),
        Err(errors) => {
            assert!(errors.diagnostics.has_errors());
            assert!(!errors.to_string().is_empty());
        }
    }
}

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    property list uchar int extra\nelement face 2\nproperty list uchar int vertex_indices\nproperty int face_indices\n\
    end_header\n0 0 0 1 5\n1 0 0 0\n0 1 0 2 1 2\n3 0 1 2 7\n4 0 1 2 1 8\n";

/// Pieces of scenes, to be shuffled.
fn piece() -> impl Strategy<Value = String> {
    let words: Vec<&str> = SCENE.split_whitespace().chain(["[", "]", "\"", "#", "\n", "-1e99", "WorldEnd"]).collect();
    prop_oneof![
        4 => proptest::sample::select(words).prop_map(|word| format!("{word} ")),
        1 => "\"[a-z]{1,4} [a-zA-Z]{1,4}\" ",
        1 => any::<f64>().prop_map(|x| format!("{x:?} ")),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, rng_seed: RngSeed::Fixed(1), ..Default::default() })]

    #[test]
    fn any_bytes(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        read(&bytes);
        let _ = luz_scene::ply::parse(&bytes);
        let _ = luz_scene::spd::parse(&bytes);
    }

    #[test]
    fn any_order_of_words(pieces in proptest::collection::vec(piece(), 0..80)) {
        read(pieces.concat().as_bytes());
        read(("WorldBegin ".to_owned() + &pieces.concat()).as_bytes());
    }

    #[test]
    fn scenes_with_changed_bytes(
        changes in proptest::collection::vec((0..SCENE.len(), any::<u8>()), 1..8),
        cut in 0..2 * SCENE.len(),
    ) {
        let mut bytes = SCENE.as_bytes().to_vec();
        changes.iter().for_each(|(at, byte)| bytes[*at] = *byte);
        bytes.truncate(cut);
        read(&bytes);
    }

    #[test]
    fn meshes_with_changed_bytes(
        changes in proptest::collection::vec((0..PLY.len(), any::<u8>()), 0..8),
        binary in any::<bool>(),
        cut in 0..2 * PLY.len(),
    ) {
        let text = if binary { PLY.replace("ascii", "binary_little_endian") } else { PLY.to_owned() };
        let mut bytes = text.into_bytes();
        changes.iter().for_each(|(at, byte)| bytes[*at] = *byte);
        bytes.truncate(cut);
        if let Ok(mesh) = luz_scene::ply::parse(&bytes) {
            let corners = mesh.triangles.as_flattened().iter().chain(mesh.quads.as_flattened());
            prop_assert!(corners.max().is_some_and(|corner| (*corner as usize) < mesh.positions.len()));
            prop_assert!(mesh.normals.is_empty() || mesh.normals.len() == mesh.positions.len());
        }
    }
}

/// Inputs that make careless readers slow or deep: each must end within the test's patience.
#[test]
fn hostile_scenes_end() {
    let repeat = |text: &str, count: usize| "WorldBegin\n".to_owned() + &text.repeat(count);
    let chain = |count: usize, used: fn(usize) -> usize| {
        let texture = |i| format!("Texture \"{i}\" \"float\" \"scale\" \"texture tex\" \"{}\"\n", used(i));
        let ends =
            format!("WorldBegin Texture \"0\" \"float\" \"constant\" Texture \"{count}\" \"float\" \"constant\"\n");
        ends + &(1..count).map(texture).collect::<String>()
    };
    let long_name = "a".repeat(1 << 20);
    for text in [
        repeat("AttributeBegin ", 200_000),
        repeat("ObjectBegin \"a\" ", 100_000),
        repeat("[ ", 500_000),
        repeat("\" ", 500_000),
        repeat("\"\n", 200_000),
        repeat("Attribute \"shape\" \"float radius\" 1 AttributeBegin ", 20_000),
        repeat("Shape \"sphere\" \"float radius\" [ ", 50_000),
        repeat("NamedMaterial \"a\" ", 100_000),
        format!("WorldBegin Shape \"sphere\" {}", "\"float x\" 1 ".repeat(100_000)),
        format!("WorldBegin Shape \"trianglemesh\" \"point3 P\" [{}]", "0 ".repeat(3_000_000)),
        format!("WorldBegin Shape \"{long_name}\" \"float {long_name}\" 1 {long_name} {}", "9".repeat(1 << 20)),
        format!("WorldBegin Translate {} 0.{} 1e{}", "9".repeat(1 << 20), "0".repeat(1 << 20), "9".repeat(1 << 20)),
        // Textures that use the one before them: a chain as long as the file. And the other way round.
        chain(50_000, |i| i - 1),
        chain(50_000, |i| i + 1),
    ] {
        read(text.as_bytes());
    }
}
