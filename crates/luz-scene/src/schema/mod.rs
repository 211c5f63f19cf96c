//! What pbrt-v4 knows: every kind of entity, its parameters and their types. With it, a whole scene can be checked as it
//! is read, whether or not a part of it can be rendered.

mod spectra;
mod tables;

pub use spectra::NAMED_SPECTRA;

use crate::description::{Entity, TextureType};
use crate::diagnostic::{Diagnostic, Diagnostics, did_you_mean};
use crate::parameter::{Parameter, ParameterType};

/// A class of entities, by what makes them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Category {
    /// `Shape`
    Shape,
    /// `LightSource`
    Light,
    /// `AreaLightSource`
    AreaLight,
    /// `Material`, `MakeNamedMaterial`
    Material,
    /// `Texture … "float"`
    FloatTexture,
    /// `Texture … "spectrum"`
    SpectrumTexture,
    /// `MakeNamedMedium`
    Medium,
    /// `Camera`
    Camera,
    /// `Film`
    Film,
    /// `PixelFilter`
    PixelFilter,
    /// `Sampler`
    Sampler,
    /// `Integrator`
    Integrator,
    /// `Accelerator`
    Accelerator,
}

impl Category {
    /// Every category.
    pub const ALL: [Self; 13] = [
        Self::Shape,
        Self::Light,
        Self::AreaLight,
        Self::Material,
        Self::FloatTexture,
        Self::SpectrumTexture,
        Self::Medium,
        Self::Camera,
        Self::Film,
        Self::PixelFilter,
        Self::Sampler,
        Self::Integrator,
        Self::Accelerator,
    ];

    /// What a person calls it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Shape => "shape",
            Self::Light => "light",
            Self::AreaLight => "area light",
            Self::Material => "material",
            Self::FloatTexture => "float texture",
            Self::SpectrumTexture => "spectrum texture",
            Self::Medium => "medium",
            Self::Camera => "camera",
            Self::Film => "film",
            Self::PixelFilter => "pixel filter",
            Self::Sampler => "sampler",
            Self::Integrator => "integrator",
            Self::Accelerator => "accelerator",
        }
    }
}

/// What a parameter may be given as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Accepts {
    /// One of the plain types.
    Type(ParameterType),
    /// A string that names a file to be read.
    File,
    /// `rgb`, `blackbody` or `spectrum`.
    Spectrum,
    /// `float` or a spectrum.
    FloatOrSpectrum,
    /// `float` or `rgb`.
    FloatOrRgb,
    /// The name of a float texture.
    FloatTexture,
    /// `float` or the name of a float texture.
    FloatOrTexture,
    /// A spectrum or the name of a spectrum texture.
    SpectrumOrTexture,
}

impl Accepts {
    /// May the parameter be declared with this type?
    #[must_use]
    pub fn allows(self, kind: ParameterType) -> bool {
        match self {
            Self::Type(own) => own == kind,
            Self::File => kind == ParameterType::String,
            Self::Spectrum => kind.is_spectrum(),
            Self::FloatOrSpectrum => kind == ParameterType::Float || kind.is_spectrum(),
            Self::FloatOrRgb => matches!(kind, ParameterType::Float | ParameterType::Rgb),
            Self::FloatTexture => kind == ParameterType::Texture,
            Self::FloatOrTexture => matches!(kind, ParameterType::Float | ParameterType::Texture),
            Self::SpectrumOrTexture => kind == ParameterType::Texture || kind.is_spectrum(),
        }
    }

    /// For people: "float or texture".
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Type(own) => own.name(),
            Self::File => "string",
            Self::Spectrum => "rgb, blackbody or spectrum",
            Self::FloatOrSpectrum => "float, rgb, blackbody or spectrum",
            Self::FloatOrRgb => "float or rgb",
            Self::FloatTexture => "texture",
            Self::FloatOrTexture => "float or texture",
            Self::SpectrumOrTexture => "rgb, blackbody, spectrum or texture",
        }
    }

    /// If it is given as a texture: of which type must that be?
    #[must_use]
    pub fn texture_type(self) -> Option<TextureType> {
        match self {
            Self::FloatTexture | Self::FloatOrTexture => Some(TextureType::Float),
            Self::SpectrumOrTexture => Some(TextureType::Spectrum),
            _ => None,
        }
    }
}

/// How many values a parameter has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    /// Exactly so many.
    Exactly(usize),
    /// One or more.
    Many,
}

/// One parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParameterSchema {
    /// Its name.
    pub name: &'static str,
    /// Its type.
    pub accepts: Accepts,
    /// How many values it has.
    pub count: Count,
    /// Must it be given?
    pub required: bool,
}

/// One kind of entity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EntitySchema {
    /// Its name in scene files.
    pub kind: &'static str,
    /// Its parameters, in groups that kinds share.
    groups: &'static [&'static [ParameterSchema]],
}

