//! Values on the command line, and what they stand for.

use clap::ValueEnum;
use glam::Vec2;
use luz::geometry::SimdLevel;
use luz::image::metrics::ErrorMeasure;
use luz::image::{Format, ToneOperator};
use luz::render::Crop;
use luz::render::film::{FilmKind, Filter, FilterKind};
use luz::render::integrator::IntegratorKind;
use luz::sample::SamplerKind;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Frames wider or higher than this are taken for a slip of the keyboard.
const MAX_RESOLUTION: u32 = 1 << 16;

/// A number that is neither infinite nor NaN.
pub fn finite(text: &str) -> Result<f32, String> {
    match text.trim().parse::<f32>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err("expected a number".to_owned()),
    }
}

/// A number above zero.
pub fn positive_f64(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("expected a number above zero".to_owned()),
    }
}

/// A number above zero.
pub fn positive(text: &str) -> Result<f32, String> {
    finite(text).ok().filter(|v| *v > 0.0).ok_or_else(|| "expected a number above zero".to_owned())
}

/// A share above zero: `0.02` or `2%`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Share(pub f64);

impl FromStr for Share {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let (number, unit) = match text.trim().strip_suffix('%') {
            Some(number) => (number, 0.01),
            None => (text, 1.0),
        };
        let share = positive_f64(number).map_err(|_| "expected a share above zero, 2% or 0.02 say".to_owned())?;
        Ok(Self(share * unit))
    }
}

/// `WxH`, both positive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Resolution(pub [u32; 2]);

impl FromStr for Resolution {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let (width, height) = text.split_once(['x', 'X', '×', ',']).ok_or("expected WxH, 640x480 say")?;
        let size = |side: &str| match side.trim().parse::<u32>() {
            Ok(size @ 1..=MAX_RESOLUTION) => Ok(size),
            _ => Err(format!("`{}` is not a size between 1 and {MAX_RESOLUTION} pixels", side.trim())),
        };
        Ok(Self([size(width)?, size(height)?]))
    }
}

impl fmt::Display for Resolution {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.0[0], self.0[1])
    }
}

/// `x0,x1,y0,y1` in fractions of the frame or in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CropArgument(pub Crop);

impl FromStr for CropArgument {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let (text, is_pixels) = match text.strip_suffix("px") {
            Some(rest) => (rest, true),
            None => (text, false),
        };
        let numbers: Vec<f32> = text
            .split([',', ' '])
            .filter(|part| !part.is_empty())
            .map(|part| finite(part).map_err(|_| format!("`{part}` is not a number")))
            .collect::<Result<_, _>>()?;
        let window = <[f32; 4]>::try_from(numbers)
            .map_err(|numbers| format!("expected four numbers x0,x1,y0,y1, not {}", numbers.len()))?;
        if window.iter().any(|v| *v < 0.0) {
            return Err("a crop window has no negative corners".to_owned());
        }
        let [x0, x1, y0, y1] = window;
        if x0 >= x1 || y0 >= y1 {
            return Err(
                "the crop window is empty: x0 < x1 and y0 < y1 are expected, in the order x0,x1,y0,y1".to_owned()
            );
        }
        if !is_pixels && window.iter().all(|v| *v <= 1.0) {
            return Ok(Self(Crop::Fraction(window)));
        }
        if window.iter().any(|v| v.fract() != 0.0 || *v > MAX_RESOLUTION as f32) {
            return Err("fractions lie within 0 and 1, pixels are whole numbers".to_owned());
        }
        Ok(Self(Crop::Pixels(window.map(|v| v as u32))))
    }
}

impl fmt::Display for CropArgument {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Crop::Fraction([x0, x1, y0, y1]) => write!(f, "{x0},{x1},{y0},{y1}"),
            Crop::Pixels([x0, x1, y0, y1]) => write!(f, "{x0},{x1},{y0},{y1}px"),
        }
    }
}

/// A file to be written, with the format that its extension says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutputFile {
    /// Where.
    pub path: PathBuf,
    /// How.
    pub format: Format,
}

impl OutputFile {
    /// A file whose extension says its format.
    pub fn new(path: &Path) -> Result<Self, String> {
        let format = Format::from_path(path).ok_or_else(|| {
            let known = "known are exr, pfm, hdr, png, jpg, tiff, bmp and tga";
            match path.extension() {
                Some(extension) => format!("no format is called `{}`; {known}", extension.display()),
                None => format!("the extension chooses the format; {known}"),
            }
        })?;
        Ok(Self { path: path.to_owned(), format })
    }
}

