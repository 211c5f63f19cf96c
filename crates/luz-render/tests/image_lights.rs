//! Lights that shine with an image: every way of finding them finds the same light, and they have their power.

mod common;

use common::{load_description, mean, overrides, render};
use glam::{Vec2, Vec3};
use luz_color::Wavelengths;
use luz_geometry::{Ray, Reference};
use luz_image::Image;
use luz_render::integrator::Technique;
use luz_render::light::{Combination, EmittedSpectrum, LightSampler};
use luz_sample::Samples;
use luz_sample::random::Random;
use luz_sample::warp::uniform_sphere;
use std::fs;
use std::path::PathBuf;

/// A folder with the images that the scenes name.
fn folder() -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("image-lights-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder for images");
    // Mostly dim, partly black, with a few bright texels.
    let wall = |x: usize, y: usize| match (x * 7 + y * 3) % 13 {
        0 => [40.0, 20.0, 8.0],
        n if n < 5 => [0.0; 3],
        n => [0.05 * n as f32, 0.1, 0.3],
    };
    // A sun in a sky above dark ground, around +z.
    let sky = |x: usize, y: usize| match (x, y) {
        (20, 5) => [9000.0, 8000.0, 6000.0],
        (_, y) if y < 8 => [0.3, 0.4, 0.6],
        _ => [0.05, 0.04, 0.03],
    };
    write(&folder, "wall.pfm", [12, 8], wall);
    write(&folder, "sky.pfm", [32, 16], sky);
    write(&folder, "octahedral.pfm", [16, 16], |x, y| if (x, y) == (9, 5) { [900.0; 3] } else { wall(x, y) });
    folder
}

fn write(folder: &std::path::Path, name: &str, [width, height]: [usize; 2], texel: impl Fn(usize, usize) -> [f32; 3]) {
    let data = (0..width * height).flat_map(|i| texel(i % width, i / width)).collect();
    let image = Image::from_data(width, height, ["R", "G", "B"], data).expect("sizes fit");
    image.write(folder.join(name)).expect("an image can be written");
}

