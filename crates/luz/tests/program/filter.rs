//! `luz filter` on images.

use super::support::Folder;
use luz::image::{BitDepth, Encoding, Format, Image, ReadOptions, SampleType, WriteOptions, metrics};

/// Soft hills with an edge, and a little texture.
fn picture(width: usize, height: usize) -> Image {
    let data = (0..width * height)
        .flat_map(|i| {
            let (x, y) = ((i % width) as f32, (i / width) as f32);
            let edge = if x + 0.3 * y > 0.6 * width as f32 { 0.4 } else { 0.0 };
            let texture = 0.03 * ((x * 1.7).sin() * (y * 2.3).cos());
            [0, 1, 2].map(|c| 0.25 + edge + texture + 0.05 * (0.1 * (x + y * c as f32)).sin())
        })
        .collect();
    let mut image = Image::from_data(width, height, ["R", "G", "B"], data).unwrap();
    image.metadata.encoding = Some(Encoding::Linear);
    image.metadata.stored_encoding = Some(Encoding::Srgb);
    image.metadata.sample_type = Some(SampleType::Unsigned(8));
    image
}

/// Writes stored values as they are.
fn write(folder: &Folder, name: &str, image: &Image) {
    let path = folder.path().join(name);
    image.write_with(&path, &WriteOptions::as_read(image, Format::from_path(&path).unwrap())).unwrap();
}

fn stored(folder: &Folder, name: &str) -> Image {
    Image::read_with(folder.path().join(name), &ReadOptions::stored()).unwrap()
}

fn psnr(a: &Image, b: &Image) -> f64 {
    metrics::compare(a, b, &Default::default()).unwrap().mean.psnr
}

#[test]
fn what_the_filter_leaves_alone_is_written_as_it_was_read() {
    let folder = Folder::new();
    for (name, bits) in [("a.png", 16), ("b.png", 8), ("c.tiff", 16), ("d.bmp", 8)] {
        let mut image = picture(40, 30);
        image.metadata.sample_type = Some(SampleType::Unsigned(bits));
        if name.ends_with("png") {
            image.metadata.text.insert("Author".to_owned(), "Ada".to_owned());
            image.metadata.icc_profile = Some(vec![1, 2, 3, 4]);
        }
        write(&folder, name, &image);
        folder.run(&format!("filter {name} -o out-{name} -s 2 -r 1e-7 --method exact -q")).ends_with(0);
        assert_eq!(stored(&folder, &format!("out-{name}")), stored(&folder, name), "{name}");
    }
    // Eight bits of light become floats: decoded, not as they are stored.
    folder.run("filter b.png -o b.exr -s 2 -r 1e-7 --method exact -q").ends_with(0);
    let linear = folder.image("b.png");
    assert!(folder.image("b.exr").data().iter().zip(linear.data()).all(|(a, b)| (a - b).abs() < 1e-6));
}

#[test]
fn halves_and_other_channels_are_kept() {
    let folder = Folder::new();
    let mut image = picture(24, 16);
    image.metadata = Default::default();
    let extra = Image::from_data(24, 16, ["Z", "Ns.X"], (0..24 * 16 * 2).map(|i| i as f32).collect()).unwrap();
    image.append("", &extra).unwrap();
    let options = WriteOptions { exr: luz::image::ExrPrecision::Half, ..Default::default() };
    image.write_with(folder.path().join("a.exr"), &options).unwrap();
    folder.run("filter a.exr -o b.exr -s 2 -r 0.2 -q").ends_with(0);
    let (a, b) = (stored(&folder, "a.exr"), stored(&folder, "b.exr"));
    assert_eq!(b.metadata.sample_type, Some(SampleType::Float(16)));
    let names = ["Z", "Ns.X"];
    assert_eq!(a.select(&names).unwrap().data(), b.select(&names).unwrap().data());
    assert_ne!(a.pixel(14, 8)[..3], b.pixel(14, 8)[..3]);
    // Only what is named is filtered.
    folder.run("filter a.exr -o c.exr -s 2 -r 1e4 --channels Z -q").ends_with(0);
    let c = stored(&folder, "c.exr");
    assert_eq!(a.select(&["R", "G", "B"]).unwrap().data(), c.select(&["R", "G", "B"]).unwrap().data());
    assert_ne!(a.select(&["Z"]).unwrap().data(), c.select(&["Z"]).unwrap().data());
    folder.run("filter a.exr -o d.exr -s 2 -r 1 --channels W").ends_with(5).complains(&["`W`", "Ns.X"]);
}

