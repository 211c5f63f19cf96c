//! Every way of finding direct light finds the same light.

mod common;

use common::{load, mean, overrides, render};
use luz_render::integrator::Technique;
use luz_sample::mis::Heuristic;
use luz_sample::roulette::Roulette;

/// Lights and the material of the floor that they shine on.
fn scene(lights: &str, material: &str) -> String {
    format!(
        r#"
        LookAt 0 3 -6  0 0.5 0  0 1 0
        Camera "perspective" "float fov" 40
        Integrator "path" "integer maxdepth" 3
        Sampler "independent"
        WorldBegin
        {lights}
        {material}
        Shape "bilinearmesh" "point3 P" [-3 0 -3  -3 0 3  3 0 -3  3 0 3]
        Translate 0 0.7 0
        Shape "sphere" "float radius" 0.7
        "#
    )
}

const LIGHTS: [(&str, &str); 9] = [
    (
        "sphere",
        r#"AttributeBegin AreaLightSource "diffuse" "rgb L" [9 8 7] Translate 1 2.5 0 Shape "sphere" "float radius" 0.5 AttributeEnd"#,
    ),
    (
        "partial sphere",
        r#"AttributeBegin AreaLightSource "diffuse" "rgb L" [9 8 7] "bool twosided" true Translate 1 2.5 0 Shape "sphere" "float radius" 0.5 "float zmax" 0.2 "float phimax" 200 AttributeEnd"#,
    ),
    (
        "disk",
        r#"AttributeBegin AreaLightSource "diffuse" "rgb L" [9 8 7] Translate 0 3 0 Rotate 90 1 0 0 Shape "disk" "float radius" 0.8 AttributeEnd"#,
    ),
    (
        "cylinder",
        r#"AttributeBegin AreaLightSource "diffuse" "rgb L" [9 8 7] Translate 0 2.5 0 Shape "cylinder" "float radius" 0.2 AttributeEnd"#,
    ),
    (
        "triangles",
        r#"AttributeBegin AreaLightSource "diffuse" "rgb L" [9 8 7] "bool twosided" true Shape "trianglemesh" "point3 P" [-1 2.5 -1  1 2.5 -1  0 3 1  1 3.5 1] "integer indices" [0 1 2  1 2 3] AttributeEnd"#,
    ),
    (
        "rectangle",
        r#"AttributeBegin AreaLightSource "diffuse" "rgb L" [9 8 7] "bool twosided" true Shape "bilinearmesh" "point3 P" [-1 2.5 -1  1 2.5 -1  -1 2.5 1  1 2.5 1] AttributeEnd"#,
    ),
    (
        "patch",
        r#"AttributeBegin AreaLightSource "diffuse" "rgb L" [9 8 7] "bool twosided" true Shape "bilinearmesh" "point3 P" [-1 2.5 -1  1 2.9 -1  -1 2.5 1.4  1 3.5 1] AttributeEnd"#,
    ),
    ("uniform sky", r#"LightSource "infinite" "rgb L" [0.5 0.7 1]"#),
    (
        "two kinds",
        r#"LightSource "infinite" "rgb L" [0.1 0.1 0.2] AttributeBegin AreaLightSource "diffuse" "rgb L" [9 8 7] Translate 1 2.5 0 Shape "sphere" "float radius" 0.3 AttributeEnd"#,
    ),
];

const MATERIALS: [(&str, &str); 3] = [
    ("diffuse", r#"Material "diffuse" "rgb reflectance" [0.5 0.6 0.7]"#),
    (
        "rough gold",
        r#"Material "conductor" "spectrum eta" "metal-Au-eta" "spectrum k" "metal-Au-k" "float roughness" 0.25"#,
    ),
    ("rough coat", r#"Material "coateddiffuse" "rgb reflectance" [0.5 0.2 0.2] "float roughness" 0.2"#),
];

/// z-test of the whole picture's mean, each technique alone against both combined, over all channels of all scenes:
/// 9 × 3 × 2 × 3 comparisons at |z| < 4.8 are a false alarm in 4000 runs, and the seed is fixed.
#[test]
fn each_technique_alone_has_the_mean_of_both() {
    for (light, lights) in LIGHTS {
        for (name, material) in MATERIALS {
            let text = scene(lights, material);
            let measured = |technique: Technique, seed: u64| {
                let mut loaded = load(&text, &overrides([20, 16], 128));
                common::path(&mut loaded).technique = technique;
                loaded.settings.seed = seed;
                mean(&render(&loaded))
            };
            let both = measured(Technique::Both, 1);
            for technique in [Technique::Light, Technique::Bsdf] {
                let alone = measured(technique, 2);
                for channel in 0..3 {
                    let z = (alone[channel].0 - both[channel].0) / alone[channel].1.hypot(both[channel].1);
                    assert!(z.abs() < 4.8, "{light}, {name}, {technique}: z = {z}, {alone:?} against {both:?}");
                }
            }
        }
    }
}

/// Half a roof: shadow rays pass where paths do.
#[test]
fn techniques_agree_below_a_mix_with_nothing() {
    let roof = r#"
        MakeNamedMaterial "nothing" "string type" "interface"
        MakeNamedMaterial "paint" "string type" "diffuse"
        Material "mix" "string materials" ["nothing" "paint"] "float amount" 0.5
        Shape "bilinearmesh" "point3 P" [-9 2 -9  -9 2 9  9 2 -9  9 2 9]"#;
    let text = scene(&format!("{}{roof}", LIGHTS[0].1), MATERIALS[0].1);
    let measured = |technique: Technique, seed: u64| {
        let mut loaded = load(&text, &overrides([20, 16], 1024));
        common::path(&mut loaded).technique = technique;
        loaded.settings.seed = seed;
        mean(&render(&loaded))[1]
    };
    let (light, bsdf) = (measured(Technique::Light, 1), measured(Technique::Bsdf, 2));
    let z = (light.0 - bsdf.0) / light.1.hypot(bsdf.1);
    assert!(z.abs() < 4.8, "z = {z}: {light:?} against {bsdf:?}");
}

/// z-tests of the whole picture's mean against the balance heuristic: 9 × 3 × 7 comparisons at |z| < 4.5.
#[test]
fn every_heuristic_has_the_same_mean() {
    let heuristics = [
        Heuristic::Power(2.0),
        Heuristic::Power(4.0),
        Heuristic::Cutoff(0.1),
        Heuristic::Maximum,
        Heuristic::Average,
        Heuristic::Optimal,
    ];
    for (light, lights) in LIGHTS {
        for (name, material) in MATERIALS {
            let text = scene(lights, material);
            let measured = |heuristic: Heuristic, seed: u64| {
                let mut loaded = load(&text, &overrides([20, 16], 128));
                common::path(&mut loaded).heuristic = heuristic;
                loaded.settings.seed = seed;
                mean(&render(&loaded))[1]
            };
            let balance = measured(Heuristic::Balance, 1);
            for heuristic in heuristics {
                let other = measured(heuristic, 2);
                let z = (other.0 - balance.0) / other.1.hypot(balance.1);
                assert!(z.abs() < 4.5, "{light}, {name}, {heuristic}: z = {z}");
            }
        }
    }
}

/// A closed, bright box, a glass sphere and a glossy one in it: paths are long.
const BOX: &str = r#"
    LookAt 0 0 -0.95  0 0 0  0 1 0
    Camera "perspective" "float fov" 90
    Integrator "path" "integer maxdepth" 24
    Sampler "independent"
    WorldBegin
    AttributeBegin AreaLightSource "diffuse" "rgb L" [9 8 7] Translate 0.3 0.6 0 Shape "sphere" "float radius" 0.1 AttributeEnd
    Material "diffuse" "rgb reflectance" [0.8 0.8 0.7]
    AttributeBegin ReverseOrientation Shape "sphere" AttributeEnd
    AttributeBegin Material "dielectric" Translate -0.3 -0.3 0.2 Shape "sphere" "float radius" 0.3 AttributeEnd
    Material "conductor" "float roughness" 0.2
    Translate 0.4 -0.4 0.1 Shape "sphere" "float radius" 0.25
"#;

/// z-tests of the whole picture's mean against paths that don't end early, |z| < 4.
#[test]
fn roulette_and_splitting_keep_the_mean() {
    let measured = |roulette: Roulette, seed: u64| {
        let wanted = luz_render::Overrides { roulette: Some(roulette), seed: Some(seed), ..overrides([16, 12], 512) };
        mean(&render(&load(BOX, &wanted)))
    };
    let none = measured(Roulette::None, 1);
    for roulette in [Roulette::Throughput, Roulette::Efficiency] {
        let other = measured(roulette, 2);
        for channel in 0..3 {
            let z = (other[channel].0 - none[channel].0) / other[channel].1.hypot(none[channel].1);
            assert!(z.abs() < 4.0, "{roulette}: z = {z}");
            // The test sees errors of a few per cent.
            assert!(other[channel].1 < 0.01 * other[channel].0);
        }
    }
}

/// The checker itself: a lamp 2 % brighter is told apart.
#[test]
fn a_two_percent_error_is_found() {
    let brightness = |scale: &str| {
        let lamp = LIGHTS[0].1.replace(r#""rgb L""#, &format!(r#""float scale" {scale} "rgb L""#));
        mean(&render(&load(&scene(&lamp, MATERIALS[0].1), &overrides([20, 16], 4096))))[1]
    };
    let (right, wrong) = (brightness("1"), brightness("1.02"));
    assert!((wrong.0 - right.0) / right.1.hypot(wrong.1) > 4.8);
}

/// The weighted shares of the techniques are the picture, and each alone has its mean: |z| < 4.8 as above.
#[test]
fn pictures_of_the_techniques_add_up() {
    for (light, lights) in LIGHTS {
        let text = scene(lights, MATERIALS[1].1);
        let wanted = luz_render::Overrides { technique_images: true, ..overrides([20, 16], 256) };
        let film = render(&load(&text, &wanted));
        let image = film.to_image().expect("it fits");
        let index = |name: &str| image.channels().iter().position(|c| c == name).expect("a channel");
        let stride = image.channels().len();
        let column = |name: &str| image.data().iter().skip(index(name)).step_by(stride).map(|v| f64::from(*v));
        let sums = |name: &str| column(name).sum::<f64>();
        for c in ["R", "G", "B"] {
            let parts = column(&format!("BsdfWeighted.{c}")).zip(column(&format!("LightWeighted.{c}")));
            for ((bsdf, light), whole) in parts.zip(column(c)) {
                assert!((bsdf + light - whole).abs() <= 1e-5 + 1e-4 * whole, "{bsdf} + {light} ≠ {whole}");
            }
            // Light that only the BSDF finds is in one of the shares alone.
            let seen = sums(c);
            for alone in ["BsdfAlone", "LightAlone"] {
                assert!(sums(&format!("{alone}.{c}")) < 1.5 * seen, "{light}: {alone}");
            }
        }
    }
}
