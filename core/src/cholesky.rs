//! Cholesky factorisation of a packed symmetric positive matrix, and the solve.

use core::ops::{Add, Div, Mul, Sub};

/// The floats a matrix may be made of.
pub trait Real:
    Copy + PartialOrd + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// 0.
    const ZERO: Self;
    /// The pivot of a direction nothing is known about: what is divided by it vanishes.
    const HUGE: Self;
    /// The square root.
    #[must_use]
    fn root(self) -> Self;
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const HUGE: Self = 1e150;
    fn root(self) -> Self {
        libm::sqrt(self)
    }
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    const HUGE: Self = 1e18;
    fn root(self) -> Self {
        libm::sqrtf(self)
    }
}

/// Length of a packed lower triangle of `n` rows.
pub const fn packed(n: usize) -> usize {
    n * (n + 1) / 2
}

/// Row `i` of a packed lower triangle, i + 1 long.
pub(crate) fn row<T>(matrix: &[T], i: usize) -> &[T] {
    matrix.get(packed(i)..).and_then(|m| m.get(..=i)).unwrap_or(&[])
}

/// Solves A x = b. `matrix` holds A's lower triangle row by row and is replaced by its factor L, A = L Lᵀ;
/// `vector` holds b and becomes x. A pivot that is not positive is taken as the largest number: its
/// unknown becomes zero, as for a direction nothing is known about.
pub fn solve(matrix: &mut [f64], vector: &mut [f64]) {
    let n = vector.len();
    for i in 0..n {
        let Some((above, rest)) = matrix.split_at_mut_checked(packed(i)) else { return };
        let Some(current) = rest.get_mut(..=i) else { return };
        factor_row(above, current);
    }
    for i in 0..n {
        let Some((solved, rest)) = vector.split_at_mut_checked(i) else { return };
        let Some((pivot, left)) = row(matrix, i).split_last() else { return };
        let Some(value) = rest.first_mut() else { return };
        *value = (*value - inner(left, solved)) / pivot;
    }
    for i in (0..n).rev() {
        let Some((before, rest)) = vector.split_at_mut_checked(i) else { return };
        let Some((pivot, left)) = row(matrix, i).split_last() else { return };
        let Some(value) = rest.first_mut() else { return };
        *value /= pivot;
        for (b, l) in before.iter_mut().zip(left) {
            *b -= l * *value;
        }
    }
}

/// Turns row i of A (i + 1 long) into that of L; `above` holds the rows of L before it.
pub(crate) fn factor_row<T: Real>(above: &[T], current: &mut [T]) {
    let i = current.len().saturating_sub(1);
    solve_row(above, current, i);
    let Some((pivot, known)) = current.split_last_mut() else { return };
    let square = *pivot - inner(known, known);
    *pivot = if square > T::ZERO { square.root() } else { T::HUGE };
}

/// Turns the first `count` entries x of a row into L⁻¹ x; `factor` holds the first `count` rows of L.
pub(crate) fn solve_row<T: Real>(factor: &[T], current: &mut [T], count: usize) {
    for j in 0..count {
        let Some((&pivot, left)) = row(factor, j).split_last() else { return };
        let Some((known, rest)) = current.split_at_mut_checked(j) else { return };
        let Some(value) = rest.first_mut() else { return };
        *value = (*value - inner(left, known)) / pivot;
    }
}

/// Σ a b.
pub(crate) fn inner<T: Real>(a: &[T], b: &[T]) -> T {
    a.iter().zip(b).fold(T::ZERO, |sum, (&x, &y)| sum + x * y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_a_small_system() {
        let mut matrix = [4.0, 2.0, 5.0, 0.6, 1.0, 3.0];
        let full = [[4.0, 2.0, 0.6], [2.0, 5.0, 1.0], [0.6, 1.0, 3.0]];
        let x = [1.0, -2.0, 3.0];
        let mut vector = full.map(|row| row.iter().zip(x).map(|(a, b)| a * b).sum::<f64>());
        solve(&mut matrix, &mut vector);
        assert!(vector.iter().zip(x).all(|(a, b)| (a - b).abs() < 1e-12), "{vector:?}");
    }

    #[test]
    fn an_unknown_direction_stays_at_zero() {
        let (mut matrix, mut vector) = ([2.0, 0.0, 0.0], [4.0, 0.0]);
        solve(&mut matrix, &mut vector);
        assert!((vector[0] - 2.0).abs() < 1e-12 && vector[1] == 0.0, "{vector:?}");
    }
}
