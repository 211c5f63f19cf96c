//! Parameter lists: `"type name" value` or `"type name" [ values ]`.

use super::directives::is_directive;
use super::legacy;
use super::lexer::{Lexer, Token, TokenKind, skip_blank};
use super::number::{NumberFault, parse_f32, parse_i32};
use super::parser::{Parser, shorten};
use crate::diagnostic::{Diagnostic, did_you_mean};
use crate::parameter::{Parameter, ParameterType, Values};
use crate::source::Span;
use crate::spectrum::SpectrumParameter;
use std::sync::Arc;

/// What the values of a parameter are in the text.
enum Raw {
    Bools(Vec<bool>),
    Integers(Vec<i32>),
    Floats(Vec<f32>),
    Strings(Vec<(Arc<str>, Span)>),
}

/// Which of them to expect.
#[derive(Clone, Copy, PartialEq, Eq)]
enum RawKind {
    Bools,
    Integers,
    Floats,
    Strings,
}

impl RawKind {
    fn expected(self) -> &'static str {
        match self {
            RawKind::Bools => "`true` or `false`",
            RawKind::Integers => "an integer",
            RawKind::Floats => "a number",
            RawKind::Strings => "a quoted string",
        }
    }
}

impl Parser<'_> {
    /// All parameters up to the next token that isn't a string. Tells the builder whether one of them is lost.
    pub fn parameters(&mut self) -> Vec<Parameter> {
        let errors = self.builder.diagnostics.error_count();
        let mut list = Vec::new();
        while let Some(token) = self.peek() {
            match token.kind {
                TokenKind::String => {
                    self.next();
                    list.extend(self.parameter(token));
                }
                TokenKind::OpenString => {
                    self.next();
                    self.report_open_string(token);
                    self.skip_value();
                }
                _ => break,
            }
        }
        self.builder.parameters_complete = self.builder.diagnostics.error_count() == errors;
        list
    }

    /// One parameter, after its declaration. `None` if it's wrong; the position is then behind its value.
    fn parameter(&mut self, token: Token) -> Option<Parameter> {
        let Some((kind, name, name_span)) = self.declaration(token) else {
            self.skip_value();
            return None;
        };
        let (raw, value_span) = self.raw_values(kind, &name, name_span)?;
        let values = self.convert(kind, &name, raw, value_span)?;
        Some(Parameter::new(name, kind, values, name_span, value_span))
    }

    /// Type, name and place of the name in `"type name"`.
    fn declaration(&mut self, token: Token) -> Option<(ParameterType, Arc<str>, Span)> {
        let frame = self.lexer();
        let (bytes, span) = (frame.bytes(token), frame.span(token));
        let name_offset = bytes[1..]
            .iter()
            .position(|b| matches!(b, b' ' | b'\t'))
            .map_or(1, |i| 1 + i + bytes[1 + i..].iter().position(|b| !matches!(b, b' ' | b'\t')).unwrap_or(0));
        let name_length = bytes[name_offset..].iter().position(|b| matches!(b, b' ' | b'\t' | b'"')).unwrap_or(0);
        let name_start = token.start + name_offset;
        let name_span = Span::new(span.file, name_start, name_start + name_length);
        if let Some((kind, name)) = self.known_declaration(token) {
            return Some((kind, name, name_span));
        }
        let (text, _) = self.string_of(token)?;
        let mut words = text.split([' ', '\t']).filter(|word| !word.is_empty());
        let (Some(type_name), Some(name)) = (words.next(), words.next()) else {
            let help = "write `\"type name\"`, for example `\"float radius\"`";
            let message = if text.trim().is_empty() {
                "this parameter has neither type nor name".to_owned()
            } else {
                format!("this parameter has no type, or no name: `{}`", shorten(&text))
            };
            self.error(Diagnostic::error(span, message).with_help(help));
            return None;
        };
        if let Some(extra) = words.next() {
            let message = format!("`{}` after the name of the parameter means nothing", shorten(extra));
            self.error(Diagnostic::warning(span, message));
        }
        let name = self.intern(name);
        if let Some(kind) = ParameterType::named(type_name) {
            self.remember_declaration(token, kind, name.clone());
            return Some((kind, name, name_span));
        }
        let message = format!("unknown parameter type `{}`", shorten(type_name));
        let old = legacy::parameter_type(type_name);
        let help = old.map(|(_, help)| help.to_owned()).or_else(|| {
            did_you_mean(type_name, ParameterType::ALL.map(ParameterType::name))
                .or_else(|| Some(format!("known are {}", ParameterType::ALL.map(ParameterType::name).join(", "))))
        });
        self.error(Diagnostic::error(span, message).with_optional_help(help));
        let kind = old.and_then(|(new, _)| ParameterType::named(new))?;
        Some((kind, name, name_span))
    }

    /// The values as the text has them, and their place.
    fn raw_values(&mut self, kind: ParameterType, name: &str, name_span: Span) -> Option<(Raw, Span)> {
        let takes_strings = matches!(kind, ParameterType::String | ParameterType::Texture | ParameterType::Spectrum);
        let value = self.peek().filter(|first| {
            let directive = first.kind == TokenKind::Word && is_directive(self.lexer().bytes(*first));
            !directive && (takes_strings || !self.is_declaration(*first))
        });
        let Some(first) = value else {
            self.error(Diagnostic::error(name_span, format!("parameter `{name}` has no value")));
            return None;
        };
        let span = self.lexer().span(first);
        match first.kind {
            TokenKind::OpenBracket => {
                self.next();
                let expected = self.raw_kind(kind);
                let raw = self.raw_list(expected, name, span)?;
                let end = self.lexer().position as u64;
                Some((raw, Span { end, ..span }))
            }
            TokenKind::CloseBracket => {
                self.next();
                self.error(Diagnostic::error(span, format!("`]` without `[` in parameter `{name}`")));
                None
            }
            TokenKind::OpenString => {
                self.next();
                self.report_open_string(first);
                None
            }
            TokenKind::Word | TokenKind::String => {
                let expected = self.raw_kind(kind);
                let mut raw = Raw::new(expected);
                if let Err(diagnostic) = self.raw_value(&mut raw) {
                    self.next();
                    self.error(*diagnostic);
                    return None;
                }
                Some((raw, span))
            }
        }
    }

    /// What to expect for a type; spectra are told by their first value.
    fn raw_kind(&mut self, kind: ParameterType) -> RawKind {
        match kind {
            ParameterType::Bool => RawKind::Bools,
            ParameterType::Integer => RawKind::Integers,
            ParameterType::String | ParameterType::Texture => RawKind::Strings,
            ParameterType::Spectrum if self.lexer_mut().skip_blank() == Some(b'"') => RawKind::Strings,
            _ => RawKind::Floats,
        }
    }

    /// The values after `[`, and the `]`.
    fn raw_list(&mut self, expected: RawKind, name: &str, open: Span) -> Option<Raw> {
        let mut raw = Raw::new(expected);
        loop {
            match &mut raw {
                Raw::Floats(values) => read_floats(self.lexer_mut(), values),
                Raw::Integers(values) => read_integers(self.lexer_mut(), values),
                _ => {}
            }
            let Some(token) = self.lexer_mut().peek() else {
                let diagnostic = Diagnostic::error(open, format!("the list of values of `{name}` has no `]`"));
                self.error(diagnostic);
                return None;
            };
            if token.kind == TokenKind::CloseBracket {
                self.lexer_mut().next();
                raw.shrink();
                return Some(raw);
            }
            if let Err(diagnostic) = self.raw_value(&mut raw) {
                let forgotten = self.is_declaration(token) && expected != RawKind::Strings
                    || token.kind == TokenKind::Word && is_directive(self.lexer().bytes(token));
                if forgotten {
                    let place = self.lexer().span(token);
                    let message = format!("the list of values of `{name}` has no `]`");
                    self.error(Diagnostic::error(open, message).with_note(place, "it should end before this"));
                } else {
                    self.error(*diagnostic);
                    self.skip_list();
                }
                return None;
            }
        }
    }

    /// One value. On failure the position is unchanged.
    fn raw_value(&mut self, raw: &mut Raw) -> Result<(), Box<Diagnostic>> {
        let expected = raw.kind().expected();
        let Some(token) = self.lexer_mut().peek() else { return Ok(()) };
        let lexer = self.lexer();
        let span = lexer.span(token);
        let bytes = lexer.bytes(token);
        let found = || shorten(&String::from_utf8_lossy(bytes));
        let wrong = || Box::new(Diagnostic::error(span, format!("expected {expected}, found `{}`", found())));
        let number = |fault| match fault {
            NumberFault::NotANumber => wrong(),
            NumberFault::NotAnInteger => {
                let diagnostic = *wrong();
                let exact = std::str::from_utf8(bytes).ok().and_then(|t| t.parse::<f64>().ok());
                Box::new(match exact {
                    Some(v) if v.fract() == 0.0 && v.abs() < 2e9 => diagnostic.with_help(format!("write `{v}`")),
                    _ => diagnostic,
                })
            }
            NumberFault::OutOfRange => {
                let diagnostic = Diagnostic::error(span, format!("`{}` is out of range for {expected}", found()));
                Box::new(diagnostic.with_help("integers have 32 bits, other numbers are of single precision"))
            }
        };
        let end = match (raw, token.kind) {
            (Raw::Floats(values), TokenKind::Word) => {
                let (value, end) = parse_f32(&lexer.text, token.start).map_err(number)?;
                values.push(value);
                end
            }
            (Raw::Integers(values), TokenKind::Word) => {
                let (value, end) = parse_i32(&lexer.text, token.start).map_err(number)?;
                values.push(value);
                end
            }
            (Raw::Bools(values), TokenKind::Word | TokenKind::String) => {
                values.push(match bytes {
                    b"true" | b"\"true\"" => true,
                    b"false" | b"\"false\"" => false,
                    _ => return Err(wrong()),
                });
                if token.kind == TokenKind::String {
                    let message = "pbrt-v4 writes booleans without quotes";
                    self.error(Diagnostic::warning(span, message));
                }
                token.end
            }
            (Raw::Strings(values), TokenKind::String) => {
                match self.string_of(token) {
                    Some((text, span)) => values.push((text, span)),
                    // Already reported; an empty string keeps the list going.
                    None => values.push(("".into(), span)),
                }
                token.end
            }
            _ => return Err(wrong()),
        };
        self.lexer_mut().position = end;
        Ok(())
    }

    /// Does this token look like `"float radius"`?
    fn is_declaration(&self, token: Token) -> bool {
        if token.kind != TokenKind::String {
            return false;
        }
        let bytes = self.lexer().bytes(token);
        let mut words = bytes[1..bytes.len() - 1].split(|b| matches!(b, b' ' | b'\t')).filter(|w| !w.is_empty());
        let known = |word: &[u8]| {
            std::str::from_utf8(word)
                .is_ok_and(|w| ParameterType::named(w).is_some() || legacy::parameter_type(w).is_some())
        };
        words.next().is_some_and(known) && words.next().is_some()
    }

    /// Skips the value of a parameter that could not be understood.
    fn skip_value(&mut self) {
        let Some(token) = self.peek() else { return };
        match token.kind {
            TokenKind::OpenBracket => {
                self.next();
                self.skip_list();
            }
            TokenKind::Word if is_directive(self.lexer().bytes(token)) => {}
            _ if self.is_declaration(token) => {}
            _ => {
                self.next();
            }
        }
    }

    /// Skips up to and with the `]` that closes the list, unless a directive or a declaration comes first.
    fn skip_list(&mut self) {
        let mut depth = 1;
        while let Some(token) = self.lexer_mut().peek() {
            if token.kind == TokenKind::Word && is_directive(self.lexer().bytes(token)) || self.is_declaration(token) {
                return;
            }
            self.lexer_mut().next();
            match token.kind {
                TokenKind::OpenBracket => depth += 1,
                TokenKind::CloseBracket => depth -= 1,
                _ => {}
            }
            if depth == 0 {
                return;
            }
        }
    }

    /// From what stands in the text to what the type says.
    fn convert(&mut self, kind: ParameterType, name: &str, raw: Raw, span: Span) -> Option<Values> {
        if raw.len() == 0 {
            self.error(Diagnostic::error(span, format!("parameter `{name}` has no values")));
            return None;
        }
        let components = kind.components();
        if !raw.len().is_multiple_of(components) {
            let message = format!(
                "the {} values of `{name}` are not a multiple of {components}, as `{}` needs",
                raw.len(),
                kind.name()
            );
            self.error(Diagnostic::error(span, message));
            return None;
        }
        let color_space = self.builder.color_space();
        Some(match (kind, raw) {
            (ParameterType::Rgb, Raw::Floats(values)) => {
                if let Some(bad) = values.iter().find(|v| **v < 0.0) {
                    self.error(Diagnostic::error(span, format!("`{name}` has a negative component, {bad}")));
                    return None;
                }
                let triples = values.chunks_exact(3);
                let rgb = |v: &[f32]| SpectrumParameter::Rgb { rgb: [v[0], v[1], v[2]], color_space };
                Values::Spectra(triples.map(rgb).collect())
            }
            (ParameterType::Blackbody, Raw::Floats(values)) => {
                if let Some(bad) = values.iter().find(|v| **v <= 0.0) {
                    let message = format!("the temperature of a blackbody must be positive, not {bad} K");
                    self.error(Diagnostic::error(span, message));
                    return None;
                }
                Values::Spectra(values.into_iter().map(SpectrumParameter::Blackbody).collect())
            }
            (ParameterType::Spectrum, Raw::Floats(values)) => match crate::spd::samples(&values) {
                Ok(samples) => Values::Spectra(vec![SpectrumParameter::Samples(samples)]),
                Err(fault) => {
                    self.error(Diagnostic::error(span, format!("spectrum `{name}`: {fault}")));
                    return None;
                }
            },
            (ParameterType::Spectrum, Raw::Strings(names)) => {
                let count = names.len();
                let spectra: Vec<_> =
                    names.into_iter().filter_map(|(text, span)| self.named_or_file_spectrum(text, span)).collect();
                (spectra.len() == count).then_some(Values::Spectra(spectra))?
            }
            (_, Raw::Bools(values)) => Values::Bools(values),
            (_, Raw::Integers(values)) => Values::Integers(values),
            (_, Raw::Floats(values)) => Values::Floats(values),
            (_, Raw::Strings(values)) => Values::Strings(values.into_iter().map(|(text, _)| text).collect()),
        })
    }
}

