//! A patch of the scan with weights of its own.
//!
//! What the modes cannot explain is smooth: neighbouring points share it, and counted one by one they would drag the
//! pose along. But it is not an arbitrary function either: a part of a shape differs from the mean in the ways it
//! differs in the training shapes, if not always together with the other parts. So the points of a patch are
//! explained by weights w of their own, around the weights v of the whole with the prior δ |w - v|²:
//!
//! ```text
//! min  |J w + P x + r|²_W + δ |w - v|²        S = Jᵀ W J + δ I,  H = Jᵀ W P,  h = Jᵀ W r
//!  w
//! v v:  δ I - δ² S⁻¹     v x:  δ S⁻¹ H     x x:  Pᵀ W P - Hᵀ S⁻¹ H      v:  δ S⁻¹ h     x:  Pᵀ W r - Hᵀ S⁻¹ h
//! ```
//!
//! J are the rows' modes, P their motion x of the pose. The last line is what the patch adds to the normal
//! equations of v and x once w is eliminated. All of it happens in place in the patch's packed sums: sweeping them by
//! a pivot p of S, for all other i and j
//!
//! ```text
//! a_ij -= a_ip a_jp / a_pp,     a_ip /= a_pp,     a_pp = -1 / a_pp
//! ```
//!
//! leaves -S⁻¹, S⁻¹ H, the last xx and the last x once it is done for all. Four pivots at a time share the loads and
//! stores of the sums.

use crate::packed::{packed, split};
use crate::pose_row::MOST_ENTRIES;

/// Turns the sums of a patch's points into those of a patch with weights of its own. `sums` holds the packed lower
/// triangle of Σ w row rowᵀ for `unknowns` unknowns, the first `modes` of them the weights, then Σ w r row. `own` is
/// δ > 0, in units of Σ w b'².
pub fn eliminate_own_weights(sums: &mut [f32], modes: usize, unknowns: usize, own: f32) {
    for i in 0..modes {
        sums.get_mut(packed(i) + i).into_iter().for_each(|diagonal| *diagonal += own);
    }
    // The vector is one more row, without a diagonal.
    let rows = (unknowns + 1).min(MOST_ENTRIES);
    let together = modes / PIVOTS * PIVOTS;
    let mut room = [[[0.0; PIVOTS]; MOST_ENTRIES]; 2];
    if let Some(mut sweep) = Sweep::new(&mut room, rows) {
        (0..together).step_by(PIVOTS).for_each(|pivot| sweep.by(sums, pivot));
    }
    let mut room = [[[0.0]; MOST_ENTRIES]; 2];
    if let Some(mut sweep) = Sweep::new(&mut room, rows) {
        (together..modes).for_each(|pivot| sweep.by(sums, pivot));
    }
    for i in 0..=unknowns {
        let Some(row) = sums.get_mut(packed(i)..) else { return };
        let factor = if i < modes { own * own } else { own };
        row.iter_mut().take(modes.min(i + 1)).for_each(|value| *value *= factor);
        row.get_mut(i).into_iter().filter(|_| i < modes).for_each(|diagonal| *diagonal += own);
    }
}

/// Pivots at a time.
const PIVOTS: usize = 4;

/// A sweep of packed sums by `P` pivots.
struct Sweep<'s, const P: usize> {
    /// The pivots' columns.
    columns: &'s mut [[f32; P]],
    /// Each column as it was when it was the pivot's turn.
    before: &'s mut [[f32; P]],
    /// One over the pivots.
    inverse: [f32; P],
    /// The first pivot.
    pivot: usize,
}

impl<'s, const P: usize> Sweep<'s, P> {
    /// Of columns of `rows` rows.
    fn new([columns, before]: &'s mut [[[f32; P]; MOST_ENTRIES]; 2], rows: usize) -> Option<Self> {
        let (columns, before) = (columns.get_mut(..rows)?, before.get_mut(..rows)?);
        Some(Self { columns, before, inverse: [0.0; P], pivot: 0 })
    }

    /// Sweeps by the pivots from `pivot` on: first their columns, then all sums.
    #[inline(never)]
    fn by(&mut self, sums: &mut [f32], pivot: usize) {
        self.pivot = pivot;
        self.gather(sums);
        self.turn();
        self.reduce(sums);
        self.scatter(sums);
    }

    /// Copies the pivots' columns of the symmetric matrix, and their entries of the vector.
    fn gather(&mut self, sums: &[f32]) {
        for column in 0..P {
            let line = sums.get(packed(self.pivot + column)..).unwrap_or(&[]);
            for (slots, &value) in self.columns.iter_mut().zip(line).take(self.pivot + column + 1) {
                slots[column] = value;
            }
        }
        for (row, slots) in self.columns.iter_mut().enumerate().skip(self.pivot + 1) {
            let line = sums.get(packed(row) + self.pivot..).unwrap_or(&[]);
            slots.iter_mut().zip(line).take(row - self.pivot).for_each(|(slot, &value)| *slot = value);
        }
    }

    /// Sweeps the columns by one pivot after the other: first the pivots' own rows, which all others need.
    fn turn(&mut self) {
        let (mut pivots, mut before, mut shares) = ([[0.0; P]; P], [[0.0; P]; P], [[0.0; P]; P]);
        pivots.iter_mut().zip(self.columns.iter().skip(self.pivot)).for_each(|(row, values)| *row = *values);
        for turn in 0..P {
            let inverse = reciprocal(pivots[turn][turn]);
            (shares[turn], self.inverse[turn]) = (pivots.map(|values| values[turn] * inverse), inverse);
            for (values, before) in pivots.iter_mut().zip(&mut before) {
                sweep_row(values, before, turn, shares[turn], inverse);
            }
            pivots[turn] = shares[turn];
            pivots[turn][turn] = -inverse;
        }
        let inverse = self.inverse;
        for (row, (values, kept)) in self.columns.iter_mut().zip(self.before.iter_mut()).enumerate() {
            let own = row.wrapping_sub(self.pivot);
            if let (Some(swept), Some(before)) = (pivots.get(own), before.get(own)) {
                (*values, *kept) = (*swept, *before);
                continue;
            }
            (0..P).for_each(|turn| sweep_row(values, kept, turn, shares[turn], inverse[turn]));
        }
    }

