//! The report of a study of the filter.

use super::measure::{Cell as Measurement, shown};
use super::{FilterOutcome, Kernel, StrategyOutcome, points};
use crate::study::html::{Finding, Page, download, escape, findings, note, paragraph};
use crate::study::number::{duration, factor, significant};
use crate::study::picture::{Frame, Gallery, Layer, LogScale, png};
use crate::study::plot::{Axis, Plot, Point, Series, legend};
use crate::study::statistics::{Interval, fit_power_law, mean_interval};
use crate::study::table::{Cell, Table, csv_number, csv_row};
use luz_color::encoding::srgb_to_linear;
use luz_image::metrics::false_color;
use luz_image::{Image, ImageError, ToneMap};
use std::fmt::Write;

/// Pictures on the page are cut to this side in pixels.
const LARGEST_PICTURE: usize = 480;

/// One page for the studies of one or several images.
///
/// # Errors
/// When a picture can't be made.
pub fn page(outcomes: &[FilterOutcome], command: Option<&str>) -> Result<String, ImageError> {
    let Some(first) = outcomes.first() else {
        return Ok(Page::new("The bilateral filter by sampling", "Nothing was studied").finish());
    };
    let study = &first.study;
    let subtitle = format!(
        "σ_s = {} pixels, σ_r = {}, window of {window} × {window} pixels; {} seeds",
        study.sigma_spatial,
        study.sigma_range,
        first.seeds(),
        window = first.window
    );
    let mut page = Page::new("The bilateral filter by sampling", &subtitle);
    if let Some(command) = command {
        page.push(&note(command));
    }
    let mut csv = csv_row(["image", "strategy", "samples", "seed", "psnr_db", "seconds"]);
    for (index, outcome) in outcomes.iter().enumerate() {
        let id = |name: &str| if index == 0 { name.to_owned() } else { format!("{name}-{}", index + 1) };
        let heading =
            |text: &str| if outcomes.len() == 1 { text.to_owned() } else { format!("{}: {text}", outcome.name) };
        page.section(&id("findings"), &heading("In short"), &outcome.findings());
        page.section(&id("kernels"), &heading("What a pixel looks at"), &outcome.kernels()?);
        if index == 0 {
            page.section("points", "Where samples are taken", &outcome.point_sets());
        }
        page.section(&id("quality"), &heading("Quality against samples and time"), &outcome.curves());
        page.section(&id("pictures"), &heading("Pictures and errors"), &outcome.pictures()?);
        outcome.push_csv(&mut csv);
    }
    page.section("numbers", "Numbers", &download("filter-study.csv", "text/csv", csv.as_bytes()));
    Ok(page.finish())
}

impl FilterOutcome {
    fn seeds(&self) -> usize {
        self.strategies.iter().flat_map(|s| &s.cells).map(|c| c.quality.len()).max().unwrap_or(0)
    }

    fn findings(&self) -> String {
        let at = shown(&self.study.samples);
        let best = self.strategies.iter().max_by(|a, b| mean(a, at).total_cmp(&mean(b, at)));
        let mut all = Vec::new();
        if let Some(best) = best {
            let cell = &best.cells[at];
            all.push(Finding {
                figure: format!("{:.1} dB", mean(best, at)),
                what: format!(
                    "of {}, the best strategy with {:.0} samples per pixel",
                    best.strategy.name(),
                    cell.samples
                ),
                remark: format!(
                    "the window has {} pixels; unfiltered {:.1} dB",
                    self.window * self.window,
                    self.unfiltered
                ),
            });
            let seconds = median(&cell.seconds);
            all.push(Finding {
                figure: factor(self.exact_seconds / seconds.max(1e-9)),
                what: format!(
                    "as fast as the exact filter: {} instead of {}",
                    duration(seconds),
                    duration(self.exact_seconds)
                ),
                remark: "medians over the seeds, all threads, point sets included".to_owned(),
            });
        }
        let random = self.strategies.iter().find(|s| s.strategy == luz_filter::Strategy::Random);
        if let (Some(best), Some(random)) = (best, random) {
            all.push(Finding {
                figure: format!("{:.1} dB", mean(best, at) - mean(random, at)),
                what: format!("more than independent random samples of the same number, by {}", best.strategy.name()),
                remark: "three decibels are half of the squared error".to_owned(),
            });
        }
        findings(&all)
            + &note(&format!(
                "{} ({}×{} pixels): {}. Quality is the peak signal-to-noise ratio against the exact filter, with a peak of 1.",
                self.name,
                self.values.width(),
                self.values.height(),
                self.values_are
            ))
    }

