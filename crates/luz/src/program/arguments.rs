//! The command line's grammar.

use super::exit::EXIT_CODES;
use super::filtering::arguments::{
    DENOISE_HELP, DenoiseArguments, ENHANCE_HELP, EnhanceArguments, FILTER_HELP, FilterArguments, TONEMAP_HELP,
    TonemapArguments,
};
use super::metropolis::MetropolisArguments;
use super::piece_values::RenderOutput;
use super::pieces::{
    BudgetArguments, MERGE_HELP, MergeArguments, PLAN_HELP, PieceArguments, PlanArguments, TRACE_HELP, TraceArguments,
};
use super::study::StudyArguments;
use super::values::{
    CropArgument, ErrorName, FilmName, FilterName, IntegratorName, OutputFile, Resolution, SamplerName, Share,
    SimdName, Threshold, ToneMapName,
};
use clap::builder::styling::{AnsiColor, Styles};
use clap::{Args, Parser, Subcommand};
use luz::render::integrator::Technique;
use luz::render::light::LightSampler;
use luz::sample::mis::Heuristic;
use luz::sample::roulette::Roulette;
use std::num::NonZeroU32;
use std::path::PathBuf;

const STYLES: Styles = Styles::styled()
    .header(AnsiColor::Green.on_default().bold())
    .usage(AnsiColor::Green.on_default().bold())
    .literal(AnsiColor::Cyan.on_default().bold())
    .placeholder(AnsiColor::Cyan.on_default());

const EXAMPLES: &str = "\
Examples:
  luz render scenes/cornell-box.pbrt
  luz info scenes/cornell-box.pbrt
  luz compare cornell-box.exr reference.exr -o error.png
  luz study scenes/cornell-box.pbrt --vary sampler=independent,sobol --time 10s
  luz filter photo.jpg -o smooth.png --sigma-spatial 8 --sigma-range 0.1

";

/// Monte Carlo imaging: renders pbrt-v4 scenes, compares pictures, filters images and videos
#[derive(Debug, Parser)]
#[command(name = "luz", version, styles = STYLES, after_help = format!("{EXAMPLES}{EXIT_CODES}"))]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene
    #[command(after_help = RENDER_HELP, args_override_self = true)]
    Render(Box<RenderArguments>),
    /// Split a render into shards: prints the commands
    #[command(after_help = PLAN_HELP)]
    Plan(Box<PlanArguments>),
    /// Put the shards of a render together
    #[command(after_help = MERGE_HELP)]
    Merge(MergeArguments),
    /// Follow one sample of one pixel, vertex by vertex
    #[command(after_help = TRACE_HELP)]
    Trace(Box<TraceArguments>),
    /// Say what is inside a scene, and what of it cannot be rendered
    #[command(after_help = INFO_HELP)]
    Info(InfoArguments),
    /// Compare an image with a reference
    #[command(after_help = COMPARE_HELP)]
    Compare(CompareArguments),
    /// Compare ways of rendering a scene: errors, times, efficiencies, in a report to look at
    #[command(after_help = super::study::help())]
    Study(Box<StudyArguments>),
    /// Smooth an image or a video but keep its edges: the bilateral filter
    #[command(after_help = FILTER_HELP)]
    Filter(FilterArguments),
    /// Fit an HDR image into what a screen shows, details kept
    #[command(after_help = TONEMAP_HELP)]
    Tonemap(TonemapArguments),
    /// Strengthen or soften the detail of an image or a video
    #[command(after_help = ENHANCE_HELP)]
    Enhance(EnhanceArguments),
    /// Take noise out of a rendering, a photograph or a video
    #[command(after_help = DENOISE_HELP)]
    Denoise(DenoiseArguments),
    /// Say what exit codes mean
    #[command(name = "exit-codes", help_template = "{after-help}", after_help = EXIT_CODES, hide = true)]
    ExitCodes,
    /// Print a completion script for a shell
    #[command(after_help = "Examples:\n  luz completions bash > ~/.local/share/bash-completion/completions/luz\n  \
        luz completions zsh > ~/.zfunc/_luz\n  luz completions fish > ~/.config/fish/completions/luz.fish")]
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
}

const RENDER_HELP: &str = "\
Without -o, two files are written to the current directory, named as the scene's film says (or else as the scene): a \
linear EXR with the variance of every pixel, and beside it a tone-mapped PNG. With -o, just the files named.

Ctrl-C finishes the pass, writes what has been rendered by then, and exits with code 130; a second one exits at once.

Equal scene, seed and samples give equal bits, for any number of threads.

Examples:
  luz render scenes/cornell-box.pbrt
  luz render scene.pbrt -o picture.png --exposure 1
  luz render scene.pbrt -o out.exr -o out.png --spp 256 --resolution 640x360
  luz render scene.pbrt --crop 0.25,0.75,0.25,0.75 --spp 16 --report a.json
  luz render scene.pbrt --time 10m --error 1% --checkpoint scene.luz
  luz render --resume scene.luz --time 10m";

