//! How well a class predicts its own unseen parts: every shape completed by the model of the others, from partial
//! scans, as a table.

use super::held_out::{KINDS, Trial};
use crate::quantile::{median, quantile};
use crate::score::Score;
use crate::synth::Kind;
use crate::unit::digits;
use serde::Serialize;

/// One shape, scanned in one way.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// The shape's file.
    pub shape: String,
    /// Sides from which it was scanned.
    pub sides: usize,
    /// Distances from the true surface to the completed one where the scan shows it, in the shapes' unit.
    pub seen: Option<Score>,
    /// The same where it shows nothing.
    pub missing: Option<Score>,
    /// Shares of measured and inferred vertices with less than their expected error, which was fitted to other shapes.
    pub within_expected: [Option<f32>; 2],
}

/// All rows of one number of sides in a few numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Sides from which the shapes were scanned.
    pub sides: usize,
    /// Shapes that were completed.
    pub shapes: usize,
    /// Shapes that could not be completed, of which the other numbers know nothing.
    pub failed: usize,
    /// Seen part, rms, median over the shapes.
    pub seen_rms: f64,
    /// Missing part, rms: first quartile, median and third quartile over the shapes.
    pub missing_rms: [f64; 3],
    /// 95th percentile of the missing part's distances, median over the shapes.
    pub missing_p95: f64,
}

/// The table of the shapes `held` back; `names` are those of all shapes, `shares` belong to the trials. Shapes that could not
/// be completed have rows without numbers.
pub fn rows(held: &[usize], trials: &[Trial], names: &[String], shares: &[[Option<f32>; 2]]) -> Vec<Row> {
    let row = |(shape, kind): (usize, Kind)| {
        let number = trials.iter().position(|trial| (trial.shape, trial.kind) == (shape, kind));
        let trial = number.map(|number| &trials[number]);
        Row {
            shape: names[shape].clone(),
            sides: if kind == Kind::Stitched { 3 } else { 1 },
            seen: trial.and_then(|trial| score(trial, false)),
            missing: trial.and_then(|trial| score(trial, true)),
            within_expected: number.and_then(|number| shares.get(number).copied()).unwrap_or_default(),
        }
    };
    held.iter().flat_map(|&shape| KINDS.map(|kind| row((shape, kind)))).collect()
}

fn score(trial: &Trial, missing: bool) -> Option<Score> {
    let chosen = trial.covered.iter().filter(|(_, m)| *m == missing);
    Score::of(chosen.map(|&(distance, _)| f64::from(distance)).collect())
}

/// What to expect of scans from one side and from three.
pub fn summaries(rows: &[Row]) -> Vec<Summary> {
    [1, 3].into_iter().filter_map(|sides| summary(rows, sides)).collect()
}

fn summary(rows: &[Row], sides: usize) -> Option<Summary> {
    let chosen = || rows.iter().filter(|row| row.sides == sides);
    let all = |value: &dyn Fn(&Row) -> Option<f64>| chosen().filter_map(value).collect::<Vec<f64>>();
    let mut missing = all(&|row| Some(row.missing?.rms));
    missing.sort_by(f64::total_cmp);
    let at = |share| quantile(&missing, share);
    let failed = chosen().filter(|row| row.is_empty()).count();
    Some(Summary {
        sides,
        shapes: chosen().count() - failed,
        failed,
        seen_rms: median(all(&|row| Some(row.seen?.rms)))?,
        missing_rms: [at(0.25)?, at(0.5)?, at(0.75)?],
        missing_p95: median(all(&|row| Some(row.missing?.p95)))?,
    })
}

impl Row {
    /// Whether the shape could not be completed.
    fn is_empty(&self) -> bool {
        self.seen.is_none() && self.missing.is_none()
    }
}

