//! Scenes of several files.

use flate2::{Compression, write::GzEncoder};
use luz_scene::{Limits, ReadOptions, SpectrumParameter};
use std::io::Write;
use std::path::Path;
use tempfile::TempDir;

/// A directory with these files.
fn directory(files: &[(&str, &str)]) -> TempDir {
    let directory = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = directory.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    directory
}

/// What is said about `scene.pbrt` in a directory, with the directory's name taken out.
fn report(directory: &TempDir, options: &ReadOptions) -> String {
    let text = match luz_scene::read_with(directory.path().join("scene.pbrt"), options) {
        Ok((scene, warnings)) => format!("read\n{}", warnings.render(&scene.sources)),
        Err(errors) => errors.to_string(),
    };
    text.replace(&format!("{}/", directory.path().display()), "")
}

fn snapshot(name: &str, directory: &TempDir) {
    let text = report(directory, &ReadOptions::default());
    insta::with_settings!({ omit_expression => true }, { insta::assert_snapshot!(name, text) });
}

const TRIANGLE: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

#[test]
fn includes_are_relative_to_the_scene_and_may_be_packed() {
    let directory = directory(&[
        ("scene.pbrt", "WorldBegin\nInclude \"parts/a.pbrt\"\nAttributeEnd\nShape \"sphere\" \"float radius\" 3"),
        ("parts/a.pbrt", "AttributeBegin Translate 1 0 0\nInclude \"parts/b.pbrt.gz\"\n  \"float radius\" 2"),
        ("mesh.ply", TRIANGLE),
        ("a.spd", "400 1\n700 2"),
    ]);
    let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
    packed
        .write_all(
            b"Shape \"plymesh\" \"string filename\" \"mesh.ply\"\nShape \"plymesh\" \"string filename\" \"./mesh.ply\"\n\
            Material \"conductor\" \"spectrum eta\" \"a.spd\" \"spectrum k\" \"metal-Cu-k\"\nShape \"sphere\"",
        )
        .unwrap();
    std::fs::write(directory.path().join("parts/b.pbrt.gz"), packed.finish().unwrap()).unwrap();
    let (scene, warnings) = luz_scene::read(directory.path().join("scene.pbrt")).unwrap();
    assert!(warnings.is_empty());
    assert_eq!(scene.shapes.len(), 4);
    let [first, second, third, last] = scene.shapes.as_slice() else { panic!() };
    // Both names mean one file, which is loaded once.
    let (a, b) = (first.mesh.as_ref().unwrap(), second.mesh.as_ref().unwrap());
    assert!(std::sync::Arc::ptr_eq(a, b) && a.triangles == [[0, 1, 2]]);
    // The parameters of a directive may go on in the file that includes it.
    let mut d = luz_scene::Diagnostics::default();
    assert_eq!(third.entity.parameters.one_float("radius", 0.0, &mut d), 2.0);
    assert_eq!(third.world_from_object.start.w_axis.x, 1.0);
    assert_eq!(last.world_from_object.start.w_axis.x, 0.0);
    let conductor = &scene.materials[third.material].entity.parameters;
    let Some(SpectrumParameter::File { samples, .. }) = conductor.spectrum("eta", &mut d) else { panic!() };
    assert_eq!(&**samples, [(400.0, 1.0), (700.0, 2.0)]);
    assert_eq!(conductor.spectrum("k", &mut d), Some(&SpectrumParameter::Named("metal-Cu-k".into())));
    assert_eq!(scene.sources.files().len(), 3);
}

#[test]
fn imports_leave_the_state_alone() {
    let directory = directory(&[
        (
            "scene.pbrt",
            "WorldBegin\nTranslate 1 0 0\nImport \"a.pbrt\"\nShape \"sphere\"\nNamedMaterial \"m\"\nShape \"sphere\"\n\
            ObjectBegin \"o\"\nImport \"a2.pbrt\"\nObjectEnd\nObjectInstance \"o\"",
        ),
        (
            "a.pbrt",
            "Translate 0 2 0\nMakeNamedMaterial \"m\" \"string type\" \"dielectric\"\nNamedMaterial \"m\"\nShape \"disk\"",
        ),
        ("a2.pbrt", "Shape \"disk\" AttributeBegin Shape \"cylinder\" AttributeEnd"),
    ]);
    let (scene, warnings) = luz_scene::read(directory.path().join("scene.pbrt")).unwrap();
    assert!(warnings.is_empty());
    let kinds: Vec<_> = scene.shapes.iter().map(|s| (&*s.entity.kind, s.material)).collect();
    assert_eq!(kinds, [("disk", 1), ("sphere", 0), ("sphere", 1)]);
    assert_eq!(scene.shapes[0].world_from_object.start.w_axis.truncate(), glam::Vec3::new(1.0, 2.0, 0.0));
    assert_eq!(scene.shapes[1].world_from_object.start.w_axis.truncate(), glam::Vec3::new(1.0, 0.0, 0.0));
    assert_eq!(scene.objects[0].shapes.len(), 2);
}

#[test]
fn errors_in_included_files_name_the_chain() {
    let directory = directory(&[
        ("scene.pbrt", "WorldBegin\nInclude \"a.pbrt\"\nImport \"c.pbrt\""),
        ("a.pbrt", "\n  Include \"b.pbrt\""),
        ("b.pbrt", "Shape \"sphere\" \"float radios\" 1\n"),
        ("c.pbrt", "AttributeEnd\nAttributeBegin\nObjectEnd\n"),
    ]);
    snapshot("include_chain", &directory);
}

