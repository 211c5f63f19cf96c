#![cfg(unix)]

use super::support::{BALL, Folder, Ran};
use assert_cmd::cargo::cargo_bin;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// More samples than any machine does in the time of a test.
fn start(folder: &Folder, arguments: &str) -> Child {
    Command::new(cargo_bin!("luz"))
        .current_dir(folder.path())
        .args(["render", "scene.pbrt", "--spp", "100000000", "--threads", "1"])
        .args(arguments.split_whitespace())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn interrupt(child: &Child) {
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
}

fn wait(mut child: Child) -> Ran {
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if start.elapsed() > Duration::from_secs(60) {
            child.kill().unwrap();
            panic!("the program did not end");
        }
        sleep(Duration::from_millis(20));
    }
    Ran::new(child.wait_with_output().unwrap())
}

#[test]
fn ctrl_c_finishes_the_pass_and_writes_what_there_is() {
    let folder = Folder::with_scene(BALL);
    let child = start(&folder, "--report report.json");
    sleep(Duration::from_millis(1500));
    interrupt(&child);
    let said = wait(child).ends_with(130).complains(&["interrupted"]);
    assert!(said.stdout.contains("interrupted after"), "{}", said.stdout);
    assert_eq!(folder.files(), ["ball.exr", "ball.png", "report.json", "scene.pbrt"]);
    let report = folder.json("report.json");
    assert_eq!(report["stopped"], "interrupted");
    let samples = report["samples"].as_u64().unwrap();
    assert!(samples > 0 && samples < 100_000_000, "{samples}");
    let image = folder.image("ball.exr");
    let r = image.channel("R").unwrap();
    assert!((image.pixel(0, 0)[r] - 0.6).abs() < 0.02);
}

#[test]
fn a_second_ctrl_c_ends_at_once_and_leaves_no_part_of_a_file() {
    let folder = Folder::with_scene(BALL);
    // A frame whose single pass takes long enough to be caught in.
    let child = start(&folder, "--resolution 6000x6000 --quiet");
    sleep(Duration::from_millis(700));
    interrupt(&child);
    sleep(Duration::from_millis(100));
    interrupt(&child);
    let begin = Instant::now();
    let said = wait(child).ends_with(130);
    assert!(begin.elapsed() < Duration::from_secs(3));
    assert_eq!((said.stdout.as_str(), said.stderr.as_str()), ("", ""));
    assert_eq!(folder.files(), ["scene.pbrt"]);
}
