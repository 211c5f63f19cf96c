//! The file of a checkpoint.
//!
//! ```text
//! magic         8 bytes, not text, damaged by whoever converts line ends
//! version       u32
//! header        u32 length, JSON: identity, and the headers of the parts
//! data          of each part, one after the other
//! checksum      u128, XXH3 of all before
//! ```
//!
//! Numbers are little-endian.

use super::{Checkpoint, Identity};
use luz_render::{Part, PartHeader, Shard};
use serde::{Deserialize, Serialize};
use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, Write};
use std::ops::Range;
use std::path::Path;
use xxhash_rust::xxh3::{Xxh3, xxh3_128};

const MAGIC: [u8; 8] = *b"\x89luz\r\n\x1a\n";
/// The version of the format that is written, and the only one that is read.
pub const VERSION: u32 = 2;
const CHECKSUM: usize = size_of::<u128>();

/// A file that is no checkpoint, or none that can be used.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// It can't be read.
    #[error("cannot be read: {0}")]
    Unreadable(#[from] io::Error),
    /// It is something else.
    #[error("is no checkpoint of luz")]
    NotACheckpoint,
    /// It is of another format.
    #[error("has version {0} of the format, not {VERSION}: it was written by another version of luz")]
    Version(u32),
    /// Something is missing or changed.
    #[error("is damaged: its checksum is wrong, so that it was cut off or changed")]
    Damaged,
    /// The checksum is right but the contents make no sense.
    #[error("does not hold what its header says")]
    Unfit,
}

#[derive(Serialize, Deserialize)]
struct Header {
    identity: Identity,
    parts: Vec<PartHeader>,
}

impl Checkpoint {
    /// Writes the file: after this call it holds the checkpoint, or what it held before. It survives the power failing right
    /// after.
    ///
    /// # Errors
    /// If it can't be written: no room, no permission.
    pub fn write(&self, path: &Path) -> io::Result<()> {
        let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let mut builder = tempfile::Builder::new();
        let prefix = unfinished_prefix(path);
        builder.prefix(&prefix).suffix(UNFINISHED_SUFFIX).rand_bytes(UNFINISHED_RANDOM);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // As for any new file; the process's mask applies.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let mut file = builder.tempfile_in(folder)?;
        self.write_to(file.as_file_mut())?;
        file.as_file().sync_all()?;
        file.persist(path).map_err(|error| error.error)?;
        // So that the new name is on the disk, too; not all systems let folders be opened.
        if let Ok(folder) = File::open(folder) {
            let _ = folder.sync_all();
        }
        Ok(())
    }

