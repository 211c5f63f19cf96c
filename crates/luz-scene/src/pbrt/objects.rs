//! Objects and their instances, imported files, and options.

use super::builder::{Builder, Named, Opener, pend};
use super::state::GraphicsState;
use crate::description::{Instance, ObjectDefinition, RenderCoordinateSystem, RenderOptions, Spanned};
use crate::diagnostic::{Diagnostic, did_you_mean};
use crate::source::Span;

/// The object being defined.
pub(super) struct ActiveObject {
    /// Its index; `None` if it is defined twice, and dropped.
    pub index: Option<usize>,
    /// Its `ObjectBegin`.
    pub span: Span,
    /// How deep the stack was behind its `ObjectBegin`.
    pub depth: usize,
}

/// What an imported file must not change in the file that imports it.
pub(super) struct ImportedState {
    state: GraphicsState,
    base: usize,
}

impl Builder<'_> {
    pub fn object_begin(&mut self, span: Span, (name, name_span): Named) {
        self.require_world("ObjectBegin", span);
        if let Some(object) = &self.active_object {
            let message = "`ObjectBegin` inside an object";
            self.diagnostics.push(Diagnostic::error(span, message).with_note(object.span, "that object"));
            return;
        }
        self.push_state(Opener::Object, span);
        let index = match self.object_names.get(&name) {
            Some(first) => {
                let first = self.objects[*first].span;
                let message = format!("object `{name}` is defined twice");
                self.diagnostics.push(Diagnostic::error(name_span, message).with_note(first, "first defined here"));
                None
            }
            None => {
                self.object_names.insert(name.clone(), self.objects.len());
                self.objects.push(ObjectDefinition { name, span: name_span, shapes: Vec::new() });
                Some(self.objects.len() - 1)
            }
        };
        self.active_object = Some(ActiveObject { index, span, depth: self.stack.len() });
    }

    pub fn object_end(&mut self, span: Span) {
        self.require_world("ObjectEnd", span);
        let Some(object) = self.active_object.take() else {
            self.diagnostics.error(span, "`ObjectEnd` without `ObjectBegin`");
            return;
        };
        if object.depth <= self.base {
            let message = "`ObjectEnd` in an imported file for an object that began outside of it";
            self.diagnostics.push(Diagnostic::error(span, message).with_note(object.span, "that object"));
            self.active_object = Some(object);
            return;
        }
        // Attributes that were opened inside and not closed.
        while self.stack.len() > object.depth {
            if let Some((_, opened, _)) = self.stack.pop() {
                let message = "`ObjectEnd` before this `AttributeBegin` is closed";
                self.diagnostics.push(Diagnostic::error(opened, message).with_note(span, "the object ends here"));
            }
        }
        if let Some((_, _, state)) = self.stack.pop() {
            self.state = state;
        }
    }

    pub fn object_instance(&mut self, span: Span, (name, name_span): Named) {
        self.require_world("ObjectInstance", span);
        if let Some(object) = &self.active_object {
            let message = "`ObjectInstance` inside an object";
            self.diagnostics.push(Diagnostic::error(span, message).with_note(object.span, "that object"));
            return;
        }
        let object = match self.object_names.get(&name) {
            Some(index) => *index,
            None => pend(&mut self.pending_objects, (name, name_span)),
        };
        let world_from_instance = self.state.transforms.to_set();
        self.instances.push(Instance { object, world_from_instance, span: name_span });
    }

    /// Begins an imported file.
    pub fn begin_import(&mut self) -> ImportedState {
        let base = std::mem::replace(&mut self.base, self.stack.len());
        ImportedState { state: self.state.clone(), base }
    }

    /// Ends an imported file, at `end`.
    pub fn end_import(&mut self, imported: ImportedState, end: Span) {
        if self.active_object.as_ref().is_some_and(|object| object.depth > self.base) {
            self.active_object = None;
        }
        self.close_open(self.base, end);
        self.state = imported.state;
        self.base = imported.base;
    }

    /// Reports what is still open above `depth`.
    pub fn close_open(&mut self, depth: usize, end: Span) {
        while self.stack.len() > depth {
            if let Some((opener, opened, _)) = self.stack.pop() {
                let (begin, missing) = match opener {
                    Opener::Attribute => ("AttributeBegin", "AttributeEnd"),
                    Opener::Object => ("ObjectBegin", "ObjectEnd"),
                };
                let message = format!("this `{begin}` has no `{missing}`");
                self.diagnostics.push(Diagnostic::error(opened, message).with_note(end, "the file ends here"));
            }
        }
    }

    /// Case, `-` and `_` in names of options don't matter, as in pbrt-v4; a type before the name neither.
    pub fn option(&mut self, span: Span, name: &str, name_span: Span, value: &str, quoted: bool) {
        const NAMES: [&str; 11] = [
            "disablepixeljitter",
            "disabletexturefiltering",
            "disablewavelengthjitter",
            "displacementedgescale",
            "forcediffuse",
            "msereferenceimage",
            "msereferenceout",
            "pixelstats",
            "rendercoordsys",
            "seed",
            "wavefront",
        ];
        let word = name.split_whitespace().next_back().unwrap_or_default();
        let normal: String = word.chars().filter(|c| !matches!(c, '-' | '_')).map(|c| c.to_ascii_lowercase()).collect();
        let mut given = Given { value, quoted, span, fault: None };
        let options: &mut RenderOptions = &mut self.options;
        match normal.as_str() {
            "disablepixeljitter" => options.disable_pixel_jitter = given.boolean(),
            "disabletexturefiltering" => options.disable_texture_filtering = given.boolean(),
            "disablewavelengthjitter" => options.disable_wavelength_jitter = given.boolean(),
            "displacementedgescale" => {
                options.displacement_edge_scale =
                    given.parsed("a number", |v| v.parse().ok().filter(|v: &f32| v.is_finite()))
            }
            "forcediffuse" => options.force_diffuse = given.boolean(),
            "msereferenceimage" => options.mse_reference_image = given.text(),
            "msereferenceout" => options.mse_reference_out = given.text(),
            "pixelstats" => options.pixel_stats = given.boolean(),
            "rendercoordsys" => {
                options.render_coordinate_system =
                    given.parsed("\"camera\", \"cameraworld\" or \"world\"", |value| match value {
                        "camera" => Some(RenderCoordinateSystem::Camera),
                        "cameraworld" => Some(RenderCoordinateSystem::CameraWorld),
                        "world" => Some(RenderCoordinateSystem::World),
                        _ => None,
                    });
            }
            "seed" => options.seed = given.parsed("an integer", |value| value.parse().ok()),
            "wavefront" => options.wavefront = given.boolean(),
            _ => {
                let help = did_you_mean(&normal, NAMES).unwrap_or_else(|| format!("known are {}", NAMES.join(", ")));
                let message = format!("unknown option `{word}`");
                self.diagnostics.push(Diagnostic::error(name_span, message).with_help(help));
            }
        }
        if let Some(expected) = given.fault {
            self.diagnostics.error(span, format!("option `{word}` should be {expected}, not `{value}`"));
        }
    }
}

/// The value of an option.
struct Given<'a> {
    value: &'a str,
    quoted: bool,
    span: Span,
    /// What it should have been.
    fault: Option<&'static str>,
}

impl Given<'_> {
    fn parsed<T>(&mut self, expected: &'static str, parse: impl Fn(&str) -> Option<T>) -> Option<Spanned<T>> {
        let value = parse(self.value);
        if value.is_none() {
            self.fault = Some(expected);
        }
        value.map(|value| Spanned { value, span: self.span })
    }

    fn boolean(&mut self) -> Option<Spanned<bool>> {
        self.parsed("true or false", |value| value.parse().ok())
    }

    fn text(&mut self) -> Option<Spanned<std::sync::Arc<str>>> {
        let quoted = self.quoted;
        self.parsed("a quoted string", |value| (quoted && !value.is_empty()).then(|| value.into()))
    }
}
