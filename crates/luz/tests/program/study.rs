use super::support::{BALL, Folder, interrupt_soon};
use serde_json::Value;

const TINY: &str = "study scene.pbrt --spp 8 --seeds 2 --reference-spp 64 --quiet";

fn variants(report: &Value) -> &Vec<Value> {
    report["variants"].as_array().unwrap()
}

#[test]
fn a_study_writes_a_report_that_stands_alone_and_its_numbers() {
    let folder = Folder::with_scene(BALL);
    let said = folder
        .run("study scene.pbrt --vary sampler=independent,sobol --vary max-depth=1,3 --spp 8 --seeds 2 --reference-spp 64")
        .ends_with(0);
    assert!(said.stdout.contains("wrote study.html, study.json, study.csv"), "{}", said.stdout);
    assert!(said.stdout.contains("independent · max-depth 1"), "{}", said.stdout);
    assert_eq!(folder.files(), ["scene.pbrt", "study.csv", "study.html", "study.json"]);

    let report = folder.json("study.json");
    assert_eq!(report["interrupted"], false);
    assert_eq!(report["axes"][1]["name"], "max-depth");
    assert_eq!(report["reference"]["samples"], 64);
    assert!(report["reference"]["own_error"]["mse"].as_f64().unwrap() > 0.0);
    let names: Vec<&str> = variants(&report).iter().map(|v| v["name"].as_str().unwrap()).collect();
    assert_eq!(
        names,
        ["independent · max-depth 1", "independent · max-depth 3", "sobol · max-depth 1", "sobol · max-depth 3"]
    );
    for variant in variants(&report) {
        let summary = &variant["summary"];
        assert_eq!(summary["samples"], 8.0);
        for positive in ["seconds", "paths_per_second", "rays_per_second", "closest_rays_per_path"] {
            assert!(summary[positive].as_f64().unwrap() > 0.0, "{positive}: {summary}");
        }
        for interval in ["mse", "rel_mse", "efficiency", "brightness"] {
            let at = |end: &str| summary[interval][end].as_f64().unwrap();
            assert!(at("low") <= at("value") && at("value") <= at("high"), "{interval}: {summary}");
        }
        let runs = variant["runs"].as_array().unwrap();
        assert_eq!(runs.len(), 2);
        assert_eq!((&runs[0]["seed"], &runs[1]["seed"]), (&Value::from(0), &Value::from(1)));
        let rounds: Vec<u64> =
            runs[0]["checkpoints"].as_array().unwrap().iter().map(|c| c["rounds"].as_u64().unwrap()).collect();
        assert_eq!(rounds, [1, 2, 4, 8]);
    }
    // One eighth of the error is expected, but a few bright pixels carry most of it.
    let errors = &variants(&report)[1]["runs"][0]["checkpoints"];
    let ratio = errors[0]["mse"].as_f64().unwrap() / errors[3]["mse"].as_f64().unwrap();
    assert!(ratio > 2.0 && ratio < 32.0, "{ratio}");

    let csv = std::fs::read_to_string(folder.path().join("study.csv")).unwrap();
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines.len(), 1 + 4 * 2 * 4);
    assert!(
        lines[0].starts_with("variant,sampler,max-depth,seed,is_last,rounds,samples,seconds,mse,relmse,trimmed_relmse")
    );
    assert!(lines[1].starts_with("independent · max-depth 1,independent,1,0,0,1,1.0,"));

    let html = std::fs::read_to_string(folder.path().join("study.html")).unwrap();
    assert!(html.starts_with("<!doctype html>") && html.ends_with("</html>\n"));
    for name in names {
        assert!(html.contains(name), "{name}");
    }
    for outside in ["http:", "https:", "url("] {
        assert!(!html.contains(outside), "{outside}");
    }
    for wrong in ["NaN", ">inf"] {
        assert!(!html.contains(wrong), "{wrong}");
    }
}

