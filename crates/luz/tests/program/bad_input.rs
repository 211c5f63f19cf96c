use super::support::{BALL, Folder};

#[test]
fn all_missing_files_are_listed_at_once_and_nothing_is_written() {
    let scene = format!(
        "{BALL}\nTexture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"missing.png\"\n\
         Material \"diffuse\" \"texture reflectance\" \"t\"\n\
         Shape \"plymesh\" \"string filename\" \"missing.ply\"\n\
         LightSource \"infinite\" \"string filename\" \"missing.exr\"\n\
         Include \"missing.pbrt\"\n"
    );
    let folder = Folder::with_scene(&scene);
    folder.run("render scene.pbrt").ends_with(3).complains(&[
        "missing.png",
        "missing.ply",
        "missing.exr",
        "missing.pbrt",
        "scene.pbrt:18:",
        "scene.pbrt:22:",
    ]);
    assert_eq!(folder.files(), ["scene.pbrt"]);
}

#[test]
fn a_missing_scene_is_named() {
    let folder = Folder::new();
    folder.run("render nowhere.pbrt").ends_with(3).complains(&["nowhere.pbrt", "no such file"]);
    folder.run("info nowhere.pbrt").ends_with(3).complains(&["nowhere.pbrt"]);
    folder.run("render .").ends_with(3);
    assert!(folder.files().is_empty());
}

#[test]
fn misspelt_parameters_are_answered_with_what_was_meant() {
    let folder = Folder::with_scene(&BALL.replace("reflectance", "reflectence"));
    folder.run("render scene.pbrt").ends_with(3).complains(&["reflectence", "did you mean `reflectance`?"]);
    let folder = Folder::with_scene(&BALL.replace("\"diffuse\" \"rgb refl", "\"difuse\" \"rgb refl"));
    folder.run("render scene.pbrt").ends_with(3).complains(&["difuse", "did you mean `diffuse`?"]);
}

#[test]
fn outputs_are_checked_before_the_work() {
    let folder = Folder::with_scene(&BALL.replace("pixelsamples\" 4", "pixelsamples\" 100000000"));
    folder.run("render scene.pbrt -o no/a.exr -o nowhere/b.png --report none/c.json").ends_with(4).complains(&[
        "no/a.exr",
        "nowhere/b.png",
        "none/c.json",
        "there is no folder",
    ]);
    std::fs::create_dir(folder.path().join("ball.exr")).unwrap();
    folder.run("render scene.pbrt").ends_with(4).complains(&["ball.exr", "it is a folder"]);
}

#[test]
fn a_film_that_no_memory_holds_is_refused() {
    let folder = Folder::with_scene(BALL);
    folder.run("render scene.pbrt --resolution 65536x65536").ends_with(3).complains(&["65536×65536 pixels", "GB"]);
    assert_eq!(folder.files(), ["scene.pbrt"]);
}

