//! Keeps the state of a render on disk while it goes on.

use super::{interrupt, output, problems};
use luz::checkpoint::Checkpoint;
use std::io;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// At most this share of the time goes into taking snapshots.
const MAX_SHARE: u32 = 100;

/// Writes a checkpoint from time to time, beside the render, which waits only while its state is copied.
pub struct Keeper {
    path: PathBuf,
    every: Duration,
    last: Instant,
    pause: Duration,
    writing: Option<JoinHandle<io::Result<()>>>,
}

impl Keeper {
    /// Writes to `path` every so often. Removes what is left of writes that were killed.
    pub fn new(path: PathBuf, every: Duration) -> Self {
        Checkpoint::remove_unfinished(&path);
        Self { path, every, last: Instant::now(), pause: every, writing: None }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Between two passes: writes, if it is time.
    pub fn after_pass(&mut self, checkpoint: impl FnOnce() -> Option<Checkpoint>) {
        if self.writing.as_ref().is_some_and(JoinHandle::is_finished) {
            self.wait();
        }
        if self.writing.is_some() || self.last.elapsed() < self.pause {
            return;
        }
        let start = Instant::now();
        let Some(checkpoint) = checkpoint() else { return };
        self.pause = self.every.max(start.elapsed() * MAX_SHARE);
        self.last = Instant::now();
        let path = self.path.clone();
        let write = move || {
            let _whole_files_only = interrupt::writing();
            checkpoint.write(&path)
        };
        let spawned = std::thread::Builder::new().name("checkpoint".to_owned()).spawn(write);
        match spawned {
            Ok(thread) => self.writing = Some(thread),
            Err(error) => self.complain(&error),
        }
    }

    /// After the last pass: writes. Returns whether the file is there.
    pub fn finish(mut self, checkpoint: impl FnOnce() -> Option<Checkpoint>) -> bool {
        // Before another copy of the state is made.
        self.wait();
        let Some(checkpoint) = checkpoint() else { return true };
        match output::write_checkpoint(&checkpoint, &self.path) {
            Ok(()) => true,
            Err(error) => {
                problems::error(&error);
                false
            }
        }
    }

    /// Before somebody else writes the file.
    pub fn wait(&mut self) {
        match self.writing.take().map(JoinHandle::join) {
            None | Some(Ok(Ok(()))) => {}
            Some(Ok(Err(error))) => self.complain(&error),
            Some(Err(_)) => self.complain(&io::Error::other("the thread that writes it failed")),
        }
    }

    fn complain(&self, error: &io::Error) {
        problems::warning(&format!(
            "cannot write the checkpoint `{}`: {error}. Rendering goes on, the checkpoint before stays as it is, and it is \
             tried again in {}",
            self.path.display(),
            super::progress::duration(self.pause.as_secs_f64())
        ));
    }
}
