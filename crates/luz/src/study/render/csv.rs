//! All measured points, for spreadsheets and scripts.

use super::Outcome;
use crate::study::table::{csv_number, csv_row};

impl Outcome {
    /// A row for every variant, seed and checkpoint: the variant's values on the axes, the seed, samples per pixel, seconds, MSE,
    /// relMSE and trimmed relMSE (less the reference's own), and of the render at its end paths and rays.
    pub fn to_csv(&self) -> String {
        let axes = self.axes.iter().map(|axis| axis.name.as_str());
        let measured = [
            "seed",
            "is_last",
            "rounds",
            "samples",
            "seconds",
            "mse",
            "relmse",
            "trimmed_relmse",
            "paths",
            "rays",
            "shadow_rays",
        ];
        let mut out = csv_row(["variant"].into_iter().chain(axes).chain(measured));
        for variant in &self.variants {
            for run in &variant.runs {
                for (index, point) in run.checkpoints.iter().enumerate() {
                    let is_last = index + 1 == run.checkpoints.len();
                    // What a render cost is known at its end.
                    let at_end = |count: u64| if is_last { count.to_string() } else { String::new() };
                    let cells = [
                        run.seed.to_string(),
                        u8::from(is_last).to_string(),
                        point.rounds.to_string(),
                        csv_number(point.samples),
                        csv_number(point.seconds),
                        csv_number(point.errors.mse),
                        csv_number(point.errors.rel_mse),
                        csv_number(point.errors.trimmed_rel_mse),
                        at_end(run.cost.paths),
                        at_end(run.cost.rays),
                        at_end(run.cost.shadow_rays),
                    ];
                    let name = [variant.name.clone()].into_iter();
                    out += &csv_row(name.chain(variant.values.iter().cloned()).chain(cells));
                }
            }
        }
        out
    }
}
