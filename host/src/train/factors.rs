//! How much farther off than elsewhere the inferred surface is in each brick of a model, from held-back shapes.
//!
//! In a brick, the logarithm of true over stated error has a quantile `SHARE` for each scan. The factor is the mean of
//! these quantiles less that of all bricks, drawn to none where few scans went into it.

use super::calibration::{Member, ratio, sigma};
use crate::uncertainty::factors::Factors;
use lacuna::Model;
use lacuna::format::{Calibration, FACTOR_STEPS, NO_FACTOR};
use std::collections::BTreeMap;

/// Scans without a difference that those of each brick are averaged with.
const DOUBT: f64 = 3.0;
/// Fewest vertices of a scan that say something about a brick.
const FEWEST: usize = 5;

/// The factors that go with `constants`; `unknown` is the grid of the model.
pub fn factors(members: &[&Member<'_>], constants: &Calibration, unknown: Factors) -> Factors {
    let mut sums = vec![(0.0, 0.0); unknown.cells()];
    for member in members {
        for (cell, ratios) in by_cell(member, constants, &unknown) {
            if let (Some(quantile), Some((sum, count))) = (sigma(ratios.into_iter()), sums.get_mut(cell)) {
                (*sum, *count) = (*sum + quantile, *count + 1.0);
            }
        }
    }
    let (sum, count) = sums.iter().fold((0.0, 0.0), |all, one| (all.0 + one.0, all.1 + one.1));
    let mean = if count > 0.0 { sum / count } else { 0.0 };
    let log = |&(sum, count): &(f64, f64)| ((sum - mean * count) / (count + DOUBT)) as f32;
    let logs = sums.iter().map(|one| (one.1 > 0.0).then(|| log(one))).collect();
    unknown.with_logs(logs)
}

/// Logarithms of true over stated error of a scan's inferred vertices, by the cell they lie in.
fn by_cell(member: &Member<'_>, constants: &Calibration, grid: &Factors) -> BTreeMap<usize, Vec<f64>> {
    let mut cells: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for (cue, error, place) in member.inferred() {
        if let Some(cell) = grid.cell(place) {
            cells.entry(cell).or_default().push(ratio(constants, cue, error));
        }
    }
    cells.retain(|_, ratios| ratios.len() >= FEWEST);
    cells
}

/// The factors of a model's bricks as its file has them.
pub fn bytes(factors: &Factors, model: &Model<'_>) -> Vec<u8> {
    let edge = u16::from(model.grid().brick());
    let middle = |corner: [u16; 3]| corner.map(|c| f32::from(c) + f32::from(edge) / 2.0 - 0.5);
    let byte = |corner| {
        let log = factors.cell(middle(corner)).and_then(|cell| factors.log(cell)).unwrap_or(0.0);
        (f32::from(NO_FACTOR) + f32::from(FACTOR_STEPS) * log / core::f32::consts::LN_2)
            .round()
            .clamp(0.0, 255.0) as u8
    };
    model.bricks().map(|brick| byte(brick.corner)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_read_as_the_factors_they_were_written_for() {
        let file = lacuna_fixtures::VERSIONS[0].model;
        let model = Model::from_bytes(file).expect("a model");
        let unknown = Factors::unknown(&model);
        let logs =
            (0..unknown.cells()).map(|cell| (cell % 3 > 0).then_some(0.1 * cell as f32 - 0.4)).collect();
        let written = unknown.with_logs(logs);
        let calibration = crate::uncertainty::expected::of_faces(0.3);
        let bytes = bytes(&written, &model);
        let file = crate::train::model_file::calibrated(file, &calibration, Some(&bytes)).expect("a file");
        let model = Model::from_bytes(&file).expect("a model");
        let read = Factors::of(&model);
        let close = |cell: usize| {
            let brick = model.brick_of_cell(lacuna::grid::position(cell, model.grid().brick_sides()));
            let expected = brick.map(|_| written.log(cell).unwrap_or(0.0));
            let found = read.log(cell);
            expected.is_some() == found.is_some()
                && (expected.unwrap_or(0.0) - found.unwrap_or(0.0)).abs() < 0.011
        };
        assert!((0..read.cells()).all(close), "{written:?} {read:?}");
        assert!(read != Factors::unknown(&model));
    }
}
