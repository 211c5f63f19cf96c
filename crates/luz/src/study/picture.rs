//! Pictures inside a page: data URIs, false colours, and a gallery in which all zoom together.

use super::html::escape;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use luz_image::metrics::false_color;
use luz_image::{Format, Image, ImageError, ToneMap, WriteOptions};
use std::fmt::Write;

/// A file inside a page.
pub fn data_uri(mime: &str, bytes: &[u8]) -> String {
    format!("data:{mime};base64,{}", STANDARD.encode(bytes))
}

/// An image's colour, tone-mapped, as a PNG inside a page.
///
/// # Errors
/// If the image has no channels R, G and B, or Y.
pub fn png(image: &Image, tone_map: ToneMap) -> Result<String, ImageError> {
    let bytes = image.encode(Format::Png, &WriteOptions { tone_map, ..WriteOptions::default() })?;
    Ok(data_uri("image/png", &bytes))
}

/// What the false colours stand for: the logarithms of the numbers between two bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogScale {
    /// What is black, and so is all below. Positive.
    pub low: f32,
    /// What has the brightest colour, and so has all above.
    pub high: f32,
}

impl LogScale {
    /// A scale for all these numbers together, so that their pictures can be compared: up to what 99.5 % of them stay below, and
    /// from as many decades below it as given. Numbers that are not positive and finite do not count; without any, up to 1.
    pub fn of<'a>(values: impl IntoIterator<Item = &'a f32>, decades: f32) -> Self {
        let mut usable: Vec<f32> = values.into_iter().copied().filter(|v| *v > 0.0 && v.is_finite()).collect();
        let high = if usable.is_empty() {
            1.0
        } else {
            let index = ((usable.len() - 1) as f64 * 0.995).round() as usize;
            *usable.select_nth_unstable_by(index, f32::total_cmp).1
        };
        Self { low: (high * 10f32.powf(-decades)).max(f32::MIN_POSITIVE), high }
    }

    /// Where a number lies on the scale, from 0 to 1; NaN for what is not a number.
    pub fn place(&self, value: f32) -> f32 {
        if value.is_nan() {
            return f32::NAN;
        }
        let (low, high) = (self.low.ln(), self.high.ln());
        if value <= self.low || high <= low { 0.0 } else { ((value.ln() - low) / (high - low)).min(1.0) }
    }

    /// Numbers, row by row, in false colours, as a PNG inside a page. What is not a number is green.
    ///
    /// # Errors
    /// If there are not `width` times `height` of them.
    pub fn png(&self, width: usize, height: usize, values: &[f32]) -> Result<String, ImageError> {
        let colors = values.iter().flat_map(|&v| false_color(self.place(v))).collect();
        png(&Image::from_data(width, height, ["R", "G", "B"], colors)?, ToneMap::default())
    }

    /// The colours with the numbers at their ends, as HTML.
    ///
    /// # Errors
    /// None that can be expected.
    pub fn key(&self, label: &str) -> Result<String, ImageError> {
        const STEPS: usize = 256;
        let colors = (0..STEPS).flat_map(|i| false_color(i as f32 / (STEPS - 1) as f32)).collect();
        let strip = png(&Image::from_data(STEPS, 1, ["R", "G", "B"], colors)?, ToneMap::default())?;
        let number = |v: f32| super::number::significant(f64::from(v), 2);
        let (low, high) = (number(self.low), number(self.high));
        Ok(format!(
            "<div class=\"scale\"><span>≤ {low}</span><img src=\"{strip}\" alt=\"from black through violet, red and orange to pale \
             yellow, on a logarithmic scale\"><span>≥ {high}</span></div>\n<p class=\"note\">{}</p>\n",
            escape(label)
        ))
    }
}

/// What can be seen of a frame, one at a time.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// `Picture`, `Error`; equal in all frames that have it.
    pub name: String,
    /// The image, as [`png`] gives it.
    pub source: String,
}

