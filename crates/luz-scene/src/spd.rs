//! Tabulated spectra: `.spd` files of wavelengths and values.

use crate::file;
use crate::pbrt::{is_number_delimiter, parse_number};
use std::path::Path;
use std::sync::Arc;

/// Why a list of numbers isn't a spectrum, or a file not one of them.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SpectrumError {
    /// The file could not be read.
    #[error("{0}")]
    Unreadable(String),
    /// Something in the file isn't a number.
    #[error("line {line}: `{token}` is not a number")]
    NotANumber {
        /// Line, from 1.
        line: usize,
        /// What stands there.
        token: String,
    },
    /// There are no numbers.
    #[error("it has no samples")]
    Empty,
    /// A wavelength without a value.
    #[error("{0} numbers are not pairs of wavelength and value")]
    Odd(usize),
    /// Wavelengths do not increase.
    #[error("wavelengths must increase, but {next} nm comes after {previous} nm")]
    NotIncreasing {
        /// A wavelength.
        previous: f32,
        /// The one behind it.
        next: f32,
    },
}

/// The biggest spectrum file, in bytes.
const MAX_BYTES: u64 = 64 << 20;

/// Pairs of wavelength (nm, strictly increasing) and value out of a flat list.
///
/// # Errors
/// [`SpectrumError::Empty`], [`SpectrumError::Odd`], [`SpectrumError::NotIncreasing`].
pub fn samples(values: &[f32]) -> Result<Arc<[(f32, f32)]>, SpectrumError> {
    if values.is_empty() {
        return Err(SpectrumError::Empty);
    }
    if !values.len().is_multiple_of(2) {
        return Err(SpectrumError::Odd(values.len()));
    }
    let pairs: Arc<[(f32, f32)]> = values.chunks_exact(2).map(|pair| (pair[0], pair[1])).collect();
    match pairs.windows(2).find(|pair| pair[1].0 <= pair[0].0) {
        Some(pair) => Err(SpectrumError::NotIncreasing { previous: pair[0].0, next: pair[1].0 }),
        None => Ok(pairs),
    }
}

/// Reads a spectrum from text: numbers separated by white space (or commas), `#` to the end of the line is a comment.
///
/// # Errors
/// Those of [`samples`], [`SpectrumError::NotANumber`].
pub fn parse(text: &[u8]) -> Result<Arc<[(f32, f32)]>, SpectrumError> {
    let mut values = Vec::new();
    for (index, line) in text.split(|b| *b == b'\n').enumerate() {
        let line = line.split(|b| *b == b'#').next().unwrap_or_default();
        let tokens = line.split(|b| is_number_delimiter(*b) || *b == b',').filter(|token| !token.is_empty());
        for token in tokens {
            let value = parse_number(token).ok_or_else(|| SpectrumError::NotANumber {
                line: index + 1,
                token: String::from_utf8_lossy(token).chars().take(40).collect(),
            })?;
            values.push(value);
        }
    }
    samples(&values)
}

/// Reads an `.spd` file (gzip'd or not).
///
/// # Errors
/// Those of [`parse`], [`SpectrumError::Unreadable`].
pub fn read(path: &Path) -> Result<Arc<[(f32, f32)]>, SpectrumError> {
    let bytes = file::read_bytes(path, MAX_BYTES).map_err(|e| SpectrumError::Unreadable(file::explain(&e)))?;
    parse(&bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_with_comments() {
        let text = b"# wavelength value\n400 0.5\r\n500\t1e-1 # green\n\n600, -2";
        assert_eq!(&*parse(text).unwrap(), &[(400.0, 0.5), (500.0, 0.1), (600.0, -2.0)]);
    }

    #[test]
    fn what_is_wrong_is_said() {
        let message = |text: &str| parse(text.as_bytes()).unwrap_err().to_string();
        assert_eq!(message(" # nothing"), "it has no samples");
        assert_eq!(message("400 1 500"), "3 numbers are not pairs of wavelength and value");
        assert_eq!(message("500 1 400 2"), "wavelengths must increase, but 400 nm comes after 500 nm");
        assert_eq!(message("400 1\n500 nan"), "line 2: `nan` is not a number");
        assert_eq!(message("400 1e99"), "line 1: `1e99` is not a number");
        assert_eq!(read(Path::new("/nowhere/a.spd")).unwrap_err().to_string(), "no such file");
    }
}
