//! Image files, read once however often they are used.

use crate::texture::{Pyramid, SpectrumImage, SpectrumKind, TexelFilter};
use luz_color::RgbColorSpace;
use luz_image::{Chromaticities, Encoding, Image, ReadOptions, WrapMode};
use luz_sample::distribution::TexelTree;
use luz_scene::{Diagnostics, Span};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// All the images that a scene uses, by file and by how they are read.
#[derive(Default)]
pub(super) struct Images {
    images: HashMap<(PathBuf, Option<EncodingKey>), Option<Arc<Image>>>,
    colors: HashMap<PyramidKey, Arc<Pyramid<3>>>,
    floats: HashMap<PyramidKey, Arc<Pyramid<1>>>,
    brightness: HashMap<PathBuf, Option<Arc<TexelTree>>>,
}

type EncodingKey = (u8, u32);
/// File, encoding, wrap mode (by its number) and filter.
type PyramidKey = (PathBuf, Option<EncodingKey>, u8, TexelFilter);

fn encoding_key(encoding: Option<Encoding>) -> Option<EncodingKey> {
    encoding.map(|encoding| match encoding {
        Encoding::Linear => (0, 0),
        Encoding::Srgb => (1, 0),
        Encoding::Gamma(gamma) => (2, gamma.to_bits()),
    })
}

impl Images {
    /// The image of a file; `None` (and a diagnostic, once) where it cannot be read.
    pub fn image(
        &mut self,
        path: &Path,
        encoding: Option<Encoding>,
        span: Option<Span>,
        diagnostics: &mut Diagnostics,
    ) -> Option<Arc<Image>> {
        self.images
            .entry((path.to_owned(), encoding_key(encoding)))
            .or_insert_with(|| match Image::read_with(path, &ReadOptions { encoding, ..Default::default() }) {
                Ok(image) if image.width() > 0 && image.height() > 0 => Some(Arc::new(image)),
                Ok(_) => {
                    diagnostics.error(span, format!("the image `{}` has no pixels", path.display()));
                    None
                }
                Err(error) => {
                    diagnostics.error(span, error.to_string());
                    None
                }
            })
            .clone()
    }

    /// The colours of a file at every scale.
    pub fn colors(
        &mut self,
        path: &Path,
        encoding: Option<Encoding>,
        (wrap, filter): (WrapMode, TexelFilter),
        kind: SpectrumKind,
        span: Option<Span>,
        diagnostics: &mut Diagnostics,
    ) -> Option<SpectrumImage> {
        let image = self.image(path, encoding, span, diagnostics)?;
        // Made now, at the first lookup it would be waited for by all threads but one.
        image_color_space(&image).sigmoid_table();
        let channels = color_channels(&image);
        let pyramid = self
            .colors
            .entry((path.to_owned(), encoding_key(encoding), wrap as u8, filter))
            .or_insert_with(|| Arc::new(Pyramid::new(&image, channels, wrap, filter)))
            .clone();
        Some(SpectrumImage { pyramid, color_space: image_color_space(&image), kind })
    }

    /// One channel of a file at every scale: alpha where it has four channels, else the mean of its colours.
    pub fn floats(
        &mut self,
        path: &Path,
        encoding: Option<Encoding>,
        (wrap, filter): (WrapMode, TexelFilter),
        span: Option<Span>,
        diagnostics: &mut Diagnostics,
    ) -> Option<Arc<Pyramid<1>>> {
        let image = self.image(path, encoding, span, diagnostics)?;
        let pyramid = self
            .floats
            .entry((path.to_owned(), encoding_key(encoding), wrap as u8, filter))
            .or_insert_with(|| {
                let stride = image.channels().len();
                let value = |texel: &[f32]| match stride {
                    4.. => texel[3],
                    3 => (texel[0] + texel[1] + texel[2]) / 3.0,
                    _ => texel[0],
                };
                let data = image.data().chunks_exact(stride).map(value).collect();
                let grey = Image::from_data(image.width(), image.height(), ["Y"], data);
                // As many values as pixels: this cannot fail, but if it did the texture would be the image's first channel.
                let grey = grey.as_ref().unwrap_or(&image);
                Arc::new(Pyramid::new(grey, [0], wrap, filter))
            })
            .clone();
        Some(pyramid)
    }

    /// The tree by which lights draw points of an image, made once; `None` where it has nothing to prefer.
    pub fn brightness_tree(&mut self, path: &Path, make: impl FnOnce() -> Option<TexelTree>) -> Option<Arc<TexelTree>> {
        self.brightness.entry(path.to_owned()).or_insert_with(|| make().map(Arc::new)).clone()
    }

    /// Bytes that the pyramids and trees hold.
    pub fn bytes(&self) -> usize {
        self.colors.values().map(|p| p.bytes()).sum::<usize>()
            + self.floats.values().map(|p| p.bytes()).sum::<usize>()
            + self.brightness.values().flatten().map(|tree| tree.bytes()).sum::<usize>()
    }
}

/// Where red, green and blue are; a grey image's single channel stands for all three.
pub(super) fn color_channels(image: &Image) -> [usize; 3] {
    let find = |name: &str| image.channels().iter().position(|c| c == name);
    match (find("R"), find("G"), find("B")) {
        (Some(r), Some(g), Some(b)) => [r, g, b],
        _ if image.channels().len() >= 3 => [0, 1, 2],
        _ => [0; 3],
    }
}

/// The colour space that a file says it has; sRGB primaries where it says nothing.
pub(super) fn image_color_space(image: &Image) -> &'static RgbColorSpace {
    image.metadata.chromaticities.as_ref().and_then(Chromaticities::color_space).unwrap_or_else(RgbColorSpace::srgb)
}
