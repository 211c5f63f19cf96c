//! What the commands that filter have in common: opening, looping over frames, writing, reporting.

use super::arguments::FileArguments;
use super::failure::Failure;
use super::ticker::Ticker;
use super::values::Target;
use crate::program::exit::{Exit, print};
use crate::program::report::{Stopped, peak_memory};
use crate::program::{interrupt, output, problems, progress, threads};
use luz::filter::Report as FilterReport;
use luz::image::video::{
    FramePattern, ReadVideoOptions, VideoInfo, VideoKind, VideoReader, VideoWriter, WriteVideoOptions,
};
use luz::image::{Encoding, Image, ReadOptions, ToneMap, WriteOptions};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// An image or a frame that is done.
pub struct Outcome {
    /// The image: stored values, or light, as its metadata say.
    pub image: Image,
    /// How it came about.
    pub report: FilterReport,
    /// True for a picture that is ready to be shown: encoded as sRGB, whatever the input was.
    pub is_display: bool,
}

/// What a command does with images and frames: one in, one out, perhaps some later.
pub trait Work {
    /// Takes the next frame.
    fn push(&mut self, image: Image, ticker: &Ticker) -> Result<Option<Outcome>, Failure>;

    /// After the last: gives the next that is missing, or none.
    fn flush(&mut self, ticker: &Ticker) -> Result<Option<Outcome>, Failure> {
        let _ = ticker;
        Ok(None)
    }
}

/// What can be known of the input before it is read.
pub struct Start {
    input: Input,
    seconds: f64,
}

enum Input {
    Image(Image),
    Video(VideoReader),
}

/// How videos are read, as these arguments say.
pub fn video_options(files: &FileArguments) -> ReadVideoOptions {
    ReadVideoOptions {
        frames: files.frames.as_ref().map(|f| f.0.clone()),
        frame_rate: files.frame_rate,
        ffmpeg: ffmpeg(),
        ..ReadVideoOptions::default()
    }
}

/// The `ffmpeg` program: `LUZ_FFMPEG`, or the one of that name.
fn ffmpeg() -> PathBuf {
    std::env::var_os("LUZ_FFMPEG").filter(|v| !v.is_empty()).map_or_else(|| PathBuf::from("ffmpeg"), PathBuf::from)
}

impl Start {
    /// Checks what can be checked before the work, and opens the input.
    pub fn new(files: &FileArguments) -> Result<Self, Exit> {
        interrupt::install(files.quiet);
        threads::start(files.threads)?;
        let kind = VideoKind::from_path(&files.input);
        let target = files.output.path();
        match (&kind, &files.output) {
            (Some(_), Target::Image(_)) => {
                return Err(Failure::Usage(format!(
                    "`{}` is a video, but `{}` is one image; name numbered frames, out_%04d.png say, or a video",
                    files.input.display(),
                    target.display()
                ))
                .report());
            }
            (None, Target::Video(_)) => {
                return Err(Failure::Usage(format!(
                    "`{}` is one image, but `{}` is a video; name numbered frames, in_%04d.png say, to be its frames",
                    files.input.display(),
                    target.display()
                ))
                .report());
            }
            _ => {}
        }
        // A pattern is no file: one of its files stands for them.
        let pattern = FramePattern::parse(target).filter(|_| kind.is_some());
        let first = pattern.map_or_else(|| target.to_owned(), |pattern| pattern.path(1));
        let unwritable = output::problems([first.as_path()].into_iter().chain(files.report.as_deref()));
        if !unwritable.is_empty() {
            unwritable.iter().for_each(|problem| problems::error(problem));
            return Err(Exit::Output);
        }
        if kind.is_some() && files.input == target {
            let same = "a video cannot be filtered into itself; give the new one another name";
            return Err(Failure::Usage(same.to_owned()).report());
        }
        let start = Instant::now();
        let input = match kind {
            Some(_) => VideoReader::open(&files.input, &video_options(files)).map(Input::Video).map_err(Failure::from),
            None => Image::read_with(&files.input, &ReadOptions::stored()).map(Input::Image).map_err(Failure::from),
        };
        let input = input.map_err(|failure| failure.report())?;
        let is_interlaced = matches!(&input, Input::Video(reader) if reader.info().is_interlaced());
        if is_interlaced && !files.quiet {
            problems::warning("the video is interlaced; its frames are filtered as if they were progressive");
        }
        Ok(Self { input, seconds: start.elapsed().as_secs_f64() })
    }

    /// What is known of the video; none for an image.
    pub fn video(&self) -> Option<&VideoInfo> {
        match &self.input {
            Input::Image(_) => None,
            Input::Video(reader) => Some(reader.info()),
        }
    }

    /// The image; none for a video.
    pub fn image(&self) -> Option<&Image> {
        match &self.input {
            Input::Image(image) => Some(image),
            Input::Video(_) => None,
        }
    }

