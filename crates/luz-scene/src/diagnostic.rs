//! Errors and warnings about a scene, each with its place.

use crate::source::{Locator, SourceMap, Span};
use std::fmt;

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Severity {
    /// The scene can be rendered; somebody should look at this.
    Warning,
    /// The scene cannot be rendered.
    Error,
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Severity::Warning => "warning",
            Severity::Error => "error",
        })
    }
}

/// Another place that explains a diagnostic ("first defined here").
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// What that place has to do with it.
    pub message: String,
    /// The place, if it has one.
    pub span: Option<Span>,
}

/// One problem of a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// How bad it is.
    pub severity: Severity,
    /// What is wrong, in one line without a full stop.
    pub message: String,
    /// Where; `None` only if no text can be blamed (a scene file that does not exist).
    pub span: Option<Span>,
    /// What would be right ("did you mean `reflectance`?").
    pub help: Option<String>,
    /// Other places that matter.
    pub notes: Vec<Note>,
}

impl Diagnostic {
    /// An error at a place.
    pub fn error(span: impl Into<Option<Span>>, message: impl Into<String>) -> Self {
        Self::new(Severity::Error, span.into(), message.into())
    }

    /// A warning at a place.
    pub fn warning(span: impl Into<Option<Span>>, message: impl Into<String>) -> Self {
        Self::new(Severity::Warning, span.into(), message.into())
    }

    fn new(severity: Severity, span: Option<Span>, message: String) -> Self {
        Self { severity, message, span, help: None, notes: Vec::new() }
    }

    /// Says what would be right.
    #[must_use]
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// As [`Diagnostic::with_help`], where there is something to say.
    #[must_use]
    pub fn with_optional_help(mut self, help: Option<String>) -> Self {
        self.help = help.or(self.help);
        self
    }

    /// Points at another place.
    #[must_use]
    pub fn with_note(mut self, span: impl Into<Option<Span>>, message: impl Into<String>) -> Self {
        self.notes.push(Note { message: message.into(), span: span.into() });
        self
    }

    /// The diagnostic as plain text without colours: `file:line:column: error: message`, the source line with the
    /// place underlined, notes, the chain of `Include`s and the help. Ends in a line feed.
    #[must_use]
    pub fn render(&self, sources: &SourceMap) -> String {
        self.render_with(&mut Locator::new(sources))
    }

    fn render_with(&self, sources: &mut Locator<'_>) -> String {
        let mut out = String::new();
        match self.span {
            Some(span) => {
                let location = sources.locate(span);
                out += &format!(
                    "{}:{}:{}: {}: {}\n",
                    location.file, location.line, location.column, self.severity, self.message
                );
                if !location.excerpt.trim().is_empty() {
                    out += &format!("    {}\n", location.excerpt.trim_end());
                    let indent = " ".repeat(location.excerpt_start);
                    out += &format!("    {indent}{}\n", "^".repeat(location.excerpt_length));
                }
            }
            None => out += &format!("{}: {}\n", self.severity, self.message),
        }
        for note in &self.notes {
            match note.span {
                Some(span) => out += &format!("  note: {}: {}\n", sources.place(span), note.message),
                None => out += &format!("  note: {}\n", note.message),
            }
        }
        if let Some(span) = self.span {
            for include in sources.sources().include_chain(span.file) {
                out += &format!("  included from {}\n", sources.place(include));
            }
        }
        if let Some(help) = &self.help {
            out += &format!("  help: {help}\n");
        }
        out
    }
}

/// Problems in the order of finding them. It keeps at most [`Diagnostics::MAX_KEPT`] errors and as many warnings, so
/// that a file of garbage costs bounded memory; it counts the rest.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Diagnostics {
    list: Vec<Diagnostic>,
    errors: usize,
    warnings: usize,
}

impl Diagnostics {
    /// How many errors, and how many warnings, are kept.
    pub const MAX_KEPT: usize = 1000;

    /// Adds a problem.
    pub fn push(&mut self, diagnostic: Diagnostic) {
        let count = match diagnostic.severity {
            Severity::Error => &mut self.errors,
            Severity::Warning => &mut self.warnings,
        };
        *count += 1;
        if *count <= Self::MAX_KEPT {
            self.list.push(diagnostic);
        }
    }

    /// Adds an error.
    pub fn error(&mut self, span: impl Into<Option<Span>>, message: impl Into<String>) {
        self.push(Diagnostic::error(span, message));
    }

