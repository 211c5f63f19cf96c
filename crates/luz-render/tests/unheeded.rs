//! What a scene asks for and is not heeded, or cannot be had, is said.

use luz_geometry::SimdLevel;
use luz_render::Overrides;
use luz_render::world::build;
use luz_scene::{Diagnostics, Severity};

/// The messages of a scene's errors and warnings, and whether it can be rendered.
fn messages(text: &str) -> (Vec<(Severity, String)>, bool) {
    let (description, _) = luz_scene::read_str("test.pbrt", text).unwrap_or_else(|errors| panic!("{errors}"));
    let mut diagnostics = Diagnostics::default();
    let loaded = build(&description, &Overrides::default(), SimdLevel::Auto, &mut diagnostics);
    (diagnostics.iter().map(|d| (d.severity, d.message.clone())).collect(), loaded.is_some())
}

#[test]
fn a_medium_is_named_once_however_often_it_is_used() {
    let (found, renderable) = messages(
        r#"
        MakeNamedMedium "fog" "string type" "homogeneous"
        WorldBegin
        LightSource "infinite"
        MediumInterface "fog" ""
        Shape "sphere"
        Shape "disk"
        "#,
    );
    assert_eq!(found, [(Severity::Error, "the medium `homogeneous` cannot be rendered yet".to_owned())]);
    assert!(!renderable);
}

#[test]
fn options_and_parameters_without_effect_are_warned_of() {
    let (found, renderable) = messages(
        r#"
        Option "bool forcediffuse" true
        Film "gbuffer"
        Sampler "halton" "string randomization" "none"
        WorldBegin
        LightSource "infinite"
        Shape "sphere"
        "#,
    );
    assert!(renderable && found.iter().all(|(severity, _)| *severity == Severity::Warning), "{found:?}");
    let texts: Vec<&str> = found.iter().map(|(_, text)| text.as_str()).collect();
    assert_eq!(
        texts,
        [
            "the option `forcediffuse` is not heeded",
            "positions and normals are written in world space",
            "samples are randomized all the same",
        ]
    );
}

#[test]
fn unknown_light_samplers_are_an_error() {
    let (found, renderable) = messages(
        r#"Integrator "path" "string lightsampler" "exhaustive" WorldBegin LightSource "infinite" Shape "sphere""#,
    );
    assert!(!renderable);
    assert_eq!(found[0].1, "unknown light sampler `exhaustive`; known are bvh, power, uniform");
}

#[test]
fn bottomless_textures_are_an_error() {
    let chain: String = (1..5000)
        .map(|i| format!(r#"Texture "t{i}" "float" "scale" "texture tex" "t{}" "float scale" 1 "#, i - 1))
        .collect();
    let (found, renderable) = messages(&format!(
        r#"WorldBegin LightSource "infinite" Texture "t0" "float" "constant" {chain}
        Material "dielectric" "texture roughness" "t4999" Shape "sphere""#
    ));
    assert!(!renderable);
    assert!(found[0].1.contains("nested more than 200 deep"), "{found:?}");
}