    /// Does the work and writes everything. `settings` go into the report.
    pub fn run(
        self,
        command: &'static str,
        files: &FileArguments,
        settings: &impl Serialize,
        work: &mut dyn Work,
    ) -> Exit {
        let ticker = Ticker::new(files.quiet);
        let mut totals = Totals { read: self.seconds, ..Totals::default() };
        let done = match self.input {
            Input::Image(image) => one_image(image, files, work, &ticker, &mut totals),
            Input::Video(reader) => all_frames(reader, files, work, &ticker, &mut totals),
        };
        ticker.finish();
        match done {
            Ok(stopped) => conclude(command, files, settings, &totals, stopped),
            Err(failure) => failure.report(),
        }
    }
}

/// What all frames came to.
#[derive(Default)]
struct Totals {
    frames: u64,
    /// Seconds.
    read: f64,
    filter: f64,
    write: f64,
    excluded_pixels: u64,
    clipped_pixels: u64,
    samples_per_pixel: f64,
    measured_quality: Option<f64>,
    scratch_bytes: usize,
    last: Option<FilterReport>,
}

impl Totals {
    fn add(&mut self, report: FilterReport) {
        self.frames += 1;
        self.filter += report.seconds;
        self.excluded_pixels += report.excluded_pixels;
        self.samples_per_pixel += (report.samples_per_pixel - self.samples_per_pixel) / self.frames as f64;
        self.scratch_bytes = self.scratch_bytes.max(report.scratch_bytes);
        let worst = |a: Option<f64>, b: f64| Some(a.map_or(b, |a| a.min(b)));
        self.measured_quality =
            report.measured_quality.map_or(self.measured_quality, |q| worst(self.measured_quality, q));
        self.last = Some(report);
    }
}

fn one_image(
    image: Image,
    files: &FileArguments,
    work: &mut dyn Work,
    ticker: &Ticker,
    totals: &mut Totals,
) -> Result<Stopped, Failure> {
    let outcome = match work.push(image, ticker)? {
        Some(outcome) => Some(outcome),
        None => work.flush(ticker)?,
    };
    let Some(Outcome { mut image, report, is_display }) = outcome else { return Ok(Stopped::Finished) };
    totals.add(report);
    let Target::Image(file) = &files.output else { return Ok(Stopped::Finished) };
    let start = Instant::now();
    let mut options = WriteOptions::as_read(&image, file.format);
    if is_display {
        options = WriteOptions { bits: options.bits, encoding: None, ..WriteOptions::default() };
        if options.bits == luz::image::BitDepth::Float {
            options.bits = luz::image::BitDepth::Eight;
        }
    } else if file.format.is_float() {
        image.decode_stored();
    } else if options.encoding.is_none() && options.bits != luz::image::BitDepth::Float {
        totals.clipped_pixels = clipped(&image);
    }
    let bytes = image.encode(file.format, &options)?;
    output::write_bytes(&file.path, &bytes)?;
    totals.write += start.elapsed().as_secs_f64();
    Ok(Stopped::Finished)
}

/// Pixels whose light is beyond white.
fn clipped(image: &Image) -> u64 {
    let Some(rgb) = image.rgb() else { return 0 };
    let is_bright = |p: &&[f32]| rgb.iter().any(|&c| p[c] > 1.0);
    image.data().chunks_exact(image.channel_count()).filter(is_bright).count() as u64
}

fn all_frames(
    mut reader: VideoReader,
    files: &FileArguments,
    work: &mut dyn Work,
    ticker: &Ticker,
    totals: &mut Totals,
) -> Result<Stopped, Failure> {
    let path = files.output.path();
    let is_frames = matches!(VideoKind::from_path(path), Some(VideoKind::Frames(_)));
    let options = WriteVideoOptions { sound: Some(files.input.clone()), ffmpeg: ffmpeg(), yuv: None };
    // Sound belongs to the whole video.
    let options = if files.frames.is_some() { WriteVideoOptions { sound: None, ..options } } else { options };
    let mut writer = VideoWriter::create(path, reader.info(), &options)?;
    interrupt::remove_at_exit(writer.temporary_path());
    interrupt::begin_rendering();
    let total = reader.info().frames;
    let mut stopped = Stopped::Finished;
    let mut write = |outcome: Outcome, totals: &mut Totals| -> Result<(), Failure> {
        totals.add(outcome.report);
        let start = Instant::now();
        let image = if is_frames { outcome.image } else { to_stored(outcome.image) };
        {
            let _whole_files_only = interrupt::writing();
            writer.write(&image)?;
        }
        totals.write += start.elapsed().as_secs_f64();
        ticker.frame(totals.frames, total);
        Ok(())
    };
    ticker.frame(0, total);
    loop {
        if interrupt::is_requested() {
            stopped = Stopped::Interrupted;
            break;
        }
        let start = Instant::now();
        let Some(frame) = reader.read()? else { break };
        totals.read += start.elapsed().as_secs_f64();
        if let Some(outcome) = work.push(frame, ticker)? {
            write(outcome, totals)?;
        }
    }
    if stopped == Stopped::Finished {
        while let Some(outcome) = work.flush(ticker)? {
            write(outcome, totals)?;
        }
    }
    let _whole_files_only = interrupt::writing();
    writer.finish()?;
    Ok(stopped)
}

