//! Packed lower triangles: row after row, row i is i + 1 long.

/// Length of a packed lower triangle of `n` rows.
pub const fn packed(n: usize) -> usize {
    n * (n + 1) / 2
}

/// As [`split_at_mut`](slice::split_at_mut), at the end if it is nearer: cuts a line off packed sums.
pub(crate) fn split(sums: &mut [f32], at: usize) -> (&mut [f32], &mut [f32]) {
    sums.split_at_mut_checked(at.min(sums.len())).unwrap_or_default()
}
