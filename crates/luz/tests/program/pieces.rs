//! Renders that stop and go on, that are killed, that are put together from shards, that find no room on the disk: the picture
//! stays the same to the last bit.
#![cfg(unix)]

use super::support::{BALL, Folder, Ran};
use assert_cmd::cargo::cargo_bin;
use luz::checkpoint::Checkpoint;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

fn bytes(folder: &Folder, name: &str) -> Vec<u8> {
    std::fs::read(folder.path().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Starts the program here and does not wait.
fn start(folder: &Folder, arguments: &str) -> Child {
    Command::new(cargo_bin!("luz"))
        .current_dir(folder.path())
        .args(arguments.split_whitespace())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Waits until something is there.
#[track_caller]
fn await_that(what: &str, mut is_there: impl FnMut() -> bool) {
    let start = Instant::now();
    while !is_there() {
        assert!(start.elapsed() < Duration::from_secs(60), "{what} is not there after a minute");
        sleep(Duration::from_millis(10));
    }
}

/// A shell in this folder, in which `luz` is the program.
fn shell(folder: &Folder, script: &str) -> Ran {
    let program = cargo_bin!("luz").parent().unwrap();
    let path = std::env::var_os("PATH").unwrap_or_default();
    let path = std::env::join_paths([program.to_owned()].into_iter().chain(std::env::split_paths(&path))).unwrap();
    let output =
        Command::new("bash").current_dir(folder.path()).args(["-ec", script]).env("PATH", path).output().unwrap();
    Ran::new(output)
}

fn rounds(path: &Path) -> u32 {
    let checkpoint = Checkpoint::read(path).unwrap_or_else(|error| panic!("{} {error}", path.display()));
    checkpoint.parts()[0].header.rounds_done
}

/// Numbers that look random, from a seed.
struct Dice(u64);

impl Dice {
    fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % end
    }
}

/// Kills a render at random moments twenty times in a row, goes on each time with what the checkpoint has, and compares the end with
/// a render that nobody disturbed.
fn survives_kills(seed: u64, options: &str) {
    let folder = Folder::with_scene(BALL);
    let common = format!("--resolution 48x32 --threads 1 --quiet {options}");
    folder.run(&format!("render scene.pbrt --time 300ms -o no.exr --report speed.json {common}")).ends_with(0);
    let in_a_moment = folder.json("speed.json")["samples"].as_u64().unwrap();
    // Enough work for twenty kills, unless the machine has become much faster in the meantime.
    let has_survived = [9, 50, 250].into_iter().any(|moments| {
        let common = format!("--spp {} {common}", in_a_moment * moments);
        let has_survived = kill_twenty_times(&folder, &mut Dice(seed), &common);
        if has_survived {
            folder.run(&format!("render scene.pbrt -o whole.exr {common}")).ends_with(0);
            assert!(bytes(&folder, "killed.exr") == bytes(&folder, "whole.exr"), "{common}");
        }
        has_survived
    });
    assert!(has_survived, "it is always too fast to be killed");
    let names = ["killed.exr", "no.exr", "scene.pbrt", "speed.json", "state.luz", "whole.exr"];
    assert_eq!(folder.files(), names, "nothing else is left behind");
}

/// Leaves `killed.exr`; returns false where the render has come to its end before all kills.
fn kill_twenty_times(folder: &Folder, dice: &mut Dice, common: &str) -> bool {
    let checkpoint = folder.path().join("state.luz");
    let _ = std::fs::remove_file(&checkpoint);
    let (mut kills, mut gains, mut done) = (0, 0, 0);
    // On a machine that is busy, some may come before anything is done.
    while kills < 20 || gains < 5 {
        assert!(kills < 200, "nothing is ever kept");
        let from = if checkpoint.exists() { "--resume state.luz" } else { "scene.pbrt" };
        let mut child = start(folder, &format!("render {from} --checkpoint state.luz --every 15ms -o no.exr {common}"));
        sleep(Duration::from_millis(15 + dice.below(120)));
        child.kill().unwrap();
        let ran = Ran::new(child.wait_with_output().unwrap());
        if ran.code == Some(0) {
            return false;
        }
        assert_eq!((ran.code, ran.stderr.as_str()), (None, ""), "after {kills} kills");
        kills += 1;
        if checkpoint.exists() {
            let now = rounds(&checkpoint);
            assert!(now >= done, "{now} rounds, after {done}");
            gains += u32::from(now > done);
            done = now;
        }
    }
    folder.run(&format!("render --resume state.luz --checkpoint state.luz -o killed.exr {common}")).ends_with(0);
    true
}

#[test]
fn twenty_kills_change_no_bit() {
    survives_kills(1, "");
}

#[test]
fn twenty_kills_change_no_bit_of_what_has_been_learned() {
    survives_kills(2, "--sampler independent --roulette efficiency --film gbuffer");
}

#[test]
fn signals_write_everything_and_have_their_codes() {
    for (signal, code) in [("-TERM", 143), ("-INT", 130)] {
        let folder = Folder::with_scene(BALL);
        let arguments = "render scene.pbrt --spp 100000000 --threads 1 --checkpoint state.luz --every 20ms -o a.exr -o a.png \
                         --report a.json";
        let child = start(&folder, arguments);
        await_that("the checkpoint", || folder.path().join("state.luz").exists());
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        let ran = Ran::new(child.wait_with_output().unwrap()).ends_with(code).complains(&["interrupted"]);
        assert!(ran.stdout.contains("interrupted after"), "{}", ran.stdout);
        assert_eq!(folder.files(), ["a.exr", "a.json", "a.png", "scene.pbrt", "state.luz"]);
        let report = folder.json("a.json");
        assert_eq!(report["stopped"], "interrupted");
        let done = report["samples"].as_u64().unwrap();
        assert_eq!(u64::from(rounds(&folder.path().join("state.luz"))), done);
        // Going on for no more is the picture that was written.
        folder.run(&format!("render --resume state.luz --spp {done} -o b.exr")).ends_with(0);
        assert!(bytes(&folder, "a.exr") == bytes(&folder, "b.exr"));
    }
}

#[test]
fn resuming_for_more_samples_is_rendering_more() {
    for sampler in ["sobol", "independent"] {
        let folder = Folder::with_scene(BALL);
        let run = |arguments: &str| folder.run(&format!("render --quiet {arguments}")).ends_with(0);
        run(&format!("scene.pbrt --sampler {sampler} --spp 5 -o 5.luz"));
        // The scene and the sampler are those that it was begun with.
        run("--resume 5.luz --spp 12 -o 12.exr");
        run("--resume 5.luz --spp 7 -o 7.luz");
        run("--resume 7.luz --spp 12 -o 12.luz -o by-7.exr");
        assert!(bytes(&folder, "12.exr") == bytes(&folder, "by-7.exr"), "{sampler}");
        // Nothing is left to do.
        run("--resume 12.luz --spp 12 -o again.exr");
        assert!(bytes(&folder, "12.exr") == bytes(&folder, "again.exr"), "{sampler}");
        run("--resume 5.luz -o 5.exr");
        for samples in [5, 12] {
            run(&format!("scene.pbrt --sampler {sampler} --spp {samples} -o whole.exr"));
            // Points of the Sobol sequence are laid out for the number of samples that the render was begun for.
            let are_same_points = samples == 5 || sampler == "independent";
            let is_same = bytes(&folder, &format!("{samples}.exr")) == bytes(&folder, "whole.exr");
            assert_eq!(is_same, are_same_points, "{sampler}, {samples}");
        }
    }
}

#[test]
fn what_a_checkpoint_is_not_of_is_refused_with_the_reason() {
    let folder = Folder::with_scene(BALL);
    folder.write("other.pbrt", BALL.replace("5 4 3", "5 4 2"));
    folder.run("render scene.pbrt --spp 2 --seed 7 --quiet -o state.luz").ends_with(0);
    for (arguments, reason) in [
        ("--resume state.luz --seed 8", "seed: 7 and 8"),
        ("--resume state.luz --max-depth 9", "longest path: 4 and 9"),
        ("--resume state.luz --resolution 20x20", "resolution: 16x12 and 20x20"),
        ("--resume state.luz --sampler halton", "sampler: sobol and halton"),
        ("--resume state.luz --filter gaussian", "pixel filter"),
        ("--resume state.luz --mis balance", "combination"),
        ("--resume state.luz --adaptive 1%", "adaptive: no and 0.01"),
        ("--resume state.luz --film gbuffer", "film"),
        ("--resume state.luz --pbrt-coats", "coats"),
        ("--resume state.luz --simd scalar", "instruction set of rays"),
        ("other.pbrt --resume state.luz", "the scenes `scene.pbrt` and `other.pbrt` are different"),
    ] {
        folder
            .run(&format!("render {arguments} -o a.exr"))
            .ends_with(7)
            .complains(&["`state.luz` is of another render", reason]);
    }
    folder.run("render --resume state.luz -o a.exr --seed 7 --quiet").ends_with(0);
    std::fs::remove_file(folder.path().join("a.exr")).unwrap();

    let whole = bytes(&folder, "state.luz");
    let mut other_version = whole.clone();
    other_version[8] += 1;
    folder.write("version.luz", other_version);
    folder.write("cut.luz", &whole[..whole.len() / 2]);
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 4;
    folder.write("flipped.luz", flipped);
    folder.write("empty.luz", "");
    for (name, reason) in [
        ("version.luz", "was written by another version of luz"),
        ("cut.luz", "is damaged"),
        ("flipped.luz", "is damaged"),
        ("empty.luz", "is no checkpoint of luz"),
        ("scene.pbrt", "is no checkpoint of luz"),
        ("nowhere.luz", "cannot be read"),
    ] {
        folder.run(&format!("render --resume {name} -o a.exr")).ends_with(7).complains(&[name, reason]);
        folder.run(&format!("merge {name} -o a.exr")).ends_with(7).complains(&[name, reason]);
    }
    // The scene has changed since.
    folder.write("scene.pbrt", BALL.replace("0.6 0.7 0.8", "0.6 0.7 0.9"));
    folder.run("render --resume state.luz -o a.exr").ends_with(7).complains(&["the scene `scene.pbrt` has changed"]);
    assert!(!folder.path().join("a.exr").exists());
}

#[test]
fn what_is_planned_and_merged_is_the_whole() {
    let folder = Folder::with_scene(BALL);
    let options = "--spp 5 --resolution 70x40 --film gbuffer";
    let script = format!("luz plan scene.pbrt --shards 3 {options} > jobs.sh; sh jobs.sh");
    shell(&folder, &script).ends_with(0);
    folder.run(&format!("render scene.pbrt {options} -o whole.exr -o whole.png")).ends_with(0);
    assert!(bytes(&folder, "ball.exr") == bytes(&folder, "whole.exr"));
    assert!(bytes(&folder, "ball.png") == bytes(&folder, "whole.png"));
    let part = |i: u32| format!("ball-{i}-of-3.luz");
    for i in 1..=3 {
        assert_eq!(Checkpoint::read(&folder.path().join(part(i))).unwrap().missing().len(), 2, "it is one of three");
    }

    // In any order and grouping, and more than once.
    let [one, two, three] = [part(1), part(2), part(3)];
    folder.run(&format!("merge {three} {one} --partial -o some.luz")).ends_with(0).complains(&["missing: 2"]);
    for parts in [
        format!("{three} {two} {one}"),
        format!("{two} some.luz"),
        format!("some.luz {one} {two} {two} some.luz {one}"),
    ] {
        let said = folder.run(&format!("merge {parts} -o merged.exr -o merged.luz")).ends_with(0);
        assert!(said.stdout.contains("3 of 3 shards · 14.0 k paths"), "{}", said.stdout);
        assert!(bytes(&folder, "merged.exr") == bytes(&folder, "whole.exr"), "{parts}");
    }

    // Shards that are not there are named, and nothing is written unless that is asked for.
    let error = "of 3 shards these are missing: 1, 3";
    folder.run(&format!("merge {two} -o part.exr")).ends_with(7).complains(&[error, "--partial"]);
    assert!(!folder.path().join("part.exr").exists());
    folder.run(&format!("merge {two} --partial -o part.exr")).ends_with(0).complains(&[error]);
    let (part_image, whole) = (folder.image("part.exr"), folder.image("whole.exr"));
    let mut there = 0;
    for y in 0..40 {
        for x in 0..70 {
            let pixel = part_image.pixel(x, y);
            if pixel.iter().any(|&v| v != 0.0) {
                assert_eq!(pixel, whole.pixel(x, y), "what is there is right, and so is its variance");
                there += 1;
            }
        }
    }
    assert!((500..2000).contains(&there), "{there}");

    // Parts of other renders, and shards of other cuts, do not go together.
    folder.run(&format!("render scene.pbrt {options} --seed 9 --shard 1/3 -o seed.luz")).ends_with(0);
    folder.run(&format!("merge {two} seed.luz {one} -o no.exr")).ends_with(7).complains(&["seed.luz", "seed: 0 and 9"]);
    folder.run(&format!("render scene.pbrt {options} --shard 1/2 -o cut.luz")).ends_with(0);
    folder.run(&format!("merge {two} cut.luz -o no.exr")).ends_with(7).complains(&["one is of 2 shards, another of 3"]);
    // Several parts are merged, not resumed.
    folder.run("render --resume some.luz -o a.exr").ends_with(7).complains(&["holds several parts", "luz merge"]);
    assert!(!folder.path().join("no.exr").exists() && !folder.path().join("a.exr").exists());
}

#[test]
fn shards_are_rendered_once_and_go_on_where_they_were() {
    let folder = Folder::with_scene(BALL);
    let shard = "render scene.pbrt --spp 4 --shard 2/3";
    folder.run(shard).ends_with(0);
    assert_eq!(folder.files(), ["ball-2-of-3.luz", "scene.pbrt"], "its name says what it is");
    let first = bytes(&folder, "ball-2-of-3.luz");
    let said = folder.run(shard).ends_with(0);
    assert!(said.stdout.contains("shard 2/3 is already in ball-2-of-3.luz"), "{}", said.stdout);
    assert!(bytes(&folder, "ball-2-of-3.luz") == first);
    // The file of another shard or of another render is not overwritten.
    folder
        .run("render scene.pbrt --spp 4 --shard 1/3 -o ball-2-of-3.luz")
        .ends_with(7)
        .complains(&["holds other shards"]);
    folder.run(&format!("{shard} --seed 5")).ends_with(7).complains(&["seed: 0 and 5"]);
    folder.write("broken.luz", "");
    folder.run(&format!("{shard} -o broken.luz")).ends_with(7).complains(&["is no checkpoint"]);
    assert!(bytes(&folder, "ball-2-of-3.luz") == first);
    for wrong in ["-o a.png", "-o a.luz -o a.exr"] {
        folder.run(&format!("{shard} {wrong}")).ends_with(2).complains(&["a shard is no picture"]);
    }
    for wrong in [
        "--shard 4/3",
        "--shard 0/3",
        "--shard 1/0",
        "--shard 1",
        "--shard 1/2 --time 1s",
        "--shard 1/2 --roulette efficiency",
    ] {
        folder.run(&format!("render scene.pbrt {wrong}")).ends_with(2);
    }

    // A shard that was interrupted goes on by the same command.
    let long = "render scene.pbrt --spp 30000 --threads 1 --shard 1/2 -o part.luz --every 10ms --quiet";
    let mut child = start(&folder, long);
    await_that("the shard", || folder.path().join("part.luz").exists());
    child.kill().unwrap();
    child.wait().unwrap();
    let part = Checkpoint::read(&folder.path().join("part.luz")).unwrap();
    assert_eq!(part.unfinished(), [1]);
    assert!(part.parts()[0].header.rounds_done > 0);
    folder.run("merge part.luz -o a.exr").ends_with(7).complains(&["not finished: 1", "missing: 2"]);
    folder.run("merge part.luz --partial -o a.exr").ends_with(0).complains(&["not finished: 1", "missing: 2"]);
    folder.run(long).ends_with(0);
    folder.run("render scene.pbrt --spp 30000 --shard 1/2 -o whole.luz --quiet").ends_with(0);
    let data = |name: &str| Checkpoint::read(&folder.path().join(name)).unwrap().parts()[0].data.clone();
    assert!(data("part.luz") == data("whole.luz"));
}

#[test]
fn time_and_error_end_a_render_and_the_report_says_so() {
    let folder = Folder::with_scene(BALL);
    let run = |arguments: &str| {
        folder.run(&format!("render scene.pbrt -o a.exr --report a.json {arguments}")).ends_with(0);
        folder.json("a.json")
    };
    let report = run("--time 300ms");
    assert_eq!(report["stopped"], "time");
    assert!(report["samples"].as_u64().unwrap() > 4, "without --spp, the scene's number of samples does not count");
    let report = run("--error 1%");
    assert_eq!(report["stopped"], "error");
    assert!(report["typical_error"].as_f64().unwrap() <= 0.01, "{report}");
    let enough = report["samples"].as_u64().unwrap();
    // The same error is reached after the same samples, up to the length of a pass; one more is less than half of them.
    let report = run(&format!("--error 1% --spp {}", enough / 4));
    assert_eq!(report["stopped"], "finished");
    assert!(report["typical_error"].as_f64().unwrap() > 0.01, "{report}");
    assert_eq!(run("--time 1h --error 0.0001% --spp 3")["stopped"], "finished");
    assert_eq!(run("--time 200ms --error 0.0001%")["stopped"], "time");
    assert_eq!(run("--time 1h --error 20%")["stopped"], "error");
}

/// A file may have 64 KiB here, as on a disk that is full by then. The checkpoint takes more, the pictures less.
#[test]
fn a_full_disk_stops_no_render_and_spoils_no_checkpoint() {
    let folder = Folder::with_scene(BALL);
    let common = "--resolution 60x40 --quiet";
    folder.run(&format!("render scene.pbrt {common} --spp 3 --checkpoint state.luz -o a.exr")).ends_with(0);
    let before = bytes(&folder, "state.luz");
    assert!(before.len() > 1 << 16);
    let render =
        "luz render --resume state.luz --checkpoint state.luz --every 5ms --threads 1 -o b.exr --report b.json";
    let said = shell(&folder, &format!("ulimit -f 64; {render} --spp 300")).ends_with(4);
    said.complains(&[
        "warning: cannot write the checkpoint `state.luz`",
        "Rendering goes on",
        "error: cannot write `state.luz`",
    ]);
    assert!(bytes(&folder, "state.luz") == before, "it is the one before");
    assert_eq!(folder.files(), ["a.exr", "b.exr", "b.json", "scene.pbrt", "state.luz"], "no half of a file is left");
    let report = folder.json("b.json");
    assert_eq!((&report["stopped"], &report["samples"]), (&"finished".into(), &300.into()));

    // With room again, it goes on.
    folder.run("render --resume state.luz --checkpoint state.luz --spp 300 -o c.exr --quiet").ends_with(0);
    assert!(bytes(&folder, "b.exr") == bytes(&folder, "c.exr"));
    assert_eq!(rounds(&folder.path().join("state.luz")), 300);
}

#[test]
fn places_that_take_no_files_are_refused_before_the_work() {
    let folder = Folder::with_scene(BALL);
    folder.write("file", "");
    for place in ["file/state.luz", "nowhere/state.luz", "."] {
        for option in ["--checkpoint", "-o a.exr --checkpoint", "--report"] {
            let begin = Instant::now();
            let said = folder.run(&format!("render scene.pbrt --spp 1000000 {option} {place}")).ends_with(4);
            said.complains(&["cannot write", place]);
            assert!(begin.elapsed() < Duration::from_secs(20));
        }
    }
    // Nobody can make files there, root included.
    if Path::new("/proc/self").is_dir() {
        folder
            .run("render scene.pbrt --checkpoint /proc/self/state.luz")
            .ends_with(4)
            .complains(&["/proc/self/state.luz"]);
    }
    let locked = folder.path().join("locked");
    std::fs::create_dir(&locked).unwrap();
    let lock = |is_locked: bool| {
        let mut permissions = std::fs::metadata(&locked).unwrap().permissions();
        permissions.set_readonly(is_locked);
        std::fs::set_permissions(&locked, permissions).unwrap();
    };
    lock(true);
    // Root may write everywhere; then there is nothing to be refused.
    if tempfile::tempfile_in(&locked).is_err() {
        folder.run("render scene.pbrt --checkpoint locked/state.luz").ends_with(4).complains(&["does not take files"]);
    }
    lock(false);
    assert_eq!(folder.files(), ["file", "locked", "scene.pbrt"]);
}

#[test]
fn a_trace_has_the_colour_of_the_sample() {
    let folder = Folder::with_scene(BALL);
    for options in ["--sampler independent", "--sampler sobol --seed 3 --film gbuffer", "--mis power --max-depth 2"] {
        folder.run(&format!("render scene.pbrt {options} --spp 1 -o one.exr --quiet")).ends_with(0);
        let image = folder.image("one.exr");
        for [x, y] in [[0, 0], [8, 6], [7, 9], [15, 11]] {
            let said = folder.run(&format!("trace scene.pbrt {options} --spp 1 --pixel {x},{y}")).ends_with(0);
            let colour = said.stdout.lines().last().unwrap().strip_prefix("colour").unwrap();
            let colour: Vec<f32> = colour.split_whitespace().map(|v| v.parse().unwrap()).collect();
            for (traced, rendered) in colour.iter().zip(&image.pixel(x, y)[..3]) {
                // Six digits are printed.
                assert!(
                    (traced - rendered).abs() <= 6e-7 * (1.0 + rendered.abs()),
                    "{options} {x},{y}: {traced} {rendered}"
                );
            }
            for part in ["ray from camera", "throughput", "wavelengths"] {
                assert!(said.stdout.contains(part), "`{part}` is not in {}", said.stdout);
            }
            let replayed = folder.run(&format!("render scene.pbrt {options} --spp 1 --replay {x},{y},0")).ends_with(0);
            assert_eq!(replayed.stdout, said.stdout, "a replay is a trace");
        }
    }
    let ball = folder.run("trace scene.pbrt --pixel 8,6 --sample 2").ends_with(0).stdout;
    for part in ["pixel 8,6 · sample 2 · seed 0", "vertex 1 · diffuse", "light pdf", "bsdf pdf", "weight", "ends"] {
        assert!(ball.contains(part), "`{part}` is not in {ball}");
    }
    assert_ne!(ball, folder.run("trace scene.pbrt --pixel 8,6 --sample 3").stdout);
    for outside in ["16,0", "0,12", "4000000000,4000000000"] {
        folder.run(&format!("trace scene.pbrt --pixel {outside}")).ends_with(2).complains(&["16 × 12", outside]);
        folder.run(&format!("render scene.pbrt --replay {outside},0")).ends_with(2).complains(&["16 × 12", outside]);
    }
    folder.run("trace scene.pbrt --pixel 1,1 --half 1").ends_with(2).complains(&["--adaptive"]);
    folder.run("trace scene.pbrt --pixel 1,1 --half 1 --adaptive 1%").ends_with(0);
    for wrong in ["--pixel 1", "--pixel a,b", "--pixel -1,0", "", "--pixel 1,1 --sample -1"] {
        folder.run(&format!("trace scene.pbrt {wrong}")).ends_with(2);
    }
    assert_eq!(folder.files(), ["one.exr", "scene.pbrt"]);
}

#[test]
fn the_exit_codes_are_explained() {
    let folder = Folder::new();
    let said = folder.run("help exit-codes").ends_with(0).stdout;
    for code in [0, 1, 2, 3, 4, 5, 6, 7, 130, 143] {
        let explains = |line: &str| line.split_whitespace().next() == Some(&code.to_string());
        assert!(said.lines().any(explains), "{code} is not in {said}");
    }
    assert_eq!(folder.run("exit-codes").ends_with(0).stdout.trim(), said.trim());
}
