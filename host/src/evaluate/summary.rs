//! Medians and quartiles over draws and targets.

use super::{Approximation, Record, Score};
use crate::quantile::quantile;
use crate::unit::digits;
use serde::Serialize;
use std::collections::BTreeMap;

/// A quantity over draws and targets.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Quartiles {
    /// Half of the values are below.
    pub median: f64,
    /// A quarter of the values is below.
    pub q1: f64,
    /// Three quarters of the values are below.
    pub q3: f64,
}

impl std::fmt::Display for Quartiles {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [median, q1, q3] = [self.median, self.q1, self.q3].map(|value| digits(value, 3));
        f.pad(&format!("{median} [{q1} {q3}]"))
    }
}

/// One box of figure 2.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Root mean square distances.
    pub rms: Quartiles,
    /// 95th percentiles.
    pub p95: Quartiles,
}

/// For each number of training shapes what each model reached.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// By the number of training shapes.
    pub counts: BTreeMap<usize, BTreeMap<Approximation, Row>>,
}

impl Summary {
    /// Summarises the results.
    pub fn of(records: &[&Record]) -> Self {
        let mut counts: BTreeMap<usize, BTreeMap<Approximation, Vec<Score>>> = BTreeMap::new();
        for record in records {
            let count = counts.entry(record.count).or_default();
            record.scores.iter().for_each(|(&kind, &score)| count.entry(kind).or_default().push(score));
        }
        let rows = |models: BTreeMap<Approximation, Vec<Score>>| {
            models.into_iter().filter_map(|(kind, scores)| Some((kind, row(&scores)?))).collect()
        };
        Self { counts: counts.into_iter().map(|(count, models)| (count, rows(models))).collect() }
    }
}

/// Targets whose local approximations miss them by more than `limit` rms in the median, with that median.
pub fn missed(records: &[Record], limit: f64) -> Vec<(String, f64)> {
    let mut by_target: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for record in records {
        let local = record.scores.get(&Approximation::Local).map(|score| score.rms);
        by_target.entry(&record.target).or_default().extend(local);
    }
    let medians =
        by_target.into_iter().filter_map(|(name, all)| Some((name.to_owned(), quartiles(all)?.median)));
    medians.filter(|(_, median)| *median > limit).collect()
}

fn row(scores: &[Score]) -> Option<Row> {
    let values = |pick: fn(&Score) -> f64| quartiles(scores.iter().map(pick).collect());
    Some(Row { rms: values(|s| s.rms)?, p95: values(|s| s.p95)? })
}

fn quartiles(mut values: Vec<f64>) -> Option<Quartiles> {
    values.sort_by(f64::total_cmp);
    let at = |share| quantile(&values, share);
    Some(Quartiles { median: at(0.5)?, q1: at(0.25)?, q3: at(0.75)? })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::Scores;

    #[test]
    fn draws_and_targets_of_a_count_are_put_together() {
        let record = |count, rms| {
            let scores = Scores::from([(Approximation::Global, Score { rms, p95: 2.0 * rms })]);
            Record { count, draw: 0, target: String::new(), digest: 0, scores }
        };
        let records = [record(10, 3.0), record(10, 1.0), record(10, 2.0), record(30, 9.0)];
        let summary = Summary::of(&records.iter().collect::<Vec<_>>());
        let row = summary.counts[&10][&Approximation::Global];
        assert_eq!(row.rms, Quartiles { median: 2.0, q1: 1.5, q3: 2.5 });
        assert_eq!(row.p95.median, 4.0);
        let json = serde_json::to_value(&summary).unwrap();
        assert_eq!(json["counts"]["30"]["global"]["rms"]["q3"], 9.0);
    }
}
