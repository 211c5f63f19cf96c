//! `luz compare`

mod z_test;

use super::arguments::CompareArguments;
use super::exit::{Exit, print};
use super::output;
use super::problems;
use super::values::{Metric, OutputFile, Threshold};
use luz::image::metrics::{self, CompareOptions, Comparison, Difference, ErrorMeasure};
use luz::image::{Format, Image, ImageError, ToneMap};
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;
use z_test::{Estimate, SIGNIFICANCE, TILE, ZTest};

/// Compares an image with a reference.
pub fn run(arguments: &CompareArguments) -> Exit {
    match compare(arguments) {
        Ok(exit) | Err(exit) => exit,
    }
}

/// The result, as JSON has it.
#[derive(Serialize)]
struct Report<'a> {
    image: &'a Path,
    reference: &'a Path,
    #[serde(flatten)]
    comparison: &'a Comparison,
    z_test: Option<ZTests>,
    error_map: Option<MapReport<'a>>,
    failed: Vec<String>,
}

/// Tests at two scales.
#[derive(Clone, Copy, Serialize)]
struct ZTests {
    pixels: ZTest,
    /// Of [`TILE`]² pixels each.
    tiles: ZTest,
}

/// What the colours of the error map mean.
#[derive(Serialize)]
struct MapReport<'a> {
    file: &'a Path,
    shows: &'static str,
    /// The error that has the brightest colour; none for a file that holds the difference itself.
    scale: Option<f32>,
}

fn compare(arguments: &CompareArguments) -> Result<Exit, Exit> {
    let unwritable = output::problems(arguments.output.iter().map(|o| o.path.as_path()));
    if !unwritable.is_empty() {
        unwritable.iter().for_each(|problem| problems::error(problem));
        return Err(Exit::Output);
    }
    let [image, reference, variance_a, variance_b] = read_all(arguments)?;
    let (Some(image), Some(reference)) = (image, reference) else { return Err(Exit::Image) };
    let options = CompareOptions { peak: arguments.peak, ..CompareOptions::default() };
    let comparison = metrics::compare(&image, &reference, &options).map_err(|error| {
        let (a, b) = (arguments.a.display(), arguments.b.display());
        problems::error(&format!("cannot compare `{a}` with `{b}`: {error}"));
        Exit::Image
    })?;
    let z_test = z_test(arguments, [&image, &reference], [variance_a.as_ref(), variance_b.as_ref()])?;
    let failed = arguments.threshold.iter().filter_map(|t| exceeded(t, &comparison.mean, z_test.as_ref())).collect();
    let map = arguments.output.as_ref().map(|file| write_map(arguments, file, &image, &reference)).transpose()?;
    let report = Report {
        image: &arguments.a,
        reference: &arguments.b,
        comparison: &comparison,
        z_test,
        error_map: map,
        failed,
    };
    let text = if arguments.json {
        serde_json::to_string_pretty(&report).map(|json| json + "\n").map_err(|error| {
            problems::error(&error.to_string());
            Exit::Output
        })?
    } else {
        to_text(&report)
    };
    let printed = print(&text);
    Ok(if report.failed.is_empty() { printed } else { Exit::Differs })
}

/// Reads everything that is named, and says at once what cannot be read.
fn read_all(arguments: &CompareArguments) -> Result<[Option<Image>; 4], Exit> {
    let paths = [Some(&arguments.a), Some(&arguments.b), arguments.variance_a.as_ref(), arguments.variance_b.as_ref()];
    let mut is_readable = true;
    let images = paths.map(|path| match Image::read(path?) {
        Ok(image) => Some(image),
        Err(error) => {
            problems::error(&error.to_string());
            is_readable = false;
            None
        }
    });
    if is_readable { Ok(images) } else { Err(Exit::Image) }
}

/// The z-test, where both variances are known; without them, that is an error only if the test was asked for.
fn z_test(
    arguments: &CompareArguments,
    images: [&Image; 2],
    variances: [Option<&Image>; 2],
) -> Result<Option<ZTests>, Exit> {
    let size = |image: &Image| (image.width(), image.height());
    for (variance, image) in variances.into_iter().zip(images) {
        if let Some(variance) = variance.filter(|v| size(v) != size(image)) {
            let ((vw, vh), (w, h)) = (size(variance), size(image));
            problems::error(&format!("the variances are of {vw}×{vh} pixels, their image of {w}×{h}"));
            return Err(Exit::Image);
        }
    }
    let wanted = |metric| arguments.threshold.iter().find(|t| t.metric == metric);
    let significance = |metric| wanted(metric).map_or(SIGNIFICANCE, |t| t.value);
    let [a, b] = [0, 1].map(|i| Estimate::of(images[i], variances[i]));
    if let (Some(a), Some(b)) = (a, b) {
        let width = images[0].width();
        return Ok(Some(ZTests {
            pixels: ZTest::new(&a, &b, significance(Metric::ZTest)),
            tiles: ZTest::new(&a.tiles(width), &b.tiles(width), significance(Metric::TileZTest)),
        }));
    }
    let is_wanted = wanted(Metric::ZTest).or(wanted(Metric::TileZTest)).is_some();
    if is_wanted || variances.iter().any(Option::is_some) {
        problems::error(
            "a z-test needs colours and variances of both images: channels Variance.R, Variance.G, Variance.B, \
             or files given by --variance-a and --variance-b",
        );
        return Err(Exit::Image);
    }
    Ok(None)
}