    fn kernels(&self) -> Result<String, ImageError> {
        let mut out = paragraph(
            "The weight of each neighbour, f_s · g_r, from black (0) to pale yellow (1, the pixel itself): a Gaussian in flat \
             places, cut off by edges, scattered by texture. It is another one at every pixel, which is why no fixed set of \
             weights computes it.",
        );
        out += "<div class=\"plots\">\n";
        for kernel in &self.kernels {
            let zoom = (320 / kernel.window).max(1);
            let values = display(&kernel.image(&self.values)?);
            let weights = kernel.weights.iter().flat_map(|&w| false_color(w)).collect();
            let weights = Image::from_data(kernel.window, kernel.window, ["R", "G", "B"], weights)?;
            let style = "width:48%;image-rendering:pixelated";
            // Writing to a string cannot fail.
            let _ = writeln!(
                out,
                "<figure><figcaption>{} at ({}, {})</figcaption>\
                 <img style=\"{style}\" alt=\"its neighbourhood\" src=\"{}\"> <img style=\"{style}\" alt=\"its kernel\" src=\"{}\">\
                 <p class=\"note\">worth {} neighbours of equal weight; the Gaussian alone {}</p></figure>",
                escape(&kernel.name),
                kernel.at[0],
                kernel.at[1],
                png(&enlarged(&values, zoom)?, ToneMap::default())?,
                png(&enlarged(&weights, zoom)?, ToneMap::default())?,
                significant(kernel.effective, 3),
                significant(kernel.effective_gaussian, 3),
            );
        }
        Ok(out + "</div>\n")
    }

    fn point_sets(&self) -> String {
        let count = self.window;
        let mut out = paragraph(&format!(
            "{count} points of each strategy, drawn from the spatial Gaussian; circles are at each σ_s. Independent points clump and \
             leave holes, which is noise. A grid has neither, but every pixel sees the same few offsets, which shows as ghosts. \
             Points that keep their distance, or have one in each cell, err least. Neighbouring pixels use different sets."
        ));
        out += "<div style=\"display:grid;grid-template-columns:repeat(auto-fit,minmax(9rem,1fr));gap:1rem\">\n";
        for strategy in &self.study.strategies {
            let drawing = points::drawing(&self.study, *strategy, count, 0);
            let _ = writeln!(out, "<figure><figcaption>{}</figcaption>\n{drawing}</figure>", strategy.name());
        }
        out + "</div>\n"
    }

