//! Textures out of a scene's descriptions of them.

use super::images::Images;
use super::spectra;
use super::{Context, unsupported};
use crate::texture::{
    Checkerboard, FloatTexture, FloatTextureId, Mapping, SpectrumKind, SpectrumTexture, SpectrumTextureId, TexelFilter,
    Textures,
};
use glam::{Vec2, Vec3};
use luz_color::Spectrum;
use luz_geometry::Transform;
use luz_image::{Encoding, WrapMode};
use luz_scene::{Diagnostic, Entity, FloatOrTexture, SpectrumOrTexture, TextureType, TransformSet};
use std::collections::HashMap;
use std::path::PathBuf;

/// Makes textures, each at most once for what it is used as.
#[derive(Default)]
pub(super) struct TextureBuilder {
    pub textures: Textures,
    pub images: Images,
    floats: HashMap<usize, FloatTextureId>,
    spectra: HashMap<(usize, SpectrumKind), SpectrumTextureId>,
    constants: HashMap<u32, FloatTextureId>,
    depth: u32,
}

/// How deep textures may be made of textures: evaluating them recurses as deep.
const MAX_DEPTH: u32 = 200;

/// How an image texture reads its file.
struct ImageParameters {
    path: PathBuf,
    encoding: Option<Encoding>,
    sampling: (WrapMode, TexelFilter),
    scale: f32,
    invert: bool,
    span: Option<luz_scene::Span>,
}

impl TextureBuilder {
    /// A float that is the same everywhere.
    pub fn constant(&mut self, value: f32) -> FloatTextureId {
        let textures = &mut self.textures;
        *self.constants.entry(value.to_bits()).or_insert_with(|| textures.add_float(FloatTexture::Constant(value)))
    }

    /// The float texture that a parameter names or is.
    pub fn float(&mut self, context: &mut Context<'_>, entity: &Entity, name: &str, default: f32) -> FloatTextureId {
        self.optional_float(context, entity, name).unwrap_or_else(|| self.constant(default))
    }

    /// The float texture that a parameter names or is, if it is given.
    pub fn optional_float(&mut self, context: &mut Context<'_>, entity: &Entity, name: &str) -> Option<FloatTextureId> {
        match entity.parameters.float_or_texture(name, context.diagnostics)? {
            FloatOrTexture::Float(value) => Some(self.constant(value)),
            FloatOrTexture::Texture { name, .. } => {
                let index = context.description.texture_index(TextureType::Float, name)?;
                Some(self.named_float(context, index))
            }
        }
    }

    /// The spectrum texture that a parameter names or is.
    pub fn spectrum(
        &mut self,
        context: &mut Context<'_>,
        entity: &Entity,
        name: &str,
        kind: SpectrumKind,
        default: impl FnOnce() -> Spectrum,
    ) -> SpectrumTextureId {
        self.optional_spectrum(context, entity, name, kind)
            .unwrap_or_else(|| self.textures.add_spectrum(SpectrumTexture::Constant(default())))
    }

    /// The spectrum texture that a parameter names or is, if it is given.
    pub fn optional_spectrum(
        &mut self,
        context: &mut Context<'_>,
        entity: &Entity,
        name: &str,
        kind: SpectrumKind,
    ) -> Option<SpectrumTextureId> {
        match entity.parameters.spectrum_or_texture(name, context.diagnostics)? {
            SpectrumOrTexture::Spectrum(parameter) => {
                let span = entity.parameters.span(name);
                let spectrum = spectra::spectrum(parameter, kind, span, context.diagnostics);
                Some(self.textures.add_spectrum(SpectrumTexture::Constant(spectrum)))
            }
            SpectrumOrTexture::Texture { name, .. } => {
                let index = context.description.texture_index(TextureType::Spectrum, name)?;
                Some(self.named_spectrum(context, index, kind))
            }
        }
    }

    fn is_too_deep(&self, context: &mut Context<'_>, entity: &Entity) -> bool {
        let is_too_deep = self.depth >= MAX_DEPTH;
        if is_too_deep {
            let message = format!("textures are nested more than {MAX_DEPTH} deep here");
            context.diagnostics.error(entity.kind_span, message);
        }
        is_too_deep
    }