const LIGHTS: [(&str, &str); 13] = [
    ("sky", r#"Rotate 90 -1 0 0 LightSource "infinite" "string filename" "sky.pfm""#),
    ("sky of texels", r#"Rotate 90 -1 0 0 LightSource "infinite" "string filename" "sky.pfm" "string filter" "point""#),
    ("octahedral sky", r#"Rotate 70 1 0 0 LightSource "infinite" "string filename" "octahedral.pfm""#),
    (
        "interpolated octahedral sky",
        r#"Rotate 70 1 0 0 LightSource "infinite" "string filename" "octahedral.pfm" "string filter" "bilinear""#,
    ),
    (
        "portal",
        r#"Rotate 90 -1 0 0 LightSource "infinite" "string filename" "sky.pfm" "point3 portal" [-1.5 3 -1  1.5 3 -1  1.5 3 1.5  -1.5 3 1.5]"#,
    ),
    (
        "portal of one brightness",
        r#"LightSource "infinite" "rgb L" [2 3 4] "point3 portal" [-1.5 3 -1  1.5 3 -1  1.5 3 1.5  -1.5 3 1.5]"#,
    ),
    (
        "rectangle",
        r#"AreaLightSource "diffuse" "string filename" "wall.pfm" "bool twosided" true Shape "bilinearmesh" "point3 P" [-1 1.5 2  2 1.5 2  -1 3 1.5  2 3 1.5]"#,
    ),
    (
        "curved patch with part of the image",
        r#"AreaLightSource "diffuse" "string filename" "wall.pfm" "bool twosided" true Shape "bilinearmesh" "point3 P" [-1 1.5 2  2 1.9 2  -1 3 1.5  2 3.5 1] "point2 uv" [0.1 0.2  0.9 0.1  0.3 0.9  0.8 0.8]"#,
    ),
    (
        "triangles",
        r#"AreaLightSource "diffuse" "string filename" "wall.pfm" "bool twosided" true Shape "trianglemesh" "point3 P" [-1 1.5 2  2 1.5 2  -1 3 1.5  2 3 1.5] "point2 uv" [0.1 0.2  0.9 0.1  0.3 0.9  1.2 0.8] "integer indices" [0 1 2  1 3 2]"#,
    ),
    (
        "sphere",
        r#"AreaLightSource "diffuse" "string filename" "wall.pfm" Translate 1.5 2.5 0 Shape "sphere" "float radius" 0.6"#,
    ),
    (
        "disk",
        r#"AreaLightSource "diffuse" "string filename" "wall.pfm" Translate 0 3 0 Rotate 90 1 0 0 Shape "disk" "float radius" 1.2 "float innerradius" 0.2"#,
    ),
    (
        "stretched cylinder",
        r#"AreaLightSource "diffuse" "string filename" "wall.pfm" Translate 0 2.5 0 Rotate 30 0 1 0 Scale 1 0.5 1 Shape "cylinder" "float radius" 0.3"#,
    ),
    (
        "near wall",
        r#"AreaLightSource "diffuse" "string filename" "wall.pfm" "bool twosided" true Shape "bilinearmesh" "point3 P" [-3 0.01 -0.8  3 0.01 -0.8  -3 2 -0.8  3 2 -0.8]"#,
    ),
];

fn scene(light: &str) -> String {
    format!(
        r#"
        LookAt 0 3 -6  0 0.5 0  0 1 0
        Camera "perspective" "float fov" 40
        Integrator "path" "integer maxdepth" 2
        Sampler "independent"
        WorldBegin
        AttributeBegin {light} AttributeEnd
        Material "diffuse" "rgb reflectance" [0.5 0.6 0.7]
        Shape "bilinearmesh" "point3 P" [-3 0 -3  -3 0 3  3 0 -3  3 0 3]
        Material "conductor" "float roughness" 0.3
        Translate 0 0.7 0
        Shape "sphere" "float radius" 0.7
        "#
    )
}

fn measure(light: &str, technique: Technique, sampler: LightSampler, samples: u32, seed: u64) -> [(f64, f64); 3] {
    let file = folder().join(format!("{technique}-{sampler}-{samples}-{seed}-{}.pbrt", light.len()));
    fs::write(&file, scene(light)).expect("a scene can be written");
    let (description, _) = luz_scene::read(&file).unwrap_or_else(|errors| panic!("{errors}"));
    let wishes = luz_render::Overrides { light_sampler: Some(sampler), ..overrides([16, 12], samples) };
    let mut loaded = load_description(&description, &wishes);
    common::path(&mut loaded).technique = technique;
    loaded.settings.seed = seed;
    mean(&render(&loaded))
}

/// z-test of the whole picture's mean, `bsdf` alone against `light` alone and both combined: 13 × 2 × 3 comparisons at
/// |z| < 4.5 are a false alarm in 1900 runs, and the seeds are fixed. Suns are hardly ever found by `bsdf` alone: light
/// alone is compared with both for them.
#[test]
fn techniques_agree() {
    for (name, light) in LIGHTS {
        let is_sunny = name.contains("sky");
        let both = measure(light, Technique::Both, LightSampler::Bvh, 200, 1);
        let alone = measure(light, Technique::Light, LightSampler::Bvh, 200, 2);
        let bsdf = measure(light, Technique::Bsdf, LightSampler::Bvh, if is_sunny { 16 } else { 800 }, 3);
        for c in 0..3 {
            assert!(both[c].0 > 0.0, "{name}");
            let z = |a: [(f64, f64); 3], b: [(f64, f64); 3]| (a[c].0 - b[c].0) / a[c].1.hypot(b[c].1);
            assert!(z(both, alone).abs() < 4.5, "{name}: both {both:?}, light {alone:?}");
            assert!(is_sunny || z(bsdf, alone).abs() < 4.5, "{name}: bsdf {bsdf:?}, light {alone:?}");
        }
    }
}

fn loaded(light: &str, sampler: LightSampler) -> luz_render::world::Loaded {
    let file = folder().join(format!("loaded-{}-{sampler}.pbrt", light.len()));
    fs::write(
        &file,
        format!(
            r#"WorldBegin AttributeBegin {light} AttributeEnd Translate 0 -9 0 Shape "sphere" "float radius" 0.01"#
        ),
    )
    .expect("a scene can be written");
    let (description, _) = luz_scene::read(&file).unwrap_or_else(|errors| panic!("{errors}"));
    load_description(&description, &luz_render::Overrides { light_sampler: Some(sampler), ..overrides([8, 8], 1) })
}

/// From a point below: what is drawn has the density that is said of it where a ray meets it, the probabilities of all
/// lights add up to one, and the densities integrate to one (within 6 %: few directions meet a bright texel).
#[test]
fn densities_are_those_of_the_samples() {
    let reference = Reference::surface(Vec3::new(0.3, 0.2, 0.1), Vec3::Y);
    let wavelengths = Wavelengths::sample_visible(0.3);
    for (name, light) in LIGHTS {
        let world = loaded(light, LightSampler::Bvh).world;
        let emitted = EmittedSpectrum::default();
        let combination = Combination::WithBsdf;
        let context = world.light_context(&emitted, combination);
        let selection = world.light_selection();
        let density = |direction: Vec3| {
            let ray = Ray::new(reference.position, direction, 0.0);
            let found = world.intersect(&ray).map(|hit| world.interaction(&ray, &hit));
            match found.and_then(|i| i.light.map(|light| (light, i.surface))) {
                Some((number, surface)) => {
                    let area = world.area_light(number).expect("an area light");
                    selection.probability(combination, &reference, number as usize)
                        * area.pdf(context, &reference, &surface)
                }
                None => world
                    .infinite_lights()
                    .iter()
                    .map(|&number| {
                        selection.probability(combination, &reference, number as usize)
                            * world.lights()[number as usize].pdf_infinite(context, &reference, direction)
                    })
                    .sum(),
            }
        };
        let (mut off, mut drawn) = (0, 0);
        for i in 0..1000 {
            let u = Vec2::new((i as f32 * 0.618_034) % 1.0, (i as f32 + 0.5) / 1000.0);
            let Some((number, probability, u_x)) = selection.sample(combination, &reference, u.x) else { continue };
            let sample = world.lights()[number].sample(context, &reference, Vec2::new(u_x, u.y), &wavelengths);
            let Some(sample) = sample else { continue };
            // The far side of a shape is drawn, too, but not seen.
            let found = density(sample.direction);
            drawn += 1;
            off += i32::from((found / (probability * sample.pdf) - 1.0).abs() > 0.01);
        }
        let hidden = if name.contains("sphere") || name.contains("cylinder") { drawn * 6 / 10 } else { drawn / 40 };
        assert!(drawn > 100 && off <= hidden, "{name}: {off} of {drawn}");
        if name.contains("sky") || hidden > drawn / 2 {
            continue;
        }
        let n = 900;
        let total: f64 = (0..n * n)
            .map(|i| {
                let mut random = Random::new(4, 0, i);
                let cell = Vec2::new((i % n) as f32, (i / n) as f32);
                f64::from(density(uniform_sphere((cell + random.next_2d()) / n as f32)))
            })
            .sum::<f64>()
            * (4.0 * std::f64::consts::PI / (n * n) as f64);
        assert!((total - 1.0).abs() < 0.06, "{name}: {total}");
    }
}

/// Whatever is mixed, probabilities add up to one and are those of the choices.
#[test]
fn choices_among_near_and_far_lights_have_their_probabilities() {
    let more = format!(
        r#"AttributeBegin {} AttributeEnd LightSource "point" "point3 from" [2 2 -2] LightSource "distant" "rgb L" [0.3 0.3 0.3]
        LightSource "infinite" "rgb L" [0.2 0.1 0.1] {}"#,
        LIGHTS[0].1, LIGHTS[8].1
    );
    for (_, sampler) in LightSampler::ALL {
        let world = loaded(&more, sampler).world;
        let selection = world.light_selection();
        for combination in [Combination::Alone, Combination::WithBsdf] {
            for reference in [Reference::point(Vec3::Y), Reference::surface(Vec3::new(0.5, 0.0, -2.0), Vec3::Y)] {
                let of = |light: usize| selection.probability(combination, &reference, light);
                let sum: f32 = (0..world.lights().len()).map(of).sum();
                assert!((sum - 1.0).abs() < 1e-4, "{sampler} {combination:?}: {sum}");
                for i in 0..100 {
                    let u = (i as f32 + 0.5) / 100.0;
                    let (light, probability, _) = selection.sample(combination, &reference, u).expect("a light");
                    assert!((of(light) / probability - 1.0).abs() < 1e-4, "{sampler} {combination:?} {light}");
                }
            }
        }
    }
}

/// However lights are chosen, the picture is the same.
#[test]
fn light_samplers_agree() {
    let both = format!("AttributeBegin {} AttributeEnd {}", LIGHTS[0].1, LIGHTS[8].1);
    let more = format!(
        r#"{both} LightSource "point" "rgb I" [3 2 1] "point3 from" [2 2 -2] LightSource "spot" "point3 from" [-2 3 0] "point3 to" [0 0 0]
        LightSource "distant" "rgb L" [0.3 0.3 0.3] "point3 from" [1 2 0] LightSource "infinite" "rgb L" [0.2 0.1 0.1]"#
    );
    let [bvh, others @ ..] = [LightSampler::Bvh, LightSampler::Power, LightSampler::Uniform]
        .map(|sampler| measure(&more, Technique::Both, sampler, 400, 1));
    for other in others {
        for c in 0..3 {
            let z = (bvh[c].0 - other[c].0) / bvh[c].1.hypot(other[c].1);
            assert!(z.abs() < 4.5, "{bvh:?} {other:?}");
        }
    }
}

/// A lamp of so many lumens illuminates the inside of a ball so much, whatever its image and the part of it that it shows.
#[test]
fn power_is_that_of_the_part_that_is_shown() {
    let light = |uv: &str| {
        format!(
            r#"AreaLightSource "diffuse" "string filename" "wall.pfm" "float power" 5 Shape "trianglemesh" "point3 P" [-0.1 0 0  0.1 0 0  0 0.1 0] "point2 uv" [{uv}] "integer indices" [0 1 2]"#
        )
    };
    let luminance = |uv: &str| {
        let file = folder().join(format!("power-{}.pbrt", uv.len()));
        let text = format!(
            r#"LookAt 0 0 0.5  0 0 1  0 1 0 Camera "perspective" "float fov" 90 Sampler "independent" Integrator "path" "integer maxdepth" 1
            WorldBegin AttributeBegin {} AttributeEnd Material "diffuse" "rgb reflectance" [0.5 0.5 0.5] ReverseOrientation Shape "sphere" "float radius" 10"#,
            light(uv)
        );
        fs::write(&file, text).expect("a scene can be written");
        let (description, _) = luz_scene::read(&file).unwrap_or_else(|errors| panic!("{errors}"));
        let rgb = mean(&render(&load_description(&description, &overrides([16, 16], 256))));
        let of = |k: usize| [rgb[0], rgb[1], rgb[2]].map(|c| if k == 0 { c.0 } else { c.1 });
        let weighted = |c: [f64; 3]| 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
        (weighted(of(0)), weighted(of(1)))
    };
    let (a, b) = (luminance("0 0  1 0  0.5 1"), luminance("0.52 0.31  0.61 0.33  0.55 0.45"));
    assert!(((a.0 - b.0) / a.1.hypot(b.1)).abs() < 4.5 && a.0 > 0.0, "{a:?} {b:?}");
}

/// What shines within an object shines wherever the object is placed.
#[test]
fn emitters_within_objects_shine() {
    let lamp = r#"AttributeBegin AreaLightSource "diffuse" "rgb L" [9 5 2] Scale 1 1.3 1 Shape "sphere" "float radius" 0.2 AttributeEnd"#;
    let placed = format!(
        "AttributeBegin Translate 1 2 0 {lamp} AttributeEnd AttributeBegin Translate -1 2.5 1 {lamp} AttributeEnd"
    );
    let instances = format!(
        r#"ObjectBegin "lamp" {lamp} ObjectEnd AttributeBegin Translate 1 2 0 ObjectInstance "lamp" AttributeEnd
        AttributeBegin Translate -1 2.5 1 ObjectInstance "lamp" AttributeEnd"#
    );
    let [a, b] = [placed, instances].map(|light| measure(&light, Technique::Both, LightSampler::Bvh, 100, 1));
    assert!(a == b && a[0].0 > 0.0, "{a:?} {b:?}");
}

/// Texels that cannot shine are counted and said, and the rest shines.
#[test]
fn broken_texels_are_reported() {
    let folder = folder();
    write(&folder, "broken.pfm", [4, 4], |x, y| match (x, y) {
        (0, 0) => [-1.0, 1.0, 1.0],
        (1, 1) => [f32::NAN, 1.0, 1.0],
        (2, 1) => [1.0, f32::INFINITY, 1.0],
        _ => [1.0; 3],
    });
    for light in [
        r#"LightSource "infinite" "string filename" "broken.pfm""#,
        r#"AreaLightSource "diffuse" "string filename" "broken.pfm" Translate 0 3 0 Shape "sphere""#,
        r#"LightSource "goniometric" "string filename" "broken.pfm""#,
        r#"LightSource "projection" "string filename" "broken.pfm""#,
    ] {
        let file = folder.join("broken.pbrt");
        fs::write(&file, scene(light)).expect("a scene can be written");
        let (description, _) = luz_scene::read(&file).unwrap_or_else(|errors| panic!("{errors}"));
        let mut diagnostics = luz_scene::Diagnostics::default();
        let loaded = luz_render::world::build(
            &description,
            &overrides([8, 8], 16),
            luz_geometry::SimdLevel::Auto,
            &mut diagnostics,
        );
        let said = diagnostics.render(&description.sources);
        assert!(said.contains("1 texels are negative") && said.contains("2 texels are not finite"), "{said}");
        let film = render(&loaded.expect("warnings only"));
        assert_eq!(film.dropped(), 0, "{light}");
    }
}