/// Scenes that are broken, odd or hostile. Each must end in a picture (0) or in a complaint about the scene (3), soon.
#[test]
fn nothing_in_a_scene_makes_the_program_panic() {
    let film = "Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 3\nSampler \"independent\" \
                \"integer pixelsamples\" 2\n";
    let world = |body: &str| format!("{film}WorldBegin\nLightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\n{body}\n");
    let lamp = |shape: &str| world(&format!("AreaLightSource \"diffuse\" \"rgb L\" [ 1 1 1 ]\n{shape}"));
    let triangle = |p: &str| format!("Shape \"trianglemesh\" \"point3 P\" [ {p} ] \"integer indices\" [ 0 1 2 ]");
    let scenes = [
        String::new(),
        "WorldBegin".to_owned(),
        "\0\0\0\0".to_owned(),
        "Film".to_owned(),
        "Film \"rgb\" [".to_owned(),
        "\"".to_owned(),
        "AttributeBegin ".repeat(100_000),
        "[ ".repeat(100_000),
        "Include \"scene.pbrt\"".to_owned(),
        world("Include \"scene.pbrt\""),
        world("Scale 0 0 0 Shape \"sphere\""),
        world("Scale 1e-30 1e-30 1e-30 Shape \"sphere\""),
        world("Scale 1e30 1e30 1e30 Shape \"sphere\""),
        world("Transform [ 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 ] Shape \"sphere\""),
        world("Shape \"sphere\" \"float radius\" -1"),
        world("Shape \"sphere\" \"float radius\" 0"),
        world("Shape \"sphere\" \"float radius\" nan"),
        world("Shape \"sphere\" \"float zmin\" 1 \"float zmax\" -1"),
        world(&triangle("nan 0 5  1 0 5  0 1 5")),
        world(&triangle("inf 0 5  1 0 5  0 1 5")),
        world(&triangle("1e39 0 5  1 0 5  0 1 5")),
        world(&triangle("0 0 5  0 0 5  0 0 5")),
        world("Shape \"trianglemesh\" \"point3 P\" [ 0 0 5  1 0 5  0 1 5 ] \"integer indices\" [ 0 1 7 ]"),
        world("Shape \"trianglemesh\" \"point3 P\" [ 0 0 5  1 0 5  0 1 5 ] \"integer indices\" [ 0 1 -1 ]"),
        world("Shape \"trianglemesh\""),
        world("Shape \"bilinearmesh\" \"point3 P\" [ 0 0 5  0 0 5  0 0 5  0 0 5 ]"),
        world("Shape \"disk\" \"float radius\" 0"),
        world(
            "Shape \"loopsubdiv\" \"integer levels\" 2000000000 \"point3 P\" [ 0 0 5  1 0 5  0 1 5 ] \"integer indices\" [ 0 1 2 ]",
        ),
        world("LightSource \"infinite\" \"rgb L\" [ 0 0 0 ]"),
        world("LightSource \"point\" \"float scale\" nan"),
        world("LightSource \"point\" \"float scale\" inf"),
        world("LightSource \"distant\" \"point3 from\" [ 0 0 0 ] \"point3 to\" [ 0 0 0 ]"),
        world("LightSource \"spot\" \"float coneangle\" -5"),
        world("LightSource \"infinite\" \"rgb L\" [ -1 -1 -1 ]"),
        world("Material \"dielectric\" \"float eta\" 0\nTranslate 0 0 5 Shape \"sphere\""),
        world("Material \"dielectric\" \"float eta\" 1 \"float roughness\" -1\nTranslate 0 0 5 Shape \"sphere\""),
        world("Material \"conductor\" \"float roughness\" nan\nTranslate 0 0 5 Shape \"sphere\""),
        world("Material \"diffuse\" \"rgb reflectance\" [ 5 5 5 ]\nTranslate 0 0 5 Shape \"sphere\""),
        world("Material \"mix\"\nTranslate 0 0 5 Shape \"sphere\""),
        world("NamedMaterial \"nobody\" Shape \"sphere\""),
        lamp(&triangle("0 0 5  0 0 5  0 0 5")),
        lamp(&triangle("nan 0 5  1 0 5  0 1 5")),
        lamp("Scale 1e-25 1e-25 1e-25 Shape \"sphere\""),
        lamp("Shape \"sphere\" \"float radius\" 1e20"),
        "Film \"rgb\" \"integer xresolution\" -5\nWorldBegin".to_owned(),
        "Film \"rgb\" \"integer xresolution\" 2000000000 \"integer yresolution\" 2000000000\nWorldBegin".to_owned(),
        format!("{film}Camera \"perspective\" \"float fov\" 0\nWorldBegin"),
        format!("{film}Camera \"perspective\" \"float fov\" 180\nWorldBegin"),
        format!("{film}Camera \"perspective\" \"float lensradius\" 1e30 \"float focaldistance\" 0\nWorldBegin"),
        format!("{film}LookAt 0 0 0  0 0 0  0 0 0\nWorldBegin"),
        format!("{film}LookAt 0 0 0  0 1 0  0 1 0\nWorldBegin"),
        format!("{film}Camera \"perspective\" \"float shutteropen\" 1 \"float shutterclose\" 0\nWorldBegin"),
        format!("{film}PixelFilter \"gaussian\" \"float xradius\" 0\nWorldBegin"),
        format!("{film}PixelFilter \"gaussian\" \"float sigma\" 1e-30\nWorldBegin"),
        format!("{film}Integrator \"path\" \"integer maxdepth\" -1\nWorldBegin"),
        "Sampler \"independent\" \"integer pixelsamples\" 0\nWorldBegin".to_owned(),
        "Film \"rgb\" \"float maxcomponentvalue\" -1\nWorldBegin".to_owned(),
        "Film \"rgb\" \"float cropwindow\" [ 1 0 1 0 ] \nWorldBegin".to_owned(),
    ];
    for scene in scenes {
        let folder = Folder::with_scene(&scene);
        let said = folder.run("render scene.pbrt --spp 2 -o a.exr");
        let shown = &scene[..scene.len().min(300)];
        assert!(matches!(said.code, Some(0 | 3)), "{:?} of\n{shown}\n{}", said.code, said.stderr);
        if said.code == Some(0) {
            let image = folder.image("a.exr");
            assert!(image.data().iter().all(|v| v.is_finite()), "{shown}");
        } else {
            assert!(said.stderr.contains("error: "), "{shown}\n{}", said.stderr);
            assert_eq!(folder.files(), ["scene.pbrt"]);
        }
    }
}

#[test]
fn truncated_scenes_are_answered() {
    for end in (0..BALL.len()).step_by(23) {
        let folder = Folder::with_scene(&BALL[..end]);
        let said = folder.run("info scene.pbrt");
        assert!(matches!(said.code, Some(0 | 3)), "{:?} of\n{}\n{}", said.code, &BALL[..end], said.stderr);
    }
}

#[test]
fn a_black_environment_map_gives_a_black_picture() {
    let folder = Folder::with_scene(
        "Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 3\nWorldBegin\n\
         LightSource \"infinite\" \"string filename\" \"black.pfm\"\nTranslate 0 0 5 Shape \"sphere\"\n",
    );
    folder.write("black.pfm", [b"PF\n4 4\n-1.0\n".as_slice(), &[0; 4 * 4 * 3 * 4]].concat());
    folder.run("render scene.pbrt --spp 2 -o a.exr").ends_with(0).complains(&["warning"]);
    let image = folder.image("a.exr");
    let [r, ..] = image.rgb().unwrap();
    assert_eq!(image.pixel(1, 1)[r], 0.0);
}
