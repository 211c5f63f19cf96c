//! Lights of every kind, each in a world of its own.

use super::common::{load_description, overrides};
use glam::Vec2;
use luz_color::observer::y_bar;
use luz_color::{CIE_Y_INTEGRAL, LANES, SampledSpectrum, Wavelengths};
use luz_geometry::{Ray, ShapeId};
use luz_image::Image;
use luz_render::light::{AreaLight, Light, LightEnd, Place};
use luz_render::world::World;
use luz_sample::test_support::{Chi2Result, chi2_rectangle, chi2_sphere};
use std::fs;
use std::path::{Path, PathBuf};

/// A folder with the images that the lights name; all of one colour, so that brightness is luminance.
fn folder() -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("ends-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder for images");
    folder
}

fn write(folder: &Path, name: &str, [width, height]: [usize; 2], texel: impl Fn(usize, usize) -> f32) {
    let data = (0..width * height).flat_map(|i| [texel(i % width, i / width); 3]).collect();
    let image = Image::from_data(width, height, ["R", "G", "B"], data).expect("sizes fit");
    image.write(folder.join(name)).expect("an image can be written");
}

/// Names and scene texts.
pub const LIGHTS: [(&str, &str); 29] = [
    (
        "triangle",
        r#"AreaLightSource "diffuse" "rgb L" [2 3 4] Shape "trianglemesh" "point3 P" [-1 1.5 2  2 1.5 2  -1 3 1.5] "integer indices" [0 1 2]"#,
    ),
    (
        "triangle of two sides",
        r#"AreaLightSource "diffuse" "bool twosided" true Shape "trianglemesh" "point3 P" [-1 1.5 2  2 1.5 2  -1 3 1.5] "integer indices" [0 1 2]"#,
    ),
    (
        "turned triangle",
        r#"AreaLightSource "diffuse" ReverseOrientation Scale -1 1 2 Shape "trianglemesh" "point3 P" [-1 1.5 2  2 1.5 2  -1 3 1.5] "integer indices" [0 1 2]"#,
    ),
    (
        "curved patch",
        r#"AreaLightSource "diffuse" Shape "bilinearmesh" "point3 P" [-1 1.5 2  2 1.9 2  -1 3 1.5  2 3.5 1]"#,
    ),
    ("sphere", r#"AreaLightSource "diffuse" Translate 1.5 2.5 0 Shape "sphere" "float radius" 0.6"#),
    ("ellipsoid", r#"AreaLightSource "diffuse" Translate 1.5 2.5 0 Scale 0.5 1.5 1 Shape "sphere" "float radius" 0.6"#),
    ("inside of a sphere", r#"AreaLightSource "diffuse" ReverseOrientation Shape "sphere" "float radius" 4"#),
    (
        "disk",
        r#"AreaLightSource "diffuse" "bool twosided" true Translate 0 3 0 Rotate 90 1 0 0 Shape "disk" "float radius" 1.2"#,
    ),
    ("cylinder", r#"AreaLightSource "diffuse" Translate 0 2.5 0 Scale 1 0.5 1 Shape "cylinder" "float radius" 0.3"#),
    (
        "screen",
        r#"AreaLightSource "diffuse" "string filename" "wall.pfm" "bool twosided" true Shape "bilinearmesh" "point3 P" [-1 1.5 2  2 1.5 2  -1 3 1.5  2 3 1.5]"#,
    ),
    (
        "curved screen",
        r#"AreaLightSource "diffuse" "string filename" "wall.pfm" Shape "bilinearmesh" "point3 P" [-1 1.5 2  2 1.9 2  -1 3 1.5  2 3.5 1]"#,
    ),
    (
        "triangles of a screen",
        r#"AreaLightSource "diffuse" "string filename" "wall.pfm" Shape "trianglemesh" "point3 P" [-1 1.5 2  2 1.5 2  -1 3 1.5  2 3 1.5] "point2 uv" [0.1 0.2  0.9 0.1  0.3 0.9  0.95 0.8] "integer indices" [0 1 2  1 3 2]"#,
    ),
    (
        "globe",
        r#"AreaLightSource "diffuse" "string filename" "wall.pfm" Translate 1.5 2.5 0 Shape "sphere" "float radius" 0.6"#,
    ),
    (
        "lamp shade",
        r#"AreaLightSource "diffuse" "string filename" "wall.pfm" Translate 0 2.5 0 Rotate 30 0 1 0 Scale 1 0.5 1 Shape "cylinder" "float radius" 0.3"#,
    ),
    ("point", r#"LightSource "point" "rgb I" [3 2 1] "point3 from" [2 2 -2]"#),
    (
        "spot",
        r#"LightSource "spot" "point3 from" [-2 3 0] "point3 to" [0 0 0.5] "float coneangle" 50 "float conedeltaangle" 30"#,
    ),
    ("hard spot", r#"LightSource "spot" "point3 from" [-2 3 0] "point3 to" [0 0 0.5] "float conedeltaangle" 0"#),
    ("narrow spot", r#"LightSource "spot" "point3 from" [-2 3 0] "float coneangle" 8 "float conedeltaangle" 8"#),
    ("goniometric", r#"Translate 0 2 0 Rotate 50 1 2 3 LightSource "goniometric" "string filename" "lamp.pfm""#),
    (
        "projection",
        r#"Translate 0 2 0 Rotate 50 1 2 3 LightSource "projection" "string filename" "slide.pfm" "float fov" 60"#,
    ),
    (
        "stretched goniometric",
        r#"Translate 0 2 0 Rotate 50 1 2 3 Scale 1 2 0.5 LightSource "goniometric" "string filename" "lamp.pfm""#,
    ),
    (
        "stretched projection",
        r#"Translate 0 2 0 Rotate 50 1 2 3 Scale 1 2 0.5 LightSource "projection" "string filename" "slide.pfm" "float fov" 60"#,
    ),
    ("distant", r#"LightSource "distant" "rgb L" [0.3 0.4 0.3] "point3 from" [1 2 0]"#),
    ("infinite", r#"LightSource "infinite" "rgb L" [0.2 0.1 0.1]"#),
    ("sky", r#"Rotate 80 -1 0 0 LightSource "infinite" "string filename" "sky.pfm""#),
    ("sky of texels", r#"Rotate 80 -1 0 0 LightSource "infinite" "string filename" "sky.pfm" "string filter" "point""#),
    ("stretched sky", r#"Rotate 80 -1 0 0 Scale 1 2 0.5 LightSource "infinite" "string filename" "sky.pfm""#),
    ("octahedral sky", r#"Rotate 70 1 0 0 LightSource "infinite" "string filename" "lamp.pfm""#),
    (
        "portal",
        r#"Rotate 80 -1 0 0 LightSource "infinite" "string filename" "sky.pfm" "point3 portal" [-1.5 3 -1  1.5 3 -1  1.5 3 1.5  -1.5 3 1.5]"#,
    ),
];

/// The world of a light and a few small things far apart.
pub fn world(name: &str, light: &str) -> World {
    let apart = r#"AttributeBegin Translate 0 -5 0 Shape "sphere" "float radius" 0.01 AttributeEnd
        AttributeBegin Translate 3 -1 4 Shape "sphere" "float radius" 0.01 AttributeEnd"#;
    world_with(name, light, apart)
}

/// The world of a light and other things.
pub fn world_with(name: &str, light: &str, others: &str) -> World {
    let folder = folder();
    write(&folder, "wall.pfm", [6, 8], |x, y| match (x * 7 + y * 3) % 13 {
        0 => 20.0,
        n if n < 4 => 0.0,
        n => 0.1 * n as f32,
    });
    write(&folder, "lamp.pfm", [16, 16], |x, y| if (x + 3 * y) % 11 < 2 { 0.0 } else { 1.0 + ((x + y) % 5) as f32 });
    write(&folder, "slide.pfm", [96, 64], |x, y| if (x / 16 + y / 16) % 3 == 0 { 0.0 } else { 1.0 + (x % 7) as f32 });
    write(&folder, "sky.pfm", [32, 16], |x, y| if y < 9 { 1.0 + ((x / 3 + y) % 4) as f32 } else { 0.1 });
    let file = folder.join(format!("{}-{}.pbrt", name.replace(' ', "-"), others.len()));
    let text = format!("WorldBegin AttributeBegin {light} AttributeEnd {others}");
    fs::write(&file, text).expect("a scene can be written");
    let (description, _) = luz_scene::read(&file).unwrap_or_else(|errors| panic!("{errors}"));
    load_description(&description, &overrides([8, 8], 1)).world
}

/// A direction or a point drawn within rounding of a texel's border may fall into the next, which may be black.
pub const ROUNDING: f64 = 1e-9;

/// The end that a ray meets at the texture coordinates `uv` of a light, and the area of the world by area of the texture.
fn end_at(world: &World, number: u32, area: &AreaLight, uv: Vec2) -> Option<(LightEnd, f32)> {
    let (shape, primitive) = (world.accelerator().shape(ShapeId(area.shape)), area.primitive as usize);
    let footprint = shape.uv_footprint(primitive)?;
    let corners = footprint.corners();
    let turn = |i: usize| (corners[(i + 1) % corners.len()] - corners[i]).perp_dot(uv - corners[i]);
    if !(1..corners.len()).all(|i| turn(i).signum() == turn(0).signum()) {
        return None;
    }
    let point = shape.at_uv(primitive, uv)?;
    let ray = Ray::new(point.position + 0.01 * point.normal, -point.normal, 0.0);
    let found = world.interaction(&ray, &world.intersect(&ray)?);
    (found.light == Some(number)).then(|| (LightEnd::hit(number, &found.surface), point.area_by_uv))
}

/// Ends of a light that have a density, against it: points of surfaces by their texture coordinates, others by direction.
pub fn chi2_ends(
    world: &World,
    number: u32,
    sample: impl Fn(Vec2) -> Option<LightEnd>,
    pdf: impl Fn(&LightEnd) -> f64,
) -> Chi2Result {
    const SAMPLES: u64 = 10_000;
    match &world.lights()[number as usize] {
        Light::Area(area) => chi2_rectangle(
            |u| match sample(u)?.place {
                Place::Surface(point) => Some(point.uv),
                _ => None,
            },
            |uv| ROUNDING + end_at(world, number, area, uv).map_or(0.0, |(end, a)| pdf(&end) * f64::from(a)),
            [0.0, 1.0, 0.0, 1.0],
            [12, 16],
            SAMPLES,
            3,
        ),
        _ => chi2_sphere(
            |u| match sample(u)?.place {
                Place::Infinity(towards) => Some(towards),
                _ => None,
            },
            |w| ROUNDING + pdf(&LightEnd::escaped(number, w)),
            SAMPLES,
            3,
        ),
    }
}

/// Luminance, from a few wavelengths.
pub fn luminance(spectrum: SampledSpectrum, wavelengths: &Wavelengths) -> f64 {
    let pdf = wavelengths.pdf();
    let of = |i: usize| f64::from(spectrum[i] * y_bar().value(wavelengths.lambda[i]) / pdf[i]);
    (0..LANES).map(of).sum::<f64>() / (LANES as f64 * f64::from(CIE_Y_INTEGRAL))
}
