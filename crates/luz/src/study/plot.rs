//! Curves with error bars and fitted lines, on linear and logarithmic axes, as inline SVG.
//!
//! Colours come from the page ([`super::html`]) and follow its light or dark theme. A curve is told from the others by colour *and*
//! by the shape of its marks, so that plots can be read without colours.

pub use super::axis::{Axis, Scale};
use super::axis::{Mapping, ticks};
use super::html::escape;
use std::fmt::Write;

/// The size of a plot in its own units, which are about pixels.
const SIZE: [f64; 2] = [460.0, 330.0];
/// Left, right, top and bottom margins of the area of the curves.
const MARGIN: [f64; 4] = [62.0, 16.0, 26.0, 46.0];
/// How many colours, and how many shapes of marks, there are.
const STYLES: usize = 8;

/// A measured point.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Where.
    pub x: f64,
    /// What was measured.
    pub y: f64,
    /// The ends of the error bar; both `y` for none.
    pub bar: [f64; 2],
    /// What is said when the pointer rests on it.
    pub note: String,
}

impl Point {
    /// A point without an error bar.
    pub fn new(x: f64, y: f64) -> Self {
        Self { x, y, bar: [y; 2], note: String::new() }
    }

    /// The same with an error bar; ends that are not finite are left out.
    pub fn with_bar(self, low: f64, high: f64) -> Self {
        Self { bar: [low, high], ..self }
    }

    /// The same with words.
    pub fn with_note(self, note: String) -> Self {
        Self { note, ..self }
    }
}

/// A curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Its name; curves of equal names are highlighted together.
    pub name: String,
    /// Its colour and mark: 0, 1, 2 …; equal on all plots of a page.
    pub style: usize,
    /// Its points, from left to right.
    pub points: Vec<Point>,
    /// Both ends of a fitted line, straight on the plot's axes, which is drawn instead of one from point to point.
    pub fit: Option<[[f64; 2]; 2]>,
}

/// A line of known slope on logarithmic axes, to compare curves with.
#[derive(Clone, Debug, PartialEq)]
pub struct Guide {
    /// Its exponent.
    pub slope: f64,
    /// What it is: `∝ 1/n`.
    pub label: String,
}

/// A plot.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// What it shows.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The curves.
    pub series: Vec<Series>,
    /// Lines of known slope, through the neighbourhood of the first point of the first curve.
    pub guides: Vec<Guide>,
}

impl Plot {
    /// The plot under its title, as HTML. Side by side in `<div class="plots">`.
    pub fn figure(&self) -> String {
        format!("<figure class=\"plot\"><figcaption>{}</figcaption>\n{}</figure>\n", escape(&self.title), self.svg())
    }

    /// The plot as SVG, without its title, which is its label for those who cannot see it.
    pub fn svg(&self) -> String {
        let [width, height] = SIZE;
        let names: Vec<&str> = self.series.iter().map(|s| s.name.as_str()).collect();
        let label = format!(
            "{}: {} against {}, for {}. The numbers are in a table of this page.",
            self.title,
            self.y.label,
            self.x.label,
            names.join("; ")
        );
        let mut out = format!(
            "<svg class=\"chart\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{}\">\n",
            escape(&label)
        );
        let [left, right, top, bottom] = MARGIN;
        let (right, bottom) = (width - right, height - bottom);
        // Writing to a string cannot fail.
        match (self.range(&self.x, |p| vec![p.x]), self.range(&self.y, |p| vec![p.y, p.bar[0], p.bar[1]])) {
            (Some(x), Some(y)) => {
                let frame = Frame {
                    x: Mapping::new(self.x.scale, x, [left, right]),
                    y: Mapping::new(self.y.scale, y, [bottom, top]),
                };
                self.grid(&mut out, &frame);
                // An inner `svg` cuts off what reaches beyond.
                let (w, h) = (right - left, bottom - top);
                let _ = writeln!(
                    out,
                    "<svg x=\"{left}\" y=\"{top}\" width=\"{w}\" height=\"{h}\" viewBox=\"{left} {top} {w} {h}\">"
                );
                self.guides(&mut out, &frame);
                self.series.iter().for_each(|series| self.curve(&mut out, &frame, series));
                out += "</svg>\n";
            }
            _ => {
                let _ = writeln!(
                    out,
                    "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">nothing to show</text>",
                    width / 2.0,
                    height / 2.0
                );
            }
        }
        let _ = writeln!(
            out,
            "<rect class=\"frame\" x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\"/>",
            right - left,
            bottom - top
        );
        let (x, y) = (escape(&self.x.label), escape(&self.y.label));
        let _ = writeln!(
            out,
            "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{x}</text>",
            0.5 * (left + right),
            height - 8.0
        );
        let _ = writeln!(out, "<text x=\"4\" y=\"16\">{y}</text>");
        out + "</svg>\n"
    }

