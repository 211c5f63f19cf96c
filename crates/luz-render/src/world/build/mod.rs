//! From a scene's description to a world.

mod images;
mod integrator;
mod lights;
mod materials;
mod settings;
mod shapes;
mod spectra;
mod textures;
mod unheeded;

use super::{ShapeInfo, World, WorldStatistics};
use crate::bsdf::CoatWeights;
use crate::camera::Camera;
use crate::light::{
    AreaLight, Combination, Emission, EmittedSpectrum, Light, LightContext, LightSampler, LightSelection,
};
use crate::material::{Material, MaterialId, Scattering};
use crate::settings::{Overrides, Settings};
use glam::Mat4;
use luz_geometry::{
    Accelerator, AcceleratorBuilder, AnimatedTransform, GroupId, InstanceTransform, Shape, ShapeId, SimdLevel,
    Transform,
};
use luz_scene::{Description, Diagnostic, Diagnostics, Entity, Instance, ShapeEntity, Span, TransformSet};
use std::collections::{HashMap, HashSet};
use std::time::Instant;
use textures::TextureBuilder;

/// A scene, ready to be rendered.
#[derive(Debug)]
pub struct Loaded {
    /// What light meets.
    pub world: World,
    /// Who looks at it.
    pub camera: Camera,
    /// How.
    pub settings: Settings,
}

/// What every builder needs.
struct Context<'a> {
    description: &'a Description,
    coat_weights: CoatWeights,
    /// Whether points of emitting surfaces are drawn by their images.
    draws_by_images: bool,
    diagnostics: &'a mut Diagnostics,
}

impl Context<'_> {
    /// A transform out of a scene's matrix; the identity, said why, where it has no inverse.
    fn transform(&mut self, matrix: Mat4, span: Span) -> Transform {
        Transform::try_from(matrix).unwrap_or_else(|error| {
            self.diagnostics.error(span, format!("the current transformation cannot be used: {error}"));
            Transform::IDENTITY
        })
    }
}

/// Reports a kind of entity that the scene format has and this renderer hasn't.
fn unsupported(context: &mut Context<'_>, entity: &Entity, what: &str) {
    let message = format!("the {what} `{}` cannot be rendered yet", entity.kind);
    context.diagnostics.error(entity.kind_span, message);
}

/// Builds the world that a description describes. All problems are reported; if one is an error, there is no world.
///
/// `simd` chooses the instruction set of ray traversal.
pub fn build(
    description: &Description,
    overrides: &Overrides,
    simd: SimdLevel,
    diagnostics: &mut Diagnostics,
) -> Option<Loaded> {
    let mut context = Context {
        description,
        coat_weights: overrides.coat_weights,
        draws_by_images: overrides.emission_images.unwrap_or(true),
        diagnostics,
    };
    let settings = settings::settings(&mut context, overrides);
    let camera = settings::camera(&mut context, description, settings.resolution);
    unheeded::report(&mut context);
    let mut builder = Builder::new(simd);
    builder.materials(&mut context);
    builder.add_shapes(&mut context);
    builder.add_lights(&mut context);
    let light_sampler = integrator::light_sampler(&mut context, overrides);
    let mis_compensation = overrides.mis_compensation.unwrap_or(true);
    let world = builder.finish(&mut context, (light_sampler, mis_compensation))?;
    (!context.diagnostics.has_errors()).then_some(Loaded { world, camera, settings })
}

/// An area light that waits for the areas of its shape's primitives.
struct Emitter {
    shape: u32,
    primitives: u32,
    /// Of the description's area lights.
    entity: usize,
    emission: u32,
}

struct Builder {
    textures: TextureBuilder,
    materials: Vec<Material>,
    accelerator: AcceleratorBuilder,
    shapes: Vec<ShapeInfo>,
    /// Where each shape stands in the scene's text.
    places: Vec<Span>,
    emissions: Vec<Emission>,
    emission_of: HashMap<usize, Option<u32>>,
    emitters: Vec<Emitter>,
    lights: Vec<Light>,
    statistics: WorldStatistics,
}

impl Builder {
    fn new(simd: SimdLevel) -> Self {
        let mut accelerator = AcceleratorBuilder::new();
        accelerator.simd(simd);
        Self {
            textures: TextureBuilder::default(),
            materials: Vec::new(),
            accelerator,
            shapes: Vec::new(),
            places: Vec::new(),
            emissions: Vec::new(),
            emission_of: HashMap::new(),
            emitters: Vec::new(),
            lights: Vec::new(),
            statistics: WorldStatistics::default(),
        }
    }

    fn materials(&mut self, context: &mut Context<'_>) {
        let description = context.description;
        for material in &description.materials {
            self.materials.push(materials::material(context, &mut self.textures, &material.entity));
            *self.statistics.materials.entry(material.entity.kind.to_string()).or_default() += 1;
        }
        for texture in &description.textures {
            *self.statistics.textures.entry(texture.entity.kind.to_string()).or_default() += 1;
        }
    }