/// `luz render`
#[derive(Debug, Args)]
pub struct RenderArguments {
    /// The scene, a pbrt-v4 file (.pbrt, .pbrt.gz)
    #[arg(required_unless_present = "resume")]
    pub scene: Option<PathBuf>,
    /// Write this file; its extension chooses the format: exr, pfm, hdr (linear), png, jpg, tiff (tone-mapped), luz
    /// (a checkpoint, to go on with or to merge). Repeat it for several
    #[arg(short, long, value_name = "FILE", alias = "outfile")]
    pub output: Vec<RenderOutput>,
    /// Write a report as JSON: settings, samples, times, rays, error, what is in the scene
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// Brighten the tone-mapped pictures by so many stops (EV); the EXR stays as it is
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true, value_parser = super::values::finite)]
    pub exposure: f32,
    /// How light beyond white is shown in the tone-mapped pictures
    #[arg(long, value_name = "NAME", default_value = "clip")]
    pub tone_map: ToneMapName,
    /// Say nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
    /// Threads [default: as many as the machine has]
    #[arg(short, long, value_name = "N", alias = "nthreads")]
    pub threads: Option<NonZeroU32>,
    /// Instruction set of ray traversal
    #[arg(long, value_name = "SET", default_value = "auto")]
    pub simd: SimdName,
    /// When it is enough
    #[command(flatten)]
    pub budget: BudgetArguments,
    /// Rendering in pieces
    #[command(flatten)]
    pub pieces: PieceArguments,
    /// What to render otherwise than the scene says
    #[command(flatten)]
    pub overrides: OverrideArguments,
}