    /// The least and largest number that an axis shows, with some air.
    fn range(&self, axis: &Axis, numbers: impl Fn(&Point) -> Vec<f64>) -> Option<[f64; 2]> {
        let usable = |v: &f64| v.is_finite() && (axis.scale == Scale::Linear || *v > 0.0);
        // What is not on the plot does not stretch it.
        let is_shown = |p: &&Point| self.is_shown(p);
        let all = self.series.iter().flat_map(|s| &s.points).filter(is_shown).flat_map(numbers).filter(usable);
        let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        if low > high {
            return None;
        }
        Some(match axis.scale {
            Scale::Log => {
                let air = (0.06 * (high / low).log10()).max(0.08);
                [low / 10f64.powf(air), high * 10f64.powf(air)]
            }
            Scale::Linear => {
                let air = if high > low { 0.05 * (high - low) } else { 0.5 * high.abs().max(1.0) };
                [low - air, high + air]
            }
        })
    }

    fn is_shown(&self, point: &Point) -> bool {
        let fits = |axis: &Axis, v: f64| v.is_finite() && (axis.scale == Scale::Linear || v > 0.0);
        fits(&self.x, point.x) && fits(&self.y, point.y)
    }

    fn grid(&self, out: &mut String, frame: &Frame) {
        let [left, right] = frame.x.to;
        let [bottom, top] = frame.y.to;
        for tick in ticks(&frame.x, self.x.unit, 6) {
            let x = frame.x.at(tick.value);
            let class = if tick.label.is_some() { "grid" } else { "minor" };
            let _ = writeln!(out, "<line class=\"{class}\" x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{top}\" y2=\"{bottom}\"/>");
            if let Some(label) = tick.label {
                let label = escape(&label);
                let y = bottom + 18.0;
                let _ =
                    writeln!(out, "<text class=\"tick\" x=\"{x:.1}\" y=\"{y}\" text-anchor=\"middle\">{label}</text>");
            }
        }
        for tick in ticks(&frame.y, self.y.unit, 7) {
            let y = frame.y.at(tick.value);
            let class = if tick.label.is_some() { "grid" } else { "minor" };
            let _ = writeln!(out, "<line class=\"{class}\" x1=\"{left}\" x2=\"{right}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/>");
            if let Some(label) = tick.label {
                let (label, x, y) = (escape(&label), left - 6.0, y + 4.5);
                let _ = writeln!(out, "<text class=\"tick\" x=\"{x}\" y=\"{y:.1}\" text-anchor=\"end\">{label}</text>");
            }
        }
    }

    fn guides(&self, out: &mut String, frame: &Frame) {
        let Some(anchor) = self.series.iter().flat_map(|s| &s.points).find(|p| self.is_shown(p)) else { return };
        for guide in &self.guides {
            let at = |x: f64| frame.y.at(anchor.y * 1.35 * (x / anchor.x).powf(guide.slope));
            let [x0, x1] = [0, 1].map(|i| frame.x.from[i]);
            let (y0, y1) = (at(x0), at(x1));
            let [left, right] = frame.x.to;
            let _ = writeln!(out, "<line class=\"guide\" x1=\"{left}\" y1=\"{y0:.1}\" x2=\"{right}\" y2=\"{y1:.1}\"/>");
            // The label rides on the line, before it leaves the plot.
            let [bottom, _] = frame.y.to;
            let slope = (y1 - y0) / (right - left);
            let exit = if slope > 0.0 { ((bottom - y0) / slope + left).min(right) } else { right };
            let x = exit - 14.0;
            let y = y0 + slope * (x - left);
            let (angle, label) = (slope.atan().to_degrees(), escape(&guide.label));
            let _ = writeln!(
                out,
                "<text class=\"guide-label\" text-anchor=\"end\" dy=\"-5\" transform=\"translate({x:.1} {y:.1}) rotate({angle:.1})\">{label}</text>"
            );
        }
    }