    /// Adds a warning.
    pub fn warning(&mut self, span: impl Into<Option<Span>>, message: impl Into<String>) {
        self.push(Diagnostic::warning(span, message));
    }

    /// Adds all of another collection.
    pub fn append(&mut self, other: Diagnostics) {
        let kept = |severity| other.list.iter().filter(|d| d.severity == severity).count();
        let (lost_errors, lost_warnings) =
            (other.errors - kept(Severity::Error), other.warnings - kept(Severity::Warning));
        for diagnostic in other.list {
            self.push(diagnostic);
        }
        self.errors += lost_errors;
        self.warnings += lost_warnings;
    }

    /// The kept problems.
    pub fn iter(&self) -> std::slice::Iter<'_, Diagnostic> {
        self.list.iter()
    }

    /// How many errors were found, kept or not.
    #[must_use]
    pub fn error_count(&self) -> usize {
        self.errors
    }

    /// How many warnings were found, kept or not.
    #[must_use]
    pub fn warning_count(&self) -> usize {
        self.warnings
    }

    /// Is there an error?
    #[must_use]
    pub fn has_errors(&self) -> bool {
        self.errors > 0
    }

    /// Is there nothing at all?
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.errors == 0 && self.warnings == 0
    }

    /// How many problems were found but not kept.
    #[must_use]
    pub fn dropped(&self) -> usize {
        self.errors + self.warnings - self.list.len()
    }

    /// All of them as plain text, see [`Diagnostic::render`].
    #[must_use]
    pub fn render(&self, sources: &SourceMap) -> String {
        let mut locator = Locator::new(sources);
        let mut out: String = self.list.iter().map(|d| d.render_with(&mut locator)).collect();
        if self.dropped() > 0 {
            out += &format!("… and {} more\n", self.dropped());
        }
        out
    }
}

impl<'a> IntoIterator for &'a Diagnostics {
    type Item = &'a Diagnostic;
    type IntoIter = std::slice::Iter<'a, Diagnostic>;
    fn into_iter(self) -> Self::IntoIter {
        self.list.iter()
    }
}

/// A scene that could not be read: every problem that was found, and the texts they point into.
#[derive(Clone, Debug)]
pub struct SceneErrors {
    /// At least one error, and whatever warnings came along.
    pub diagnostics: Diagnostics,
    /// The files that the spans point into.
    pub sources: SourceMap,
}

impl fmt::Display for SceneErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.diagnostics.render(&self.sources).trim_end())
    }
}

impl std::error::Error for SceneErrors {}

/// The candidate that a person most likely meant, if one is close enough to `name` (optimal string alignment
/// distance of at most a third of the length, ignoring case).
#[must_use]
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // Names longer than any real one cost quadratic time and match nothing.
    if name.len() > 100 {
        return None;
    }
    let lower = name.to_lowercase();
    let limit = (name.chars().count() / 3).max(1);
    candidates
        .into_iter()
        .filter(|candidate| candidate.len() <= 100)
        .map(|candidate| (strsim::osa_distance(&lower, &candidate.to_lowercase()), candidate))
        .filter(|(distance, _)| *distance <= limit)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// "did you mean `…`?", where [`nearest`] has an answer.
#[must_use]
pub fn did_you_mean<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<String> {
    nearest(name, candidates).map(|candidate| format!("did you mean `{candidate}`?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suggestions_need_to_be_near() {
        let names = ["reflectance", "roughness", "eta"];
        assert_eq!(nearest("reflectence", names), Some("reflectance"));
        assert_eq!(nearest("Roughness", names), Some("roughness"));
        assert_eq!(nearest("temperature", names), None);
        assert_eq!(nearest(&"x".repeat(1 << 20), names), None);
    }

    #[test]
    fn floods_are_counted_but_not_kept() {
        let mut diagnostics = Diagnostics::default();
        for _ in 0..3 * Diagnostics::MAX_KEPT {
            diagnostics.error(None, "no");
        }
        diagnostics.warning(None, "hm");
        assert_eq!(diagnostics.iter().count(), Diagnostics::MAX_KEPT + 1);
        assert_eq!(diagnostics.dropped(), 2 * Diagnostics::MAX_KEPT);
        let mut other = Diagnostics::default();
        other.append(diagnostics);
        assert_eq!(other.error_count(), 3 * Diagnostics::MAX_KEPT);
    }
}