#[test]
fn every_method_and_strategy_comes_close_to_the_exact_one() {
    let folder = Folder::new();
    write(&folder, "a.png", &picture(64, 48));
    let options = "-s 4 -r 0.1 -q";
    folder.run(&format!("filter a.png -o exact.exr {options} --method exact")).ends_with(0);
    let exact = folder.image("exact.exr");
    let input = psnr(&folder.image("a.png"), &exact);
    for (arguments, least) in [
        ("--method auto --quality 55", 50.0),
        ("", 45.0),
        ("--strategy random --samples 8k", 38.0),
        ("--strategy stratified", 42.0),
        ("--strategy grid", 38.0),
        ("--strategy poisson-disk", 42.0),
        ("--strategy sobol --samples 64", 42.0),
        ("--strategy vogel --samples 2k", 45.0),
        ("--samples 2K --density uniform", 38.0),
        ("--samples 0.5k --regression", 38.0),
    ] {
        folder.run(&format!("filter a.png -o a.exr {options} {arguments} --report a.json")).ends_with(0);
        let found = psnr(&folder.image("a.exr"), &exact);
        assert!(found > least && found > input + 3.0, "{arguments}: {found} dB, unfiltered {input}");
        let report = folder.json("a.json");
        assert_eq!(report["command"], "filter");
        assert!(report["samples_per_pixel"].as_f64().unwrap() >= 1.0, "{report}");
    }
}

#[test]
fn bits_depend_on_the_seed_and_not_on_threads() {
    let folder = Folder::new();
    write(&folder, "a.png", &picture(70, 50));
    let run = |arguments: &str| {
        folder.run(&format!("filter a.png -o out.exr -s 3 -r 0.1 --strategy random -q {arguments}")).ends_with(0);
        std::fs::read(folder.path().join("out.exr")).unwrap()
    };
    let one = run("--threads 1 --seed 5");
    assert!(one == run("--threads 3 --seed 5"));
    assert!(one != run("--threads 3 --seed 6"));
}

#[test]
fn a_guide_decides_what_is_alike() {
    let folder = Folder::new();
    let image = picture(40, 32);
    write(&folder, "a.png", &image);
    folder.run("filter a.png -o plain.exr -s 3 -r 0.1 --method exact -q").ends_with(0);
    folder.run("filter a.png -o same.exr -s 3 -r 7 --guide a.png=0.1 --method exact -q").ends_with(0);
    assert!(psnr(&folder.image("plain.exr"), &folder.image("same.exr")) > 100.0);
    // A guide without edges is none; with an infinite range neither.
    let mut flat = image.clone();
    flat.data_mut().fill(0.5);
    write(&folder, "flat.png", &flat);
    folder.run("filter a.png -o flat.exr -s 3 -r 0.1 --guide flat.png --method exact -q").ends_with(0);
    folder.run("filter a.png -o blur.exr -s 3 -r inf --method exact -q").ends_with(0);
    assert!(psnr(&folder.image("flat.exr"), &folder.image("blur.exr")) > 100.0);
    assert!(psnr(&folder.image("flat.exr"), &folder.image("plain.exr")) < 45.0);
    // Channels of the input itself.
    folder.run("filter plain.exr -o own.exr -s 3 -r 1 --guide @R,G=0.1 --guide @B=inf --method exact -q").ends_with(0);
    write(&folder, "small.png", &picture(20, 32));
    folder.run("filter a.png -o b.png -s 3 -r 0.1 --guide small.png").ends_with(5).complains(&["20×32", "40×32"]);
    folder.run("filter a.png -o b.png -s 3 -r 0.1 --guide none.png").ends_with(5).complains(&["none.png"]);
    folder.run("filter a.png -o b.png -s 3 -r 0.1 --guide @Ns").ends_with(5).complains(&["`Ns`", "R, G, B"]);
    folder.run("filter a.png -o b.png -s 3 -r 0.1 --guide small.y4m").ends_with(2).complains(&["small.y4m"]);
    assert!(!folder.files().contains(&"b.png".to_owned()));
}

