//! Turns directives into a description. It follows pbrt-v4's `BasicSceneBuilder` (Pharr, Jakob, Humphreys, *Physically
//! Based Rendering*, 4th ed., appendix C.2): a stack of graphics states, an options block up to `WorldBegin`, and a world
//! block behind it.

use super::ReadOptions;
use super::objects::ActiveObject;
use super::state::{AttributeTarget, GraphicsState, PENDING, Reference};
use super::transforms::Transforms;
use crate::description::{
    CameraEntity, Entity, Instance, LightEntity, MaterialEntity, MediumEntity, ObjectDefinition, RenderOptions,
    ShapeEntity, TextureEntity, TextureType, TransformSet,
};
use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::parameter::{Parameter, Values};
use crate::parameters::ParameterList;
use crate::schema::{self, Accepts, Category, EntitySchema};
use crate::source::{SourceMap, Span};
use crate::spectrum::ColorSpace;
use glam::DMat4;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A name and its place.
pub(super) type Named = (Arc<str>, Span);

/// What opened a nested graphics state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Opener {
    Attribute,
    Object,
}

/// A use of a texture, to be looked up when all are known.
pub(super) struct TextureUse {
    pub value_type: TextureType,
    pub name: Arc<str>,
    pub span: Span,
    /// The texture that uses it, if one does.
    pub user: Option<usize>,
}

/// Builds a description; see the module.
pub(super) struct Builder<'a> {
    pub diagnostics: Diagnostics,
    pub sources: SourceMap,
    pub directory: PathBuf,
    pub read_options: &'a ReadOptions,
    pub state: GraphicsState,
    pub stack: Vec<(Opener, Span, GraphicsState)>,
    /// How deep the stack was at the beginning of the imported file: what lies below is not its to close.
    pub base: usize,
    pub coordinate_systems: HashMap<Arc<str>, [DMat4; 2]>,
    pub world: Option<Span>,
    /// The end of the scene's text.
    pub end: Option<Span>,
    pub world_assumed: bool,

    pub camera: CameraEntity,
    pub film: Entity,
    pub sampler: Entity,
    pub integrator: Entity,
    pub accelerator: Entity,
    pub pixel_filter: Entity,
    pub options: RenderOptions,
    pub transform_times: [f32; 2],
    pub shapes: Vec<ShapeEntity>,
    pub objects: Vec<ObjectDefinition>,
    pub instances: Vec<Instance>,
    pub lights: Vec<LightEntity>,
    pub area_lights: Vec<Entity>,
    pub materials: Vec<MaterialEntity>,
    pub textures: Vec<TextureEntity>,
    pub media: Vec<MediumEntity>,

    /// Were all parameters of the current directive read? If not, none is called missing.
    pub parameters_complete: bool,
    pub active_object: Option<ActiveObject>,
    pub material_names: HashMap<Arc<str>, usize>,
    pub medium_names: HashMap<Arc<str>, usize>,
    pub object_names: HashMap<Arc<str>, usize>,
    pub texture_names: [HashMap<Arc<str>, usize>; 2],
    pub pending_materials: Vec<Named>,
    pub pending_media: Vec<Named>,
    pub pending_objects: Vec<Named>,
    pub texture_uses: Vec<TextureUse>,
    /// Files that were looked for.
    pub known_files: HashMap<Arc<str>, bool>,
}

fn default_entity(kind: &str) -> Entity {
    Entity {
        kind: kind.into(),
        kind_span: Span::default(),
        span: Span::default(),
        parameters: ParameterList::default(),
        color_space: ColorSpace::Srgb,
    }
}

impl<'a> Builder<'a> {
    pub fn new(directory: &Path, read_options: &'a ReadOptions) -> Self {
        let camera = CameraEntity {
            entity: default_entity("perspective"),
            camera_from_world: TransformSet::IDENTITY,
            medium: None,
        };
        Self {
            diagnostics: Diagnostics::default(),
            sources: SourceMap::default(),
            directory: directory.to_owned(),
            read_options,
            state: GraphicsState::new(),
            stack: Vec::new(),
            base: 0,
            coordinate_systems: HashMap::new(),
            world: None,
            end: None,
            world_assumed: false,
            camera,
            film: default_entity("rgb"),
            sampler: default_entity("zsobol"),
            integrator: default_entity("volpath"),
            accelerator: default_entity("bvh"),
            pixel_filter: default_entity("gaussian"),
            options: RenderOptions::default(),
            transform_times: [0.0, 1.0],
            shapes: Vec::new(),
            objects: Vec::new(),
            instances: Vec::new(),
            lights: Vec::new(),
            area_lights: Vec::new(),
            materials: vec![MaterialEntity { name: None, entity: default_entity("diffuse") }],
            textures: Vec::new(),
            media: Vec::new(),
            parameters_complete: true,
            active_object: None,
            material_names: HashMap::new(),
            medium_names: HashMap::new(),
            object_names: HashMap::new(),
            texture_names: Default::default(),
            pending_materials: Vec::new(),
            pending_media: Vec::new(),
            pending_objects: Vec::new(),
            texture_uses: Vec::new(),
            known_files: HashMap::new(),
        }
    }