impl FromStr for OutputFile {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        Self::new(Path::new(text))
    }
}

/// What [`Threshold`] limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// Mean squared error.
    Mse,
    /// Mean relative squared error.
    RelMse,
    /// Mean absolute error.
    Mae,
    /// Peak signal-to-noise ratio.
    Psnr,
    /// Structural similarity.
    Ssim,
    /// The significance of the z-tests of all pixels together.
    ZTest,
    /// The significance of the z-tests of all tiles together.
    TileZTest,
}

impl Metric {
    const ALL: [(&'static str, Self); 7] = [
        ("mse", Self::Mse),
        ("relmse", Self::RelMse),
        ("mae", Self::Mae),
        ("psnr", Self::Psnr),
        ("ssim", Self::Ssim),
        ("z-test", Self::ZTest),
        ("tile-z-test", Self::TileZTest),
    ];
}

impl fmt::Display for Metric {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = Self::ALL.iter().find(|(_, metric)| metric == self).map_or("", |(name, _)| name);
        f.write_str(name)
    }
}

/// `METRIC=VALUE`
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Threshold {
    /// What is limited.
    pub metric: Metric,
    /// By what.
    pub value: f64,
}

impl FromStr for Threshold {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let (name, value) = text.split_once('=').ok_or("expected METRIC=VALUE, relmse=0.001 say")?;
        let name = name.trim().to_lowercase();
        let metric = Metric::ALL.iter().find(|(known, _)| *known == name).map(|(_, metric)| *metric);
        let metric = metric.ok_or_else(|| {
            let names: Vec<&str> = Metric::ALL.iter().map(|(name, _)| *name).collect();
            format!("no metric is called `{name}`; known are {}", names.join(", "))
        })?;
        match value.trim().parse::<f64>() {
            Ok(value) if matches!(metric, Metric::ZTest | Metric::TileZTest) && !(value > 0.0 && value < 1.0) => {
                Err("a significance lies within 0 and 1, exclusively".to_owned())
            }
            Ok(value) if value.is_finite() => Ok(Self { metric, value }),
            _ => Err(format!("`{}` is not a number", value.trim())),
        }
    }
}

/// What an error map shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ErrorName {
    /// |image − reference|
    Absolute,
    /// (image − reference)²
    Squared,
    /// |image − reference| / √(reference² + 0.01)
    Relative,
}

impl From<ErrorName> for ErrorMeasure {
    fn from(name: ErrorName) -> Self {
        match name {
            ErrorName::Absolute => Self::Absolute,
            ErrorName::Squared => Self::Squared,
            ErrorName::Relative => Self::Relative,
        }
    }
}

/// Integrators by their names on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum IntegratorName {
    /// Path tracing with next-event estimation and multiple importance sampling
    Path,
    /// The same; there are no volumes yet
    Volpath,
    /// Light tracing: paths from the lights, connected to the camera
    Light,
    /// Bidirectional path tracing
    Bdpt,
    /// Primary-space Metropolis light transport (Kelemen et al.)
    Pssmlt,
    /// Multiplexed Metropolis light transport (Hachisuka et al.), which pbrt-v4 calls mlt
    Mmlt,
    /// Path-space Metropolis light transport (Veach and Guibas)
    Mlt,
}

impl From<IntegratorName> for IntegratorKind {
    fn from(name: IntegratorName) -> Self {
        match name {
            IntegratorName::Path | IntegratorName::Volpath => Self::Path,
            IntegratorName::Light => Self::Light,
            IntegratorName::Bdpt => Self::Bidirectional,
            IntegratorName::Pssmlt => Self::PrimarySpace,
            IntegratorName::Mmlt => Self::Multiplexed,
            IntegratorName::Mlt => Self::PathSpace,
        }
    }
}

/// Samplers by their names in scene files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SamplerName {
    /// Independent random numbers
    Independent,
    /// Jittered strata, dimension by dimension
    Stratified,
    /// Halton's sequence, scrambled
    Halton,
    /// Sobol's sequence, Owen-scrambled
    #[value(alias = "paddedsobol")]
    Sobol,
    /// Sobol's sequence in Z-order: blue noise over the picture
    Zsobol,
}

impl From<SamplerName> for SamplerKind {
    fn from(name: SamplerName) -> Self {
        match name {
            SamplerName::Independent => Self::Independent,
            SamplerName::Stratified => Self::Stratified,
            SamplerName::Halton => Self::Halton,
            SamplerName::Sobol => Self::Sobol,
            SamplerName::Zsobol => Self::ZSobol,
        }
    }
}