    fn named_float(&mut self, context: &mut Context<'_>, index: usize) -> FloatTextureId {
        if let Some(&id) = self.floats.get(&index) {
            return id;
        }
        let description = context.description;
        let texture = &description.textures[index];
        let entity = &texture.entity;
        if self.is_too_deep(context, entity) {
            return self.constant(1.0);
        }
        self.depth += 1;
        let made = match &*entity.kind {
            "constant" => FloatTexture::Constant(entity.parameters.one_float("value", 1.0, context.diagnostics)),
            "scale" => {
                let tex = self.float(context, entity, "tex", 1.0);
                FloatTexture::Scale(tex, self.float(context, entity, "scale", 1.0))
            }
            "mix" => {
                let textures = [self.float(context, entity, "tex1", 0.0), self.float(context, entity, "tex2", 1.0)];
                FloatTexture::Mix { textures, amount: self.float(context, entity, "amount", 0.5) }
            }
            "checkerboard" => {
                let textures = [self.float(context, entity, "tex1", 1.0), self.float(context, entity, "tex2", 0.0)];
                FloatTexture::Checkerboard { board: board(context, entity, &texture.world_from_texture), textures }
            }
            "imagemap" => match self.float_image(context, entity, &texture.world_from_texture) {
                Some(made) => made,
                None => FloatTexture::Constant(1.0),
            },
            _ => {
                unsupported(context, entity, "float texture");
                FloatTexture::Constant(1.0)
            }
        };
        self.depth -= 1;
        let id = self.textures.add_float(made);
        self.floats.insert(index, id);
        id
    }

    fn float_image(
        &mut self,
        context: &mut Context<'_>,
        entity: &Entity,
        to_world: &TransformSet,
    ) -> Option<FloatTexture> {
        let image = image_parameters(context, entity)?;
        let mapping = mapping(context, entity, to_world);
        let pyramid =
            self.images.floats(&image.path, image.encoding, image.sampling, image.span, context.diagnostics)?;
        Some(FloatTexture::Image { pyramid, mapping, scale: image.scale, invert: image.invert })
    }

    fn named_spectrum(&mut self, context: &mut Context<'_>, index: usize, kind: SpectrumKind) -> SpectrumTextureId {
        if let Some(&id) = self.spectra.get(&(index, kind)) {
            return id;
        }
        let description = context.description;
        let texture = &description.textures[index];
        let entity = &texture.entity;
        let one = || Spectrum::Constant(1.0);
        let zero = || Spectrum::Constant(0.0);
        if self.is_too_deep(context, entity) {
            return self.textures.add_spectrum(SpectrumTexture::Constant(one()));
        }
        self.depth += 1;
        let made = match &*entity.kind {
            "constant" => SpectrumTexture::Constant(
                spectra::optional_spectrum(&entity.parameters, "value", kind, context.diagnostics).unwrap_or_else(one),
            ),
            "scale" => {
                let tex = self.spectrum(context, entity, "tex", kind, one);
                SpectrumTexture::Scale(tex, self.float(context, entity, "scale", 1.0))
            }
            "mix" => {
                let first = self.spectrum(context, entity, "tex1", kind, zero);
                let textures = [first, self.spectrum(context, entity, "tex2", kind, one)];
                SpectrumTexture::Mix { textures, amount: self.float(context, entity, "amount", 0.5) }
            }
            "checkerboard" => {
                let first = self.spectrum(context, entity, "tex1", kind, one);
                let textures = [first, self.spectrum(context, entity, "tex2", kind, zero)];
                SpectrumTexture::Checkerboard { board: board(context, entity, &texture.world_from_texture), textures }
            }
            "imagemap" => self
                .spectrum_image(context, entity, &texture.world_from_texture, kind)
                .unwrap_or_else(|| SpectrumTexture::Constant(one())),
            _ => {
                unsupported(context, entity, "spectrum texture");
                SpectrumTexture::Constant(one())
            }
        };
        self.depth -= 1;
        let id = self.textures.add_spectrum(made);
        self.spectra.insert((index, kind), id);
        id
    }

    fn spectrum_image(
        &mut self,
        context: &mut Context<'_>,
        entity: &Entity,
        to_world: &TransformSet,
        kind: SpectrumKind,
    ) -> Option<SpectrumTexture> {
        let image = image_parameters(context, entity)?;
        let mapping = mapping(context, entity, to_world);
        let colors =
            self.images.colors(&image.path, image.encoding, image.sampling, kind, image.span, context.diagnostics)?;
        Some(SpectrumTexture::Image { image: colors, mapping, scale: image.scale, invert: image.invert })
    }
}