    pub fn color_space(&self) -> ColorSpace {
        self.state.color_space
    }

    /// Is this the world block? Says so once if not, and goes on as if it were.
    pub fn require_world(&mut self, directive: &str, span: Span) -> bool {
        if self.world.is_none() && !self.world_assumed {
            self.world_assumed = true;
            let message = format!("`{directive}` must come after `WorldBegin`");
            self.diagnostics.error(span, message);
        }
        true
    }

    /// Is this the options block?
    pub fn require_options(&mut self, directive: &str, span: Span) -> bool {
        if let Some(world) = self.world {
            let message = format!("`{directive}` must come before `WorldBegin`");
            self.diagnostics.push(Diagnostic::error(span, message).with_note(world, "the world begins here"));
        }
        self.world.is_none()
    }

    fn entity(
        &mut self,
        span: Span,
        (kind, kind_span): Named,
        own: Vec<Parameter>,
        target: Option<AttributeTarget>,
    ) -> Entity {
        let parameters = match target {
            Some(target) => ParameterList::with_inherited(own, self.state.attributes(target)),
            None => ParameterList::new(own),
        };
        Entity { kind, kind_span, span, parameters, color_space: self.state.color_space }
    }

    /// Checks an entity, and that the files it names are there. `user`: the texture that it is.
    fn check(&mut self, category: Category, entity: &Entity, user: Option<usize>) {
        let Some(schema) = schema::check(category, entity, self.parameters_complete, &mut self.diagnostics) else {
            return;
        };
        self.note_references(schema, entity, user);
    }

    /// Notes uses of textures, looks for files.
    fn note_references(&mut self, schema: &EntitySchema, entity: &Entity, user: Option<usize>) {
        for parameter in entity.parameters.iter() {
            let Values::Strings(values) = &parameter.values else { continue };
            let Some(expected) = schema.parameter(&parameter.name) else { continue };
            if !expected.accepts.allows(parameter.kind) {
                continue;
            }
            if expected.accepts == Accepts::File {
                values.iter().for_each(|name| self.look_for_file(name, parameter.value_span));
            } else if let (Some(value_type), [name]) = (expected.accepts.texture_type(), values.as_slice()) {
                let (name, span) = (name.clone(), parameter.value_span);
                self.texture_uses.push(TextureUse { value_type, name, span, user });
            }
        }
    }

    /// Reports a file that isn't there: so all of them are said at once.
    fn look_for_file(&mut self, name: &Arc<str>, span: Span) {
        // An empty name stands for none where one may be left out.
        if name.is_empty() {
            return;
        }
        let path = crate::description::resolve(&self.directory, name);
        let exists = *self.known_files.entry(name.clone()).or_insert_with(|| path.exists() && !path.is_dir());
        if !exists {
            let what = if path.is_dir() { "is a directory" } else { "no such file" };
            self.diagnostics.error(span, format!("cannot read `{}`: {what}", path.display()));
        }
    }

    pub fn camera(&mut self, span: Span, kind: Named, parameters: Vec<Parameter>) {
        if !self.require_options("Camera", span) {
            return;
        }
        let entity = self.entity(span, kind, parameters, None);
        self.check(Category::Camera, &entity, None);
        let inverse: Transforms = self.state.transforms.inverse();
        self.coordinate_systems.insert("camera".into(), inverse.matrices);
        let camera_from_world = self.state.transforms.to_set();
        self.camera = CameraEntity { entity, camera_from_world, medium: self.state.outside_medium };
    }

    pub fn film(&mut self, span: Span, kind: Named, parameters: Vec<Parameter>) {
        if self.require_options("Film", span) {
            self.film = self.entity(span, kind, parameters, None);
            schema::check(Category::Film, &self.film, self.parameters_complete, &mut self.diagnostics);
        }
    }