#[test]
fn errors_are_those_that_compare_finds() {
    let folder = Folder::with_scene(BALL);
    folder.run(&format!("{TINY} --vary sampler=sobol,halton --save-reference reference.exr")).ends_with(0);
    let own = folder.json("study.json")["reference"]["own_error"].clone();
    let report = folder.json("study.json");
    for (variant, name) in variants(&report).iter().zip(["sobol", "halton"]) {
        for (run, seed) in variant["runs"].as_array().unwrap().iter().zip([0, 1]) {
            let options = format!("--spp 8 --sampler {name} --seed {seed}");
            folder.run(&format!("render scene.pbrt -o a.exr --quiet {options}")).ends_with(0);
            let compared = folder.run("compare a.exr reference.exr --json").ends_with(0).stdout;
            let compared: Value = serde_json::from_str(&compared).unwrap();
            for (of_study, of_compare) in [("mse", "mse"), ("rel_mse", "rel_mse")] {
                let measured = run["checkpoints"][3][of_study].as_f64().unwrap() + own[of_study].as_f64().unwrap();
                let expected = compared["mean"][of_compare].as_f64().unwrap();
                assert!((measured / expected - 1.0).abs() < 1e-4, "{name} {seed} {of_study}: {measured} {expected}");
            }
        }
    }
    // Kept and given back, the reference is the same, with what is known of its error.
    folder.run("study scene.pbrt --spp 8 --seeds 2 --quiet --vary sampler=sobol,halton --reference reference.exr -o again.html").ends_with(0);
    let again = folder.json("again.json");
    for measure in ["mse", "rel_mse"] {
        let at = |report: &Value| variants(report)[1]["summary"][measure]["value"].as_f64().unwrap();
        assert!((at(&again) / at(&report) - 1.0).abs() < 1e-4, "{measure}");
    }
}

#[test]
fn errors_do_not_depend_on_the_number_of_threads() {
    let folder = Folder::with_scene(BALL);
    let measured = |threads: u32| {
        folder.run(&format!("{TINY} --vary sampler=sobol --threads {threads}")).ends_with(0);
        variants(&folder.json("study.json"))[0]["summary"]["mse"].clone()
    };
    assert_eq!(measured(1), measured(3));
}

#[test]
fn techniques_are_shown_and_biases_found() {
    let folder = Folder::with_scene(BALL);
    folder.run(&format!("{TINY} --vary technique=both,bsdf --vary max-depth=4,0")).ends_with(0);
    let html = std::fs::read_to_string(folder.path().join("study.html")).unwrap();
    for part in ["BSDF alone", "Light alone", "Light’s share"] {
        assert!(html.contains(part), "{part}");
    }
    let report = folder.json("study.json");
    // Without any bounce, the ball is black: most of the error is bias, and the picture is darker.
    let summary = &variants(&report)[1]["summary"];
    assert!(summary["squared_bias"]["low"].as_f64().unwrap() > 0.5 * summary["mse"]["value"].as_f64().unwrap());
    assert!(summary["brightness"]["high"].as_f64().unwrap() < 0.0);
    assert!(html.contains("It is biased"));
}

#[test]
fn a_time_ends_each_render() {
    let folder = Folder::with_scene(BALL);
    folder
        .run("study scene.pbrt --vary sampler=stratified,sobol --time 300ms --seeds 2 --reference-spp 256 --quiet")
        .ends_with(0);
    let report = folder.json("study.json");
    for variant in variants(&report) {
        for run in variant["runs"].as_array().unwrap() {
            // A noisy machine may stretch a pass.
            let seconds = run["cost"]["seconds"].as_f64().unwrap();
            assert!(seconds > 0.05 && seconds < 3.0, "{seconds}");
            assert!(run["rounds"].as_u64().unwrap() > 4);
        }
    }
}

#[test]
fn one_seed_gives_no_intervals() {
    let folder = Folder::with_scene(BALL);
    folder
        .run("study scene.pbrt --vary sampler=sobol,halton --spp 4 --seeds 1 --reference-spp 16")
        .ends_with(0)
        .complains(&["warning: One seed says nothing"]);
    let report = folder.json("study.json");
    let summary = &variants(&report)[1]["summary"];
    assert!(summary["mse"]["high"].is_null() && summary["mse"]["value"].as_f64().unwrap() > 0.0);
    let html = std::fs::read_to_string(folder.path().join("study.html")).unwrap();
    assert!(html.contains("One seed says nothing") && !html.contains("inf"));
}

