//! Source files and places in them: what a diagnostic points at.

use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A file of a scene: its position in [`SourceMap::files`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FileId(pub u32);

/// A range of bytes in one file, `start..end`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Span {
    /// The file.
    pub file: FileId,
    /// Byte offset of the first byte.
    pub start: u64,
    /// Byte offset behind the last byte; `end ≥ start`.
    pub end: u64,
}

impl Span {
    /// The range `start..end` of `file`.
    #[must_use]
    pub fn new(file: FileId, start: usize, end: usize) -> Self {
        Self { file, start: start as u64, end: end.max(start) as u64 }
    }

    /// From the start of `self` to the end of `other`; `self` where they lie in different files.
    #[must_use]
    pub fn to(self, other: Span) -> Self {
        if self.file == other.file { Self { end: other.end.max(self.end), ..self } } else { self }
    }
}

/// Files up to this size stay in memory with the description; bigger ones are read again when a diagnostic needs
/// a line of them.
pub const KEPT_TEXT_BYTES: usize = 4 << 20;

/// One file (or string) that a scene was read from.
#[derive(Clone, Debug)]
pub struct SourceFile {
    /// The name for people: the path as given, or the name handed to [`crate::read_str`].
    pub name: String,
    /// Where it can be read again; `None` for strings.
    pub path: Option<PathBuf>,
    /// The `Include` or `Import` that asked for it; `None` for the top-level scene.
    pub included_from: Option<Span>,
    /// The bytes, unless the file is bigger than [`KEPT_TEXT_BYTES`] and has a path.
    pub text: Option<Arc<Vec<u8>>>,
}

/// Every file that a scene was read from, in the order of reading.
#[derive(Clone, Debug, Default)]
pub struct SourceMap {
    files: Vec<SourceFile>,
}

/// A span in a person's terms.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Location {
    /// The file's name.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// The source line, cut to a window of at most [`Location::MAX_EXCERPT`] characters around the span; control
    /// characters and bytes that are not UTF-8 are replaced.
    pub excerpt: String,
    /// Where the span starts in `excerpt`, in characters from 0.
    pub excerpt_start: usize,
    /// How many characters of `excerpt` the span covers, at least 1.
    pub excerpt_length: usize,
}

impl Location {
    /// The longest excerpt, in characters.
    pub const MAX_EXCERPT: usize = 120;
}

impl SourceMap {
    /// The files, in the order of reading.
    #[must_use]
    pub fn files(&self) -> &[SourceFile] {
        &self.files
    }

    /// The file with this id, if it is one of this map's.
    #[must_use]
    pub fn file(&self, id: FileId) -> Option<&SourceFile> {
        self.files.get(id.0 as usize)
    }

    /// Adds a file and names it.
    pub fn add(&mut self, file: SourceFile) -> FileId {
        let id = FileId(u32::try_from(self.files.len()).unwrap_or(u32::MAX));
        self.files.push(file);
        id
    }

    /// The bytes of a file: those kept, or read again from disk (and decompressed), if they still can be.
    #[must_use]
    pub fn text(&self, id: FileId) -> Option<Arc<Vec<u8>>> {
        let file = self.file(id)?;
        match (&file.text, &file.path) {
            (Some(text), _) => Some(text.clone()),
            (None, Some(path)) => crate::file::read_bytes(path, u64::MAX).ok().map(Arc::new),
            (None, None) => None,
        }
    }

    /// Line, column and source line of the start of a span. Where the text cannot be had any more, line and column
    /// are 0 and the excerpt is empty.
    #[must_use]
    pub fn locate(&self, span: Span) -> Location {
        let file = self.file(span.file).map_or_else(|| "<unknown>".to_owned(), |f| f.name.clone());
        match self.text(span.file) {
            Some(text) => locate_in(&text, file, span),
            None => Location { file, line: 0, column: 0, excerpt: String::new(), excerpt_start: 0, excerpt_length: 1 },
        }
    }

    /// `file:line:column`.
    #[must_use]
    pub fn place(&self, span: Span) -> String {
        let location = self.locate(span);
        format!("{}:{}:{}", location.file, location.line, location.column)
    }

