//! The grammar of the commands that filter: `luz filter`, `luz tonemap`, `luz enhance`, `luz denoise`.

use super::values::{
    BorderName, DensityName, DistanceName, FrameRange, GuideArgument, MethodName, Samples, ScaleName, StrategyName,
    Target, sigma_range, strength,
};
use crate::program::values::{positive, positive_f64};
use clap::Args;
use luz::image::video::FrameRate;
use std::num::NonZeroU32;
use std::path::PathBuf;

pub const FILTER_HELP: &str = "\
What it computes. Every pixel x becomes a mean of its neighbours y, weighted by how near they are and how alike:

    BF[I](x) = Σ I(y) g(|x − y| / S) g(|I(y) − I(x)| / R) / Σ g(|x − y| / S) g(|I(y) − I(x)| / R),   g(t) = exp(−t²/2)

over a window of k = 2⌈5S/2⌉ + 1 pixels each way. S (--sigma-spatial) says how far one looks, in pixels; R (--sigma-range) \
what counts as alike: edges much higher than R stay, differences much lower than R are smoothed. As R grows, the filter \
becomes a Gaussian blur; as it shrinks, it changes nothing.

Scale. Integers (png, jpg, 8- and 16-bit tiff, video) are compared and averaged as they are stored, encoded, from 0 to 1; \
floats (exr, hdr, pfm) as they are, linear. --scale log compares ratios and suits high dynamic range: R = 0.1 is then a \
difference of 10 %. --distance delta-e compares colours as they are seen, R = 2.3 being just noticeable.

How it computes. All of the window costs k² neighbours (--method exact). Drawn from the Gaussian, n of them estimate the \
same (--method sampled), with an error that falls faster than 1/√n for all strategies but `random`; k to 2k are enough for 45 \
to 50 dB. A guide of one channel needs no samples (--method cosines). Without a method, the fastest is chosen that reaches \
--quality, which is measured on some pixels. Equal input, options and seed give equal bits, for any number of threads.

Guides. With --guide, likeness is that of other images: `--guide flash.png=0.05` compares the pixels of flash.png with \
R = 0.05; `@Ns` are the channels Ns.X, Ns.Y, Ns.Z of the input itself, `file.exr@Albedo=0.1` those of another file. \
Several guides must all agree.

Files. Depth and metadata are kept: a 16-bit PNG stays one, with its profile, Exif and texts; a pixel that the filter leaves \
alone is written as it was read. Channels beside the colour are passed on. Pixels that are not finite stay as they are, do not \
touch their neighbours, and are counted. Videos are .y4m, numbered frames (frame_%04d.png), and whatever an installed ffmpeg \
reads and writes; --sigma-temporal averages over their frames, too.

Examples:
  Smooth a photograph, edges kept, to 50 dB of the exact filter:
    luz filter photo.jpg -o smooth.png --sigma-spatial 8 --sigma-range 0.1
  Denoise an HDR image by ratios of light, with 2k samples per pixel, and say what was done:
    luz filter desk.exr -o clean.exr --sigma-spatial 4 --sigma-range 0.15 --scale log --samples 2k --report a.json
  Smooth a video over space and time:
    luz filter clip.y4m -o calm.y4m --sigma-spatial 3 --sigma-range 0.08 --sigma-temporal 1.5";

