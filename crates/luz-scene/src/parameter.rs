//! One parameter: its type, its values and their places.

use crate::source::Span;
use crate::spectrum::SpectrumParameter;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The type a parameter is declared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ParameterType {
    /// `bool`
    Bool,
    /// `integer`
    Integer,
    /// `float`
    Float,
    /// `point2`
    Point2,
    /// `vector2`
    Vector2,
    /// `point3`
    Point3,
    /// `vector3`
    Vector3,
    /// `normal`
    Normal,
    /// `string`
    String,
    /// `texture`: the name of one
    Texture,
    /// `rgb`
    Rgb,
    /// `blackbody`
    Blackbody,
    /// `spectrum`
    Spectrum,
}

impl ParameterType {
    /// Every type.
    pub const ALL: [Self; 13] = [
        Self::Bool,
        Self::Integer,
        Self::Float,
        Self::Point2,
        Self::Vector2,
        Self::Point3,
        Self::Vector3,
        Self::Normal,
        Self::String,
        Self::Texture,
        Self::Rgb,
        Self::Blackbody,
        Self::Spectrum,
    ];

    /// Its name in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bool => "bool",
            Self::Integer => "integer",
            Self::Float => "float",
            Self::Point2 => "point2",
            Self::Vector2 => "vector2",
            Self::Point3 => "point3",
            Self::Vector3 => "vector3",
            Self::Normal => "normal",
            Self::String => "string",
            Self::Texture => "texture",
            Self::Rgb => "rgb",
            Self::Blackbody => "blackbody",
            Self::Spectrum => "spectrum",
        }
    }

    /// The type with this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|t| t.name() == name)
    }

    /// How many values of the text make one value.
    #[must_use]
    pub const fn components(self) -> usize {
        match self {
            Self::Point2 | Self::Vector2 => 2,
            Self::Point3 | Self::Vector3 | Self::Normal | Self::Rgb => 3,
            _ => 1,
        }
    }

    /// Is it one of the three ways to give a spectrum?
    #[must_use]
    pub const fn is_spectrum(self) -> bool {
        matches!(self, Self::Rgb | Self::Blackbody | Self::Spectrum)
    }
}

/// The values of a parameter; never empty.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Of a `bool`.
    Bools(Vec<bool>),
    /// Of an `integer`.
    Integers(Vec<i32>),
    /// Of a `float`, or the components of points, vectors and normals one after the other (a whole number of them).
    /// All are finite.
    Floats(Vec<f32>),
    /// Of a `string` or a `texture`.
    Strings(Vec<Arc<str>>),
    /// Of an `rgb`, a `blackbody` or a `spectrum`.
    Spectra(Vec<SpectrumParameter>),
}

impl Values {
    /// How many values there are (for `Floats`: components).
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Bools(v) => v.len(),
            Self::Integers(v) => v.len(),
            Self::Floats(v) => v.len(),
            Self::Strings(v) => v.len(),
            Self::Spectra(v) => v.len(),
        }
    }

    /// Are there none?
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// One parameter: `"float radius" [ 3 ]`.
#[derive(Debug)]
pub struct Parameter {
    /// Its name.
    pub name: Arc<str>,
    /// Its declared type.
    pub kind: ParameterType,
    /// Its values.
    pub values: Values,
    /// The name within the declaration (`radius`).
    pub name_span: Span,
    /// The values, with their brackets.
    pub value_span: Span,
    used: AtomicBool,
}

impl Clone for Parameter {
    fn clone(&self) -> Self {
        Self {
            name: self.name.clone(),
            kind: self.kind,
            values: self.values.clone(),
            name_span: self.name_span,
            value_span: self.value_span,
            used: AtomicBool::new(self.is_used()),
        }
    }
}

impl Parameter {
    /// A parameter that nobody has asked for yet.
    #[must_use]
    pub fn new(name: Arc<str>, kind: ParameterType, values: Values, name_span: Span, value_span: Span) -> Self {
        Self { name, kind, values, name_span, value_span, used: AtomicBool::new(false) }
    }

    /// Has somebody asked for it?
    #[must_use]
    pub fn is_used(&self) -> bool {
        self.used.load(Ordering::Relaxed)
    }

    /// Notes that somebody asked for it.
    pub fn mark_used(&self) {
        // Shared lists of many threads: don't dirty the cache line again and again.
        if !self.is_used() {
            self.used.store(true, Ordering::Relaxed);
        }
    }
}