    fn add_shapes(&mut self, context: &mut Context<'_>) {
        let description = context.description;
        for shape in &description.shapes {
            if shape.world_from_object.is_animated() {
                self.add_moving(context, shape);
            } else {
                self.add(context, None, shape);
            }
        }
        let mut groups: HashMap<usize, GroupId> = HashMap::new();
        for instance in &description.instances {
            let group = *groups.entry(instance.object).or_insert_with(|| {
                let group = self.accelerator.add_group();
                for shape in description.objects[instance.object].shapes.iter().filter(|s| s.area_light.is_none()) {
                    self.add(context, Some(group), shape);
                }
                group
            });
            for shape in description.objects[instance.object].shapes.iter().filter(|s| s.area_light.is_some()) {
                self.add_instanced_emitter(context, instance, shape);
            }
            let transform = instance_transform(context, &instance.world_from_instance, instance.span);
            self.accelerator.add_instance(group, transform);
            self.statistics.instances += 1;
        }
    }

    /// What shines stands in the world itself, once for every place of its object: each is a light of its own.
    fn add_instanced_emitter(&mut self, context: &mut Context<'_>, instance: &Instance, shape: &ShapeEntity) {
        if instance.world_from_instance.is_animated() || shape.world_from_object.is_animated() {
            report_moving_emitter(context, shape);
            return;
        }
        let placed = instance.world_from_instance.start * shape.world_from_object.start;
        let world_from_object = TransformSet { start: placed, end: placed };
        self.add(context, None, &ShapeEntity { world_from_object, ..shape.clone() });
    }

    /// A shape that moves is a group of its own, in object space, with a moving instance.
    fn add_moving(&mut self, context: &mut Context<'_>, shape: &ShapeEntity) {
        if shape.area_light.is_some() {
            report_moving_emitter(context, shape);
            return;
        }
        let transform = instance_transform(context, &shape.world_from_object, shape.entity.span);
        let group = self.accelerator.add_group();
        let at_rest = ShapeEntity { world_from_object: TransformSet::IDENTITY, ..shape.clone() };
        self.add(context, Some(group), &at_rest);
        self.accelerator.add_instance(group, transform);
    }

    fn add(&mut self, context: &mut Context<'_>, group: Option<GroupId>, shape: &ShapeEntity) {
        if group.is_some() && shape.world_from_object.is_animated() {
            context.diagnostics.error(shape.entity.span, "shapes that move within an object cannot be rendered yet");
        }
        let transform = context.transform(shape.world_from_object.start, shape.entity.span);
        let alpha = self.textures.optional_float(context, &shape.entity, "alpha");
        let alpha = alpha.filter(|&id| self.textures.textures.constant_float(id).is_none_or(|a| a < 1.0));
        let is_interface = matches!(self.materials[shape.material].scattering, Scattering::Interface);
        let is_mixed_interface = !is_interface && self.contains_interface(shape.material);
        for made in shapes::shapes(context, shape, &transform) {
            let primitives = made.primitive_count() as u32;
            let count = self.statistics.shapes.entry(shape.entity.kind.to_string()).or_default();
            count.shapes += 1;
            count.primitives += u64::from(primitives);
            let needs_filter = alpha.is_some() || is_interface || is_mixed_interface;
            let id = self.add_to_accelerator(group, made, needs_filter);
            self.shapes.push(ShapeInfo {
                material: MaterialId(shape.material as u32),
                first_light: None,
                alpha,
                is_interface,
                is_mixed_interface,
            });
            self.places.push(shape.entity.span);
            debug_assert_eq!(id as usize + 1, self.shapes.len());
            if let Some(entity) = shape.area_light {
                self.add_emitter(context, entity, (id, primitives));
            }
        }
    }

    /// True if a material is an interface or a mix with one somewhere in it; mixes name only earlier materials.
    fn contains_interface(&self, material: usize) -> bool {
        let mut open = vec![material];
        let mut seen = HashSet::new();
        while let Some(index) = open.pop() {
            match self.materials.get(index).map(|m| &m.scattering) {
                Some(Scattering::Interface) => return true,
                Some(Scattering::Mix { materials, .. }) if seen.insert(index) => {
                    open.extend(materials.map(MaterialId::index));
                }
                _ => {}
            }
        }
        false
    }

    fn add_to_accelerator(&mut self, group: Option<GroupId>, shape: Shape, needs_filter: bool) -> u32 {
        let id = match group {
            None => self.accelerator.add_shape(shape),
            Some(group) => self.accelerator.add_shape_to(group, shape),
        };
        if needs_filter {
            self.accelerator.set_filtered(id, true);
        }
        id.0
    }

    fn add_emitter(&mut self, context: &mut Context<'_>, entity: usize, (id, primitives): (u32, u32)) {
        let description = context.description;
        let emission = match self.emission_of.get(&entity) {
            Some(known) => *known,
            None => {
                let images = &mut self.textures.images;
                let made = lights::area_emission(context, images, &description.area_lights[entity]).map(|emission| {
                    self.emissions.push(emission);
                    self.emissions.len() as u32 - 1
                });
                self.emission_of.insert(entity, made);
                made
            }
        };
        if let Some(emission) = emission {
            self.emitters.push(Emitter { shape: id, primitives, entity, emission });
        }
    }