    pub fn sampler(&mut self, span: Span, kind: Named, parameters: Vec<Parameter>) {
        if self.require_options("Sampler", span) {
            self.sampler = self.entity(span, kind, parameters, None);
            schema::check(Category::Sampler, &self.sampler, self.parameters_complete, &mut self.diagnostics);
        }
    }

    pub fn integrator(&mut self, span: Span, kind: Named, parameters: Vec<Parameter>) {
        if self.require_options("Integrator", span) {
            self.integrator = self.entity(span, kind, parameters, None);
            schema::check(Category::Integrator, &self.integrator, self.parameters_complete, &mut self.diagnostics);
        }
    }

    pub fn accelerator(&mut self, span: Span, kind: Named, parameters: Vec<Parameter>) {
        if self.require_options("Accelerator", span) {
            self.accelerator = self.entity(span, kind, parameters, None);
            schema::check(Category::Accelerator, &self.accelerator, self.parameters_complete, &mut self.diagnostics);
        }
    }

    pub fn pixel_filter(&mut self, span: Span, kind: Named, parameters: Vec<Parameter>) {
        if self.require_options("PixelFilter", span) {
            self.pixel_filter = self.entity(span, kind, parameters, None);
            schema::check(Category::PixelFilter, &self.pixel_filter, self.parameters_complete, &mut self.diagnostics);
        }
    }

    pub fn world_begin(&mut self, span: Span) {
        if let Some(world) = self.world {
            let diagnostic = Diagnostic::error(span, "`WorldBegin` is given twice");
            self.diagnostics.push(diagnostic.with_note(world, "first given here"));
            return;
        }
        self.world = Some(span);
        self.state.transforms = Transforms::IDENTITY;
        self.coordinate_systems.insert("world".into(), self.state.transforms.matrices);
    }

    pub fn light_source(&mut self, span: Span, kind: Named, parameters: Vec<Parameter>) {
        self.require_world("LightSource", span);
        let entity = self.entity(span, kind, parameters, Some(AttributeTarget::Light));
        self.check(Category::Light, &entity, None);
        if let Some(object) = &self.active_object {
            let message = "a light inside an object belongs to the scene: it is not instanced";
            self.diagnostics.push(Diagnostic::warning(span, message).with_note(object.span, "in this object"));
        }
        let (world_from_light, outside_medium) = (self.state.transforms.to_set(), self.state.outside_medium);
        self.lights.push(LightEntity { entity, world_from_light, outside_medium });
    }

    pub fn area_light_source(&mut self, span: Span, kind: Named, parameters: Vec<Parameter>) {
        self.require_world("AreaLightSource", span);
        if kind.0.is_empty() {
            self.state.area_light = None;
            return;
        }
        let entity = self.entity(span, kind, parameters, Some(AttributeTarget::Light));
        self.check(Category::AreaLight, &entity, None);
        self.state.area_light = Some(self.area_lights.len());
        self.area_lights.push(entity);
    }

    pub fn material(&mut self, span: Span, kind: Named, parameters: Vec<Parameter>) {
        self.require_world("Material", span);
        let mut entity = self.entity(span, kind, parameters, Some(AttributeTarget::Material));
        self.check_material(&mut entity);
        self.state.material = self.materials.len();
        self.materials.push(MaterialEntity { name: None, entity });
    }

    pub fn make_named_material(&mut self, span: Span, (name, name_span): Named, parameters: Vec<Parameter>) {
        self.require_world("MakeNamedMaterial", span);
        let nameless = ("".into(), name_span);
        let mut entity = self.entity(span, nameless, parameters, Some(AttributeTarget::Material));
        self.kind_from_type(&mut entity, "material");
        if entity.parameters.contains("type") {
            self.check_material(&mut entity);
        }
        if let Some(first) = self.material_names.get(&name) {
            let first = self.materials[*first].entity.span;
            let message = format!("material `{name}` is defined twice");
            self.diagnostics.push(Diagnostic::error(name_span, message).with_note(first, "first defined here"));
            return;
        }
        self.material_names.insert(name.clone(), self.materials.len());
        self.materials.push(MaterialEntity { name: Some(name), entity });
    }

