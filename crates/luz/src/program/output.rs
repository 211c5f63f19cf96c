//! Files to be written: checked before the work, whole after it.

use super::interrupt;
use super::values::OutputFile;
use luz::checkpoint::Checkpoint;
use luz::image::{Format, Image, ImageError, ToneMap, WriteOptions};
use std::path::{Path, PathBuf};

/// What a render writes when nothing was asked for: a linear EXR, and beside it a tone-mapped PNG, named as the scene's
/// film wants its file to be named, or else as the scene, in the current directory.
pub fn default_outputs(film_filename: Option<&str>, scene: &Path) -> Vec<OutputFile> {
    let stem = stem(film_filename, scene);
    let named = |extension: &str, format| {
        // Not `set_extension`, for which `box.v2` has an extension already.
        let mut name = stem.to_owned();
        name.push(extension);
        OutputFile { path: PathBuf::from(name), format }
    };
    vec![named(".exr", Format::Exr), named(".png", Format::Png)]
}

/// What pictures of a scene are called.
pub fn scene_name(film_filename: Option<&str>, scene: &Path) -> String {
    stem(film_filename, scene).to_string_lossy().into_owned()
}

fn stem<'a>(film_filename: Option<&'a str>, scene: &'a Path) -> &'a std::ffi::OsStr {
    let of_film = film_filename.map(Path::new).and_then(Path::file_stem);
    of_film.or_else(|| scene_stem(scene)).unwrap_or("luz".as_ref())
}

/// `scene` of `folder/scene.pbrt.gz`.
fn scene_stem(scene: &Path) -> Option<&std::ffi::OsStr> {
    let stem = scene.file_stem()?;
    let is_packed = scene.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz"));
    if is_packed { Path::new(stem).file_stem() } else { Some(stem) }
}

/// Why files could not be written, one sentence for each: every folder must exist and take a file.
pub fn problems<'a>(paths: impl IntoIterator<Item = &'a Path>) -> Vec<String> {
    paths
        .into_iter()
        .filter_map(|path| check(path).err().map(|why| format!("cannot write `{}`: {why}", path.display())))
        .collect()
}

fn check(path: &Path) -> Result<(), String> {
    if path.is_dir() {
        return Err("it is a folder".to_owned());
    }
    if std::fs::metadata(path).is_ok_and(|m| !m.is_file()) {
        // A device or a pipe, which is written to directly.
        return Ok(());
    }
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return Err(format!("there is no folder `{}`; create it first", folder.display()));
    }
    // The only honest test of whether a folder takes a file.
    tempfile::Builder::new().prefix(".luz-").tempfile_in(folder).map(drop).map_err(|error| match error.kind() {
        std::io::ErrorKind::PermissionDenied => format!("the folder `{}` does not take files", folder.display()),
        _ => error.to_string(),
    })
}

/// Writes an image; Ctrl-C waits until it is whole.
pub fn write_image(image: &Image, file: &OutputFile, tone_map: ToneMap) -> Result<(), ImageError> {
    let bytes = image.encode(file.format, &WriteOptions { tone_map, ..WriteOptions::default() })?;
    write_bytes(&file.path, &bytes)
}

/// Writes a checkpoint; Ctrl-C waits until it is whole.
pub fn write_checkpoint(checkpoint: &Checkpoint, path: &Path) -> Result<(), String> {
    let _whole_files_only = interrupt::writing();
    checkpoint.write(path).map_err(|error| format!("cannot write `{}`: {error}", path.display()))
}

/// Writes a file, or leaves everything as it was; Ctrl-C waits until it is whole.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    let _whole_files_only = interrupt::writing();
    luz::image::write_atomically(path, bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(film: Option<&str>, scene: &str) -> Vec<String> {
        default_outputs(film, Path::new(scene)).iter().map(|o| o.path.display().to_string()).collect()
    }

    #[test]
    fn outputs_are_named_as_the_film_says_or_as_the_scene() {
        assert_eq!(names(Some("a/b/box.exr"), "s.pbrt"), ["box.exr", "box.png"]);
        assert_eq!(names(None, "folder/my.scene.pbrt"), ["my.scene.exr", "my.scene.png"]);
        assert_eq!(names(None, "scene.pbrt.gz"), ["scene.exr", "scene.png"]);
        assert_eq!(names(Some(""), "scene.pbrt"), ["scene.exr", "scene.png"]);
    }

    #[test]
    fn folders_must_exist_and_take_files() {
        let folder = tempfile::tempdir().unwrap();
        let fine = folder.path().join("a.png");
        let wrong = folder.path().join("no/a.png");
        let found = problems([fine.as_path(), wrong.as_path(), folder.path()]);
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].contains("there is no folder"), "{found:?}");
        assert!(found[1].contains("it is a folder"), "{found:?}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
