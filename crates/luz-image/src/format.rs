//! The image file formats, and how to tell them apart.

use std::fmt;
use std::path::Path;

/// An image file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// OpenEXR: any number of named half or float channels.
    Exr,
    /// Portable Network Graphics, 8 or 16 bits.
    Png,
    /// JPEG, 8 bits, lossy.
    Jpeg,
    /// Tagged Image File Format: 8 or 16 bits, or float.
    Tiff,
    /// Radiance RGBE.
    Hdr,
    /// Portable Float Map: one or three float channels.
    Pfm,
    /// Windows bitmap, 8 bits.
    Bmp,
    /// Truevision TGA, 8 bits.
    Tga,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 8] =
        [Self::Exr, Self::Png, Self::Jpeg, Self::Tiff, Self::Hdr, Self::Pfm, Self::Bmp, Self::Tga];

    /// The file extensions of the format, in lower case; the usual one first.
    pub const fn extensions(self) -> &'static [&'static str] {
        match self {
            Self::Exr => &["exr"],
            Self::Png => &["png"],
            Self::Jpeg => &["jpg", "jpeg"],
            Self::Tiff => &["tif", "tiff"],
            Self::Hdr => &["hdr", "pic"],
            Self::Pfm => &["pfm"],
            Self::Bmp => &["bmp"],
            Self::Tga => &["tga"],
        }
    }

    /// The format that a file's extension stands for.
    pub fn from_path(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        Self::ALL.into_iter().find(|format| format.extensions().contains(&extension.as_str()))
    }

    /// The format that a file's first bytes show; none for TGA, which has no mark.
    pub fn from_contents(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [0x76, 0x2f, 0x31, 0x01, ..] => Some(Self::Exr),
            [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n', ..] => Some(Self::Png),
            [0xff, 0xd8, 0xff, ..] => Some(Self::Jpeg),
            [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => Some(Self::Tiff),
            [b'#', b'?', ..] => Some(Self::Hdr),
            [b'P', b'F' | b'f', c, ..] if c.is_ascii_whitespace() => Some(Self::Pfm),
            [b'B', b'M', ..] => Some(Self::Bmp),
            _ => None,
        }
    }

    /// True for formats that hold floating-point light and need no tone mapping.
    pub const fn is_float(self) -> bool {
        matches!(self, Self::Exr | Self::Hdr | Self::Pfm)
    }

    /// All formats' names, for messages.
    pub(crate) fn known_names() -> String {
        Self::ALL.map(|format| format.to_string()).join(", ")
    }

    /// All formats' extensions, for messages.
    pub(crate) fn known_extensions() -> String {
        let all: Vec<String> =
            Self::ALL.iter().flat_map(|format| format.extensions()).map(|extension| format!(".{extension}")).collect();
        all.join(", ")
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Exr => "OpenEXR",
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
            Self::Tiff => "TIFF",
            Self::Hdr => "Radiance HDR",
            Self::Pfm => "PFM",
            Self::Bmp => "BMP",
            Self::Tga => "TGA",
        })
    }
}
