//! The report as a page.

use super::outcome::{CurvePoint, MEASURES, Measure, Outcome, VariantOutcome, curve, power_laws};
use super::{Checkpoint, ReferenceOrigin};
use crate::study::chart::{Bar, IntervalRow, bars, ratios};
use crate::study::html::{Finding, Page, alternatives, details, download, findings, note, paragraph, warning};
use crate::study::number::{duration, factor, percent, si, significant};
use crate::study::picture::{Frame, Gallery, Layer, LogScale, png};
use crate::study::plot::{Axis, Guide, Plot, Point, Series, key, legend};
use crate::study::statistics::Interval;
use crate::study::table::{Cell, Table};
use luz_image::{Image, ImageError, ToneMap};

/// How a report looks, and what it quotes.
#[derive(Clone, Debug, Default)]
pub struct PageOptions {
    /// The heading; `None` for one made of the scene's name.
    pub title: Option<String>,
    /// How light becomes the colours of pictures.
    pub tone_map: ToneMap,
    /// The command that made it.
    pub command: Option<String>,
    /// What the files are called that the page offers, without an extension.
    pub name: String,
}

/// How many decades the false colours of errors span.
const ERROR_DECADES: f32 = 2.5;

impl Outcome {
    /// The report: one HTML file that needs nothing else.
    ///
    /// # Errors
    /// If a picture does not fit in memory.
    pub fn page(&self, options: &PageOptions) -> Result<String, ImageError> {
        let scene = self.setup.scene.file_name().unwrap_or(self.setup.scene.as_os_str()).to_string_lossy();
        let stem = scene.split(".pbrt").next().unwrap_or(&scene);
        let axes: Vec<&str> = self.axes.iter().map(|axis| axis.name.as_str()).collect();
        let title = options.title.clone().unwrap_or_else(|| format!("{stem}: {}", axes.join(" × ")));
        let mut page = Page::new(&title, &self.subtitle());
        page.push(&findings(&self.findings()));
        self.warnings().iter().for_each(|text| page.push(&warning(text)));
        page.section("efficiency", "Efficiency", &self.efficiency());
        page.section("convergence", "Convergence", &self.convergence());
        page.section("pictures", "Pictures", &self.pictures(options.tone_map)?);
        page.section("numbers", "Numbers", &self.numbers());
        page.section("time", "Where the time went", &self.time());
        page.section("method", "How it was measured", &self.method(options));
        Ok(page.finish())
    }