#[test]
fn scales_and_distances() {
    let folder = Folder::new();
    write(&folder, "a.png", &picture(32, 24));
    let mut hdr = picture(32, 24);
    hdr.data_mut().iter_mut().for_each(|v| *v = (12.0 * *v).exp());
    hdr.metadata = Default::default();
    hdr.write(folder.path().join("a.exr")).unwrap();
    // Ratios know no exposure: a factor before is a factor after.
    let mut bright = hdr.clone();
    bright.data_mut().iter_mut().for_each(|v| *v *= 64.0);
    bright.write(folder.path().join("b.exr")).unwrap();
    folder.run("filter a.exr -o log-a.exr -s 2 -r 0.4 --scale log --method exact -q").ends_with(0);
    folder.run("filter b.exr -o log-b.exr -s 2 -r 0.4 --scale log --method exact -q").ends_with(0);
    let (a, b) = (folder.image("log-a.exr"), folder.image("log-b.exr"));
    assert!(a.data().iter().zip(b.data()).all(|(a, b)| (64.0 * a / b - 1.0).abs() < 1e-3));
    let mut outputs = vec![std::fs::read(folder.path().join("a.png")).unwrap()];
    for arguments in
        ["-r 0.1", "-r 0.1 --distance l1", "-r 5 --distance delta-e", "-r 0.1 --scale linear", "-r 0.1 --scale log"]
    {
        folder.run(&format!("filter a.png -o b.png -s 3 {arguments} --method exact -q")).ends_with(0);
        let file = std::fs::read(folder.path().join("b.png")).unwrap();
        assert!(!outputs.contains(&file), "{arguments}");
        outputs.push(file);
    }
    // What is encoded already is as it is stored.
    folder.run("filter a.png -o c.png -s 3 -r 0.1 --scale encoded --method exact -q").ends_with(0);
    assert!(std::fs::read(folder.path().join("c.png")).unwrap() == outputs[1]);
}

#[test]
fn odd_pixels_and_odd_sizes() {
    let folder = Folder::new();
    let mut image = picture(24, 20);
    image.metadata = Default::default();
    image.pixel_mut(5, 5)[1] = f32::NAN;
    image.pixel_mut(15, 9)[0] = f32::INFINITY;
    image.write(folder.path().join("nan.exr")).unwrap();
    for method in ["exact", "sampled", "auto"] {
        let said = folder.run(&format!("filter nan.exr -o out.exr -s 2 -r 0.1 --method {method} --report r.json"));
        said.ends_with(0).complains(&["2 pixels are infinite or not a number"]);
        assert_eq!(folder.json("r.json")["excluded_pixels"], 2);
        let out = folder.image("out.exr");
        assert_eq!(out.non_finite_count(), 2, "{method}");
        assert!(out.pixel(5, 5)[1].is_nan());
    }
    for (width, height) in [(1, 1), (1, 50), (50, 1), (2, 2)] {
        write(&folder, "small.png", &picture(width, height));
        for method in ["exact", "sampled", "auto"] {
            folder.run(&format!("filter small.png -o out.png -s 30 -r 0.1 --method {method} -q")).ends_with(0);
            let out = folder.image("out.png");
            assert_eq!((out.width(), out.height()), (width, height));
        }
    }
}

#[test]
fn wrong_arguments_are_answered_before_any_work() {
    let folder = Folder::new();
    write(&folder, "a.png", &picture(8, 8));
    for arguments in [
        "-s 0 -r 0.1",
        "-s -1 -r 0.1",
        "-s nan -r 0.1",
        "-s inf -r 0.1",
        "-s 1e30 -r 0.1",
        "-s 2 -r 0",
        "-s 2 -r nan",
        "-s 2 -r -0.1",
        "-s 2",
        "-r 0.1",
        "-s 2 -r 0.1 --samples 0",
        "-s 2 -r 0.1 --samples k2",
        "-s 2 -r 0.1 --quality -5",
        "-s 2 -r 0.1 --quality 40 --samples k",
        "-s 2 -r 0.1 --method exact --strategy sobol",
        "-s 2 -r 0.1 --strategy bluenoise",
        "-s 2 -r 0.1 --guide a.png=x",
        "-s 2 -r 0.1 --sigma-temporal 2",
        "-s 2 -r 0.1 --threads 0",
        "-s 2 -r 0.1 --frames 5-1",
    ] {
        folder.run(&format!("filter a.png -o b.png {arguments}")).ends_with(2);
    }
    folder.run("filter a.png -o b.xyz -s 2 -r 1").ends_with(2).complains(&["xyz", "png", "y4m"]);
    folder.run("filter a.png -o b -s 2 -r 1").ends_with(2);
    folder.run("filter a.png -o b.y4m -s 2 -r 1").ends_with(2).complains(&["one image", "b.y4m"]);
    folder.run("filter a.y4m -o b.png -s 2 -r 1").ends_with(2).complains(&["a.y4m", "frames"]);
    assert_eq!(folder.files(), ["a.png"]);
}

