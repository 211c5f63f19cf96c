//! White furnaces: in light that is the same everywhere, a body that loses nothing cannot be seen.

mod common;

use common::{load, mean, overrides, render};

/// A sphere of `material` that fills the picture, in light of radiance 1 all around.
fn furnace(material: &str) -> [(f64, f64); 3] {
    let text = format!(
        r#"
        LookAt 0 0 -4  0 0 0  0 1 0
        Camera "perspective" "float fov" 20
        Integrator "path" "integer maxdepth" 200
        Sampler "sobol"
        WorldBegin
        LightSource "infinite" "rgb L" [1 1 1]
        {material}
        Shape "sphere"
        "#
    );
    let film = render(&load(&text, &overrides([24, 24], 64)));
    assert_eq!(film.dropped(), 0);
    mean(&film)
}

/// The mean is 1 within five standard errors and the 0.1 % by which the wavelengths' table rounds.
fn assert_unseen(material: &str) {
    for (value, error) in furnace(material) {
        assert!((value - 1.0).abs() < 5.0 * error + 1e-3, "{material}: {value} ± {error}");
    }
}

#[test]
fn white_diffuse_is_unseen() {
    assert_unseen(r#"Material "diffuse" "rgb reflectance" [1 1 1]"#);
}

#[test]
fn smooth_glass_is_unseen() {
    assert_unseen(r#"Material "dielectric""#);
    assert_unseen(r#"Material "thindielectric""#);
}

#[test]
fn white_diffuse_transmission_is_unseen() {
    assert_unseen(
        r#"Material "diffusetransmission" "rgb reflectance" [0.3 0.3 0.3] "rgb transmittance" [0.7 0.7 0.7]"#,
    );
}

#[test]
fn interfaces_are_unseen() {
    assert_unseen(r#"Material "interface""#);
}

/// What passes does not count as scattering: even the shortest paths see what is behind.
#[test]
fn paths_of_no_bounce_see_through_interfaces() {
    let text = r#"
        LookAt 0 0 -4  0 0 0  0 1 0
        Camera "perspective" "float fov" 20
        Integrator "path" "integer maxdepth" 0
        WorldBegin
        LightSource "infinite" "rgb L" [1 1 1]
        MakeNamedMaterial "nothing" "string type" "interface"
        MakeNamedMaterial "white" "string type" "diffuse"
        Material "mix" "string materials" ["nothing" "white"] "float amount" 0
        Shape "sphere"
        "#;
    for (value, error) in mean(&render(&load(text, &overrides([16, 16], 64)))) {
        assert!((value - 1.0).abs() < 5.0 * error + 1e-3, "{value} ± {error}");
    }
}

#[test]
fn dispersion_loses_nothing() {
    assert_unseen(r#"Material "dielectric" "spectrum eta" "glass-BK7""#);
}

/// Everything else may lose light to single scattering or absorption, but never gains any.
#[test]
fn nothing_gains_light() {
    for material in [
        r#"Material "coateddiffuse" "rgb reflectance" [1 1 1]"#,
        r#"Material "coateddiffuse" "rgb reflectance" [1 1 1] "float roughness" 0.3"#,
        r#"Material "conductor" "rgb reflectance" [1 1 1] "float roughness" 0.3"#,
        r#"Material "conductor""#,
        r#"Material "dielectric" "float roughness" 0.3"#,
        r#"Material "coatedconductor""#,
        r#"Material "coatedconductor" "float conductor.roughness" 0.2 "float interface.roughness" 0.1"#,
        r#"Material "coateddiffuse" "rgb reflectance" [1 1 1] "rgb albedo" [0.9 0.9 0.9] "float thickness" 0.5"#,
    ] {
        for (value, error) in furnace(material) {
            assert!(value < 1.0 + 5.0 * error + 1e-3, "{material}: {value} ± {error}");
            assert!(value > 0.15, "{material}: {value} ± {error}");
        }
    }
}

/// In a closed box whose walls reflect the share ρ and emit L, every point has radiance L / (1 − ρ).
#[test]
fn a_closed_box_is_a_geometric_series() {
    let text = r#"
        LookAt 0 0 -0.5  0 0.3 1  0 1 0
        Camera "perspective" "float fov" 70
        Integrator "path" "integer maxdepth" 100
        Sampler "sobol"
        WorldBegin
        Material "diffuse" "rgb reflectance" [0.5 0.5 0.5]
        AreaLightSource "diffuse" "rgb L" [1 1 1]
        ReverseOrientation
        Shape "sphere" "float radius" 3
        "#;
    let film = render(&load(text, &overrides([16, 16], 256)));
    for (value, error) in mean(&film) {
        assert!((value - 2.0).abs() < 5.0 * error + 2e-3, "{value} ± {error}");
    }
}