#[test]
fn what_cannot_be_varied_is_answered_with_what_can() {
    let folder = Folder::with_scene(BALL);
    for (options, reason) in [
        ("", "--vary"),
        ("--vary sampler", "AXIS=VALUE"),
        ("--vary sampler=", "no values"),
        ("--vary sampeler=sobol", "did you mean `sampler`?"),
        ("--vary colour=red", "known are technique"),
        ("--vary sampler=sobal", "did you mean `sobol`?"),
        ("--vary sampler=sobol,sobol", "twice"),
        ("--vary sampler=sobol --vary sampler=halton", "varied twice"),
        ("--vary spp=0", "above zero"),
        ("--vary sampler=sobol --time 0s", "above zero"),
        ("--vary sampler=sobol --time soon", "unit of time"),
        ("--vary sampler=sobol --seeds 0", "--seeds"),
        ("--vary sampler=sobol --reference-spp 1", "--reference-spp"),
        ("--vary sampler=sobol --reference-spp 8 --reference r.exr", "cannot be used with"),
        ("--vary sampler=sobol -o study.png", ".html"),
        ("--vary max-depth=1,2,3,4,5,6,7 --vary spp=1,2,3,4,5,6,7", "49 variants"),
    ] {
        folder.run(&format!("study scene.pbrt {options}")).ends_with(2).complains(&[reason]);
    }
    assert_eq!(folder.files(), ["scene.pbrt"]);
}

#[test]
fn what_is_missing_or_does_not_fit_is_said_before_the_work() {
    let folder = Folder::with_scene(BALL);
    let study = "study scene.pbrt --vary sampler=sobol --spp 100000000";
    folder.run("study nowhere.pbrt --vary sampler=sobol").ends_with(3).complains(&["nowhere.pbrt"]);
    folder.run(&format!("{study} -o no/study.html")).ends_with(4).complains(&["no/study.html", "no/study.json"]);
    folder.run(&format!("{study} --reference no.exr")).ends_with(5).complains(&["no.exr"]);
    folder.write("broken.exr", "this is not an image");
    folder.run(&format!("{study} --reference broken.exr")).ends_with(5).complains(&["broken.exr"]);
    luz::image::Image::new(5, 4, ["R", "G", "B"]).unwrap().write(folder.path().join("small.exr")).unwrap();
    folder.run(&format!("{study} --reference small.exr")).ends_with(5).complains(&["5×4", "16×12"]);
    luz::image::Image::new(16, 12, ["Z"]).unwrap().write(folder.path().join("depth.exr")).unwrap();
    folder.run(&format!("{study} --reference depth.exr")).ends_with(5).complains(&["R"]);
    assert_eq!(folder.files(), ["broken.exr", "depth.exr", "scene.pbrt", "small.exr"]);
}

#[cfg(unix)]
#[test]
fn ctrl_c_writes_the_report_with_what_there_is() {
    let folder = Folder::with_scene(BALL);
    let said = interrupt_soon(
        &folder,
        "study scene.pbrt --vary sampler=sobol,halton --time 300s --seeds 2 --reference-spp 16 --threads 1",
    )
    .ends_with(130)
    .complains(&["interrupted"]);
    assert!(said.stdout.contains("interrupted: 1 of 2 seeds"), "{}", said.stdout);
    assert_eq!(folder.files(), ["scene.pbrt", "study.csv", "study.html", "study.json"]);
    let report = folder.json("study.json");
    assert_eq!(report["interrupted"], true);
    assert!(variants(&report).iter().all(|v| v["summary"]["samples"].as_f64().unwrap() >= 1.0));
}

#[test]
fn everything_that_can_be_varied_renders() {
    let folder = Folder::with_scene(BALL);
    for vary in [
        "mis=balance,power:3,cutoff,maximum,average,optimal",
        "roulette=none,throughput,efficiency",
        "light-sampler=bvh,power,uniform",
        "mis-compensation=on,off",
        "emission-images=on,off",
        "adaptive=off,5%",
        "filter=box,triangle,gaussian,mitchell,sinc",
        "integrator=path,volpath",
        "spp=1,32",
        "pbrt-coats=off,on",
    ] {
        folder
            .run(&format!("study scene.pbrt --spp 40 --seeds 2 --reference-spp 8 --quiet --vary {vary}"))
            .ends_with(0);
        let report = folder.json("study.json");
        for variant in variants(&report) {
            assert!(variant["summary"]["paths_per_second"].as_f64().unwrap() > 0.0, "{vary}: {}", variant["name"]);
            assert!(variant["summary"]["mse"]["value"].is_f64(), "{vary}: {}", variant["name"]);
        }
    }
}