    fn subtitle(&self) -> String {
        let bounds = self.setup.bounds;
        let counted = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
        let each = match self.setup.seconds_budget {
            Some(seconds) => format!("{} each", duration(seconds)),
            None => {
                let samples = self.variants.iter().map(|v| v.summary.samples);
                let (low, high) = samples.fold((f64::INFINITY, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
                let range = if high > low { format!("{low:.0} to {high:.0}") } else { format!("{high:.0}") };
                format!("{range} samples per pixel each")
            }
        };
        format!(
            "{}, {}, {each}; {} × {} pixels",
            counted(self.variants.len(), "variant"),
            counted(self.seeds_done(), "seed"),
            bounds.width(),
            bounds.height()
        )
    }

    /// The variant that is best by the MSE, if all can be compared.
    fn best(&self) -> Option<(&VariantOutcome, Interval)> {
        let with_efficiency = self.variants.iter().filter_map(|v| Some((v, v.summary.efficiency?)));
        with_efficiency.max_by(|a, b| a.1.value.total_cmp(&b.1.value))
    }

    fn findings(&self) -> Vec<Finding> {
        let mut out = Vec::new();
        let Some(first) = self.variants.first() else { return out };
        if let Some((best, interval)) = self.best().filter(|_| self.variants.len() > 1) {
            if best.name == first.name {
                let others = self.variants.iter().skip(1).filter_map(|v| Some((v, v.summary.efficiency?)));
                let next = others.max_by(|a, b| a.1.value.total_cmp(&b.1.value));
                out.push(Finding {
                    figure: first.name.clone(),
                    what: "is the most efficient".to_owned(),
                    remark: next
                        .map_or(String::new(), |(v, i)| format!("next: {}, {}", v.name, with_interval(&i, factor))),
                });
            } else {
                out.push(Finding {
                    figure: factor(interval.value),
                    what: format!("the efficiency of {}: {}", first.name, best.name),
                    remark: format!("{}, by the MSE", interval_words(&interval, |v| significant(v, 3))),
                });
            }
        }
        let slopes = self.variants.iter().filter_map(|v| Some((v, v.summary.slopes_by_samples[0]?)));
        if let Some((variant, slope)) = slopes.min_by(|a, b| a.1.value.total_cmp(&b.1.value)) {
            out.push(Finding {
                figure: format!("n^{}", significant(slope.value, 3)),
                what: format!("the steepest MSE over n samples: {}", variant.name),
                remark: interval_words(&slope, |v| significant(v, 3)),
            });
        }
        let origin = match &self.reference.origin {
            ReferenceOrigin::File { path } => {
                path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
            }
            ReferenceOrigin::Rendered { samples, .. } => format!("{} samples per pixel", si(f64::from(*samples))),
        };
        out.push(match self.reference.own_error {
            Some(own) => Finding {
                figure: significant(own.mse, 2),
                what: "the reference's own MSE, subtracted from all others".to_owned(),
                remark: origin,
            },
            None => Finding {
                figure: "?".to_owned(),
                what: "the reference's own error is not known".to_owned(),
                remark: origin,
            },
        });
        out
    }

    fn warnings(&self) -> Vec<String> {
        let mut out = Vec::new();
        if self.interrupted {
            out.push(format!(
                "The study was interrupted: {} of {} seeds are complete.",
                self.seeds_done(),
                self.setup.seeds
            ));
        }
        if self.seeds_done() < 2 {
            out.push("One seed says nothing of the scatter: there are no intervals. Two seeds give some, four give useful ones.".to_owned());
        }
        let smallest =
            self.variants.iter().filter_map(|v| v.summary.mse).map(|i| i.value).fold(f64::INFINITY, f64::min);
        match self.reference.own_error {
            None => out.push(
                "The reference does not say how large its own error is. It adds to the MSE of all variants alike, flattens curves \
                 at their end and draws efficiencies towards each other."
                    .to_owned(),
            ),
            Some(own) if own.mse > 0.25 * smallest => out.push(format!(
                "The reference is not much better than the best variant: its own MSE is {} of that one's. What is subtracted is \
                 uncertain itself; give the reference more samples.",
                percent(own.mse / smallest.max(f64::MIN_POSITIVE))
            )),
            Some(_) => {}
        }
        for variant in &self.variants {
            let summary = &variant.summary;
            if let (Some(bias), Some(mse)) = (summary.squared_bias, summary.mse)
                && bias > 0.2 * mse.value
                && mse.value > 0.0
            {
                out.push(format!(
                    "{}: {} of the MSE does not shrink with more samples. It is biased, or does not show what the reference shows.",
                    variant.name,
                    percent((bias / mse.value).min(1.0))
                ));
            }
            if summary.dropped_samples > 0 {
                out.push(format!("{}: {} samples were left out: not finite.", variant.name, summary.dropped_samples));
            }
        }
        out
    }

    fn efficiency(&self) -> String {
        let chart = |of: fn(&VariantOutcome) -> Option<Interval>| {
            let rows: Vec<IntervalRow> = self
                .variants
                .iter()
                .enumerate()
                .map(|(style, variant)| {
                    let interval = of(variant);
                    let text = match interval {
                        Some(_) if style == 0 => "1, by definition".to_owned(),
                        Some(interval) => with_interval(&interval, factor),
                        None => "not known: its error is below the reference's".to_owned(),
                    };
                    IntervalRow { name: variant.name.clone(), style, interval, text }
                })
                .collect();
            ratios(&rows)
        };
        let first = self.variants.first().map_or("", |v| v.name.as_str());
        paragraph(&format!(
            "1 / (error · time) relative to {first}. Twice the efficiency means half the time for the same error, as far as the error \
             falls as one over the samples."
        )) + &alternatives(&[("MSE", chart(|v| v.summary.efficiency)), ("relMSE", chart(|v| v.summary.rel_efficiency))])
            + &note(&format!(
                "Bars are {} intervals of the ratio of the mean costs, from Student's t with the paired seeds' deviations (delta method \
             on the logarithm): {} degrees of freedom.",
                percent(self.setup.confidence),
                self.seeds_done().saturating_sub(1)
            ))
    }

    fn convergence(&self) -> String {
        let block = |index: usize| {
            let (name, measure) = MEASURES[index];
            let slopes = self.variants.iter().enumerate().map(|(style, variant)| {
                let slope = variant.summary.slopes_by_samples[index];
                let words = slope.map_or(String::new(), |s| format!("n^{}", with_spread(&s)));
                (variant.name.as_str(), style, words)
            });
            let by_samples = self.plot(name, measure, "samples per pixel", "", |c| c.samples, |p| p.samples);
            let by_time = self.plot(name, measure, "seconds of rendering", " s", |c| c.seconds, |p| p.seconds);
            legend(slopes) + "<div class=\"plots\">\n" + &by_samples.figure() + &by_time.figure() + "</div>\n"
        };
        alternatives(&[(MEASURES[0].0, block(0)), (MEASURES[1].0, block(1))])
            + &note(
                "Press a name to make its curves stand out. Lines are power laws, fitted by least squares in the logarithms to each \
                 seed; the exponent is the mean over the seeds, with half of its interval. Independent samples have the exponent −1. \
                 Bars are intervals of the mean over the seeds.",
            )
            + &details("All points", &self.points())
    }

    fn plot(
        &self,
        name: &str,
        measure: Measure,
        label: &str,
        unit: &'static str,
        of_checkpoint: fn(&Checkpoint) -> f64,
        of_point: fn(&CurvePoint) -> f64,
    ) -> Plot {
        let series = self.variants.iter().enumerate().map(|(style, variant)| {
            let measured = curve(&variant.runs, measure);
            let points = measured.iter().map(|point| {
                let error = &point.error;
                let words = format!(
                    "{name} {} after {} samples, {}",
                    with_interval(error, |v| significant(v, 3)),
                    significant(point.samples, 3),
                    duration(point.seconds)
                );
                Point::new(of_point(point), error.value).with_bar(error.low, error.high).with_note(words)
            });
            let points: Vec<Point> = points.collect();
            let laws = power_laws(&variant.runs, of_checkpoint, measure);
            let count = laws.len() as f64;
            let slope = laws.iter().map(|law| law.slope).sum::<f64>() / count;
            let factor = (laws.iter().map(|law| law.factor.ln()).sum::<f64>() / count).exp();
            let shown = || points.iter().filter(|p| p.y > 0.0);
            let fit = match (shown().next(), shown().next_back()) {
                (Some(a), Some(b)) if !laws.is_empty() && a.x < b.x => {
                    Some([a.x, b.x].map(|x| [x, factor * x.powf(slope)]))
                }
                _ => None,
            };
            Series { name: variant.name.clone(), style, points, fit }
        });
        let what = if unit.is_empty() { "samples" } else { "time" };
        Plot {
            title: format!("{name} against {what}"),
            x: Axis::log(label).with_unit(unit),
            y: Axis::log(name),
            series: series.collect(),
            guides: vec![Guide { slope: -1.0, label: format!("∝ 1 / {what}") }],
        }
    }

    fn points(&self) -> String {
        let mut rows = Vec::new();
        for (style, variant) in self.variants.iter().enumerate() {
            let curves = MEASURES.map(|(_, measure)| curve(&variant.runs, measure));
            for (mse, rel_mse) in curves[0].iter().zip(&curves[1]) {
                rows.push(vec![
                    name_cell(style, &variant.name),
                    Cell::number(significant(mse.samples, 4)),
                    Cell::number(significant(mse.seconds, 3)),
                    Cell::number(with_interval(&mse.error, |v| significant(v, 3))),
                    Cell::number(with_interval(&rel_mse.error, |v| significant(v, 3))),
                ]);
            }
        }
        let columns = ["Variant", "Samples per pixel", "Seconds", "MSE", "relMSE"].map(str::to_owned).to_vec();
        Table { caption: "Mean over the seeds, with intervals".to_owned(), columns, rows }.html()
    }

    fn pictures(&self, tone_map: ToneMap) -> Result<String, ImageError> {
        let [width, height] = self.target.size;
        let image = |pixels: Vec<f32>| Image::from_data(width, height, ["R", "G", "B"], pixels);
        let layer = |name: &str, source: String| Layer { name: name.to_owned(), source };
        let scale = LogScale::of(self.variants.iter().flat_map(|v| &v.pictures.relative_errors), ERROR_DECADES);
        let target = self.target.mean.iter().flatten().map(|v| *v as f32).collect();
        let mut frames = vec![Frame {
            name: "reference".to_owned(),
            remark: String::new(),
            layers: vec![layer("Picture", png(&image(target)?, tone_map)?)],
            is_reference: true,
        }];
        for variant in &self.variants {
            let pictures = &variant.pictures;
            let first = pictures.first.iter().flatten().copied().collect();
            let mut layers = vec![
                layer("Picture", png(&image(first)?, tone_map)?),
                layer("Error", scale.png(width, height, &pictures.relative_errors)?),
            ];
            if let Some(techniques) = &pictures.techniques {
                for (name, channels) in TECHNIQUE_LAYERS {
                    if let Ok(selected) = techniques
                        .select(&["R", "G", "B"].map(|c| format!("{channels}.{c}")).each_ref().map(String::as_str))
                    {
                        layers.push(layer(name, png(&image(selected.into_data())?, tone_map)?));
                    }
                }
            }
            let mse = variant.summary.mse.map_or("–".to_owned(), |i| significant(i.value, 2));
            let remark = format!("MSE {mse} · {} samples", significant(variant.summary.samples, 3));
            frames.push(Frame { name: variant.name.clone(), remark, layers, is_reference: false });
        }
        let error_key = scale.key("Each pixel's relative error, |x − r| / √(r² + 0.01), as the root of its mean square over seeds and channels; one scale for all variants.")?;
        let technique_key = note(TECHNIQUE_KEY);
        let keys = [("Error".to_owned(), error_key)]
            .into_iter()
            .chain(TECHNIQUE_LAYERS.iter().map(|(name, _)| ((*name).to_owned(), technique_key.clone())));
        let first_seed = note("Pictures are those of the first seed, at the end of its time.");
        Ok(Gallery { width, height, frames, keys: keys.collect() }.html() + &first_seed)
    }

    fn numbers(&self) -> String {
        let mut columns = vec!["Variant".to_owned()];
        columns.extend(
            [
                "Samples",
                "Seconds",
                "MSE",
                "relMSE",
                "Efficiency",
                "Exponent",
                "Brightness",
                "Bias² / MSE",
                "Paths/s",
                "Rays/s",
            ]
            .map(str::to_owned),
        );
        let short = |interval: Option<Interval>| {
            interval.map_or("–".to_owned(), |i| with_interval(&i, |v| significant(v, 3)))
        };
        let row = |(style, variant): (usize, &VariantOutcome)| {
            let s = &variant.summary;
            let brightness = s.brightness.map_or("–".to_owned(), |b| {
                let sign = if b.value >= 0.0 { "+" } else { "" };
                let half =
                    if b.is_bounded() { format!(" ± {:.2}", 100.0 * (b.high - b.value)) } else { String::new() };
                format!("{sign}{:.2}{half} %", 100.0 * b.value).replace('-', "−")
            });
            let bias = match (s.squared_bias, s.mse) {
                (Some(bias), Some(mse)) if mse.value > 0.0 => percent((bias / mse.value).clamp(0.0, 1.0)),
                _ => "–".to_owned(),
            };
            let exponent = s.slopes_by_samples[0].map_or("–".to_owned(), |i| with_spread(&i));
            let numbers = [
                significant(s.samples, 4),
                significant(s.seconds, 3),
                short(s.mse),
                short(s.rel_mse),
                if style == 0 { "1".to_owned() } else { short(s.efficiency) },
                exponent,
                brightness,
                bias,
                si(s.paths_per_second),
                si(s.rays_per_second),
            ];
            [name_cell(style, &variant.name)].into_iter().chain(numbers.into_iter().map(Cell::number)).collect()
        };
        let table =
            Table { caption: String::new(), columns, rows: self.variants.iter().enumerate().map(row).collect() };
        table.html()
            + &note(
                "Means over the seeds. Brightness is the mean of the picture relative to the reference's, with the uncertainty of both. \
                 Bias² is the part of the MSE that is the same for all seeds; without bias it scatters around zero.",
            )
    }

    fn time(&self) -> String {
        let s = &self.seconds;
        let parts = [
            ("scene read", s.read),
            ("scene built", s.build),
            ("warming up", s.calibration),
            ("reference", s.reference),
            ("variants", s.variants),
            ("techniques", s.techniques),
            ("measuring errors", s.measuring),
            ("unfinished seed", s.discarded),
        ];
        let names: Vec<&str> = parts.iter().filter(|(_, t)| *t > 0.0).map(|(name, _)| *name).collect();
        let sizes: Vec<f64> = parts.iter().filter(|(_, t)| *t > 0.0).map(|(_, t)| *t).collect();
        let whole = [Bar { name: "The study".to_owned(), text: duration(s.total), parts: sizes }];
        let per_path: Vec<Bar> = self
            .variants
            .iter()
            .map(|variant| {
                let v = &variant.summary;
                let parts = vec![v.closest_rays_per_path, v.shadow_rays_per_path];
                Bar { name: variant.name.clone(), text: significant(parts.iter().sum(), 3), parts }
            })
            .collect();
        let rate = |of: fn(&VariantOutcome) -> f64, what: &str| -> Vec<Bar> {
            let bar = |v: &VariantOutcome| Bar {
                name: v.name.clone(),
                text: format!("{} {what}", si(of(v))),
                parts: vec![of(v)],
            };
            self.variants.iter().map(bar).collect()
        };
        bars(&names, &whole, duration)
            + "<h3>Paths per second</h3>\n"
            + &bars(&["paths per second"], &rate(|v| v.summary.paths_per_second, "paths/s"), si)
            + "<h3>Rays per second</h3>\n"
            + &bars(&["rays per second"], &rate(|v| v.summary.rays_per_second, "rays/s"), si)
            + "<h3>Rays per path</h3>\n"
            + &bars(&["to the closest hit", "to any hit (shadow rays)"], &per_path, |v| significant(v, 3))
    }

    fn method(&self, options: &PageOptions) -> String {
        let setup = &self.setup;
        let mut out = String::new();
        if let Some(command) = &options.command {
            out += &format!("<pre><code>{}</code></pre>\n", crate::study::html::escape(command));
        }
        out += &paragraph(
            "With each seed, all variants are rendered in turns, pass by pass, so that whatever else the machine does meets all of them \
             alike. Only passes are timed; errors are measured between them.",
        );
        out += &paragraph(&match (&self.reference.origin, self.reference.own_error) {
            (ReferenceOrigin::Rendered { samples, parts, .. }, _) => format!(
                "The reference is the scene as it stands, without any of the variants' settings, rendered with {samples} samples per pixel \
                 in {parts} parts with seeds of their own. The differences between the parts tell its own error, whatever the sampler; \
                 since E(x − r)² = MSE + Var(r), that is subtracted from all errors."
            ),
            (ReferenceOrigin::File { path }, Some(_)) => format!(
                "The reference is {}. The variances of its pixels, which it brings along, are subtracted from all errors, since \
                 E(x − r)² = MSE + Var(r). It must be independent of the pictures: rendered with other seeds.",
                path.display()
            ),
            (ReferenceOrigin::File { path }, None) => {
                format!(
                    "The reference is {}. It says nothing of its own error, which is taken for none.",
                    path.display()
                )
            }
        });
        let row = |name: &str, value: String| vec![Cell::text(name), Cell::text(value)];
        let size = [setup.bounds.width(), setup.bounds.height()];
        let mut rows = vec![
            row("Scene", setup.scene.display().to_string()),
            row(
                "Pixels",
                format!("{} × {}, of a frame of {} × {}", size[0], size[1], setup.resolution[0], setup.resolution[1]),
            ),
            row("Threads", setup.threads.to_string()),
            row("Instructions", setup.simd.clone()),
            row("Seeds", format!("{} of {}", self.seeds_done(), setup.seeds)),
            row("Pixels compared", self.reference.compared_pixels.to_string()),
        ];
        if let Some(own) = self.reference.own_error {
            rows.push(row(
                "Reference's own error",
                format!("MSE {}, relMSE {}", significant(own.mse, 3), significant(own.rel_mse, 3)),
            ));
        }
        for axis in &self.axes {
            rows.push(row(&axis.name, axis.values.join(", ")));
        }
        let columns = vec!["Setting".to_owned(), "Value".to_owned()];
        out += &format!("<div class=\"setup\">{}</div>\n", Table { caption: String::new(), columns, rows }.html());
        out += "<p>All measured points, to be saved:</p>\n";
        out += &download(&format!("{}.csv", options.name), "text/csv", self.to_csv().as_bytes());
        if let Ok(json) = self.to_json() {
            out += &download(&format!("{}.json", options.name), "application/json", &json);
        }
        out
    }
}

/// Layers of the gallery, and the channels of the film that they show.
const TECHNIQUE_LAYERS: [(&str, &str); 4] = [
    ("BSDF’s share", "BsdfWeighted"),
    ("Light’s share", "LightWeighted"),
    ("BSDF alone", "BsdfAlone"),
    ("Light alone", "LightAlone"),
];

const TECHNIQUE_KEY: &str = "What each technique of finding light contributes: its share is weighted by the heuristic, and both shares sum \
    to the picture; alone, it is weighted by one, and estimates all the light that the technique can find. Light that is seen directly or \
    through specular scattering is the BSDF’s.";

fn name_cell(style: usize, name: &str) -> Cell {
    Cell::Html(format!("{} {}", key(style), crate::study::html::escape(name)))
}

/// 95 % interval 1.1 to 1.3
fn interval_words(interval: &Interval, write: impl Fn(f64) -> String) -> String {
    if interval.is_bounded() {
        let share = percent(crate::study::statistics::CONFIDENCE);
        format!("{share} interval {} to {}", write(interval.low), write(interval.high))
    } else {
        "no interval: one seed".to_owned()
    }
}

/// 1.2 (1.1 – 1.3)
fn with_interval(interval: &Interval, write: impl Fn(f64) -> String) -> String {
    if interval.is_bounded() {
        let number = |v: f64| significant(v, 3);
        format!("{} ({} – {})", write(interval.value), number(interval.low), number(interval.high))
    } else {
        write(interval.value)
    }
}

/// −1.02 ± 0.03
fn with_spread(interval: &Interval) -> String {
    let value = format!("{:.2}", interval.value).replace('-', "−");
    if interval.is_bounded() { format!("{value} ± {:.2}", interval.high - interval.value) } else { value }
}
