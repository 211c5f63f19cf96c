//! The directives, one by one: what follows each, and whom it concerns.

use super::legacy;
use super::lexer::{Token, TokenKind};
use super::parser::{Parser, shorten};
use crate::diagnostic::{Diagnostic, did_you_mean};
use crate::source::Span;

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

impl Parser<'_> {
    /// One directive. `false`: its end was not found.
    pub fn directive(&mut self, token: Token) -> bool {
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
            b"AttributeBegin" => self.builder.attribute_begin("AttributeBegin", span),
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
        if word == b"TransformBegin" {
            self.builder.attribute_begin("TransformBegin", span);
        } else {
            self.builder.attribute_end(span);
        }
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
