use super::support::{BALL, Folder};

#[test]
fn a_scene_is_described() {
    let folder = Folder::with_scene(BALL);
    let said = folder.run("info scene.pbrt").ends_with(0).stdout;
    for part in ["perspective", "16 × 12", "sobol, 4 samples", "2 sphere", "1 area", "1 infinite", "diffuse", "yes"] {
        assert!(said.contains(part), "`{part}` is not in:\n{said}");
    }
    assert_eq!(folder.files(), ["scene.pbrt"]);
}

#[test]
fn json_has_the_same() {
    let scene = format!(
        "{BALL}\nObjectBegin \"o\"\nShape \"trianglemesh\" \"point3 P\" [ 0 0 0  1 0 0  0 1 0  1 1 0 ] \
         \"integer indices\" [ 0 1 2 2 1 3 ]\nObjectEnd\nObjectInstance \"o\"\nTranslate 2 0 0\nObjectInstance \"o\"\n"
    );
    let folder = Folder::with_scene(&scene);
    let said = folder.run("info scene.pbrt --json").ends_with(0);
    let info: serde_json::Value = serde_json::from_str(&said.stdout).unwrap();
    assert_eq!(info["renderable"], true);
    assert_eq!(info["triangles"], 2);
    assert_eq!(info["instanced_triangles"], 4);
    assert_eq!(info["instances"], 2);
    assert_eq!(info["shapes"]["sphere"], 2);
    assert_eq!(info["lights"]["area"], 1);
    assert_eq!(info["samples_per_pixel"], 4);
    assert!(info["memory"]["hierarchy"].as_u64().unwrap() > 0);
    assert!(info["problems"].as_array().unwrap().is_empty());
}

#[test]
fn what_cannot_be_rendered_is_listed_with_its_place() {
    let scene = format!("{BALL}\nMaterial \"hair\"\nShape \"curve\" \"point3 P\" [ 0 0 0 1 0 0 1 1 0 0 1 0 ]\n");
    let folder = Folder::with_scene(&scene);
    let said =
        folder.run("info scene.pbrt").ends_with(3).complains(&["hair", "curve", "scene.pbrt:18:", "scene.pbrt:19:"]);
    assert!(said.stdout.contains("2 reasons"), "{}", said.stdout);
    let said = folder.run("info scene.pbrt --json").ends_with(3);
    let info: serde_json::Value = serde_json::from_str(&said.stdout).unwrap();
    assert_eq!(info["renderable"], false);
    let lines: Vec<_> = info["problems"].as_array().unwrap().iter().map(|p| p["line"].as_u64().unwrap()).collect();
    assert_eq!(lines, [18, 19]);
    folder.run("render scene.pbrt").ends_with(3).complains(&["hair", "curve", "nothing was rendered"]);
    assert_eq!(folder.files(), ["scene.pbrt"]);
}
