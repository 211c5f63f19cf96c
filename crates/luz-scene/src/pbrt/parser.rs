//! Directives: reads them one by one, across `Include`s and `Import`s, and hands them to the builder. After a mistake
//! it goes on at the next directive.

use super::builder::Builder;
use super::lexer::{Lexer, StringFault, Token, TokenKind};
use super::number::parse_f32;
use super::objects::ImportedState;
use super::{ReadOptions, legacy};
use crate::description::{Description, resolve};
use crate::diagnostic::{Diagnostic, Diagnostics, SceneErrors, did_you_mean};
use crate::file;
use crate::parameters::ParameterType;
use crate::source::Span;
use crate::spectrum::SpectrumParameter;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Every directive of pbrt-v4.
const DIRECTIVES: [&str; 39] = [
    "Accelerator",
    "ActiveTransform",
    "AreaLightSource",
    "Attribute",
    "AttributeBegin",
    "AttributeEnd",
    "Camera",
    "ColorSpace",
    "ConcatTransform",
    "CoordSysTransform",
    "CoordinateSystem",
    "Film",
    "Identity",
    "Import",
    "Include",
    "Integrator",
    "LightSource",
    "LookAt",
    "MakeNamedMaterial",
    "MakeNamedMedium",
    "Material",
    "MediumInterface",
    "NamedMaterial",
    "ObjectBegin",
    "ObjectEnd",
    "ObjectInstance",
    "Option",
    "PixelFilter",
    "ReverseOrientation",
    "Rotate",
    "Sampler",
    "Scale",
    "Shape",
    "Texture",
    "Transform",
    "TransformBegin",
    "TransformEnd",
    "TransformTimes",
    "Translate",
];

/// Is this word a directive (of pbrt-v4 or of its predecessors)?
pub(super) fn is_directive(word: &[u8]) -> bool {
    word == b"WorldBegin"
        || word.first().is_some_and(u8::is_ascii_uppercase)
            && (DIRECTIVES.binary_search_by(|d| d.as_bytes().cmp(word)).is_ok() || legacy::directive(word).is_some())
}

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
struct Frame {
    lexer: Lexer,
    /// For the detection of cycles.
    path: Option<PathBuf>,
    /// What an `Import` must not change.
    import: Option<ImportedState>,
}

