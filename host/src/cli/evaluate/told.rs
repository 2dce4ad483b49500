//! What `lacuna evaluate` tells: tables as lines, as JSON and as CSV.

use crate::evaluate::{Record, Summary};
use crate::unit;
use lacuna::format::Unit;
use serde_json::json;

/// Figure 2 as a table.
pub fn figure(summary: &Summary, unit: Unit) -> String {
    let mut lines =
        vec![format!("shapes  model            rms {0:23} p95 {0}, median [quartiles]", unit::symbol(unit))];
    for (count, models) in &summary.counts {
        for (model, row) in models {
            lines.push(format!("{count:6}  {:16} {:26} {}", model.to_string(), row.rms, row.p95));
        }
    }
    lines.join("\n")
}

/// The same for programs.
pub fn figure_json(summary: &Summary, notes: &[String]) -> serde_json::Result<String> {
    serde_json::to_string_pretty(&json!({ "counts": summary.counts, "notes": notes }))
}

/// Departures from the paper, and what each of them makes of the shapes.
pub fn ablation(rows: &[(&str, Summary)], unit: Unit) -> String {
    let unit = unit::symbol(unit);
    let mut lines =
        vec![format!("method                        model    rms {unit:23} p95 {unit}, median [quartiles]")];
    for (name, summary) in rows {
        for (model, row) in summary.counts.values().flatten() {
            lines.push(format!("{name:29} {:8} {:26} {}", model.to_string(), row.rms, row.p95));
        }
    }
    lines.join("\n")
}

/// The same for programs.
pub fn ablation_json(rows: &[(&str, Summary)], notes: &[String]) -> serde_json::Result<String> {
    let row = |(name, summary): &(&str, Summary)| json!({ "method": name, "counts": summary.counts });
    let rows: Vec<_> = rows.iter().map(row).collect();
    serde_json::to_string_pretty(&json!({ "ablation": rows, "notes": notes }))
}

/// The setting that names the program.
pub const PROGRAM: &str = "program";

/// Settings for programs.
pub fn settings(settings: &[(&str, String)]) -> serde_json::Result<String> {
    let map: serde_json::Map<_, _> =
        settings.iter().map(|(name, value)| ((*name).to_owned(), value.as_str().into())).collect();
    serde_json::to_string_pretty(&map)
}

/// Whether [`settings`] wrote this.
pub fn is_settings(text: &[u8]) -> bool {
    let settings: Option<serde_json::Value> = serde_json::from_slice(text).ok();
    let program = settings.as_ref().and_then(|settings| settings.get(PROGRAM)).and_then(|name| name.as_str());
    program.is_some_and(|name| name.starts_with("lacuna "))
}

const COLUMNS: &str = "shapes,draw,target,model,rms,p95";

/// Every single result.
pub fn csv(records: &[Record]) -> String {
    format!("{COLUMNS}\n{}\n", lines(records).join("\n"))
}

/// Every single result of every method.
pub fn ablation_csv(rows: &[(&str, Vec<Record>)]) -> String {
    let of_one = |(name, records): &(&str, Vec<Record>)| {
        lines(records).into_iter().map(|line| format!("{},{line}\n", field(name))).collect::<String>()
    };
    format!("method,{COLUMNS}\n{}", rows.iter().map(of_one).collect::<String>())
}

fn lines(records: &[Record]) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for r in records {
        for (model, score) in &r.scores {
            let target = field(&r.target);
            lines.push(format!("{},{},{target},{model},{},{}", r.count, r.draw, score.rms, score.p95));
        }
    }
    lines.sort();
    lines
}

/// A text as a field of CSV (RFC 4180): in quotation marks where it would end the field or the line.
fn field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.into()
    }
}

#[cfg(test)]
mod tests {
    use super::field;

    #[test]
    fn fields_with_commas_and_quotation_marks_are_quoted() {
        assert_eq!(["a b", "a,b", "a\"b"].map(field), ["a b", "\"a,b\"", "\"a\"\"b\""]);
    }
}
