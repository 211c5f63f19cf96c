//! What checkpoints cost at 4K. It measures, and so wants a machine for itself and a release build:
//!
//! ```text
//! cargo test --release -p luz --test checkpoint_cost -- --ignored --nocapture
//! ```

use luz::Scene;
use luz::checkpoint::{Checkpoint, Identity};
use luz::render::{Overrides, Renderer};
use std::path::Path;
use std::time::{Duration, Instant};

const SCENE: &str = r#"
    Film "rgb" "integer xresolution" 3840 "integer yresolution" 2160
    Sampler "independent" "integer pixelsamples" 8
    Integrator "path" "integer maxdepth" 1
    PixelFilter "box"
    Camera "perspective" "float fov" 40
    WorldBegin
    LightSource "infinite" "rgb L" [ 1 0.9 0.8 ]
    Translate 0 0 5
    Shape "sphere"
"#;

/// The fastest of a few: other programs can make it slower, none faster.
fn fastest<T>(what: &str, mut work: impl FnMut() -> T) -> (Duration, T) {
    let mut best: Option<(Duration, T)> = None;
    for _ in 0..5 {
        let start = Instant::now();
        let result = work();
        let time = start.elapsed();
        if best.as_ref().is_none_or(|(least, _)| time < *least) {
            best = Some((time, result));
        }
    }
    let (time, result) = best.expect("it was done");
    println!("{what:<40} {:.3} s", time.as_secs_f64());
    (time, result)
}

#[test]
#[ignore = "measures times, for which it wants a machine for itself"]
fn a_4k_checkpoint_is_saved_and_loaded_within_a_second() {
    let scene = Scene::from_text("4k.pbrt", SCENE).expect("the scene is sound");
    let identity = Identity::new(&scene, Path::new("4k.pbrt"), &Overrides::default(), Vec::new()).expect("no files");
    let mut renderer = scene.renderer();
    renderer.pass(1);
    let folder = tempfile::tempdir().expect("there is room");
    let path = folder.path().join("4k.luz");

    let (copied, checkpoint) =
        fastest("copy the state (rendering waits)", || Checkpoint::of(identity.clone(), &renderer));
    let (encoded, bytes) =
        fastest("encode into memory, with checksum", || checkpoint.to_bytes().expect("it has a file"));
    println!("{:<40} {:.0} MB", "size", bytes.len() as f64 / 1e6);
    let (saved, ()) = fastest("write into the page cache", || std::fs::write(&path, &bytes).expect("there is room"));
    drop(bytes);
    let (synced, ()) =
        fastest("encode, write, wait for the disk, rename", || checkpoint.write(&path).expect("there is room"));
    drop(checkpoint);
    let (loaded, checkpoint) = fastest("read and check", || Checkpoint::read(&path).expect("it is sound"));
    let part = checkpoint.parts().first().expect("there is one");
    let mut other: Option<Renderer<'_>> = None;
    let (restored, ()) = fastest("restore", || {
        let renderer = other.insert(scene.renderer());
        renderer.restore(part).expect("it is a part of it");
    });
    assert!(other.is_some_and(|other| other.film() == renderer.film()));

    let every = 30.0;
    println!("{:<40} {:.2} %", "rendering waits, of 30 s", 100.0 * copied.as_secs_f64() / every);
    println!("{:<40} {:.3} s", "save, without the disk", (copied + encoded + saved).as_secs_f64());
    println!("{:<40} {:.3} s", "save, with the disk", (copied + synced).as_secs_f64());
    println!("{:<40} {:.3} s", "load", (loaded + restored).as_secs_f64());
    assert!(copied.as_secs_f64() < 0.01 * every, "{copied:?}");
    assert!(loaded + restored < Duration::from_secs(1), "{loaded:?} + {restored:?}");
    assert!(copied + encoded + saved < Duration::from_secs(1), "{copied:?} + {encoded:?} + {saved:?}");
}