impl EntitySchema {
    /// Its parameters.
    pub fn parameters(&self) -> impl Iterator<Item = &'static ParameterSchema> + Clone {
        self.groups.iter().copied().flatten()
    }

    /// One parameter.
    #[must_use]
    pub fn parameter(&self, name: &str) -> Option<&'static ParameterSchema> {
        self.parameters().find(|p| p.name == name)
    }
}

/// All kinds of a category.
#[must_use]
pub fn kinds(category: Category) -> &'static [EntitySchema] {
    tables::kinds(category)
}

/// One kind of a category.
#[must_use]
pub fn entity(category: Category, kind: &str) -> Option<&'static EntitySchema> {
    kinds(category).iter().find(|schema| schema.kind == kind)
}

/// Checks kind, names, types and numbers of values of an entity's own parameters. (Those of `Attribute` are for many
/// kinds of entities and need not fit this one.) `complete`: all of them are there, so that a required one that isn't
/// is missing. Returns the schema, if the kind is known.
pub(crate) fn check(
    category: Category,
    entity: &Entity,
    complete: bool,
    diagnostics: &mut Diagnostics,
) -> Option<&'static EntitySchema> {
    let Some(schema) = self::entity(category, &entity.kind) else {
        let what = format!("unknown {} `{}`", category.name(), entity.kind);
        let help = crate::pbrt::legacy::kind(category, &entity.kind).map(str::to_owned).or_else(|| {
            did_you_mean(&entity.kind, kinds(category).iter().map(|s| s.kind)).or_else(|| Some(list_kinds(category)))
        });
        diagnostics.push(Diagnostic::error(entity.kind_span, what).with_optional_help(help));
        return None;
    };
    for (index, parameter) in entity.parameters.own().iter().enumerate() {
        match schema.parameter(&parameter.name) {
            Some(expected) => check_parameter(expected, parameter, diagnostics),
            None => diagnostics.push(unknown_parameter(category, schema, parameter)),
        }
        let earlier = &entity.parameters.own()[..index];
        // Long lists come from garbage only; don't spend quadratic time on them.
        if index < 64
            && let Some(first) = earlier.iter().find(|p| p.name == parameter.name && p.kind == parameter.kind)
        {
            diagnostics.push(
                Diagnostic::warning(
                    parameter.name_span,
                    format!("parameter `{}` is given twice; the last one counts", parameter.name),
                )
                .with_note(first.name_span, "first given here"),
            );
        }
    }
    for missing in schema.parameters().filter(|p| complete && p.required && !entity.parameters.contains(p.name)) {
        diagnostics.error(
            entity.kind_span,
            format!(
                "{} `{}` needs a parameter `\"{} {}\"`",
                category.name(),
                schema.kind,
                missing.accepts.name(),
                missing.name
            ),
        );
    }
    Some(schema)
}

fn list_kinds(category: Category) -> String {
    let names: Vec<_> = kinds(category).iter().map(|s| s.kind).filter(|k| !k.is_empty()).collect();
    format!("known are {}", names.join(", "))
}

fn check_parameter(expected: &ParameterSchema, parameter: &Parameter, diagnostics: &mut Diagnostics) {
    if !expected.accepts.allows(parameter.kind) {
        diagnostics.error(
            parameter.name_span,
            format!(
                "parameter `{}` should be {}, not {}",
                parameter.name,
                expected.accepts.name(),
                parameter.kind.name()
            ),
        );
        return;
    }
    let components = match parameter.kind {
        // Spectra are counted whole.
        kind if kind.is_spectrum() => 1,
        kind => kind.components(),
    };
    let count = parameter.values.len() / components;
    if let Count::Exactly(expected_count) = expected.count
        && count != expected_count
    {
        let plural = if expected_count == 1 { "" } else { "s" };
        diagnostics.error(
            parameter.value_span,
            format!("parameter `{}` should have {expected_count} value{plural}, not {count}", parameter.name),
        );
    }
}

fn unknown_parameter(category: Category, schema: &EntitySchema, parameter: &Parameter) -> Diagnostic {
    let what = format!("unknown parameter `{}` of {} `{}`", parameter.name, category.name(), schema.kind);
    let help = crate::pbrt::legacy::parameter(category, schema.kind, &parameter.name)
        .map(str::to_owned)
        .or_else(|| did_you_mean(&parameter.name, schema.parameters().map(|p| p.name)));
    Diagnostic::error(parameter.name_span, what).with_optional_help(help)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique() {
        for category in Category::ALL {
            for (index, schema) in kinds(category).iter().enumerate() {
                assert!(kinds(category)[..index].iter().all(|s| s.kind != schema.kind), "{category:?} {}", schema.kind);
                let names: Vec<_> = schema.parameters().map(|p| p.name).collect();
                for (i, name) in names.iter().enumerate() {
                    assert!(!names[..i].contains(name), "{category:?} {} {name}", schema.kind);
                }
            }
        }
    }
}
