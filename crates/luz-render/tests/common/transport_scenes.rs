//! Small scenes, each of which covers something of light transport that every integrator must agree on.
//!
//! Path tracing finds all of their light quickly: lamps are large where specular surfaces are near, and lamps without extent shine on
//! surfaces without specular lobes only. So `path` is the reference, within seconds.
//!
//! The samplers are `independent`: variances of pixels are those of the mean, and z-tests mean what they say.

use luz_image::Image;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// A scene, and what can be asked of it.
#[derive(Clone, Debug)]
pub struct TransportScene {
    /// The name of the function that makes it.
    pub name: &'static str,
    /// The scene, in pbrt-v4's format: 20 × 20 pixels or so, `path`.
    pub text: String,
    /// Does the camera see surfaces with specular lobes, of mirrors, glass or smooth coats? What it sees in them, light tracing cannot
    /// connect with the camera. All other integrators find everything.
    pub has_specular_view: bool,
}

/// All of them.
pub fn all() -> Vec<TransportScene> {
    let scene = |name, text, has_specular_view| TransportScene { name, text, has_specular_view };
    vec![
        scene("diffuse_box", diffuse_box(), false),
        scene("area_light_shapes", area_light_shapes(), false),
        scene("many_lights", many_lights(), false),
        scene("textured_area_light", textured_area_light(), false),
        scene("covered_lights", covered_lights(), false),
        scene("point_light", point_light(), false),
        scene("spot_light", spot_light(), false),
        scene("distant_light", distant_light(), false),
        scene("goniometric_light", goniometric_light(), false),
        scene("projection_light", projection_light(), false),
        scene("uniform_environment", uniform_environment(), false),
        scene("image_environment", image_environment(), false),
        scene("portal", portal(), false),
        scene("all_lights", all_lights(), false),
        scene("glossy", glossy(), false),
        scene("rough_glass", rough_glass(), false),
        scene("specular", specular(), true),
        scene("thin_glass_and_leaf", thin_glass_and_leaf(), true),
        scene("dispersion", dispersion(), true),
        scene("coats", coats(), true),
        scene("rough_coats", rough_coats(), false),
        scene("mixed_materials", mixed_materials(), false),
        scene("passed_through", passed_through(), false),
        scene("shading_normals", shading_normals(), false),
        scene("bump_map", bump_map(), false),
        scene("normal_map", normal_map(), false),
        scene("bumpy_glass", bumpy_glass(), true),
        scene("thin_lens", thin_lens(), false),
        scene("orthographic_camera", orthographic_camera(), false),
        scene("orthographic_lens", orthographic_lens(), false),
        scene("spherical_camera", spherical_camera("equalarea"), false),
        scene("equirectangular_camera", spherical_camera("equirectangular"), false),
        scene("motion_blur", motion_blur(), false),
        scene("closed_furnace", closed_furnace(), false),
    ]
}

/// Looks into the room below from its open side, under the lamp, which would outshine everything.
const VIEW: &str = r#"LookAt 0 0.9 -4.2  0 0.75 0  0 1 0  Camera "perspective" "float fov" 26"#;
/// The same with the lamp and what is around the room.
const WIDE_VIEW: &str = r#"LookAt 0 1.1 -4.2  0 1 0  0 1 0  Camera "perspective" "float fov" 36"#;
/// A lamp of a square metre below the ceiling.
const LAMP: &str = r#"
    AttributeBegin
    AreaLightSource "diffuse" "rgb L" [5 4.6 4]
    Shape "bilinearmesh" "point3 P" [-0.5 1.98 -0.5  0.5 1.98 -0.5  -0.5 1.98 0.5  0.5 1.98 0.5]
    AttributeEnd"#;
/// A ball in the middle of the room.
const BALL: &str = r#"AttributeBegin Translate 0 0.6 0 Shape "sphere" "float radius" 0.6 AttributeEnd"#;

