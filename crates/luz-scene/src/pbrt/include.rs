//! Files that a scene names and that are read at once: included scenes and spectra.

use super::parser::{Parser, shorten};
use crate::description::resolve;
use crate::diagnostic::{Diagnostic, did_you_mean};
use crate::file;
use crate::source::Span;
use crate::spectrum::SpectrumParameter;
use std::sync::Arc;

impl Parser<'_> {
    /// `Include` and `Import`. Names start from the top-level scene's directory, as in pbrt.
    pub fn include(&mut self, name: &str, name_span: Span, span: Span, import: bool) {
        let limits = self.options.limits;
        let directive = if import { "Import" } else { "Include" };
        if import && !self.builder.require_world(directive, span) {
            return;
        }
        let path = resolve(&self.builder.directory, name);
        let canonical = path.canonicalize().ok();
        if self.frames.iter().any(|frame| frame.path.is_some() && frame.path == canonical) {
            // The chain of includes that is shown with every diagnostic says how.
            self.error(Diagnostic::error(name_span, format!("`{}` includes itself", shorten(name))));
            return;
        }
        if self.frames.len() >= limits.include_depth {
            let message = format!("files include each other more than {} levels deep", limits.include_depth);
            self.error(Diagnostic::error(name_span, message));
            return;
        }
        if self.files_read >= limits.files || self.bytes_read >= limits.total_bytes {
            let message = format!(
                "the scene is too large: more than {} files or {} bytes with all that it includes",
                limits.files, limits.total_bytes
            );
            self.error(Diagnostic::error(name_span, message));
            // Whatever else there is would be the same once more.
            self.frames.truncate(1);
            let end = self.lexer().text.len();
            self.lexer_mut().position = end;
            return;
        }
        match file::read_bytes(&path, limits.file_bytes) {
            Ok(text) => {
                let imported = import.then(|| self.builder.begin_import());
                let shown = path.display().to_string();
                self.enter(shown, Some((&path, canonical)), Some(span), Arc::new(text), imported);
            }
            Err(error) => {
                let message = format!("cannot read `{}`: {}", path.display(), file::explain(&error));
                self.error(Diagnostic::error(name_span, message));
            }
        }
    }

    /// A spectrum given by a string: a name that pbrt-v4 knows, or a file.
    pub fn named_or_file_spectrum(&mut self, name: Arc<str>, span: Span) -> Option<SpectrumParameter> {
        if crate::schema::NAMED_SPECTRA.contains(&&*name) {
            return Some(SpectrumParameter::Named(self.intern(&name)));
        }
        let path = resolve(&self.builder.directory, &name);
        if let Some(known) = self.spectra.get(&path) {
            return known.clone();
        }
        let spectrum = match crate::spd::read(&path) {
            Ok(samples) => Some(SpectrumParameter::File { path: path.clone(), samples }),
            Err(fault) => {
                let exists = path.exists();
                let message = if exists {
                    format!("spectrum file `{}`: {fault}", path.display())
                } else {
                    format!("`{}` is neither a named spectrum nor a file", shorten(&name))
                };
                let help = did_you_mean(&name, crate::schema::NAMED_SPECTRA.iter().copied());
                let help = help.or_else(|| (!exists).then(|| format!("looked for `{}`", path.display())));
                self.error(Diagnostic::error(span, message).with_optional_help(help));
                None
            }
        };
        self.spectra.insert(path, spectrum.clone());
        spectrum
    }
}
