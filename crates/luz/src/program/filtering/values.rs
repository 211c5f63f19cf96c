//! Values on the command lines of the commands that filter.

use crate::program::values::OutputFile;
use clap::ValueEnum;
use luz::filter::{Border, Density, Distance, SampleCount, Scale, Strategy};
use luz::image::video::VideoKind;
use serde::Serialize;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// A width of the range Gaussian: above zero, perhaps infinite.
pub fn sigma_range(text: &str) -> Result<f32, String> {
    match text.trim().parse::<f32>() {
        Ok(value) if value > 0.0 => Ok(value),
        _ => Err("expected a number above zero, or inf".to_owned()),
    }
}

/// A factor that isn't negative.
pub fn strength(text: &str) -> Result<f32, String> {
    match text.trim().parse::<f32>() {
        Ok(value) if value.is_finite() && value >= 0.0 => Ok(value),
        _ => Err("expected a number from zero on".to_owned()),
    }
}

/// A file to be written: an image or a video, by its name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// An image.
    Image(OutputFile),
    /// A video, or numbered frames.
    Video(PathBuf),
}

impl Target {
    /// Where it is written; for numbered frames, their pattern.
    pub fn path(&self) -> &Path {
        match self {
            Self::Image(file) => &file.path,
            Self::Video(path) => path,
        }
    }
}

impl FromStr for Target {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        if VideoKind::from_path(Path::new(text)).is_some() {
            return Ok(Self::Video(PathBuf::from(text)));
        }
        let image = OutputFile::new(Path::new(text));
        image.map(Self::Image).map_err(|why| format!("{why}; of videos, {}", VideoKind::known_names()))
    }
}

/// `A-B`, or one number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameRange(pub RangeInclusive<u64>);

impl FromStr for FrameRange {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let (first, last) = text.split_once('-').unwrap_or((text, text));
        match (first.trim().parse(), last.trim().parse()) {
            (Ok(first), Ok(last)) if first <= last => Ok(Self(first..=last)),
            _ => Err("expected the first and the last frame, 10-50 say".to_owned()),
        }
    }
}

/// `k`, `2k`, `0.5k`, or a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Samples(pub SampleCount);

impl FromStr for Samples {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || "expected k, a multiple of it like 2k or 0.5k, or a number above zero".to_owned();
        let text = text.trim().to_lowercase();
        if let Some(factor) = text.strip_suffix('k') {
            let factor = if factor.is_empty() { Ok(1.0) } else { factor.trim_end_matches(['*', '·']).trim().parse() };
            return match factor {
                Ok(factor) if factor > 0.0 && factor <= 1e4 => Ok(Self(SampleCount::Windows(factor))),
                _ => Err(wrong()),
            };
        }
        match text.parse::<u32>() {
            Ok(count @ 1..) => Ok(Self(SampleCount::Count(count))),
            _ => Err(wrong()),
        }
    }
}

/// `0.5k` or `k`: a multiple of the window's width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Multiple(pub f32);

impl FromStr for Multiple {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        match text.parse::<Samples>()?.0 {
            SampleCount::Windows(multiple) => Ok(Self(multiple)),
            SampleCount::Count(_) => Err("expected a multiple of k: k, 2k or 0.5k".to_owned()),
        }
    }
}

/// `X,Y`
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pixel(pub [usize; 2]);

impl FromStr for Pixel {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Vec<usize> = text.split(',').filter_map(|part| part.trim().parse().ok()).collect();
        <[usize; 2]>::try_from(numbers).map(Self).map_err(|_| "expected a column and a row, 120,80 say".to_owned())
    }
}

/// `[FILE][@CHANNELS][=R]`
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GuideArgument {
    /// The file; none for the input itself.
    pub file: Option<PathBuf>,
    /// Channels or layers of it; the colour where there are none.
    pub channels: Vec<String>,
    /// Its σ_r; that of the command where there is none.
    pub sigma: Option<f32>,
}

impl FromStr for GuideArgument {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        // A file may be called a=b.png: only a number is a width.
        let (rest, sigma) = match text.rsplit_once('=') {
            Some((rest, value)) if value.trim().parse::<f32>().is_ok() => (rest, Some(sigma_range(value)?)),
            Some((_, value)) if !value.contains('.') => {
                return Err(format!("`{value}` is no σ_r: a number is expected"));
            }
            _ => (text, None),
        };
        let (file, channels) = rest.rsplit_once('@').unwrap_or((rest, ""));
        let channels: Vec<String> =
            channels.split(',').map(str::trim).filter(|c| !c.is_empty()).map(str::to_owned).collect();
        let file = (!file.is_empty()).then(|| PathBuf::from(file));
        if file.is_none() && channels.is_empty() {
            return Err("expected a file, @CHANNELS of the input, or both: flash.png=0.05, @Ns=0.2".to_owned());
        }
        Ok(Self { file, channels, sigma })
    }
}

/// Methods.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MethodName {
    /// The fastest of the others that reaches the quality
    Auto,
    /// All neighbours in the window: the reference
    Exact,
    /// A Monte Carlo estimate from some of them
    Sampled,
    /// Sums of cosines, at a cost that does not depend on the window: for guides of one channel
    Cosines,
}

