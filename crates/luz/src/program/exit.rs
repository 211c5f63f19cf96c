//! How the program ends.

use std::io::{self, Write};
use std::process::ExitCode;

/// The exit codes, as `luz --help` and `luz help exit-codes` document them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// All went well.
    Success = 0,
    /// `luz compare`: the images differ by more than a threshold.
    Differs = 1,
    /// The command line is wrong.
    Usage = 2,
    /// The scene has errors, misses files, or uses what cannot be rendered yet.
    Scene = 3,
    /// An output cannot be written.
    Output = 4,
    /// An image or a video cannot be read, or two do not belong together.
    Image = 5,
    /// ffmpeg is not installed, or failed.
    Ffmpeg = 6,
    /// A checkpoint cannot be used, or parts do not go together.
    Checkpoint = 7,
    /// Ctrl-C, or SIGINT.
    Interrupted = 130,
    /// SIGTERM.
    Terminated = 143,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// The table for `luz --help` and `luz help exit-codes`.
pub const EXIT_CODES: &str = "\
Exit codes:
  0    all went well
  1    luz compare: the images differ by more than a threshold
  2    the command line is wrong
  3    the scene has errors, misses files, or uses what luz cannot render yet
  4    an output cannot be written
  5    an image or a video cannot be read, or two do not belong together
  6    ffmpeg is needed and not installed, or it failed
  7    a checkpoint cannot be used, or parts of a frame do not go together
  130  interrupted by Ctrl-C (SIGINT); what was done by then has been written
  143  ended by SIGTERM; what was done by then has been written";

/// Writes to standard output. That nobody reads it to its end is no failure.
pub fn print_bytes(bytes: &[u8]) -> Exit {
    let mut out = io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Ok(()) => Exit::Success,
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Exit::Success,
        Err(error) => {
            super::problems::error(&format!("cannot write to standard output: {error}"));
            Exit::Output
        }
    }
}

/// As [`print_bytes`], for text.
pub fn print(text: &str) -> Exit {
    print_bytes(text.as_bytes())
}
