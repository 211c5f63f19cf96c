//! Textures: floats and spectra that vary over a surface.

mod mapping;
mod pyramid;

pub use mapping::{Coordinates, Mapping};
pub use pyramid::{Pyramid, TexelFilter};

use glam::{Vec2, Vec3};
use luz_color::{RgbColorSpace, SampledSpectrum, Spectrum, Wavelengths};
use luz_geometry::Transform;
use std::sync::Arc;

/// Where a texture is looked up, and how far the lookup moves with one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceContext {
    /// World-space position.
    pub position: Vec3,
    /// Surface parameters.
    pub uv: Vec2,
    /// Change of position over one pixel to the right.
    pub dp_dx: Vec3,
    /// Change of position over one pixel down.
    pub dp_dy: Vec3,
    /// Change of the parameters over one pixel to the right.
    pub duv_dx: Vec2,
    /// Change of the parameters over one pixel down.
    pub duv_dy: Vec2,
}

/// What an RGB value stands for, which decides the spectrum made of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SpectrumKind {
    /// A reflectance within `[0, 1]`.
    Albedo,
    /// Any non-negative quantity.
    Unbounded,
    /// An emission, relative to the colour space's illuminant.
    Illuminant,
}

impl SpectrumKind {
    /// The spectrum that an RGB value stands for, no component of which is negative.
    pub fn spectrum(self, space: &RgbColorSpace, rgb: [f32; 3], wavelengths: &Wavelengths) -> SampledSpectrum {
        let sigmoid = |rgb: [f32; 3]| space.sigmoid_table().lookup(rgb).sample(wavelengths);
        if self == Self::Albedo {
            return sigmoid(rgb.map(|v| v.clamp(0.0, 1.0)));
        }
        // Bright colours are a factor times one within the table, half way up so that the curve stays smooth.
        let scale = 2.0 * rgb[0].max(rgb[1]).max(rgb[2]);
        if scale <= 0.0 {
            return SampledSpectrum::ZERO;
        }
        let shape = sigmoid(rgb.map(|v| v / scale)) * scale;
        if self == Self::Illuminant { shape * space.illuminant().sample(wavelengths) } else { shape }
    }
}

/// An image of colours, as several textures may share it.
#[derive(Clone, Debug)]
pub struct SpectrumImage {
    /// The texels.
    pub pyramid: Arc<Pyramid<3>>,
    /// The colour space of the texels.
    pub color_space: &'static RgbColorSpace,
    /// What they stand for.
    pub kind: SpectrumKind,
}

/// Names a float texture in [`Textures`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct FloatTextureId(u32);

/// Names a spectrum texture in [`Textures`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SpectrumTextureId(u32);

/// How a checkerboard is laid out.
#[derive(Clone, Debug)]
pub enum Checkerboard {
    /// Over two texture coordinates, filtered.
    Flat(Mapping),
    /// Over space, by cells of unit size, unfiltered.
    Solid(Transform),
}

/// A float over a surface.
#[derive(Clone, Debug)]
pub enum FloatTexture {
    /// The same everywhere.
    Constant(f32),
    /// An image's channel.
    Image {
        /// Its texels.
        pyramid: Arc<Pyramid<1>>,
        /// Its layout.
        mapping: Mapping,
        /// Factor.
        scale: f32,
        /// Whether 1 − value is meant.
        invert: bool,
    },
    /// A product.
    Scale(FloatTextureId, FloatTextureId),
    /// `(1 − amount) · first + amount · second`.
    Mix {
        /// First and second.
        textures: [FloatTextureId; 2],
        /// Share of the second.
        amount: FloatTextureId,
    },
    /// Two textures by turns.
    Checkerboard {
        /// The pattern.
        board: Checkerboard,
        /// Both textures.
        textures: [FloatTextureId; 2],
    },
}

/// A spectrum over a surface.
#[derive(Clone, Debug)]
pub enum SpectrumTexture {
    /// The same everywhere.
    Constant(Spectrum),
    /// An image's colours.
    Image {
        /// Its texels.
        image: SpectrumImage,
        /// Its layout.
        mapping: Mapping,
        /// Factor.
        scale: f32,
        /// Whether 1 − value is meant.
        invert: bool,
    },
    /// A product with a float texture.
    Scale(SpectrumTextureId, FloatTextureId),
    /// `(1 − amount) · first + amount · second`.
    Mix {
        /// First and second.
        textures: [SpectrumTextureId; 2],
        /// Share of the second.
        amount: FloatTextureId,
    },
    /// Two textures by turns.
    Checkerboard {
        /// The pattern.
        board: Checkerboard,
        /// Both textures.
        textures: [SpectrumTextureId; 2],
    },
}

