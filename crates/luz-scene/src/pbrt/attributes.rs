//! Directives that change the graphics state: transformations and attributes.

use super::builder::{Builder, Named, Opener, pend};
use super::state::{AttributeTarget, GraphicsState, Reference};
use super::transforms::{self, MatrixFault};
use crate::diagnostic::{Diagnostic, did_you_mean};
use crate::parameter::Parameter;
use crate::source::Span;
use crate::spectrum::ColorSpace;
use glam::DMat4;
use std::sync::Arc;

impl Builder<'_> {
    // Transformations

    pub fn identity(&mut self) {
        // The identity cannot fail.
        let _ = self.state.transforms.set(DMat4::IDENTITY);
    }

    fn concatenate(&mut self, matrix: DMat4, span: Span) {
        let result = self.state.transforms.concatenate(matrix);
        self.report_matrix(result, span);
    }

    fn report_matrix(&mut self, result: Result<(), MatrixFault>, span: Span) {
        let message = match result {
            Ok(()) => return,
            Err(MatrixFault::Singular) => "this transformation has no inverse",
            Err(MatrixFault::OutOfRange) => {
                "with this, the current transformation leaves the range of single precision"
            }
        };
        self.diagnostics.error(span, message);
    }

    pub fn translate(&mut self, v: [f32; 3], span: Span) {
        self.concatenate(transforms::translate(v), span);
    }

    pub fn scale(&mut self, v: [f32; 3], span: Span) {
        self.concatenate(transforms::scale(v), span);
    }

    pub fn rotate(&mut self, degrees: f32, axis: [f32; 3], span: Span) {
        match transforms::rotate(degrees, axis) {
            Some(matrix) => self.concatenate(matrix, span),
            None => self.diagnostics.error(span, "the axis of this rotation has length zero"),
        }
    }

    pub fn look_at(&mut self, v: [f32; 9], span: Span) {
        match transforms::look_at(v) {
            Some(matrix) => self.concatenate(matrix, span),
            None => self.diagnostics.push(
                Diagnostic::error(span, "this `LookAt` leaves the orientation open")
                    .with_help("eye and target must differ, and up must not be parallel to the line between them"),
            ),
        }
    }

    pub fn set_transform(&mut self, v: [f32; 16], span: Span) {
        let result = self.state.transforms.set(DMat4::from_cols_array(&v.map(f64::from)));
        self.report_matrix(result, span);
    }

    pub fn concat_transform(&mut self, v: [f32; 16], span: Span) {
        self.concatenate(DMat4::from_cols_array(&v.map(f64::from)), span);
    }

    pub fn transform_times(&mut self, times: [f32; 2], span: Span) {
        if self.require_options("TransformTimes", span) {
            if times[1] < times[0] {
                self.diagnostics.error(span, "the end time must not come before the start time");
            }
            self.transform_times = times;
        }
    }

    pub fn active_transform(&mut self, active: [bool; 2]) {
        self.state.transforms.active = active;
    }

    pub fn coordinate_system(&mut self, (name, _): Named) {
        self.coordinate_systems.insert(name, self.state.transforms.matrices);
    }

    pub fn coord_sys_transform(&mut self, (name, span): Named) {
        match self.coordinate_systems.get(&name) {
            Some(matrices) => self.state.transforms.matrices = *matrices,
            None => {
                let known = self.coordinate_systems.keys().map(|k| &**k);
                let help = did_you_mean(&name, known);
                let message = format!("there is no coordinate system `{name}`; nothing changes");
                self.diagnostics.push(Diagnostic::warning(span, message).with_optional_help(help));
            }
        }
    }

    // Attributes

    pub fn set_color_space(&mut self, (name, span): Named) {
        match ColorSpace::named(&name) {
            Some(color_space) => self.state.color_space = color_space,
            None => {
                let help = did_you_mean(&name, ColorSpace::NAMES)
                    .unwrap_or_else(|| format!("known are {}", ColorSpace::NAMES.join(", ")));
                let message = format!("unknown colour space `{name}`");
                self.diagnostics.push(Diagnostic::error(span, message).with_help(help));
            }
        }
    }

    /// `directive`: `AttributeBegin` or its old form.
    pub fn attribute_begin(&mut self, directive: &str, span: Span) {
        self.require_world(directive, span);
        self.push_state(Opener::Attribute, span);
    }

    pub fn push_state(&mut self, opener: Opener, span: Span) {
        let limit = self.read_options.limits.attribute_depth;
        if self.stack.len() == limit {
            let message = format!("`AttributeBegin` is nested more than {limit} deep");
            self.diagnostics.error(span, message);
        }
        // Deeper states are counted but not kept: the scene is lost anyway.
        if self.stack.len() >= limit {
            self.stack.push((opener, span, GraphicsState::new()));
        } else {
            self.stack.push((opener, span, self.state.clone()));
        }
    }

    pub fn attribute_end(&mut self, span: Span) {
        let message = "`AttributeEnd` without `AttributeBegin`";
        if self.stack.len() <= self.base {
            self.diagnostics.error(span, message);
            return;
        }
        match self.stack.pop_if(|(opener, _, _)| *opener == Opener::Attribute) {
            Some((_, _, state)) => self.state = state,
            None => {
                let object = self.stack.last().map(|(_, opened, _)| *opened);
                self.diagnostics.push(Diagnostic::error(span, message).with_note(object, "in this object"));
            }
        }
    }

    pub fn attribute(&mut self, (target, span): Named, parameters: Vec<Parameter>) {
        let Some(target) = AttributeTarget::named(&target) else {
            let help = did_you_mean(&target, AttributeTarget::NAMES)
                .unwrap_or_else(|| format!("known are {}", AttributeTarget::NAMES.join(", ")));
            let message = format!("unknown target of attributes `{target}`");
            self.diagnostics.push(Diagnostic::error(span, message).with_help(help));
            return;
        };
        let limit = self.read_options.limits.attribute_parameters;
        let attributes = &mut self.state.attributes[target as usize];
        if attributes.len() + parameters.len() > limit {
            self.diagnostics.error(span, format!("more than {limit} parameters are set by `Attribute` at once"));
        } else if !parameters.is_empty() {
            Arc::make_mut(attributes).extend(parameters.into_iter().map(Arc::new));
        }
    }

    pub fn reverse_orientation(&mut self, span: Span) {
        self.require_world("ReverseOrientation", span);
        self.state.reverse_orientation = !self.state.reverse_orientation;
    }

    /// An empty name is no medium.
    fn medium_reference(&mut self, (name, span): Named) -> Option<Reference> {
        if name.is_empty() {
            return None;
        }
        Some(match self.medium_names.get(&name) {
            Some(index) => *index,
            None => pend(&mut self.pending_media, (name, span)),
        })
    }

    pub fn medium_interface(&mut self, inside: Named, outside: Named) {
        self.state.inside_medium = self.medium_reference(inside);
        self.state.outside_medium = self.medium_reference(outside);
    }
}