/// `luz filter`
#[derive(Debug, Args)]
pub struct FilterArguments {
    /// What to read and write
    #[command(flatten)]
    pub files: FileArguments,
    /// Width of the spatial Gaussian in pixels, 0.1 to 1000
    #[arg(short = 's', long, value_name = "S", value_parser = positive)]
    pub sigma_spatial: f32,
    /// Width of the range Gaussian in the unit of the distance; `inf` blurs
    #[arg(short = 'r', long, value_name = "R", value_parser = sigma_range)]
    pub sigma_range: f32,
    /// Width of the Gaussian over the frames of a video [default: each frame for itself]
    #[arg(long, value_name = "T", value_parser = positive)]
    pub sigma_temporal: Option<f32>,
    /// What is alike is judged by this, not by the input itself: a file, channels of it, and a σ_r of its own. Repeat it
    /// for several
    #[arg(long, value_name = "[FILE][@CHANNELS][=R]")]
    pub guide: Vec<GuideArgument>,
    /// How the difference of two colours is measured
    #[arg(long, value_name = "NAME", default_value = "l2")]
    pub distance: DistanceName,
    /// On which scale values are compared and averaged [default: as they are stored]
    #[arg(long, value_name = "NAME")]
    pub scale: Option<ScaleName>,
    /// Which channels are filtered, separated by commas [default: the colour, or all where there is none]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub channels: Vec<String>,
    /// What lies beyond the edges
    #[arg(long, value_name = "NAME", default_value = "mirror")]
    pub border: BorderName,
    /// How it is computed
    #[command(flatten)]
    pub method: MethodArguments,
}

/// What to read and write.
#[derive(Debug, Args)]
pub struct FileArguments {
    /// The image or video
    #[arg(value_name = "IN")]
    pub input: PathBuf,
    /// Write this file; its extension chooses the format: png, jpg, tiff, exr, hdr, pfm, bmp, tga; y4m, frame_%04d.png, or
    /// what ffmpeg writes
    #[arg(short, long, value_name = "OUT")]
    pub output: Target,
    /// Write a report as JSON: settings, method, samples, times, what was left out
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// Only these frames of a video: first and last, as numbered, else counted from 1
    #[arg(long, value_name = "A-B")]
    pub frames: Option<FrameRange>,
    /// Frames per second of the new video [default: as the old one, or 25 for numbered frames]
    #[arg(long, value_name = "RATE")]
    pub frame_rate: Option<FrameRate>,
    /// Say nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
    /// Threads [default: as many as the machine has]
    #[arg(short, long, value_name = "N")]
    pub threads: Option<NonZeroU32>,
}

/// How the filter is computed.
#[derive(Debug, Args)]
#[command(next_help_heading = "How it is computed")]
pub struct MethodArguments {
    /// The method [default: auto; sampled where samples or a strategy are given]
    #[arg(long, value_name = "NAME")]
    pub method: Option<MethodName>,
    /// How close to the exact filter, in dB of PSNR with a peak of 1, for the methods auto and cosines [default: 50]
    #[arg(long, value_name = "DB", value_parser = positive_f64)]
    pub quality: Option<f64>,
    /// Where samples are taken [default: vogel]
    #[arg(long, value_name = "NAME")]
    pub strategy: Option<StrategyName>,
    /// Samples per pixel: k, a multiple of it like 2k or 0.5k, or a number; k is the width of the window [default: 2k]
    #[arg(long, value_name = "k|2k|N")]
    pub samples: Option<Samples>,
    /// The density of the samples [default: gaussian]
    #[arg(long, value_name = "NAME")]
    pub density: Option<DensityName>,
    /// Fit estimates to the image locally: less noise from few samples, for a small bias
    #[arg(long)]
    pub regression: bool,
    /// Seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
}

pub const TONEMAP_HELP: &str = "\
The logarithm of luminance is split in two by the bilateral filter: a base of large, edge-preserving variations, and the detail \
that remains. Only the base is compressed, to the --contrast wanted, so that details keep their full contrast where the base \
jumps (Durand and Dorsey 2002). The filter's σ_s is --sigma-spatial in fractions of the larger side, its σ_r is \
--sigma-range in powers of ten.

Examples:
  luz tonemap desk.exr -o desk.png
  luz tonemap desk.exr -o desk.jpg --contrast 30 --detail 1.3 --exposure -0.5
  luz render scenes/cornell-box.pbrt -o box.exr && luz tonemap box.exr -o box.png";

