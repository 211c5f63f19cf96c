//! What people are told about broken scenes. The texts are snapshots under `tests/snapshots`; after a change that is
//! meant, `INSTA_UPDATE=always cargo test -p luz-scene` writes them anew, to be read before they are committed.

use std::path::Path;

/// All that is said about a scene, errors or warnings.
fn report(text: &[u8]) -> String {
    match luz_scene::read_bytes("scene.pbrt", text.to_vec(), Path::new(""), &Default::default()) {
        Ok((scene, warnings)) => format!("read\n{}", warnings.render(&scene.sources)),
        Err(errors) => errors.to_string(),
    }
}

/// As [`report`], for statements in the world block.
fn world(text: &str) -> String {
    report(format!("WorldBegin\n{text}").as_bytes())
}

macro_rules! snapshot {
    ($name:ident, $report:expr) => {
        #[test]
        fn $name() {
            insta::with_settings!({ omit_expression => true }, { insta::assert_snapshot!(stringify!($name), $report) });
        }
    };
}

snapshot!(unknown_parameter, world(r#"Material "diffuse" "rgb reflectence" [.5 .5 .5]"#));
snapshot!(unknown_kind, world("Shape \"spere\"\nLightSource \"ambient\"\nMaterial \"gold\""));
snapshot!(
    unknown_directive,
    world("Shap \"sphere\"\n  \"float radius\" 1\nShape \"sphere\" \"float radius\" 1\nshape 1 2 3")
);
snapshot!(wrong_type, world(r#"Shape "sphere" "integer radius" 1 "string zmin" "0" "texture alpha" "none""#));
snapshot!(
    wrong_count,
    world(
        "Shape \"sphere\" \"float radius\" [1 2]\nShape \"trianglemesh\" \"point3 P\" [1 2 3 4]\nMaterial \"mix\" \"string materials\" \"a\""
    )
);
snapshot!(
    missing_required,
    world("Shape \"plymesh\"\nMakeNamedMaterial \"a\" \"rgb reflectance\" [0 0 0]\nMakeNamedMedium \"m\"")
);
snapshot!(twice, world("Shape \"sphere\" \"float radius\" 1\n \"float radius\" 2"));
snapshot!(
    defined_twice,
    world(
        "MakeNamedMaterial \"a\" \"string type\" \"diffuse\"\nMakeNamedMaterial \"a\" \"string type\" \"diffuse\"\n\
    Texture \"t\" \"float\" \"constant\"\nTexture \"t\" \"spectrum\" \"constant\"\nTexture \"t\" \"float\" \"constant\"\n\
    MakeNamedMedium \"m\" \"string type\" \"homogeneous\"\nMakeNamedMedium \"m\" \"string type\" \"homogeneous\"\n\
    ObjectBegin \"o\"\nObjectEnd\nObjectBegin \"o\"\nShape \"sphere\"\nObjectEnd"
    )
);
snapshot!(
    undefined_names,
    world(
        "NamedMaterial \"wod\"\nMakeNamedMaterial \"wood\" \"string type\" \"diffuse\" \"texture reflectance\" \"t\"\n\
    Texture \"t\" \"float\" \"constant\"\nObjectInstance \"tree\"\nMediumInterface \"fog\" \"\"\nShape \"sphere\" \"texture alpha\" \"tt\"\n\
    Material \"mix\" \"string materials\" [\"wood\" \"woood\"]\nCoordSysTransform \"wrld\""
    )
);
snapshot!(
    uses_itself,
    world(
        "Texture \"a\" \"float\" \"scale\" \"texture tex\" \"b\"\nTexture \"b\" \"float\" \"scale\" \"texture tex\" \"a\"\n\
    MakeNamedMaterial \"m\" \"string type\" \"mix\" \"string materials\" [\"m\" \"m\"]"
    )
);
snapshot!(
    bad_numbers,
    world(
        "Translate 1 x 3\nScale 1 2\nRotate nan 0 0 1\nShape \"sphere\" \"float radius\" [1e999]\n\
    Shape \"sphere\" \"float radius\" [ 1.2.3 ] \"float zmin\" inf\n\
    Shape \"trianglemesh\" \"integer indices\" [0 1 2.0 3] \"point3 P\" [0 0 0 1 0 0 1 1 0]\n\
    Shape \"trianglemesh\" \"integer indices\" [0 1 99999999999] \"point3 P\" [0 0 0 1 0 0 1 1 0]\n\
    Shape \"sphere\" \"float radius\" \"3\" \"float zmin\" true"
    )
);
snapshot!(
    unclosed_list,
    world(
        "Shape \"sphere\" \"float radius\" [ 1\n  \"float zmin\" -1\nShape \"disk\" \"float radius\" [ 1\nShape \"disk\" \"string x\" [ \"a\""
    )
);
snapshot!(nested_lists, world("Shape \"sphere\" \"float radius\" [ [ 1 ] ]\nShape \"sphere\" \"float radius\" ]"));
snapshot!(
    missing_value,
    world(
        "Shape \"sphere\" \"float radius\"\nShape \"sphere\" \"float radius\" []\nShape \"sphere\" \"float radius\" \"float zmin\" 1\nShape \"sphere\" \"float zmax\""
    )
);
snapshot!(
    bad_declarations,
    world("Shape \"sphere\" \"radius\" 1 \"\" 2 \"float\" 3 \"flaot zmin\" 4 \"float zmax now\" 5")
);
snapshot!(open_string, world("Shape \"sphere\nShape \"sphere\" \"float radius\" 1\nShape \"disk\" \"float radi"));
snapshot!(bad_strings, report(b"WorldBegin\nMaterial \"a\\q\"\nMaterial \"caf\xe9\"\nMaterial \"a\0b\""));
snapshot!(garbage, report(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"));
snapshot!(utf16, report(b"\xff\xfeW\0o\0r\0l\0d\0"));
snapshot!(empty, report(b""));
snapshot!(only_a_comment, report(b"# nothing to see"));
snapshot!(no_world, report(b"Camera \"perspective\""));
snapshot!(
    world_before_begin,
    report(b"Shape \"sphere\"\nLightSource \"point\"\nWorldBegin\nCamera \"perspective\"\nFilm \"rgb\"\nWorldBegin")
);
snapshot!(
    unbalanced,
    world(
        "AttributeEnd\nAttributeBegin\nObjectBegin \"a\"\nAttributeBegin\nObjectEnd\nObjectEnd\nObjectBegin \"b\"\nAttributeEnd\nObjectBegin \"c\"\nObjectInstance \"a\""
    )
);
snapshot!(
    transformations,
    world(
        "Scale 1 0 1\nRotate 90 0 0 0\nLookAt 0 0 0  0 0 0  0 1 0\nLookAt 0 0 0  0 1 0  0 1 0\nTransform [1 0 0 0 0 1 0 0 0 0 1 0]\n\
    Transform [1 0 0 0  0 1 0 0  1 1 0 0  0 0 0 1]\nScale 1e30 1e30 1e30\nScale 1e30 1e30 1e30\nActiveTransform Some"
    )
);
snapshot!(
    spectra,
    world(
        "Material \"diffuse\" \"rgb reflectance\" [1 0]\nMaterial \"diffuse\" \"rgb reflectance\" [1 0 -1]\n\
    Material \"diffuse\" \"spectrum reflectance\" [400 1 500]\nMaterial \"diffuse\" \"spectrum reflectance\" [400 1 400 2]\n\
    Material \"conductor\" \"spectrum eta\" \"metal-Au-etta\"\nMaterial \"conductor\" \"spectrum eta\" \"missing.spd\"\n\
    LightSource \"point\" \"blackbody I\" 0\nColorSpace \"adobe\"\nColorSpace \"rec2002\""
    )
);
snapshot!(
    missing_files,
    world(
        "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"missing.png\"\nShape \"plymesh\" \"string filename\" \"missing.ply\"\n\
    LightSource \"infinite\" \"string filename\" \"missing.exr\"\nMaterial \"diffuse\" \"string normalmap\" \"src\"\nInclude \"missing.pbrt\""
    )
);
snapshot!(
    attributes,
    world(
        "Attribute \"shap\" \"float radius\" 2\nAttribute \"shape\" \"float radius\" 2 \"float phimax\" 90\nShape \"sphere\"\nShape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 1 1 0]"
    )
);
snapshot!(options, report(
    b"Option \"seed\" 7\nOption \"Disable-Pixel_Jitter\" true\nOption \"sed\" 7\nOption \"wavefront\" maybe\nOption \"msereferenceimage\" image.exr\nOption \"seed\" 1.5\nOption\nWorldBegin"
));
snapshot!(
    objects_and_lights,
    world(
        "AreaLightSource \"diffuse\"\nObjectBegin \"a\"\nLightSource \"point\"\nShape \"sphere\"\nObjectEnd\nObjectInstance \"a\""
    )
);
snapshot!(old_forms, report(
    b"TransformBegin\nWorldBegin\nTransformBegin\nTransformEnd\nMaterial \"none\"\nMaterial \"dielectric\" \"bool remaproughness\" \"false\"\nTransformEnd"
));
snapshot!(version_3, report(
    b"LookAt 0 1 2.35  0 1 0  0 1 0\nCamera \"environment\" \"float fov\" [90]\nFilm \"image\" \"integer xresolution\" [800]\n\
    Sampler \"random\" \"integer pixelsamples\" [256]\nPixelFilter \"box\" \"float xwidth\" 1\nWorldBegin\n\
    MakeNamedMaterial \"white\" \"string type\" \"matte\" \"color Kd\" [1 1 1]\nTexture \"t\" \"color\" \"imagemap\" \"bool gamma\" true\n\
    AreaLightSource \"area\" \"rgb L\" [1 1 1] \"integer nsamples\" 1\nShape \"trianglemesh\" \"point P\" [0 0 0 1 0 0 1 1 0] \"point2 st\" [0 0 0 0 0 0]\nWorldEnd\n"
));

#[test]
fn floods_are_cut() {
    let text = "WorldBegin\n".to_owned() + &"Oops\n".repeat(100_000);
    let errors = luz_scene::read_str("scene.pbrt", &text).unwrap_err();
    // One error: what follows is skipped up to the next directive.
    assert_eq!(errors.diagnostics.error_count(), 1);
    let text = "WorldBegin\n".to_owned() + &"Shape \"oops\"\n".repeat(100_000);
    let errors = luz_scene::read_str("scene.pbrt", &text).unwrap_err();
    assert_eq!(errors.diagnostics.error_count(), 100_000);
    assert_eq!(errors.diagnostics.iter().count(), luz_scene::Diagnostics::MAX_KEPT);
    assert!(errors.to_string().ends_with("… and 99000 more"));
}
