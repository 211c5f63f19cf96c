//! The parameters of an entity, with a memory of which were asked for.

use crate::diagnostic::{Diagnostic, Diagnostics, did_you_mean};
use crate::parameter::{Parameter, ParameterType, Values};
use crate::source::Span;
use crate::spectrum::SpectrumParameter;
use glam::{Vec2, Vec3};
use std::sync::Arc;

/// A parameter that may be a number or a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FloatOrTexture<'a> {
    /// `"float roughness" 0.1`
    Float(f32),
    /// `"texture roughness" "name"`: a float texture.
    Texture {
        /// The texture's name; one is defined.
        name: &'a str,
        /// Where the name stands.
        span: Span,
    },
}

/// A parameter that may be a spectrum or a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SpectrumOrTexture<'a> {
    /// `"rgb reflectance" [.5 .5 .5]` and the like.
    Spectrum(&'a SpectrumParameter),
    /// `"texture reflectance" "name"`: a spectrum texture.
    Texture {
        /// The texture's name; one is defined.
        name: &'a str,
        /// Where the name stands.
        span: Span,
    },
}

/// The parameters of an entity. Every accessor takes the last definition of a name (an entity's own before those of
/// `Attribute`), notes that it was asked for, and pushes a diagnostic (and answers as if the parameter were absent)
/// where type or number of values are wrong.
#[derive(Clone, Debug, Default)]
pub struct ParameterList {
    /// Those of `Attribute`, shared by all entities they apply to.
    inherited: Arc<Vec<Arc<Parameter>>>,
    own: Vec<Parameter>,
}

impl ParameterList {
    /// A list of an entity's own parameters.
    #[must_use]
    pub fn new(own: Vec<Parameter>) -> Self {
        Self { inherited: Arc::default(), own }
    }

    /// A list of an entity's own parameters and those that `Attribute` directives gave it.
    #[must_use]
    pub fn with_inherited(own: Vec<Parameter>, inherited: Arc<Vec<Arc<Parameter>>>) -> Self {
        Self { inherited, own }
    }