/// Which threshold is exceeded, in words; none if it holds.
fn exceeded(threshold: &Threshold, mean: &Difference, z_tests: Option<&ZTests>) -> Option<String> {
    let Threshold { metric, value } = *threshold;
    // What is not a number holds no threshold.
    let (found, holds) = match metric {
        Metric::Mse => (mean.mse, mean.mse <= value),
        Metric::RelMse => (mean.rel_mse, mean.rel_mse <= value),
        Metric::Mae => (mean.mae, mean.mae <= value),
        Metric::Psnr => (mean.psnr, mean.psnr >= value),
        Metric::Ssim => {
            let ssim = mean.ssim.unwrap_or(f64::NAN);
            (ssim, ssim >= value)
        }
        Metric::ZTest | Metric::TileZTest => {
            let test = z_tests.map(|tests| if metric == Metric::ZTest { tests.pixels } else { tests.tiles });
            (test.map_or(f64::NAN, |test| test.smallest_p), test.is_some_and(|test| !test.differs()))
        }
    };
    let (name, relation) = match metric {
        Metric::Psnr | Metric::Ssim => (metric.to_string(), "below"),
        Metric::ZTest | Metric::TileZTest => (format!("{metric}: the smallest p"), "too small for a significance of"),
        _ => (metric.to_string(), "above"),
    };
    (!holds).then(|| format!("{name} is {found:.6e}, {relation} {value}"))
}

fn write_map<'a>(
    arguments: &CompareArguments,
    file: &'a OutputFile,
    image: &Image,
    reference: &Image,
) -> Result<MapReport<'a>, Exit> {
    let measure = ErrorMeasure::from(arguments.error);
    let result = if matches!(file.format, Format::Exr | Format::Pfm) {
        difference(image, reference).map(|map| (map, "image − reference", None))
    } else {
        let shows = match measure {
            ErrorMeasure::Absolute => "|image − reference|",
            ErrorMeasure::Squared => "(image − reference)²",
            ErrorMeasure::Relative => "|image − reference| / √(reference² + 0.01)",
        };
        metrics::error_map(image, reference, measure, arguments.scale).map(|map| (map.image, shows, Some(map.scale)))
    };
    let (map, shows, scale) = result.map_err(|error| {
        problems::error(&error.to_string());
        Exit::Image
    })?;
    output::write_image(&map, file, ToneMap::default()).map_err(|error| {
        problems::error(&error.to_string());
        Exit::Output
    })?;
    Ok(MapReport { file: &file.path, shows, scale })
}

/// image − reference, in the colours that both have.
fn difference(image: &Image, reference: &Image) -> Result<Image, ImageError> {
    let missing = |of: &Image| ImageError::NoSuchChannel { name: "R".to_owned(), known: of.channels().to_vec() };
    let (a, b) = (image.rgb().ok_or_else(|| missing(image))?, reference.rgb().ok_or_else(|| missing(reference))?);
    let pixels =
        |image: &Image| image.data().chunks_exact(image.channel_count()).map(<[f32]>::to_vec).collect::<Vec<_>>();
    let data =
        pixels(image).iter().zip(&pixels(reference)).flat_map(|(p, q)| [0, 1, 2].map(|c| p[a[c]] - q[b[c]])).collect();
    Image::from_data(image.width(), image.height(), ["R", "G", "B"], data)
}

fn to_text(report: &Report<'_>) -> String {
    let mut out = String::new();
    let Comparison { width, height, channels, mean, .. } = report.comparison;
    // Writing to a string cannot fail.
    let _ = writeln!(out, "{width} × {height} pixels");
    let _ = writeln!(
        out,
        "{:<9}{:>12}{:>12}{:>12}{:>9}{:>9}{:>12}{:>12}{:>9}",
        "", "MSE", "relMSE", "MAE", "PSNR", "SSIM", "mean", "reference", "ratio"
    );
    let named = channels.iter().map(|c| (c.name.as_str(), &c.difference));
    for (name, d) in named.chain([("all", mean)]) {
        let ssim = d.ssim.map_or("–".to_owned(), |s| format!("{s:.4}"));
        let _ = writeln!(
            out,
            "{name:<9}{:>12.4e}{:>12.4e}{:>12.4e}{:>9.2}{ssim:>9}{:>12.5}{:>12.5}{:>9.4}",
            d.mse,
            d.rel_mse,
            d.mae,
            d.psnr,
            d.image_mean,
            d.reference_mean,
            d.image_mean / d.reference_mean,
        );
    }
    let skipped = width * height - report.comparison.compared_pixels;
    if skipped > 0 {
        let _ = writeln!(out, "left out: {skipped} pixels with values that are not finite");
    }
    if let Some(ZTests { pixels, tiles }) = &report.z_test {
        z_test_lines(&mut out, "z-test", "pixels", pixels);
        z_test_lines(&mut out, "", &format!("tiles of {TILE} × {TILE}"), tiles);
        let _ = writeln!(out, "         the pictures' means differ by z = {:.2}", pixels.mean_z);
    }
    if let Some(map) = &report.error_map {
        let scale =
            map.scale.map_or(String::new(), |scale| format!(", from 0 (black) to {scale:.4e} and above (pale yellow)"));
        let _ = writeln!(out, "wrote {}: {}{scale}", map.file.display(), map.shows);
    }
    for failure in &report.failed {
        let _ = writeln!(out, "differs: {failure}");
    }
    out
}

fn z_test_lines(out: &mut String, name: &str, what: &str, test: &ZTest) {
    let verdict = if test.differs() { "the means differ" } else { "no difference found" };
    let untested =
        if test.untested > 0 { format!("; {} not tested: not finite", test.untested) } else { String::new() };
    let _ = writeln!(
        out,
        "{name:<9}{what}: {verdict}; {} of {} tests fail at a level of {:.2e} (significance {} over all), smallest p \
         {:.2e}, mean z² {:.3}{untested}",
        test.rejected, test.tests, test.level, test.significance, test.smallest_p, test.mean_square_z
    );
}
