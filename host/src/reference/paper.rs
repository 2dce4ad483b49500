//! The local fit as printed, eqs. (14)-(16) with the weight *field* smoothed, and the projection of eq. (3).
//!
//! Every voxel of Ω has a weight vector. Those in the hull take a step, then the whole field is smoothed with
//! a cubic kernel, then each weight vector is brought back onto the hyper-ellipse. Two things are left open:
//! eq. (14) adds the gradient, which climbs ([`Step::Printed`]), and with orthonormal modes the step is
//! orders of magnitude too small for distances over many voxels. [`Step`] has both remedies.

use super::{Grid, Hull, Model};

/// How eq. (14) is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// w + ∇r, as it stands: away from the minimum.
    Printed,
    /// w - μ ∇r.
    Descent(f64),
    /// The same in whitened weights and divided by the curvature: v - μ e b' / (|b'|² + λ), λ in voxel².
    Normalised {
        /// μ; 1 meets the measured distance at once where λ is small.
        step: f64,
        /// λ.
        ridge: f64,
    },
}

/// What can be chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// How eq. (14) is read.
    pub step: Step,
    /// Radius of the hyper-ellipse in eq. (3), standard deviations; the paper has 3.
    pub radius: f64,
    /// Radius of the smoothing kernel in each iteration, voxels: its side is 2 r + 1.
    pub kernels: Vec<usize>,
}

impl Settings {
    /// Kernel radii for sides that shrink evenly on a log scale from `from` to `to`, in units of `spacing`;
    /// the paper goes from 65 mm to 2.5 mm for complete shapes and to 16.5 mm for scans with holes.
    pub fn shrinking(from: f64, to: f64, spacing: f64, iterations: usize) -> Vec<usize> {
        let share = |i: usize| i as f64 / iterations.saturating_sub(1).max(1) as f64;
        let side = |i: usize| from * libm::pow(to / from, share(i)) / spacing;
        (0..iterations).map(|i| ((side(i) - 1.0) / 2.0).round().max(0.0) as usize).collect()
    }
}

/// A field of weights over all voxels, in standard deviations, for each mode one a voxel.
pub type Field = Vec<Vec<f64>>;

/// Fits a weight field, from the global weights `start` (standard deviations).
pub fn local(model: &Model, hull: &Hull, start: &[f64], settings: &Settings) -> Field {
    let mut field: Field = start.iter().map(|&v| vec![v; model.grid.len()]).collect();
    for &kernel in &settings.kernels {
        for n in (0..hull.len()).filter(|&n| model.mask[n]) {
            if let Some(target) = hull[n] {
                update(model, &mut field, (n, target), settings.step);
            }
        }
        for weights in &mut field {
            smooth(model.grid, weights, kernel);
        }
        project(&mut field, settings.radius);
    }
    field
}

/// Φ(w(x)), eq. (6).
pub fn distances(model: &Model, field: &Field) -> Vec<f64> {
    (0..model.grid.len()).map(|n| distance(model, field, n)).collect()
}

fn distance(model: &Model, field: &Field, n: usize) -> f64 {
    let modes = model.axes.iter().zip(&model.deviations).zip(field);
    model.mean[n] + modes.map(|((axis, s), v)| v[n] * s * axis[n]).sum::<f64>()
}

/// Eqs. (14)-(16) for voxel n: ∇r = (Φ(w) - Φ_hull) b, without the factor 2 as printed.
fn update(model: &Model, field: &mut Field, (n, target): (usize, f64), step: Step) {
    let residual = distance(model, field, n) - target;
    let modes = model.axes.iter().zip(&model.deviations);
    let square: f64 = modes.clone().map(|(axis, s)| (s * axis[n]) * (s * axis[n])).sum();
    for ((axis, s), v) in modes.zip(field) {
        // A step in w is a step in v times s.
        v[n] += match step {
            Step::Printed => residual * axis[n] / s,
            Step::Descent(mu) => -mu * residual * axis[n] / s,
            Step::Normalised { step, ridge } => -step * residual * s * axis[n] / (square + ridge),
        };
    }
}

