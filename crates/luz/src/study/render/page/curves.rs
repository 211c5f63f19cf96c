//! Efficiencies, and errors against samples and time.

use super::super::Checkpoint;
use super::super::outcome::{CurvePoint, MEASURES, Measure, Outcome, VariantOutcome, curve, power_laws};
use super::words::{name_cell, with_interval, with_spread};
use crate::study::chart::{IntervalRow, ratios};
use crate::study::html::{alternatives, details, note, paragraph};
use crate::study::number::{duration, factor, percent, significant};
use crate::study::plot::{Axis, Guide, Plot, Point, Series, legend};
use crate::study::statistics::Interval;
use crate::study::table::{Cell, Table};

impl Outcome {
    pub(super) fn efficiency(&self) -> String {
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

    pub(super) fn convergence(&self) -> String {
        let block = |index: usize| {
            let (name, measure) = MEASURES[index];
            let slopes = self.variants.iter().enumerate().map(|(style, variant)| {
                let slope = variant.summary.slopes_by_samples[index];
                let words = slope.map_or(String::new(), |s| format!("slope {}", with_spread(&s)));
                (variant.name.as_str(), style, words)
            });
            let by_samples = self.plot(name, measure, "samples per pixel", "", |c| c.samples, |p| p.samples);
            let by_time = self.plot(name, measure, "seconds of rendering", " s", |c| c.seconds, |p| p.seconds);
            legend(slopes) + "<div class=\"plots\">\n" + &by_samples.figure() + &by_time.figure() + "</div>\n"
        };
        alternatives(&[(MEASURES[0].0, block(0)), (MEASURES[1].0, block(1))])
            + &note(
                "Press a name to make its curves stand out. Lines are power laws, fitted by least squares in the logarithms to each seed; \
                 the slope is the mean over the seeds, with half of its interval. Independent samples have the slope −1. Bars are \
                 intervals of the mean over the seeds.",
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
}