/// `luz tonemap`
#[derive(Debug, Args)]
pub struct TonemapArguments {
    /// What to read and write
    #[command(flatten)]
    pub files: FileArguments,
    /// The ratio of the brightest to the darkest base in the picture
    #[arg(long, value_name = "RATIO", default_value_t = 50.0, value_parser = positive)]
    pub contrast: f32,
    /// What detail is multiplied with
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = strength)]
    pub detail: f32,
    /// Brighten the picture by so many stops (EV)
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true, value_parser = crate::program::values::finite)]
    pub exposure: f32,
    /// How colourful the picture is: 0 is grey, 1 keeps the ratios of the components
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = strength)]
    pub saturation: f32,
    /// Width of the spatial Gaussian, as a fraction of the larger side
    #[arg(long, value_name = "S", default_value_t = 0.02, value_parser = positive)]
    pub sigma_spatial: f32,
    /// Width of the range Gaussian in powers of ten of luminance
    #[arg(long, value_name = "R", default_value_t = 0.4, value_parser = positive)]
    pub sigma_range: f32,
    /// How close to the exact filter, in dB of PSNR with a peak of 1 (a power of ten)
    #[arg(long, value_name = "DB", default_value_t = 45.0, value_parser = positive_f64)]
    pub quality: f64,
}

pub const ENHANCE_HELP: &str = "\
Detail is what the bilateral filter takes away: variations lower than σ_r and smaller than σ_s. It is added again, --strength \
times, to the luma of the picture; edges, which the filter keeps, get no halos. A negative strength softens.

Examples:
  luz enhance photo.jpg -o crisp.png
  luz enhance photo.png -o crisp.png --strength 2 --sigma-spatial 4 --sigma-range 0.05
  luz enhance clip.y4m -o soft.y4m --strength -0.7";

/// `luz enhance`
#[derive(Debug, Args)]
pub struct EnhanceArguments {
    /// What to read and write
    #[command(flatten)]
    pub files: FileArguments,
    /// How many times detail is added
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, allow_negative_numbers = true, value_parser = crate::program::values::finite)]
    pub strength: f32,
    /// Width of the spatial Gaussian in pixels
    #[arg(short = 's', long, value_name = "S", default_value_t = 6.0, value_parser = positive)]
    pub sigma_spatial: f32,
    /// Width of the range Gaussian; for floats, of the logarithm of light
    #[arg(short = 'r', long, value_name = "R", default_value_t = 0.1, value_parser = positive)]
    pub sigma_range: f32,
    /// How close to the exact filter, in dB of PSNR with a peak of 1
    #[arg(long, value_name = "DB", default_value_t = 45.0, value_parser = positive_f64)]
    pub quality: f64,
}

pub const DENOISE_HELP: &str = "\
Three kinds of input:

A rendering with the channels Variance, Albedo, Ns and Z, as `luz render --film gbuffer -o a.exr` writes them. Its light is \
divided by albedo, filtered by the guides normal, depth and light itself, with widths from the film's own variance, and \
multiplied again: textures and geometry stay sharp. R, G and B are new; Variance.R, Variance.G and Variance.B become the \
estimated variance that is left, which knows nothing of the bias that smoothing brings.

An image without these: its noise is measured, and the bilateral filter is given a range of --strength times that.

A video: the same, over space and time.

Examples:
  luz render scenes/cornell-box.pbrt --film gbuffer --spp 16 -o noisy.exr && luz denoise noisy.exr -o clean.exr
  luz denoise photo.png -o clean.png --strength 1.5
  luz denoise clip.y4m -o clean.y4m --sigma-temporal 2";

/// `luz denoise`
#[derive(Debug, Args)]
pub struct DenoiseArguments {
    /// What to read and write
    #[command(flatten)]
    pub files: FileArguments,
    /// How far values may differ, relative to their noise, to be averaged: more is smoother
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = positive)]
    pub strength: f32,
    /// Width of the spatial Gaussian in pixels [default: 4 for renderings, 2 for images, 1.2 for videos]
    #[arg(short = 's', long, value_name = "S", value_parser = positive)]
    pub sigma_spatial: Option<f32>,
    /// Width of the Gaussian over the frames of a video
    #[arg(long, value_name = "T", default_value_t = 1.5, value_parser = positive)]
    pub sigma_temporal: f32,
    /// The standard deviation of the noise of an image or a video [default: measured]
    #[arg(long, value_name = "SIGMA", value_parser = positive)]
    pub noise: Option<f32>,
    /// Seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
}
