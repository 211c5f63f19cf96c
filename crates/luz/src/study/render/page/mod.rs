//! The report as a page.

mod curves;
mod pictures;
mod tables;
mod words;

use super::ReferenceOrigin;
use super::outcome::{Outcome, VariantOutcome};
use crate::study::html::{Finding, Page, download, escape, findings, paragraph, warning};
use crate::study::number::{duration, factor, percent, significant};
use crate::study::statistics::Interval;
use crate::study::table::{Cell, Table};
use luz_image::{ImageError, ToneMap};
use words::{interval_words, with_interval};

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
                    what: match next {
                        Some((_, interval)) if interval.high >= 1.0 => "leads in efficiency, but not for sure",
                        _ => "is the most efficient",
                    }
                    .to_owned(),
                    remark: next
                        .map_or(String::new(), |(v, i)| format!("next: {}, {}", v.name, with_interval(&i, factor))),
                });
            } else {
                out.push(Finding {
                    figure: factor(interval.value),
                    what: format!("as efficient as {}: {}", first.name, best.name),
                    remark: format!(
                        "by the MSE; {}{}",
                        interval_words(&interval, |v| significant(v, 3)),
                        best.summary
                            .rel_efficiency
                            .map_or(String::new(), |i| format!("; by the relMSE {}", factor(i.value)))
                    ),
                });
            }
        }
        let slopes = self.variants.iter().filter_map(|v| Some((v, v.summary.slopes_by_samples[0]?)));
        if let Some((variant, slope)) = slopes.min_by(|a, b| a.1.value.total_cmp(&b.1.value)) {
            out.push(Finding {
                figure: significant(slope.value, 3),
                what: format!("is the steepest slope, MSE over samples: {}", variant.name),
                remark: interval_words(&slope, |v| significant(v, 3)),
            });
        }
        let origin = match &self.reference.origin {
            ReferenceOrigin::File { path } => {
                path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
            }
            ReferenceOrigin::Rendered { samples, .. } => format!("{samples} samples per pixel"),
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

    /// What nobody should overlook who reads the numbers, in whole sentences.
    pub fn warnings(&self) -> Vec<String> {
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
            // Well beyond its scatter, and not to be overlooked.
            if let (Some(bias), Some(mse)) = (summary.squared_bias, summary.mse)
                && bias.value - 2.0 * (bias.high - bias.value) > 0.0
                && bias.value > 0.05 * mse.value
            {
                out.push(format!(
                    "{}: about {} of the MSE does not shrink with more samples. It is biased, or does not show what the reference shows.",
                    variant.name,
                    percent((bias.value / mse.value).min(1.0))
                ));
            }
            if summary.dropped_samples > 0 {
                out.push(format!("{}: {} samples were left out: not finite.", variant.name, summary.dropped_samples));
            }
        }
        out
    }

    fn method(&self, options: &PageOptions) -> String {
        let setup = &self.setup;
        let mut out = String::new();
        if let Some(command) = &options.command {
            out += &format!("<pre tabindex=\"0\"><code>{}</code></pre>\n", escape(command));
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
            row(
                "As it stands",
                format!(
                    "sampler {}, {} samples per pixel, max-depth {}, seed {}",
                    setup.sampler, setup.samples_per_pixel, setup.max_depth, setup.seed
                ),
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
        out +=
            &format!("<div class=\"setup\">{}</div>\n", Table { caption: "Settings".to_owned(), columns, rows }.html());
        out += "<p>All measured points, to be saved:</p>\n";
        out += &download(&format!("{}.csv", options.name), "text/csv", self.to_csv().as_bytes());
        if let Ok(json) = self.to_json() {
            out += &download(&format!("{}.json", options.name), "application/json", &json);
        }
        out
    }
}
