//! The end of reading: names become indices, meshes are loaded, and what is wrong comes to light.

use super::builder::{Builder, Named};
use super::legacy;
use super::state::{PENDING, Reference};
use crate::description::{Description, ShapeEntity, TextureType};
use crate::diagnostic::{Diagnostic, Diagnostics, SceneErrors, did_you_mean};
use crate::mesh::MeshData;
use crate::parameter::Values;
use crate::ply::{self, PlyError};
use crate::source::Span;
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

impl Builder<'_> {
    /// The description, or everything that is wrong with it.
    pub fn finish(mut self) -> Result<(Description, Diagnostics), SceneErrors> {
        self.check_block();
        let materials = resolve_all(&self.pending_materials, &self.material_names, "material", &mut self.diagnostics);
        let media = resolve_all(&self.pending_media, &self.medium_names, "medium", &mut self.diagnostics);
        let objects = resolve_all(&self.pending_objects, &self.object_names, "object", &mut self.diagnostics);
        let texture_order = self.order_textures();
        let material_order = self.order_materials();
        if self.read_options.load_meshes && !self.diagnostics.has_errors() {
            self.load_meshes();
        }
        self.hint_at_old_syntax();
        if self.diagnostics.has_errors() {
            return Err(SceneErrors { diagnostics: self.diagnostics, sources: self.sources });
        }

        // From here on everything is known to be defined.
        let new_position = inverse(&material_order);
        let material = |reference: Reference| new_position[lookup(reference, &materials)];
        let medium = |reference: Option<Reference>| reference.map(|r| lookup(r, &media));
        let fix = |shape: &mut ShapeEntity| {
            shape.material = material(shape.material);
            shape.inside_medium = medium(shape.inside_medium);
            shape.outside_medium = medium(shape.outside_medium);
        };
        self.shapes.iter_mut().for_each(fix);
        self.objects.iter_mut().flat_map(|object| &mut object.shapes).for_each(fix);
        for instance in &mut self.instances {
            instance.object = lookup(instance.object, &objects);
        }
        for light in &mut self.lights {
            light.outside_medium = medium(light.outside_medium);
        }
        self.camera.medium = medium(self.camera.medium);
        let description = Description {
            camera: self.camera,
            film: self.film,
            sampler: self.sampler,
            integrator: self.integrator,
            accelerator: self.accelerator,
            pixel_filter: self.pixel_filter,
            options: self.options,
            transform_times: self.transform_times,
            shapes: self.shapes,
            objects: self.objects,
            instances: self.instances,
            lights: self.lights,
            area_lights: self.area_lights,
            materials: permute(self.materials, &material_order),
            textures: permute(self.textures, &texture_order),
            media: self.media,
            directory: self.directory,
            sources: self.sources,
        };
        Ok((description, self.diagnostics))
    }

    fn check_block(&mut self) {
        // Without a file there is one error already, and no place to point at.
        let Some(end) = self.end else { return };
        self.close_open(0, end);
        if self.world.is_none() && !self.world_assumed && !self.diagnostics.has_errors() {
            self.diagnostics.error(end, "the scene has no `WorldBegin`");
        }
    }

    /// Looks up all textures that are used. Returns an order in which each uses only those before it: that of
    /// definition, as far as it can be.
    fn order_textures(&mut self) -> Vec<usize> {
        let mut uses = vec![Vec::new(); self.textures.len()];
        for used in std::mem::take(&mut self.texture_uses) {
            let names = &self.texture_names[used.value_type as usize];
            match names.get(&used.name) {
                Some(index) => {
                    if let Some(user) = used.user {
                        uses[user].push((*index, used.span));
                    }
                }
                None => {
                    let other = match used.value_type {
                        TextureType::Float => TextureType::Spectrum,
                        TextureType::Spectrum => TextureType::Float,
                    };
                    let message = format!("there is no {} texture `{}`", used.value_type.name(), used.name);
                    let help = if self.texture_names[other as usize].contains_key(&used.name) {
                        Some(format!("`{}` is a {} texture", used.name, other.name()))
                    } else {
                        did_you_mean(&used.name, names.keys().map(|name| &**name))
                    };
                    self.diagnostics.push(Diagnostic::error(used.span, message).with_optional_help(help));
                }
            }
        }
        order(&uses).unwrap_or_else(|(index, span)| {
            let message = format!("texture `{}` uses itself", self.textures[index].name);
            self.diagnostics.error(span, message);
            Vec::new()
        })
    }

    /// As [`Self::order_textures`], for mix materials.
    fn order_materials(&mut self) -> Vec<usize> {
        let mut uses = vec![Vec::new(); self.materials.len()];
        for (index, material) in self.materials.iter().enumerate() {
            if &*material.entity.kind != "mix" {
                continue;
            }
            let Some(parameter) = material.entity.parameters.get("materials") else { continue };
            let Values::Strings(names) = &parameter.values else { continue };
            for name in names {
                match self.material_names.get(name) {
                    Some(used) => uses[index].push((*used, parameter.value_span)),
                    None => {
                        let message = format!("there is no material `{name}`");
                        let help = did_you_mean(name, self.material_names.keys().map(|name| &**name));
                        self.diagnostics
                            .push(Diagnostic::error(parameter.value_span, message).with_optional_help(help));
                    }
                }
            }
        }
        order(&uses).unwrap_or_else(|(_, span)| {
            self.diagnostics.error(span, "this material is mixed from itself");
            Vec::new()
        })
    }

    /// Loads every mesh file once, in parallel.
    fn load_meshes(&mut self) {
        let all = || self.shapes.iter().chain(self.objects.iter().flat_map(|object| &object.shapes));
        let mut paths: Vec<PathBuf> = Vec::new();
        let mut index_of: HashMap<Arc<str>, usize> = HashMap::new();
        let mut index_of_path: HashMap<PathBuf, usize> = HashMap::new();
        let mut spans = Vec::new();
        for shape in all() {
            let Some((name, span)) = mesh_file(shape) else { continue };
            if index_of.contains_key(&name) {
                continue;
            }
            let path = crate::description::resolve(&self.directory, &name);
            let key = path.canonicalize().unwrap_or_else(|_| path.clone());
            let index = *index_of_path.entry(key).or_insert_with(|| {
                paths.push(path);
                spans.push(span);
                paths.len() - 1
            });
            index_of.insert(name, index);
        }
        let limit = self.read_options.limits.file_bytes;
        let loaded: Vec<Result<Arc<MeshData>, PlyError>> =
            paths.par_iter().map(|path| ply::read_within(path, limit).map(Arc::new)).collect();
        let attach = |shape: &mut ShapeEntity| {
            if let Some((name, _)) = mesh_file(shape)
                && let Some(Ok(mesh)) = index_of.get(&name).map(|index| &loaded[*index])
            {
                shape.mesh = Some(mesh.clone());
            }
        };
        self.shapes.iter_mut().for_each(attach);
        self.objects.iter_mut().flat_map(|object| &mut object.shapes).for_each(attach);
        for ((result, path), span) in loaded.iter().zip(&paths).zip(spans) {
            match result {
                Err(error) => self.diagnostics.error(span, format!("cannot read `{}`: {error}", path.display())),
                Ok(mesh) if mesh.replaced > 0 => self.diagnostics.warning(
                    span,
                    format!(
                        "`{}`: {} normals or texture coordinates that are not finite became zero",
                        path.display(),
                        mesh.replaced
                    ),
                ),
                Ok(_) => {}
            }
        }
    }

    /// Old scenes give many errors of one cause: it is said at the end.
    fn hint_at_old_syntax(&mut self) {
        let old = |d: &Diagnostic| d.help.as_ref().is_some_and(|help| help.contains("pbrt-v3"));
        if self.diagnostics.iter().any(old) {
            self.diagnostics.warning(None, legacy::UPGRADE_HINT);
        }
    }
}