/// One picture of a gallery, in several layers.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Its name.
    pub name: String,
    /// A line of small print below it.
    pub remark: String,
    /// At least one, the first of which is shown where a frame lacks a layer.
    pub layers: Vec<Layer>,
    /// Is it what the others are compared with?
    pub is_reference: bool,
}

/// Pictures of the same size, which zoom together, change layers together, and can be compared in pairs under a slider.
#[derive(Clone, Debug, PartialEq)]
pub struct Gallery {
    /// The pictures' width in pixels.
    pub width: usize,
    /// The pictures' height in pixels.
    pub height: usize,
    /// The pictures.
    pub frames: Vec<Frame>,
    /// Explanations (HTML) that are seen with a layer only, by its name: the scale of false colours.
    pub keys: Vec<(String, String)>,
}

impl Gallery {
    /// The names of all layers, in the order in which frames have them.
    fn layers(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for layer in self.frames.iter().flat_map(|f| &f.layers) {
            if !names.contains(&layer.name.as_str()) {
                names.push(&layer.name);
            }
        }
        names
    }

    /// As HTML.
    pub fn html(&self) -> String {
        let layers = self.layers();
        let first = escape(layers.first().copied().unwrap_or_default());
        let (width, height) = (self.width, self.height);
        // Small pictures may be small on the page, wide ones want to be wide.
        let least = (width as f64 * if width < 200 { 2.0 } else { 1.0 } / 16.0).clamp(12.0, 22.0);
        let mut out = format!(
            "<div class=\"gallery\" data-width=\"{width}\" data-first=\"{first}\" style=\"--least: {least:.1}rem\">\n"
        );
        // Writing to a string cannot fail.
        out += "<div class=\"controls\">";
        if layers.len() > 1 {
            out += "<div class=\"group\" role=\"group\" aria-label=\"What is shown\">";
            for name in &layers {
                let name = escape(name);
                let _ =
                    write!(out, "<button type=\"button\" data-show=\"{name}\" aria-pressed=\"false\">{name}</button>");
            }
            out += "</div>";
        }
        out += "<div class=\"group\" role=\"group\" aria-label=\"Zoom of all pictures\">\
                <button type=\"button\" data-zoom=\"0.5\" aria-label=\"Zoom out\">−</button>\
                <button type=\"button\" data-zoom=\"2\" aria-label=\"Zoom in\">+</button>\
                <button type=\"button\" data-zoom=\"0\">Whole</button>\
                <span class=\"note readout\" aria-live=\"polite\"></span></div></div>\n";
        for (layer, html) in &self.keys {
            let _ = writeln!(out, "<div data-key=\"{}\">{html}</div>", escape(layer));
        }
        out += "<div class=\"frames\">\n";
        for frame in &self.frames {
            let name = escape(&frame.name);
            let class = if frame.is_reference { "frame anchor" } else { "frame" };
            let _ = write!(
                out,
                "<figure class=\"{class}\"><div class=\"view\" tabindex=\"0\" role=\"group\" aria-label=\"{name}, zoomable\">"
            );
            for Layer { name: layer, source } in &frame.layers {
                let layer = escape(layer);
                let _ = write!(
                    out,
                    "<img data-layer=\"{layer}\" src=\"{source}\" width=\"{width}\" height=\"{height}\" alt=\"{name}: {layer}\" \
                     draggable=\"false\">"
                );
            }
            let remark = escape(&frame.remark);
            let _ =
                writeln!(out, "</div><figcaption>{name} <span class=\"note\">{remark}</span></figcaption></figure>");
        }
        out += "</div>\n";
        if self.frames.len() > 1 {
            out += &self.wipe();
        }
        out += "<p class=\"note\">Click, pinch, or hold Ctrl and scroll to zoom; drag to move; with the keyboard + − 0 and arrows. All \
                pictures move together.</p>\n";
        out + "</div>\n"
    }

