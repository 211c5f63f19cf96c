//! YUV4MPEG2: a line of fields, then frames of a short line and planes of samples each.
//!
//! Source: the `yuv4mpeg` manual page of mjpegtools, with the extensions that ffmpeg writes: depths above eight bits and
//! `XCOLORRANGE`.

use std::io::{self, BufRead, Read, Write};

use super::{FrameRate, Matrix, Range, Siting, Subsampling, VideoInfo, YuvFormat};

/// What every file begins with.
const SIGNATURE: &str = "YUV4MPEG2";
/// Lines are no longer than this.
const LINE: u64 = 4096;

/// What can be wrong with a stream; the reader of a file adds its name.
#[derive(Debug)]
pub(super) enum StreamError {
    Io(io::Error),
    /// There is nothing at all.
    Empty,
    Damaged(String),
    /// So many of the frame's bytes are there.
    Truncated(usize),
}

/// The header of a stream. `matrix` is what the file can't say; without it, what is usual for the height.
pub(super) fn read_header(input: &mut impl BufRead, matrix: Option<Matrix>) -> Result<VideoInfo, StreamError> {
    let Some(line) = read_line(input)? else { return Err(StreamError::Empty) };
    let mut fields = line.split(' ').filter(|f| !f.is_empty());
    if fields.next() != Some(SIGNATURE) {
        return Err(damaged(format!("it doesn't begin with {SIGNATURE}")));
    }
    let (mut width, mut height, mut colors, mut range) = (None, None, "420jpeg".to_owned(), Range::Limited);
    let mut info = VideoInfo::new(0, 0);
    info.interlacing = '?';
    for field in fields {
        let mut characters = field.chars();
        let Some(kind) = characters.next() else { continue };
        let value = characters.as_str();
        let number = || match value.parse::<u32>() {
            Ok(number @ 1..) => Ok(number as usize),
            _ => Err(damaged(format!("its header says `{field}`, which is no size"))),
        };
        match kind {
            'W' => width = Some(number()?),
            'H' => height = Some(number()?),
            'F' => info.frame_rate = rate(value).ok_or_else(|| damaged(format!("`{field}` is no frame rate")))?,
            'I' => info.interlacing = value.chars().next().unwrap_or('?'),
            'A' => info.pixel_aspect = ratio(value).filter(|r| r[0] > 0 && r[1] > 0),
            'C' => colors = value.to_owned(),
            'X' => match value.strip_prefix("COLORRANGE=") {
                Some(name) if name.eq_ignore_ascii_case("full") => range = Range::Full,
                Some(_) => range = Range::Limited,
                // Says again what C says.
                None if value.starts_with("YSCSS=") => {}
                None => info.extensions.push(field.to_owned()),
            },
            _ => {}
        }
    }
    let (Some(width), Some(height)) = (width, height) else {
        return Err(damaged("its header says no width or no height".to_owned()));
    };
    (info.width, info.height) = (width, height);
    let (subsampling, siting, bits) = color_space(&colors).ok_or_else(|| {
        damaged(format!(
            "its colour space `C{colors}` is not supported; 420, 422, 444 and mono of 8 to 16 bits are, without alpha"
        ))
    })?;
    let matrix = matrix.unwrap_or(Matrix::usual(height));
    info.yuv = Some(YuvFormat { subsampling, siting, bits, range, matrix });
    Ok(info)
}

/// The bytes of the next frame; none at the end.
pub(super) fn read_frame(input: &mut impl BufRead, buffer: &mut [u8], number: u64) -> Result<bool, StreamError> {
    let Some(line) = read_line(input)? else { return Ok(false) };
    if line != "FRAME" && !line.starts_with("FRAME ") {
        return Err(damaged(format!("frame {number} doesn't begin with FRAME")));
    }
    let mut found = 0;
    while found < buffer.len() {
        match input.read(&mut buffer[found..]) {
            Ok(0) => return Err(StreamError::Truncated(found)),
            Ok(count) => found += count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(StreamError::Io(error)),
        }
    }
    Ok(true)
}

/// Writes a header; the information says how samples are stored.
pub(super) fn write_header(output: &mut impl Write, info: &VideoInfo, yuv: &YuvFormat) -> io::Result<()> {
    let FrameRate { frames, seconds } = info.frame_rate;
    write!(output, "{SIGNATURE} W{} H{} F{frames}:{seconds} I{}", info.width, info.height, info.interlacing)?;
    if let Some([width, height]) = info.pixel_aspect {
        write!(output, " A{width}:{height}")?;
    }
    write!(output, " C{}", color_name(yuv))?;
    let range = if yuv.range == Range::Full { "FULL" } else { "LIMITED" };
    write!(output, " XCOLORRANGE={range}")?;
    for extension in &info.extensions {
        write!(output, " {extension}")?;
    }
    output.write_all(b"\n")
}

/// Writes a frame.
pub(super) fn write_frame(output: &mut impl Write, bytes: &[u8]) -> io::Result<()> {
    output.write_all(b"FRAME\n")?;
    output.write_all(bytes)
}

fn damaged(reason: String) -> StreamError {
    StreamError::Damaged(reason)
}

/// A line without its end; none where the stream ends.
fn read_line(input: &mut impl BufRead) -> Result<Option<String>, StreamError> {
    let mut line = Vec::new();
    input.take(LINE).read_until(b'\n', &mut line).map_err(StreamError::Io)?;
    if line.is_empty() {
        return Ok(None);
    }
    if line.pop() != Some(b'\n') {
        return Err(damaged("a line of text doesn't end".to_owned()));
    }
    Ok(Some(String::from_utf8_lossy(&line).into_owned()))
}

