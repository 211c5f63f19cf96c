//! Pictures of Markov chains, as their users meet them.

use super::support::{BALL, Folder};

const PSSMLT: &str = "--integrator pssmlt --chains 64 --bootstrap-samples 3000 --spp 20";

#[test]
fn chains_render_and_report() {
    let folder = Folder::with_scene(BALL);
    let said = folder.run(&format!("render scene.pbrt -o a.exr --report a.json {PSSMLT}")).ends_with(0);
    for words in ["large step", "small step", "64 chains in 16 batches", "20 mutations per pixel"] {
        assert!(said.stdout.contains(words), "`{words}` is not in {}", said.stdout);
    }
    let report = folder.json("a.json");
    assert_eq!(report["settings"]["integrator"], "pssmlt");
    assert_eq!(report["settings"]["metropolis"]["direct_light"], "inside");
    assert!(report["settings"]["technique"].is_null());
    let chains = &report["chains"];
    assert_eq!(chains["mutations"], 16 * 12 * 20);
    assert_eq!(chains["is_dark"], false);
    assert!(chains["normalization"]["standard_error"].as_f64().unwrap() > 0.0);
    for kind in [0, 1] {
        let acceptance = &chains["kinds"][kind][1]["acceptance"];
        assert!(acceptance["accepted"].as_u64().unwrap() > 0, "{chains}");
    }
    assert!(report["relative_error"].as_f64().unwrap() > 0.0);
    let image = folder.image("a.exr");
    let variance = image.channel("Variance.G").unwrap();
    assert!((0..12).all(|y| image.pixel(8, y)[variance] > 0.0));
}

#[test]
fn chains_rest_and_are_put_together() {
    let folder = Folder::with_scene(BALL);
    for more in ["", "--direct-light separate --two-stage"] {
        let options = format!("{PSSMLT} {more}");
        folder.run(&format!("render scene.pbrt -o whole.exr {options}")).ends_with(0);
        // Begun for fewer mutations, and gone on with for more.
        let fewer = options.replace("--spp 20", "--spp 7");
        folder.run(&format!("render scene.pbrt -o part.luz {fewer} --threads 1")).ends_with(0);
        let sampler_spp = folder.run("render --resume part.luz --spp 20 -o resumed.exr");
        sampler_spp.ends_with(0);
        if more.is_empty() {
            assert_eq!(folder.image("whole.exr").data(), folder.image("resumed.exr").data(), "{more}");
        }
        for shard in ["1/3", "2/3", "3/3"] {
            let name = shard.replace('/', "-of-");
            folder.run(&format!("render scene.pbrt {options} --shard {shard} -o {name}.luz")).ends_with(0);
        }
        folder.run("merge 3-of-3.luz 1-of-3.luz 2-of-3.luz -o merged.exr").ends_with(0);
        assert_eq!(folder.image("whole.exr").data(), folder.image("merged.exr").data(), "{more}");
        for shard in ["1/3", "2/3", "3/3"] {
            std::fs::remove_file(folder.path().join(format!("{}.luz", shard.replace('/', "-of-")))).unwrap();
        }
    }
}

#[test]
fn darkness_is_said_and_ends() {
    let dark = BALL.replace("[ 0.6 0.7 0.8 ]", "[ 0 0 0 ]").replace("[ 5 4 3 ]", "[ 0 0 0 ]");
    let folder = Folder::with_scene(&dark);
    for budget in ["", "--time 1h"] {
        let said = folder.run(&format!("render scene.pbrt -o a.exr --integrator pssmlt {budget}")).ends_with(0);
        said.complains(&["no light reaches the camera"]);
    }
    assert!(folder.image("a.exr").data().iter().all(|v| *v == 0.0));
}

#[test]
fn too_many_chains_are_said() {
    let folder = Folder::with_scene(BALL);
    folder
        .run("render scene.pbrt -o a.exr --integrator pssmlt --spp 1 --resolution 1x1 --bootstrap-samples 100")
        .ends_with(0)
        .complains(&["more chains (1024) than mutations (1)"]);
}

