//! Ctrl-C: the first lets the pass finish and the pictures be written, the second ends the program at once.

use super::exit::Exit;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

static REQUESTED: AtomicBool = AtomicBool::new(false);
static RENDERING: AtomicBool = AtomicBool::new(false);
/// A video that is being written.
static UNFINISHED: Mutex<Option<PathBuf>> = Mutex::new(None);
/// Held while a file is written: whoever ends the program waits until the file is whole.
static WRITING: Mutex<()> = Mutex::new(());

/// Takes Ctrl-C over. Until [`begin_rendering`], there is nothing to be saved and it ends the program.
pub fn install(is_quiet: bool) {
    let installed = ctrlc::set_handler(move || {
        let is_second = REQUESTED.swap(true, Ordering::SeqCst);
        if is_second || !RENDERING.load(Ordering::SeqCst) {
            let _whole_files_only = writing();
            remove_unfinished();
            std::process::exit(Exit::Interrupted as i32);
        }
        if !is_quiet {
            eprintln!("\ninterrupted: writing what there is, in a moment (again to stop at once)");
        }
    });
    // Without a handler, Ctrl-C ends the program, as it always has.
    if let Err(error) = installed {
        super::problems::warning(&format!("Ctrl-C will not save the picture: {error}"));
    }
}

/// From here on, an interrupted render has something worth keeping.
pub fn begin_rendering() {
    RENDERING.store(true, Ordering::SeqCst);
}

/// Has Ctrl-C been pressed?
pub fn is_requested() -> bool {
    REQUESTED.load(Ordering::SeqCst)
}

/// A file that is no use if the program ends before it is finished.
pub fn remove_at_exit(path: Option<&Path>) {
    *UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner) = path.map(Path::to_owned);
}

fn remove_unfinished() {
    if let Some(path) = UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner).take() {
        // If it has been finished by now, it has another name.
        let _ = std::fs::remove_file(path);
    }
}

/// To be held while a file is written, so that a second Ctrl-C leaves no part of it.
pub fn writing() -> MutexGuard<'static, ()> {
    WRITING.lock().unwrap_or_else(PoisonError::into_inner)
}
