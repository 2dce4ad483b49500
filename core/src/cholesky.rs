//! Cholesky factorisation of a packed symmetric positive matrix, and the solve.

use crate::packed::packed;

/// Row `i` of a packed lower triangle, i + 1 long.
fn row(matrix: &[f64], i: usize) -> &[f64] {
    matrix.get(packed(i)..).and_then(|m| m.get(..=i)).unwrap_or(&[])
}

/// Solves A x = b. `matrix` holds A's lower triangle row by row and is replaced by its factor L, A = L Lᵀ;
/// `vector` holds b and becomes x. A pivot that is not positive is taken as a huge number: its
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
fn factor_row(above: &[f64], current: &mut [f64]) {
    for j in 0..current.len().saturating_sub(1) {
        let Some((&pivot, left)) = row(above, j).split_last() else { return };
        let Some((known, rest)) = current.split_at_mut_checked(j) else { return };
        let Some(value) = rest.first_mut() else { return };
        *value = (*value - inner(left, known)) / pivot;
    }
    let Some((pivot, known)) = current.split_last_mut() else { return };
    let square = *pivot - inner(known, known);
    *pivot = if square > 0.0 { libm::sqrt(square) } else { HUGE };
}

/// The pivot of a direction nothing is known about: what is divided by it vanishes.
const HUGE: f64 = 1e150;

/// Σ a b.
fn inner(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |sum, (&x, &y)| sum + x * y)
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