fn image_parameters(context: &mut Context<'_>, entity: &Entity) -> Option<ImageParameters> {
    let parameters = &entity.parameters;
    let diagnostics = &mut *context.diagnostics;
    let Some(name) = parameters.string("filename", diagnostics) else {
        diagnostics.error(entity.span, "an `imagemap` needs `\"string filename\"`");
        return None;
    };
    let encoding = parameters.string("encoding", diagnostics).and_then(|name| {
        let known = Encoding::parse(name);
        if known.is_none() {
            diagnostics.push(
                Diagnostic::error(parameters.span("encoding"), format!("unknown encoding `{name}`"))
                    .with_help("known are `sRGB`, `linear` and `gamma G`"),
            );
        }
        known
    });
    let name_of_wrap = parameters.one_string("wrap", "repeat", diagnostics);
    let wrap = WrapMode::parse(name_of_wrap).unwrap_or_else(|| {
        diagnostics.push(
            Diagnostic::error(parameters.span("wrap"), format!("unknown wrap mode `{name_of_wrap}`"))
                .with_help("known are `repeat`, `black`, `clamp`, `octahedralsphere`"),
        );
        WrapMode::Repeat
    });
    let filter = match parameters.one_string("filter", "bilinear", diagnostics) {
        "point" => TexelFilter::Point,
        "bilinear" => TexelFilter::Bilinear,
        "trilinear" => TexelFilter::Trilinear,
        "EWA" | "ewa" => {
            diagnostics.warning(parameters.span("filter"), "`EWA` filtering is not there yet; `trilinear` is used");
            TexelFilter::Trilinear
        }
        other => {
            diagnostics.push(
                Diagnostic::error(parameters.span("filter"), format!("unknown texture filter `{other}`"))
                    .with_help("known are `point`, `bilinear`, `trilinear`, `EWA`"),
            );
            TexelFilter::Bilinear
        }
    };
    Some(ImageParameters {
        path: context.description.resolve(name),
        encoding,
        sampling: (wrap, filter),
        scale: parameters.one_float("scale", 1.0, diagnostics),
        invert: parameters.one_bool("invert", false, diagnostics),
        span: parameters.span("filename"),
    })
}

fn board(context: &mut Context<'_>, entity: &Entity, to_world: &TransformSet) -> Checkerboard {
    match entity.parameters.one_integer("dimension", 2, context.diagnostics) {
        2 => Checkerboard::Flat(mapping(context, entity, to_world)),
        3 => Checkerboard::Solid(texture_from_world(context, entity, to_world)),
        other => {
            let span = entity.parameters.span("dimension");
            context.diagnostics.error(span, format!("a checkerboard has 2 or 3 dimensions, not {other}"));
            Checkerboard::Flat(Mapping::IDENTITY)
        }
    }
}

fn mapping(context: &mut Context<'_>, entity: &Entity, to_world: &TransformSet) -> Mapping {
    let parameters = &entity.parameters;
    let diagnostics = &mut *context.diagnostics;
    let shift =
        Vec2::new(parameters.one_float("udelta", 0.0, diagnostics), parameters.one_float("vdelta", 0.0, diagnostics));
    match parameters.one_string("mapping", "uv", diagnostics) {
        "uv" => {
            let scale = Vec2::new(
                parameters.one_float("uscale", 1.0, diagnostics),
                parameters.one_float("vscale", 1.0, diagnostics),
            );
            Mapping::Uv { scale, shift }
        }
        "planar" => {
            let axes = [
                parameters.one_vector3("v1", Vec3::X, diagnostics),
                parameters.one_vector3("v2", Vec3::Y, diagnostics),
            ];
            Mapping::Planar { texture_from_world: texture_from_world(context, entity, to_world), axes, shift }
        }
        "spherical" => Mapping::Spherical(texture_from_world(context, entity, to_world)),
        "cylindrical" => Mapping::Cylindrical(texture_from_world(context, entity, to_world)),
        other => {
            diagnostics.push(
                Diagnostic::error(parameters.span("mapping"), format!("unknown texture mapping `{other}`"))
                    .with_help("known are `uv`, `spherical`, `cylindrical`, `planar`"),
            );
            Mapping::IDENTITY
        }
    }
}

fn texture_from_world(context: &mut Context<'_>, entity: &Entity, to_world: &TransformSet) -> Transform {
    if to_world.is_animated() {
        context.diagnostics.warning(entity.span, "textures do not move; the transform of the start time is used");
    }
    context.transform(to_world.start, entity.span).inverse()
}
