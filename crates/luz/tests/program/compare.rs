use super::support::{BALL, Folder};
use luz::image::Image;

/// A gradient, brighter by a factor.
fn gradient(folder: &Folder, name: &str, factor: f32) {
    let data: Vec<f32> = (0..24 * 16 * 3).map(|i| factor * (i % 97) as f32 / 97.0).collect();
    Image::from_data(24, 16, ["R", "G", "B"], data).unwrap().write(folder.path().join(name)).unwrap();
}

#[test]
fn equal_images_do_not_differ() {
    let folder = Folder::new();
    gradient(&folder, "a.exr", 1.0);
    let said = folder.run("compare a.exr a.exr --json --threshold mse=0 --threshold ssim=0.999").ends_with(0);
    let json: serde_json::Value = serde_json::from_str(&said.stdout).unwrap();
    assert_eq!(json["mean"]["mse"], 0.0);
    assert_eq!(json["mean"]["ssim"], 1.0);
    assert_eq!(json["channels"].as_array().unwrap().len(), 3);
    assert!(json["failed"].as_array().unwrap().is_empty());
}

#[test]
fn metrics_are_printed_by_channel_and_over_all() {
    let folder = Folder::new();
    gradient(&folder, "a.exr", 1.1);
    gradient(&folder, "b.exr", 1.0);
    let said = folder.run("compare a.exr b.exr").ends_with(0).stdout;
    for part in ["MSE", "relMSE", "MAE", "PSNR", "SSIM", "ratio", "\nR ", "\nG ", "\nB ", "\nall "] {
        assert!(said.contains(part), "`{part}` is not in:\n{said}");
    }
    assert!(said.contains("1.1000"), "{said}");
}

#[test]
fn thresholds_decide_the_exit_code() {
    let folder = Folder::new();
    gradient(&folder, "a.exr", 1.1);
    gradient(&folder, "b.exr", 1.0);
    for holds in ["mse=0.1", "relmse=0.1", "mae=0.1", "psnr=20", "ssim=0.5"] {
        folder.run(&format!("compare a.exr b.exr --threshold {holds}")).ends_with(0);
    }
    for fails in ["mse=0.001", "relmse=0.001", "mae=0.01", "psnr=80", "ssim=1"] {
        let said = folder.run(&format!("compare a.exr b.exr --threshold {fails}")).ends_with(1).stdout;
        assert!(said.contains("differs: "), "{said}");
    }
}

#[test]
fn the_error_map_is_written_with_its_scale() {
    let folder = Folder::new();
    gradient(&folder, "a.exr", 1.5);
    gradient(&folder, "b.exr", 1.0);
    let said = folder.run("compare a.exr b.exr -o map.png --scale 0.25").ends_with(0).stdout;
    assert!(said.contains("wrote map.png: |image − reference|") && said.contains("2.5000e-1"), "{said}");
    assert_eq!((folder.image("map.png").width(), folder.image("map.png").height()), (24, 16));
    folder.run("compare a.exr b.exr -o difference.exr").ends_with(0);
    let difference = folder.image("difference.exr");
    let [r, ..] = difference.rgb().unwrap();
    let expected = 0.5 * 3.0 / 97.0;
    assert!((difference.pixel(1, 0)[r] - expected).abs() < 1e-6);
}

#[test]
fn what_cannot_be_compared_is_said() {
    let folder = Folder::new();
    gradient(&folder, "a.exr", 1.0);
    Image::new(5, 4, ["R", "G", "B"]).unwrap().write(folder.path().join("small.exr")).unwrap();
    folder.run("compare a.exr small.exr -o map.png").ends_with(5).complains(&["24×16", "5×4"]);
    folder.run("compare no.exr neither.exr").ends_with(5).complains(&["no.exr", "neither.exr"]);
    folder.write("broken.exr", "this is not an image");
    folder.run("compare a.exr broken.exr").ends_with(5).complains(&["broken.exr"]);
    folder.run("compare a.exr a.exr -o no/map.png").ends_with(4).complains(&["no/map.png"]);
    folder.run("compare a.exr a.exr --threshold z-test=0.01").ends_with(5).complains(&["Variance.R"]);
    assert_eq!(folder.files(), ["a.exr", "broken.exr", "small.exr"]);
}

#[test]
fn renderings_of_one_scene_pass_the_z_test_and_those_of_another_fail() {
    // 256 independent samples are normal enough for the tails that 576 tests ask for.
    let folder = Folder::with_scene(BALL);
    folder.write("other.pbrt", BALL.replace("0.8 0.3 0.1", "0.7 0.3 0.1"));
    let options = "--spp 256 --sampler independent";
    folder.run(&format!("render scene.pbrt -o a.exr --seed 1 {options}")).ends_with(0);
    folder.run(&format!("render scene.pbrt -o b.exr --seed 2 {options}")).ends_with(0);
    folder.run(&format!("render other.pbrt -o c.exr --seed 3 {options}")).ends_with(0);
    let said =
        folder.run("compare a.exr b.exr --threshold z-test=0.001 --threshold tile-z-test=0.001").ends_with(0).stdout;
    assert!(said.contains("no difference found"), "{said}");
    let said = folder.run("compare a.exr c.exr --threshold z-test=0.001").ends_with(1).stdout;
    assert!(said.contains("the means differ"), "{said}");
    folder.run("compare a.exr c.exr --threshold tile-z-test=0.001").ends_with(1);
}
