//! A scene as plain data: what the file says, resolved (transforms multiplied out, names looked up), not interpreted.

use crate::mesh::MeshData;
use crate::parameters::ParameterList;
use crate::source::{SourceMap, Span};
use crate::spectrum::ColorSpace;
use glam::Mat4;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Two transforms, at the start and at the end of the motion ([`Description::transform_times`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransformSet {
    /// At the start time.
    pub start: Mat4,
    /// At the end time.
    pub end: Mat4,
}

impl TransformSet {
    /// Nothing moves, nothing changes.
    pub const IDENTITY: Self = Self { start: Mat4::IDENTITY, end: Mat4::IDENTITY };

    /// Do start and end differ?
    #[must_use]
    pub fn is_animated(&self) -> bool {
        self.start != self.end
    }
}

impl Default for TransformSet {
    fn default() -> Self {
        Self::IDENTITY
    }
}

/// Something a directive made: a kind (`"trianglemesh"`) and its parameters.
#[derive(Clone, Debug)]
pub struct Entity {
    /// The kind, `"perspective"` say; for named materials and media the value of their parameter `"string type"`.
    pub kind: Arc<str>,
    /// Where the kind stands, without its quotes; where the scene leaves the entity to its default, an empty span at
    /// the start of the first file.
    pub kind_span: Span,
    /// The directive's keyword.
    pub span: Span,
    /// The parameters, those of `Attribute` included.
    pub parameters: ParameterList,
    /// The colour space that was current.
    pub color_space: ColorSpace,
}

/// The camera.
#[derive(Clone, Debug)]
pub struct CameraEntity {
    /// Kind and parameters.
    pub entity: Entity,
    /// From world space to camera space (which looks along +z, y up).
    pub camera_from_world: TransformSet,
    /// The medium the camera is in: index into [`Description::media`].
    pub medium: Option<usize>,
}

/// A shape.
#[derive(Clone, Debug)]
pub struct ShapeEntity {
    /// Kind and parameters.
    pub entity: Entity,
    /// From object space to world space; in an object definition, to the space of the instance.
    pub world_from_object: TransformSet,
    /// Does `ReverseOrientation` turn its normals over?
    pub reverse_orientation: bool,
    /// Index into [`Description::materials`].
    pub material: usize,
    /// Index into [`Description::area_lights`].
    pub area_light: Option<usize>,
    /// The medium inside: index into [`Description::media`].
    pub inside_medium: Option<usize>,
    /// The medium outside: index into [`Description::media`].
    pub outside_medium: Option<usize>,
    /// The contents of a `plymesh`'s file, shared by all shapes that name the same file; `None` for other kinds.
    pub mesh: Option<Arc<MeshData>>,
}

/// `ObjectBegin … ObjectEnd`: shapes to be instanced.
#[derive(Clone, Debug)]
pub struct ObjectDefinition {
    /// The object's name.
    pub name: Arc<str>,
    /// Where the name stands.
    pub span: Span,
    /// Its shapes, in order of definition.
    pub shapes: Vec<ShapeEntity>,
}

/// `ObjectInstance`: one use of an object.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Index into [`Description::objects`].
    pub object: usize,
    /// From the space of the object's shapes to world space.
    pub world_from_instance: TransformSet,
    /// Where the name stands.
    pub span: Span,
}

/// A light that is not a shape's.
#[derive(Clone, Debug)]
pub struct LightEntity {
    /// Kind and parameters.
    pub entity: Entity,
    /// From light space to world space.
    pub world_from_light: TransformSet,
    /// The medium it is in: index into [`Description::media`].
    pub outside_medium: Option<usize>,
}

/// A material, named or not.
#[derive(Clone, Debug)]
pub struct MaterialEntity {
    /// The name given by `MakeNamedMaterial`.
    pub name: Option<Arc<str>>,
    /// Kind and parameters.
    pub entity: Entity,
}

/// What a texture yields.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TextureType {
    /// A number.
    Float,
    /// A spectrum.
    Spectrum,
}

impl TextureType {
    /// Its name in scene files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Float => "float",
            Self::Spectrum => "spectrum",
        }
    }
}

/// A named texture.
#[derive(Clone, Debug)]
pub struct TextureEntity {
    /// Its name; float and spectrum textures have separate name spaces.
    pub name: Arc<str>,
    /// What it yields.
    pub value_type: TextureType,
    /// Kind and parameters.
    pub entity: Entity,
    /// From texture space to world space.
    pub world_from_texture: TransformSet,
}

/// A named medium.
#[derive(Clone, Debug)]
pub struct MediumEntity {
    /// Its name.
    pub name: Arc<str>,
    /// Kind and parameters.
    pub entity: Entity,
    /// From medium space to world space.
    pub world_from_medium: TransformSet,
}

