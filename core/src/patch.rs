//! A patch of the scan with weights of its own.
//!
//! What the modes cannot explain is smooth: neighbouring points share it, and counted one by one they would drag the
//! pose along. But it is not an arbitrary function either: a part of a shape differs from the mean in the ways it
//! differs in the training shapes, if not always together with the other parts. So the points of a patch are
//! explained by weights w of their own, around the weights v of the whole with the prior δ |w - v|²:
//!
//! ```text
//! min  |J w + P x + r|²_W + δ |w - v|²        S = Jᵀ W J + δ I = L Lᵀ,  H = Jᵀ W P,  h = Jᵀ W r
//!  w
//! v v:  δ I - δ² S⁻¹     v x:  δ S⁻¹ H     x x:  Pᵀ W P - Hᵀ S⁻¹ H      v:  δ S⁻¹ h     x:  Pᵀ W r - Hᵀ S⁻¹ h
//! ```
//!
//! J are the rows' modes, P their motion x of the pose. The last line is what the patch adds to the normal
//! equations of v and x once w is eliminated. All of it happens in place in the patch's packed sums.

use crate::cholesky::{factor_row, inner, packed, row, solve_row};

/// Turns the sums of a patch's points into those of a patch with weights of its own. `sums` holds the packed lower
/// triangle of Σ w row rowᵀ for `unknowns` unknowns, the first `modes` of them the weights, then Σ w r row. `own` is
/// δ > 0, in units of Σ w b'².
pub fn eliminate_own_weights(sums: &mut [f32], modes: usize, unknowns: usize, own: f32) {
    for i in 0..modes {
        let Some((above, current)) = split(sums, i, i + 1) else { return };
        current.last_mut().into_iter().for_each(|diagonal| *diagonal += own);
        factor_row(above, current);
    }
    // The vector is one more row, without a diagonal.
    for i in modes..=unknowns {
        let Some((above, current)) = split(sums, i, unknowns.min(i + 1)) else { return };
        solve_row(above, current, modes);
        reduce_row(above, current, modes);
    }
    for i in 0..modes {
        let Some((above, current)) = split(sums, i, i + 1) else { return };
        invert_row(above, current);
    }
    for i in modes..=unknowns {
        let Some((above, current)) = split(sums, i, modes) else { return };
        times_rows(above, current);
        current.iter_mut().for_each(|value| *value *= own);
    }
    square(sums, modes, own);
}

/// The rows before row `i`, and the first `length` entries from its beginning.
fn split(sums: &mut [f32], i: usize, length: usize) -> Option<(&[f32], &mut [f32])> {
    let (above, rest) = sums.split_at_mut_checked(packed(i))?;
    Some((above, rest.get_mut(..length)?))
}

/// Takes Hᵀ S⁻¹ H out of a row whose first `modes` entries are L⁻¹ of what they were; `above` holds the rows before it,
/// likewise.
fn reduce_row(above: &[f32], current: &mut [f32], modes: usize) {
    let Some((solved, rest)) = current.split_at_mut_checked(modes) else { return };
    for (k, value) in rest.iter_mut().enumerate() {
        // The diagonal's row is this one.
        let other = above.get(packed(modes + k)..).and_then(|row| row.get(..modes)).unwrap_or(solved);
        *value -= inner(solved, other);
    }
}

/// Turns row i of L into that of M = L⁻¹; `above` holds the rows of M before it.
fn invert_row(above: &[f32], current: &mut [f32]) {
    let Some((pivot, left)) = current.split_last_mut() else { return };
    times_rows(above, left);
    *pivot = 1.0 / *pivot;
    left.iter_mut().for_each(|value| *value *= -*pivot);
}

/// Turns a row y into Mᵀ y; `factor` holds the rows of M.
fn times_rows(factor: &[f32], current: &mut [f32]) {
    for k in 0..current.len() {
        let Some(share) = current.get_mut(k).map(core::mem::take) else { return };
        add(current, share, row(factor, k));
    }
}

/// Turns the rows of M into those of δ I - δ² Mᵀ M.
fn square(sums: &mut [f32], modes: usize, own: f32) {
    for i in 0..modes {
        let Some((before, later)) = sums.split_at_mut_checked(packed(i + 1)) else { return };
        let Some(current) = before.get_mut(packed(i)..) else { return };
        let diagonal = current.last().copied().unwrap_or(0.0);
        current.iter_mut().for_each(|value| *value *= diagonal);
        let mut rest = &*later;
        for length in i + 2..=modes {
            let Some((next, tail)) = rest.split_at_checked(length) else { return };
            add(current, next.get(i).copied().unwrap_or(0.0), next);
            rest = tail;
        }
        current.iter_mut().for_each(|value| *value *= -own * own);
        current.last_mut().into_iter().for_each(|diagonal| *diagonal += own);
    }
}

/// Adds a multiple of a row to another.
fn add(to: &mut [f32], share: f32, from: &[f32]) {
    to.iter_mut().zip(from).for_each(|(to, &from)| *to += share * from);
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::cholesky::solve;
    use crate::normal_sums::add_row;
    use std::vec::Vec;

    const OWN: f32 = 0.7;

    /// Rows of two modes and one unknown of the pose, residuals and weights.
    const POINTS: [([f32; 3], f32, f32); 4] = [
        ([1.0, 0.5, 0.3], 0.3, 1.0),
        ([-0.5, 2.0, 1.2], -0.7, 0.5),
        ([0.25, -1.0, -0.6], 1.1, 0.8),
        ([0.1, 0.4, -1.5], 0.2, 1.0),
    ];

    fn solved(sums: &[f32], unknowns: usize) -> Vec<f64> {
        let mut sums: Vec<f64> = sums.iter().map(|&v| f64::from(v)).collect();
        (0..unknowns).for_each(|i| sums[packed(i) + i] += 0.05);
        let (matrix, vector) = sums.split_at_mut(packed(unknowns));
        solve(matrix, vector);
        vector.to_vec()
    }

    #[test]
    fn eliminated_weights_are_unknowns_that_were_solved_for() {
        let mut short = [0.0f32; packed(3) + 3];
        // Unknowns: weights of the whole, pose, then the patch's deviations from the whole.
        let mut long = [0.0f32; packed(5) + 5];
        for (row, residual, weight) in POINTS {
            add_row(&mut short, &row, residual, weight);
            let [a, b, x] = row;
            add_row(&mut long, &[a, b, x, a, b], residual, weight);
        }
        for i in 3..5 {
            long[packed(i) + i] += OWN - 0.05;
        }
        eliminate_own_weights(&mut short, 2, 3, OWN);
        let (short, long) = (solved(&short, 3), solved(&long, 5));
        assert!(short.iter().zip(&long).all(|(a, b)| (a - b).abs() < 1e-4), "{short:?} {long:?}");
    }

    #[test]
    fn weights_that_may_not_deviate_change_nothing() {
        let mut sums = [0.0f32; packed(3) + 3];
        for (row, residual, weight) in POINTS {
            add_row(&mut sums, &row, residual, weight);
        }
        let mut stiff = sums;
        eliminate_own_weights(&mut stiff, 2, 3, 1e3);
        assert!(sums.iter().zip(&stiff).all(|(a, b)| (a - b).abs() < 2e-2), "{sums:?} {stiff:?}");
    }

    #[test]
    fn modes_that_move_nothing_leave_numbers() {
        let mut sums = [0.0f32; packed(3) + 3];
        eliminate_own_weights(&mut sums, 2, 3, OWN);
        assert!(sums.iter().all(|v| v.abs() < 1e-6), "{sums:?}");
    }
}
