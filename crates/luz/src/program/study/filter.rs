//! `luz study filter`

use crate::program::exit::{Exit, print};
use crate::program::filtering::values::{Multiple, Pixel, StrategyName};
use crate::program::values::positive;
use crate::program::{interrupt, output, problems, progress, threads};
use clap::Args;
use luz::filter::{FilterError, Strategy};
use luz::image::{Image, ReadOptions};
use luz::study::filter::{FilterOutcome, FilterStudy, FilterStudyError, page, run as run_study};
use std::num::NonZeroU32;
use std::ops::ControlFlow;
use std::path::PathBuf;

pub const HELP: &str = "\
Shows on one page, which needs no network: the kernel of the bilateral filter at some pixels (it is another one at each: flat \
places, edges, corners), the point sets of the strategies, the filtered images with their errors, and quality against samples and \
time for every strategy, with error bars over the seeds.

Images are cut to their middle, --size pixels on a side at most. Ctrl-C writes the seeds that are complete.

Examples:
  luz study filter photo.png
  luz study filter photo.png desk.exr --kernel-at 120,80 --kernel-at 300,200 --seeds 10 -o filter.html";

/// `luz study filter`
#[derive(Debug, Args)]
pub struct FilterStudyArguments {
    /// The images
    #[arg(value_name = "IN", required = true)]
    pub inputs: Vec<PathBuf>,
    /// The report
    #[arg(short, long, value_name = "FILE", default_value = "filter-study.html", value_parser = super::arguments::html)]
    pub output: PathBuf,
    /// Width of the spatial Gaussian in pixels
    #[arg(short = 's', long, value_name = "S", default_value_t = 8.0, value_parser = positive)]
    pub sigma_spatial: f32,
    /// Width of the range Gaussian
    #[arg(short = 'r', long, value_name = "R", default_value_t = 0.1, value_parser = positive)]
    pub sigma_range: f32,
    /// Show the kernel of this pixel, counted from the top left of the part that is studied. Repeat it for several
    /// [default: a flat place, an edge, a corner]
    #[arg(long, value_name = "X,Y")]
    pub kernel_at: Vec<Pixel>,
    /// Only these strategies, separated by commas
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub strategies: Vec<StrategyName>,
    /// Numbers of samples, as multiples of the window's width k, separated by commas
    #[arg(long, value_name = "MULTIPLES", value_delimiter = ',', default_value = "0.25k,0.5k,k,2k,4k")]
    pub samples: Vec<Multiple>,
    /// Seeds that everything is repeated with
    #[arg(long, value_name = "N", default_value = "5")]
    pub seeds: NonZeroU32,
    /// The largest side of the part of an image that is studied, in pixels
    #[arg(long, value_name = "PIXELS", default_value = "768")]
    pub size: NonZeroU32,
    /// Say nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
    /// Threads [default: as many as the machine has]
    #[arg(short, long, value_name = "N")]
    pub threads: Option<NonZeroU32>,
}

/// Studies the images and writes the report.
pub fn run(arguments: &FilterStudyArguments) -> Exit {
    match study(arguments) {
        Ok(exit) | Err(exit) => exit,
    }
}

fn study(arguments: &FilterStudyArguments) -> Result<Exit, Exit> {
    interrupt::install(arguments.quiet);
    threads::start(arguments.threads)?;
    let unwritable = output::problems([arguments.output.as_path()]);
    if !unwritable.is_empty() {
        unwritable.iter().for_each(|problem| problems::error(problem));
        return Err(Exit::Output);
    }
    let mut samples: Vec<f32> = arguments.samples.iter().map(|m| m.0).collect();
    samples.sort_by(f32::total_cmp);
    samples.dedup();
    let study = FilterStudy {
        sigma_spatial: arguments.sigma_spatial,
        sigma_range: arguments.sigma_range,
        strategies: if arguments.strategies.is_empty() {
            Strategy::ALL.to_vec()
        } else {
            arguments.strategies.iter().map(|&s| s.into()).collect()
        },
        samples,
        seeds: arguments.seeds.get(),
        kernels_at: arguments.kernel_at.iter().map(|p| p.0).collect(),
    };
    // All images are read before the first is studied: what is wrong with the last is known at once.
    let images: Vec<Image> = read_all(arguments)?;
    let ticker = crate::program::filtering::ticker::Ticker::new(arguments.quiet);
    interrupt::begin_rendering();
    let mut outcomes: Vec<FilterOutcome> = Vec::new();
    for (index, (path, image)) in arguments.inputs.iter().zip(&images).enumerate() {
        let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
        let mut tell = |done: f64| {
            ticker.update(((index as f64 + done) * 1000.0) as u64, 1000 * images.len() as u64);
            if interrupt::is_requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        match run_study(&study, &name, image, &mut tell) {
            Ok(outcome) => outcomes.push(outcome),
            Err(FilterStudyError::Stopped) => break,
            Err(error) => {
                ticker.finish();
                return Err(explain(&error));
            }
        }
    }
    ticker.finish();
    if outcomes.is_empty() {
        problems::error("interrupted before any image had been studied; nothing was written");
        return Err(Exit::Interrupted);
    }
    let html = page(&outcomes, Some(&super::command_line())).map_err(|error| {
        problems::error(&error.to_string());
        Exit::Image
    })?;
    output::write_bytes(&arguments.output, html.as_bytes()).map_err(|error| {
        problems::error(&error.to_string());
        Exit::Output
    })?;
    if !arguments.quiet {
        let size = progress::bytes(html.len() as u64);
        print(&format!("wrote {} (the report has {size})\n", arguments.output.display()));
    }
    Ok(if interrupt::is_requested() { Exit::Interrupted } else { Exit::Success })
}

/// The middle of every image.
fn read_all(arguments: &FilterStudyArguments) -> Result<Vec<Image>, Exit> {
    let read = |path: &PathBuf| {
        let image = Image::read_with(path, &ReadOptions::stored())?;
        let size = |full: usize| full.min(arguments.size.get() as usize);
        let (width, height) = (size(image.width()), size(image.height()));
        image.crop((image.width() - width) / 2, (image.height() - height) / 2, width, height)
    };
    let mut images = Vec::new();
    for path in &arguments.inputs {
        match read(path) {
            Ok(image) => images.push(image),
            Err(error) => problems::error(&error.to_string()),
        }
    }
    if images.len() == arguments.inputs.len() { Ok(images) } else { Err(Exit::Image) }
}

fn explain(error: &FilterStudyError) -> Exit {
    problems::error(&error.to_string());
    match error {
        FilterStudyError::Filter(FilterError::Image(_)) | FilterStudyError::Image(_) => Exit::Image,
        FilterStudyError::Filter(_) | FilterStudyError::NoSuchPixel { .. } => Exit::Usage,
        FilterStudyError::Stopped => Exit::Interrupted,
    }
}