impl Raw {
    fn new(kind: RawKind) -> Self {
        match kind {
            RawKind::Bools => Raw::Bools(Vec::new()),
            RawKind::Integers => Raw::Integers(Vec::new()),
            RawKind::Floats => Raw::Floats(Vec::new()),
            RawKind::Strings => Raw::Strings(Vec::new()),
        }
    }

    fn kind(&self) -> RawKind {
        match self {
            Raw::Bools(_) => RawKind::Bools,
            Raw::Integers(_) => RawKind::Integers,
            Raw::Floats(_) => RawKind::Floats,
            Raw::Strings(_) => RawKind::Strings,
        }
    }

    fn len(&self) -> usize {
        match self {
            Raw::Bools(v) => v.len(),
            Raw::Integers(v) => v.len(),
            Raw::Floats(v) => v.len(),
            Raw::Strings(v) => v.len(),
        }
    }

    /// Gives back what growing took too much.
    fn shrink(&mut self) {
        match self {
            Raw::Bools(v) => v.shrink_to_fit(),
            Raw::Integers(v) => v.shrink_to_fit(),
            Raw::Floats(v) => v.shrink_to_fit(),
            Raw::Strings(v) => v.shrink_to_fit(),
        }
    }
}

/// Reads numbers as long as there are any: the loop that big meshes spend their time in. Stops before whatever isn't a
/// good number.
fn read_floats(lexer: &mut Lexer, values: &mut Vec<f32>) {
    let text = &lexer.text[..];
    let mut at = skip_blank(text, lexer.position);
    while let Ok((value, end)) = parse_f32(text, at) {
        values.push(value);
        at = skip_blank(text, end);
    }
    lexer.position = at;
}

/// As [`read_floats`].
fn read_integers(lexer: &mut Lexer, values: &mut Vec<i32>) {
    let text = &lexer.text[..];
    let mut at = skip_blank(text, lexer.position);
    while let Ok((value, end)) = parse_i32(text, at) {
        values.push(value);
        at = skip_blank(text, end);
    }
    lexer.position = at;
}
