//! Times, samples and outputs on the command line.

use super::values::OutputFile;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

/// `X,Y`: a pixel of the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelName(pub [u32; 2]);

impl FromStr for PixelName {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        whole_numbers(text).map(Self).ok_or_else(|| "expected X,Y: 200,150 say".to_owned())
    }
}

/// `X,Y,SAMPLE`: a sample of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleName {
    /// The pixel.
    pub pixel: [u32; 2],
    /// The number of the sample.
    pub sample: u32,
}

impl FromStr for SampleName {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let [x, y, sample] = whole_numbers(text).ok_or("expected X,Y,SAMPLE: 200,150,3 say")?;
        Ok(Self { pixel: [x, y], sample })
    }
}

fn whole_numbers<const N: usize>(text: &str) -> Option<[u32; N]> {
    let numbers: Vec<u32> = text.split(',').map(|part| part.trim().parse().ok()).collect::<Option<_>>()?;
    numbers.try_into().ok()
}

/// A time: `90s`, `10m`, `1h30m`, `1.5h`; without a unit, seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Period(pub Duration);

impl FromStr for Period {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let error = || format!("`{text}` is no time above zero: expected 90s, 10m, 1h30m, say");
        let mut seconds = 0.0;
        let mut rest = text.trim();
        while !rest.is_empty() {
            let (number, behind) = rest.split_at(number_length(rest));
            let behind = behind.trim_start();
            let unit_length = behind.find(|c: char| !c.is_alphabetic()).unwrap_or(behind.len());
            let (unit, behind) = behind.split_at(unit_length);
            let factor = match unit {
                "" | "s" | "sec" => 1.0,
                "ms" => 1e-3,
                "m" | "min" => 60.0,
                "h" => 3600.0,
                "d" => 86400.0,
                _ => return Err(format!("`{unit}` is no unit of time; known are ms, s, m or min, h, and d")),
            };
            seconds += factor * number.parse::<f64>().map_err(|_| error())?;
            rest = behind.trim_start();
        }
        let period = Duration::try_from_secs_f64(seconds).map_err(|_| error())?;
        if period.is_zero() { Err(error()) } else { Ok(Self(period)) }
    }
}

/// The length of the number that a text begins with: digits, a point, and an exponent.
fn number_length(text: &str) -> usize {
    let digits = |text: &str| text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let mantissa = digits(text);
    let Some(exponent) = text[mantissa..].strip_prefix(['e', 'E']) else { return mantissa };
    let unsigned = exponent.strip_prefix(['+', '-']).unwrap_or(exponent);
    match digits(unsigned) {
        0 => mantissa,
        length => text.len() - unsigned.len() + length,
    }
}

/// What a render writes: pictures, or itself at rest.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RenderOutput {
    /// A picture.
    Image(OutputFile),
    /// A checkpoint.
    Checkpoint(PathBuf),
}

impl RenderOutput {
    /// Where.
    pub fn path(&self) -> &Path {
        match self {
            Self::Image(file) => &file.path,
            Self::Checkpoint(path) => path,
        }
    }
}

impl FromStr for RenderOutput {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let path = Path::new(text);
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("luz")) {
            return Ok(Self::Checkpoint(path.to_owned()));
        }
        OutputFile::new(path).map(Self::Image).map_err(|error| format!("{error}; luz is a checkpoint"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_add_up() {
        let seconds = |text: &str| text.parse::<Period>().map(|period| period.0.as_secs_f64());
        for (text, expected) in
            [("90s", 90.0), ("1h30m", 5400.0), ("1h 30m 5", 5405.0), ("2e1", 20.0), ("1.5 h", 5400.0)]
        {
            assert_eq!(seconds(text), Ok(expected), "{text}");
        }
        for wrong in ["", "0s", "h", "1x", "1h-2m", "1e", "-1s"] {
            assert!(seconds(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn samples_have_three_numbers() {
        assert_eq!("1, 2,3".parse(), Ok(SampleName { pixel: [1, 2], sample: 3 }));
        for wrong in ["", "1,2", "1,2,3,4", "1,2,x", "-1,2,3"] {
            assert!(wrong.parse::<SampleName>().is_err(), "{wrong}");
        }
    }
}
