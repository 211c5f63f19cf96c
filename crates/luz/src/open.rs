//! From a scene file to a scene that can be rendered.

use luz_geometry::SimdLevel;
use luz_render::camera::Camera;
use luz_render::film::Film;
use luz_render::world::{self, Loaded, World};
use luz_render::{Overrides, Renderer, Settings};
use luz_scene::{Description, Diagnostics, SceneErrors, SourceMap};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// How long it took to open a scene, in wall-clock seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct OpenTimes {
    /// Reading the scene file and everything it includes, meshes as well.
    pub read: f64,
    /// Interpreting it: images, shapes, lights, and the hierarchy that rays traverse.
    pub build: f64,
}

/// A scene, ready to be rendered.
#[derive(Debug)]
pub struct Scene {
    /// What light meets.
    pub world: World,
    /// Who looks at it.
    pub camera: Camera,
    /// How it is rendered: as its file says, but for the overrides.
    pub settings: Settings,
    /// Warnings; there are no errors.
    pub diagnostics: Diagnostics,
    /// The texts that the warnings point into.
    pub sources: SourceMap,
    /// The files that the scene is made of.
    pub files: Vec<PathBuf>,
    /// How long all of this took.
    pub times: OpenTimes,
}

impl Scene {
    /// Opens a pbrt-v4 scene file.
    ///
    /// # Errors
    /// All problems at once: what the file gets wrong, files that it misses, and what cannot be rendered yet.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, SceneErrors> {
        Self::open_with(path, &Overrides::default(), SimdLevel::Auto)
    }

    /// As [`Self::open`], but rendered as the caller wishes, with the given instruction set.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn open_with(path: impl AsRef<Path>, overrides: &Overrides, simd: SimdLevel) -> Result<Self, SceneErrors> {
        let start = Instant::now();
        let (description, diagnostics) = luz_scene::read(path)?;
        let read = start.elapsed().as_secs_f64();
        Self::build(description, diagnostics, overrides, simd, read)
    }

    /// Opens a scene that is a string in pbrt-v4's format; `name` stands in for its file in diagnostics. Relative file
    /// names start from the working directory.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn from_text(name: &str, text: &str) -> Result<Self, SceneErrors> {
        let start = Instant::now();
        let (description, diagnostics) = luz_scene::read_str(name, text)?;
        let read = start.elapsed().as_secs_f64();
        Self::build(description, diagnostics, &Overrides::default(), SimdLevel::Auto, read)
    }

    fn build(
        description: Description,
        mut diagnostics: Diagnostics,
        overrides: &Overrides,
        simd: SimdLevel,
        read: f64,
    ) -> Result<Self, SceneErrors> {
        let start = Instant::now();
        let loaded = world::build(&description, overrides, simd, &mut diagnostics);
        let times = OpenTimes { read, build: start.elapsed().as_secs_f64() };
        let files = description.files();
        // The description holds every mesh once more; only its texts are still needed.
        let sources = description.sources;
        match loaded {
            Some(Loaded { world, camera, settings }) => {
                Ok(Self { world, camera, settings, diagnostics, sources, files, times })
            }
            None => Err(SceneErrors { diagnostics, sources }),
        }
    }

    /// A render of which no pass is done.
    pub fn renderer(&self) -> Renderer<'_> {
        Renderer::new(&self.world, &self.camera, &self.settings)
    }

    /// Renders all samples.
    pub fn render(&self) -> Film {
        let mut renderer = self.renderer();
        renderer.finish();
        renderer.into_film()
    }
}