/// The file of a `plymesh`.
fn mesh_file(shape: &ShapeEntity) -> Option<(Arc<str>, Span)> {
    if &*shape.entity.kind != "plymesh" {
        return None;
    }
    let parameter = shape.entity.parameters.get("filename")?;
    match &parameter.values {
        Values::Strings(names) => Some((names.first()?.clone(), parameter.value_span)),
        _ => None,
    }
}

/// Looks up names that were used before they were defined. Reports those that never were; 0 stands for them.
fn resolve_all(
    pending: &[Named],
    names: &HashMap<Arc<str>, usize>,
    what: &str,
    diagnostics: &mut Diagnostics,
) -> Vec<usize> {
    let mut resolve = |(name, span): &Named| {
        names.get(name).copied().unwrap_or_else(|| {
            let message = format!("there is no {what} `{name}`");
            let help = did_you_mean(name, names.keys().map(|name| &**name));
            diagnostics.push(Diagnostic::error(*span, message).with_optional_help(help));
            0
        })
    };
    pending.iter().map(&mut resolve).collect()
}

fn lookup(reference: Reference, pending: &[usize]) -> usize {
    if reference >= PENDING { pending[reference - PENDING] } else { reference }
}

/// An order in which each element comes behind those it uses, and otherwise stays where it was. `uses[i]`: what `i`
/// uses, and where. If there is none: an element that uses itself, directly or not, and a place.
fn order<S: Copy>(uses: &[Vec<(usize, S)>]) -> Result<Vec<usize>, (usize, S)> {
    #[derive(Clone, Copy, PartialEq)]
    enum Visit {
        New,
        Open,
        Done,
    }
    let mut visits = vec![Visit::New; uses.len()];
    let mut out = Vec::with_capacity(uses.len());
    // An explicit stack: chains can be as long as the file.
    let mut stack: Vec<(usize, usize)> = Vec::new();
    for root in 0..uses.len() {
        if visits[root] == Visit::New {
            visits[root] = Visit::Open;
            stack.push((root, 0));
        }
        while let Some((element, next)) = stack.last_mut() {
            match uses[*element].get(*next) {
                Some((used, span)) => {
                    *next += 1;
                    match visits[*used] {
                        Visit::New => {
                            visits[*used] = Visit::Open;
                            stack.push((*used, 0));
                        }
                        Visit::Open => return Err((*used, *span)),
                        Visit::Done => {}
                    }
                }
                None => {
                    visits[*element] = Visit::Done;
                    out.push(*element);
                    stack.pop();
                }
            }
        }
    }
    Ok(out)
}