#[test]
fn what_does_not_go_together_is_refused() {
    let folder = Folder::with_scene(BALL);
    for (options, reason) in [
        ("--integrator pssmlt --adaptive 5%", "adaptive sampling does not go with the integrator `pssmlt`"),
        ("--integrator pssmlt --technique light", "a choice of techniques"),
        ("--integrator pssmlt --mis balance", "a choice of the heuristic"),
        ("--integrator pssmlt --roulette none", "a choice of roulette"),
        ("--integrator pssmlt --technique-images", "an image of each technique"),
        ("--integrator pssmlt --film gbuffer", "the film `gbuffer`"),
        ("--integrator pssmlt --chains 0", "`chains` must lie within 16"),
        ("--integrator pssmlt --chains 20 --batches 32", "`chains` must lie within 32"),
        ("--integrator pssmlt --batches 3", "within 16 and 1024"),
        ("--integrator pssmlt --bootstrap-samples 0", "`bootstrapsamples` must lie within 1"),
        ("--integrator pssmlt --large-step-probability 0", "chains never leave"),
        ("--integrator pssmlt --mutations lens:1", "a choice of mutations"),
        ("--integrator path --chains 32", "what is said of Markov chains"),
        ("--integrator path --small-step 0.01:0.1", "large or small steps"),
    ] {
        folder.run(&format!("render scene.pbrt -o a.exr {options}")).ends_with(3).complains(&[reason]);
    }
    for (options, reason) in [
        ("--mutations lense:1", "known are bidirectional"),
        ("--mutations bidirectional:0", "without bidirectional mutations"),
        ("--perturbations lens-area:2", "a share of the film's area"),
        ("--small-step 0.1:0.01", "small steps go from"),
        ("--direct-light outside", "inside, separate"),
        ("--chains many", "--chains"),
    ] {
        folder.run(&format!("render scene.pbrt -o a.exr --integrator mlt {options}")).ends_with(2).complains(&[reason]);
    }
    folder.run("trace scene.pbrt --pixel 3,3 --integrator pssmlt").ends_with(2).complains(&["no samples"]);
}

/// What pbrt-v4 says of its `mlt` is heeded by chains of other kinds, too, where they have it.
#[test]
fn settings_of_pbrt_are_heeded() {
    let mlt = r#"Integrator "mlt" "integer maxdepth" 3 "integer bootstrapsamples" 2000 "integer chains" 32
        "integer mutationsperpixel" 9 "float largestepprobability" 0.5 "float sigma" 0.02"#;
    let folder = Folder::with_scene(&BALL.replace(r#"Integrator "path" "integer maxdepth" 4"#, mlt));
    folder.run("render scene.pbrt -o a.exr --report a.json --integrator pssmlt").ends_with(0);
    let report = folder.json("a.json");
    assert_eq!(report["settings"]["max_depth"], 3);
    assert_eq!(report["settings"]["metropolis"]["chains"], 32);
    assert_eq!(report["settings"]["metropolis"]["bootstrap_samples"], 2000);
    assert_eq!(report["samples"], 9);
    folder.write("wrong.pbrt", BALL.replace(r#"Integrator "path" "integer maxdepth" 4"#, &mlt.replace("0.5", "0")));
    folder.run("render wrong.pbrt -o a.exr --integrator pssmlt").ends_with(3).complains(&["wrong.pbrt", "large steps"]);
}

#[test]
fn studies_compare_chains_with_paths() {
    let folder = Folder::with_scene(BALL);
    let chains = "integrator=path,pssmlt";
    folder.run(&format!("study scene.pbrt --spp 20 --seeds 2 --reference-spp 64 --quiet --vary {chains}")).ends_with(0);
    let report = folder.json("study.json");
    for variant in report["variants"].as_array().unwrap() {
        assert!(variant["summary"]["mse"]["value"].as_f64().unwrap() < 0.1, "{}", variant["name"]);
    }
}
