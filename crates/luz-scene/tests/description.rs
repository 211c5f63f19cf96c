//! What scenes mean: the graphics state, transformations, references.

use glam::{Mat4, Vec3};
use luz_scene::{
    ColorSpace, Description, Diagnostics, FloatOrTexture, SpectrumOrTexture, SpectrumParameter, TextureType,
};

fn read(text: &str) -> Description {
    match luz_scene::read_str("scene.pbrt", text) {
        Ok((scene, warnings)) => {
            assert!(warnings.is_empty(), "{}", warnings.render(&scene.sources));
            scene
        }
        Err(errors) => panic!("{errors}"),
    }
}

fn near(a: Mat4, b: Mat4) -> bool {
    a.abs_diff_eq(b, 1e-6)
}

#[test]
fn an_empty_world_has_pbrts_defaults() {
    let scene = read("WorldBegin");
    let kinds = [&scene.film, &scene.sampler, &scene.integrator, &scene.accelerator, &scene.pixel_filter];
    assert_eq!(kinds.map(|e| e.kind.to_string()), ["rgb", "zsobol", "volpath", "bvh", "gaussian"]);
    assert_eq!(&*scene.camera.entity.kind, "perspective");
    assert_eq!(scene.materials.len(), 1);
    assert_eq!(&*scene.materials[0].entity.kind, "diffuse");
    assert_eq!(scene.transform_times, [0.0, 1.0]);
}

#[test]
fn the_camera_sees_through_the_current_transformation() {
    let scene = read(
        "LookAt 1 2 3  1 2 4  0 1 0\nCamera \"perspective\" \"float fov\" 45\nWorldBegin\n\
        AttributeBegin CoordSysTransform \"camera\" Shape \"sphere\" AttributeEnd\n\
        Shape \"sphere\" Translate 5 0 0 CoordSysTransform \"world\" Shape \"sphere\"",
    );
    assert!(near(scene.camera.camera_from_world.start, Mat4::from_translation(Vec3::new(-1.0, -2.0, -3.0))));
    // `camera` is the transformation from camera to world space; `WorldBegin` starts afresh.
    let transforms: Vec<_> = scene.shapes.iter().map(|s| s.world_from_object.start).collect();
    assert!(near(transforms[0], Mat4::from_translation(Vec3::new(1.0, 2.0, 3.0))));
    assert_eq!(transforms[1..], [Mat4::IDENTITY; 2]);
}

#[test]
fn transformations_concatenate_from_the_right() {
    let scene = read(
        "WorldBegin\nTranslate 1 0 0 Scale 2 2 2 Shape \"sphere\"\n\
        Identity ConcatTransform [1 0 0 0  0 1 0 0  0 0 1 0  7 8 9 1] Shape \"sphere\"\n\
        Transform [2 0 0 0  0 2 0 0  0 0 2 0  1 2 3 1] Shape \"sphere\" Rotate 90 0 0 1 Shape \"sphere\"",
    );
    let at = |i: usize, p: Vec3| scene.shapes[i].world_from_object.start.transform_point3(p);
    assert_eq!(at(0, Vec3::ONE), Vec3::new(3.0, 2.0, 2.0));
    assert_eq!(at(1, Vec3::ZERO), Vec3::new(7.0, 8.0, 9.0));
    assert_eq!(at(2, Vec3::ONE), Vec3::new(3.0, 4.0, 5.0));
    assert!((at(3, Vec3::X) - Vec3::new(1.0, 4.0, 3.0)).length() < 1e-6);
}

#[test]
fn motion() {
    let scene = read(
        "TransformTimes 0.25 0.75\nActiveTransform EndTime Translate 0 0 1 ActiveTransform All\nCamera \"perspective\"\n\
        WorldBegin\nActiveTransform StartTime Translate 1 0 0 AttributeBegin ActiveTransform EndTime Translate 0 1 0 Shape \"sphere\" AttributeEnd\n\
        Translate 1 0 0 Shape \"sphere\" ActiveTransform All Identity Shape \"sphere\"",
    );
    assert_eq!(scene.transform_times, [0.25, 0.75]);
    assert!(scene.camera.camera_from_world.is_animated());
    let translation = |i: usize| {
        let t = scene.shapes[i].world_from_object;
        (t.start.w_axis.truncate(), t.end.w_axis.truncate())
    };
    assert_eq!(translation(0), (Vec3::X, Vec3::Y));
    // Which transformations are active is part of the graphics state.
    assert_eq!(translation(1), (2.0 * Vec3::X, Vec3::ZERO));
    assert!(!scene.shapes[2].world_from_object.is_animated());
}

