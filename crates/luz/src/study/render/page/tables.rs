//! Numbers of each variant, and where the time went.

use super::super::outcome::{Outcome, VariantOutcome, VariantSummary};
use super::words::{name_cell, with_interval, with_spread};
use crate::study::chart::{Bar, bars};
use crate::study::html::note;
use crate::study::number::{duration, si, significant};
use crate::study::statistics::Interval;
use crate::study::table::{Cell, Table};

impl Outcome {
    /// Errors and efficiencies, and below them what else there is to know of each variant.
    pub(super) fn numbers(&self) -> String {
        let short = |interval: Option<Interval>| {
            interval.map_or("–".to_owned(), |i| with_interval(&i, |v| significant(v, 3)))
        };
        let errors = |style: usize, s: &VariantSummary| {
            vec![
                significant(s.samples, 4),
                significant(s.seconds, 3),
                short(s.mse),
                short(s.rel_mse),
                if style == 0 { "1".to_owned() } else { short(s.efficiency) },
            ]
        };
        let more = |_: usize, s: &VariantSummary| {
            let brightness = s.brightness.map_or("–".to_owned(), |b| {
                let sign = if b.value >= 0.0 { "+" } else { "" };
                let half =
                    if b.is_bounded() { format!(" ± {:.2}", 100.0 * (b.high - b.value)) } else { String::new() };
                format!("{sign}{:.2}{half} %", 100.0 * b.value).replace('-', "−")
            });
            let bias = match (s.squared_bias, s.mse) {
                (Some(bias), Some(mse)) if mse.value > 0.0 => {
                    let [value, half] = [bias.value, bias.high - bias.value].map(|v| 100.0 * v / mse.value);
                    format!("{value:.1} ± {half:.1} %").replace('-', "−")
                }
                _ => "–".to_owned(),
            };
            let slope = s.slopes_by_samples[0].map_or("–".to_owned(), |i| with_spread(&i));
            vec![slope, brightness, bias, si(s.paths_per_second), si(s.rays_per_second)]
        };
        let table = |caption: &str, columns: [&str; 6], cells: &dyn Fn(usize, &VariantSummary) -> Vec<String>| {
            let row = |(style, variant): (usize, &VariantOutcome)| {
                let numbers = cells(style, &variant.summary).into_iter().map(Cell::number);
                [name_cell(style, &variant.name)].into_iter().chain(numbers).collect()
            };
            let rows = self.variants.iter().enumerate().map(row).collect();
            Table { caption: caption.to_owned(), columns: columns.map(str::to_owned).to_vec(), rows }.html()
        };
        let robust = |style: usize, s: &VariantSummary| {
            let efficiency = |i: Option<Interval>| if style == 0 { "1".to_owned() } else { short(i) };
            let median = |m: Option<f64>| m.map_or("–".to_owned(), |m| significant(m, 3));
            vec![
                short(s.trimmed_rel_mse),
                efficiency(s.rel_efficiency),
                efficiency(s.trimmed_rel_efficiency),
                median(s.median_efficiency),
                median(s.median_rel_efficiency),
            ]
        };
        table("Errors and efficiencies", ["Variant", "Samples", "Seconds", "MSE", "relMSE", "Efficiency"], &errors)
            + &table(
                "By other measures of the error",
                [
                    "Variant",
                    "relMSE, trimmed",
                    "Efficiency, relMSE",
                    "Efficiency, trimmed",
                    "Median efficiency",
                    "Median, relMSE",
                ],
                &robust,
            )
            + &table(
                "Convergence, bias, speed",
                ["Variant", "Slope", "Brightness", "Bias² / MSE", "Paths/s", "Rays/s"],
                &more,
            )
            + &note(
                "Means over the seeds. Trimmed errors leave out the worst thousandth of the pixels, median efficiencies come from the seed in the \
                 middle: where they tell another story, few bright pixels or one seed decide. Brightness is the mean of the picture relative to the reference's, with the uncertainty of both. \
                 Bias² is the part of the MSE that is the same for all seeds; without bias it scatters around zero (its interval takes pixels as independent).",
            )
    }

    pub(super) fn time(&self) -> String {
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
        let group = |heading: &str, html: String| format!("<div><h3>{heading}</h3>\n{html}</div>\n");
        let paths = bars(&["paths per second"], &rate(|v| v.summary.paths_per_second, "paths/s"), si);
        let rays = bars(&["rays per second"], &rate(|v| v.summary.rays_per_second, "rays/s"), si);
        let kinds = bars(&["to the closest hit", "to any hit (shadow rays)"], &per_path, |v| significant(v, 3));
        bars(&names, &whole, duration)
            + "<div class=\"plots\">\n"
            + &group("Paths per second", paths)
            + &group("Rays per second", rays)
            + &group("Rays per path", kinds)
            + "</div>\n"
    }
}