/// What a video stores: light is encoded as it was, or for screens.
fn to_stored(mut image: Image) -> Image {
    if image.metadata.stored_encoding.is_none() {
        image = ToneMap::default().apply_to(&image);
        image.metadata.stored_encoding = Some(Encoding::Srgb);
        image.metadata.encoding = Some(Encoding::Srgb);
    }
    image.encode_stored();
    image
}

/// What was done, as JSON.
#[derive(Serialize)]
struct Report<'a> {
    program: &'static str,
    version: &'static str,
    command: &'static str,
    input: &'a Path,
    output: &'a Path,
    stopped: Stopped,
    settings: serde_json::Value,
    frames: u64,
    /// Of the last frame.
    method: Option<&'a luz::filter::Method>,
    window: Option<usize>,
    window_frames: Option<usize>,
    samples_per_pixel: f64,
    /// In dB; of the worst frame, where it was measured.
    measured_quality: Option<f64>,
    /// Pixels left as they were, since they aren't finite.
    excluded_pixels: u64,
    scratch_bytes: usize,
    seconds: Seconds,
    threads: usize,
    peak_memory_bytes: Option<u64>,
}

/// Wall-clock seconds.
#[derive(Serialize)]
struct Seconds {
    read: f64,
    filter: f64,
    write: f64,
}

fn conclude(
    command: &'static str,
    files: &FileArguments,
    settings: &impl Serialize,
    totals: &Totals,
    stopped: Stopped,
) -> Exit {
    if totals.excluded_pixels > 0 && !files.quiet {
        problems::warning(&format!(
            "{} pixels are infinite or not a number; they are left as they are, and no neighbour is touched by them",
            totals.excluded_pixels
        ));
    }
    if totals.clipped_pixels > 0 && !files.quiet {
        problems::warning(&format!(
            "{} pixels are brighter than white and were clipped; `luz tonemap` compresses them, exr and hdr hold them",
            totals.clipped_pixels
        ));
    }
    let last = totals.last.as_ref();
    let report = Report {
        program: "luz",
        version: env!("CARGO_PKG_VERSION"),
        command,
        input: &files.input,
        output: files.output.path(),
        stopped,
        settings: serde_json::to_value(settings).unwrap_or_default(),
        frames: totals.frames,
        method: last.map(|l| &l.method),
        window: last.map(|l| l.window),
        window_frames: last.map(|l| l.window_frames),
        samples_per_pixel: totals.samples_per_pixel,
        measured_quality: totals.measured_quality,
        excluded_pixels: totals.excluded_pixels,
        scratch_bytes: totals.scratch_bytes,
        seconds: Seconds { read: totals.read, filter: totals.filter, write: totals.write },
        threads: rayon::current_num_threads(),
        peak_memory_bytes: peak_memory(),
    };
    if let Some(path) = &files.report {
        let json = serde_json::to_vec_pretty(&report).map_err(|error| error.to_string());
        let written = json.and_then(|mut json| {
            json.push(b'\n');
            output::write_bytes(path, &json).map_err(|error| error.to_string())
        });
        if let Err(error) = written {
            problems::error(&error);
            return Exit::Output;
        }
    }
    if !files.quiet {
        print(&summary(&report, files.report.as_deref()));
    }
    match stopped {
        Stopped::Interrupted => interrupt::exit(),
        _ => Exit::Success,
    }
}

fn summary(report: &Report<'_>, report_path: Option<&Path>) -> String {
    let mut parts = Vec::new();
    if report.stopped == Stopped::Interrupted {
        parts.push("interrupted".to_owned());
    }
    if report.frames != 1 {
        parts.push(format!("{} frames", report.frames));
    }
    parts.extend(report.method.map(method_text));
    if let Some(window) = report.window {
        let frames = report.window_frames.filter(|n| *n > 1).map_or(String::new(), |n| format!(" × {n} frames"));
        parts.push(format!("{:.0} samples per pixel of {window} × {window}{frames}", report.samples_per_pixel));
    }
    parts.extend(report.measured_quality.map(|q| format!("{q:.1} dB measured")));
    parts.push(progress::duration(report.seconds.filter));
    let files: Vec<String> = [report.output].into_iter().chain(report_path).map(|p| p.display().to_string()).collect();
    format!("{}\nwrote {}\n", parts.join(" · "), files.join(", "))
}

fn method_text(method: &luz::filter::Method) -> String {
    use luz::filter::Method;
    match method {
        Method::Exact => "exact".to_owned(),
        Method::Sampled(sampling) => format!("sampled ({})", sampling.strategy.name()),
        Method::Cosines { .. } => "cosines".to_owned(),
        Method::Auto { .. } => "auto".to_owned(),
    }
}