    /// Takes the products of the columns' entries, over their pivots, out of all sums.
    fn reduce(&self, sums: &mut [f32]) {
        let factors = |row: usize| {
            let mut factors = self.before.get(row).copied().unwrap_or([0.0; P]);
            factors.iter_mut().zip(self.inverse).for_each(|(factor, inverse)| *factor *= inverse);
            factors
        };
        let mut rest = sums;
        for row in (0..self.before.len()).step_by(2) {
            let (line, tail) = split(rest, row + 1);
            let (after, tail) = split(tail, row + 2);
            rest = tail;
            self.reduce_lines(line, after, factors(row), factors(row + 1));
        }
    }

    /// The same for two lines; the second may be longer by one, or empty.
    #[inline(never)]
    fn reduce_lines(&self, line: &mut [f32], after: &mut [f32], first: [f32; P], second: [f32; P]) {
        let reduced = |sum: f32, factors: [f32; P], values: &[f32; P]| {
            factors.into_iter().zip(values).fold(sum, |sum, (factor, value)| sum - factor * value)
        };
        let both = line.len().min(after.len());
        let ((line, line_end), (after, after_end)) = (split(line, both), split(after, both));
        let (columns, ends) = self.before.split_at_checked(both).unwrap_or_default();
        for ((line, after), values) in line.iter_mut().zip(after).zip(columns) {
            (*line, *after) = (reduced(*line, first, values), reduced(*after, second, values));
        }
        line_end.iter_mut().zip(ends).for_each(|(sum, values)| *sum = reduced(*sum, first, values));
        after_end.iter_mut().zip(ends).for_each(|(sum, values)| *sum = reduced(*sum, second, values));
    }

    /// Copies the columns back; among the pivots the entries above the diagonal, of which those below are the mirror.
    fn scatter(&self, sums: &mut [f32]) {
        for (row, values) in self.columns.iter().enumerate().skip(self.pivot + P) {
            let line = sums.get_mut(packed(row) + self.pivot..).unwrap_or_default();
            line.iter_mut().zip(values).for_each(|(slot, &value)| *slot = value);
        }
        for column in 0..P {
            let line = sums.get_mut(packed(self.pivot + column)..).unwrap_or_default();
            for (slot, values) in line.iter_mut().zip(self.columns.iter()).take(self.pivot + column + 1) {
                *slot = values[column];
            }
        }
    }
}

/// Sweeps the pivots' columns of a row by one of them, given its row over the pivot; `before` keeps its entry.
#[inline(always)]
fn sweep_row<const P: usize>(
    values: &mut [f32; P],
    before: &mut [f32; P],
    turn: usize,
    shares: [f32; P],
    inverse: f32,
) {
    let value = values[turn];
    before[turn] = value;
    values.iter_mut().zip(shares).for_each(|(other, share)| *other -= value * share);
    values[turn] = value * inverse;
}

/// One over a pivot; 0 where it is not positive, as for a direction nothing is known about.
fn reciprocal(pivot: f32) -> f32 {
    if pivot > 0.0 { 1.0 / pivot } else { 0.0 }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::cholesky::solve;
    use std::vec::Vec;

    const OWN: f32 = 0.7;

    /// Rows of two modes and one unknown of the pose, residuals and weights.
    const POINTS: [([f32; 3], f32, f32); 4] = [
        ([1.0, 0.5, 0.3], 0.3, 1.0),
        ([-0.5, 2.0, 1.2], -0.7, 0.5),
        ([0.25, -1.0, -0.6], 1.1, 0.8),
        ([0.1, 0.4, -1.5], 0.2, 1.0),
    ];

    /// Adds w row rowᵀ (packed lower triangle), then w r row.
    fn add_row(sums: &mut [f32], row: &[f32], residual: f32, weight: f32) {
        let lines = row.iter().enumerate().flat_map(|(i, &a)| row[..=i].iter().map(move |&b| a * b));
        let products = lines.chain(row.iter().map(|&a| a * residual));
        sums.iter_mut().zip(products).for_each(|(sum, product)| *sum += weight * product);
    }

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

    /// Seven modes are four pivots at a time, and three singly.
    #[test]
    fn many_eliminated_weights_are_unknowns_that_were_solved_for() {
        let row = |n: usize| core::array::from_fn::<f32, 9, _>(|k| libm::sinf((n * 31 + k * k * 7) as f32));
        let mut short = [0.0f32; packed(9) + 9];
        let mut long = [0.0f32; packed(16) + 16];
        for n in 0..20 {
            let (row, residual, weight) = (row(n), libm::cosf(n as f32), 1.0 / (1 + n % 3) as f32);
            add_row(&mut short, &row, residual, weight);
            let mut both = [0.0; 16];
            both[..9].copy_from_slice(&row);
            both[9..].copy_from_slice(&row[..7]);
            add_row(&mut long, &both, residual, weight);
        }
        (9..16).for_each(|i| long[packed(i) + i] += OWN - 0.05);
        eliminate_own_weights(&mut short, 7, 9, OWN);
        let (short, long) = (solved(&short, 9), solved(&long, 16));
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
