//! The `ffmpeg` process: decodes to and encodes from `.y4m` through pipes.

use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::thread::JoinHandle;

use super::{FrameRate, Matrix, Range, Siting, Subsampling, VideoError, VideoInfo, YuvFormat};

/// How much of what ffmpeg says is kept, in bytes.
const KEPT: usize = 4096;

/// A running process. Dropping it ends it.
pub(super) struct Process {
    child: Child,
    path: PathBuf,
    action: &'static str,
    /// Gives what was said on standard error.
    said: Option<JoinHandle<String>>,
}

impl Process {
    fn start(mut command: Command, path: &Path, action: &'static str) -> Result<Self, VideoError> {
        command.stderr(Stdio::piped());
        #[cfg(unix)]
        {
            use std::os::unix::process::CommandExt;
            // Ctrl-C is ours to handle: it shall not tear the pipe.
            command.process_group(0);
        }
        let mut child = command.spawn().map_err(|error| VideoError::FfmpegMissing {
            path: path.to_owned(),
            program: PathBuf::from(command.get_program()),
            reason: match error.kind() {
                std::io::ErrorKind::NotFound => "it is not installed".to_owned(),
                _ => error.to_string(),
            },
        })?;
        // Read all the time, or ffmpeg would wait for somebody to listen.
        let said = child.stderr.take().map(|mut stderr| {
            std::thread::spawn(move || {
                let (mut kept, mut buffer) = (Vec::new(), [0; 1024]);
                while let Ok(count @ 1..) = stderr.read(&mut buffer) {
                    let room = KEPT - kept.len();
                    kept.extend_from_slice(&buffer[..count.min(room)]);
                }
                String::from_utf8_lossy(&kept).into_owned()
            })
        });
        Ok(Self { child, path: path.to_owned(), action, said })
    }

