//! The point sets of the strategies, drawn.

use super::FilterStudy;
use crate::study::html::escape;
use luz_filter::{BilateralFilter, Strategy};
use luz_sample::point_set::Request;
use std::fmt::Write;

/// One set of so many points in the window of a study, as SVG: lines at every σ_s, the window's edge.
pub(super) fn drawing(study: &FilterStudy, strategy: Strategy, count: usize, seed: u64) -> String {
    let radius = BilateralFilter::new(study.sigma_spatial, study.sigma_range).radius() as f64;
    let limit = (radius + 0.5) / f64::from(study.sigma_spatial);
    let request = Request { dimensions: 2, count, seed, member: 0, members: 1 };
    let points = strategy.points().normal(&request, [limit, limit, 0.0]).points;
    let size = limit + 0.1;
    let label = escape(&format!("{count} points of the strategy {}", strategy.name()));
    let mut out = format!(
        "<svg viewBox=\"{} {} {} {}\" role=\"img\" aria-label=\"{label}\" style=\"width:100%;max-width:14rem\">\n",
        -size,
        -size,
        2.0 * size,
        2.0 * size
    );
    // Writing to a string cannot fail.
    let line = "fill=\"none\" stroke=\"currentColor\" stroke-opacity=\"0.3\" stroke-width=\"0.015\"";
    let _ = writeln!(out, "<rect x=\"{0}\" y=\"{0}\" width=\"{1}\" height=\"{1}\" {line}/>", -limit, 2.0 * limit);
    for sigma in 1..=limit as usize {
        let _ = writeln!(out, "<circle r=\"{sigma}\" {line}/>");
    }
    for [x, y, _] in points {
        let _ = writeln!(out, "<circle cx=\"{x:.3}\" cy=\"{y:.3}\" r=\"0.055\" fill=\"currentColor\"/>");
    }
    out + "</svg>\n"
}