/// The table as lines of text.
pub fn table(rows: &[Row], unit: &str) -> Vec<String> {
    let width = rows.iter().map(|row| row.shape.chars().count()).max().unwrap_or(0).max(5);
    let head =
        format!("{:width$}  sides  seen rms    p95  missing rms    p95  within expected ({unit})", "shape");
    let number = |value: Option<f64>| value.map_or("-".into(), |v| digits(v, 2));
    let line = |row: &Row| {
        let [seen, missing] =
            [row.seen, row.missing].map(|s| [s.map(|s| s.rms), s.map(|s| s.p95)].map(number));
        let share = row.within_expected[1].map_or("-".into(), |share| format!("{:.0} %", 100.0 * share));
        format!(
            "{:width$}  {:5}  {:>8}  {:>5}  {:>11}  {:>5}  {share:>15}",
            row.shape, row.sides, seen[0], seen[1], missing[0], missing[1]
        )
    };
    std::iter::once(head).chain(rows.iter().map(line)).collect()
}

impl Summary {
    /// What to expect, as a sentence.
    pub fn sentence(&self, unit: &str) -> String {
        let [low, middle, high] = self.missing_rms.map(|rms| digits(rms, 2));
        let [most, seen] = [self.missing_p95, self.seen_rms].map(|off| digits(off, 2));
        let sides = if self.sides == 1 { "one side" } else { "three sides" };
        let failed = match self.failed {
            0 => String::new(),
            1 => "; one shape could not be completed".into(),
            more => format!("; {more} shapes could not be completed"),
        };
        format!(
            "a scan from {sides}: what it does not show comes out {middle} {unit} rms off (half of the shapes {low} \
             to {high}), 95 % of it within {most}; what it shows {seen}{failed}"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(shape: usize, kind: Kind, missing: f32) -> Trial {
        let covered = vec![(0.1, false), (0.1, false), (missing, true), (missing, true)];
        Trial { shape, kind, errors: vec![], cues: vec![], places: vec![], covered }
    }

    #[test]
    fn rows_become_a_table_and_sentences() {
        let kinds = [Kind::Front, Kind::Stitched];
        let trials: Vec<Trial> = (0..3)
            .flat_map(|i| {
                kinds.map(|kind| trial(i, kind, if kind == Kind::Front { i as f32 + 1.0 } else { 0.5 }))
            })
            .collect();
        let names: Vec<String> = ["a.ply", "b.ply", "long_name.ply"].map(String::from).into();
        let rows = rows(&[0, 1, 2], &trials, &names, &[[None, Some(0.68)]]);
        let found = summaries(&rows);
        assert_eq!((found.len(), found[0].sides, found[0].shapes), (2, 1, 3));
        let near = |a: f64, b: f64| (a - b).abs() < 1e-6;
        assert!(near(found[0].missing_rms[1], 2.0) && near(found[0].missing_p95, 2.0), "{found:?}");
        assert!(near(found[0].seen_rms, 0.1) && near(found[1].missing_rms[0], 0.5), "{found:?}");
        assert!(found[0].sentence("mm").contains("2.00 mm rms off (half of the shapes 1.50 to 2.50)"));
        let lines = table(&rows, "mm");
        assert_eq!(lines.len(), 7);
        assert!(lines[1].starts_with("a.ply") && lines[1].contains("68 %") && lines[2].ends_with(" -"));
        assert!(lines.windows(2).all(|w| w[1].len() == lines[1].len()), "{lines:#?}");
    }

    #[test]
    fn a_shape_that_could_not_be_completed_is_told() {
        let trials: Vec<Trial> = [0, 2].map(|i| trial(i, Kind::Front, 1.0)).into();
        let names: Vec<String> = ["a.ply", "b.ply", "c.ply"].map(String::from).into();
        let rows = rows(&[0, 1, 2], &trials, &names, &[]);
        let found = summaries(&rows);
        assert_eq!((found.len(), found[0].shapes, found[0].failed), (1, 2, 1));
        assert!(found[0].sentence("mm").ends_with("; one shape could not be completed"));
        let lines = table(&rows, "mm");
        assert!(lines[3].starts_with("b.ply"), "{lines:#?}");
        assert_eq!(lines[3].split_whitespace().filter(|word| *word == "-").count(), 5, "{lines:#?}");
    }
}
