//! Ctrl-C: the first lets the pass finish and the pictures be written, the second ends the program at once.

use super::exit::Exit;
use std::path::{Path, PathBuf};
#[cfg(unix)]
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The exit code that a signal has asked for; 0 for none.
static REQUESTED: AtomicU8 = AtomicU8::new(0);
static RENDERING: AtomicBool = AtomicBool::new(false);
/// A video that is being written.
static UNFINISHED: Mutex<Option<PathBuf>> = Mutex::new(None);
/// Held while a file is written: whoever ends the program waits until the file is whole.
static WRITING: Mutex<()> = Mutex::new(());

/// Takes Ctrl-C and SIGTERM over. Until [`begin_rendering`], there is nothing to be saved and they end the program.
pub fn install(is_quiet: bool) {
    // Without a handler, signals end the program, as they always have.
    if let Err(error) = watch(move |exit| receive(exit, is_quiet)) {
        super::problems::warning(&format!("Ctrl-C will not save the picture: {error}"));
    }
}

#[cfg(unix)]
fn watch(mut receive: impl FnMut(Exit) + Send + 'static) -> std::io::Result<()> {
    use signal_hook::consts::{SIGINT, SIGTERM, SIGXFSZ};
    // A file larger than is allowed is an error like a full disk, not the end of the program.
    signal_hook::flag::register(SIGXFSZ, Arc::default())?;
    let mut signals = signal_hook::iterator::Signals::new([SIGINT, SIGTERM])?;
    std::thread::Builder::new().name("signals".to_owned()).spawn(move || {
        for signal in signals.forever() {
            receive(if signal == SIGTERM { Exit::Terminated } else { Exit::Interrupted });
        }
    })?;
    Ok(())
}

#[cfg(not(unix))]
fn watch(mut receive: impl FnMut(Exit) + Send + 'static) -> Result<(), ctrlc::Error> {
    ctrlc::set_handler(move || receive(Exit::Interrupted))
}

fn receive(exit: Exit, is_quiet: bool) {
    let is_second = REQUESTED.swap(exit as u8, Ordering::SeqCst) != 0;
    if is_second || !RENDERING.load(Ordering::SeqCst) {
        let _whole_files_only = writing();
        remove_unfinished();
        std::process::exit(exit as i32);
    }
    if !is_quiet {
        eprintln!("\ninterrupted: writing what there is, in a moment (again to stop at once)");
    }
}

/// From here on, an interrupted render has something worth keeping.
pub fn begin_rendering() {
    RENDERING.store(true, Ordering::SeqCst);
}

/// Has Ctrl-C been pressed, or SIGTERM come?
pub fn is_requested() -> bool {
    REQUESTED.load(Ordering::SeqCst) != 0
}

/// How the program ends after it has been interrupted.
pub fn exit() -> Exit {
    if REQUESTED.load(Ordering::SeqCst) == Exit::Terminated as u8 { Exit::Terminated } else { Exit::Interrupted }
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