/// A room of 2.4 m by 2 m by 2.4 m around the origin, open to the camera, with what is said in it. All its walls are diffuse.
fn room(view: &str, max_depth: u32, lights: &str, things: &str) -> String {
    format!(
        r#"
        {view}
        Film "rgb" "integer xresolution" 20 "integer yresolution" 20
        Sampler "independent" "integer pixelsamples" 64
        Integrator "path" "integer maxdepth" {max_depth}
        WorldBegin
        {lights}
        Material "diffuse" "rgb reflectance" [0.6 0.6 0.6]
        Shape "bilinearmesh" "point3 P" [-1.2 0 -1.2  1.2 0 -1.2  -1.2 0 1.2  1.2 0 1.2]
        Shape "bilinearmesh" "point3 P" [-1.2 0 1.2  1.2 0 1.2  -1.2 2 1.2  1.2 2 1.2]
        Material "diffuse" "rgb reflectance" [0.6 0.1 0.1]
        Shape "bilinearmesh" "point3 P" [-1.2 0 -1.2  -1.2 0 1.2  -1.2 2 -1.2  -1.2 2 1.2]
        Material "diffuse" "rgb reflectance" [0.1 0.5 0.15]
        Shape "bilinearmesh" "point3 P" [1.2 0 -1.2  1.2 0 1.2  1.2 2 -1.2  1.2 2 1.2]
        Material "diffuse" "rgb reflectance" [0.6 0.6 0.6]
        {things}
        "#
    )
}

/// The ceiling of the room, where lights do not shine through it.
const CEILING: &str = r#"Shape "bilinearmesh" "point3 P" [-1.2 2 -1.2  1.2 2 -1.2  -1.2 2 1.2  1.2 2 1.2]"#;

/// A ball and the ceiling.
fn ball(material: &str) -> String {
    format!("{CEILING}\n{material}\n{BALL}")
}

/// Diffuse surfaces, a rectangular lamp that the camera sees, several bounces.
pub fn diffuse_box() -> String {
    room(WIDE_VIEW, 6, LAMP, &ball(""))
}

/// Lamps of every shape: a sphere, part of a sphere, a disk, a cylinder, triangles that shine to both sides, a curved patch.
pub fn area_light_shapes() -> String {
    let lights = r#"
        AttributeBegin AreaLightSource "diffuse" "rgb L" [6 5 4] Translate -0.8 1.6 0 Shape "sphere" "float radius" 0.2 AttributeEnd
        AttributeBegin AreaLightSource "diffuse" "rgb L" [5 6 4] "bool twosided" true Translate 0.8 1.6 0
            Shape "sphere" "float radius" 0.2 "float zmax" 0.1 "float phimax" 200 AttributeEnd
        AttributeBegin AreaLightSource "diffuse" "rgb L" [4 5 6] Translate 0 1.9 0 Rotate 90 1 0 0 Shape "disk" "float radius" 0.3 AttributeEnd
        AttributeBegin AreaLightSource "diffuse" "rgb L" [6 5 4] Translate 0 1.5 0.9 Shape "cylinder" "float radius" 0.1 "float zmin" -0.2 "float zmax" 0.2 AttributeEnd
        AttributeBegin AreaLightSource "diffuse" "rgb L" [5 5 5] "bool twosided" true
            Shape "trianglemesh" "point3 P" [-0.9 0.6 -0.6  -0.6 0.6 -0.6  -0.8 0.9 -0.3  -0.5 0.9 -0.4] "integer indices" [0 1 2  1 3 2] AttributeEnd
        AttributeBegin AreaLightSource "diffuse" "rgb L" [4 4 7] "bool twosided" true
            Shape "bilinearmesh" "point3 P" [0.6 0.5 -0.6  1 0.6 -0.5  0.7 0.9 -0.3  0.9 0.8 -0.6] AttributeEnd"#;
    room(WIDE_VIEW, 4, lights, &ball(""))
}

