//! The same bits, whatever the threads and the passes.

mod common;

use common::load;
use common::ways::{SCENE, loaded, ways};
use luz_render::film::Film;
use luz_render::world::Loaded;
use luz_render::{Overrides, Renderer};

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
