//! Rows of intervals and of stacked bars. They are HTML, so that they fit any width and their text is text.

use super::axis::{Mapping, Scale, ticks};
use super::html::escape;
use super::plot::key;
use super::statistics::Interval;
use std::fmt::Write;

/// An estimate with its interval, in a row of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct IntervalRow {
    /// What it is of.
    pub name: String,
    /// Colour and mark, as on plots.
    pub style: usize,
    /// The estimate; `None` where there is none.
    pub interval: Option<Interval>,
    /// The estimate in words.
    pub text: String,
}

/// Estimates below each other on a logarithmic axis, with a line at 1: for ratios to something.
pub fn ratios(rows: &[IntervalRow]) -> String {
    let ends = |i: &Interval| {
        // An interval without bounds does not stretch the axis.
        if i.is_bounded() { [i.low, i.value, i.high] } else { [i.value; 3] }
    };
    let numbers =
        rows.iter().filter_map(|row| row.interval.as_ref()).flat_map(ends).filter(|v| *v > 0.0 && v.is_finite());
    let (low, high) = numbers.chain([1.0]).fold((f64::INFINITY, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
    let air = 10f64.powf((0.06 * (high / low).log10()).max(0.05));
    let axis = Mapping::new(Scale::Log, [low / air, high * air], [0.0, 100.0]);
    let mut out = String::from("<div class=\"intervals\">\n");
    let all_ticks: Vec<(f64, String)> =
        ticks(&axis, "", 5).into_iter().filter_map(|t| Some((axis.at(t.value), t.label?))).collect();
    // Writing to a string cannot fail.
    for row in rows {
        let (name, text) = (escape(&row.name), escape(&row.text));
        let _ = write!(
            out,
            "<div class=\"row c{}\"><div class=\"head\"><span>{}{name}</span><b>{text}</b></div><div class=\"track\" aria-hidden=\"true\">",
            row.style % 8,
            key(row.style)
        );
        for (at, _) in &all_ticks {
            let _ = write!(out, "<i style=\"left:{at:.2}%\"></i>");
        }
        let _ = write!(out, "<i class=\"one-line\" style=\"left:{:.2}%\"></i>", axis.at(1.0));
        if let Some(interval) = row.interval.filter(|i| i.value > 0.0 && i.value.is_finite()) {
            if interval.is_bounded() && interval.low > 0.0 {
                let (from, to) = (axis.at(interval.low), axis.at(interval.high));
                let _ =
                    write!(out, "<span class=\"whisker\" style=\"left:{from:.2}%;width:{:.2}%\"></span>", to - from);
            }
            let _ = write!(out, "<span class=\"dot\" style=\"left:{:.2}%\"></span>", axis.at(interval.value));
        }
        out += "</div></div>\n";
    }
    out += "<div class=\"axis\" aria-hidden=\"true\">";
    for (at, label) in &all_ticks {
        let _ = write!(out, "<span style=\"left:{at:.2}%\">{}</span>", escape(label));
    }
    out + "</div></div>\n"
}

/// A bar of several parts.
#[derive(Clone, Debug, PartialEq)]
pub struct Bar {
    /// What it is of.
    pub name: String,
    /// Its size in words.
    pub text: String,
    /// The parts' sizes, in the order of the chart's names; what is not positive has no length.
    pub parts: Vec<f64>,
}

/// Bars below each other, parts side by side, on a common scale; `parts` are the names of the parts, and `write` puts a size into
/// words.
pub fn bars(parts: &[&str], bars: &[Bar], write: impl Fn(f64) -> String) -> String {
    let length = |bar: &Bar| bar.parts.iter().filter(|v| **v > 0.0).sum::<f64>();
    let longest = bars.iter().map(length).fold(0.0, f64::max);
    let mut out = String::from("<div class=\"bars\">\n");
    if parts.len() > 1 {
        out += "<ul class=\"legend plain\">";
        for (index, part) in parts.iter().enumerate() {
            let _ = write!(out, "<li><i class=\"swatch c{}\"></i>{}</li>", index % 8, escape(part));
        }
        out += "</ul>\n";
    }
    for bar in bars {
        let _ = write!(
            out,
            "<div class=\"row\"><div class=\"head\"><span>{}</span><b>{}</b></div><div class=\"bar\">",
            escape(&bar.name),
            escape(&bar.text)
        );
        for (index, (part, &size)) in parts.iter().zip(&bar.parts).enumerate() {
            if size > 0.0 && longest > 0.0 {
                let words = escape(&format!("{part}: {}", write(size)));
                let width = 100.0 * size / longest;
                let _ = write!(
                    out,
                    "<span class=\"c{}\" style=\"width:{width:.3}%\" title=\"{words}\"><span class=\"hidden\">{words}; </span></span>",
                    index % 8
                );
            }
        }
        out += "</div></div>\n";
    }
    out + "</div>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(name: &str, interval: Option<[f64; 3]>) -> IntervalRow {
        let interval = interval.map(|[low, value, high]| Interval { value, low, high });
        IntervalRow { name: name.to_owned(), style: 1, interval, text: "x".to_owned() }
    }

    #[test]
    fn intervals_lie_where_they_should() {
        let html =
            ratios(&[row("<a>", Some([0.1, 1.0, 10.0])), row("b", None), row("c", Some([0.0, 2.0, f64::INFINITY]))]);
        assert!(html.contains("&lt;a&gt;") && !html.contains("<a>"));
        assert_eq!(html.matches("class=\"dot\"").count(), 2);
        assert_eq!(html.matches("class=\"whisker\"").count(), 1);
        assert!(html.contains("class=\"dot\" style=\"left:50.00%\""), "{html}");
        assert!(!html.contains("NaN") && !html.contains("inf"));
        assert!(!ratios(&[]).contains("NaN"));
    }

    #[test]
    fn bars_share_a_scale() {
        let bar = |name: &str, parts: &[f64]| Bar { name: name.to_owned(), text: String::new(), parts: parts.to_vec() };
        let html = bars(&["one", "two"], &[bar("a", &[1.0, 3.0]), bar("b", &[2.0, 0.0])], |v| format!("{v} s"));
        assert!(html.contains("width:25.000%") && html.contains("width:75.000%") && html.contains("width:50.000%"));
        assert!(html.contains("two: 3 s"));
        assert!(!bars(&["one"], &[bar("a", &[0.0])], |v| v.to_string()).contains("NaN"));
    }
}