/// Thirty lamps from dim to bright, chosen by a tree, two of them within instances.
pub fn many_lights() -> String {
    let mut lights = String::from(
        r#"ObjectBegin "lamp" AreaLightSource "diffuse" "rgb L" [3 4 3] Shape "sphere" "float radius" 0.08 ObjectEnd
        AttributeBegin Translate -0.9 0.3 -0.8 ObjectInstance "lamp" AttributeEnd
        AttributeBegin Translate 0.9 0.3 -0.8 Scale 1.5 1.5 1.5 ObjectInstance "lamp" AttributeEnd"#,
    );
    for i in 0..28 {
        let (row, column) = (f64::from(i / 7), f64::from(i % 7));
        lights += &format!(
            r#"
            AttributeBegin AreaLightSource "diffuse" "rgb L" [{red} 3 4] Translate {x} {y} {z} Shape "sphere" "float radius" 0.06 AttributeEnd"#,
            red = 1.0 + 2.0 * row,
            x = 0.3 * (column - 3.0),
            y = 1.8 - 0.02 * column,
            z = 0.5 * (row - 1.5),
        );
    }
    room(WIDE_VIEW, 4, &lights, &ball(""))
}

/// A rectangle that shines with an image.
pub fn textured_area_light() -> String {
    let file = file("screen.pfm");
    let lights = format!(
        r#"AttributeBegin AreaLightSource "diffuse" "string filename" "{file}" "bool twosided" true
        Shape "bilinearmesh" "point3 P" [-0.8 1.2 0.9  0.8 1.2 0.9  -0.8 1.9 0.7  0.8 1.9 0.7] AttributeEnd"#
    );
    room(WIDE_VIEW, 4, &lights, &ball(""))
}

/// Lamps with holes, of which only some rays meet what is there, and one that no ray meets although it shines.
pub fn covered_lights() -> String {
    let file = file("screen.pfm");
    let lights = format!(
        r#"
        Texture "holes" "float" "checkerboard" "float uscale" 4 "float vscale" 4 "float tex1" 0.2 "float tex2" 0.9
        AttributeBegin AreaLightSource "diffuse" "rgb L" [9 8 7]
        Shape "bilinearmesh" "point3 P" [-0.5 1.98 -0.5  0.5 1.98 -0.5  -0.5 1.98 0.5  0.5 1.98 0.5] "texture alpha" "holes" AttributeEnd
        AttributeBegin AreaLightSource "diffuse" "string filename" "{file}" "bool twosided" true
        Shape "bilinearmesh" "point3 P" [-0.9 0.6 0.9  -0.2 0.6 1.1  -0.9 1.3 0.9  -0.2 1.3 1.1] "float alpha" 0.3 AttributeEnd
        AttributeBegin AreaLightSource "diffuse" "rgb L" [2 6 3] Translate 0.8 1.2 -0.4
        Shape "sphere" "float radius" 0.2 "float alpha" 0 AttributeEnd"#
    );
    room(WIDE_VIEW, 5, &lights, &ball(""))
}