/// Where each element has gone.
fn inverse(order: &[usize]) -> Vec<usize> {
    let mut positions = vec![0; order.len()];
    for (position, element) in order.iter().enumerate() {
        positions[*element] = position;
    }
    positions
}

fn permute<T>(items: Vec<T>, order: &[usize]) -> Vec<T> {
    let mut items: Vec<Option<T>> = items.into_iter().map(Some).collect();
    order.iter().filter_map(|index| items[*index].take()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_is_stable_and_finds_cycles() {
        let uses = |lists: &[&[usize]]| -> Vec<Vec<(usize, ())>> {
            lists.iter().map(|list| list.iter().map(|i| (*i, ())).collect()).collect()
        };
        assert_eq!(order(&uses(&[&[], &[0], &[0, 1]])), Ok(vec![0, 1, 2]));
        assert_eq!(order(&uses(&[&[], &[3], &[], &[0]])), Ok(vec![0, 3, 1, 2]));
        assert_eq!(order(&uses(&[&[], &[2], &[3], &[1]])), Err((1, ())));
        assert_eq!(order(&uses(&[&[0]])), Err((0, ())));
        assert_eq!(inverse(&[0, 3, 1, 2]), [0, 2, 3, 1]);
        assert_eq!(permute(vec!["a", "b", "c", "d"], &[0, 3, 1, 2]), ["a", "d", "b", "c"]);
    }
}