/// Cubic smoothing kernel: the mean over the part of the box that lies in the grid, one axis at a time.
/// Cut off, not padded with zeros, so that a constant field stays what it is.
fn smooth(grid: Grid, field: &mut [f64], radius: usize) {
    let strides = [1, grid.sides[0], grid.sides[0] * grid.sides[1]];
    for (axis, stride) in strides.into_iter().enumerate() {
        let side = grid.sides[axis];
        let starts = (0..grid.len()).filter(|&n| grid.position(n)[axis] == 0);
        for start in starts {
            let line: Vec<f64> = (0..side).map(|i| field[start + i * stride]).collect();
            for i in 0..side {
                let near = &line[i.saturating_sub(radius)..(i + radius + 1).min(side)];
                field[start + i * stride] = near.iter().sum::<f64>() / near.len() as f64;
            }
        }
    }
}

/// Eq. (3): a weight vector outside the hyper-ellipse is shortened onto it.
fn project(field: &mut Field, radius: f64) {
    for n in 0..field.first().map_or(0, Vec::len) {
        let length = field.iter().map(|v| v[n] * v[n]).sum::<f64>().sqrt();
        if length > radius {
            field.iter_mut().for_each(|v| v[n] *= radius / length);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::toy;

    fn errors(model: &Model, field: &Field, hull: &Hull) -> f64 {
        let made = distances(model, field);
        made.iter().zip(hull).filter_map(|(d, t)| Some((d - (*t)?).abs())).fold(0.0, f64::max)
    }

    fn run(step: Step, kernels: Vec<usize>) -> (f64, f64) {
        let model = toy::model();
        let hull = toy::hull(&model, &model.synthesise(&toy::weights(&model)), 1.5);
        let settings = |kernels| Settings { step, radius: 99.0, kernels };
        let start = vec![0.0; model.modes()];
        let before = errors(&model, &local(&model, &hull, &start, &settings(vec![])), &hull);
        (before, errors(&model, &local(&model, &hull, &start, &settings(kernels)), &hull))
    }

    #[test]
    fn the_printed_sign_climbs_and_the_corrected_one_hardly_moves() {
        let (before, after) = run(Step::Printed, vec![1; 5]);
        assert!(after > before, "{before} to {after}");
        let (before, after) = run(Step::Descent(1.0), vec![1; 5]);
        assert!(after < before && after > 0.8 * before, "{before} to {after}");
    }

    #[test]
    fn normalised_and_shrinking_it_converges() {
        let kernels = Settings::shrinking(9.0, 1.0, 1.0, 12);
        let (before, after) = run(Step::Normalised { step: 1.0, ridge: 1e-9 }, kernels);
        assert!(after < 1e-6 * before, "{before} to {after}");
    }

    #[test]
    fn kernels_shrink_from_first_to_last() {
        assert_eq!(Settings::shrinking(65.0, 2.5, 2.5, 3), [13, 2, 0]);
        assert_eq!(Settings::shrinking(65.0, 2.5, 2.5, 1), [13]);
    }

    #[test]
    fn smoothing_keeps_a_constant_and_spreads_a_peak() {
        let grid = Grid { sides: [5, 4, 3] };
        let mut flat = vec![2.0; grid.len()];
        smooth(grid, &mut flat, 2);
        assert!(flat.iter().all(|v| (v - 2.0f64).abs() < 1e-12));
        let mut peak = vec![0.0; grid.len()];
        peak[grid.index([2, 2, 1])] = 27.0;
        smooth(grid, &mut peak, 1);
        assert!((peak[grid.index([1, 1, 1])] - 1.0).abs() < 1e-12);
        assert_eq!(peak[grid.index([0, 1, 1])], 0.0);
    }

    #[test]
    fn weights_end_within_the_hyper_ellipse() {
        let mut field = vec![vec![3.0, 0.5], vec![4.0, 0.5]];
        project(&mut field, 2.5);
        assert_eq!(field, [[1.5, 0.5], [2.0, 0.5]]);
    }
}