    fn curve(&self, out: &mut String, frame: &Frame, series: &Series) {
        let points: Vec<&Point> = series.points.iter().filter(|p| self.is_shown(p)).collect();
        let name = escape(&series.name);
        let _ = writeln!(out, "<g class=\"one c{}\" data-series=\"{name}\">", series.style % STYLES);
        let dash = dash(series.style);
        match series.fit {
            Some(ends) if ends.iter().flatten().all(|v| v.is_finite()) => {
                let [[x0, y0], [x1, y1]] = ends.map(|[x, y]| [frame.x.at(x), frame.y.at(y)]);
                let _ =
                    writeln!(out, "<line class=\"fit\" x1=\"{x0:.1}\" y1=\"{y0:.1}\" x2=\"{x1:.1}\" y2=\"{y1:.1}\"/>");
            }
            _ if points.len() > 1 => {
                let list: Vec<String> =
                    points.iter().map(|p| format!("{:.1},{:.1}", frame.x.at(p.x), frame.y.at(p.y))).collect();
                let _ = writeln!(out, "<polyline class=\"series\"{dash} points=\"{}\"/>", list.join(" "));
            }
            _ => {}
        }
        for point in points {
            let (x, y) = (frame.x.at(point.x), frame.y.at(point.y));
            out.push_str("<g>");
            let note = if point.note.is_empty() { name.clone() } else { format!("{name}\n{}", escape(&point.note)) };
            let _ = write!(out, "<title>{note}</title>");
            let [low, high] = point.bar;
            if low < high && low.is_finite() && high.is_finite() {
                // A bar that reaches to zero or below reaches out of a logarithmic plot.
                let [y0, y1] =
                    [low, high].map(|v| if self.y.scale == Scale::Log && v <= 0.0 { SIZE[1] } else { frame.y.at(v) });
                let (a, b) = (x - 3.0, x + 3.0);
                let _ = write!(
                    out,
                    "<path class=\"bar\" d=\"M{x:.1} {y0:.1}V{y1:.1}M{a:.1} {y0:.1}H{b:.1}M{a:.1} {y1:.1}H{b:.1}\"/>"
                );
            }
            out.push_str(&mark(series.style, x, y));
            out.push_str("</g>\n");
        }
        out.push_str("</g>\n");
    }
}

/// The entries of a legend, as HTML: name, style and a remark, the fitted slope say. Pressing an entry makes its curves stand out
/// from the others in all plots of the section.
pub fn legend<'a>(entries: impl IntoIterator<Item = (&'a str, usize, String)>) -> String {
    let mut out = String::from("<ul class=\"legend\">\n");
    for (name, style, remark) in entries {
        let name = escape(name);
        let remark =
            if remark.is_empty() { String::new() } else { format!(" <span class=\"note\">{}</span>", escape(&remark)) };
        let _ = writeln!(
            out,
            "<li><button type=\"button\" data-series=\"{name}\" aria-pressed=\"false\">{}<span>{name}{remark}</span></button></li>",
            key(style)
        );
    }
    out + "</ul>\n"
}

/// A sample of a curve's line and mark, for legends and tables.
pub fn key(style: usize) -> String {
    format!(
        "<svg class=\"key c{}\" viewBox=\"0 0 34 14\" aria-hidden=\"true\"><path class=\"series\"{} d=\"M0 7H34\"/>{}</svg>",
        style % STYLES,
        dash(style),
        mark(style, 17.0, 7.0)
    )
}

