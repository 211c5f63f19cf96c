//! The header of a PLY file: which elements of which properties follow.

use super::PlyError;

/// How the data are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Ascii,
    BinaryLittleEndian,
    BinaryBigEndian,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// The type of a property.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PropertyType {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

/// A property.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Property {
    pub name: String,
    pub kind: PropertyType,
}

/// An element: so many times these properties.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

impl Element {
    /// The scalar properties of these names, if all are there.
    pub fn scalars<const N: usize>(&self, names: [&str; N]) -> Option<[usize; N]> {
        let mut indices = [0; N];
        for (index, name) in indices.iter_mut().zip(names) {
            let found = |p: &Property| p.name == name && matches!(p.kind, PropertyType::Scalar(_));
            *index = self.properties.iter().position(found)?;
        }
        Some(indices)
    }

    /// The list property of this name.
    pub fn list(&self, name: &str) -> Option<usize> {
        self.properties.iter().position(|p| p.name == name && matches!(p.kind, PropertyType::List { .. }))
    }

    /// Bytes of each in binary form; `None` if there are lists.
    pub fn stride(&self) -> Option<usize> {
        self.properties
            .iter()
            .map(|p| match p.kind {
                PropertyType::Scalar(scalar) => Some(scalar.size()),
                PropertyType::List { .. } => None,
            })
            .sum()
    }

    /// The fewest bytes that each can take in binary form.
    pub fn least_bytes(&self) -> usize {
        let least = |p: &Property| match p.kind {
            PropertyType::Scalar(scalar) => scalar.size(),
            PropertyType::List { count, .. } => count.size(),
        };
        self.properties.iter().map(least).sum()
    }

    /// The count, if that many fit into `available` bytes of `least` each.
    pub fn count_within(&self, available: usize, least: usize) -> Result<usize, PlyError> {
        let fits = (available / least.max(1)) as u64;
        if self.count > fits {
            return Err(PlyError::AbsurdCount { element: self.name.clone(), count: self.count });
        }
        Ok(self.count as usize)
    }

    pub fn truncated(&self, index: usize) -> PlyError {
        PlyError::Truncated { element: self.name.clone(), index: index as u64, count: self.count }
    }
}

/// A header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub format: Format,
    pub elements: Vec<Element>,
    /// Where the data start.
    pub data_start: usize,
}

/// The longest header, in bytes.
const MAX_BYTES: usize = 1 << 20;
/// The most elements, and the most properties of one.
const MAX_ITEMS: usize = 1 << 12;

impl Header {
    /// Parses the header at the start of a file.
    pub fn parse(bytes: &[u8]) -> Result<Self, PlyError> {
        let mut format = None;
        let mut elements: Vec<Element> = Vec::new();
        let mut at = 0;
        let mut number = 0;
        loop {
            number += 1;
            let fail = |message: String| PlyError::Header { line: number, message };
            let window = &bytes[at..bytes.len().min(MAX_BYTES)];
            let Some(length) = window.iter().position(|b| *b == b'\n') else {
                let message = if number == 1 { "this is not a PLY file" } else { "there is no `end_header`" };
                return Err(fail(message.into()));
            };
            let line = String::from_utf8_lossy(&window[..length]);
            at += length + 1;
            let words: Vec<&str> = line.split_ascii_whitespace().take(6).collect();
            if number == 1 {
                if words != ["ply"] {
                    return Err(fail("this is not a PLY file".into()));
                }
                continue;
            }
            match words.as_slice() {
                [] | ["comment" | "obj_info", ..] => {}
                ["format", name, _version] => {
                    format = Some(match *name {
                        "ascii" => Format::Ascii,
                        "binary_little_endian" => Format::BinaryLittleEndian,
                        "binary_big_endian" => Format::BinaryBigEndian,
                        other => return Err(fail(format!("unknown format `{}`", cut(other)))),
                    });
                }
                ["element", name, count] => {
                    let count = count.parse().map_err(|_| fail(format!("`{}` is not a count", cut(count))))?;
                    if elements.iter().any(|e| e.name == *name) {
                        return Err(fail(format!("element `{}` is there twice", cut(name))));
                    }
                    if elements.len() == MAX_ITEMS {
                        return Err(fail("there are too many elements".into()));
                    }
                    elements.push(Element { name: (*name).into(), count, properties: Vec::new() });
                }
                ["property", rest @ ..] => {
                    let Some(element) = elements.last_mut() else {
                        return Err(fail("a property before any element".into()));
                    };
                    if element.properties.len() == MAX_ITEMS {
                        return Err(fail("there are too many properties".into()));
                    }
                    element.properties.push(property(rest).map_err(fail)?);
                }
                ["end_header", ..] => break,
                [word, ..] => return Err(fail(format!("unknown or incomplete `{}`", cut(word)))),
            }
        }
        let format = format.ok_or(PlyError::Header { line: number, message: "there is no `format`".into() })?;
        Ok(Self { format, elements, data_start: at })
    }
}

fn property(words: &[&str]) -> Result<Property, String> {
    let scalar = |name: &str| Scalar::named(name).ok_or_else(|| format!("unknown type `{}`", cut(name)));
    match words {
        ["list", count, item, name] => {
            let (count, item) = (scalar(count)?, scalar(item)?);
            if matches!(count, Scalar::F32 | Scalar::F64) {
                return Err("the length of a list must be an integer".into());
            }
            Ok(Property { name: (*name).into(), kind: PropertyType::List { count, item } })
        }
        [kind, name] => Ok(Property { name: (*name).into(), kind: PropertyType::Scalar(scalar(kind)?) }),
        _ => Err("a property should be `property TYPE NAME` or `property list TYPE TYPE NAME`".into()),
    }
}

/// Text for a message.
pub(super) fn cut(text: &str) -> String {
    text.chars().take(40).map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}
