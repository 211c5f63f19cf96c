//! Errors and warnings, for people: with source lines and colours on terminals, one per paragraph and plain elsewhere.

use luz::scene::diagnostic::Note;
use luz::scene::source::Location;
use luz::scene::{Diagnostic, Diagnostics, Locator, Severity, SourceMap};
use miette::{
    GraphicalReportHandler, GraphicalTheme, LabeledSpan, MietteError, MietteSpanContents, SourceCode, SourceSpan,
};
use std::fmt;
use std::io::{self, IsTerminal};

/// Prints one error that has no place in a scene.
pub fn error(message: &str) {
    eprintln!("{} {message}", tag(Severity::Error));
}

/// Prints one warning that has no place in a scene.
pub fn warning(message: &str) {
    eprintln!("{} {message}", tag(Severity::Warning));
}

fn tag(severity: Severity) -> String {
    let color = match severity {
        Severity::Error => 31,
        Severity::Warning => 33,
    };
    if is_fancy() { format!("\x1b[1;{color}m{severity}:\x1b[0m") } else { format!("{severity}:") }
}

/// Are there eyes for colours?
fn is_fancy() -> bool {
    io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty())
}

/// Prints all problems of a scene to standard error.
pub fn print_all(diagnostics: &Diagnostics, sources: &SourceMap) {
    if is_fancy() {
        eprint!("{}", render(diagnostics, sources, &GraphicalTheme::unicode()));
    } else {
        eprint!("{}", diagnostics.render(sources));
    }
}

/// "3 errors and 1 warning", or less.
pub fn count(diagnostics: &Diagnostics) -> String {
    let plural = |count: usize, what: &str| format!("{count} {what}{}", if count == 1 { "" } else { "s" });
    match (diagnostics.error_count(), diagnostics.warning_count()) {
        (errors, 0) => plural(errors, "error"),
        (0, warnings) => plural(warnings, "warning"),
        (errors, warnings) => format!("{} and {}", plural(errors, "error"), plural(warnings, "warning")),
    }
}

fn render(diagnostics: &Diagnostics, sources: &SourceMap, theme: &GraphicalTheme) -> String {
    let handler = GraphicalReportHandler::new_themed(theme.clone()).with_width(120).with_context_lines(0);
    let mut out = String::new();
    let mut locator = Locator::new(sources);
    for diagnostic in diagnostics {
        let report = Report::new(diagnostic, &mut locator);
        if handler.render_report(&mut out, &report).is_err() {
            out += &diagnostic.render(sources);
        }
    }
    if diagnostics.dropped() > 0 {
        out += &format!("… and {} more\n", diagnostics.dropped());
    }
    out
}

/// A diagnostic in miette's terms.
#[derive(Debug)]
struct Report {
    severity: Severity,
    message: String,
    excerpt: Option<Excerpt>,
    help: Option<String>,
}

impl Report {
    fn new(diagnostic: &Diagnostic, locator: &mut Locator<'_>) -> Self {
        let notes: Vec<String> = diagnostic.notes.iter().map(|note| note_text(note, locator)).collect();
        let includes = diagnostic.span.map(|span| locator.sources().include_chain(span.file)).unwrap_or_default();
        let includes: Vec<String> =
            includes.into_iter().map(|span| format!("included from {}", locator.place(span))).collect();
        let help: Vec<String> = diagnostic.help.iter().cloned().chain(notes).collect();
        let location = diagnostic.span.map(|span| locator.locate(span));
        // A file that is gone, or that has no line there, has nothing to show but its name.
        let (excerpt, place) = match location {
            Some(location) if location.excerpt.trim().is_empty() => (None, Some(location.file)),
            Some(location) => {
                let label = (!includes.is_empty()).then(|| includes.join(", "));
                (Some(Excerpt { location, label }), None)
            }
            None => (None, None),
        };
        let message = match place {
            Some(place) => format!("{place}: {}", diagnostic.message),
            None => diagnostic.message.clone(),
        };
        Self { severity: diagnostic.severity, message, excerpt, help: (!help.is_empty()).then(|| help.join("\n")) }
    }
}

fn note_text(note: &Note, locator: &mut Locator<'_>) -> String {
    match note.span {
        Some(span) => format!("{}: {}", locator.place(span), note.message),
        None => note.message.clone(),
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Report {}

impl miette::Diagnostic for Report {
    fn severity(&self) -> Option<miette::Severity> {
        Some(match self.severity {
            Severity::Error => miette::Severity::Error,
            Severity::Warning => miette::Severity::Warning,
        })
    }

    fn help(&self) -> Option<Box<dyn fmt::Display + '_>> {
        self.help.as_ref().map(|help| Box::new(help) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.excerpt.as_ref().map(|excerpt| excerpt as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let excerpt = self.excerpt.as_ref()?;
        let label = LabeledSpan::new_primary_with_span(excerpt.label.clone(), excerpt.marked());
        Some(Box::new(std::iter::once(label)))
    }
}

/// The line that a diagnostic is about, without the rest of a file that may have gigabytes.
#[derive(Debug)]
struct Excerpt {
    location: Location,
    /// What is said at the place.
    label: Option<String>,
}

impl Excerpt {
    /// The bytes of the excerpt that are to be underlined.
    fn marked(&self) -> SourceSpan {
        let text = &self.location.excerpt;
        let byte = |character: usize| text.char_indices().nth(character).map_or(text.len(), |(byte, _)| byte);
        let start = byte(self.location.excerpt_start);
        let end = byte(self.location.excerpt_start + self.location.excerpt_length);
        (start, end - start).into()
    }
}

impl SourceCode for Excerpt {
    fn read_span<'a>(
        &'a self,
        _: &SourceSpan,
        _: usize,
        _: usize,
    ) -> Result<Box<dyn miette::SpanContents<'a> + 'a>, MietteError> {
        let Location { file, line, column, excerpt, .. } = &self.location;
        let whole = (0, excerpt.len()).into();
        let (line, column) = (line.saturating_sub(1), column.saturating_sub(1));
        Ok(Box::new(MietteSpanContents::new_named(file.clone(), excerpt.as_bytes(), whole, line, column, 1)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_snippet_shows_place_line_and_help() {
        let text = "WorldBegin\nMaterial \"diffuse\" \"rgb reflectence\" [ 1 1 1 ]\n";
        let errors = match luz::scene::read_str("scene.pbrt", text) {
            Err(errors) => errors,
            Ok(_) => panic!("the misspelt parameter passed"),
        };
        let shown = render(&errors.diagnostics, &errors.sources, &GraphicalTheme::unicode_nocolor());
        assert!(shown.contains("scene.pbrt:2:"), "{shown}");
        assert!(shown.contains("reflectence"), "{shown}");
        assert!(shown.contains("did you mean `reflectance`?"), "{shown}");
    }

    #[test]
    fn counts_read_like_a_sentence() {
        let mut diagnostics = Diagnostics::default();
        diagnostics.error(None, "a");
        assert_eq!(count(&diagnostics), "1 error");
        diagnostics.error(None, "b");
        diagnostics.warning(None, "c");
        assert_eq!(count(&diagnostics), "2 errors and 1 warning");
    }
}
