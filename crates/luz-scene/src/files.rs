//! The files that a scene is made of.

use crate::description::Description;
use crate::parameter::Values;
use crate::spectrum::SpectrumParameter;
use crate::{Entity, ParameterList};
use std::collections::BTreeSet;
use std::path::PathBuf;

impl Description {
    /// The files that the scene is made of, sorted: its own texts, and every file that some parameter names, meshes, images
    /// and spectra among them. A word that happens to be the name of a file is taken for one.
    #[must_use]
    pub fn files(&self) -> Vec<PathBuf> {
        let mut files: BTreeSet<PathBuf> = self.sources.files().iter().filter_map(|file| file.path.clone()).collect();
        let mut add = |name: &str| {
            let path = self.resolve(name);
            if path.is_file() {
                files.insert(path);
            }
        };
        for parameter in self.entities().flat_map(|entity| ParameterList::iter(&entity.parameters)) {
            match &parameter.values {
                Values::Strings(names) => names.iter().for_each(|name| add(name)),
                Values::Spectra(spectra) => spectra.iter().for_each(|spectrum| {
                    if let SpectrumParameter::File { path, .. } = spectrum {
                        add(&path.to_string_lossy());
                    }
                }),
                Values::Bools(_) | Values::Integers(_) | Values::Floats(_) => {}
            }
        }
        files.into_iter().collect()
    }

    /// Everything that has parameters, but for the film, whose file is written, not read.
    fn entities(&self) -> impl Iterator<Item = &Entity> {
        let shapes = self.shapes.iter().chain(self.objects.iter().flat_map(|object| &object.shapes));
        [&self.camera.entity, &self.sampler, &self.integrator, &self.accelerator, &self.pixel_filter]
            .into_iter()
            .chain(shapes.map(|shape| &shape.entity))
            .chain(self.lights.iter().map(|light| &light.entity))
            .chain(&self.area_lights)
            .chain(self.materials.iter().map(|material| &material.entity))
            .chain(self.textures.iter().map(|texture| &texture.entity))
            .chain(self.media.iter().map(|medium| &medium.entity))
    }
}
