//! Sums of products of integer columns: the normal equations of a patch of points.
//!
//! The rows of up to [`PATCH`] points lie transposed, a column for each unknown. An entry is below [`LIMIT`], so a sum
//! of products of two columns is an exact i32: 96 · 4729² < 2³¹. Two lines of the triangle and two columns at a time
//! share their loads.

use crate::packed::split;

/// Points of a patch.
pub const PATCH: usize = 96;
/// Entries are smaller.
pub const LIMIT: i16 = 4729;
const _: () = assert!((PATCH as i64) * (LIMIT as i64) * (LIMIT as i64) < 1 << 31);

/// A value for each point of a patch.
pub type Column = [i16; PATCH];

/// Sets a point's values.
pub fn set_row(columns: &mut [Column], point: usize, row: &[i16]) {
    for (column, &value) in columns.iter_mut().zip(row) {
        if let Some(slot) = column.get_mut(point) {
            *slot = value;
        }
    }
}

/// Sets the values of the points from `count` on to zero.
pub fn clear_from(columns: &mut [Column], count: usize) {
    for column in columns {
        column.get_mut(count..).unwrap_or_default().fill(0);
    }
}

/// Sets `sums` to the packed lower triangle of Σ row rowᵀ, each sum times the units of both columns; the last of them, or
/// more, may be missing. With residuals as the last column that is the matrix of the normal equations, then the vector.
pub fn products(columns: &[Column], units: &[f32], sums: &mut [f32]) {
    let unit = |k: usize| units.get(k).copied().unwrap_or(0.0);
    let mut rest = sums;
    for (pair, lines) in columns.chunks(2).enumerate() {
        let i = 2 * pair;
        let (line, tail) = split(rest, i + 1);
        let (next, tail) = split(tail, i + 2);
        rest = tail;
        let mut room = [[0; PATCH]; 2];
        let lines = both(lines, &mut room);
        for (other, columns) in columns.chunks(2).take(pair + 1).enumerate() {
            let j = 2 * other;
            let sums =
                columns.first_chunk().map_or_else(|| tile(lines, lines), |columns| tile(lines, columns));
            let [ac, ad, bc, bd] = sums.map(|sum| sum as f32);
            let [u, v] = [unit(j), unit(j + 1)];
            set(line, j, [ac * u * unit(i), ad * v * unit(i)]);
            set(next, j, [bc * u * unit(i + 1), bd * v * unit(i + 1)]);
        }
    }
}

/// Σ a c, Σ a d, Σ b c, Σ b d.
#[inline(never)]
fn tile([a, b]: &[Column; 2], [c, d]: &[Column; 2]) -> [i32; 4] {
    let [mut p, mut q, mut r, mut s] = [0i32; 4];
    for (((&a, &b), &c), &d) in a.iter().zip(b).zip(c).zip(d) {
        let [a, b, c, d] = [a, b, c, d].map(i32::from);
        (p, q) = (p.wrapping_add(a * c), q.wrapping_add(a * d));
        (r, s) = (r.wrapping_add(b * c), s.wrapping_add(b * d));
    }
    [p, q, r, s]
}

/// The columns of a pair, the first twice where there is no second.
fn both<'c>(pair: &'c [Column], room: &'c mut [Column; 2]) -> &'c [Column; 2] {
    if let ([first], [slot, other]) = (pair, &mut *room) {
        (*slot, *other) = (*first, *first);
    }
    pair.first_chunk().unwrap_or(room)
}

/// Sets two values of a line, as far as it goes.
#[inline]
fn set(line: &mut [f32], at: usize, [a, b]: [f32; 2]) {
    match line.get_mut(at..) {
        Some([first, second, ..]) => (*first, *second) = (a, b),
        Some([last]) => *last = a,
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_those_of_the_products() {
        for count in 1..=7usize {
            let columns: [Column; 7] = core::array::from_fn(|k| {
                core::array::from_fn(|n| ((n * 37 + k * 911) % 9001) as i16 - LIMIT + 1)
            });
            let units: [f32; 7] = core::array::from_fn(|k| 1.0 / (1 << k) as f32);
            let length = count * (count + 1) / 2 - 1;
            let mut sums = [7.0; 28];
            products(&columns[..count], &units, &mut sums[..length]);
            let exact = |i: usize, j: usize| {
                let products = columns[i].iter().zip(&columns[j]).map(|(&a, &b)| i64::from(a) * i64::from(b));
                products.sum::<i64>() as f32 / (1u32 << (i + j)) as f32
            };
            let mut expected = (0..count).flat_map(|i| (0..=i).map(move |j| (i, j)));
            assert!(
                sums[..length].iter().all(|&sum| expected.next().is_some_and(|(i, j)| sum == exact(i, j)))
            );
            assert!(sums[length..].iter().all(|&sum| sum == 7.0), "nothing beyond");
        }
    }

    #[test]
    fn the_largest_entries_do_not_overflow() {
        let mut sums = [0.0; 3];
        products(&[[1 - LIMIT; PATCH], [LIMIT - 1; PATCH]], &[1.0, 1.0], &mut sums);
        let square = PATCH as f32 * f32::from(LIMIT - 1) * f32::from(LIMIT - 1);
        assert_eq!(sums, [square, -square, square]);
    }
}