    fn curves(&self) -> String {
        let series = |x: &dyn Fn(&Measurement) -> f64, write: &dyn Fn(f64) -> String| -> Vec<Series> {
            self.strategies
                .iter()
                .enumerate()
                .map(|(style, strategy)| Series {
                    name: strategy.strategy.name().to_owned(),
                    style,
                    points: strategy
                        .cells
                        .iter()
                        .filter_map(|cell| {
                            let Interval { value, low, high } = mean_interval(&cell.quality)?;
                            let words = format!("{}: {value:.2} dB", write(x(cell)));
                            Some(Point::new(x(cell), value).with_bar(low, high).with_note(words))
                        })
                        .collect(),
                    fit: None,
                })
                .collect()
        };
        let plot = |title: &str, x: Axis, series: Vec<Series>| Plot {
            title: title.to_owned(),
            x,
            y: Axis::linear("PSNR").with_unit(" dB"),
            series,
            guides: Vec::new(),
        };
        let slopes = self.strategies.iter().enumerate().map(|(style, strategy)| {
            let words = slope(strategy).map_or(String::new(), |s| format!("error ∝ n^{s:.2}").replace('-', "−"));
            (strategy.strategy.name(), style, words)
        });
        let samples = series(&|cell| cell.samples, &|v| format!("{v:.0} samples"));
        let time = series(&|cell| median(&cell.seconds), &|v| duration(v));
        let mut table = Table {
            caption: "PSNR in dB, and median seconds".to_owned(),
            columns: std::iter::once("strategy".to_owned())
                .chain(self.study.samples.iter().map(|m| format!("{m} k")))
                .collect(),
            rows: Vec::new(),
        };
        for strategy in &self.strategies {
            let mut row = vec![Cell::text(strategy.strategy.name())];
            for cell in &strategy.cells {
                let quality = mean_interval(&cell.quality).map_or("–".to_owned(), |i| {
                    let spread =
                        if i.is_bounded() { format!(" ± {:.2}", 0.5 * (i.high - i.low)) } else { String::new() };
                    format!("{:.2}{spread}", i.value)
                });
                row.push(Cell::number(format!("{quality} · {}", duration(median(&cell.seconds)))));
            }
            table.rows.push(row);
        }
        legend(slopes)
            + "<div class=\"plots\">\n"
            + &plot("Quality against samples", Axis::log("samples per pixel"), samples).figure()
            + &plot("Quality against time", Axis::log("seconds").with_unit(" s"), time).figure()
            + "</div>\n"
            + &note(&format!(
                "Bars are 95 % intervals of the mean over the seeds, from Student's t. k = {} is the width of the window. The unfiltered \
                 image has {:.1} dB; the exact filter takes {}. The exponents are of the root of the mean squared error, by least \
                 squares in the logarithms: independent samples have −0.5.",
                self.window,
                self.unfiltered,
                duration(self.exact_seconds)
            ))
            + &table.html()
    }

    fn pictures(&self) -> Result<String, ImageError> {
        let cut = |image: &Image| {
            let size = |full: usize| full.min(LARGEST_PICTURE);
            let (w, h) = (size(image.width()), size(image.height()));
            image.crop((image.width() - w) / 2, (image.height() - h) / 2, w, h)
        };
        let exact = cut(&self.exact)?;
        let n = exact.channel_count();
        let errors = |image: &Image| -> Vec<f32> {
            let pairs = image.data().chunks_exact(n).zip(exact.data().chunks_exact(n));
            pairs.map(|(a, b)| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f32>().sqrt()).collect()
        };
        let mut shown_pictures: Vec<(String, String, Image)> = Vec::new();
        let at = shown(&self.study.samples);
        for strategy in &self.strategies {
            if let Some(picture) = &strategy.picture {
                let remark =
                    format!("{:.0} samples per pixel, {:.1} dB", strategy.cells[at].samples, mean(strategy, at));
                shown_pictures.push((strategy.strategy.name().to_owned(), remark, cut(picture)?));
            }
        }
        let maps: Vec<Vec<f32>> = shown_pictures.iter().map(|(_, _, picture)| errors(picture)).collect();
        let scale = LogScale::of(maps.iter().flatten(), 2.5);
        let layer = |name: &str, source: String| Layer { name: name.to_owned(), source };
        let frame = |name: &str, remark: String, image: &Image, is_reference: bool| {
            let picture = png(&display(image), ToneMap::default())?;
            Ok::<_, ImageError>(Frame {
                name: name.to_owned(),
                remark,
                layers: vec![layer("Picture", picture)],
                is_reference,
            })
        };
        let input = cut(&self.values)?;
        let mut frames = vec![
            frame("unfiltered", format!("{:.1} dB", self.unfiltered), &input, false)?,
            frame("exact", duration(self.exact_seconds), &exact, true)?,
        ];
        for ((name, remark, picture), map) in shown_pictures.iter().zip(&maps) {
            let mut frame = frame(name, remark.clone(), picture, false)?;
            frame.layers.push(layer("Error", scale.png(exact.width(), exact.height(), map)?));
            frames.push(frame);
        }
        let key = scale.key("Distance to the exact result, over all channels, on one scale for all strategies.")?;
        let gallery =
            Gallery { width: exact.width(), height: exact.height(), frames, keys: vec![("Error".to_owned(), key)] };
        Ok(gallery.html())
    }