/// A value and where it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spanned<T> {
    /// The value.
    pub value: T,
    /// The directive.
    pub span: Span,
}

/// The coordinate system that pbrt-v4 would compute in (`Option "string rendercoordsys"`). It changes no picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RenderCoordinateSystem {
    /// Camera space.
    Camera,
    /// Camera position, world orientation.
    CameraWorld,
    /// World space.
    World,
}

/// What `Option` directives said; `None` where the scene says nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderOptions {
    /// Sample every pixel at its centre.
    pub disable_pixel_jitter: Option<Spanned<bool>>,
    /// Point-sample all textures.
    pub disable_texture_filtering: Option<Spanned<bool>>,
    /// Use the same wavelengths for every sample.
    pub disable_wavelength_jitter: Option<Spanned<bool>>,
    /// Target edge length of displaced geometry.
    pub displacement_edge_scale: Option<Spanned<f32>>,
    /// Replace every material by a diffuse one.
    pub force_diffuse: Option<Spanned<bool>>,
    /// Report the error against this image while rendering.
    pub mse_reference_image: Option<Spanned<Arc<str>>>,
    /// Where to report it.
    pub mse_reference_out: Option<Spanned<Arc<str>>>,
    /// Write statistics of every pixel.
    pub pixel_stats: Option<Spanned<bool>>,
    /// Coordinate system of pbrt-v4's computations.
    pub render_coordinate_system: Option<Spanned<RenderCoordinateSystem>>,
    /// Seed of the random numbers.
    pub seed: Option<Spanned<i32>>,
    /// Use pbrt-v4's wavefront integrator.
    pub wavefront: Option<Spanned<bool>>,
}

/// A scene as plain data. Entities that the scene leaves out have pbrt-v4's defaults: camera `perspective`, sampler
/// `zsobol`, pixel filter `gaussian`, integrator `volpath`, accelerator `bvh`, film `rgb`.
///
/// Every index is valid, and every name of a texture or a material in a parameter is that of one that exists. Textures
/// and mix materials use only what stands before them in [`Description::textures`] and [`Description::materials`], so
/// that both can be built from front to back.
#[derive(Clone, Debug)]
pub struct Description {
    /// `Camera`.
    pub camera: CameraEntity,
    /// `Film`.
    pub film: Entity,
    /// `Sampler`.
    pub sampler: Entity,
    /// `Integrator`.
    pub integrator: Entity,
    /// `Accelerator`.
    pub accelerator: Entity,
    /// `PixelFilter`.
    pub pixel_filter: Entity,
    /// `Option`.
    pub options: RenderOptions,
    /// `TransformTimes`: start and end of the motion, in seconds. The default is 0, 1.
    pub transform_times: [f32; 2],
    /// Shapes outside object definitions, in order of definition.
    pub shapes: Vec<ShapeEntity>,
    /// `ObjectBegin`, in order of definition.
    pub objects: Vec<ObjectDefinition>,
    /// `ObjectInstance`, in order.
    pub instances: Vec<Instance>,
    /// `LightSource`, in order.
    pub lights: Vec<LightEntity>,
    /// `AreaLightSource`, in order.
    pub area_lights: Vec<Entity>,
    /// `Material` and `MakeNamedMaterial`, in order of definition (but see above); the first is the default material,
    /// `diffuse`.
    pub materials: Vec<MaterialEntity>,
    /// `Texture`, in order of definition (but see above).
    pub textures: Vec<TextureEntity>,
    /// `MakeNamedMedium`, in order.
    pub media: Vec<MediumEntity>,
    /// The directory that relative file names start from: the top-level scene's.
    pub directory: PathBuf,
    /// The texts that all spans point into.
    pub sources: SourceMap,
}

impl Description {
    /// The file that a name in the scene means: relative names start from the top-level scene's directory, and from
    /// the working directory where no such file is there.
    #[must_use]
    pub fn resolve(&self, name: &str) -> PathBuf {
        resolve(&self.directory, name)
    }

    /// The index of a named material.
    #[must_use]
    pub fn material_index(&self, name: &str) -> Option<usize> {
        self.materials.iter().position(|material| material.name.as_deref() == Some(name))
    }

    /// The index of a texture.
    #[must_use]
    pub fn texture_index(&self, value_type: TextureType, name: &str) -> Option<usize> {
        self.textures.iter().position(|texture| texture.value_type == value_type && &*texture.name == name)
    }

    /// The index of a medium.
    #[must_use]
    pub fn medium_index(&self, name: &str) -> Option<usize> {
        self.media.iter().position(|medium| &*medium.name == name)
    }
}

/// See [`Description::resolve`].
pub(crate) fn resolve(directory: &Path, name: &str) -> PathBuf {
    let beside_scene = directory.join(name);
    if beside_scene.exists() || !Path::new(name).exists() { beside_scene } else { PathBuf::from(name) }
}
