//! Source files and places in them: what a diagnostic points at.

use std::collections::HashMap;
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

    /// Line, column and source line of the start of a span; see [`Locator::locate`]. For many spans, use one
    /// [`Locator`].
    #[must_use]
    pub fn locate(&self, span: Span) -> Location {
        Locator::new(self).locate(span)
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

/// Finds many places: texts are read and searched for lines only once.
pub struct Locator<'a> {
    sources: &'a SourceMap,
    texts: HashMap<FileId, Option<IndexedText>>,
}

/// A text, and where the multiples of [`IndexedText::STEP`] lie in it.
struct IndexedText {
    text: Arc<Vec<u8>>,
    marks: Vec<Mark>,
}

/// A place in a text.
#[derive(Clone, Copy, Default)]
struct Mark {
    /// Line feeds before it.
    line_feeds: usize,
    /// Characters of its line before it.
    characters: usize,
}

impl Mark {
    /// The place behind `bytes`, which follow this one.
    fn advance(self, bytes: &[u8]) -> Self {
        let line_feeds = bytes.iter().filter(|b| **b == b'\n').count();
        // All bytes but UTF-8's continuations.
        let characters = |bytes: &[u8]| bytes.iter().filter(|b| **b & 0xc0 != 0x80).count();
        match bytes.iter().rposition(|b| *b == b'\n') {
            Some(last) => Self { line_feeds: self.line_feeds + line_feeds, characters: characters(&bytes[last + 1..]) },
            None => Self { characters: self.characters + characters(bytes), ..self },
        }
    }
}

impl<'a> Locator<'a> {
    /// For the files of a map.
    #[must_use]
    pub fn new(sources: &'a SourceMap) -> Self {
        Self { sources, texts: HashMap::new() }
    }

    /// The files.
    #[must_use]
    pub fn sources(&self) -> &'a SourceMap {
        self.sources
    }

    /// Line, column and source line of the start of a span. Where the text cannot be had any more, line and column
    /// are 0 and the excerpt is empty.
    pub fn locate(&mut self, span: Span) -> Location {
        let file = self.sources.file(span.file).map_or_else(|| "<unknown>".to_owned(), |f| f.name.clone());
        let text = self.texts.entry(span.file).or_insert_with(|| self.sources.text(span.file).map(IndexedText::new));
        match text {
            Some(text) => text.locate(file, span),
            None => Location { file, line: 0, column: 0, excerpt: String::new(), excerpt_start: 0, excerpt_length: 1 },
        }
    }

    /// `file:line:column`.
    pub fn place(&mut self, span: Span) -> String {
        let location = self.locate(span);
        format!("{}:{}:{}", location.file, location.line, location.column)
    }
}

impl IndexedText {
    const STEP: usize = 1 << 13;

    fn new(text: Arc<Vec<u8>>) -> Self {
        let step = |mark: &mut Mark, chunk: &[u8]| Some(std::mem::replace(mark, mark.advance(chunk)));
        let marks = text.chunks(Self::STEP).scan(Mark::default(), step).collect();
        Self { text, marks }
    }

    fn mark(&self, at: usize) -> Mark {
        let block = (at / Self::STEP).min(self.marks.len().saturating_sub(1));
        let before = self.marks.get(block).copied().unwrap_or_default();
        before.advance(&self.text[block * Self::STEP..at])
    }

    fn locate(&self, file: String, span: Span) -> Location {
        let text = &self.text[..];
        let start = usize::try_from(span.start).unwrap_or(usize::MAX).min(text.len());
        let end = usize::try_from(span.end).unwrap_or(usize::MAX).clamp(start, text.len());
        // The line can be a whole array of gigabytes: only a window of it is looked at.
        let window_start = start.saturating_sub(4 * Location::MAX_EXCERPT);
        let window_end = text.len().min(start + 4 * Location::MAX_EXCERPT);
        let line_feed = |b: &u8| *b == b'\n';
        let before_start =
            text[window_start..start].iter().rposition(line_feed).map_or(window_start, |i| window_start + i + 1);
        let line_end = text[start..window_end].iter().position(line_feed).map_or(window_end, |i| start + i);
        let mark = self.mark(start);

        let (mut excerpt, excerpt_start) =
            tail(&String::from_utf8_lossy(&text[before_start..start]), Location::MAX_EXCERPT / 2);
        let after = String::from_utf8_lossy(&text[start..line_end]);
        let covered = String::from_utf8_lossy(&text[start..end.min(line_end)]);
        excerpt.extend(after.trim_end().chars().take(Location::MAX_EXCERPT - excerpt_start).map(printable));
        let room = excerpt.chars().count().saturating_sub(excerpt_start).max(1);
        let excerpt_length = covered.trim_end().chars().count().clamp(1, room);
        let (line, column) = (mark.line_feeds + 1, mark.characters + 1);
        Location { file, line, column, excerpt, excerpt_start, excerpt_length }
    }
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
    fn places_far_into_a_text() {
        let text = "ä b\nlonger line\n".repeat(10_000);
        let map = map(&text);
        for (at, _) in text.match_indices('b').step_by(997) {
            let location = map.locate(Span::new(FileId(0), at, at + 1));
            assert_eq!((location.line, location.column), (text[..at].matches('\n').count() + 1, 3));
        }
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
