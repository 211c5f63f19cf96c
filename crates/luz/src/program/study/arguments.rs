//! The grammar of `luz study`.

use super::axes::{AXES, AxisKind};
use super::filter::FilterStudyArguments;
use crate::program::arguments::OverrideArguments;
use crate::program::piece_values::Period;
use crate::program::values::{SimdName, ToneMapName};
use clap::{Args, Subcommand};
use luz::render::Overrides;
use std::fmt::Write;
use std::num::NonZeroU32;
use std::path::PathBuf;
use std::str::FromStr;

/// `luz study`
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct StudyArguments {
    /// What to study instead of a scene.
    #[command(subcommand)]
    pub command: Option<StudyCommand>,
    /// The scene, a pbrt-v4 file (.pbrt, .pbrt.gz)
    #[arg(required = true)]
    pub scene: Option<PathBuf>,
    /// What to vary, and its values. Repeat it: all combinations are rendered, and the first is what the others are compared with
    #[arg(long, value_name = "AXIS=VALUE,…", required = true)]
    pub vary: Vec<Vary>,
    /// Render each variant with each seed for so long: 30s, 500ms, 2min
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    pub time: Option<f64>,
    /// Seeds that each variant is rendered with, counting up from that of the scene
    #[arg(long, value_name = "N", default_value = "4")]
    pub seeds: NonZeroU32,
    /// Compare with this image (exr, pfm), of the frame's size or of the crop window's; its channels Variance.R, Variance.G and
    /// Variance.B, if it has them, tell its own error
    #[arg(long, value_name = "FILE", conflicts_with = "reference_spp")]
    pub reference: Option<PathBuf>,
    /// Samples per pixel of the reference that is rendered otherwise, at least 2 [default: 16 times as many as a variant gets]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..))]
    pub reference_spp: Option<u32>,
    /// Keep the reference that was rendered, with its variance, for --reference
    #[arg(long, value_name = "FILE", conflicts_with = "reference", value_parser = exr)]
    pub save_reference: Option<PathBuf>,
    /// The report; numbers are written beside it, as .json and .csv
    #[arg(short, long, value_name = "FILE", default_value = "study.html", value_parser = html)]
    pub output: PathBuf,
    /// The report's heading [default: the scene and what was varied]
    #[arg(long, value_name = "TEXT")]
    pub title: Option<String>,
    /// Brighten the pictures by so many stops (EV)
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true, value_parser = crate::program::values::finite)]
    pub exposure: f32,
    /// How light beyond white is shown in the pictures
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
    /// What all variants and the reference render otherwise than the scene says.
    #[command(flatten)]
    pub overrides: OverrideArguments,
}

/// What to study instead of a scene.
#[derive(Debug, Subcommand)]
pub enum StudyCommand {
    /// Compare strategies of sampling the bilateral filter: kernels, point sets, pictures, errors
    #[command(after_help = super::filter::HELP)]
    Filter(FilterStudyArguments),
}

/// The help that follows the options.
pub fn help() -> String {
    let mut axes = String::new();
    for axis in AXES {
        let _ = writeln!(axes, "  {:<18}{}", axis.name, axis.known());
    }
    format!(
        "\
What can be varied (as with `luz render`):
{axes}
Budget: each variant is rendered with each seed, V × S renders in all. --time ends a render after so many seconds; how many samples fit \
is tried first. --spp (or an axis spp) ends it after so many samples. With both, whichever is reached first; with neither, the scene's \
own samples per pixel.

Fairness: with each seed, the variants take turns, pass by pass, so that a noisy machine disturbs all of them alike. Only passes are timed.

Reference: without --reference, the scene is rendered as it stands (with the options given, without any axis), with more samples, in four \
parts of seeds of their own. Their differences tell the reference's own error, for every sampler; it is subtracted from all errors. An axis \
that changes what the picture converges to (max-depth, filter) shows as bias.

Numbers: efficiency is 1 / (error · time), relative to the first variant. Intervals have a confidence of 95 %, from Student's t over the \
seeds; with one seed there are none. Slopes are those of log error over log samples (or time), fitted for each seed.

Pictures of what each technique finds are added where technique or mis is varied (or with --technique-images); they are rendered after \
everything that is timed.

The report is one HTML file with all pictures in it: --resolution keeps it small.

Ctrl-C finishes the pass, writes the report with the seeds that are complete, and exits with code 130.

Examples:
  luz study scenes/veach-mis.pbrt --vary technique=bsdf,light,both --time 30s
  luz study scenes/veach-mis.pbrt --vary technique=light,both --vary mis=balance,power
  luz study scenes/cornell-box.pbrt --vary sampler=independent,sobol --resolution 200x200
  luz study scene.pbrt --vary roulette=none,throughput --seeds 8 --reference ref.exr
  luz study scene.pbrt --vary sampler=sobol --time 1min --save-reference ref.exr"
    )
}

