//! Normal equations of a least squares problem, four points at a time.
//!
//! Point by point every sum of the packed triangle would be loaded and stored for a single product. Four points and
//! two lines of the triangle at a time, eight products share that. Each sum still takes its points one after the
//! other, so the bits are those of adding them singly.

/// Points of a block.
pub const BLOCK: usize = 4;

/// Adds w row rowᵀ (packed lower triangle), then w r row.
pub fn add_row(sums: &mut [f32], row: &[f32], residual: f32, weight: f32) {
    let mut rest = sums;
    for (i, &value) in row.iter().enumerate() {
        let Some((line, tail)) = rest.split_at_mut_checked(i + 1) else { return };
        let scaled = weight * value;
        for (sum, &other) in line.iter_mut().zip(row) {
            *sum += scaled * other;
        }
        rest = tail;
    }
    let scaled = weight * residual;
    for (sum, &value) in rest.iter_mut().zip(row) {
        *sum += scaled * value;
    }
}

/// Adds four points' w row rowᵀ and w r row of `unknowns` unknowns to `sums`. A point of weight 0 adds nothing, whatever
/// finite numbers its row holds.
#[inline(never)]
pub fn add_block(
    sums: &mut [f32],
    unknowns: usize,
    rows: [&[f32]; BLOCK],
    residuals: [f32; BLOCK],
    weights: [f32; BLOCK],
) {
    let scaled = |k: usize| {
        let mut values = weights;
        values.iter_mut().zip(rows).for_each(|(value, row)| *value *= row.get(k).copied().unwrap_or(0.0));
        values
    };
    let mut rest = sums;
    for i in (0..unknowns).step_by(2) {
        let Some((first, tail)) = rest.split_at_mut_checked(i + 1) else { return };
        if i + 1 == unknowns {
            rest = tail;
            add_lines(first, &mut [], rows, scaled(i), weights);
            break;
        }
        let Some((second, tail)) = tail.split_at_mut_checked(i + 2) else { return };
        add_lines(first, second, rows, scaled(i), scaled(i + 1));
        rest = tail;
    }
    let mut pulls = weights;
    pulls.iter_mut().zip(residuals).for_each(|(pull, residual)| *pull *= residual);
    if let Some(vector) = rest.get_mut(..unknowns) {
        add_lines(vector, &mut [], rows, pulls, [0.0; BLOCK]);
    }
}

/// Adds Σ p row to the first line and Σ q row to the second, which may be longer by one or empty.
#[inline]
fn add_lines(
    first: &mut [f32],
    second: &mut [f32],
    [a, b, c, d]: [&[f32]; BLOCK],
    p: [f32; BLOCK],
    q: [f32; BLOCK],
) {
    let both = first.len().min(second.len());
    let (first, first_end) = first.split_at_mut_checked(both).unwrap_or_default();
    let (second, second_end) = second.split_at_mut_checked(both).unwrap_or_default();
    let add = |sum: f32, [p, q, r, s]: [f32; BLOCK], [a, b, c, d]: [f32; BLOCK]| {
        (((sum + p * a) + q * b) + r * c) + s * d
    };
    let (lines, ends) = (first.as_chunks_mut::<4>(), second.as_chunks_mut::<4>());
    let chunks = lines.0.iter_mut().zip(ends.0).zip(a.as_chunks::<4>().0).zip(b.as_chunks::<4>().0);
    for (((((f, s), a), b), c), d) in chunks.zip(c.as_chunks::<4>().0).zip(d.as_chunks::<4>().0) {
        for i in 0..4 {
            let row = [a[i], b[i], c[i], d[i]];
            (f[i], s[i]) = (add(f[i], p, row), add(s[i], q, row));
        }
    }
    let done = both / 4 * 4;
    let row = |k: usize| [a, b, c, d].map(|row| row.get(k).copied().unwrap_or(0.0));
    for (k, (f, s)) in lines.1.iter_mut().zip(ends.1).enumerate() {
        let row = row(done + k);
        (*f, *s) = (add(*f, p, row), add(*s, q, row));
    }
    for (k, f) in first_end.iter_mut().enumerate() {
        *f = add(*f, p, row(both + k));
    }
    for (k, s) in second_end.iter_mut().enumerate() {
        *s = add(*s, q, row(both + k));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_adds_the_bits_of_its_points_one_by_one() {
        for unknowns in 1..=13 {
            let row = |n: usize| {
                core::array::from_fn::<f32, 13, _>(|k| libm::sinf((n * 31 + k * 7) as f32) * (k + 1) as f32)
            };
            let rows: [_; BLOCK] = core::array::from_fn(row);
            let (residuals, weights) = ([0.3, -0.7, 1.9, 0.01], [1.0, 0.31, 0.77, 0.0]);
            let length = unknowns * (unknowns + 1) / 2 + unknowns;
            let (mut blocked, mut single) = ([0.25f32; 104], [0.25f32; 104]);
            let slices = rows.each_ref().map(|row| &row[..unknowns]);
            add_block(&mut blocked[..length], unknowns, slices, residuals, weights);
            for ((row, residual), weight) in slices.into_iter().zip(residuals).zip(weights) {
                add_row(&mut single[..length], row, residual, weight);
            }
            assert_eq!(blocked, single, "{unknowns}");
        }
    }
}