/// A point light.
pub fn point_light() -> String {
    room(VIEW, 5, r#"LightSource "point" "rgb I" [1.2 1 0.8] "point3 from" [0.4 1.7 -0.5]"#, &ball(""))
}

/// A spot light with a soft edge, turned and scaled.
pub fn spot_light() -> String {
    let lights = r#"AttributeBegin Rotate 10 0 0 1 LightSource "spot" "rgb I" [4 3.5 3] "point3 from" [0.2 1.7 -0.9]
        "point3 to" [-0.3 0.3 0.5] "float coneangle" 40 "float conedeltaangle" 15 AttributeEnd"#;
    room(VIEW, 5, lights, &ball(""))
}

/// Parallel light through the room's open side.
pub fn distant_light() -> String {
    let lights = r#"LightSource "distant" "rgb L" [2 1.9 1.6] "point3 from" [0.4 1 -1] "point3 to" [0 0 0]"#;
    room(VIEW, 5, lights, &ball(""))
}

/// A lamp at a point whose intensity is an image over directions.
pub fn goniometric_light() -> String {
    let file = file("octahedral.pfm");
    let lights = format!(
        r#"AttributeBegin Translate 0.3 1.5 -0.6 Rotate 40 1 2 3 LightSource "goniometric" "rgb I" [1.5 1.4 1.2] "string filename" "{file}" AttributeEnd"#
    );
    room(VIEW, 5, &lights, &ball(""))
}

/// A projector.
pub fn projection_light() -> String {
    let file = file("screen.pfm");
    let lights = format!(
        r#"AttributeBegin Translate 0.4 1.6 -2 Rotate 15 1 0 0 LightSource "projection" "float fov" 50 "float scale" 6 "string filename" "{file}" AttributeEnd"#
    );
    room(VIEW, 5, &lights, &ball(""))
}

/// Light that is the same from everywhere, partly seen by the camera.
pub fn uniform_environment() -> String {
    room(WIDE_VIEW, 5, r#"LightSource "infinite" "rgb L" [0.8 1 1.2]"#, &ball("").replace(CEILING, ""))
}

/// A sky with a sun of five texels' width, above the room without a ceiling.
pub fn image_environment() -> String {
    let file = file("sky.pfm");
    let lights = format!(
        r#"AttributeBegin Rotate -90 1 0 0 LightSource "infinite" "string filename" "{file}" "float scale" 1.5 AttributeEnd"#
    );
    room(WIDE_VIEW, 5, &lights, &ball("").replace(CEILING, ""))
}

/// A sky that is looked for through the room's open top only.
pub fn portal() -> String {
    let file = file("octahedral.pfm");
    let lights = format!(
        r#"AttributeBegin Rotate -90 1 0 0 LightSource "infinite" "string filename" "{file}" "float scale" 1.5
            "point3 portal" [-1.2 2 -1.2  1.2 2 -1.2  1.2 2 1.2  -1.2 2 1.2] AttributeEnd"#
    );
    // Light that comes in elsewhere is not looked for: the open side is closed, behind the camera's back.
    let view = r#"LookAt 0 1.1 -1.1  0 0.8 0  0 1 0  Camera "perspective" "float fov" 80"#;
    let front = r#"Shape "bilinearmesh" "point3 P" [-1.2 0 -1.2  1.2 0 -1.2  -1.2 2 -1.2  1.2 2 -1.2]"#;
    room(view, 5, &lights, &ball("").replace(CEILING, front))
}

/// Lights with and without extent, near and at infinity, at once.
pub fn all_lights() -> String {
    let lights = format!(
        r#"{LAMP}
        LightSource "infinite" "rgb L" [0.2 0.25 0.4]
        LightSource "point" "rgb I" [0.5 0.3 0.3] "point3 from" [-0.8 1.5 -0.9]
        LightSource "distant" "rgb L" [0.6 0.6 0.5] "point3 from" [0.4 0.6 -1] "point3 to" [0 0 0]
        LightSource "spot" "rgb I" [1 2 1] "point3 from" [0.9 1.8 0] "point3 to" [0 0 0.5]"#
    );
    room(VIEW, 4, &lights, &ball(r#"Material "conductor" "float roughness" 0.3"#))
}

/// Rough metals, one of them with another roughness along than across.
pub fn glossy() -> String {
    let things = format!(
        r#"{CEILING}
        AttributeBegin
        Material "conductor" "spectrum eta" "metal-Au-eta" "spectrum k" "metal-Au-k" "float roughness" 0.2
        Translate -0.5 0.5 0.2 Shape "sphere" "float radius" 0.5
        AttributeEnd
        Material "conductor" "float uroughness" 0.15 "float vroughness" 0.4
        Translate 0.6 0.5 -0.2 Rotate 60 1 1 0 Shape "sphere" "float radius" 0.5"#
    );
    room(VIEW, 5, LAMP, &things)
}

/// A ball of rough glass: refraction whose radiance is compressed, without specular lobes.
pub fn rough_glass() -> String {
    room(VIEW, 6, LAMP, &ball(r#"Material "dielectric" "float eta" 1.5 "float roughness" 0.4"#))
}

/// A ball of glass and a mirror, under a large lamp: caustics, and specular surfaces seen in each other.
pub fn specular() -> String {
    let things = format!(
        r#"{CEILING}
        AttributeBegin Material "dielectric" "float eta" 1.5 Translate -0.5 0.5 -0.2 Shape "sphere" "float radius" 0.5 AttributeEnd
        Material "conductor"
        Shape "bilinearmesh" "point3 P" [0.2 0 0.9  1.1 0 0.2  0.2 1.2 0.9  1.1 1.2 0.2]"#
    );
    room(VIEW, 8, LAMP, &things)
}

/// A pane of thin glass, and a leaf that light passes and is scattered by.
pub fn thin_glass_and_leaf() -> String {
    let things = format!(
        r#"{CEILING}
        AttributeBegin Material "thindielectric" "float eta" 1.5
        Shape "bilinearmesh" "point3 P" [-1 0 -0.4  -0.1 0 -0.6  -1 1.2 -0.4  -0.1 1.2 -0.6] AttributeEnd
        Material "diffusetransmission" "rgb reflectance" [0.2 0.4 0.1] "rgb transmittance" [0.3 0.5 0.1]
        Shape "bilinearmesh" "point3 P" [0.1 0.9 -0.6  1 1 -0.4  0.1 1.2 0.5  1 1.1 0.7]"#
    );
    room(VIEW, 6, LAMP, &things)
}

/// A ball of flint glass, whose index depends on the wavelength: paths keep one wavelength after it. The lamp is the whole ceiling.
pub fn dispersion() -> String {
    let lamp = LAMP.replace("0.5", "1.2").replace("[5 4.6 4]", "[0.9 0.8 0.7]");
    room(VIEW, 7, &lamp, &ball(r#"Material "dielectric" "spectrum eta" "glass-F11""#))
}

/// Smooth coats over paint, over rough metal, and one that absorbs: specular and other lobes in one material.
pub fn coats() -> String {
    coated("0", "0")
}

/// The same coats, rough.
pub fn rough_coats() -> String {
    coated("0.25", "0.3")
}

fn coated(roughness: &str, interface: &str) -> String {
    let things = format!(
        r#"{CEILING}
        AttributeBegin Material "coateddiffuse" "rgb reflectance" [0.6 0.2 0.1] "float roughness" {roughness}
        Translate -0.7 0.4 0 Shape "sphere" "float radius" 0.4 AttributeEnd
        AttributeBegin Material "coatedconductor" "float conductor.roughness" 0.3 "float interface.roughness" {interface}
        Translate 0.15 0.4 0.3 Shape "sphere" "float radius" 0.4 AttributeEnd
        AttributeBegin Material "coateddiffuse" "rgb reflectance" [0.2 0.6 0.3] "float roughness" {roughness}
            "rgb albedo" [0.6 0.7 0.8] "float thickness" 0.3 "float g" 0.3
        Translate 0.8 0.35 -0.3 Shape "sphere" "float radius" 0.35 AttributeEnd"#
    );
    room(VIEW, 5, LAMP, &things)
}

/// Paint and metal by turns, chosen by a texture and by chance.
pub fn mixed_materials() -> String {
    let material = r#"
        MakeNamedMaterial "paint" "string type" "diffuse" "rgb reflectance" [0.2 0.3 0.7]
        MakeNamedMaterial "metal" "string type" "conductor" "float roughness" 0.3
        Texture "squares" "float" "checkerboard" "float uscale" 6 "float vscale" 3 "float tex1" 0.2 "float tex2" 0.9
        Material "mix" "string materials" ["paint" "metal"] "texture amount" "squares""#;
    room(VIEW, 5, LAMP, &ball(material))
}

/// Surfaces that are passed: a box of nothing around the ball, and a veil that is there by chance.
pub fn passed_through() -> String {
    let things = format!(
        r#"{}
        AttributeBegin Material "interface" Translate 0 0.6 0 Shape "sphere" "float radius" 0.8 AttributeEnd
        MakeNamedMaterial "nothing" "string type" "interface"
        MakeNamedMaterial "paint" "string type" "diffuse" "rgb reflectance" [0.7 0.6 0.2]
        Material "mix" "string materials" ["nothing" "paint"] "float amount" 0.4
        Shape "bilinearmesh" "point3 P" [-1 0 -0.9  0 0 -0.9  -1 1.5 -0.7  0 1.5 -0.7]
        Material "diffuse"
        Shape "bilinearmesh" "point3 P" [0.3 0.2 -0.9  1 0.2 -0.9  0.3 1.2 -0.9  1 1.2 -0.9] "float alpha" 0.5"#,
        ball("")
    );
    room(VIEW, 5, LAMP, &things)
}

/// A coarse mesh whose normals are those of a smooth body: light leaks and darkens at its edges, the same for all integrators.
pub fn shading_normals() -> String {
    let things = format!(
        r#"{CEILING}
        Material "conductor" "float roughness" 0.35
        Translate 0 0.75 0 Rotate 20 1 2 0
        Shape "trianglemesh" "point3 P" [0.7 0 0  -0.7 0 0  0 0.7 0  0 -0.7 0  0 0 0.7  0 0 -0.7] "normal N" [1 0 0  -1 0 0  0 1 0  0 -1 0  0 0 1  0 0 -1]
            "integer indices" [0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5]"#
    );
    room(VIEW, 5, LAMP, &things)
}

/// Waves in varnished paint.
pub fn bump_map() -> String {
    let material = r#"Material "coateddiffuse" "rgb reflectance" [0.5 0.4 0.3] "float roughness" 0.3 "texture displacement" "dents""#;
    room(VIEW, 5, LAMP, &ball(&format!("{}{material}", dents())))
}

/// The texture `dents`: smooth waves.
fn dents() -> String {
    let file = file("waves.pfm");
    format!(
        r#"
        Texture "waves" "float" "imagemap" "string filename" "{file}" "float uscale" 3 "float vscale" 2
        Texture "dents" "float" "scale" "texture tex" "waves" "float scale" 0.08
        "#
    )
}

/// A metal relief by a normal map.
pub fn normal_map() -> String {
    let file = file("normals.pfm");
    let material = format!(r#"Material "conductor" "float roughness" 0.3 "string normalmap" "{file}""#);
    room(VIEW, 5, LAMP, &ball(&material))
}

/// Smooth glass with dents: refraction and shading normals at once, in both directions of transport.
pub fn bumpy_glass() -> String {
    let material = r#"Material "dielectric" "float eta" 1.5 "texture displacement" "dents""#;
    room(VIEW, 7, LAMP, &ball(&format!("{}{material}", dents())))
}

/// A wide lens, focused on the ball.
pub fn thin_lens() -> String {
    let view = r#"LookAt 0 0.9 -4.2  0 0.75 0  0 1 0
        Camera "perspective" "float fov" 26 "float lensradius" 0.25 "float focaldistance" 3.8"#;
    room(view, 5, LAMP, &ball(""))
}

/// Parallel projection, of a part of the film plane that is not square.
pub fn orthographic_camera() -> String {
    let view = r#"LookAt 0.3 1.2 -4.2  0 0.75 0  0 1 0  Camera "orthographic" "float screenwindow" [-1 1 -0.9 0.8]"#;
    room(view, 5, LAMP, &ball(""))
}

/// Parallel projection through a lens.
pub fn orthographic_lens() -> String {
    let view = r#"LookAt 0.3 1.2 -4.2  0 0.75 0  0 1 0
        Camera "orthographic" "float screenwindow" [-1 1 -0.9 0.8] "float lensradius" 0.2 "float focaldistance" 4.2"#;
    room(view, 5, LAMP, &ball(""))
}

/// All directions, from a point in the room, by the mapping `equalarea` or `equirectangular`.
pub fn spherical_camera(mapping: &str) -> String {
    let view = format!(r#"LookAt 0.2 1.4 -0.9  0 0.8 1  0 1 0  Camera "spherical" "string mapping" "{mapping}""#);
    room(&view, 5, LAMP, &ball(""))
}

/// A ball that moves, and a camera that does, too.
pub fn motion_blur() -> String {
    let view = r#"
        ActiveTransform StartTime LookAt 0 0.9 -4.2  0 0.75 0  0 1 0
        ActiveTransform EndTime LookAt 0.2 1 -4  0 0.75 0  0 1 0
        ActiveTransform All
        Camera "perspective" "float fov" 26 "float shutteropen" 0.1 "float shutterclose" 0.9"#;
    let things = format!(
        r#"{CEILING}
        ActiveTransform EndTime Translate 0.4 0.3 0 Rotate 30 0 0 1 ActiveTransform All
        Shape "bilinearmesh" "point3 P" [-0.6 0.2 -0.4  0.4 0.2 -0.4  -0.6 1.2 0  0.4 1.2 0]"#
    );
    room(view, 5, LAMP, &things)
}

/// The inside of a ball that shines and reflects half: radiance is 2 (1 − 0.5^(d + 1)) everywhere with d bounces at most.
pub fn closed_furnace() -> String {
    r#"
    LookAt 0 0 -0.5  0 0.3 1  0 1 0  Camera "perspective" "float fov" 70
    Film "rgb" "integer xresolution" 20 "integer yresolution" 20
    Sampler "independent" "integer pixelsamples" 64
    Integrator "path" "integer maxdepth" 8
    WorldBegin
    Material "diffuse" "rgb reflectance" [0.5 0.5 0.5]
    AreaLightSource "diffuse" "rgb L" [1 1 1]
    ReverseOrientation
    Shape "sphere" "float radius" 3
    "#
    .to_owned()
}

/// An image for these scenes, by its name.
fn file(name: &str) -> String {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(images).join(name).display().to_string()
}

/// A folder with the images that the scenes name, one for each process.
fn images() -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("transport-scenes-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder for images");
    write(&folder, "screen.pfm", [12, 8], |x, y| match (x * 7 + y * 3) % 13 {
        0 => [20.0, 10.0, 4.0],
        n if n < 5 => [0.0; 3],
        n => [0.3 * n as f32, 1.0, 2.0],
    });
    // All directions, by the octahedral equal-area map.
    write(&folder, "octahedral.pfm", [16, 16], |x, y| {
        [0.3 + ((x + 3 * y) % 7) as f32 / 3.0, 1.0, 0.6 + (y % 3) as f32]
    });
    // Longitudes and latitudes around +z: a broad sun in a sky above dark ground.
    write(&folder, "sky.pfm", [32, 16], |x, y| match (x, y) {
        (19..=21, 3..=5) => [20.0, 18.0, 14.0],
        (_, y) if y < 8 => [0.4, 0.6, 0.9],
        _ => [0.1, 0.08, 0.05],
    });
    let wave =
        |x: usize, y: usize, k: f32| [x as f32 / 64.0, y as f32 / 64.0].map(|v| (k * std::f32::consts::TAU * v).sin());
    write(&folder, "waves.pfm", [64, 64], |x, y| {
        let [u, v] = wave(x, y, 2.0);
        [0.5 + 0.25 * (u + v); 3]
    });
    // Normals as colours: (n + 1) / 2.
    write(&folder, "normals.pfm", [64, 64], |x, y| {
        let [u, v] = wave(x, y, 3.0);
        let length = (0.16 * (u * u + v * v) + 1.0).sqrt();
        [0.5 + 0.2 * u / length, 0.5 + 0.2 * v / length, 0.5 + 0.5 / length]
    });
    folder
}

fn write(folder: &Path, name: &str, [width, height]: [usize; 2], texel: impl Fn(usize, usize) -> [f32; 3]) {
    let data = (0..width * height).flat_map(|i| texel(i % width, i / width)).collect();
    let image = Image::from_data(width, height, ["R", "G", "B"], data).expect("sizes fit");
    image.write(folder.join(name)).expect("an image can be written");
}