    fn push_csv(&self, csv: &mut String) {
        for strategy in &self.strategies {
            for cell in &strategy.cells {
                for (seed, (quality, seconds)) in cell.quality.iter().zip(&cell.seconds).enumerate() {
                    let numbers = [cell.samples, seed as f64, *quality, *seconds].map(csv_number);
                    let texts = [self.name.clone(), strategy.strategy.name().to_owned()];
                    csv.push_str(&csv_row(texts.into_iter().chain(numbers)));
                }
            }
        }
    }
}

impl Kernel {
    /// The values of the window; black beyond the image.
    fn image(&self, like: &Image) -> Result<Image, ImageError> {
        let data = self.values.iter().map(|v| if v.is_nan() { 0.0 } else { *v }).collect();
        Image::from_data(self.window, self.window, like.channels().iter().cloned(), data)
    }
}

/// The exponent of the root mean squared error as a power of the samples.
fn slope(strategy: &StrategyOutcome) -> Option<f64> {
    let cells = strategy.cells.iter();
    let points: Vec<[f64; 2]> = cells.map(|c| [c.samples, 10f64.powf(-mean_of(&c.quality) / 20.0)]).collect();
    fit_power_law(&points).map(|law| law.slope)
}

fn mean(strategy: &StrategyOutcome, cell: usize) -> f64 {
    strategy.cells.get(cell).map_or(f64::NAN, |c| mean_of(&c.quality))
}

fn mean_of(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Encoded values as light, which writing a picture encodes again.
fn display(values: &Image) -> Image {
    let mut light = values.clone();
    light.metadata = Default::default();
    light.data_mut().iter_mut().for_each(|v| *v = srgb_to_linear(*v));
    light
}

/// Every pixel as a square of so many.
fn enlarged(image: &Image, zoom: usize) -> Result<Image, ImageError> {
    let (width, height) = (image.width() * zoom, image.height() * zoom);
    let pixels = (0..width * height).flat_map(|i| image.pixel(i % width / zoom, i / width / zoom).iter().copied());
    let data = pixels.collect();
    Image::from_data(width, height, image.channels().iter().cloned(), data)
}

#[cfg(test)]
mod tests {
    use super::super::{FilterStudy, run};
    use super::*;
    use std::ops::ControlFlow;

    #[test]
    fn the_page_is_one_file_that_shows_everything() {
        let data = (0..64 * 48).flat_map(|i| [0, 7, 13].map(|c| ((i * (c + 3)) % 97) as f32 / 97.0)).collect();
        let image = Image::from_data(64, 48, ["R", "G", "B"], data).unwrap();
        let study = FilterStudy { sigma_spatial: 2.0, seeds: 2, samples: vec![1.0, 2.0], ..FilterStudy::default() };
        let outcome = run(&study, "<noise>", &image, &mut |_| ControlFlow::Continue(())).unwrap();
        let html = page(&[outcome.clone(), outcome], Some("luz study filter")).unwrap();
        for part in ["&lt;noise&gt;", "poisson-disk", "vogel", "<svg", "data:image/png", "In short", "Numbers", "±"] {
            assert!(html.contains(part), "{part}");
        }
        // Nothing is fetched.
        assert!(!html.contains("=\"http") && !html.contains("url("));
        assert!(!html.contains("NaN"), "a number is missing");
    }

    #[test]
    fn stopping_early_keeps_whole_seeds() {
        let image = Image::new(20, 20, ["Y"]).unwrap();
        let study = FilterStudy { sigma_spatial: 1.0, seeds: 3, samples: vec![1.0], ..FilterStudy::default() };
        let stop_at = |share: f64| {
            let mut progress = |p: f64| if p > share { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
            run(&study, "", &image, &mut progress)
        };
        assert!(stop_at(0.1).is_err());
        assert!(stop_at(0.5).unwrap().strategies.iter().all(|s| s.cells[0].quality.len() == 1));
        let beyond = FilterStudy { kernels_at: vec![[20, 0]], ..study.clone() };
        assert!(run(&beyond, "", &image, &mut |_| ControlFlow::Continue(())).is_err());
    }
}
