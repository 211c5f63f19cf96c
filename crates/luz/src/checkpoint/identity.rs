//! What a checkpoint is a checkpoint of.

use crate::Scene;
use luz_image::Chromaticities;
use luz_render::Overrides;
use luz_render::film::{FilmContents, PixelBounds};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::Xxh3;

/// What decides the bits of a render, and what is needed to make a picture of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// The program.
    pub program: String,
    /// The scene's file, as it was named.
    pub scene: PathBuf,
    /// A hash of all files that the scene is made of.
    pub content: String,
    /// What was asked for otherwise than the scene says, as on a command line.
    pub arguments: Vec<String>,
    /// Everything else that decides the bits, in words.
    pub options: BTreeMap<String, String>,
    /// What the film keeps.
    pub contents: FilmContents,
    /// The part of the frame that is rendered.
    pub bounds: PixelBounds,
    /// The frame.
    pub resolution: [u32; 2],
    /// The seed of all random numbers.
    pub seed: u64,
    /// The primaries and the white of the film's RGB.
    pub chromaticities: SavedChromaticities,
}

/// The name of the option that says with which instructions rays were traced: others may round differently.
pub const SIMD_OPTION: &str = "instruction set of rays";

/// CIE xy of red, green, blue and white.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SavedChromaticities([[f32; 2]; 4]);

impl From<SavedChromaticities> for Chromaticities {
    fn from(saved: SavedChromaticities) -> Self {
        let [red, green, blue, white] = saved.0;
        Self { primaries: [red, green, blue], white }
    }
}

impl From<Chromaticities> for SavedChromaticities {
    fn from(c: Chromaticities) -> Self {
        let [red, green, blue] = c.primaries;
        Self([red, green, blue, c.white])
    }
}

impl Identity {
    /// Of a render of `scene` as `overrides` want it, which `arguments` say on a command line.
    ///
    /// # Errors
    /// If a file that the scene is made of can't be read any more.
    pub fn new(scene: &Scene, path: &Path, overrides: &Overrides, arguments: Vec<String>) -> io::Result<Self> {
        let settings = &scene.settings;
        let integrator = &settings.integrator;
        let mut options = BTreeMap::new();
        let mut option = |name: &str, value: String| options.insert(name.to_owned(), value);
        option("resolution", format!("{}x{}", settings.resolution[0], settings.resolution[1]));
        option("crop window", format!("{:?}", settings.bounds));
        option("film", format!("{:?}, {:?}", settings.film, settings.film_contents()));
        option("largest component", settings.max_component.to_string());
        option("pixel filter", format!("{:?}, radius {}", settings.filter.kind(), settings.filter.radius()));
        option("sampler", settings.sampler.to_string());
        option("samples that the sampler is laid out for", settings.samples_per_pixel.to_string());
        option("seed", settings.seed.to_string());
        option("adaptive", settings.adaptive.map_or("no".to_owned(), |target| target.to_string()));
        option("integrator", integrator.kind().to_string());
        option("longest path", integrator.max_depth().to_string());
        if let Some(path) = integrator.path() {
            option("technique", path.technique.to_string());
            option("combination", path.heuristic.to_string());
            option("roulette", path.roulette.to_string());
            option("regularize", path.regularize.to_string());
        } else {
            option("settings of the integrator", format!("{integrator:?}"));
        }
        option("coats", format!("{:?}", overrides.coat_weights));
        option("light sampler", format!("{:?}", overrides.light_sampler));
        option("MIS compensation", format!("{:?}", overrides.mis_compensation));
        option("emission images", format!("{:?}", overrides.emission_images));
        option(SIMD_OPTION, scene.world.accelerator().simd().name().to_owned());
        Ok(Self {
            program: concat!("luz ", env!("CARGO_PKG_VERSION")).to_owned(),
            scene: path.to_owned(),
            content: content_hash(&scene.files)?,
            arguments,
            options,
            contents: settings.film_contents(),
            bounds: settings.bounds,
            resolution: settings.resolution,
            seed: settings.seed,
            chromaticities: Chromaticities::of(settings.color_space).into(),
        })
    }

    /// What is different, in words: nothing where samples of both belong to one picture.
    pub fn differences(&self, other: &Self) -> Vec<String> {
        let mut differences = Vec::new();
        if self.program != other.program {
            differences.push(format!("one is of {}, the other of {}", self.program, other.program));
        }
        if self.content != other.content {
            let (ours, theirs) = (self.scene.display(), other.scene.display());
            differences.push(if self.scene == other.scene {
                format!("the scene `{ours}` has changed")
            } else {
                format!("the scenes `{ours}` and `{theirs}` are different")
            });
        }
        for (name, value) in &self.options {
            match other.options.get(name) {
                Some(theirs) if theirs == value => {}
                Some(theirs) => differences.push(format!("{name}: {value} and {theirs}")),
                None => differences.push(format!("{name}: {value} and unknown")),
            }
        }
        for name in other.options.keys().filter(|name| !self.options.contains_key(*name)) {
            differences.push(format!("{name}: unknown to one of them"));
        }
        let geometry = |i: &Self| (i.contents, i.bounds, i.resolution, i.seed, i.chromaticities);
        if differences.is_empty() && geometry(self) != geometry(other) {
            differences.push("their frames are different".to_owned());
        }
        differences
    }

    /// Of two identities without differences one is kept, always the same: is it this one?
    pub(super) fn is_preferred_to(&self, other: &Self) -> bool {
        (&self.scene, &self.arguments) < (&other.scene, &other.arguments)
    }
}

/// A hash of the contents of files, whatever their names and folders; 32 hexadecimal digits.
///
/// # Errors
/// If one of them can't be read.
pub fn content_hash(files: &[PathBuf]) -> io::Result<String> {
    let mut hashes = Vec::with_capacity(files.len());
    let mut buffer = vec![0; 1 << 20];
    for path in files {
        let mut hasher = Xxh3::new();
        let mut file = File::open(path)?;
        loop {
            match file.read(&mut buffer) {
                Ok(0) => break,
                Ok(count) => hasher.update(&buffer[..count]),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        hashes.push(hasher.digest128());
    }
    // The order of the files is that of their paths, which may be others on another machine.
    hashes.sort_unstable();
    let mut all = Xxh3::new();
    hashes.iter().for_each(|hash| all.update(&hash.to_le_bytes()));
    Ok(format!("{:032x}", all.digest128()))
}
