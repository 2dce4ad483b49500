//! The volumetric model, eqs. (4)-(5): mean, principal axes and standard deviations of training volumes.

use super::Grid;
use nalgebra::{DMatrix, SymmetricEigen};

/// Modes with less than this share of the strongest one's variance are rounding, not shape.
const WEAKEST: f64 = 1e-8;

/// A model of dense volumes: Φ_w = Φ_mean + Σ w_k B_k, eq. (5).
#[derive(Clone, Debug)]
pub struct Model {
    /// The grid Ω.
    pub grid: Grid,
    /// Voxels that take part; elsewhere the mean and all modes are zero.
    pub mask: Vec<bool>,
    /// Φ_mean, voxels.
    pub mean: Vec<f64>,
    /// B_k, of unit length over the mask, strongest first.
    pub axes: Vec<Vec<f64>>,
    /// s_k: standard deviation of the weight w_k over the training set.
    pub deviations: Vec<f64>,
}

impl Model {
    /// K.
    pub fn modes(&self) -> usize {
        self.axes.len()
    }

    /// b'_k = s_k B_k: a mode at one standard deviation, voxels.
    pub fn whitened(&self) -> Vec<Vec<f64>> {
        let scaled = |(axis, s): (&Vec<f64>, &f64)| axis.iter().map(|b| b * s).collect();
        self.axes.iter().zip(&self.deviations).map(scaled).collect()
    }

    /// g_k = (mean(s) / s_k)²: how much faster the local fit moves a weak mode.
    pub fn gains(&self) -> Vec<f64> {
        let mean = self.deviations.iter().sum::<f64>() / self.modes().max(1) as f64;
        self.deviations.iter().map(|s| (mean / s) * (mean / s)).collect()
    }

    /// v_k = w_k / s_k: weights in standard deviations.
    pub fn sigmas(&self, weights: &[f64]) -> Vec<f64> {
        weights.iter().zip(&self.deviations).map(|(w, s)| w / s).collect()
    }

    /// Φ_w, eqs. (5), (8) and (11), for weights in standard deviations.
    pub fn synthesise(&self, sigmas: &[f64]) -> Vec<f64> {
        let mut volume = self.mean.clone();
        for ((axis, s), v) in self.axes.iter().zip(&self.deviations).zip(sigmas) {
            volume.iter_mut().zip(axis).for_each(|(value, b)| *value += v * s * b);
        }
        volume
    }
}

/// The model of equally large training volumes, from the voxels of a mask; at most `most` modes.
pub fn pca(grid: Grid, volumes: &[Vec<f64>], mask: Vec<bool>, most: usize) -> Model {
    let m = volumes.len() as f64;
    let mean: Vec<f64> = (0..grid.len())
        .map(|x| if mask[x] { volumes.iter().map(|v| v[x]).sum::<f64>() / m } else { 0.0 })
        .collect();
    let centre = |v: &Vec<f64>| (0..grid.len()).map(|x| if mask[x] { v[x] - mean[x] } else { 0.0 }).collect();
    let rows: Vec<Vec<f64>> = volumes.iter().map(centre).collect();
    let gram = DMatrix::from_fn(rows.len(), rows.len(), |i, j| dot(&rows[i], &rows[j]));
    let eigen = SymmetricEigen::new(gram);
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let least = WEAKEST * order.first().map_or(0.0, |&i| eigen.eigenvalues[i]);
    order.truncate(most.min(rows.len().saturating_sub(1)));
    order.retain(|&i| eigen.eigenvalues[i] > least);
    // The Gram matrix and the covariance share eigenvalues: B_k = Xᵀ u / sqrt(μ), s_k² = μ / (m - 1).
    let axis = |&i: &usize| {
        let column: Vec<f64> = eigen.eigenvectors.column(i).iter().copied().collect();
        combine(&rows, &column, eigen.eigenvalues[i].sqrt())
    };
    let axes = order.iter().map(axis).collect();
    let deviations = order.iter().map(|&i| (eigen.eigenvalues[i] / (m - 1.0)).sqrt()).collect();
    Model { grid, mask, mean, axes, deviations }
}

/// Σ a_n b_n.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Σ_i u_i row_i / length.
fn combine(rows: &[Vec<f64>], coefficients: &[f64], length: f64) -> Vec<f64> {
    let mut sum = vec![0.0; rows.first().map_or(0, Vec::len)];
    for (row, u) in rows.iter().zip(coefficients) {
        sum.iter_mut().zip(row).for_each(|(s, x)| *s += u / length * x);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::toy;

    #[test]
    fn axes_are_orthonormal() {
        let model = toy::model();
        for (i, a) in model.axes.iter().enumerate() {
            for (j, b) in model.axes.iter().enumerate() {
                let expected = f64::from(u8::from(i == j));
                assert!((dot(a, b) - expected).abs() < 1e-9, "{i} {j}");
            }
        }
    }

    #[test]
    fn all_modes_reproduce_every_training_shape() {
        let volumes = toy::volumes();
        let model = toy::model();
        for volume in &volumes {
            let weights: Vec<f64> = model
                .axes
                .iter()
                .map(|axis| axis.iter().zip(volume).zip(&model.mean).map(|((b, v), m)| b * (v - m)).sum())
                .collect();
            let made = model.synthesise(&model.sigmas(&weights));
            assert!(made.iter().zip(volume).all(|(a, b)| (a - b).abs() < 1e-9));
        }
    }

    #[test]
    fn nothing_happens_off_the_mask() {
        let mut mask = vec![true; toy::GRID.len()];
        mask[7] = false;
        let model = pca(toy::GRID, &toy::volumes(), mask, 99);
        assert!(model.mean[7] == 0.0 && model.axes.iter().all(|axis| axis[7] == 0.0));
    }
}
