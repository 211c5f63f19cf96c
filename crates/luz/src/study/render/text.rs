//! The numbers for a terminal, and for documents.

use super::Outcome;
use super::outcome::VariantSummary;
use crate::study::number::significant;
use crate::study::statistics::Interval;

impl Outcome {
    /// A table of all variants in Markdown, which is as good to read as it is: samples per pixel, seconds, errors, and efficiencies
    /// relative to the first variant with their intervals: by the MSE, by the relMSE, by the relMSE without the worst pixels, and by the
    /// MSE of the seed in the middle.
    pub fn to_text(&self) -> String {
        let heads = ["", "samples", "seconds", "MSE", "relMSE", "efficiency", "by relMSE", "trimmed", "median"];
        let mut rows = vec![heads.map(str::to_owned)];
        for (index, variant) in self.variants.iter().enumerate() {
            rows.push(row(&variant.name, &variant.summary, index == 0));
        }
        let widths: [usize; 9] =
            std::array::from_fn(|column| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0));
        let line = |row: &[String; 9]| {
            let cells = row.iter().zip(widths).enumerate().map(|(column, (text, width))| {
                if column == 0 { format!("{text:<width$}") } else { format!("{text:>width$}") }
            });
            format!("| {} |\n", cells.collect::<Vec<_>>().join(" | "))
        };
        let rule = widths.iter().enumerate().map(|(column, &width)| match column {
            0 => "-".repeat(width + 2),
            _ => "-".repeat(width + 1) + ":",
        });
        let rule = format!("|{}|\n", rule.collect::<Vec<_>>().join("|"));
        line(&rows[0]) + &rule + &rows[1..].iter().map(line).collect::<String>()
    }
}

fn row(name: &str, s: &VariantSummary, is_first: bool) -> [String; 9] {
    let value = |interval: Option<Interval>| interval.map_or("–".to_owned(), |i| significant(i.value, 3));
    let ratio = |interval: Option<Interval>| match interval {
        _ if is_first => "1".to_owned(),
        Some(i) if i.is_bounded() => {
            let [value, low, high] = [i.value, i.low, i.high].map(|v| significant(v, 3));
            format!("{value} ({low} – {high})")
        }
        Some(i) => significant(i.value, 3),
        // Its error is below what is not known of the reference.
        None => "–".to_owned(),
    };
    [
        name.to_owned(),
        significant(s.samples, 4),
        significant(s.seconds, 3),
        value(s.mse),
        value(s.rel_mse),
        ratio(s.efficiency),
        ratio(s.rel_efficiency),
        ratio(s.trimmed_rel_efficiency),
        s.median_efficiency.map_or("–".to_owned(), |m| significant(m, 3)),
    ]
}