#[test]
fn attributes_are_a_stack() {
    let scene = read(
        "WorldBegin\nMaterial \"dielectric\" AreaLightSource \"diffuse\"\nMakeNamedMedium \"fog\" \"string type\" \"homogeneous\"\n\
        AttributeBegin\nReverseOrientation Material \"conductor\" MediumInterface \"fog\" \"\" ColorSpace \"rec2020\"\n\
        Shape \"sphere\" \"float radius\" 1\nAreaLightSource \"\" Shape \"disk\"\nAttributeEnd\nMediumInterface \"fog\" Shape \"cylinder\"",
    );
    let [a, b, c] = scene.shapes.as_slice() else { panic!() };
    assert_eq!((a.material, b.material, c.material), (2, 2, 1));
    assert_eq!((a.reverse_orientation, c.reverse_orientation), (true, false));
    assert_eq!((a.inside_medium, a.outside_medium), (Some(0), None));
    assert_eq!((c.inside_medium, c.outside_medium), (Some(0), Some(0)));
    assert_eq!((a.area_light, b.area_light, c.area_light), (Some(0), None, Some(0)));
    assert_eq!((a.entity.color_space, c.entity.color_space), (ColorSpace::Rec2020, ColorSpace::Srgb));
}

#[test]
fn attribute_parameters_are_defaults() {
    let scene = read(
        "WorldBegin\nAttribute \"shape\" \"float radius\" 2 \"float zmin\" -1\nAttributeBegin\nAttribute \"shape\" \"float radius\" 3\n\
        Shape \"sphere\" Shape \"sphere\" \"float radius\" 4\nAttributeEnd\nShape \"sphere\"\nShape \"disk\"\n\
        ColorSpace \"aces2065-1\" Attribute \"material\" \"rgb reflectance\" [1 0 0] ColorSpace \"srgb\" Material \"diffuse\"",
    );
    let mut d = Diagnostics::default();
    let radius = |i: usize, d: &mut Diagnostics| scene.shapes[i].entity.parameters.one_float("radius", 0.0, d);
    assert_eq!([0, 1, 2].map(|i| radius(i, &mut d)), [3.0, 4.0, 2.0]);
    // Unused ones are no error.
    scene.shapes[3].entity.parameters.report_unused(&["radius"], &mut d);
    let red = scene.materials[1].entity.parameters.spectrum("reflectance", &mut d);
    assert_eq!(red, Some(&SpectrumParameter::Rgb { rgb: [1.0, 0.0, 0.0], color_space: ColorSpace::Aces2065 }));
    assert!(d.is_empty());
}

#[test]
fn objects_and_instances() {
    let scene = read(
        "WorldBegin\nObjectInstance \"tree\" Translate 1 0 0\nMaterial \"conductor\"\nObjectBegin \"tree\"\nTranslate 0 1 0 Shape \"sphere\"\n\
        AttributeBegin Material \"diffuse\" Shape \"disk\" AttributeEnd\nObjectEnd\nObjectInstance \"tree\"\nShape \"cylinder\"",
    );
    assert_eq!((scene.objects.len(), scene.instances.len(), scene.shapes.len()), (1, 2, 1));
    // `ObjectBegin` and `ObjectEnd` save and restore the state.
    assert_eq!(scene.instances[1].world_from_instance.start, Mat4::from_translation(Vec3::X));
    assert_eq!(scene.shapes[0].material, 1);
    let shapes = &scene.objects[0].shapes;
    assert_eq!(shapes[0].world_from_object.start, Mat4::from_translation(Vec3::new(1.0, 1.0, 0.0)));
    assert_eq!(shapes.iter().map(|s| s.material).collect::<Vec<_>>(), [1, 2]);
}