#[test]
fn files_that_include_themselves() {
    let directory = directory(&[
        ("scene.pbrt", "WorldBegin\nInclude \"a.pbrt\"\nShape \"spher\""),
        ("a.pbrt", "Include \"b.pbrt\"\n"),
        ("b.pbrt", "Import \"./a.pbrt\"\nInclude \"scene.pbrt\""),
    ]);
    snapshot("includes_itself", &directory);
}

#[test]
fn all_missing_files_are_listed_at_once() {
    let directory = directory(&[
        (
            "scene.pbrt",
            "WorldBegin\nInclude \"no.pbrt\"\nImport \"no.pbrt.gz\"\nShape \"plymesh\" \"string filename\" \"no.ply\"\n\
            Texture \"t\" \"float\" \"imagemap\" \"string filename\" \"no.png\"\nMaterial \"conductor\" \"spectrum k\" \"no.spd\"\n\
            Material \"diffuse\" \"string normalmap\" \"normal.png\"\nLightSource \"infinite\" \"string filename\" \"no.exr\"\n\
            Shape \"plymesh\" \"string filename\" \"bad.ply\"",
        ),
        ("normal.png", ""),
        ("bad.ply", "OFF\n"),
    ]);
    snapshot("all_missing_files", &directory);
    // Contents are looked at when nothing is missing.
    let scene = "WorldBegin\nShape \"plymesh\" \"string filename\" \"bad.ply\"\nShape \"plymesh\" \"string filename\" \"bad2.ply\"";
    std::fs::write(directory.path().join("scene.pbrt"), scene).unwrap();
    std::fs::write(directory.path().join("bad2.ply"), TRIANGLE.replace("3 0 1 2", "3 0 1 7")).unwrap();
    snapshot("bad_meshes", &directory);
    let without = ReadOptions { load_meshes: false, ..Default::default() };
    assert_eq!(report(&directory, &without), "read\n");
}

#[test]
fn a_missing_scene_is_an_error() {
    let errors = luz_scene::read("/nowhere/scene.pbrt").unwrap_err();
    assert_eq!(errors.to_string(), "error: /nowhere/scene.pbrt: no such file");
    let errors = luz_scene::read(std::env::temp_dir()).unwrap_err();
    assert!(errors.to_string().ends_with("is a directory"));
}

/// Include files that double at every level: 2⁶⁰ of them, were there no limit.
#[test]
fn include_bombs_are_stopped() {
    let files: Vec<(String, String)> = (0..60)
        .map(|i| (format!("{i}.pbrt"), format!("Include \"{}.pbrt\"\nInclude \"{}.pbrt\"\n", i + 1, i + 1)))
        .chain([("60.pbrt".into(), String::new()), ("scene.pbrt".into(), "WorldBegin Include \"0.pbrt\"".into())])
        .collect();
    let files: Vec<(&str, &str)> = files.iter().map(|(a, b)| (a.as_str(), b.as_str())).collect();
    let directory = directory(&files);
    let limits = Limits { files: 1000, ..Limits::default() };
    let errors = luz_scene::read_with(directory.path().join("scene.pbrt"), &ReadOptions { limits, load_meshes: true });
    let errors = errors.unwrap_err().diagnostics;
    assert_eq!(errors.error_count(), 1);
    assert!(errors.iter().all(|d| d.message.starts_with("the scene is too large: more than 1000 files")));
    let limits = Limits { include_depth: 10, files: 5000, ..Limits::default() };
    let errors = luz_scene::read_with(directory.path().join("scene.pbrt"), &ReadOptions { limits, load_meshes: true });
    let errors = errors.unwrap_err().diagnostics;
    assert_eq!(errors.error_count(), 1 << 9);
    assert!(errors.iter().all(|d| d.message == "files include each other more than 10 levels deep"));
}

#[test]
fn oversized_files_are_refused() {
    let directory = directory(&[(
        "scene.pbrt",
        "WorldBegin\nInclude \"bomb.pbrt.gz\"\nShape \"plymesh\" \"string filename\" \"a.ply\"",
    )]);
    let mut packed = GzEncoder::new(Vec::new(), Compression::best());
    let zeros = vec![b' '; 1 << 20];
    (0..64).for_each(|_| packed.write_all(&zeros).unwrap());
    let packed = packed.finish().unwrap();
    assert!(packed.len() < 100_000);
    std::fs::write(directory.path().join("bomb.pbrt.gz"), &packed).unwrap();
    std::fs::write(directory.path().join("a.ply"), &packed).unwrap();
    let limits = Limits { file_bytes: 1 << 20, ..Limits::default() };
    let text = report(&directory, &ReadOptions { limits, load_meshes: true });
    assert!(text.contains("`bomb.pbrt.gz`: is larger than the limit of 1048576 bytes"), "{text}");
    std::fs::write(directory.path().join("scene.pbrt"), "WorldBegin\nShape \"plymesh\" \"string filename\" \"a.ply\"")
        .unwrap();
    let text = report(&directory, &ReadOptions { limits, load_meshes: true });
    assert!(text.contains("`a.ply`: is larger than the limit of 1048576 bytes"), "{text}");
}

/// Lines of big files are read again when a diagnostic needs them.
#[test]
fn diagnostics_in_big_files_show_their_line() {
    let text = "WorldBegin\n".to_owned() + &"# filler\n".repeat(600_000) + "Shape \"spere\"\n";
    let directory = directory(&[("scene.pbrt", &text)]);
    let errors = luz_scene::read(directory.path().join("scene.pbrt")).unwrap_err();
    assert!(errors.sources.files()[0].text.is_none());
    let text = errors.to_string();
    assert!(text.contains(":600002:8: error: unknown shape `spere`\n    Shape \"spere\"\n           ^^^^^"), "{text}");
    assert_eq!(
        luz_scene::Description::resolve(&luz_scene::read_str("", "WorldBegin").unwrap().0, "a/b"),
        Path::new("a/b")
    );
}
