//! The global fit, section 3.2: the projection of eq. (9), the fixed point of eqs. (11)-(13), and the
//! regularised least squares solution in the hull that it converges to.

use super::{Hull, Model, pca::dot};
use nalgebra::{DMatrix, DVector};

/// Where a fixed point iteration came to.
#[derive(Clone, Debug, PartialEq)]
pub struct FixedPoint {
    /// Weights in standard deviations.
    pub sigmas: Vec<f64>,
    /// Rounds done.
    pub rounds: usize,
    /// Largest change of a weight in the last round, standard deviations.
    pub change: f64,
}

/// w_opt = (Φ - Φ_mean) Aᵀ, eq. (9), for a complete volume. The weights are not whitened.
pub fn project(model: &Model, volume: &[f64]) -> Vec<f64> {
    let difference: Vec<f64> = volume.iter().zip(&model.mean).map(|(v, m)| v - m).collect();
    model.axes.iter().map(|axis| dot(axis, &difference)).collect()
}

/// Eq. (9) for a hull: unknown distances count as those of the mean. This is one round of the fixed point.
pub fn project_hull(model: &Model, hull: &Hull) -> Vec<f64> {
    model.sigmas(&project(model, &replaced(&model.mean, hull)))
}

/// Φ*, eq. (12): the measured distance in the hull, the synthesised one elsewhere.
fn replaced(synthesised: &[f64], hull: &Hull) -> Vec<f64> {
    hull.iter().zip(synthesised).map(|(measured, &own)| measured.unwrap_or(own)).collect()
}

/// Iterates eqs. (11)-(13) from w = 0 for `rounds` rounds, or until no weight changes by more than
/// `tolerance` standard deviations.
pub fn fixed_point(model: &Model, hull: &Hull, rounds: usize, tolerance: f64) -> FixedPoint {
    let mut state = FixedPoint { sigmas: vec![0.0; model.modes()], rounds: 0, change: f64::INFINITY };
    while state.rounds < rounds && state.change > tolerance {
        let volume = replaced(&model.synthesise(&state.sigmas), hull);
        let next = model.sigmas(&project(model, &volume));
        state.change = next.iter().zip(&state.sigmas).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        state.sigmas = next;
        state.rounds += 1;
    }
    state
}

/// v = (AᵀWA + λI)⁻¹ AᵀW(t - M), λ = `ridge` ΣW, in standard deviations: A are the whitened modes in the
/// hull, W is 1 there. Without a ridge the least squares solution that eqs. (11)-(13) converge to.
pub fn direct(model: &Model, hull: &Hull, ridge: f64) -> Vec<f64> {
    let known: Vec<usize> = (0..hull.len()).filter(|&n| hull[n].is_some() && model.mask[n]).collect();
    let whitened = model.whitened();
    let a = DMatrix::from_fn(known.len(), model.modes(), |row, k| whitened[k][known[row]]);
    let b =
        DVector::from_fn(known.len(), |row, _| hull[known[row]].map_or(0.0, |t| t - model.mean[known[row]]));
    let lambda = ridge * known.len() as f64;
    let normal = a.tr_mul(&a) + DMatrix::identity(model.modes(), model.modes()) * lambda;
    let solved = normal.cholesky().map(|factor| factor.solve(&a.tr_mul(&b)));
    solved.map_or_else(|| vec![0.0; model.modes()], |v| v.iter().copied().collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::toy;

    fn close(a: &[f64], b: &[f64], tolerance: f64) -> bool {
        a.len() == b.len() && a.iter().zip(b).all(|(x, y)| (x - y).abs() < tolerance)
    }

    #[test]
    fn a_complete_volume_is_projected_onto_its_weights() {
        let model = toy::model();
        let truth = toy::weights(&model);
        let found = model.sigmas(&project(&model, &model.synthesise(&truth)));
        assert!(close(&found, &truth, 1e-9), "{found:?}");
    }

    #[test]
    fn all_ways_recover_a_synthesised_shape_from_a_part() {
        let model = toy::model();
        let truth = toy::weights(&model);
        let hull = toy::hull(&model, &model.synthesise(&truth), 1.5);
        assert!(close(&direct(&model, &hull, 1e-12), &truth, 1e-6));
        let iterated = fixed_point(&model, &hull, 100_000, 1e-12);
        assert!(close(&iterated.sigmas, &truth, 1e-6), "{iterated:?}");
        assert!(!close(&project_hull(&model, &hull), &truth, 0.1), "one round is not enough");
    }

    #[test]
    fn the_fixed_point_is_the_least_squares_solution_off_the_model_too() {
        let model = toy::model();
        let mut volume = model.synthesise(&toy::weights(&model));
        volume.iter_mut().enumerate().for_each(|(n, v)| *v += 0.3 * ((n * 7919 % 101) as f64 / 50.0 - 1.0));
        let hull = toy::hull(&model, &volume, 1.5);
        let iterated = fixed_point(&model, &hull, 100_000, 1e-13);
        assert!(close(&iterated.sigmas, &direct(&model, &hull, 0.0), 1e-6), "{iterated:?}");
    }

    #[test]
    fn a_large_ridge_gives_the_mean() {
        let model = toy::model();
        let hull = toy::hull(&model, &model.synthesise(&toy::weights(&model)), 1.5);
        assert!(close(&direct(&model, &hull, 1e9), &vec![0.0; model.modes()], 1e-6));
    }
}
