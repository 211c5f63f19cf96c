//! Tables, for people and for spreadsheets.

use super::html::escape;
use std::fmt::Write;

/// What a cell holds.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Text, to the left.
    Text(String),
    /// A number as people want to read it, to the right.
    Number(String),
    /// HTML as it is, to the left.
    Html(String),
}

impl Cell {
    /// Text, to the left.
    pub fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }

    /// A number, to the right.
    pub fn number(text: impl Into<String>) -> Self {
        Self::Number(text.into())
    }
}

/// A table with a heading for each column; the first cell of each row is the row's heading.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// What it shows.
    pub caption: String,
    /// The columns' headings.
    pub columns: Vec<String>,
    /// The rows, each as long as there are columns.
    pub rows: Vec<Vec<Cell>>,
}

impl Table {
    /// As HTML; wide tables scroll on their own.
    pub fn html(&self) -> String {
        let is_number = |column: usize| self.rows.iter().any(|row| matches!(row.get(column), Some(Cell::Number(_))));
        let label = escape(if self.caption.is_empty() { "Table" } else { &self.caption });
        let mut out = format!("<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{label}\"><table>\n");
        // Writing to a string cannot fail.
        if !self.caption.is_empty() {
            let _ = writeln!(out, "<caption>{label}</caption>");
        }
        out += "<thead><tr>";
        for (index, column) in self.columns.iter().enumerate() {
            let class = if is_number(index) { " class=\"number\"" } else { "" };
            let _ = write!(out, "<th scope=\"col\"{class}>{}</th>", escape(column));
        }
        out += "</tr></thead>\n<tbody>\n";
        for row in &self.rows {
            out += "<tr>";
            for (index, cell) in row.iter().enumerate() {
                let (class, html) = match cell {
                    Cell::Text(text) => ("", escape(text)),
                    Cell::Number(text) => (" class=\"number\"", escape(text)),
                    Cell::Html(html) => ("", html.clone()),
                };
                let _ = if index == 0 {
                    write!(out, "<th scope=\"row\"{class}>{html}</th>")
                } else {
                    write!(out, "<td{class}>{html}</td>")
                };
            }
            out += "</tr>\n";
        }
        out + "</tbody></table></div>\n"
    }
}

/// A row of comma-separated values (RFC 4180), with its end of line.
pub fn csv_row<S: AsRef<str>>(cells: impl IntoIterator<Item = S>) -> String {
    let quoted = |cell: S| {
        let text = cell.as_ref();
        if text.contains(['"', ',', '\n', '\r']) {
            format!("\"{}\"", text.replace('"', "\"\""))
        } else {
            text.to_owned()
        }
    };
    cells.into_iter().map(quoted).collect::<Vec<_>>().join(",") + "\r\n"
}

/// A number in a cell of comma-separated values, with all its digits; nothing for what is not finite.
pub fn csv_number(value: f64) -> String {
    if value.is_finite() { format!("{value:?}") } else { String::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_escape_and_align() {
        let table = Table {
            caption: "a & b".to_owned(),
            columns: vec!["name".to_owned(), "<n>".to_owned()],
            rows: vec![
                vec![Cell::text("<x>"), Cell::number("1.5")],
                vec![Cell::Html("<b>y</b>".to_owned()), Cell::number("2")],
            ],
        };
        let html = table.html();
        assert!(html.contains("<caption>a &amp; b</caption>"));
        assert!(html.contains("<th scope=\"col\" class=\"number\">&lt;n&gt;</th>"));
        assert!(html.contains("<th scope=\"row\">&lt;x&gt;</th><td class=\"number\">1.5</td>"));
        assert!(html.contains("<b>y</b>"));
    }

    #[test]
    fn csv_quotes_what_it_must() {
        assert_eq!(csv_row(["a", "b,c", "d\"e", ""]), "a,\"b,c\",\"d\"\"e\",\r\n");
        assert_eq!(csv_number(0.1), "0.1");
        assert_eq!(csv_number(1e-20), "1e-20");
        assert_eq!(csv_number(f64::NAN), "");
    }
}