/// All the textures of a world; textures refer to each other by number, and only to earlier ones.
#[derive(Clone, Debug, Default)]
pub struct Textures {
    floats: Vec<FloatTexture>,
    spectra: Vec<SpectrumTexture>,
}

impl Textures {
    /// Adds a float texture.
    pub fn add_float(&mut self, texture: FloatTexture) -> FloatTextureId {
        self.floats.push(texture);
        FloatTextureId(self.floats.len() as u32 - 1)
    }

    /// Adds a spectrum texture.
    pub fn add_spectrum(&mut self, texture: SpectrumTexture) -> SpectrumTextureId {
        self.spectra.push(texture);
        SpectrumTextureId(self.spectra.len() as u32 - 1)
    }

    /// The texture itself.
    pub fn float_texture(&self, id: FloatTextureId) -> &FloatTexture {
        &self.floats[id.0 as usize]
    }

    /// The texture itself.
    #[inline(always)]
    pub fn spectrum_texture(&self, id: SpectrumTextureId) -> &SpectrumTexture {
        &self.spectra[id.0 as usize]
    }

    /// The value if it is the same everywhere.
    pub fn constant_float(&self, id: FloatTextureId) -> Option<f32> {
        match self.float_texture(id) {
            FloatTexture::Constant(value) => Some(*value),
            _ => None,
        }
    }

    /// True if no texture depends on its footprint or even on where it is looked up.
    pub fn all_constant(&self) -> bool {
        self.floats.iter().all(|t| matches!(t, FloatTexture::Constant(_)))
            && self.spectra.iter().all(|t| matches!(t, SpectrumTexture::Constant(_)))
    }

    /// Evaluates a float texture.
    pub fn float(&self, id: FloatTextureId, context: &SurfaceContext) -> f32 {
        match self.float_texture(id) {
            FloatTexture::Constant(value) => *value,
            FloatTexture::Image { pyramid, mapping, scale, invert } => {
                let [value] = pyramid.lookup(&image_coordinates(mapping, context));
                let value = value * scale;
                if *invert { (1.0 - value).max(0.0) } else { value }
            }
            FloatTexture::Scale(a, b) => {
                let factor = self.float(*b, context);
                if factor == 0.0 { 0.0 } else { self.float(*a, context) * factor }
            }
            FloatTexture::Mix { textures, amount } => blend(
                self.float(*amount, context),
                |i| self.float(textures[i], context),
                |a, b, t| a * (1.0 - t) + b * t,
            ),
            FloatTexture::Checkerboard { board, textures } => {
                blend(board.share(context), |i| self.float(textures[i], context), |a, b, t| a * (1.0 - t) + b * t)
            }
        }
    }

    /// The spectrum if it is the same everywhere.
    #[inline(always)]
    pub fn constant_spectrum(&self, id: SpectrumTextureId) -> Option<&Spectrum> {
        match self.spectrum_texture(id) {
            SpectrumTexture::Constant(spectrum) => Some(spectrum),
            _ => None,
        }
    }

    /// Evaluates a spectrum texture at a path's wavelengths.
    #[inline]
    pub fn spectrum(
        &self,
        id: SpectrumTextureId,
        context: &SurfaceContext,
        wavelengths: &Wavelengths,
    ) -> SampledSpectrum {
        match self.spectrum_texture(id) {
            SpectrumTexture::Constant(spectrum) => spectrum.sample(wavelengths),
            texture => self.varying_spectrum(texture, context, wavelengths),
        }
    }

    fn varying_spectrum(
        &self,
        texture: &SpectrumTexture,
        context: &SurfaceContext,
        wavelengths: &Wavelengths,
    ) -> SampledSpectrum {
        match texture {
            SpectrumTexture::Constant(spectrum) => spectrum.sample(wavelengths),
            SpectrumTexture::Image { image, mapping, scale, invert } => {
                let rgb = image.pyramid.lookup(&image_coordinates(mapping, context)).map(|v| {
                    let v = v * scale;
                    (if *invert { 1.0 - v } else { v }).max(0.0)
                });
                image.spectrum(rgb, wavelengths)
            }
            SpectrumTexture::Scale(texture, factor) => {
                let factor = self.float(*factor, context);
                if factor == 0.0 {
                    SampledSpectrum::ZERO
                } else {
                    self.spectrum(*texture, context, wavelengths) * factor
                }
            }
            SpectrumTexture::Mix { textures, amount } => blend(
                self.float(*amount, context),
                |i| self.spectrum(textures[i], context, wavelengths),
                SampledSpectrum::lerp,
            ),
            SpectrumTexture::Checkerboard { board, textures } => {
                blend(board.share(context), |i| self.spectrum(textures[i], context, wavelengths), SampledSpectrum::lerp)
            }
        }
    }
}