/// Reads directives.
pub(super) struct Parser<'a> {
    pub builder: Builder<'a>,
    options: &'a ReadOptions,
    frames: Vec<Frame>,
    names: HashSet<Arc<str>>,
    declarations: HashMap<Box<[u8]>, (ParameterType, Arc<str>)>,
    spectra: HashMap<PathBuf, Option<SpectrumParameter>>,
    files_read: usize,
    bytes_read: u64,
    warned_transform_begin: bool,
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
    fn enter(
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
            if let Some(imported) = frame.import {
                self.builder.end_import(imported, end);
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
    fn expect_string(&mut self, what: &str) -> Option<(Arc<str>, Span)> {
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
    fn expect_numbers<const N: usize>(&mut self, what: &str, brackets: bool) -> Option<[f32; N]> {
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

    fn unexpected(&mut self, found: Option<Token>, expected: &str) {
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

    /// One directive. `false`: its end was not found.
    fn directive(&mut self, token: Token) -> bool {
        let text = self.lexer().text.clone();
        let word = &text[token.start..token.end];
        let span = self.lexer().span(token);
        if token.kind != TokenKind::Word || !is_directive(word) || legacy::directive(word).is_some() {
            self.report_no_directive(token);
            return false;
        }
        self.known_directive(word, span).is_some()
    }

    fn report_no_directive(&mut self, token: Token) {
        let span = self.lexer().span(token);
        let bytes = self.lexer().bytes(token).to_vec();
        let text = String::from_utf8_lossy(&bytes[..bytes.len().min(200)]).into_owned();
        let is_name = token.kind == TokenKind::Word && bytes[0].is_ascii_alphabetic();
        let message = match token.kind {
            TokenKind::OpenString => "this string has no closing quote on its line".to_owned(),
            _ if is_name => format!("unknown directive `{}`", shorten(&text)),
            _ => format!("expected a directive, found `{}`", shorten(&text)),
        };
        let help = legacy::directive(&bytes).map(str::to_owned).or_else(|| {
            let candidates = DIRECTIVES.into_iter().chain(["WorldBegin"]);
            is_name.then(|| did_you_mean(&text, candidates)).flatten()
        });
        self.error(Diagnostic::error(span, message).with_optional_help(help));
    }

    /// `None`: the directive's end was not found.
    fn known_directive(&mut self, word: &[u8], span: Span) -> Option<()> {
        match word {
            b"AttributeBegin" => self.builder.attribute_begin(span),
            b"AttributeEnd" => self.builder.attribute_end(span),
            b"TransformBegin" | b"TransformEnd" => self.transform_begin_end(word, span),
            b"WorldBegin" => self.builder.world_begin(span),
            b"ReverseOrientation" => self.builder.reverse_orientation(span),
            b"Identity" => self.builder.identity(),
            b"ObjectEnd" => self.builder.object_end(span),
            b"Translate" => {
                let v = self.expect_numbers("three numbers", false)?;
                self.builder.translate(v, span);
            }
            b"Scale" => {
                let v = self.expect_numbers("three numbers", false)?;
                self.builder.scale(v, span);
            }
            b"Rotate" => {
                let [angle, x, y, z] = self.expect_numbers("an angle in degrees and an axis", false)?;
                self.builder.rotate(angle, [x, y, z], span);
            }
            b"LookAt" => {
                let v = self.expect_numbers("nine numbers (eye, target, up)", false)?;
                self.builder.look_at(v, span);
            }
            b"Transform" => {
                let v = self.expect_numbers("sixteen numbers", true)?;
                self.builder.set_transform(v, span);
            }
            b"ConcatTransform" => {
                let v = self.expect_numbers("sixteen numbers", true)?;
                self.builder.concat_transform(v, span);
            }
            b"TransformTimes" => {
                let v = self.expect_numbers("two times in seconds", false)?;
                self.builder.transform_times(v, span);
            }
            b"ActiveTransform" => self.active_transform()?,
            b"Include" | b"Import" => {
                let (name, name_span) = self.expect_string("a quoted file name")?;
                self.include(&name, name_span, span, word == b"Import");
            }
            b"Texture" => {
                let name = self.expect_string("a quoted name")?;
                let value_type = self.expect_string("`\"float\"` or `\"spectrum\"`")?;
                let kind = self.expect_string("a quoted kind of texture")?;
                let parameters = self.parameters();
                self.builder.texture(span, name, value_type, kind, parameters);
            }
            b"MediumInterface" => {
                let inside = self.expect_string("a quoted name of a medium")?;
                let outside = match self.peek() {
                    Some(token) if token.kind == TokenKind::String => self.expect_string("")?,
                    _ => inside.clone(),
                };
                self.builder.medium_interface(inside, outside);
            }
            b"Option" => self.option(span)?,
            _ => self.named_directive(word, span)?,
        }
        Some(())
    }

    /// Directives with a name, and perhaps parameters.
    fn named_directive(&mut self, word: &[u8], span: Span) -> Option<()> {
        let (name, name_span) = self.expect_string("a quoted name")?;
        let named = (name, name_span);
        match word {
            b"ColorSpace" => self.builder.set_color_space(named),
            b"CoordinateSystem" => self.builder.coordinate_system(named),
            b"CoordSysTransform" => self.builder.coord_sys_transform(named),
            b"NamedMaterial" => self.builder.named_material(span, named),
            b"ObjectBegin" => self.builder.object_begin(span, named),
            b"ObjectInstance" => self.builder.object_instance(span, named),
            _ => {
                let parameters = self.parameters();
                let builder = &mut self.builder;
                match word {
                    b"Accelerator" => builder.accelerator(span, named, parameters),
                    b"AreaLightSource" => builder.area_light_source(span, named, parameters),
                    b"Attribute" => builder.attribute(named, parameters),
                    b"Camera" => builder.camera(span, named, parameters),
                    b"Film" => builder.film(span, named, parameters),
                    b"Integrator" => builder.integrator(span, named, parameters),
                    b"LightSource" => builder.light_source(span, named, parameters),
                    b"MakeNamedMaterial" => builder.make_named_material(span, named, parameters),
                    b"MakeNamedMedium" => builder.make_named_medium(span, named, parameters),
                    b"Material" => builder.material(span, named, parameters),
                    b"PixelFilter" => builder.pixel_filter(span, named, parameters),
                    b"Sampler" => builder.sampler(span, named, parameters),
                    _ => builder.shape(span, named, parameters),
                }
            }
        }
        Some(())
    }

    fn active_transform(&mut self) -> Option<()> {
        let token = self.peek();
        let word = token.map(|token| self.lexer().bytes(token));
        let active = match word {
            Some(b"All") => [true, true],
            Some(b"StartTime") => [true, false],
            Some(b"EndTime") => [false, true],
            _ => {
                self.unexpected(token, "`All`, `StartTime` or `EndTime`");
                return None;
            }
        };
        self.next();
        self.builder.active_transform(active);
        Some(())
    }

    fn transform_begin_end(&mut self, word: &[u8], span: Span) {
        if !self.warned_transform_begin {
            self.warned_transform_begin = true;
            let message = "`TransformBegin` and `TransformEnd` are deprecated";
            let help = "write `AttributeBegin` and `AttributeEnd`, which is what they mean in pbrt-v4";
            self.error(Diagnostic::warning(span, message).with_help(help));
        }
        if word == b"TransformBegin" { self.builder.attribute_begin(span) } else { self.builder.attribute_end(span) }
    }

    /// `Option "name" value` (or `"type name" value`).
    fn option(&mut self, span: Span) -> Option<()> {
        let (name, name_span) = self.expect_string("a quoted name of an option")?;
        let token = self.peek();
        let value = match token {
            Some(token) if token.kind == TokenKind::String => self.string_of(token)?.0,
            Some(token) if token.kind == TokenKind::Word && !is_directive(self.lexer().bytes(token)) => {
                String::from_utf8_lossy(self.lexer().bytes(token)).into()
            }
            other => {
                self.unexpected(other, "the value of the option");
                return None;
            }
        };
        self.next();
        let quoted = token.is_some_and(|token| token.kind == TokenKind::String);
        self.builder.option(span, &name, name_span, &value, quoted);
        Some(())
    }

    /// `Include` and `Import`. Names start from the top-level scene's directory, as in pbrt.
    fn include(&mut self, name: &str, name_span: Span, span: Span, import: bool) {
        let limits = self.options.limits;
        let directive = if import { "Import" } else { "Include" };
        if import && !self.builder.require_world(directive, span) {
            return;
        }
        let path = resolve(&self.builder.directory, name);
        let canonical = path.canonicalize().ok();
        let open = self.frames.iter().position(|f| f.path.is_some() && f.path == canonical);
        if let Some(position) = open {
            let opened = self.frames[position].lexer.file;
            let mut diagnostic = Diagnostic::error(name_span, format!("`{}` includes itself", shorten(name)));
            let steps = self.frames[position + 1..]
                .iter()
                .filter_map(|f| self.builder.sources.file(f.lexer.file).and_then(|file| file.included_from));
            for step in steps.collect::<Vec<_>>() {
                diagnostic = diagnostic.with_note(step, "through this");
            }
            diagnostic = diagnostic.with_note(Span::new(opened, 0, 0), "this file is still being read");
            self.error(diagnostic);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directives_are_sorted() {
        assert!(DIRECTIVES.is_sorted());
        for name in DIRECTIVES {
            assert!(is_directive(name.as_bytes()));
        }
        assert!(is_directive(b"WorldBegin") && is_directive(b"WorldEnd") && !is_directive(b"1"));
    }
}
