//! Running the program in a folder of its own.

use assert_cmd::Command;
use assert_cmd::cargo::cargo_bin;
use luz::image::Image;
use std::path::{Path, PathBuf};
use std::process::Output;
use tempfile::TempDir;

/// A lit ball, 16 × 12 pixels, 4 samples each.
pub const BALL: &str = r#"
Film "rgb" "integer xresolution" 16 "integer yresolution" 12 "string filename" "ball.exr"
PixelFilter "box"
Sampler "sobol" "integer pixelsamples" 4
Integrator "path" "integer maxdepth" 4
Camera "perspective" "float fov" 40
WorldBegin
LightSource "infinite" "rgb L" [ 0.6 0.7 0.8 ]
AttributeBegin
    Translate 0 3 4
    AreaLightSource "diffuse" "rgb L" [ 5 4 3 ]
    Shape "sphere" "float radius" 0.5
AttributeEnd
Translate 0 0 5
Material "diffuse" "rgb reflectance" [ 0.8 0.3 0.1 ]
Shape "sphere"
"#;

/// An empty folder to run in.
pub struct Folder(TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// A folder with a scene in it.
    pub fn with_scene(text: &str) -> Self {
        let folder = Self::new();
        folder.write("scene.pbrt", text);
        folder
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }

    pub fn write(&self, name: &str, contents: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path().join(name);
        std::fs::write(&path, contents).unwrap();
        path
    }

    /// The names of all files, sorted.
    pub fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.path()).unwrap();
        let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    pub fn image(&self, name: &str) -> Image {
        Image::read(self.path().join(name)).unwrap()
    }

    pub fn json(&self, name: &str) -> serde_json::Value {
        serde_json::from_slice(&std::fs::read(self.path().join(name)).unwrap()).unwrap()
    }

    /// Runs the program here, with arguments separated by spaces.
    pub fn run(&self, arguments: &str) -> Ran {
        self.run_with(arguments, &[])
    }

    /// As [`Self::run`], with variables of the environment.
    pub fn run_with(&self, arguments: &str, environment: &[(&str, &str)]) -> Ran {
        let mut command = Command::new(cargo_bin!("luz"));
        command.current_dir(self.path()).args(arguments.split_whitespace());
        command.envs(environment.iter().copied());
        // A hang fails the test instead of stopping the suite.
        command.timeout(std::time::Duration::from_secs(120));
        Ran::new(command.output().unwrap())
    }
}

/// How the program ended and what it said.
#[derive(Debug)]
pub struct Ran {
    /// The exit code; none if a signal ended it.
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Ran {
    pub fn new(output: Output) -> Self {
        let text = |bytes| String::from_utf8(bytes).unwrap();
        Self { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
    }

    /// Asserts the exit code.
    #[track_caller]
    pub fn ends_with(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "\nstdout: {}\nstderr: {}", self.stdout, self.stderr);
        self
    }

    /// Asserts that all of these were said on standard error.
    #[track_caller]
    pub fn complains(self, parts: &[&str]) -> Self {
        for part in parts {
            assert!(self.stderr.contains(part), "`{part}` is not in:\n{}", self.stderr);
        }
        self
    }
}

/// Starts the program, lets it work for a while, interrupts it, and waits for its end.
#[cfg(unix)]
pub fn interrupt_soon(folder: &Folder, arguments: &str) -> Ran {
    use std::process::{Command, Stdio};
    use std::thread::sleep;
    use std::time::{Duration, Instant};
    let mut child = Command::new(cargo_bin!("luz"))
        .current_dir(folder.path())
        .args(arguments.split_whitespace())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    sleep(Duration::from_millis(2500));
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
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
