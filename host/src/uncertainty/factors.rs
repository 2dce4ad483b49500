//! How much farther off than elsewhere the inferred surface of a class is at a place: an ear is harder to predict than
//! a cheek as far from the scan. The model has a factor a brick; between the middles of bricks it changes linearly in
//! its logarithm.

use lacuna::Model;
use lacuna::grid::{linear, position};

/// Factors of the expected error over the bricks of a model's grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Factors {
    edge: f32,
    sides: [u16; 3],
    /// Logarithm a cell, x fastest; none where nothing is known.
    logs: Vec<Option<f32>>,
}

impl Factors {
    /// Those that the model's trainer has fitted.
    pub fn of(model: &Model<'_>) -> Self {
        let mut factors = Self::unknown(model);
        let sides = factors.sides;
        for (cell, log) in factors.logs.iter_mut().enumerate() {
            let brick = model.brick_of_cell(position(cell, sides));
            *log = brick.and_then(|index| model.factor(index)).map(libm::logf);
        }
        factors
    }

    /// Nothing known yet of any cell of a model's grid.
    pub fn unknown(model: &Model<'_>) -> Self {
        let sides = model.grid().brick_sides();
        let cells = sides.into_iter().map(usize::from).product();
        Self { edge: f32::from(model.grid().brick()), sides, logs: vec![None; cells] }
    }

    /// The same grid with these logarithms, one a cell.
    pub fn with_logs(self, logs: Vec<Option<f32>>) -> Self {
        debug_assert_eq!(logs.len(), self.logs.len());
        Self { logs, ..self }
    }

    /// Cells of the grid.
    pub const fn cells(&self) -> usize {
        self.logs.len()
    }

    /// The logarithm in a cell.
    pub fn log(&self, cell: usize) -> Option<f32> {
        self.logs.get(cell).copied().flatten()
    }

    /// The cell a place in the model, voxels, lies in.
    pub fn cell(&self, q: [f32; 3]) -> Option<usize> {
        self.cell_at(q.map(|x| (x + 0.5) / self.edge).map(f32::floor))
    }

    fn cell_at(&self, at: [f32; 3]) -> Option<usize> {
        let inside = at.iter().zip(self.sides).all(|(&x, side)| x >= 0.0 && x < f32::from(side));
        inside.then(|| linear(at.map(|x| x as u16), self.sides))
    }

    /// The factor at a place in the model, voxels: 1 where nothing is known.
    pub fn at(&self, q: [f32; 3]) -> f32 {
        // From middle to middle.
        let place = q.map(|x| (x + 0.5) / self.edge - 0.5);
        let low = place.map(f32::floor);
        let (mut sum, mut weights) = (0.0, 0.0);
        for corner in 0..8u8 {
            let up = [0, 1, 2].map(|axis| f32::from(corner >> axis & 1));
            let weight: f32 = (0..3).map(|i| 1.0 - (place[i] - low[i] - up[i]).abs()).product();
            let cell = self.cell_at([0, 1, 2].map(|i| low[i] + up[i]));
            if let Some(log) = cell.and_then(|cell| self.log(cell)) {
                (sum, weights) = (sum + weight * log, weights + weight);
            }
        }
        if weights > 0.0 { libm::expf(sum / weights) } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_those_of_the_bricks_and_change_evenly_between_their_middles() {
        let model = Model::from_bytes(lacuna_fixtures::VERSIONS[0].model).expect("a model");
        let unknown = Factors::of(&model);
        assert_eq!(unknown, Factors::unknown(&model), "version 1 has none");
        let edge = f32::from(model.grid().brick());
        let middle = |x: f32| edge * (x + 0.5) - 0.5;
        let (left, right) = ([middle(0.0); 3], [middle(1.0), middle(0.0), middle(0.0)]);
        assert_eq!((unknown.at(left), unknown.cell(left), unknown.cell(right)), (1.0, Some(0), Some(1)));
        assert_eq!(unknown.cell([-1.0, 0.0, 0.0]), None);
        let mut logs = vec![None; unknown.cells()];
        logs[0] = Some(libm::logf(2.0));
        let one = unknown.clone().with_logs(logs.clone());
        assert!(
            [left, [0.0; 3], [left[0] + 0.6 * edge, left[1], left[2]]]
                .iter()
                .all(|&q| (one.at(q) - 2.0).abs() < 1e-5)
        );
        logs[1] = Some(libm::logf(0.5));
        let two = unknown.with_logs(logs);
        let between = |share: f32| two.at([left[0] + share * edge, left[1], left[2]]);
        let found = [0.0, 0.25, 0.5, 1.0].map(between);
        let expected = [2.0, 2.0f32.sqrt(), 1.0, 0.5];
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5), "{found:?}");
    }
}