/// What to render otherwise than the scene says.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Instead of what the scene says")]
pub struct OverrideArguments {
    /// Samples per pixel
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub spp: Option<u32>,
    /// Width and height of the frame in pixels
    #[arg(long, value_name = "WxH")]
    pub resolution: Option<Resolution>,
    /// Render a part of the frame only: x0,x1,y0,y1 from the top left corner, as fractions (none above 1) or in pixels
    /// (`0,1,0,1px` where it could be either)
    #[arg(long, value_name = "X0,X1,Y0,Y1", visible_alias = "cropwindow")]
    pub crop: Option<CropArgument>,
    /// Seed of all random numbers
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Integrator: path, light (light tracing), bdpt (bidirectional), pssmlt, mmlt, mlt (Metropolis: in primary space,
    /// multiplexed, over paths). What pbrt-v4's scenes call mlt is mmlt here, and lightpath is light
    #[arg(long, value_name = "NAME")]
    pub integrator: Option<IntegratorName>,
    /// Longest path, in scattering events
    #[arg(long, value_name = "N", alias = "maxdepth")]
    pub max_depth: Option<u32>,
    /// Sampler
    #[arg(long, value_name = "NAME")]
    pub sampler: Option<SamplerName>,
    /// Pixel filter, of the radius that pbrt-v4 gives it
    #[arg(long, value_name = "NAME")]
    pub filter: Option<FilterName>,
    /// Film: gbuffer adds albedo, normals, position and depth to the EXR
    #[arg(long, value_name = "NAME")]
    pub film: Option<FilmName>,
    /// How lights are chosen: bvh, power, uniform
    #[arg(long, value_name = "NAME")]
    pub light_sampler: Option<LightSampler>,
    /// Whether environment maps leave dim directions to the BSDF where both are combined (MIS compensation)
    #[arg(long, value_name = "BOOL")]
    pub mis_compensation: Option<bool>,
    /// Which techniques look for direct light: bsdf, light, both
    #[arg(long, value_name = "NAME")]
    pub technique: Option<Technique>,
    /// How the techniques are combined: balance, power, power:BETA, cutoff, cutoff:ALPHA, maximum,
    /// average, optimal
    #[arg(long, value_name = "HEURISTIC")]
    pub mis: Option<Heuristic>,
    /// How paths end before they are longest: none, throughput; or efficiency, which also splits them where that is
    /// worth its rays (EARS)
    #[arg(long, value_name = "NAME")]
    pub roulette: Option<Roulette>,
    /// Sample each pixel until its relative error is so small, but no more than --spp times: 2 %, say
    #[arg(long, value_name = "ERROR")]
    pub adaptive: Option<Share>,
    /// Add to the EXR what each technique of finding direct light contributes, weighted and as if it were alone
    #[arg(long)]
    pub technique_images: bool,
    /// Weigh the insides of rough coats as pbrt-v4 does, which makes them too bright: for comparisons with its pictures
    #[arg(long)]
    pub pbrt_coats: bool,
    /// How chains are made.
    #[command(flatten)]
    pub metropolis: MetropolisArguments,
}

impl OverrideArguments {
    /// Itself as a command line.
    pub fn to_arguments(&self) -> Vec<String> {
        let mut all = Vec::new();
        let mut add = |name: &str, value: Option<String>| {
            if let Some(value) = value {
                all.extend([format!("--{name}"), value]);
            }
        };
        let text = |value: &dyn std::fmt::Display| value.to_string();
        add("spp", self.spp.map(|v| text(&v)));
        add("resolution", self.resolution.map(|v| text(&v)));
        add("crop", self.crop.map(|v| text(&v)));
        add("seed", self.seed.map(|v| text(&v)));
        add("integrator", self.integrator.and_then(possible_name));
        add("max-depth", self.max_depth.map(|v| text(&v)));
        add("sampler", self.sampler.and_then(possible_name));
        add("filter", self.filter.and_then(possible_name));
        add("film", self.film.and_then(possible_name));
        add("light-sampler", self.light_sampler.map(|v| text(&v)));
        add("mis-compensation", self.mis_compensation.map(|v| text(&v)));
        add("technique", self.technique.map(|v| text(&v)));
        add("mis", self.mis.map(|v| text(&v)));
        add("roulette", self.roulette.map(|v| text(&v)));
        add("adaptive", self.adaptive.map(|v| text(&v.0)));
        let switches = [("--technique-images", self.technique_images), ("--pbrt-coats", self.pbrt_coats)];
        all.extend(switches.iter().filter(|(_, is_on)| *is_on).map(|(name, _)| (*name).to_owned()));
        for (name, value) in self.metropolis.to_arguments() {
            all.push(format!("--{name}"));
            all.extend(value);
        }
        all
    }
}

fn possible_name(value: impl clap::ValueEnum) -> Option<String> {
    value.to_possible_value().map(|name| name.get_name().to_owned())
}

const INFO_HELP: &str = "\
Everything that is wrong with the scene, or cannot be rendered yet, is listed with its place; the exit code is then 3.

Examples:
  luz info scenes/cornell-box.pbrt
  luz info scene.pbrt --json | jq .triangles";

/// `luz info`
#[derive(Debug, Args)]
pub struct InfoArguments {
    /// The scene, a pbrt-v4 file (.pbrt, .pbrt.gz)
    pub scene: PathBuf,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

const COMPARE_HELP: &str = "\
Metrics, per channel and over all of them:
  MSE     mean of (image − reference)²
  relMSE  mean of (image − reference)² / (reference² + 0.01)
  MAE     mean of |image − reference|
  PSNR    10 log₁₀(peak² / MSE) in decibels
  SSIM    structural similarity, 1 for equal images
  z-test  have two Monte Carlo estimates the same mean?

The z-test divides the difference of each pixel and channel by the root of both variances. Each of the n tests has the \
level 1 − (1 − α)^(1/n) (Šidák), so that equal means are called different with probability α (0.01, if the threshold \
says no other), if pixels are normal. Pixels of few samples, or that rare paths light, are not, and their variances are \
underestimated; tiles of 16 × 16 pixels, which are tested likewise, are more robust and see smaller biases. It needs \
the variances of the means: channels Variance.R, Variance.G and Variance.B, as luz writes them, or files given by \
--variance-a and --variance-b.

Thresholds: mse, relmse and mae fail above their value, psnr and ssim below, z-test=α and tile-z-test=α where \
the test finds a difference.

Examples:
  luz compare image.exr reference.exr
  luz compare image.exr reference.exr -o error.png --threshold relmse=1e-3
  luz compare a.exr b.exr --variance-b b.var.exr --threshold z-test=0.01";

/// `luz compare`
#[derive(Debug, Args)]
pub struct CompareArguments {
    /// The image
    #[arg(value_name = "IMAGE")]
    pub a: PathBuf,
    /// What it should look like, of the same size
    #[arg(value_name = "REFERENCE")]
    pub b: PathBuf,
    /// Write a map of the error: in false colours (png, jpg, tiff …), or image − reference itself (exr, pfm)
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<OutputFile>,
    /// What the false colours show
    #[arg(long, value_name = "NAME", default_value = "absolute")]
    pub error: ErrorName,
    /// The error that gets the brightest colour [default: what 99 % of the pixels stay below]
    #[arg(long, value_name = "ERROR", value_parser = super::values::positive)]
    pub scale: Option<f32>,
    /// White, for PSNR and SSIM
    #[arg(long, value_name = "VALUE", default_value_t = 1.0, value_parser = super::values::positive_f64)]
    pub peak: f64,
    /// Exit with code 1 beyond this: mse, relmse, mae, psnr, ssim, z-test or tile-z-test. Repeat it for several
    #[arg(long, value_name = "METRIC=VALUE")]
    pub threshold: Vec<Threshold>,
    /// Variance of the image's means, where it has no channels for it
    #[arg(long, value_name = "FILE")]
    pub variance_a: Option<PathBuf>,
    /// Variance of the reference's means, where it has no channels for it
    #[arg(long, value_name = "FILE")]
    pub variance_b: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_grammar_is_sound() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn the_help_names_every_exit_code() {
        let help = Arguments::command().render_long_help().to_string();
        for code in ["0 ", "1 ", "2 ", "3 ", "4 ", "5 ", "6 ", "7 ", "130 ", "143 "] {
            assert!(help.lines().any(|line| line.trim_start().starts_with(code)), "{code} in {help}");
        }
    }
}
