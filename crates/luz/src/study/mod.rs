//! Studies: what an estimator does, measured and shown.
//!
//! General building blocks of reports that are one self-contained HTML file each, without network or library:
//!
//! * [`html`]: the page, its sections, escaping
//! * [`plot`]: curves with error bars and fits, linear or logarithmic, as SVG
//! * [`chart`]: rows of intervals, and stacked bars, as SVG
//! * [`picture`]: images and false colours as data URIs, and a gallery with synchronised zoom
//! * [`table`]: tables as HTML and CSV
//! * [`number`]: numbers for people
//! * [`statistics`]: fits of power laws, confidence intervals of means and of ratios
//!
//! Beside them, [`render`] studies variants of a rendering, and [`filter`] the strategies of the bilateral filter.
//!
//! A page is put together from strings of HTML:
//!
//! ```
//! use luz::study::{html::Page, plot::{Axis, Plot, Point, Series}};
//!
//! let points = [1.0, 10.0, 100.0].map(|n| Point::new(n, 0.3 / n).with_bar(0.25 / n, 0.35 / n));
//! let series = vec![Series { name: "sobol".to_owned(), style: 0, points: points.to_vec(), fit: None }];
//! let plot = Plot {
//!     title: "Error against samples".to_owned(),
//!     x: Axis::log("samples per pixel"),
//!     y: Axis::log("MSE"),
//!     series,
//!     guides: vec![],
//! };
//! let mut page = Page::new("A study", "of one sampler");
//! page.section("convergence", "Convergence", &plot.figure());
//! assert!(page.finish().starts_with("<!doctype html>"));
//! ```

mod axis;
pub mod chart;
pub mod filter;
pub mod html;
pub mod number;
pub mod picture;
pub mod plot;
pub mod render;
pub mod statistics;
pub mod table;
