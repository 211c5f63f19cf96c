//! The page: its head, its style, its sections.
//!
//! A page is one file that needs nothing else: style and script are inside, images are data URIs, and a content security policy
//! forbids the browser to fetch anything. It reads without the script, which adds synchronised zoom, highlighting and the choice
//! of light and dark.

use std::fmt::Write;

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// Text as HTML, safe in elements and in quoted attributes.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            // Neither HTML nor the XML of an SVG has them.
            c if c.is_control() && !matches!(c, '\n' | '\t') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// A paragraph of text.
pub fn paragraph(text: &str) -> String {
    format!("<p>{}</p>\n", escape(text))
}

/// A paragraph in small print: how something was measured, what to beware of.
pub fn note(text: &str) -> String {
    format!("<p class=\"note\">{}</p>\n", escape(text))
}

/// A paragraph that nobody should overlook.
pub fn warning(text: &str) -> String {
    format!("<p class=\"warning\">{}</p>\n", escape(text))
}

/// Something that most readers want folded away.
pub fn details(summary: &str, html: &str) -> String {
    format!("<details><summary>{}</summary>\n{html}</details>\n", escape(summary))
}

/// One statement that the reader should take home: a large figure, what it is, and what it is compared with.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// The figure: `3.2 ×`.
    pub figure: String,
    /// What it is, in a few words.
    pub what: String,
    /// Its uncertainty or conditions, in small print.
    pub remark: String,
}

/// Statements side by side.
pub fn findings(findings: &[Finding]) -> String {
    let mut out = String::from("<div class=\"findings\">\n");
    for Finding { figure, what, remark } in findings {
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            "<div class=\"finding\"><p class=\"figure\">{}</p><p>{}</p><p class=\"note\">{}</p></div>",
            escape(figure),
            escape(what),
            escape(remark)
        );
    }
    out + "</div>\n"
}

/// Several blocks of which the reader chooses one to be seen, all at once where the choices have the same names: choosing `MSE`
/// once shows it everywhere on the page. Each is (name, HTML). Without the script, all are seen.
pub fn alternatives(blocks: &[(&str, String)]) -> String {
    let mut out = String::from("<div class=\"alternatives\">\n<div class=\"choices\" role=\"group\">");
    for (index, (name, _)) in blocks.iter().enumerate() {
        let name = escape(name);
        let _ = write!(
            out,
            "<button type=\"button\" data-choice=\"{name}\" aria-pressed=\"{}\">{name}</button>",
            index == 0
        );
    }
    out += "</div>\n";
    for (name, html) in blocks {
        let _ = write!(out, "<div class=\"alternative\" data-name=\"{}\">\n{html}</div>\n", escape(name));
    }
    out + "</div>\n"
}

/// A file that the reader may save, inside the page.
pub fn download(name: &str, mime: &str, contents: &[u8]) -> String {
    let data = super::picture::data_uri(mime, contents);
    let name = escape(name);
    format!("<a class=\"button\" download=\"{name}\" href=\"{data}\">{name}</a>\n")
}

/// A page under construction.
#[derive(Clone, Debug)]
pub struct Page {
    title: String,
    subtitle: String,
    contents: Vec<(String, String)>,
    body: String,
}

impl Page {
    /// A page without sections.
    pub fn new(title: &str, subtitle: &str) -> Self {
        Self { title: title.to_owned(), subtitle: subtitle.to_owned(), contents: Vec::new(), body: String::new() }
    }

    /// Adds HTML that belongs to no section, such as what is to be said first.
    pub fn push(&mut self, html: &str) {
        self.body.push_str(html);
    }

    /// Adds a section; `id` is its anchor, of letters, digits and hyphens.
    pub fn section(&mut self, id: &str, heading: &str, html: &str) {
        let (id, heading) = (escape(id), escape(heading));
        let _ = write!(
            self.body,
            "<section id=\"{id}\" aria-labelledby=\"{id}-heading\">\n<h2 id=\"{id}-heading\">{heading}</h2>\n{html}</section>\n"
        );
        self.contents.push((id, heading));
    }

    /// The whole file.
    pub fn finish(&self) -> String {
        let Self { title, subtitle, contents, body } = self;
        let (title, subtitle) = (escape(title), escape(subtitle));
        let links: String = contents.iter().map(|(id, heading)| format!("<a href=\"#{id}\">{heading}</a>")).collect();
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'; \
             script-src 'unsafe-inline'\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n<meta name=\"generator\" content=\"luz {version}\">\n\
             <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
             <header>\n<div><h1>{title}</h1>\n<p class=\"subtitle\">{subtitle}</p></div>\n\
             <button type=\"button\" class=\"theme\" hidden>Dark</button>\n</header>\n\
             <nav aria-label=\"Sections\">{links}</nav>\n<main>\n{body}</main>\n\
             <footer>luz {version}</footer>\n<script>\n{SCRIPT}</script>\n</body>\n</html>\n",
            version = env!("CARGO_PKG_VERSION"),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_gets_out_of_its_place() {
        let evil = "<script>alert(\"1\") & 'x'</script>\u{0}";
        let safe = "&lt;script&gt;alert(&quot;1&quot;) &amp; &#39;x&#39;&lt;/script&gt;\u{fffd}";
        assert_eq!(escape(evil), safe);
        let mut page = Page::new(evil, evil);
        page.section(evil, evil, &(paragraph(evil) + &note(evil) + &warning(evil) + &details(evil, "")));
        page.push(&findings(&[Finding { figure: evil.into(), what: evil.into(), remark: evil.into() }]));
        page.push(&alternatives(&[(evil, String::new())]));
        page.push(&download(evil, "text/csv", evil.as_bytes()));
        let html = page.finish();
        // The page's own, at its end, and no other.
        assert_eq!(html.matches("<script>").count(), 1);
        assert!(!html.contains("alert(\""));
    }

    #[test]
    fn a_page_needs_nothing_from_outside() {
        let mut page = Page::new("A study", "of something");
        page.section("first", "First", "<p>one</p>");
        let html = page.finish();
        assert!(html.contains("<a href=\"#first\">First</a>") && html.contains("<section id=\"first\""));
        for outside in ["http:", "https:", "src=\"/", "@import", "url("] {
            assert!(!html.contains(outside), "{outside}");
        }
    }

    #[test]
    fn script_and_style_end_where_they_should() {
        assert!(!STYLE.contains("</") && !SCRIPT.contains("</"));
    }
}