fn ratio(text: &str) -> Option<[u32; 2]> {
    let (a, b) = text.split_once(':')?;
    Some([a.parse().ok()?, b.parse().ok()?])
}

/// Frames per second; 0:0 is unknown and becomes the default.
fn rate(text: &str) -> Option<FrameRate> {
    let [frames, seconds] = ratio(text)?;
    match (frames, seconds) {
        (0, 0) => Some(FrameRate::default()),
        (0, _) | (_, 0) => None,
        _ => Some(FrameRate { frames, seconds }),
    }
}

/// What the C field says.
fn color_space(name: &str) -> Option<(Subsampling, Siting, u8)> {
    match name {
        // What plain 4:2:0 means: as in JPEG.
        "420" | "420jpeg" => return Some((Subsampling::Yuv420, Siting::Center, 8)),
        "420mpeg2" => return Some((Subsampling::Yuv420, Siting::Left, 8)),
        "420paldv" => return Some((Subsampling::Yuv420, Siting::TopLeft, 8)),
        _ => {}
    }
    let names = [
        ("420", Subsampling::Yuv420),
        ("422", Subsampling::Yuv422),
        ("444", Subsampling::Yuv444),
        ("mono", Subsampling::Mono),
    ];
    let (rest, subsampling) = names.iter().find_map(|(name_, s)| Some((name.strip_prefix(name_)?, *s)))?;
    let digits = if subsampling == Subsampling::Mono { rest } else { rest.strip_prefix('p').unwrap_or(rest) };
    let bits = if rest.is_empty() { 8 } else { digits.parse().ok().filter(|bits| (9..=16).contains(bits))? };
    Some((subsampling, Siting::Left, bits))
}

/// The C field. Depths above eight bits have no name for where chroma lies; left is what all readers assume.
fn color_name(yuv: &YuvFormat) -> String {
    let deep = |name: &str| if yuv.bits > 8 { format!("{name}p{}", yuv.bits) } else { name.to_owned() };
    match (yuv.subsampling, yuv.siting) {
        (Subsampling::Mono, _) if yuv.bits > 8 => format!("mono{}", yuv.bits),
        (Subsampling::Mono, _) => "mono".to_owned(),
        (Subsampling::Yuv420, _) if yuv.bits > 8 => deep("420"),
        (Subsampling::Yuv420, Siting::Center) => "420jpeg".to_owned(),
        (Subsampling::Yuv420, Siting::Left) => "420mpeg2".to_owned(),
        (Subsampling::Yuv420, Siting::TopLeft) => "420paldv".to_owned(),
        (Subsampling::Yuv422, _) => deep("422"),
        (Subsampling::Yuv444, _) => deep("444"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(text: &str) -> Result<VideoInfo, StreamError> {
        read_header(&mut text.as_bytes(), None)
    }

    #[test]
    fn headers_come_back() {
        for (text, again) in [
            ("W4 H2 F30000:1001 Ip A128:117 C420mpeg2 XCOLORRANGE=LIMITED XFOO=1", None),
            ("W4 H2 F25:1 It A1:1 C422p10 XCOLORRANGE=FULL", None),
            ("W4 H2 F25:1 I? C444p16 XCOLORRANGE=LIMITED", None),
            ("W4 H2 F25:1 I? Cmono12 XCOLORRANGE=FULL", None),
            ("W4 H2 F25:1 I? C420paldv XCOLORRANGE=LIMITED", None),
            ("W4 H2 F0:0 A0:0", Some("W4 H2 F25:1 I? C420jpeg XCOLORRANGE=LIMITED")),
            ("H2 W4  F25:1 C420p12 XYSCSS=420P12", Some("W4 H2 F25:1 I? C420p12 XCOLORRANGE=LIMITED")),
        ] {
            let info = header(&format!("YUV4MPEG2 {text}\n")).unwrap();
            let mut bytes = Vec::new();
            write_header(&mut bytes, &info, &info.yuv.unwrap()).unwrap();
            assert_eq!(String::from_utf8(bytes).unwrap(), format!("YUV4MPEG2 {}\n", again.unwrap_or(text)));
        }
    }

    #[test]
    fn broken_headers_are_refused() {
        assert!(matches!(header(""), Err(StreamError::Empty)));
        for (text, word) in [
            ("YUV4MPEG2 W4 H2", "doesn't end"),
            ("RIFF....\n", "begin with"),
            ("YUV4MPEG2 W4\n", "no height"),
            ("YUV4MPEG2 W0 H2\n", "W0"),
            ("YUV4MPEG2 W-4 H2\n", "W-4"),
            ("YUV4MPEG2 W4 H99999999999999\n", "H99"),
            ("YUV4MPEG2 W4 H2 F0:1\n", "F0:1"),
            ("YUV4MPEG2 W4 H2 Fx\n", "Fx"),
            ("YUV4MPEG2 W4 H2 C411\n", "C411"),
            ("YUV4MPEG2 W4 H2 C444alpha\n", "C444alpha"),
            ("YUV4MPEG2 W4 H2 C420p17\n", "C420p17"),
            ("YUV4MPEG2 W4 H2 C420p999\n", "C420p999"),
        ] {
            match header(text) {
                Err(StreamError::Damaged(reason)) => assert!(reason.contains(word), "{text}: {reason}"),
                other => panic!("{text}: {other:?}"),
            }
        }
    }
}
