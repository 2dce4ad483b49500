//! Tables of a report.

use super::html::escape;
use std::fmt::Write;

/// Names and values, all of them plain text, one pair a row.
pub fn pairs(rows: &[(&str, String)]) -> String {
    let mut out = String::from("<div class=\"scroll\"><table class=\"pairs\"><tbody>\n");
    for (name, value) in rows {
        let _ = writeln!(out, "<tr><th scope=\"row\">{}</th><td>{}</td></tr>", escape(name), escape(value));
    }
    out + "</tbody></table></div>\n"
}

/// A table with a head; the first cell of a row names it. Plain text.
pub fn grid(head: &[&str], rows: &[Vec<String>]) -> String {
    let cells = |tag: &str, cells: &mut dyn Iterator<Item = &str>| -> String {
        cells.map(|cell| format!("<{tag}>{}</{}>", escape(cell), &tag[..2])).collect()
    };
    let mut out = String::from("<div class=\"scroll\"><table class=\"grid\"><thead><tr>");
    out += &cells("th scope=\"col\"", &mut head.iter().copied());
    out += "</tr></thead><tbody>\n";
    for row in rows {
        let mut texts = row.iter().map(String::as_str);
        let name = cells("th scope=\"row\"", &mut texts.by_ref().take(1));
        let _ = writeln!(out, "<tr>{name}{}</tr>", cells("td", &mut texts));
    }
    out + "</tbody></table></div>\n"
}

/// Sentences, one an item. Plain text; nothing if there are none.
pub fn list<'a>(items: impl Iterator<Item = &'a String>) -> String {
    let items: String = items.map(|text| format!("<li>{}</li>\n", escape(text))).collect();
    if items.is_empty() { items } else { format!("<ul>\n{items}</ul>\n") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_escaped_and_rows_are_named() {
        let text = grid(&["a", "b"], &[vec!["<1>".into(), "2".into()]]);
        assert!(text.contains("<th scope=\"row\">&lt;1&gt;</th><td>2</td>"), "{text}");
        assert!(pairs(&[("x", "&".into())]).contains("<td>&amp;</td>"));
        assert_eq!(list(["<".to_owned()].iter()), "<ul>\n<li>&lt;</li>\n</ul>\n");
        assert_eq!(list([].iter()), "");
    }
}