    /// Removes what is left of writes of this file that were killed. Nobody else should be writing it.
    pub fn remove_unfinished(path: &Path) {
        let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let prefix = unfinished_prefix(path);
        let is_unfinished = |name: &OsStr| {
            let middle = name.as_encoded_bytes().strip_prefix(prefix.as_encoded_bytes());
            let middle = middle.and_then(|rest| rest.strip_suffix(UNFINISHED_SUFFIX.as_bytes()));
            middle.is_some_and(|m| m.len() == UNFINISHED_RANDOM && m.iter().all(u8::is_ascii_alphanumeric))
        };
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            if is_unfinished(&entry.file_name()) {
                // It is but litter: if it can't be removed, so be it.
                let _ = fs::remove_file(entry.path());
            }
        }
    }

    fn write_to(&self, out: &mut impl Write) -> io::Result<()> {
        let parts = self.parts.iter().map(|part| part.header.clone()).collect();
        let header = serde_json::to_vec(&Header { identity: self.identity.clone(), parts })?;
        let length = u32::try_from(header.len()).map_err(io::Error::other)?;
        let mut hasher = Xxh3::new();
        let mut put = |bytes: &[u8]| {
            hasher.update(bytes);
            out.write_all(bytes)
        };
        put(&MAGIC)?;
        put(&VERSION.to_le_bytes())?;
        put(&length.to_le_bytes())?;
        put(&header)?;
        self.parts.iter().try_for_each(|part| put(&part.data))?;
        out.write_all(&hasher.digest128().to_le_bytes())
    }

    /// The bytes of the file.
    ///
    /// # Errors
    /// Only where the header can't be put into JSON, which does not happen.
    pub fn to_bytes(&self) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        self.write_to(&mut bytes)?;
        Ok(bytes)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// If it is no checkpoint, or a damaged one.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let mut bytes = fs::read(path)?;
        let (identity, contents) = parse(&bytes)?;
        // From behind, so that most bytes stay where they are.
        let mut parts: Vec<Part> = Vec::with_capacity(contents.len());
        for (i, (header, Range { start, end })) in contents.into_iter().enumerate().rev() {
            bytes.truncate(end);
            let data = if i == 0 {
                bytes.drain(..start);
                std::mem::take(&mut bytes)
            } else {
                bytes.split_off(start)
            };
            parts.push(Part { header, data });
        }
        parts.reverse();
        Ok(Self { identity, parts })
    }

    /// As [`read`](Self::read), from the bytes of a file.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, FileError> {
        let (identity, contents) = parse(bytes)?;
        let part = |(header, place): (PartHeader, Range<usize>)| Part { header, data: bytes[place].to_vec() };
        Ok(Self { identity, parts: contents.into_iter().map(part).collect() })
    }
}

/// How files are called that are not finished yet: so that they can be recognised when their writer has been killed.
fn unfinished_prefix(path: &Path) -> OsString {
    let mut prefix = OsString::from(".");
    prefix.push(path.file_name().unwrap_or_default());
    prefix.push("-");
    prefix
}

const UNFINISHED_SUFFIX: &str = ".part";
const UNFINISHED_RANDOM: usize = 6;

/// What a file holds: the identity, and each part with the place of its data.
type Contents = (Identity, Vec<(PartHeader, Range<usize>)>);

fn parse(bytes: &[u8]) -> Result<Contents, FileError> {
    let rest = bytes.strip_prefix(&MAGIC).ok_or(FileError::NotACheckpoint)?;
    let (version, rest) = rest.split_first_chunk().ok_or(FileError::Damaged)?;
    let version = u32::from_le_bytes(*version);
    if version != VERSION {
        return Err(FileError::Version(version));
    }
    let (rest, checksum) = rest.split_last_chunk::<CHECKSUM>().ok_or(FileError::Damaged)?;
    let end = bytes.len() - CHECKSUM;
    if xxh3_128(&bytes[..end]) != u128::from_le_bytes(*checksum) {
        return Err(FileError::Damaged);
    }
    let (length, rest) = rest.split_first_chunk().ok_or(FileError::Unfit)?;
    let (header, data) = rest.split_at_checked(u32::from_le_bytes(*length) as usize).ok_or(FileError::Unfit)?;
    let Header { identity, parts } = serde_json::from_slice(header).map_err(|_| FileError::Unfit)?;
    let mut contents = Vec::with_capacity(parts.len());
    let mut start = end - data.len();
    for header in parts {
        let length = header.data_length().and_then(|length| usize::try_from(length).ok()).ok_or(FileError::Unfit)?;
        let behind = start.checked_add(length).filter(|&behind| behind <= end).ok_or(FileError::Unfit)?;
        contents.push((header, start..behind));
        start = behind;
    }
    let shards: Vec<Shard> = contents.iter().map(|(header, _)| header.shard).collect();
    let is_sound = shards.windows(2).all(|pair| pair[0].index < pair[1].index && pair[0].count == pair[1].count)
        && shards.iter().all(|shard| shard.index < shard.count && shard.count <= Shard::MOST)
        && !shards.is_empty();
    if start != end || !is_sound || identity.bounds.is_absurd(identity.resolution) {
        return Err(FileError::Unfit);
    }
    Ok((identity, contents))
}
