//! Tokens of a pbrt scene file: words, quoted strings and brackets, with comments skipped.

use super::number::token_end;
use crate::source::{FileId, Span};
use std::sync::Arc;

/// What a token is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TokenKind {
    /// A directive, a number, `true` or `false`: anything up to white space, a quote or a bracket.
    Word,
    /// A quoted string; the token includes its quotes.
    String,
    /// A quoted string without an end; the token goes to the end of the line.
    OpenString,
    /// `[`
    OpenBracket,
    /// `]`
    CloseBracket,
}

/// A token: a kind and a range of bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Token {
    pub kind: TokenKind,
    pub start: usize,
    pub end: usize,
}

/// Walks over the text of one file.
pub(crate) struct Lexer {
    pub text: Arc<Vec<u8>>,
    pub file: FileId,
    pub position: usize,
}

/// What is wrong with the contents of a string.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StringFault {
    NotUtf8,
    UnknownEscape,
    TooLong,
    Nul,
}

/// The longest string, in bytes.
const MAX_STRING_BYTES: usize = 1 << 16;

impl Lexer {
    pub fn new(text: Arc<Vec<u8>>, file: FileId) -> Self {
        // A UTF-8 byte order mark says nothing.
        let position = if text.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        Self { text, file, position }
    }

    pub fn span(&self, token: Token) -> Span {
        Span::new(self.file, token.start, token.end)
    }

    pub fn bytes(&self, token: Token) -> &[u8] {
        &self.text[token.start..token.end]
    }

    /// Moves to the first byte of the next token; `None` at the end of the file.
    #[inline]
    pub fn skip_blank(&mut self) -> Option<u8> {
        self.position = skip_blank(&self.text, self.position);
        self.text.get(self.position).copied()
    }

    /// The next token; the position moves behind it.
    pub fn next(&mut self) -> Option<Token> {
        let first = self.skip_blank()?;
        let start = self.position;
        let (kind, end) = match first {
            b'[' => (TokenKind::OpenBracket, start + 1),
            b']' => (TokenKind::CloseBracket, start + 1),
            b'"' => string_end(&self.text, start),
            _ => (TokenKind::Word, token_end(&self.text, start)),
        };
        self.position = end;
        Some(Token { kind, start, end })
    }

    /// The next token; the position stays (but skips what is blank).
    pub fn peek(&mut self) -> Option<Token> {
        self.skip_blank()?;
        let position = self.position;
        let token = self.next();
        self.position = position;
        token
    }

    /// The contents of a string token, with escapes replaced.
    pub fn string(&self, token: Token) -> Result<std::borrow::Cow<'_, str>, StringFault> {
        let inner = &self.text[token.start + 1..token.end - 1];
        if inner.len() > MAX_STRING_BYTES {
            return Err(StringFault::TooLong);
        }
        let text = std::str::from_utf8(inner).map_err(|_| StringFault::NotUtf8)?;
        if text.contains('\0') {
            return Err(StringFault::Nul);
        }
        if !text.contains('\\') {
            return Ok(text.into());
        }
        let mut out = String::with_capacity(text.len());
        let mut characters = text.chars();
        while let Some(c) = characters.next() {
            if c != '\\' {
                out.push(c);
                continue;
            }
            out.push(match characters.next() {
                Some('b') => '\u{8}',
                Some('f') => '\u{c}',
                Some('n') => '\n',
                Some('r') => '\r',
                Some('t') => '\t',
                Some(c @ ('\\' | '\'' | '"')) => c,
                _ => return Err(StringFault::UnknownEscape),
            });
        }
        Ok(out.into())
    }
}

/// The first index from `at` on that is neither white space nor in a comment.
#[inline]
pub(crate) fn skip_blank(text: &[u8], mut at: usize) -> usize {
    while let Some(&byte) = text.get(at) {
        match byte {
            b' ' | b'\n' | b'\t' | b'\r' => at += 1,
            b'#' => at = text[at..].iter().position(|&b| b == b'\n' || b == b'\r').map_or(text.len(), |i| at + i),
            _ => break,
        }
    }
    at
}

/// The end of the string that starts at `start`. A string ends at its line's end at the latest.
fn string_end(text: &[u8], start: usize) -> (TokenKind, usize) {
    let mut at = start + 1;
    loop {
        match text.get(at) {
            Some(b'"') => return (TokenKind::String, at + 1),
            Some(b'\\') if !matches!(text.get(at + 1), None | Some(b'\n')) => at += 2,
            None | Some(b'\n') => return (TokenKind::OpenString, at),
            Some(_) => at += 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lexer(text: &str) -> Lexer {
        Lexer::new(Arc::new(text.as_bytes().to_vec()), FileId(0))
    }

    fn tokens(text: &str) -> Vec<(TokenKind, String)> {
        let mut lexer = lexer(text);
        let mut out = Vec::new();
        while let Some(token) = lexer.next() {
            out.push((token.kind, String::from_utf8_lossy(lexer.bytes(token)).into_owned()));
        }
        out
    }

    #[test]
    fn tokens_end_at_quotes_brackets_and_blanks() {
        use TokenKind::*;
        let found = tokens("Shape\"sphere\"[1 -2]# comment [\n x\"a b\"");
        let expected = [
            (Word, "Shape"),
            (String, "\"sphere\""),
            (OpenBracket, "["),
            (Word, "1"),
            (Word, "-2"),
            (CloseBracket, "]"),
            (Word, "x"),
            (String, "\"a b\""),
        ];
        assert_eq!(found, expected.map(|(kind, text)| (kind, text.to_owned())));
    }

    #[test]
    fn strings_end_with_their_line() {
        assert_eq!(tokens("\"abc\nx")[0], (TokenKind::OpenString, "\"abc".into()));
        assert_eq!(tokens("\"abc\\")[0], (TokenKind::OpenString, "\"abc\\".into()));
        assert_eq!(tokens("\"abc\\\"")[0], (TokenKind::OpenString, "\"abc\\\"".into()));
    }

    #[test]
    fn escapes() {
        let text = r#""a\"b\\c\n""#;
        let mut with_escapes = lexer(text);
        let token = with_escapes.next().unwrap();
        assert_eq!(with_escapes.string(token).unwrap(), "a\"b\\c\n");
        let mut unknown = lexer(r#""\x""#);
        let token = unknown.next().unwrap();
        assert_eq!(unknown.string(token), Err(StringFault::UnknownEscape));
    }
}
