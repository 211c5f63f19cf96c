//! Image files with numbers in their names.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use super::VideoError;
use crate::Format;

/// A name with a place for a number, as `frames/frame_%04d.png`: `%d` stands for the number, `%04d` for the number with zeros
/// before it up to four digits, `%%` for a percent sign. The extension is one of an image format.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FramePattern {
    folder: PathBuf,
    before: String,
    digits: usize,
    after: String,
    format: Format,
}

impl FramePattern {
    /// The pattern that a path is, if it is one.
    pub fn parse(path: &Path) -> Option<Self> {
        let format = Format::from_path(path)?;
        let name = path.file_name()?.to_str()?;
        let (mut before, mut digits) = (String::new(), None);
        let mut text = String::new();
        let mut rest = name;
        while let Some(at) = rest.find('%') {
            text.push_str(&rest[..at]);
            rest = &rest[at + 1..];
            if let Some(after) = rest.strip_prefix('%') {
                text.push('%');
                rest = after;
                continue;
            }
            let end = rest.find('d')?;
            let (width, after) = (&rest[..end], &rest[end + 1..]);
            let width = match width.strip_prefix('0') {
                Some(width) => width.parse::<usize>().ok().filter(|w| (1..=18).contains(w))?,
                None if width.is_empty() => 1,
                None => return None,
            };
            // One number is enough.
            if digits.replace(width).is_some() {
                return None;
            }
            before = std::mem::take(&mut text);
            rest = after;
        }
        text.push_str(rest);
        let folder = path.parent().map(Path::to_owned).unwrap_or_default();
        Some(Self { folder, before, digits: digits?, after: text, format })
    }

    /// The format of the images.
    pub fn format(&self) -> Format {
        self.format
    }

    /// The folder that they are in; empty for the current one.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The file of a number.
    pub fn path(&self, number: u64) -> PathBuf {
        self.folder.join(self.name(number))
    }

    fn name(&self, number: u64) -> String {
        format!("{}{number:0width$}{}", self.before, self.after, width = self.digits)
    }

    /// The pattern, as it was given.
    pub fn display(&self) -> PathBuf {
        let escaped = |text: &str| text.replace('%', "%%");
        let number = if self.digits > 1 { format!("%0{}d", self.digits) } else { "%d".to_owned() };
        self.folder.join(format!("{}{number}{}", escaped(&self.before), escaped(&self.after)))
    }

    /// The numbers of the files that exist, within a range where one is given: from the smallest to the largest, all of them.
    ///
    /// # Errors
    /// When there is none, when one is missing in between or at an end of the range, or the folder can't be read.
    pub fn numbers(&self, range: Option<&RangeInclusive<u64>>) -> Result<RangeInclusive<u64>, VideoError> {
        let folder = if self.folder.as_os_str().is_empty() { Path::new(".") } else { &self.folder };
        let open = |source| VideoError::Open { path: folder.to_owned(), source };
        let mut numbers = Vec::new();
        for entry in std::fs::read_dir(folder).map_err(open)? {
            let name = entry.map_err(open)?.file_name();
            let number = name.to_str().and_then(|name| self.number(name));
            numbers.extend(number.filter(|n| range.is_none_or(|range| range.contains(n))));
        }
        numbers.sort_unstable();
        let (Some(&first), Some(&last)) = (numbers.first(), numbers.last()) else {
            let range = range.map(|r| format!("{} to {}", r.start(), r.end()));
            return Err(VideoError::NoFrames { pattern: self.display(), range });
        };
        let (first, last) = range.map_or((first, last), |range| (*range.start(), *range.end()));
        let missing =
            numbers.iter().copied().map(Some).chain([None]).zip(first..).find(|(n, wanted)| *n != Some(*wanted));
        match missing {
            Some((_, number)) if number <= last => {
                Err(VideoError::MissingFrame { path: self.path(number), first, last })
            }
            _ => Ok(first..=last),
        }
    }

    /// The number of a file, if its name is of this pattern.
    fn number(&self, name: &str) -> Option<u64> {
        let digits = name.strip_prefix(self.before.as_str())?.strip_suffix(self.after.as_str())?;
        let number = digits.parse().ok().filter(|_| digits.bytes().all(|b| b.is_ascii_digit()))?;
        (self.name(number) == name).then_some(number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(name: &str) -> Option<FramePattern> {
        FramePattern::parse(Path::new(name))
    }

    #[test]
    fn patterns_have_one_number_and_an_image_s_extension() {
        let pattern = parse("a/frame_%04d.png").unwrap();
        assert_eq!(pattern.path(7), Path::new("a/frame_0007.png"));
        assert_eq!(pattern.path(12_345), Path::new("a/frame_12345.png"));
        assert_eq!(pattern.display(), Path::new("a/frame_%04d.png"));
        assert_eq!(parse("%d.exr").unwrap().path(3), Path::new("3.exr"));
        assert_eq!(parse("100%%_%03d.jpg").unwrap().path(3), Path::new("100%_003.jpg"));
        for wrong in ["a.png", "a%%.png", "%d_%d.png", "%04d.mp4", "%4d.png", "%x.png", "%.png", "%0d.png", "%099d.png"]
        {
            assert_eq!(parse(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn gaps_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let pattern = FramePattern::parse(&folder.path().join("f%02d.png")).unwrap();
        assert!(matches!(pattern.numbers(None), Err(VideoError::NoFrames { .. })));
        for name in ["f03.png", "f04.png", "f05.png", "f07.png", "f008.png", "f3.png", "g01.png", "f+9.png", "fxx.png"]
        {
            std::fs::write(folder.path().join(name), []).unwrap();
        }
        let error = pattern.numbers(None).unwrap_err().to_string();
        assert!(error.contains("f06.png") && error.contains("from 3 to 7"), "{error}");
        assert_eq!(pattern.numbers(Some(&(3..=5))).unwrap(), 3..=5);
        assert_eq!(pattern.numbers(Some(&(7..=7))).unwrap(), 7..=7);
        assert!(pattern.numbers(Some(&(2..=4))).unwrap_err().to_string().contains("f02.png"));
        assert!(pattern.numbers(Some(&(7..=9))).unwrap_err().to_string().contains("f08.png"));
        assert!(pattern.numbers(Some(&(20..=30))).unwrap_err().to_string().contains("20 to 30"));
    }
}
