//! `luz tonemap`, `luz enhance`, `luz denoise`.

use super::support::Folder;
use luz::image::{Image, metrics};

/// Two rooms, one a thousand times brighter, with the same texture.
fn rooms(folder: &Folder) {
    let data = (0..48 * 32)
        .flat_map(|i| {
            let (x, y) = (i % 48, i / 48);
            let light = if x < 24 { 0.02 } else { 20.0 } * if (x + y) % 2 == 0 { 1.0 } else { 0.8 };
            [light, 0.6 * light, 0.3 * light]
        })
        .collect();
    Image::from_data(48, 32, ["R", "G", "B"], data).unwrap().write(folder.path().join("rooms.exr")).unwrap();
}

#[test]
fn tone_mapping_shows_both_rooms() {
    let folder = Folder::new();
    rooms(&folder);
    folder.run("tonemap rooms.exr -o a.png --contrast 10 --sigma-spatial 0.05 --report a.json").ends_with(0);
    let image = folder.image("a.png");
    let ratio = |a: (usize, usize), b: (usize, usize)| image.pixel(a.0, a.1)[1] / image.pixel(b.0, b.1)[1];
    let contrast = ratio((40, 16), (8, 16));
    assert!((5.0..15.0).contains(&contrast), "{contrast}");
    for x in [8, 40] {
        let texture = ratio((x, 16), (x + 1, 16));
        assert!((texture - 1.25).abs() < 0.08, "{texture}");
    }
    assert_eq!(folder.json("a.json")["settings"]["contrast"], 10.0);
    let dark = folder.run("tonemap rooms.exr -o b.png --exposure -2 -q").ends_with(0);
    assert!(dark.stdout.is_empty());
    assert!(folder.image("b.png").pixel(40, 16)[0] < image.pixel(40, 16)[0]);
    folder.run("tonemap rooms.exr -o c.png --contrast 0.2").ends_with(2).complains(&["contrast"]);
    folder.run("tonemap none.exr -o c.png").ends_with(5);
    folder.run("tonemap rooms.exr -o no/c.png").ends_with(4);
    assert!(!folder.files().contains(&"c.png".to_owned()));
}

#[test]
fn enhancing_strengthens_texture_and_softening_takes_it_away() {
    let folder = Folder::new();
    let data = (0..40 * 30).flat_map(|i| [if (i % 40 + i / 40) % 2 == 0 { 0.30 } else { 0.34 }; 3]).collect();
    Image::from_data(40, 30, ["R", "G", "B"], data).unwrap().write(folder.path().join("a.png")).unwrap();
    let height = |name: &str| {
        let image = folder.image(name);
        (image.pixel(20, 15)[0] - image.pixel(21, 15)[0]).abs()
    };
    folder.run("enhance a.png -o more.png --strength 2 -q").ends_with(0);
    folder.run("enhance a.png -o less.png --strength -0.8 -q").ends_with(0);
    assert!(height("more.png") > 2.2 * height("a.png") && height("less.png") < 0.5 * height("a.png"));
    folder.run("enhance a.png -o b.png --strength nan").ends_with(2);
    folder.run("enhance a.png -o b.png -s 5000").ends_with(2);
}

#[test]
fn a_rendering_is_denoised_by_its_features() {
    let folder = Folder::new();
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/cornell-box.pbrt");
    let render =
        |arguments: &str| folder.run(&format!("render {scene} --resolution 96x96 -q {arguments}")).ends_with(0);
    render("--film gbuffer --spp 16 --sampler independent -o noisy.exr");
    render("--spp 144 --seed 3 -o truth.exr");
    folder.run("denoise noisy.exr -o clean.exr --report a.json").ends_with(0);
    let error = |name: &str| {
        let color = |name: &str| folder.image(name).select(&["R", "G", "B"]).unwrap();
        metrics::compare(&color(name), &color("truth.exr"), &Default::default()).unwrap().mean.rel_mse
    };
    assert!(error("clean.exr") < 0.3 * error("noisy.exr"), "{} {}", error("clean.exr"), error("noisy.exr"));
    let (noisy, clean) = (folder.image("noisy.exr"), folder.image("clean.exr"));
    let features = ["Albedo.R", "Ns.X", "Z"];
    assert_eq!(noisy.select(&features).unwrap().data(), clean.select(&features).unwrap().data());
    let variance = |image: &Image| image.select(&["Variance.G"]).unwrap().data().iter().sum::<f32>();
    assert!(variance(&clean) < 0.5 * variance(&noisy));
    // One sample says nothing of its variance.
    render("--film gbuffer --spp 1 -o one.exr");
    folder.run("denoise one.exr -o b.exr").complains(&["two samples per pixel"]);
    assert!(!folder.files().contains(&"b.exr".to_owned()));
}

#[test]
fn a_photograph_is_denoised_by_the_noise_it_shows() {
    let folder = Folder::new();
    let mut state = 1u32;
    let mut noise = || {
        // The sum of twelve uniform numbers is nearly normal.
        let mut sum = -6.0;
        for _ in 0..12 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            sum += (state >> 8) as f32 / (1 << 24) as f32;
        }
        0.05 * sum
    };
    let truth: Vec<f32> = (0..64 * 64).flat_map(|i| [if i % 64 < 32 { 0.25 } else { 0.6 }; 3]).collect();
    let noisy: Vec<f32> = truth.iter().map(|v| v + noise()).collect();
    let image = |data| Image::from_data(64, 64, ["R", "G", "B"], data).unwrap();
    image(truth).write(folder.path().join("truth.exr")).unwrap();
    image(noisy).write(folder.path().join("noisy.exr")).unwrap();
    folder.run("denoise noisy.exr -o clean.exr -q").ends_with(0);
    let error = |name: &str| {
        metrics::compare(&folder.image(name), &folder.image("truth.exr"), &Default::default()).unwrap().mean.mse
    };
    assert!(error("clean.exr") < 0.15 * error("noisy.exr"), "{} {}", error("clean.exr"), error("noisy.exr"));
    folder.run("denoise noisy.exr -o b.exr --noise 0").ends_with(2);
}