/// Strategies of sampling.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum StrategyName {
    /// Independent points (Box and Muller)
    Random,
    /// One point in each cell of equal probability
    Stratified,
    /// A regular grid
    Grid,
    /// Points that keep their distance: blue noise
    PoissonDisk,
    /// Sobol's sequence, Owen-scrambled
    Sobol,
    /// A golden-angle spiral
    Vogel,
}

impl From<StrategyName> for Strategy {
    fn from(name: StrategyName) -> Self {
        match name {
            StrategyName::Random => Self::Random,
            StrategyName::Stratified => Self::Stratified,
            StrategyName::Grid => Self::Grid,
            StrategyName::PoissonDisk => Self::PoissonDisk,
            StrategyName::Sobol => Self::Sobol,
            StrategyName::Vogel => Self::Vogel,
        }
    }
}

/// Densities of samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DensityName {
    /// The spatial Gaussian itself
    Gaussian,
    /// Uniform over the window, weighted by the Gaussian
    Uniform,
}

impl From<DensityName> for Density {
    fn from(name: DensityName) -> Self {
        match name {
            DensityName::Gaussian => Self::Gaussian,
            DensityName::Uniform => Self::Uniform,
        }
    }
}

/// Distances of colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DistanceName {
    /// The root of the sum of squares over all channels
    L2,
    /// The sum of absolute differences
    L1,
    /// The colour difference of CIELAB; about 2.3 is just noticeable
    DeltaE,
}

impl From<DistanceName> for Distance {
    fn from(name: DistanceName) -> Self {
        match name {
            DistanceName::L2 => Self::L2,
            DistanceName::L1 => Self::L1,
            DistanceName::DeltaE => Self::DeltaE,
        }
    }
}

/// Scales of values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ScaleName {
    /// Proportional to light
    Linear,
    /// As seen: the file's own encoding, or sRGB's
    Encoded,
    /// The natural logarithm: differences are ratios
    Log,
}

impl From<ScaleName> for Scale {
    fn from(name: ScaleName) -> Self {
        match name {
            ScaleName::Linear => Self::Linear,
            ScaleName::Encoded => Self::Encoded,
            ScaleName::Log => Self::Log,
        }
    }
}

/// What lies beyond the edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BorderName {
    /// The image, mirrored
    Mirror,
    /// The outermost pixels again and again
    Clamp,
    /// Nothing: the weights of what is inside are normalised
    Renormalize,
}

impl From<BorderName> for Border {
    fn from(name: BorderName) -> Self {
        match name {
            BorderName::Mirror => Self::Mirror,
            BorderName::Clamp => Self::Clamp,
            BorderName::Renormalize => Self::Renormalize,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sample_counts() {
        let parse = |text: &str| text.parse::<Samples>().map(|s| s.0);
        assert_eq!(parse("k"), Ok(SampleCount::Windows(1.0)));
        assert_eq!(parse("2k"), Ok(SampleCount::Windows(2.0)));
        assert_eq!(parse("0.5K"), Ok(SampleCount::Windows(0.5)));
        assert_eq!(parse("64"), Ok(SampleCount::Count(64)));
        for wrong in ["", "0", "-3", "0k", "-1k", "nank", "infk", "kk", "1.5", "99999999999"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn guides() {
        let parse = |text: &str| text.parse::<GuideArgument>();
        let guide = |file: Option<&str>, channels: &[&str], sigma| {
            let channels = channels.iter().map(|c| (*c).to_owned()).collect();
            Ok(GuideArgument { file: file.map(PathBuf::from), channels, sigma })
        };
        assert_eq!(parse("a.png"), guide(Some("a.png"), &[], None));
        assert_eq!(parse("a.png=0.1"), guide(Some("a.png"), &[], Some(0.1)));
        assert_eq!(parse("a=b.png"), guide(Some("a=b.png"), &[], None));
        assert_eq!(parse("@Ns,Z=inf"), guide(None, &["Ns", "Z"], Some(f32::INFINITY)));
        assert_eq!(parse("r.exr@Albedo"), guide(Some("r.exr"), &["Albedo"], None));
        for wrong in ["", "=0.1", "a.png=0", "a.png=-1", "a.png=nan", "a.png=x", "@"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn ranges_of_frames() {
        assert_eq!("3-7".parse(), Ok(FrameRange(3..=7)));
        assert_eq!("5".parse(), Ok(FrameRange(5..=5)));
        for wrong in ["", "7-3", "a-b", "-", "1-", "-2"] {
            assert!(wrong.parse::<FrameRange>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn targets() {
        assert!(matches!("a.png".parse(), Ok(Target::Image(_))));
        assert!(matches!("a.y4m".parse(), Ok(Target::Video(_))));
        assert!(matches!("a_%03d.png".parse(), Ok(Target::Video(_))));
        let said = "a.xyz".parse::<Target>().unwrap_err();
        assert!(said.contains("xyz") && said.contains("png") && said.contains("y4m"), "{said}");
    }
}