    /// Two pictures over each other, parted by a slider.
    fn wipe(&self) -> String {
        let (width, height) = (self.width, self.height);
        let select = |label: &str, chosen: usize| {
            let mut options = String::new();
            for (index, frame) in self.frames.iter().enumerate() {
                let selected = if index == chosen { " selected" } else { "" };
                let _ = write!(options, "<option value=\"{index}\"{selected}>{}</option>", escape(&frame.name));
            }
            format!("<label>{label} <select>{options}</select></label>")
        };
        let image = format!("<img width=\"{width}\" height=\"{height}\" alt=\"\" draggable=\"false\">");
        let widest = (width as f64 * if width < 400 { 2.0 } else { 1.0 }).clamp(320.0, 1100.0);
        format!(
            "<div class=\"wipe\"><h3>Two of them, one over the other</h3>\n<div class=\"controls\">{}{}</div>\n\
             <div style=\"max-width: {widest:.0}px\"><div class=\"view\" tabindex=\"0\" role=\"group\" aria-label=\"Two pictures, zoomable\">\
             {image}<div class=\"inner\">{image}</div><div class=\"seam\"></div></div>\n\
             <input type=\"range\" min=\"0\" max=\"100\" value=\"50\" step=\"0.5\" aria-label=\"Where the left picture ends\"></div></div>\n",
            select("Left", 0),
            select("Right", self.frames.len() - 1),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_survive_the_page() {
        let image = Image::from_data(2, 1, ["R", "G", "B"], vec![1.0, 0.0, 0.0, 0.0, 0.0, 1.0]).unwrap();
        let uri = png(&image, ToneMap::default()).unwrap();
        let bytes = STANDARD.decode(uri.strip_prefix("data:image/png;base64,").unwrap()).unwrap();
        assert_eq!(Image::decode(&bytes, None, &Default::default()).unwrap().data(), image.data());
    }

    #[test]
    fn scales_leave_out_the_brightest_and_what_is_not_a_number() {
        let values: Vec<f32> = (1..=1000).map(|i| i as f32).chain([f32::NAN, f32::INFINITY, 0.0, -1.0]).collect();
        let scale = LogScale::of(&values, 2.0);
        assert_eq!((scale.high, scale.low), (995.0, 9.95));
        assert_eq!(scale.place(1e9), 1.0);
        assert_eq!(scale.place(0.0), 0.0);
        assert!((scale.place(99.5) - 0.5).abs() < 1e-6);
        assert!(scale.place(f32::NAN).is_nan());
        assert_eq!(LogScale::of(&[], 2.0).high, 1.0);
        assert_eq!(LogScale::of(&[0.0, f32::NAN], 2.0).png(2, 1, &[0.0, f32::NAN]).unwrap().get(..5), Some("data:"));
        assert!(scale.png(3, 3, &[1.0]).is_err());
        assert!(scale.key("error").unwrap().contains("≥ 995"));
    }

    #[test]
    fn galleries_offer_all_layers_and_escape_names() {
        let layer = |name: &str| Layer { name: name.to_owned(), source: "data:,".to_owned() };
        let frame = |name: &str, layers: &[&str]| Frame {
            name: name.to_owned(),
            remark: "<i>".to_owned(),
            layers: layers.iter().map(|l| layer(l)).collect(),
            is_reference: name == "reference",
        };
        let frames = vec![frame("a<b", &["Picture", "Error"]), frame("reference", &["Picture"])];
        let html =
            Gallery { width: 10, height: 5, frames, keys: vec![("Error".to_owned(), "<p>key</p>".to_owned())] }.html();
        assert_eq!(html.matches("data-show=").count(), 2);
        assert!(html.contains("a&lt;b: Error") && html.contains("&lt;i&gt;") && !html.contains("<i>"));
        assert!(html.contains("data-key=\"Error\"") && html.contains("class=\"wipe\""));
    }
}
