//! Reading whole files, gzip'd or not, within a limit.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Reads a file; one whose name ends in `.gz` or that starts with the gzip magic is decompressed. More than
/// `limit` bytes (after decompression) are refused, with no more than that ever in memory.
///
/// # Errors
/// Those of the file system, `InvalidData` for a broken gzip stream, `FileTooLarge` beyond the limit.
pub fn read_bytes(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let mut file = File::open(path)?;
    let metadata = file.metadata()?;
    if metadata.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a directory"));
    }
    if metadata.len() > limit {
        return Err(too_large(limit));
    }
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(usize::try_from(metadata.len()).unwrap_or(usize::MAX)).map_err(out_of_memory)?;
    // A device or a growing file can deliver more than its metadata said.
    (&mut file).take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit {
        return Err(too_large(limit));
    }
    if bytes.starts_with(&[0x1f, 0x8b]) {
        return decompress(&bytes, limit);
    }
    Ok(bytes)
}

/// Unpacks a gzip stream of one or more members.
fn decompress(packed: &[u8], limit: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut decoder = flate2::read::MultiGzDecoder::new(packed).take(limit.saturating_add(1));
    let mut chunk = vec![0; 1 << 16];
    loop {
        let count = match decoder.read(&mut chunk) {
            Ok(0) => break,
            Ok(count) => count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) => {
                return Err(io::Error::new(io::ErrorKind::InvalidData, format!("broken gzip stream: {error}")));
            }
        };
        bytes.try_reserve(count).map_err(out_of_memory)?;
        bytes.extend_from_slice(&chunk[..count]);
    }
    if bytes.len() as u64 > limit { Err(too_large(limit)) } else { Ok(bytes) }
}

fn too_large(limit: u64) -> io::Error {
    io::Error::new(io::ErrorKind::FileTooLarge, format!("is larger than the limit of {limit} bytes"))
}

fn out_of_memory(_: std::collections::TryReserveError) -> io::Error {
    io::Error::new(io::ErrorKind::OutOfMemory, "does not fit in memory")
}

/// An I/O error for people: without the operating system's number.
#[must_use]
pub(crate) fn explain(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "no such file".to_owned(),
        io::ErrorKind::PermissionDenied => "permission denied".to_owned(),
        io::ErrorKind::IsADirectory => "is a directory".to_owned(),
        _ => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn gz(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    #[test]
    fn gzip_is_transparent_and_bounded() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.gz");
        let bytes = vec![b' '; 1 << 20];
        std::fs::write(&path, [gz(&bytes), gz(b"end")].concat()).unwrap();
        let read = read_bytes(&path, u64::MAX).unwrap();
        assert_eq!((read.len(), &read[1 << 20..]), ((1 << 20) + 3, &b"end"[..]));
        // A bomb: the packed file is far smaller than the limit.
        assert_eq!(read_bytes(&path, 100_000).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
    }

    #[test]
    fn broken_gzip_is_an_error() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.gz");
        let packed = gz(&vec![b'x'; 1000]);
        std::fs::write(&path, &packed[..packed.len() / 2]).unwrap();
        assert_eq!(read_bytes(&path, u64::MAX).unwrap_err().kind(), io::ErrorKind::InvalidData);
        assert_eq!(read_bytes(directory.path(), u64::MAX).unwrap_err().kind(), io::ErrorKind::IsADirectory);
    }
}