    fn add_lights(&mut self, context: &mut Context<'_>) {
        let description = context.description;
        for entity in &description.lights {
            self.lights.extend(lights::light(context, &mut self.textures.images, entity));
        }
    }

    fn finish(mut self, context: &mut Context<'_>, choice: (LightSampler, bool)) -> Option<World> {
        if context.diagnostics.has_errors() {
            return None;
        }
        let start = Instant::now();
        let accelerator = std::mem::take(&mut self.accelerator).build();
        self.statistics.build_seconds = start.elapsed().as_secs_f64();
        let report = accelerator.report();
        self.statistics.hierarchy_bytes = report.bytes as u64;
        for &(shape, count) in &report.skipped {
            self.statistics.degenerate_primitives += count as u64;
            context.diagnostics.warning(
                self.places[shape.0 as usize],
                format!(
                    "{count} primitives of this shape cannot be hit: they have no area, or vertices that are not finite"
                ),
            );
        }
        if report.overflow > 0 {
            context.diagnostics.error(None, format!("the scene has {} primitives too many", report.overflow));
        }
        for emitter in &self.emitters {
            let first = self.lights.len() as u32;
            self.shapes[emitter.shape as usize].first_light = Some(first);
            let entity = &context.description.area_lights[emitter.entity];
            let emission = &self.emissions[emitter.emission as usize];
            let power = lights::PowerFactor::new(context, entity, emission);
            let shape = accelerator.shape(ShapeId(emitter.shape));
            let alpha = self.shapes[emitter.shape as usize].alpha;
            let is_unseen = alpha.is_some_and(|id| self.textures.textures.constant_float(id).is_some_and(|a| a <= 0.0));
            for primitive in 0..emitter.primitives {
                // What was skipped has none, and is not to be looked at.
                let area = accelerator.shape_area(ShapeId(emitter.shape), primitive);
                let index = primitive as usize;
                self.lights.push(Light::Area(AreaLight {
                    shape: emitter.shape,
                    primitive,
                    emission: emitter.emission,
                    scale: power.of(emission, shape, index, area),
                    brightness: if area > 0.0 { emission.brightness_over(shape, index) } else { 0.0 },
                    alpha: alpha.filter(|_| !is_unseen),
                    is_unseen,
                    prepared: accelerator.prepare(ShapeId(emitter.shape), primitive).map(Box::new),
                }));
            }
        }
        for light in &self.lights {
            *self.statistics.lights.entry(light.kind().to_owned()).or_default() += 1;
        }
        self.statistics.texture_bytes = self.textures.images.bytes() as u64;
        self.into_world(context, accelerator, choice)
    }

    fn into_world(
        self,
        context: &mut Context<'_>,
        accelerator: Accelerator,
        (light_sampler, mis_compensation): (LightSampler, bool),
    ) -> Option<World> {
        let (center, radius) = accelerator.bounding_sphere();
        let emitted = EmittedSpectrum::default();
        let light_context = LightContext {
            accelerator: &accelerator,
            emissions: &self.emissions,
            textures: &self.textures.textures,
            emitted: &emitted,
            combination: Combination::Alone,
        };
        if self.lights.iter().all(|light| light.power(light_context, radius) == 0.0) {
            context.diagnostics.push(
                Diagnostic::warning(None, "nothing in the scene gives light: the picture will be black")
                    .with_help("add a `LightSource` or an `AreaLightSource`"),
            );
        }
        let selection = match LightSelection::new(light_sampler, &self.lights, light_context, radius) {
            Ok(selection) => selection,
            Err(error) => {
                context.diagnostics.error(None, format!("the lights' powers cannot be used: {error}"));
                return None;
            }
        };
        let infinite = self.lights.iter().enumerate().filter(|(_, l)| l.is_infinite()).map(|(i, _)| i as u32);
        Some(World {
            infinite_lights: infinite.collect(),
            has_passages: self.shapes.iter().any(|s| s.alpha.is_some() || s.is_interface || s.is_mixed_interface),
            has_passable_lights: self
                .shapes
                .iter()
                .any(|s| s.first_light.is_some() && (s.is_interface || s.is_mixed_interface)),
            has_varying_textures: !self.textures.textures.all_constant(),
            accelerator,
            shapes: self.shapes,
            materials: self.materials,
            textures: self.textures.textures,
            emissions: self.emissions,
            lights: self.lights,
            selection,
            mis_compensation,
            center,
            radius,
            statistics: self.statistics,
        })
    }
}

fn report_moving_emitter(context: &mut Context<'_>, shape: &ShapeEntity) {
    context.diagnostics.push(
        Diagnostic::error(shape.entity.span, "moving area lights cannot be rendered yet")
            .with_help("place the shape under `ActiveTransform All`"),
    );
}

fn instance_transform(context: &mut Context<'_>, transforms: &TransformSet, span: Span) -> InstanceTransform {
    let start = context.transform(transforms.start, span);
    if !transforms.is_animated() {
        return start.into();
    }
    let end = context.transform(transforms.end, span);
    let [start_time, end_time] = context.description.transform_times;
    AnimatedTransform::new(start, start_time, end, end_time).into()
}