#[test]
fn names_may_be_used_before_they_are_defined() {
    let scene = read(
        "MediumInterface \"fog\" Camera \"perspective\"\nWorldBegin\nNamedMaterial \"late\" Shape \"sphere\"\n\
        MakeNamedMaterial \"mixed\" \"string type\" \"mix\" \"string materials\" [\"late\" \"late\"]\n\
        MakeNamedMaterial \"late\" \"string type\" \"diffuse\" \"texture reflectance\" \"outer\"\n\
        Texture \"outer\" \"spectrum\" \"scale\" \"texture tex\" \"inner\" \"texture scale\" \"inner\"\n\
        Texture \"inner\" \"spectrum\" \"constant\" Texture \"inner\" \"float\" \"constant\"\n\
        MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" NamedMaterial \"mixed\" Shape \"disk\"",
    );
    assert_eq!(scene.camera.medium, Some(0));
    // What is used stands before what uses it.
    let names: Vec<_> = scene.materials.iter().map(|m| m.name.as_deref()).collect();
    assert_eq!(names, [None, Some("late"), Some("mixed")]);
    assert_eq!((scene.shapes[0].material, scene.shapes[1].material), (1, 2));
    let textures: Vec<_> = scene.textures.iter().map(|t| (&*t.name, t.value_type)).collect();
    let (float, spectrum) = (TextureType::Float, TextureType::Spectrum);
    assert_eq!(textures, [("inner", spectrum), ("inner", float), ("outer", spectrum)]);
}

#[test]
fn parameters_of_every_type() {
    let scene = read(
        "Film \"rgb\" \"bool savefp16\" false \"string filename\" [ \"a b\\\"c\" ] \"integer pixelbounds\" [1 2 3 -4]\nWorldBegin\n\
        Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"Cargo.toml\" \"vector3 v1\" [1 2 3]\n\
        Shape \"trianglemesh\" \"point3 P\" [0 0 0  1e0 +1 -.5  # comment ]\n 1. 2 3] \"normal N\" [0 0 1 0 0 1 0 0 1]\"point2 uv\"[0 0 1 0 1 1]\n\
        Material \"coateddiffuse\" \"texture reflectance\" \"t\" \"float roughness\" 0.25\n\
        LightSource \"point\" \"blackbody I\" 5500 \"point3 from\" [1 2 3]\n\
        LightSource \"point\" \"spectrum I\" [400 1 500 2.5]",
    );
    let mut d = Diagnostics::default();
    let film = &scene.film.parameters;
    assert!(!film.one_bool("savefp16", true, &mut d));
    assert_eq!(film.string("filename", &mut d), Some("a b\"c"));
    assert_eq!(film.integers("pixelbounds", &mut d), Some(&[1, 2, 3, -4][..]));
    let mesh = &scene.shapes[0].entity.parameters;
    assert_eq!(mesh.points3("P", &mut d).unwrap()[1], Vec3::new(1.0, 1.0, -0.5));
    assert_eq!(mesh.normals("N", &mut d).unwrap(), [Vec3::Z; 3]);
    assert_eq!(mesh.points2("uv", &mut d).unwrap().len(), 3);
    let material = &scene.materials[1].entity.parameters;
    let reflectance = material.spectrum_or_texture("reflectance", &mut d);
    assert!(matches!(reflectance, Some(SpectrumOrTexture::Texture { name: "t", .. })));
    assert_eq!(material.float_or_texture("roughness", &mut d), Some(FloatOrTexture::Float(0.25)));
    assert_eq!(scene.lights[0].entity.parameters.spectrum("I", &mut d), Some(&SpectrumParameter::Blackbody(5500.0)));
    let samples = scene.lights[1].entity.parameters.spectrum("I", &mut d).and_then(SpectrumParameter::samples);
    assert_eq!(samples, Some(&[(400.0, 1.0), (500.0, 2.5)][..]));
    assert!(d.is_empty());
}

/// Places let later stages point into the text.
#[test]
fn parameters_know_their_places() {
    let text = "WorldBegin\nShape \"sphere\"\n  \"float  radius\" [ 1 ]\n";
    let scene = read(text);
    let parameters = &scene.shapes[0].entity.parameters;
    let parameter = parameters.get("radius").unwrap();
    let at = |span: luz_scene::Span| &text[span.start as usize..span.end as usize];
    assert_eq!(at(parameter.name_span), "radius");
    assert_eq!(at(parameter.value_span), "[ 1 ]");
    assert_eq!(at(scene.shapes[0].entity.kind_span), "sphere");
    assert_eq!(at(scene.shapes[0].entity.span), "Shape");
    let mut d = Diagnostics::default();
    parameters.report_unused(&["radious"], &mut d);
    assert_eq!(
        d.render(&scene.sources),
        "scene.pbrt:3:11: error: unknown parameter `radius`\n      \"float  radius\" [ 1 ]\n              ^^^^^^\n  help: did you mean `radious`?\n"
    );
}