impl SpectrumImage {
    /// The spectrum that an RGB value of this image stands for.
    pub fn spectrum(&self, rgb: [f32; 3], wavelengths: &Wavelengths) -> SampledSpectrum {
        self.kind.spectrum(self.color_space, rgb, wavelengths)
    }
}

/// Coordinates of an image texture: its first row is at t = 1.
fn image_coordinates(mapping: &Mapping, context: &SurfaceContext) -> Coordinates {
    let mut at = mapping.map(context);
    at.st.y = 1.0 - at.st.y;
    at
}

/// Interpolates between two values, computing neither where its share is zero.
fn blend<T>(share: f32, value: impl Fn(usize) -> T, lerp: impl Fn(T, T, f32) -> T) -> T {
    if share <= 0.0 {
        value(0)
    } else if share >= 1.0 {
        value(1)
    } else {
        lerp(value(0), value(1), share)
    }
}

impl Checkerboard {
    /// The share of the second texture, between 0 and 1.
    fn share(&self, context: &SurfaceContext) -> f32 {
        match self {
            Self::Flat(mapping) => {
                let at = mapping.map(context);
                let radius = 1.5 * at.dx.abs().max(at.dy.abs());
                0.5 - 0.5 * square_wave(at.st.x, radius.x) * square_wave(at.st.y, radius.y)
            }
            Self::Solid(texture_from_world) => {
                let cell = texture_from_world.point(context.position).floor();
                if (cell.x + cell.y + cell.z).rem_euclid(2.0) == 0.0 { 0.0 } else { 1.0 }
            }
        }
    }
}

/// The square wave that is 1 on `[0, 1)`, −1 on `[1, 2)` and so on, under a tent filter of the given radius: the second
/// difference of the wave's second integral.
fn square_wave(x: f32, radius: f32) -> f32 {
    if (x - radius).floor() == (x + radius).floor() {
        return if x.floor().rem_euclid(2.0) == 0.0 { 1.0 } else { -1.0 };
    }
    // A pixel that covers many cells sees their mean; the difference below would lose all its digits.
    if radius > 64.0 {
        return 0.0;
    }
    // Differences are taken from the nearest even cell, where the integral is small.
    let x = x - 2.0 * (0.5 * x).floor();
    let integral = |x: f32| {
        let cell = 2.0 * (0.5 * x).floor();
        let phase = x - cell;
        // ∫∫ is periodic but for a line: each period of the integrated wave (a tent of height 1) adds an area of 1.
        let within = if phase < 1.0 { 0.5 * phase * phase } else { 1.0 - 0.5 * (2.0 - phase) * (2.0 - phase) };
        0.5 * cell + within
    };
    (integral(x + radius) - 2.0 * integral(x) + integral(x - radius)) / (radius * radius)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_filtered_square_wave_is_the_wave_under_a_tent() {
        let wave = |x: f32| if x.floor().rem_euclid(2.0) == 0.0 { 1.0f64 } else { -1.0 };
        for radius in [0.05, 0.3, 0.9, 1.7, 3.2] {
            for i in 0..40 {
                let x = -3.0 + i as f32 * 0.171;
                let n = 20_000;
                let expected: f64 = (0..n)
                    .map(|j| {
                        let t = 2.0 * (j as f32 + 0.5) / n as f32 - 1.0;
                        wave(x + t * radius) * f64::from(1.0 - t.abs()) * 2.0 / f64::from(n)
                    })
                    .sum();
                let found = square_wave(x, radius);
                assert!((f64::from(found) - expected).abs() < 2e-3, "x {x} radius {radius}: {found} {expected}");
            }
        }
    }

    #[test]
    fn scale_and_mix_combine() {
        let mut textures = Textures::default();
        let [two, half, zero] = [2.0, 0.5, 0.0].map(|v| textures.add_float(FloatTexture::Constant(v)));
        let scale = textures.add_float(FloatTexture::Scale(two, half));
        let mix = textures.add_float(FloatTexture::Mix { textures: [zero, two], amount: half });
        let context = SurfaceContext::default();
        assert_eq!((textures.float(scale, &context), textures.float(mix, &context)), (1.0, 1.0));
    }
}
