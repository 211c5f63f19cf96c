use super::support::{BALL, Folder};

#[test]
fn a_scene_becomes_an_exr_and_a_png_beside_it() {
    let folder = Folder::with_scene(BALL);
    let said = folder.run("render scene.pbrt").ends_with(0);
    assert_eq!(folder.files(), ["ball.exr", "ball.png", "scene.pbrt"]);
    assert!(said.stdout.contains("wrote ball.exr, ball.png"), "{}", said.stdout);
    assert!(said.stdout.contains("4 samples per pixel"), "{}", said.stdout);

    let exr = folder.image("ball.exr");
    assert_eq!((exr.width(), exr.height()), (16, 12));
    for channel in ["R", "G", "B", "Variance.R", "Variance.G", "Variance.B"] {
        assert!(exr.channel(channel).is_some(), "{channel} is not in {:?}", exr.channels());
    }
    assert!(exr.data().iter().all(|v| v.is_finite()));
    let png = folder.image("ball.png");
    assert_eq!((png.width(), png.height()), (16, 12));
    // The sky, which the top row shows, is as bright as the scene says, in both. (Its mean over 64 samples has a
    // standard error of 0.008 in blue.)
    let sky = |image: &luz::image::Image, channel| (0..16).map(|x| image.pixel(x, 0)[channel]).sum::<f32>() / 16.0;
    for (image, tolerance) in [(&exr, 0.03), (&png, 0.035)] {
        for (channel, expected) in image.rgb().unwrap().into_iter().zip([0.6, 0.7, 0.8]) {
            assert!((sky(image, channel) - expected).abs() < tolerance, "{}", sky(image, channel));
        }
    }
}

#[test]
fn outputs_are_just_those_asked_for() {
    let folder = Folder::with_scene(BALL);
    folder.run("render scene.pbrt -o only.png").ends_with(0);
    assert_eq!(folder.files(), ["only.png", "scene.pbrt"]);
    folder.run("render scene.pbrt -o a.pfm -o b.hdr --output c.jpg -o d.tiff -o e.exr --spp 1").ends_with(0);
    assert_eq!(folder.files(), ["a.pfm", "b.hdr", "c.jpg", "d.tiff", "e.exr", "only.png", "scene.pbrt"]);
}

#[test]
fn a_film_without_a_name_takes_the_scenes() {
    let folder = Folder::with_scene(&BALL.replace(r#""string filename" "ball.exr""#, ""));
    folder.run("render scene.pbrt --spp 1").ends_with(0);
    assert_eq!(folder.files(), ["scene.exr", "scene.pbrt", "scene.png"]);
}

#[test]
fn quiet_is_quiet() {
    let folder = Folder::with_scene(BALL);
    let said = folder.run("render scene.pbrt --quiet").ends_with(0);
    assert_eq!((said.stdout.as_str(), said.stderr.as_str()), ("", ""));
    assert_eq!(folder.files().len(), 3);
}

#[test]
fn options_override_the_scene() {
    let folder = Folder::with_scene(BALL);
    let options = "--spp 3 --resolution 20x10 --seed 7 --threads 1 --max-depth 2 --sampler independent --integrator path \
        --filter gaussian --film gbuffer --simd scalar";
    folder.run(&format!("render scene.pbrt -o a.exr --report a.json {options}")).ends_with(0);
    let image = folder.image("a.exr");
    assert_eq!((image.width(), image.height()), (20, 10));
    for channel in ["Albedo.R", "Ns.X", "P.Z", "Z"] {
        assert!(image.channel(channel).is_some(), "{channel} is not in {:?}", image.channels());
    }
    let report = folder.json("a.json");
    let settings = &report["settings"];
    assert_eq!(settings["resolution"], serde_json::json!([20, 10]));
    assert_eq!(settings["samples_per_pixel"], 3);
    assert_eq!(settings["seed"], 7);
    assert_eq!(settings["max_depth"], 2);
    assert_eq!(settings["sampler"], "independent");
    assert_eq!(settings["film"], "gbuffer");
    assert_eq!(report["threads"], 1);
    assert_eq!(report["simd"], "scalar");
}

#[test]
fn a_crop_has_the_pixels_of_the_whole() {
    let folder = Folder::with_scene(BALL);
    folder.run("render scene.pbrt -o whole.exr").ends_with(0);
    for crop in ["4,12,3,9", "0.25,0.75,0.25,0.75"] {
        folder.run(&format!("render scene.pbrt -o part.exr --crop {crop}")).ends_with(0);
        let (whole, part) = (folder.image("whole.exr"), folder.image("part.exr"));
        assert_eq!((part.width(), part.height()), (8, 6), "{crop}");
        for y in 0..6 {
            for x in 0..8 {
                assert_eq!(part.pixel(x, y), whole.pixel(x + 4, y + 3), "{crop} {x} {y}");
            }
        }
    }
}

#[test]
fn exposure_changes_the_png_but_not_the_exr() {
    let folder = Folder::with_scene(BALL);
    folder.run("render scene.pbrt -o a.exr -o a.png").ends_with(0);
    folder.run("render scene.pbrt -o b.exr -o b.png --exposure -2").ends_with(0);
    assert_eq!(folder.image("a.exr"), folder.image("b.exr"));
    let ratio = folder.image("b.png").pixel(0, 0)[1] / folder.image("a.png").pixel(0, 0)[1];
    assert!((ratio - 0.25).abs() < 0.02, "{ratio}");
}

#[test]
fn the_report_says_what_it_was_and_what_it_cost() {
    let folder = Folder::with_scene(BALL);
    folder.run("render scene.pbrt --report report.json").ends_with(0);
    let report = folder.json("report.json");
    assert_eq!(report["stopped"], "finished");
    assert_eq!(report["samples"], 4);
    assert_eq!(report["paths"], 16 * 12 * 4);
    assert_eq!(report["dropped_samples"]["not_finite"], 0);
    assert_eq!(report["settings"]["seed"], 0);
    assert_eq!(report["world"]["shapes"]["sphere"]["shapes"], 2);
    for seconds in ["load", "build", "render"] {
        assert!(report["seconds"][seconds].as_f64().unwrap() >= 0.0, "{seconds}");
    }
    for positive in ["rays", "rays_per_second", "paths_per_second", "relative_error", "threads"] {
        assert!(report[positive].as_f64().unwrap() > 0.0, "{positive}: {}", report[positive]);
    }
    for channel in 0..3 {
        assert!(report["mean_rgb"][channel].as_f64().unwrap() > 0.1);
        assert!(report["mean_rgb_standard_error"][channel].as_f64().unwrap() > 0.0);
    }
    assert_eq!(report["outputs"], serde_json::json!(["ball.exr", "ball.png"]));
    assert_eq!(report["version"], env!("CARGO_PKG_VERSION"));
}

#[test]
fn one_sample_knows_no_error_and_says_so() {
    let folder = Folder::with_scene(BALL);
    let said = folder.run("render scene.pbrt --spp 1 --report report.json").ends_with(0);
    assert!(said.stdout.contains("error not yet known"), "{}", said.stdout);
    assert!(folder.json("report.json")["relative_error"].is_null());
}

#[test]
fn the_scenes_of_the_project_render() {
    let scenes = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let mut count = 0;
    for entry in std::fs::read_dir(&scenes).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "pbrt") {
            let folder = Folder::new();
            let command = format!("render {} --spp 2 --resolution 32x24", path.display());
            let said = folder.run(&command).ends_with(0);
            assert_eq!(said.stderr, "", "{}", path.display());
            assert_eq!(folder.files().len(), 2);
            count += 1;
        }
    }
    assert!(count >= 4);
}