/// The ninth and further curves have the colours of the first, and broken lines.
fn dash(style: usize) -> &'static str {
    match style / STYLES {
        0 => "",
        1 => " stroke-dasharray=\"7 3\"",
        _ => " stroke-dasharray=\"2 3\"",
    }
}

/// A mark in the shape of its style.
fn mark(style: usize, x: f64, y: f64) -> String {
    let polygon = |corners: &[[f64; 2]]| {
        let list: Vec<String> = corners.iter().map(|[dx, dy]| format!("{:.1},{:.1}", x + dx, y + dy)).collect();
        format!("<polygon class=\"mark\" points=\"{}\"/>", list.join(" "))
    };
    let strokes = |path: &str| format!("<path class=\"mark\" d=\"M{x:.1} {y:.1}{path}\"/>");
    match style % STYLES {
        0 => format!("<circle class=\"mark\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.8\"/>"),
        1 => polygon(&[[-3.5, -3.5], [3.5, -3.5], [3.5, 3.5], [-3.5, 3.5]]),
        2 => polygon(&[[0.0, -4.6], [4.3, 3.2], [-4.3, 3.2]]),
        3 => polygon(&[[0.0, -5.0], [5.0, 0.0], [0.0, 5.0], [-5.0, 0.0]]),
        4 => polygon(&[[0.0, 4.6], [4.3, -3.2], [-4.3, -3.2]]),
        5 => strokes("m-3.6 -3.6l7.2 7.2m0 -7.2l-7.2 7.2"),
        6 => strokes("m-4.6 0h9.2m-4.6 -4.6v9.2"),
        _ => polygon(&[[-2.4, -4.2], [2.4, -4.2], [4.8, 0.0], [2.4, 4.2], [-2.4, 4.2], [-4.8, 0.0]]),
    }
}

/// Both axes as they lie on the plot.
struct Frame {
    x: Mapping,
    y: Mapping,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: Vec<Point>, scale: Scale) -> Plot {
        Plot {
            title: "a < b".to_owned(),
            x: Axis { label: "x".to_owned(), scale, unit: "" },
            y: Axis { label: "y".to_owned(), scale, unit: "" },
            series: vec![Series { name: "<s>".to_owned(), style: 0, points, fit: None }],
            guides: vec![Guide { slope: -1.0, label: "∝ 1/x".to_owned() }],
        }
    }

    #[test]
    fn plots_show_every_point_that_has_a_place() {
        let points = vec![
            Point::new(1.0, 1.0).with_bar(0.5, 1.5),
            Point::new(2.0, 0.5).with_bar(-0.1, 1.0).with_note("half & half".to_owned()),
            Point::new(4.0, -1.0),
            Point::new(8.0, f64::NAN),
        ];
        let svg = plot(points, Scale::Log).svg();
        assert_eq!(svg.matches("<circle").count(), 2);
        assert_eq!(svg.matches("class=\"bar\"").count(), 2);
        assert!(svg.contains("half &amp; half") && svg.contains("data-series=\"&lt;s&gt;\"") && svg.contains("∝ 1/x"));
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }

    #[test]
    fn odd_data_give_a_plot_all_the_same() {
        for scale in [Scale::Log, Scale::Linear] {
            for points in [
                vec![],
                vec![Point::new(f64::NAN, 1.0)],
                vec![Point::new(3.0, 3.0)],
                vec![Point::new(1e-300, 1e300); 2],
            ] {
                let svg = plot(points, scale).svg();
                assert!(svg.ends_with("</svg>\n") && !svg.contains("NaN") && !svg.contains("inf"), "{svg}");
            }
        }
        assert!(plot(vec![], Scale::Log).svg().contains("nothing to show"));
    }

    #[test]
    fn each_style_has_its_mark() {
        let marks: std::collections::HashSet<String> = (0..STYLES).map(|style| mark(style, 0.0, 0.0)).collect();
        assert_eq!(marks.len(), STYLES);
        assert_ne!(key(0), key(STYLES));
    }
}
