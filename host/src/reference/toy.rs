//! A tiny shape class for the reference's tests: balls whose radius, height and tilt vary.

use super::{Grid, Hull, Model, pca::pca};

/// Grid of the toy class.
pub const GRID: Grid = Grid { sides: [8, 10, 6] };

/// Distances of a sheared ball.
fn ball([radius, height, tilt]: [f64; 3]) -> Vec<f64> {
    let distance = |index| {
        let [x, y, z] = GRID.position(index).map(|v| v as f64);
        let (dx, dy, dz) = (x - 3.6 - tilt * (z - 2.5), y - 4.4 - height, z - 2.5);
        (dx * dx + dy * dy + dz * dz).sqrt() - radius
    };
    (0..GRID.len()).map(distance).collect()
}

/// Training volumes.
pub fn volumes() -> Vec<Vec<f64>> {
    let shapes = [[2.0, 0.0, 0.0], [2.6, 0.4, 0.1], [2.2, -0.6, 0.2], [1.8, 0.3, -0.2], [2.4, 0.1, -0.1]];
    shapes.map(ball).to_vec()
}

/// The model with all its modes.
pub fn model() -> Model {
    pca(GRID, &volumes(), vec![true; GRID.len()], 99)
}

/// Weights in standard deviations to be found again.
pub fn weights(model: &Model) -> Vec<f64> {
    (0..model.modes()).map(|k| 0.8 - 0.5 * k as f64).collect()
}

/// A volume seen where the mean is within `reach`, and of that only the upper part: y of 3 and more.
pub fn hull(model: &Model, volume: &[f64], reach: f64) -> Hull {
    let seen = |n: usize| model.mean[n].abs() < reach && GRID.position(n)[1] >= 3;
    (0..GRID.len()).map(|n| seen(n).then_some(volume[n])).collect()
}
