//! Directives: reads them one by one, across `Include`s and `Import`s, and hands them to the builder. After a mistake
//! it goes on at the next directive.

use super::ReadOptions;
use super::builder::Builder;
use super::directives::is_directive;
use super::lexer::{Lexer, StringFault, Token, TokenKind};
use super::number::parse_f32;
use super::objects::ImportedState;
use crate::description::Description;
use crate::diagnostic::{Diagnostic, Diagnostics, SceneErrors};
use crate::file;
use crate::parameter::ParameterType;
use crate::source::Span;
use crate::spectrum::SpectrumParameter;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Text for a message: cut, and without control characters.
pub(super) fn shorten(text: &str) -> String {
    const LONGEST: usize = 60;
    let mut short: String = text.chars().take(LONGEST).map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    if text.chars().nth(LONGEST).is_some() {
        short.push('…');
    }
    short
}

/// A file that is being read.
pub(super) struct Frame {
    pub lexer: Lexer,
    /// For the detection of cycles.
    pub path: Option<PathBuf>,
    /// What an `Import` must not change.
    pub import: Option<ImportedState>,
}

/// Reads directives.
pub(super) struct Parser<'a> {
    pub builder: Builder<'a>,
    pub options: &'a ReadOptions,
    pub frames: Vec<Frame>,
    names: HashSet<Arc<str>>,
    declarations: HashMap<Box<[u8]>, (ParameterType, Arc<str>)>,
    pub spectra: HashMap<PathBuf, Option<SpectrumParameter>>,
    pub files_read: usize,
    pub bytes_read: u64,
    pub warned_transform_begin: bool,
}

type ReadResult = Result<(Description, Diagnostics), SceneErrors>;

/// Reads a scene from a file.
pub(super) fn read_file(path: &Path, options: &ReadOptions) -> ReadResult {
    let directory = path.parent().unwrap_or(Path::new(""));
    let mut parser = Parser::new(directory, options);
    let name = path.display().to_string();
    match file::read_bytes(path, options.limits.file_bytes) {
        Ok(text) => {
            let canonical = path.canonicalize().ok();
            parser.enter(name, Some((path, canonical)), None, Arc::new(text), None);
            parser.run();
        }
        Err(error) => parser.builder.diagnostics.error(None, format!("{name}: {}", file::explain(&error))),
    }
    parser.builder.finish()
}

/// Reads a scene from bytes.
pub(super) fn read_text(name: &str, text: Vec<u8>, directory: &Path, options: &ReadOptions) -> ReadResult {
    let mut parser = Parser::new(directory, options);
    parser.enter(name.to_owned(), None, None, Arc::new(text), None);
    parser.run();
    parser.builder.finish()
}

impl<'a> Parser<'a> {
    fn new(directory: &Path, options: &'a ReadOptions) -> Self {
        Self {
            builder: Builder::new(directory, options),
            options,
            frames: Vec::new(),
            names: HashSet::new(),
            declarations: HashMap::new(),
            spectra: HashMap::new(),
            files_read: 0,
            bytes_read: 0,
            warned_transform_begin: false,
        }
    }

    /// Starts reading a file.
    pub fn enter(
        &mut self,
        name: String,
        path: Option<(&Path, Option<PathBuf>)>,
        included_from: Option<Span>,
        text: Arc<Vec<u8>>,
        import: Option<ImportedState>,
    ) {
        let file = self.builder.sources.add_text(name, path.as_ref().map(|(path, _)| *path), included_from, &text);
        self.files_read += 1;
        self.bytes_read += text.len() as u64;
        if text.starts_with(b"\xff\xfe") || text.starts_with(b"\xfe\xff") {
            let span = Span::new(file, 0, 0);
            self.error(Diagnostic::error(span, "the file is encoded in UTF-16; scene files must be UTF-8"));
            return;
        }
        let canonical = path.and_then(|(_, canonical)| canonical);
        self.frames.push(Frame { lexer: Lexer::new(text, file), path: canonical, import });
    }

    /// Reads everything.
    fn run(&mut self) {
        while !self.frames.is_empty() {
            while let Some(token) = self.next() {
                if !self.directive(token) {
                    self.recover();
                }
            }
            // Only a file that ends itself is left: the scene or an import.
            let end = self.end_span();
            let Some(frame) = self.frames.pop() else { break };
            match frame.import {
                Some(imported) => self.builder.end_import(imported, end),
                None => self.builder.end = Some(end),
            }
        }
    }

    /// The file being read.
    pub fn lexer(&self) -> &Lexer {
        // `run` stops when the last frame goes, and `peek` and `next` never take it.
        &self.frames[self.frames.len() - 1].lexer
    }

    /// The file being read.
    pub fn lexer_mut(&mut self) -> &mut Lexer {
        let last = self.frames.len() - 1;
        &mut self.frames[last].lexer
    }