    /// Waits for the process, whose pipes have been closed.
    ///
    /// # Errors
    /// When it failed, or said that something is wrong. `place` is where in the video that was noticed.
    pub(super) fn finish(&mut self, place: String, has_failed: bool) -> Result<(), VideoError> {
        let status = self.child.wait();
        let said = self.said.take().and_then(|said| said.join().ok()).unwrap_or_default();
        if !has_failed && status.as_ref().is_ok_and(ExitStatus::success) && said.trim().is_empty() {
            return Ok(());
        }
        let lines: Vec<&str> = said.lines().map(str::trim).filter(|l| !l.is_empty()).take(6).collect();
        let reason = match (lines.is_empty(), status) {
            (false, _) => lines.join("; "),
            (true, Ok(status)) => format!("it ended early ({status})"),
            (true, Err(error)) => error.to_string(),
        };
        Err(VideoError::Ffmpeg { path: self.path.clone(), action: self.action, place, reason })
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // Both fail only where it has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A path that ffmpeg takes for a file, whatever it looks like: not for an option or a protocol.
fn file_argument(path: &Path) -> std::ffi::OsString {
    let mut argument = std::ffi::OsString::from("file:");
    argument.push(path);
    argument
}

/// Starts decoding the first video stream of a file.
pub(super) fn decode(
    program: &Path,
    path: &Path,
    probe: &Probe,
) -> Result<(Process, BufReader<ChildStdout>), VideoError> {
    // ffmpeg would say this, too, but not as plainly.
    std::fs::File::open(path).map_err(|source| VideoError::Open { path: path.to_owned(), source })?;
    let mut command = Command::new(program);
    command.args(["-nostdin", "-hide_banner", "-loglevel", "error", "-i"]).arg(file_argument(path));
    command.args(["-map", "0:v:0", "-strict", "-1"]);
    if probe.pixel_format.as_deref().is_some_and(|f| f.contains("411") || f.contains("410")) {
        command.args(["-pix_fmt", "yuv422p"]);
    }
    command.args(["-f", "yuv4mpegpipe", "pipe:1"]).stdin(Stdio::null()).stdout(Stdio::piped());
    let mut process = Process::start(command, path, "reading")?;
    match process.child.stdout.take() {
        Some(stdout) => Ok((process, BufReader::with_capacity(1 << 20, stdout))),
        None => Err(VideoError::Decode { path: path.to_owned(), reason: "ffmpeg has no output".to_owned() }),
    }
}

/// Starts encoding `.y4m` frames that are written to its input into a file. Sound comes from `sound`, if there is any.
pub(super) fn encode(
    program: &Path,
    (path, written_to): (&Path, &Path),
    sound: Option<&Path>,
    info: &VideoInfo,
    yuv: &YuvFormat,
) -> Result<(Process, ChildStdin), VideoError> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let mut command = Command::new(program);
    command.args(["-y", "-nostdin", "-hide_banner", "-loglevel", "error", "-f", "yuv4mpegpipe", "-i", "pipe:0"]);
    let can_sound = !matches!(extension.as_str(), "gif" | "h264" | "hevc" | "m2v");
    if let Some(sound) = sound.filter(|_| can_sound) {
        command.arg("-i").arg(file_argument(sound));
        command.args(["-map", "0:v:0", "-map", "1:a?", "-map_metadata", "1"]);
        // A container takes its own codecs for sure.
        if sound.extension().is_some_and(|e| e.eq_ignore_ascii_case(&extension)) {
            command.args(["-c:a", "copy"]);
        }
    }
    // Good quality, whatever the default of an encoder is.
    match extension.as_str() {
        "mp4" | "m4v" | "mov" | "mkv" | "h264" | "flv" | "ts" | "mts" | "m2ts" => {
            command.args(["-c:v", "libx264", "-preset", "fast", "-crf", "15"])
        }
        "hevc" => command.args(["-c:v", "libx265", "-preset", "fast", "-crf", "17", "-x265-params", "log-level=error"]),
        "webm" => command.args(["-c:v", "libvpx-vp9", "-b:v", "0", "-crf", "18"]),
        "gif" => &mut command,
        _ => command.args(["-q:v", "2"]),
    };
    for (option, name) in ["-colorspace", "-color_primaries", "-color_trc"].into_iter().zip(&info.color_names) {
        if let Some(name) = name {
            command.args([option, name]);
        }
    }
    command.args(["-color_range", if yuv.range == Range::Full { "pc" } else { "tv" }]);
    command.arg(file_argument(written_to)).stdin(Stdio::piped()).stdout(Stdio::null());
    let mut process = Process::start(command, path, "writing")?;
    match process.child.stdin.take() {
        Some(stdin) => Ok((process, stdin)),
        None => Err(VideoError::Encode { path: path.to_owned(), reason: "ffmpeg has no input".to_owned() }),
    }
}

/// What `ffprobe` says of a video, which a `.y4m` pipe doesn't.
#[derive(Debug, Default)]
pub(super) struct Probe {
    pub(super) pixel_format: Option<String>,
    pub(super) frames: Option<u64>,
    matrix: Option<Matrix>,
    siting: Option<Siting>,
    rate: Option<FrameRate>,
    /// Matrix, primaries, transfer function.
    color_names: [Option<String>; 3],
}

impl Probe {
    /// Asks the `ffprobe` that lies beside `ffmpeg`; what it doesn't say stays unknown.
    pub(super) fn of(ffmpeg: &Path, path: &Path) -> Self {
        let mut probe = Self::default();
        let name = ffmpeg.file_name().map(|n| n.to_string_lossy().replace("ffmpeg", "ffprobe")).unwrap_or_default();
        let entries =
            "stream=pix_fmt,color_space,color_primaries,color_transfer,chroma_location,nb_frames,r_frame_rate";
        let output = Command::new(ffmpeg.with_file_name(name))
            .args([
                "-loglevel",
                "error",
                "-select_streams",
                "v:0",
                "-of",
                "default=noprint_wrappers=1",
                "-show_entries",
            ])
            .arg(entries)
            .arg(file_argument(path))
            .stdin(Stdio::null())
            .output();
        let Ok(output) = output else { return probe };
        for line in String::from_utf8_lossy(&output.stdout).lines() {
            let Some((key, value)) = line.split_once('=') else { continue };
            if matches!(value, "unknown" | "N/A" | "unspecified" | "reserved") {
                continue;
            }
            let named = Some(value.to_owned());
            match key {
                "pix_fmt" => probe.pixel_format = named,
                "nb_frames" => probe.frames = value.parse().ok(),
                "r_frame_rate" => probe.rate = value.parse().ok(),
                "color_primaries" => probe.color_names[1] = named,
                "color_transfer" => probe.color_names[2] = named,
                "color_space" => {
                    probe.matrix = match value {
                        "bt709" => Some(Matrix::Bt709),
                        "smpte170m" | "bt470bg" | "fcc" => Some(Matrix::Bt601),
                        "bt2020nc" => Some(Matrix::Bt2020),
                        _ => None,
                    };
                    probe.color_names[0] = named;
                }
                "chroma_location" => {
                    probe.siting = match value {
                        "left" => Some(Siting::Left),
                        "center" => Some(Siting::Center),
                        "topleft" => Some(Siting::TopLeft),
                        _ => None,
                    }
                }
                _ => {}
            }
        }
        probe
    }

    /// Completes what the pipe said. `matrix` is what the user said.
    pub(super) fn complete(self, info: &mut VideoInfo, matrix: Option<Matrix>) {
        info.frames = self.frames.or(info.frames);
        info.frame_rate = self.rate.unwrap_or(info.frame_rate);
        if let Some(yuv) = &mut info.yuv {
            yuv.matrix = matrix.or(self.matrix).unwrap_or(yuv.matrix);
            // The pipe has no name for this above eight bits.
            if yuv.bits > 8 && yuv.subsampling == Subsampling::Yuv420 {
                yuv.siting = self.siting.unwrap_or(yuv.siting);
            }
        }
        info.color_names = self.color_names;
    }
}
