//! RGB colour spaces: primaries, white, and the way to XYZ and to spectra.

use std::sync::{Arc, OnceLock};

use glam::{DMat3, DVec3, Mat3, Vec3};

use crate::sigmoid_fit::SigmoidFitter;
use crate::{DenseSpectrum, SigmoidPolynomial, SigmoidTable, Spectrum, named_spectrum, spectrum_to_xyz};

/// An RGB colour space with linear components: `[1, 1, 1]` is its white.
#[derive(Debug)]
pub struct RgbColorSpace {
    name: &'static str,
    primaries: [[f32; 2]; 3],
    white: [f32; 2],
    illuminant: Arc<DenseSpectrum>,
    xyz_from_rgb: DMat3,
    rgb_from_xyz: DMat3,
    fitter: SigmoidFitter,
    table: OnceLock<SigmoidTable>,
}

impl RgbColorSpace {
    /// sRGB: the primaries of ITU-R BT.709 with the white D65.
    pub fn srgb() -> &'static Self {
        static SPACE: OnceLock<RgbColorSpace> = OnceLock::new();
        SPACE.get_or_init(|| Self::new("srgb", [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]], "stdillum-D65"))
    }

    /// DCI-P3 with the white D65 (Display P3).
    pub fn dci_p3() -> &'static Self {
        static SPACE: OnceLock<RgbColorSpace> = OnceLock::new();
        SPACE.get_or_init(|| Self::new("dci-p3", [[0.68, 0.32], [0.265, 0.690], [0.15, 0.06]], "stdillum-D65"))
    }

    /// ITU-R BT.2020 with the white D65.
    pub fn rec2020() -> &'static Self {
        static SPACE: OnceLock<RgbColorSpace> = OnceLock::new();
        SPACE.get_or_init(|| Self::new("rec2020", [[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]], "stdillum-D65"))
    }

    /// ACES2065-1 (SMPTE ST 2065-1, "AP0") with its white of about 6000 K.
    pub fn aces2065_1() -> &'static Self {
        static SPACE: OnceLock<RgbColorSpace> = OnceLock::new();
        SPACE.get_or_init(|| Self::new("aces2065-1", [[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.077]], "illum-acesD60"))
    }

    /// The space of a name, in any case: one of [`RgbColorSpace::NAMES`].
    pub fn named(name: &str) -> Option<&'static Self> {
        match name.to_ascii_lowercase().as_str() {
            "srgb" => Some(Self::srgb()),
            "dci-p3" => Some(Self::dci_p3()),
            "rec2020" => Some(Self::rec2020()),
            "aces2065-1" => Some(Self::aces2065_1()),
            _ => None,
        }
    }

    /// The names that [`RgbColorSpace::named`] knows.
    pub const NAMES: [&'static str; 4] = ["srgb", "dci-p3", "rec2020", "aces2065-1"];

    /// The space with these chromaticities of red, green, blue and white, each within 0.1 %, as image files state them.
    pub fn from_chromaticities(primaries: [[f32; 2]; 3], white: [f32; 2]) -> Option<&'static Self> {
        let close = |a: [f32; 2], b: [f32; 2]| (0..2).all(|i| (a[i] - b[i]).abs() <= 1e-3 * b[i].abs().max(0.1));
        Self::NAMES
            .iter()
            .filter_map(|name| Self::named(name))
            .find(|space| (0..3).all(|i| close(primaries[i], space.primaries[i])) && close(white, space.white))
    }

    fn new(name: &'static str, primaries: [[f32; 2]; 3], illuminant: &str) -> Self {
        // The names passed above are in the tables (tested).
        let illuminant = named_spectrum(illuminant).unwrap_or(Spectrum::Constant(1.0));
        let dense = Arc::new(illuminant.to_dense());
        let white = DVec3::from(spectrum_to_xyz(&illuminant).map(f64::from));
        // The primaries' luminances are those that add up to white.
        let directions = DMat3::from_cols_array_2d(&primaries.map(|[x, y]| {
            let (x, y) = (f64::from(x), f64::from(y));
            [x, y, 1.0 - x - y]
        }));
        let xyz_from_rgb = directions * DMat3::from_diagonal(directions.inverse() * white);
        let rgb_from_xyz = xyz_from_rgb.inverse();
        Self {
            name,
            primaries,
            white: chromaticity(white.as_vec3().to_array()),
            fitter: SigmoidFitter::new(&dense, xyz_from_rgb),
            illuminant: dense,
            xyz_from_rgb,
            rgb_from_xyz,
            table: OnceLock::new(),
        }
    }

    /// The name, one of [`RgbColorSpace::NAMES`].
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// The CIE 1931 chromaticities (x, y) of red, green and blue.
    pub fn primaries(&self) -> [[f32; 2]; 3] {
        self.primaries
    }

    /// The CIE 1931 chromaticity (x, y) of white.
    pub fn white(&self) -> [f32; 2] {
        self.white
    }

    /// The spectrum of white, with luminance Y = 1 (∫ ȳ s dλ = [`crate::CIE_Y_INTEGRAL`]).
    pub fn illuminant(&self) -> &Arc<DenseSpectrum> {
        &self.illuminant
    }

    /// The matrix from linear RGB to XYZ, with Y = 1 for white.
    pub fn xyz_from_rgb(&self) -> Mat3 {
        self.xyz_from_rgb.as_mat3()
    }

    /// The matrix from XYZ to linear RGB.
    pub fn rgb_from_xyz(&self) -> Mat3 {
        self.rgb_from_xyz.as_mat3()
    }

    /// XYZ of a linear RGB colour.
    pub fn to_xyz(&self, rgb: [f32; 3]) -> [f32; 3] {
        (self.xyz_from_rgb() * Vec3::from(rgb)).to_array()
    }

    /// The linear RGB colour of XYZ.
    pub fn from_xyz(&self, xyz: [f32; 3]) -> [f32; 3] {
        (self.rgb_from_xyz() * Vec3::from(xyz)).to_array()
    }

    /// The luminance Y of a linear RGB colour.
    pub fn luminance(&self, rgb: [f32; 3]) -> f32 {
        self.to_xyz(rgb)[1]
    }

    /// The matrix from this space's linear RGB to that of `target`, without chromatic adaptation.
    pub fn conversion_to(&self, target: &Self) -> Mat3 {
        if std::ptr::eq(self, target) {
            return Mat3::IDENTITY;
        }
        (target.rgb_from_xyz * self.xyz_from_rgb).as_mat3()
    }

    /// The reflectance spectrum of an RGB colour: under this space's illuminant it has exactly that colour, where any
    /// reflectance has. Components are clamped to `[0, 1]`; grey gives an exact constant.
    ///
    /// Solves the fitting problem (some 30 µs): for constants of a scene. For textures, use
    /// [`RgbColorSpace::sigmoid_table`].
    pub fn to_sigmoid(&self, rgb: [f32; 3]) -> SigmoidPolynomial {
        self.fitter.fit(rgb)
    }

    /// The table that approximates [`RgbColorSpace::to_sigmoid`] fast, within about 0.0002 of RGB. The first call computes it.
    pub fn sigmoid_table(&self) -> &SigmoidTable {
        self.table.get_or_init(|| SigmoidTable::new(&self.fitter))
    }
}