/// An axis with the values that were asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Vary {
    /// Its name, which is known.
    pub axis: String,
    /// Its values, which are known; at least one, none twice.
    pub values: Vec<String>,
}

impl FromStr for Vary {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let (name, values) = text.split_once('=').ok_or("expected AXIS=VALUE,…, sampler=sobol,halton say")?;
        let axis = AxisKind::find(name.trim())?;
        let values: Vec<String> = values.split(',').map(|v| v.trim().to_owned()).filter(|v| !v.is_empty()).collect();
        if values.is_empty() {
            return Err(format!("`{}` has no values; known are {}", axis.name, axis.known()));
        }
        for (index, value) in values.iter().enumerate() {
            axis.apply(&mut Overrides::default(), value)?;
            if values[..index].contains(value) {
                return Err(format!("`{value}` stands there twice"));
            }
        }
        Ok(Self { axis: axis.name.to_owned(), values })
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    text.parse::<Period>().map(|period| period.0.as_secs_f64())
}

pub fn html(text: &str) -> Result<PathBuf, String> {
    with_extension(text, &["html", "htm"])
}

fn exr(text: &str) -> Result<PathBuf, String> {
    with_extension(text, &["exr"])
}

fn with_extension(text: &str, known: &[&str]) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let fits = path.extension().is_some_and(|e| known.iter().any(|k| e.eq_ignore_ascii_case(k)));
    if fits { Ok(path) } else { Err(format!("expected a file whose name ends in .{}", known[0])) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times() {
        let same = |text: &str, expected: f64| assert!((seconds(text).unwrap() - expected).abs() < 1e-12, "{text}");
        same("30s", 30.0);
        same("500ms", 0.5);
        same("2min", 120.0);
        same("1.5 h", 5400.0);
        same("7", 7.0);
        same("1e-1s", 0.1);
        for wrong in ["0s", "0", "-1s", "", "s", "soon", "3 parsecs", "nan", "inf", "1e999s"] {
            assert!(seconds(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn axes_have_known_values() {
        let vary = "sampler=sobol, halton".parse::<Vary>().unwrap();
        assert_eq!((vary.axis.as_str(), vary.values.len()), ("sampler", 2));
        for (wrong, reason) in [
            ("sampler", "AXIS=VALUE"),
            ("sampler=", "no values"),
            ("sampler=,", "no values"),
            ("sampler=sobal", "did you mean `sobol`?"),
            ("sampeler=sobol", "did you mean `sampler`?"),
            ("sampler=sobol,sobol", "twice"),
            ("technique=boht", "both"),
            ("spp=0", "above zero"),
        ] {
            let error = wrong.parse::<Vary>().unwrap_err();
            assert!(error.contains(reason), "{error}");
        }
    }

    #[test]
    fn outputs_have_the_right_extensions() {
        assert!(html("a/b.HTML").is_ok() && exr("x.exr").is_ok());
        assert!(html("a.png").is_err() && html("study").is_err() && exr("x.png").is_err());
    }
}