    /// The next token; an included file's end is no end.
    pub fn peek(&mut self) -> Option<Token> {
        loop {
            if let Some(token) = self.lexer_mut().peek() {
                return Some(token);
            }
            let ends_itself = self.frames.len() == 1 || self.frames.last().is_some_and(|f| f.import.is_some());
            if ends_itself {
                return None;
            }
            self.frames.pop();
        }
    }

    /// As [`Self::peek`], and moves behind it.
    pub fn next(&mut self) -> Option<Token> {
        self.peek()?;
        self.lexer_mut().next()
    }

    /// The end of the current file.
    pub fn end_span(&self) -> Span {
        let lexer = self.lexer();
        // The last character that isn't blank, so that the excerpt shows something.
        let end = lexer.text.iter().rposition(|b| !b.is_ascii_whitespace()).unwrap_or(0);
        Span::new(lexer.file, end, end + 1)
    }

    pub fn error(&mut self, diagnostic: Diagnostic) {
        self.builder.diagnostics.push(diagnostic);
    }

    pub fn report_open_string(&mut self, token: Token) {
        let span = self.lexer().span(token);
        self.error(Diagnostic::error(span, "this string has no closing quote on its line"));
    }

    /// One shared copy of a name.
    pub fn intern(&mut self, name: &str) -> Arc<str> {
        if let Some(known) = self.names.get(name) {
            return known.clone();
        }
        let name: Arc<str> = name.into();
        self.names.insert(name.clone());
        name
    }

    /// A declaration that has been seen before.
    pub fn known_declaration(&self, token: Token) -> Option<(ParameterType, Arc<str>)> {
        self.declarations.get(self.lexer().bytes(token)).cloned()
    }

    pub fn remember_declaration(&mut self, token: Token, kind: ParameterType, name: Arc<str>) {
        let bytes = self.lexer().bytes(token).into();
        self.declarations.insert(bytes, (kind, name));
    }

    /// The contents of a string token and their place; reports what is wrong with it.
    pub fn string_of(&mut self, token: Token) -> Option<(Arc<str>, Span)> {
        let lexer = self.lexer();
        let span = lexer.span(token);
        let fault = match lexer.string(token) {
            Ok(text) => {
                let inner = Span { start: span.start + 1, end: span.end - 1, ..span };
                return Some((text.into(), inner));
            }
            Err(fault) => fault,
        };
        let message = match fault {
            StringFault::NotUtf8 => "this string is not UTF-8",
            StringFault::UnknownEscape => r#"this string has an unknown escape; known are \b \f \n \r \t \\ \' \""#,
            StringFault::TooLong => "this string is too long",
            StringFault::Nul => "this string contains a NUL character",
        };
        self.error(Diagnostic::error(span, message));
        None
    }

    /// A string that must come next.
    pub fn expect_string(&mut self, what: &str) -> Option<(Arc<str>, Span)> {
        match self.peek() {
            Some(token) if token.kind == TokenKind::String => {
                self.next();
                let (text, span) = self.string_of(token)?;
                Some((self.intern(&text), span))
            }
            Some(token) if token.kind == TokenKind::OpenString => {
                self.next();
                self.report_open_string(token);
                None
            }
            other => {
                self.unexpected(other, what);
                None
            }
        }
    }

    /// Numbers that must come next; `brackets`: they may stand in brackets.
    pub fn expect_numbers<const N: usize>(&mut self, what: &str, brackets: bool) -> Option<[f32; N]> {
        let bracket = |parser: &mut Self, kind| match parser.peek() {
            Some(token) if token.kind == kind => {
                parser.next();
                true
            }
            _ => false,
        };
        let open = brackets && bracket(self, TokenKind::OpenBracket);
        let mut values = [0.0; N];
        for value in &mut values {
            let token = self.peek();
            let word = token.filter(|token| token.kind == TokenKind::Word);
            match word.and_then(|token| parse_f32(&self.lexer().text, token.start).ok()) {
                Some((number, _)) => *value = number,
                None => {
                    self.unexpected(token, what);
                    return None;
                }
            }
            self.next();
        }
        if open && !bracket(self, TokenKind::CloseBracket) {
            let token = self.peek();
            self.unexpected(token, "`]`");
            return None;
        }
        Some(values)
    }

    pub fn unexpected(&mut self, found: Option<Token>, expected: &str) {
        let diagnostic = match found {
            Some(token) => {
                let text = shorten(&String::from_utf8_lossy(self.lexer().bytes(token)));
                Diagnostic::error(self.lexer().span(token), format!("expected {expected}, found `{text}`"))
            }
            None => Diagnostic::error(self.end_span(), format!("the file ends where {expected} should be")),
        };
        self.error(diagnostic);
    }

    /// Skips to the next directive.
    fn recover(&mut self) {
        while let Some(token) = self.peek() {
            if token.kind == TokenKind::Word && is_directive(self.lexer().bytes(token)) {
                return;
            }
            self.next();
        }
    }
}
