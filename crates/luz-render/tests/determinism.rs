//! The same bits, whatever the threads and the passes.

mod common;

use common::{load, overrides};
use luz_render::film::Film;
use luz_render::world::Loaded;
use luz_render::{Overrides, Renderer};
use luz_sample::mis::Heuristic;
use luz_sample::roulette::Roulette;

const SCENE: &str = r#"
    LookAt 0 2 -6  0 0.5 0  0 1 0
    Camera "perspective" "float fov" 40 "float lensradius" 0.05 "float focaldistance" 6
    PixelFilter "mitchell"
    Film "gbuffer"
    WorldBegin
    LightSource "infinite" "rgb L" [0.5 0.7 1]
    AttributeBegin
    AreaLightSource "diffuse" "rgb L" [9 8 7]
    Translate 1 2.5 0
    Shape "sphere" "float radius" 0.5
    AttributeEnd
    Material "coateddiffuse" "float roughness" 0.1
    Shape "bilinearmesh" "point3 P" [-3 0 -3  -3 0 3  3 0 -3  3 0 3]
    Material "dielectric"
    Translate 0 0.7 0
    Shape "sphere" "float radius" 0.7
    "#;

/// Ways to render that remember something from sample to sample.
fn ways() -> [(&'static str, Overrides); 4] {
    let plain = Overrides { filter: None, ..overrides([33, 17], 12) };
    let longer = Overrides { samples_per_pixel: Some(48), ..plain.clone() };
    [
        ("plain", plain),
        ("optimal weights", Overrides { heuristic: Some(Heuristic::Optimal), ..longer.clone() }),
        ("roulette by efficiency", Overrides { roulette: Some(Roulette::Efficiency), ..longer.clone() }),
        ("adaptive", Overrides { adaptive: Some(0.2), ..longer }),
    ]
}

fn loaded() -> Loaded {
    load(SCENE, &ways()[0].1)
}

fn bits(film: &Film) -> Vec<u32> {
    film.to_image().expect("it fits").data().iter().map(|v| v.to_bits()).collect()
}

fn with_threads(wishes: &Overrides, threads: usize, passes: &[u32]) -> Vec<u32> {
    let loaded = load(SCENE, wishes);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be had");
    pool.install(|| {
        let mut renderer = Renderer::new(&loaded.world, &loaded.camera, &loaded.settings);
        passes.iter().for_each(|&samples| renderer.pass(samples));
        assert!(renderer.is_finished());
        bits(renderer.film())
    })
}

#[test]
fn threads_and_passes_change_nothing() {
    for (way, wishes) in ways() {
        let alone = with_threads(&wishes, 1, &[48]);
        assert!(alone.iter().any(|&b| f32::from_bits(b) > 0.0));
        for threads in [2, 3, 7] {
            assert!(with_threads(&wishes, threads, &[48]) == alone, "{way}, {threads} threads");
            assert!(
                with_threads(&wishes, threads, &[1, 2, 4, 5, 36]) == alone,
                "{way}, {threads} threads, five passes"
            );
        }
    }
}

#[test]
fn a_crop_window_shows_what_the_frame_shows_there() {
    let whole = loaded();
    let mut part = loaded();
    part.settings.bounds = luz_render::film::PixelBounds { x0: 5, y0: 3, x1: 20, y1: 11 };
    let render = |l: &Loaded| common::render(l);
    let (whole, part) = (render(&whole), render(&part));
    for (i, pixel) in part.estimates().enumerate() {
        let (x, y) = (i % 15, i / 15);
        assert_eq!(Some(pixel), whole.estimates().nth((y + 3) * 33 + x + 5));
    }
}