/// The chromaticity (x, y) of an XYZ triple; that of equal energy for black.
pub(crate) fn chromaticity(xyz: [f32; 3]) -> [f32; 2] {
    let sum = xyz[0] + xyz[1] + xyz[2];
    if sum == 0.0 { [1.0 / 3.0; 2] } else { [xyz[0] / sum, xyz[1] / sum] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_matrix_is_the_published_one() {
        let expected =
            [[0.4124564, 0.2126729, 0.0193339], [0.3575761, 0.7151522, 0.1191920], [0.1804375, 0.0721750, 0.9503041]];
        let columns = RgbColorSpace::srgb().xyz_from_rgb().to_cols_array_2d();
        for (column, expected) in columns.iter().zip(expected) {
            for (a, b) in column.iter().zip(expected) {
                assert!((a - b).abs() < 2e-4, "{columns:?}");
            }
        }
    }

    #[test]
    fn whites_have_their_published_chromaticities() {
        let white = RgbColorSpace::srgb().white();
        assert!((white[0] - 0.3127).abs() < 1e-4 && (white[1] - 0.3290).abs() < 1e-4, "{white:?}");
        let white = RgbColorSpace::aces2065_1().white();
        assert!((white[0] - 0.32168).abs() < 1e-4 && (white[1] - 0.33767).abs() < 1e-4, "{white:?}");
    }

    #[test]
    fn matrices_invert_and_white_is_one() {
        for name in RgbColorSpace::NAMES {
            let space = RgbColorSpace::named(name).unwrap();
            assert_eq!(space.name(), name);
            let rgb = space.from_xyz(spectrum_to_xyz(&Spectrum::Dense(space.illuminant().clone())));
            assert!(rgb.iter().all(|c| (c - 1.0).abs() < 1e-5), "{name}: {rgb:?}");
            let rgb = space.from_xyz(space.to_xyz([0.2, 0.5, 0.9]));
            assert!((rgb[0] - 0.2).abs() + (rgb[1] - 0.5).abs() + (rgb[2] - 0.9).abs() < 1e-5);
            let found = RgbColorSpace::from_chromaticities(space.primaries(), space.white()).unwrap();
            assert!(std::ptr::eq(found, space));
        }
        assert!(RgbColorSpace::named("sRGB").is_some() && RgbColorSpace::named("cmyk").is_none());
    }

    #[test]
    fn conversion_keeps_the_colour() {
        let (a, b) = (RgbColorSpace::srgb(), RgbColorSpace::rec2020());
        let rgb = [0.1, 0.7, 0.3];
        let xyz = b.to_xyz((a.conversion_to(b) * Vec3::from(rgb)).to_array());
        assert!((0..3).all(|i| (xyz[i] - a.to_xyz(rgb)[i]).abs() < 1e-6));
    }
}