    /// The chain of `Include`s that led to a file, innermost first.
    #[must_use]
    pub fn include_chain(&self, id: FileId) -> Vec<Span> {
        let mut chain = Vec::new();
        let mut next = self.file(id).and_then(|f| f.included_from);
        while let Some(span) = next {
            chain.push(span);
            next = self.file(span.file).and_then(|f| f.included_from);
        }
        chain
    }

    /// Adds a file that is kept only if it's small or cannot be read again.
    pub(crate) fn add_text(
        &mut self,
        name: String,
        path: Option<&Path>,
        included_from: Option<Span>,
        text: &Arc<Vec<u8>>,
    ) -> FileId {
        let keep = path.is_none() || text.len() <= KEPT_TEXT_BYTES;
        let text = keep.then(|| text.clone());
        self.add(SourceFile { name, path: path.map(Path::to_owned), included_from, text })
    }
}

/// The line around a span.
fn locate_in(text: &[u8], file: String, span: Span) -> Location {
    let start = usize::try_from(span.start).unwrap_or(usize::MAX).min(text.len());
    let end = usize::try_from(span.end).unwrap_or(usize::MAX).clamp(start, text.len());
    let line_start = text[..start].iter().rposition(|&b| b == b'\n').map_or(0, |i| i + 1);
    let line_end = text[start..].iter().position(|&b| b == b'\n').map_or(text.len(), |i| start + i);
    let line = text[..start].iter().filter(|&&b| b == b'\n').count() + 1;
    let before = String::from_utf8_lossy(&text[line_start..start]);
    // The line can be a whole array of gigabytes: only a window of it is decoded.
    let window_end = line_end.min(start + 4 * Location::MAX_EXCERPT);
    let after = String::from_utf8_lossy(&text[start..window_end]);
    let covered = String::from_utf8_lossy(&text[start..end.min(window_end)]);
    let column = before.chars().count() + 1;

    let (before, indent) = tail(&before, Location::MAX_EXCERPT / 2);
    let mut excerpt: String = before;
    let excerpt_start = indent;
    excerpt.extend(after.trim_end().chars().take(Location::MAX_EXCERPT - excerpt_start).map(printable));
    let room = excerpt.chars().count().saturating_sub(excerpt_start).max(1);
    let excerpt_length = covered.trim_end().chars().count().clamp(1, room);
    Location { file, line, column, excerpt, excerpt_start, excerpt_length }
}

/// The last `count` characters, made printable, and how many there are.
fn tail(text: &str, count: usize) -> (String, usize) {
    let length = text.chars().count();
    let kept: String = text.chars().skip(length.saturating_sub(count)).map(printable).collect();
    (kept, length.min(count))
}

/// Tabs and control characters would tear the caret off its place.
fn printable(c: char) -> char {
    if c == '\t' {
        ' '
    } else if c.is_control() {
        '\u{fffd}'
    } else {
        c
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(text: &str) -> SourceMap {
        let mut map = SourceMap::default();
        map.add_text("scene.pbrt".into(), None, None, &Arc::new(text.as_bytes().to_vec()));
        map
    }

    #[test]
    fn lines_and_columns_count_from_one() {
        let map = map("a\nbc def\n");
        let location = map.locate(Span::new(FileId(0), 5, 8));
        assert_eq!((location.line, location.column), (2, 4));
        assert_eq!(location.excerpt, "bc def");
        assert_eq!((location.excerpt_start, location.excerpt_length), (3, 3));
    }

    #[test]
    fn columns_count_characters_not_bytes() {
        let map = map("\"äöü\" x");
        assert_eq!(map.locate(Span::new(FileId(0), 9, 10)).column, 7);
    }

    #[test]
    fn long_lines_are_cut_around_the_span() {
        let text = "1 ".repeat(100_000) + "oops" + &" 1".repeat(100_000);
        let map = map(&text);
        let location = map.locate(Span::new(FileId(0), 200_000, 200_004));
        assert_eq!(location.column, 200_001);
        assert!(location.excerpt.chars().count() <= Location::MAX_EXCERPT);
        let found: String =
            location.excerpt.chars().skip(location.excerpt_start).take(location.excerpt_length).collect();
        assert_eq!(found, "oops");
    }

    #[test]
    fn spans_outside_the_text_are_harmless() {
        let map = map("ab");
        assert_eq!(map.locate(Span::new(FileId(0), 50, 60)).line, 1);
        assert_eq!(map.locate(Span::new(FileId(7), 0, 1)).line, 0);
    }
}