/// The name of a sampler in scene files.
pub fn sampler_name(kind: SamplerKind) -> &'static str {
    match kind {
        SamplerKind::Independent => "independent",
        SamplerKind::Stratified => "stratified",
        SamplerKind::Halton => "halton",
        SamplerKind::Sobol => "sobol",
        SamplerKind::ZSobol => "zsobol",
    }
}

/// Pixel filters by their names in scene files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FilterName {
    /// A constant over the pixel
    Box,
    /// A tent of radius 2
    Triangle,
    /// A Gaussian of standard deviation 0.5, of radius 1.5
    Gaussian,
    /// Mitchell and Netravali's, of radius 2
    Mitchell,
    /// A windowed sinc of radius 4
    Sinc,
}

impl From<FilterName> for Filter {
    fn from(name: FilterName) -> Self {
        let (kind, radius) = match name {
            FilterName::Box => return Self::unit_box(),
            FilterName::Triangle => (FilterKind::Triangle, 2.0),
            FilterName::Gaussian => (FilterKind::Gaussian { sigma: 0.5 }, 1.5),
            FilterName::Mitchell => (FilterKind::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 }, 2.0),
            FilterName::Sinc => (FilterKind::LanczosSinc { tau: 3.0 }, 4.0),
        };
        Self::new(kind, Vec2::splat(radius))
    }
}

/// Films by their names in scene files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FilmName {
    /// Colour and its variance
    Rgb,
    /// Albedo, normals, position and depth as well
    Gbuffer,
}

impl From<FilmName> for FilmKind {
    fn from(name: FilmName) -> Self {
        match name {
            FilmName::Rgb => Self::Rgb,
            FilmName::Gbuffer => Self::GBuffer,
        }
    }
}

/// The name of a film in scene files.
pub fn film_name(kind: FilmKind) -> &'static str {
    match kind {
        FilmKind::Rgb => "rgb",
        FilmKind::GBuffer => "gbuffer",
    }
}

/// Tone mapping operators.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ToneMapName {
    /// It becomes white: exact below, as for comparing pictures
    Clip,
    /// Compressed by Reinhard's curve, hues kept
    Reinhard,
    /// Compressed by a film-like curve
    Filmic,
}

impl From<ToneMapName> for ToneOperator {
    fn from(name: ToneMapName) -> Self {
        match name {
            ToneMapName::Clip => Self::Clip,
            ToneMapName::Reinhard => Self::Reinhard { white: 4.0 },
            ToneMapName::Filmic => Self::Filmic,
        }
    }
}

/// Instruction sets of ray traversal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SimdName {
    /// The fastest that the machine has
    Auto,
    /// Portable code
    Scalar,
    /// AVX2 and FMA
    Avx2,
    /// AVX-512
    Avx512,
}

impl From<SimdName> for SimdLevel {
    fn from(name: SimdName) -> Self {
        match name {
            SimdName::Auto => Self::Auto,
            SimdName::Scalar => Self::Scalar,
            SimdName::Avx2 => Self::Avx2,
            SimdName::Avx512 => Self::Avx512,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resolutions() {
        assert_eq!("640x360".parse(), Ok(Resolution([640, 360])));
        for wrong in ["640", "0x4", "-1x4", "4x", "99999999999x1", "70000x1", "axb"] {
            assert!(wrong.parse::<Resolution>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn crops_are_fractions_unless_a_number_exceeds_one() {
        let crop = |text: &str| text.parse::<CropArgument>().map(|c| c.0);
        assert_eq!(crop("0,1,0,1"), Ok(Crop::Fraction([0.0, 1.0, 0.0, 1.0])));
        assert_eq!(crop("0.25,0.75,0,.5"), Ok(Crop::Fraction([0.25, 0.75, 0.0, 0.5])));
        assert_eq!(crop("10,20,0,5"), Ok(Crop::Pixels([10, 20, 0, 5])));
        assert_eq!(crop("0,1,0,1px"), Ok(Crop::Pixels([0, 1, 0, 1])));
        for wrong in ["0,1,0", "1,0,0,1", "0,1.5,0,1", "-1,1,0,1", "a,b,c,d", "nan,1,0,1", "", "0,1,0,1,2"] {
            assert!(crop(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn thresholds() {
        assert_eq!("relMSE=1e-3".parse(), Ok(Threshold { metric: Metric::RelMse, value: 1e-3 }));
        for wrong in ["relmse", "relmse=", "foo=1", "mse=nan", "z-test=0", "z-test=1.5"] {
            assert!(wrong.parse::<Threshold>().is_err(), "{wrong}");
        }
    }
}
