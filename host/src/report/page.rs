//! The frame of a report: head, style, script.

use super::html::escape;

const STYLE: &str = include_str!("style.css");
const VIEWER: &str = include_str!("viewer.js");
/// Nothing is loaded from anywhere, whatever a page contains.
const POLICY: &str =
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'";

/// A page in parts.
pub struct Page<'a> {
    /// Its title, plain text.
    pub title: &'a str,
    /// What stands in `main`, HTML.
    pub body: &'a str,
    /// What the interactive view shows, JSON fit for a script; no view without it.
    pub scene: Option<&'a str>,
}

/// What stands at the beginning of every report, so that it is known as one.
pub const MARK: &str = "<meta name=\"generator\" content=\"lacuna\">";

impl Page<'_> {
    /// The whole file.
    pub fn html(&self) -> String {
        let title = escape(self.title);
        let script = self.scene.map_or(String::new(), |scene| {
            format!(
                "<script type=\"application/json\" id=\"scene\">{scene}</script>\n<script>\n{VIEWER}</script>\n"
            )
        });
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
             {MARK}\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n\
             <link rel=\"icon\" href=\"data:,\">\n\
             <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n{}</main>\n\
             <footer>Made by lacuna {}. This file needs nothing else: it can be mailed, printed and kept.</footer>\n\
             {script}</body>\n</html>\n",
            self.body,
            env!("CARGO_PKG_VERSION"),
        )
    }
}

/// A section with a heading; `id` is for links to it, `content` is HTML.
pub fn section(id: &str, heading: &str, content: &str) -> String {
    format!(
        "<section id=\"{id}\" aria-labelledby=\"{id}-heading\">\n<h2 id=\"{id}-heading\">{}</h2>\n{content}</section>\n",
        escape(heading)
    )
}
