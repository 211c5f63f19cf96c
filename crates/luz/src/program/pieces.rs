//! The grammar of budgets, checkpoints, shards and traces.

use super::arguments::OverrideArguments;
use super::piece_values::{Period, PixelName, RenderOutput, SampleName};
use super::values::{Share, ToneMapName};
use clap::Args;
use luz::render::Shard;
use std::path::PathBuf;

/// When it is enough: whichever comes first.
#[derive(Debug, Args)]
#[command(next_help_heading = "When to stop, besides --spp: whichever comes first")]
pub struct BudgetArguments {
    /// Stop after so long: 90s, 10m, 1h30m. Without --spp, samples are not limited
    #[arg(long, value_name = "TIME")]
    pub time: Option<Period>,
    /// Stop when pixels have this relative standard error in the mean, the worst hundredth left out: 1%, say. Without
    /// --spp, samples are not limited
    #[arg(long, value_name = "ERROR")]
    pub error: Option<Share>,
}

/// Rendering in pieces: one after the other, or on several machines.
#[derive(Debug, Args)]
#[command(next_help_heading = "In pieces")]
pub struct PieceArguments {
    /// Keep the state of the render in this file, to resume it from
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,
    /// How often the checkpoint is written; less often where copying the state would take more than 1 % of the time
    #[arg(long, value_name = "TIME", default_value = "30s")]
    pub every: Period,
    /// Go on with a render from its checkpoint: with the scene and options that it was begun with, for more samples or
    /// time if so wished. (The points of samplers stay laid out for the --spp that it was begun with.)
    #[arg(long, value_name = "FILE")]
    pub resume: Option<PathBuf>,
    /// Render the I-th of N parts of the frame into a .luz file, for `luz merge`
    #[arg(long, value_name = "I/N", conflicts_with = "resume")]
    pub shard: Option<Shard>,
    /// Render but one sample and say everything about it, as `luz trace` does
    #[arg(long, value_name = "X,Y,SAMPLE", conflicts_with_all = ["resume", "shard"])]
    pub replay: Option<SampleName>,
}

/// The end of `luz plan --help`.
pub const PLAN_HELP: &str = "\
Prints one command for each shard, and the one that merges them. Shards can be rendered on any machines, in any order, \
more than once. No pixel is in two shards; merged, they have the bits that one render of the whole frame has.

Example:
  luz plan scenes/cornell-box.pbrt --shards 4 --spp 1024 > jobs.sh";

/// `luz plan`
#[derive(Debug, Args)]
pub struct PlanArguments {
    /// The scene, a pbrt-v4 file (.pbrt, .pbrt.gz)
    pub scene: PathBuf,
    /// How many parts
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(Shard::MOST)))]
    pub shards: u32,
    /// What to render otherwise than the scene says
    #[command(flatten)]
    pub overrides: OverrideArguments,
}

/// The end of `luz merge --help`.
pub const MERGE_HELP: &str = "\
Parts may come in any order, and more than once; the result is the same. Missing shards are named; --partial merges \
what is there, and leaves the rest of the picture black.

Examples:
  luz merge part-*.luz -o picture.exr -o picture.png
  luz merge part-1.luz part-3.luz --partial -o preview.png
  luz merge part-1.luz part-2.luz --partial -o half.luz";

/// `luz merge`
#[derive(Debug, Args)]
pub struct MergeArguments {
    /// Checkpoints (.luz) of one frame
    #[arg(required = true)]
    pub parts: Vec<PathBuf>,
    /// Write this file, as in `luz render`; luz for the parts in one file. Repeat it for several
    #[arg(short, long, value_name = "FILE", required = true)]
    pub output: Vec<RenderOutput>,
    /// Merge what is there, though shards are missing or unfinished
    #[arg(long)]
    pub partial: bool,
    /// Brighten the tone-mapped pictures by so many stops (EV)
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true, value_parser = super::values::finite)]
    pub exposure: f32,
    /// How light beyond white is shown in the tone-mapped pictures
    #[arg(long, value_name = "NAME", default_value = "clip")]
    pub tone_map: ToneMapName,
    /// Say nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// The end of `luz trace --help`.
pub const TRACE_HELP: &str = "\
Prints a path vertex by vertex: where it is, what it meets, how light is looked for there and with which densities and \
weights, where it goes on and with which throughput. Densities are in solid angle (1/sr); spectra are printed by their \
mean and, in brackets, their smallest and largest value over the path's wavelengths.

The sample is the one that `luz render` draws with the same options. (Roulette by efficiency is drawn as roulette by \
throughput: what it had learned by then is not known here.)

Example:
  luz trace scenes/cornell-box.pbrt --pixel 200,150 --sample 3";

/// `luz trace`
#[derive(Debug, Args)]
pub struct TraceArguments {
    /// The scene, a pbrt-v4 file (.pbrt, .pbrt.gz)
    pub scene: PathBuf,
    /// The pixel in the frame, from the top left corner
    #[arg(long, value_name = "X,Y")]
    pub pixel: PixelName,
    /// The number of the sample
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub sample: u32,
    /// Which half of the pixel, with adaptive sampling
    #[arg(long, value_name = "0|1", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..2))]
    pub half: u32,
    /// What to render otherwise than the scene says
    #[command(flatten)]
    pub overrides: OverrideArguments,
}