    /// All parameters, in the order of the text, those of `Attribute` first.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = &Parameter> {
        self.inherited.iter().map(|p| &**p).chain(&self.own)
    }

    /// The entity's own parameters, without those of `Attribute`.
    #[must_use]
    pub fn own(&self) -> &[Parameter] {
        &self.own
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.inherited.len() + self.own.len()
    }

    /// Are there none?
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The parameter of this name that counts, of whatever type, without noting that it was asked for.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&Parameter> {
        self.iter().rev().find(|p| &*p.name == name)
    }

    /// Is there a parameter of this name?
    #[must_use]
    pub fn contains(&self, name: &str) -> bool {
        self.get(name).is_some()
    }

    /// Where the value of a parameter stands.
    #[must_use]
    pub fn span(&self, name: &str) -> Option<Span> {
        self.get(name).map(|p| p.value_span)
    }

    /// Notes that the parameters of this name were asked for.
    pub fn mark_used(&self, name: &str) {
        self.iter().filter(|p| &*p.name == name).for_each(Parameter::mark_used);
    }

    /// The last parameter of this name and of a type that will do. Says so if there are only others.
    fn find(
        &self,
        name: &str,
        expected: &str,
        accept: impl Fn(ParameterType) -> bool,
        diagnostics: &mut Diagnostics,
    ) -> Option<&Parameter> {
        let mut mismatch: Option<&Parameter> = None;
        for parameter in self.iter().rev().filter(|p| &*p.name == name) {
            if accept(parameter.kind) {
                parameter.mark_used();
                return Some(parameter);
            }
            mismatch = mismatch.or(Some(parameter));
        }
        if let Some(parameter) = mismatch
            && !parameter.is_used()
        {
            parameter.mark_used();
            diagnostics.error(
                parameter.name_span,
                format!("parameter `{name}` should be {expected}, not {}", parameter.kind.name()),
            );
        }
        None
    }

    fn of_type(&self, name: &str, kind: ParameterType, diagnostics: &mut Diagnostics) -> Option<&Parameter> {
        self.find(name, kind.name(), |k| k == kind, diagnostics)
    }

    fn components(&self, name: &str, kind: ParameterType, diagnostics: &mut Diagnostics) -> Option<&[f32]> {
        match &self.of_type(name, kind, diagnostics)?.values {
            Values::Floats(values) => Some(values),
            _ => None,
        }
    }

    fn one_of(&self, name: &str, kind: ParameterType, diagnostics: &mut Diagnostics) -> Option<&[f32]> {
        let values = self.components(name, kind, diagnostics)?;
        self.just_one(name, values.len() / kind.components(), diagnostics).then_some(values)
    }

    fn just_one(&self, name: &str, count: usize, diagnostics: &mut Diagnostics) -> bool {
        if count != 1 {
            let message = format!("parameter `{name}` should have one value, not {count}");
            diagnostics.error(self.span(name), message);
        }
        count == 1
    }

    /// All values of a `bool`.
    pub fn bools(&self, name: &str, diagnostics: &mut Diagnostics) -> Option<&[bool]> {
        match &self.of_type(name, ParameterType::Bool, diagnostics)?.values {
            Values::Bools(values) => Some(values),
            _ => None,
        }
    }

    /// All values of an `integer`.
    pub fn integers(&self, name: &str, diagnostics: &mut Diagnostics) -> Option<&[i32]> {
        match &self.of_type(name, ParameterType::Integer, diagnostics)?.values {
            Values::Integers(values) => Some(values),
            _ => None,
        }
    }

    /// All values of a `float`.
    pub fn floats(&self, name: &str, diagnostics: &mut Diagnostics) -> Option<&[f32]> {
        self.components(name, ParameterType::Float, diagnostics)
    }

    /// All values of a `point2`.
    pub fn points2(&self, name: &str, diagnostics: &mut Diagnostics) -> Option<&[Vec2]> {
        self.components(name, ParameterType::Point2, diagnostics).map(bytemuck::cast_slice)
    }

    /// All values of a `vector2`.
    pub fn vectors2(&self, name: &str, diagnostics: &mut Diagnostics) -> Option<&[Vec2]> {
        self.components(name, ParameterType::Vector2, diagnostics).map(bytemuck::cast_slice)
    }

    /// All values of a `point3`.
    pub fn points3(&self, name: &str, diagnostics: &mut Diagnostics) -> Option<&[Vec3]> {
        self.components(name, ParameterType::Point3, diagnostics).map(bytemuck::cast_slice)
    }

    /// All values of a `vector3`.
    pub fn vectors3(&self, name: &str, diagnostics: &mut Diagnostics) -> Option<&[Vec3]> {
        self.components(name, ParameterType::Vector3, diagnostics).map(bytemuck::cast_slice)
    }

    /// All values of a `normal`.
    pub fn normals(&self, name: &str, diagnostics: &mut Diagnostics) -> Option<&[Vec3]> {
        self.components(name, ParameterType::Normal, diagnostics).map(bytemuck::cast_slice)
    }

    /// All values of a `string`.
    pub fn strings(&self, name: &str, diagnostics: &mut Diagnostics) -> Option<&[Arc<str>]> {
        match &self.of_type(name, ParameterType::String, diagnostics)?.values {
            Values::Strings(values) => Some(values),
            _ => None,
        }
    }

    /// All values of an `rgb`, `blackbody` or `spectrum`.
    pub fn spectra(&self, name: &str, diagnostics: &mut Diagnostics) -> Option<&[SpectrumParameter]> {
        match &self.find(name, "a spectrum", ParameterType::is_spectrum, diagnostics)?.values {
            Values::Spectra(values) => Some(values),
            _ => None,
        }
    }

    /// A single `bool`.
    pub fn one_bool(&self, name: &str, default: bool, diagnostics: &mut Diagnostics) -> bool {
        match self.bools(name, diagnostics) {
            Some(values) if self.just_one(name, values.len(), diagnostics) => values[0],
            _ => default,
        }
    }

    /// A single `integer`.
    pub fn one_integer(&self, name: &str, default: i32, diagnostics: &mut Diagnostics) -> i32 {
        match self.integers(name, diagnostics) {
            Some(values) if self.just_one(name, values.len(), diagnostics) => values[0],
            _ => default,
        }
    }

    /// A single `float`.
    pub fn one_float(&self, name: &str, default: f32, diagnostics: &mut Diagnostics) -> f32 {
        self.one_of(name, ParameterType::Float, diagnostics).map_or(default, |v| v[0])
    }

    /// A single `point2`.
    pub fn one_point2(&self, name: &str, default: Vec2, diagnostics: &mut Diagnostics) -> Vec2 {
        self.one_of(name, ParameterType::Point2, diagnostics).map_or(default, Vec2::from_slice)
    }

    /// A single `vector2`.
    pub fn one_vector2(&self, name: &str, default: Vec2, diagnostics: &mut Diagnostics) -> Vec2 {
        self.one_of(name, ParameterType::Vector2, diagnostics).map_or(default, Vec2::from_slice)
    }

    /// A single `point3`.
    pub fn one_point3(&self, name: &str, default: Vec3, diagnostics: &mut Diagnostics) -> Vec3 {
        self.one_of(name, ParameterType::Point3, diagnostics).map_or(default, Vec3::from_slice)
    }

    /// A single `vector3`.
    pub fn one_vector3(&self, name: &str, default: Vec3, diagnostics: &mut Diagnostics) -> Vec3 {
        self.one_of(name, ParameterType::Vector3, diagnostics).map_or(default, Vec3::from_slice)
    }

    /// A single `normal`.
    pub fn one_normal(&self, name: &str, default: Vec3, diagnostics: &mut Diagnostics) -> Vec3 {
        self.one_of(name, ParameterType::Normal, diagnostics).map_or(default, Vec3::from_slice)
    }

    /// A single `string`, if there is one.
    pub fn string(&self, name: &str, diagnostics: &mut Diagnostics) -> Option<&str> {
        let values = self.strings(name, diagnostics)?;
        self.just_one(name, values.len(), diagnostics).then(|| &*values[0])
    }

    /// A single `string`.
    pub fn one_string<'a>(&'a self, name: &str, default: &'a str, diagnostics: &mut Diagnostics) -> &'a str {
        self.string(name, diagnostics).unwrap_or(default)
    }

    /// A single spectrum, if there is one.
    pub fn spectrum(&self, name: &str, diagnostics: &mut Diagnostics) -> Option<&SpectrumParameter> {
        let values = self.spectra(name, diagnostics)?;
        self.just_one(name, values.len(), diagnostics).then(|| &values[0])
    }

    /// The name of a `texture` and its place, if there is one.
    pub fn texture(&self, name: &str, diagnostics: &mut Diagnostics) -> Option<(&str, Span)> {
        let parameter = self.of_type(name, ParameterType::Texture, diagnostics)?;
        self.texture_name(parameter, diagnostics)
    }

    fn texture_name<'a>(&self, parameter: &'a Parameter, diagnostics: &mut Diagnostics) -> Option<(&'a str, Span)> {
        let Values::Strings(values) = &parameter.values else { return None };
        let one = self.just_one(&parameter.name, values.len(), diagnostics);
        one.then(|| (&*values[0], parameter.value_span))
    }

    /// A `float` or a float `texture`, if there is one.
    pub fn float_or_texture(&self, name: &str, diagnostics: &mut Diagnostics) -> Option<FloatOrTexture<'_>> {
        let accept = |kind| matches!(kind, ParameterType::Float | ParameterType::Texture);
        let parameter = self.find(name, "float or texture", accept, diagnostics)?;
        match &parameter.values {
            Values::Floats(values) => {
                self.just_one(name, values.len(), diagnostics).then(|| FloatOrTexture::Float(values[0]))
            }
            _ => self.texture_name(parameter, diagnostics).map(|(name, span)| FloatOrTexture::Texture { name, span }),
        }
    }

    /// A spectrum or a spectrum `texture`, if there is one.
    pub fn spectrum_or_texture(&self, name: &str, diagnostics: &mut Diagnostics) -> Option<SpectrumOrTexture<'_>> {
        let accept = |kind: ParameterType| kind.is_spectrum() || kind == ParameterType::Texture;
        let parameter = self.find(name, "a spectrum or texture", accept, diagnostics)?;
        match &parameter.values {
            Values::Spectra(values) => {
                self.just_one(name, values.len(), diagnostics).then(|| SpectrumOrTexture::Spectrum(&values[0]))
            }
            _ => {
                self.texture_name(parameter, diagnostics).map(|(name, span)| SpectrumOrTexture::Texture { name, span })
            }
        }
    }

    /// Reports every parameter that nobody asked for, `Attribute`'s and those shadowed by a later definition excepted,
    /// as an error with a suggestion out of `known`.
    pub fn report_unused(&self, known: &[&str], diagnostics: &mut Diagnostics) {
        for (index, parameter) in self.own.iter().enumerate() {
            let shadowed = || self.own[index + 1..].iter().any(|later| later.name == parameter.name);
            if parameter.is_used() || shadowed() {
                continue;
            }
            let message = if known.contains(&&*parameter.name) {
                format!("parameter `{}` is not used here", parameter.name)
            } else {
                format!("unknown parameter `{}`", parameter.name)
            };
            let candidates = known.iter().copied().filter(|k| *k != &*parameter.name);
            diagnostics.push(
                Diagnostic::error(parameter.name_span, message)
                    .with_optional_help(did_you_mean(&parameter.name, candidates)),
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameter(name: &str, kind: ParameterType, values: Values) -> Parameter {
        Parameter::new(name.into(), kind, values, Span::default(), Span::default())
    }

    fn list() -> ParameterList {
        let attributes = [("alpha", 0.5), ("radius", 7.0)]
            .map(|(name, value)| Arc::new(parameter(name, ParameterType::Float, Values::Floats(vec![value]))));
        let own = vec![
            parameter("radius", ParameterType::Float, Values::Floats(vec![1.0])),
            parameter("radius", ParameterType::Float, Values::Floats(vec![2.0])),
            parameter("P", ParameterType::Point3, Values::Floats(vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0])),
            parameter("reflectence", ParameterType::Rgb, Values::Spectra(vec![SpectrumParameter::Blackbody(1.0)])),
        ];
        ParameterList::with_inherited(own, Arc::new(attributes.to_vec()))
    }

    fn messages(diagnostics: &Diagnostics) -> Vec<&str> {
        diagnostics.iter().map(|d| d.message.as_str()).collect()
    }

    #[test]
    fn the_last_definition_counts() {
        let (list, mut d) = (list(), Diagnostics::default());
        assert_eq!(list.one_float("radius", 9.0, &mut d), 2.0);
        assert_eq!(list.one_float("zmin", 9.0, &mut d), 9.0);
        assert_eq!(list.points3("P", &mut d), Some(&[Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0)][..]));
        assert!(d.is_empty());
    }

    #[test]
    fn wrong_types_and_counts_are_said_once() {
        let (list, mut d) = (list(), Diagnostics::default());
        assert_eq!(list.one_integer("radius", 9, &mut d), 9);
        assert_eq!(list.one_integer("radius", 9, &mut d), 9);
        assert_eq!(list.one_point3("P", Vec3::ZERO, &mut d), Vec3::ZERO);
        assert_eq!(
            messages(&d),
            ["parameter `radius` should be integer, not float", "parameter `P` should have one value, not 2"]
        );
    }

    #[test]
    fn unused_parameters_are_reported_with_suggestions() {
        let (list, mut d) = (list(), Diagnostics::default());
        list.one_float("radius", 1.0, &mut d);
        list.report_unused(&["P", "radius", "reflectance"], &mut d);
        assert_eq!(messages(&d), ["parameter `P` is not used here", "unknown parameter `reflectence`"]);
        assert_eq!(d.iter().nth(1).and_then(|d| d.help.as_deref()), Some("did you mean `reflectance`?"));
    }
}
