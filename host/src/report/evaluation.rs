//! The report of an evaluation: the figure, the numbers behind it, the settings.

use super::html::escape;
use super::page::{Page, section};
use super::table;
use crate::evaluate::{Row, Summary};

/// What a report says besides the results.
pub struct Subject<'a> {
    /// What was compared, a heading.
    pub title: &'a str,
    /// Unit of the meshes.
    pub unit: &'a str,
    /// What a user should know of shapes and targets.
    pub notes: &'a [String],
    /// Names and values of the settings.
    pub settings: &'a [(&'a str, String)],
    /// What to type to repeat it.
    pub command: &'a str,
}

/// The whole file for figure 2: `drawing` is SVG.
pub fn figure2(summary: &Summary, drawing: &str, subject: &Subject<'_>) -> String {
    let results = summary.counts.iter().flat_map(|(count, models)| {
        models.iter().map(move |(model, row)| ([count.to_string(), model.to_string()], *row))
    });
    let [one, two] = ["shapes", "model"];
    let figure = format!(
        "<figure class=\"plot\" role=\"img\" aria-label=\"Boxplots of the rms distance over the number of training \
         shapes; the table below has the numbers\">\n{drawing}</figure>\n\
         <p class=\"note\">Boxes from quartile to quartile, a dot at the median, whiskers to the last values within \
         1.5 box heights.</p>\n"
    );
    page(
        subject,
        &[
            section("figure", "Rms distance over the number of training shapes", &figure),
            numbers([one, two], results, subject),
        ],
    )
}

/// The whole file for an ablation: a row a method.
pub fn ablation(rows: &[(&str, Summary)], subject: &Subject<'_>) -> String {
    let results = rows.iter().flat_map(|(name, summary)| {
        let models = summary.counts.values().flatten();
        models.map(move |(model, row)| ([(*name).to_owned(), model.to_string()], *row))
    });
    page(subject, &[numbers(["method", "model"], results, subject)])
}

fn numbers(
    names: [&str; 2],
    results: impl Iterator<Item = ([String; 2], Row)>,
    subject: &Subject<'_>,
) -> String {
    let rows: Vec<Vec<String>> =
        results.map(|([a, b], row)| vec![a, b, row.rms.to_string(), row.p95.to_string()]).collect();
    let unit = subject.unit;
    let head = [names[0], names[1], &format!("rms {unit}"), &format!("95th percentile {unit}")];
    let note = "<p class=\"note\">Median over draws and targets, quartiles in brackets; distances from the \
                approximation's vertices to the target.</p>\n";
    section("numbers", "Numbers", &(table::grid(&head, &rows) + note))
}

fn page(subject: &Subject<'_>, parts: &[String]) -> String {
    let repeat = format!("<pre>{}</pre>\n{}", escape(subject.command), table::pairs(subject.settings));
    let notes = table::list(subject.notes.iter());
    let body = [
        format!("<h1>{}</h1>\n", escape(subject.title)),
        parts.concat(),
        if notes.is_empty() { notes } else { section("notes", "Notes", &notes) },
        section("repeat", "To repeat it", &repeat),
    ];
    Page { title: subject.title, body: &body.concat(), scene: None }.html()
}