#[test]
fn files_that_cannot_be_read_or_written_leave_nothing_behind() {
    let folder = Folder::new();
    write(&folder, "a.png", &picture(32, 32));
    let whole = std::fs::read(folder.path().join("a.png")).unwrap();
    folder.write("short.png", &whole[..whole.len() / 2]);
    folder.write("text.png", "not an image");
    std::fs::create_dir(folder.path().join("dir.png")).unwrap();
    let options = "-s 2 -r 0.1";
    folder.run(&format!("filter short.png -o b.png {options}")).ends_with(5).complains(&["short.png", "truncated"]);
    folder.run(&format!("filter text.png -o b.png {options}")).ends_with(5).complains(&["text.png"]);
    folder.run(&format!("filter none.png -o b.png {options}")).ends_with(5).complains(&["none.png"]);
    folder.run(&format!("filter a.png -o no/b.png {options} --report nowhere/r.json")).ends_with(4).complains(&[
        "no/b.png",
        "nowhere/r.json",
        "there is no folder",
    ]);
    folder.run(&format!("filter a.png -o dir.png {options}")).ends_with(4).complains(&["it is a folder"]);
    // A format that cannot hold the image.
    let layers = Image::new(4, 4, ["a", "b"]).unwrap();
    layers.write(folder.path().join("layers.exr")).unwrap();
    folder.run(&format!("filter layers.exr -o b.png {options}")).ends_with(4).complains(&["OpenEXR"]);
    assert_eq!(folder.files(), ["a.png", "dir.png", "layers.exr", "short.png", "text.png"]);
}

#[test]
fn light_beyond_white_is_clipped_with_a_word() {
    let folder = Folder::new();
    let mut image = picture(8, 8);
    image.metadata = Default::default();
    image.pixel_mut(3, 3).fill(40.0);
    image.write(folder.path().join("a.exr")).unwrap();
    folder.run("filter a.exr -o b.png -s 1 -r 0.1 --method exact").ends_with(0).complains(&["1 pixels", "luz tonemap"]);
    let deep = WriteOptions { bits: BitDepth::Sixteen, ..Default::default() };
    image.write_with(folder.path().join("deep.png"), &deep).unwrap();
    folder.run("filter deep.png -o c.jpg -s 1 -r 0.1 -q").ends_with(0);
    assert_eq!(stored(&folder, "c.jpg").metadata.sample_type, Some(SampleType::Unsigned(8)));
}

#[test]
fn the_help_is_a_short_manual() {
    let help = Folder::new().run("filter --help").ends_with(0).stdout;
    assert_eq!(help.matches("    luz filter ").count(), 3, "{help}");
    for part in [
        "--sigma-spatial",
        "--sigma-range",
        "--sigma-temporal",
        "--method",
        "--strategy",
        "--samples",
        "--quality",
        "--guide",
        "--distance",
        "--seed",
        "--report",
        "--threads",
        "--quiet",
        "BF[I](x)",
        "poisson-disk",
        "y4m",
        "ffmpeg",
    ] {
        assert!(help.contains(part), "`{part}` is not in:\n{help}");
    }
    assert!(help.lines().count() < 200);
}

#[test]
fn a_study_of_the_filter_is_one_page() {
    let folder = Folder::new();
    write(&folder, "a.png", &picture(60, 44));
    let options = "-s 2 --seeds 2 --samples k,2k --strategies random,vogel";
    let said = folder.run(&format!("study filter a.png {options} --kernel-at 30,20 -o s.html")).ends_with(0);
    assert!(said.stdout.contains("wrote s.html"), "{}", said.stdout);
    let html = std::fs::read_to_string(folder.path().join("s.html")).unwrap();
    for part in ["(30, 20)", "random", "vogel", "data:image/png;base64,", "<svg", "PSNR"] {
        assert!(html.contains(part), "`{part}` is not in the page");
    }
    folder.run(&format!("study filter a.png {options} --kernel-at 60,0 -o t.html")).ends_with(2).complains(&["60×44"]);
    folder.run("study filter a.png --samples 7 -o t.html").ends_with(2);
    folder.run("study filter none.png other.png -o t.html").ends_with(5).complains(&["none.png", "other.png"]);
    folder.run("study filter a.png -s 2 -o no/t.html").ends_with(4);
    folder.run("study filter").ends_with(2);
    assert_eq!(folder.files(), ["a.png", "s.html"]);
}