    /// Named materials and media have their kind in a parameter.
    fn kind_from_type(&mut self, entity: &mut Entity, what: &str) {
        match entity.parameters.string("type", &mut self.diagnostics) {
            Some(kind) => {
                let kind: Arc<str> = kind.into();
                entity.kind_span = entity.parameters.span("type").unwrap_or(entity.kind_span);
                entity.kind = kind;
            }
            None if self.parameters_complete => {
                let message = format!("this {what} needs a parameter `\"string type\"`");
                self.diagnostics.error(entity.kind_span, message);
            }
            None => {}
        }
    }

    fn check_material(&mut self, entity: &mut Entity) {
        if matches!(&*entity.kind, "none" | "") {
            let message = format!("material `{}` is called `interface` in pbrt-v4", entity.kind);
            self.diagnostics.warning(entity.kind_span, message);
            entity.kind = "interface".into();
        }
        self.check(Category::Material, entity, None);
    }

    pub fn named_material(&mut self, span: Span, (name, name_span): Named) {
        self.require_world("NamedMaterial", span);
        self.state.material = match self.material_names.get(&name) {
            Some(index) => *index,
            None => pend(&mut self.pending_materials, (name, name_span)),
        };
    }

    pub fn make_named_medium(&mut self, span: Span, (name, name_span): Named, parameters: Vec<Parameter>) {
        let nameless = ("".into(), name_span);
        let mut entity = self.entity(span, nameless, parameters, Some(AttributeTarget::Medium));
        self.kind_from_type(&mut entity, "medium");
        if !entity.kind.is_empty() {
            self.check(Category::Medium, &entity, None);
        }
        if let Some(first) = self.medium_names.get(&name) {
            let first = self.media[*first].entity.span;
            let message = format!("medium `{name}` is defined twice");
            self.diagnostics.push(Diagnostic::error(name_span, message).with_note(first, "first defined here"));
            return;
        }
        self.medium_names.insert(name.clone(), self.media.len());
        self.media.push(MediumEntity { name, entity, world_from_medium: self.state.transforms.to_set() });
    }

    pub fn texture(
        &mut self,
        span: Span,
        (name, name_span): Named,
        (type_name, type_span): Named,
        kind: Named,
        parameters: Vec<Parameter>,
    ) {
        self.require_world("Texture", span);
        let value_type = match &*type_name {
            "float" => TextureType::Float,
            "spectrum" => TextureType::Spectrum,
            other => {
                let message = format!("unknown type of texture `{other}`");
                let help = match other {
                    "color" | "rgb" => "pbrt-v3's `color` is `spectrum` in pbrt-v4",
                    _ => "known are float and spectrum",
                };
                self.diagnostics.push(Diagnostic::error(type_span, message).with_help(help));
                if other != "color" {
                    return;
                }
                TextureType::Spectrum
            }
        };
        let category = match value_type {
            TextureType::Float => Category::FloatTexture,
            TextureType::Spectrum => Category::SpectrumTexture,
        };
        let entity = self.entity(span, kind, parameters, Some(AttributeTarget::Texture));
        self.check(category, &entity, Some(self.textures.len()));
        let names = &mut self.texture_names[value_type as usize];
        if let Some(first) = names.get(&name) {
            let first = self.textures[*first].entity.span;
            let message = format!("{} texture `{name}` is defined twice", value_type.name());
            self.diagnostics.push(Diagnostic::error(name_span, message).with_note(first, "first defined here"));
        } else {
            names.insert(name.clone(), self.textures.len());
        }
        let world_from_texture = self.state.transforms.to_set();
        self.textures.push(TextureEntity { name, value_type, entity, world_from_texture });
    }

    pub fn shape(&mut self, span: Span, kind: Named, parameters: Vec<Parameter>) {
        self.require_world("Shape", span);
        let entity = self.entity(span, kind, parameters, Some(AttributeTarget::Shape));
        self.check(Category::Shape, &entity, None);
        let shape = ShapeEntity {
            entity,
            world_from_object: self.state.transforms.to_set(),
            reverse_orientation: self.state.reverse_orientation,
            material: self.state.material,
            area_light: self.state.area_light,
            inside_medium: self.state.inside_medium,
            outside_medium: self.state.outside_medium,
            mesh: None,
        };
        match &self.active_object {
            None => self.shapes.push(shape),
            Some(object) => {
                if let Some(index) = object.index {
                    self.objects[index].shapes.push(shape);
                }
            }
        }
    }
}

/// Notes a name that isn't defined yet.
pub(super) fn pend(names: &mut Vec<Named>, named: Named) -> Reference {
    names.push(named);
    PENDING + names.len() - 1
}
