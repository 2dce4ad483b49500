//! Distances from a layer of known voxels to all others: the distance transform of a sampled function
//! (Felzenszwalb & Huttenlocher 2004, [FH04] in the paper).
//!
//! The cost of a voxel x is the least |x - y|² + d(y)² over the known voxels y. It separates by axis: along a row
//! every sample is a parabola, and the lower envelope of the parabolas is built in one sweep. The source y of the
//! least cost is carried along, which gives the sign. Equal costs are decided by the lowest z, then y, then x, so
//! the result does not depend on the number of threads.
//!
//! The root of the cost is a distance only for sources on the surface: straight above a thick known layer the
//! cheapest source is half way down, and the root is 1/√2 of the distance. [`sources`] tells which voxel it was.

use rayon::prelude::*;

/// No voxel is known.
pub const NO_SOURCE: u32 = u32::MAX;

/// Mark of a source whose value is negative.
const NEGATIVE: u32 = 1 << 31;

/// Columns worked on together, so that a cache line is read once.
const TILE: usize = 16;

/// Fills the unknown voxels of an x-fastest array: size √(min |x - y|² + d(y)²) over the known voxels y, sign of
/// that y's value. Unknown is NaN; known are signed distances in voxels, which are kept. Where nothing is known
/// all stays NaN.
///
/// # Panics
/// If `values` does not have the length that `sides` tells, or has 2^31 elements or more.
pub fn propagate(values: &mut [f32], sides: [usize; 3]) {
    let field = Field::new(values, sides);
    let found = field.costs.par_iter().zip(&field.sources);
    values.par_iter_mut().zip(found).with_min_len(4096).for_each(|(value, (cost, &source))| {
        if value.is_nan() && source != NO_SOURCE {
            *value = if source & NEGATIVE == 0 { cost.sqrt() } else { -cost.sqrt() };
        }
    });
}

/// For every voxel the place of the known voxel y of least |x - y|² + d(y)², or [`NO_SOURCE`]. Arguments as for
/// [`propagate`].
///
/// # Panics
/// If `values` does not have the length that `sides` tells, or has 2^31 elements or more.
pub fn sources(values: &[f32], sides: [usize; 3]) -> Vec<u32> {
    let mut sources = Field::new(values, sides).sources;
    let unmark =
        |source: &mut u32| *source = if *source == NO_SOURCE { NO_SOURCE } else { *source & !NEGATIVE };
    sources.par_iter_mut().with_min_len(4096).for_each(unmark);
    sources
}

/// Least cost and its source, marked by its sign, at every voxel.
struct Field {
    costs: Vec<f32>,
    sources: Vec<u32>,
}

/// One row of each array.
type Row<'a> = (&'a mut [f32], &'a mut [u32]);

impl Field {
    fn new(values: &[f32], sides: [usize; 3]) -> Self {
        assert_eq!(values.len(), sides.iter().product::<usize>(), "one value a voxel");
        assert!(values.len() < NEGATIVE as usize, "at most 2^31 - 1 voxels");
        let mut field = Self { costs: vec![0.0; values.len()], sources: vec![0; values.len()] };
        if values.is_empty() {
            return field;
        }
        let [width, height, depth] = sides;
        let scratch = || Scratch::new(width.max(height).max(depth));
        let slices =
            field.costs.par_chunks_mut(width * height).zip(field.sources.par_chunks_mut(width * height));
        slices.enumerate().for_each_init(scratch, |scratch, (z, (costs, sources))| {
            let first = z * width * height;
            let mut rows: Vec<Row<'_>> = costs.chunks_mut(width).zip(sources.chunks_mut(width)).collect();
            for (y, row) in rows.iter_mut().enumerate() {
                let start = first + y * width;
                scratch.envelope.row(&values[start..start + width], start as u32, row);
            }
            scratch.across(&mut rows);
        });
        let mut sheets: Vec<Vec<Row<'_>>> = (0..height).map(|_| Vec::with_capacity(depth)).collect();
        let rows = field.costs.chunks_mut(width).zip(field.sources.chunks_mut(width));
        rows.enumerate().for_each(|(i, row)| sheets[i % height].push(row));
        sheets.par_iter_mut().for_each_init(scratch, |scratch, rows| scratch.across(rows));
        field
    }
}

/// What a thread needs for itself: an envelope, and a tile of columns as rows of `TILE`.
struct Scratch {
    envelope: Envelope,
    costs: Vec<[f32; TILE]>,
    sources: Vec<[u32; TILE]>,
}

impl Scratch {
    fn new(longest: usize) -> Self {
        let (costs, sources) = (vec![[0.0; TILE]; longest], vec![[0; TILE]; longest]);
        Self { envelope: Envelope::new(longest), costs, sources }
    }

    /// Minimises along the columns of some rows.
    fn across(&mut self, rows: &mut [Row<'_>]) {
        let (costs, sources) = (&mut self.costs[..rows.len()], &mut self.sources[..rows.len()]);
        let width = rows[0].0.len();
        for from in (0..width).step_by(TILE) {
            let (range, columns) = (from..width.min(from + TILE), TILE.min(width - from));
            for (row, (costs, sources)) in rows.iter().zip(costs.iter_mut().zip(sources.iter_mut())) {
                costs[..columns].copy_from_slice(&row.0[range.clone()]);
                sources[..columns].copy_from_slice(&row.1[range.clone()]);
            }
            (0..columns).for_each(|column| self.envelope.column(costs, sources, column));
            for (row, (costs, sources)) in rows.iter_mut().zip(costs.iter().zip(sources.iter())) {
                row.0[range.clone()].copy_from_slice(&costs[..columns]);
                row.1[range.clone()].copy_from_slice(&sources[..columns]);
            }
        }
    }
}

/// A parabola of the lower envelope.
#[derive(Clone, Copy, Default)]
struct Piece {
    /// First voxel where it is the lowest.
    from: u32,
    at: f32,
    cost: f32,
    source: u32,
}

struct Envelope {
    /// The first `count` are in use.
    pieces: Vec<Piece>,
    count: usize,
}

impl Envelope {
    fn new(longest: usize) -> Self {
        Self { pieces: vec![Piece::default(); longest], count: 0 }
    }

    /// The first axis: known values at places from `start` on.
    fn row(&mut self, values: &[f32], start: u32, (costs, sources): &mut Row<'_>) {
        self.count = 0;
        for (i, value) in values.iter().enumerate().filter(|(_, value)| !value.is_nan()) {
            let mark = if value.is_sign_negative() { NEGATIVE } else { 0 };
            self.add(i as i32 as f32, value * value, (start + i as u32) | mark, values.len() as f32);
        }
        if self.count == 0 {
            sources.fill(NO_SOURCE);
        }
        self.spans(costs.len(), |piece, span| {
            let mut offset = span.start as i32 as f32 - piece.at;
            for cost in &mut costs[span.clone()] {
                *cost = offset * offset + piece.cost;
                offset += 1.0;
            }
            sources[span].fill(piece.source);
        });
    }

    /// A further axis, in place: one column of a tile.
    #[inline]
    fn column(&mut self, costs: &mut [[f32; TILE]], sources: &mut [[u32; TILE]], column: usize) {
        self.count = 0;
        let (length, mut at) = (costs.len() as f32, 0.0);
        for (costs, sources) in costs.iter().zip(sources.iter()) {
            if sources[column] != NO_SOURCE {
                self.add(at, costs[column], sources[column], length);
            }
            at += 1.0;
        }
        self.spans(costs.len(), |piece, span| {
            let mut offset = span.start as i32 as f32 - piece.at;
            for (costs, sources) in costs[span.clone()].iter_mut().zip(&mut sources[span]) {
                costs[column] = offset * offset + piece.cost;
                sources[column] = piece.source;
                offset += 1.0;
            }
        });
    }

    #[inline(always)]
    fn add(&mut self, at: f32, cost: f32, source: u32, length: f32) {
        let mut from = 0.0;
        while let Some(top) = self.count.checked_sub(1).and_then(|last| self.pieces.get(last)) {
            let crossing = 0.5 * (at + top.at + (cost - top.cost) / (at - top.at));
            // The first whole number beyond the crossing is below this: on a tie the earlier parabola stays.
            from = crossing + 1.0;
            if from >= (top.from as i32 + 1) as f32 {
                break;
            }
            from = 0.0;
            self.count -= 1;
        }
        if from < length {
            self.pieces[self.count] = Piece { from: from as i32 as u32, at, cost, source };
            self.count += 1;
        }
    }

    /// The pieces and where they are the lowest, last first.
    #[inline(always)]
    fn spans(&self, length: usize, mut found: impl FnMut(&Piece, std::ops::Range<usize>)) {
        let mut end = length;
        for piece in self.pieces[..self.count].iter().rev() {
            let from = piece.from as usize;
            found(piece, from..end);
            end = from;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in [0, 1).
    fn random() -> impl FnMut() -> f32 {
        let mut state = 7_u32;
        move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        }
    }

    fn place([width, height, _]: [usize; 3], i: usize) -> [i64; 3] {
        [i % width, i / width % height, i / width / height].map(|v| v as i64)
    }

    fn squared(sides: [usize; 3], i: usize, j: usize) -> f32 {
        let (a, b) = (place(sides, i), place(sides, j));
        (0..3).map(|axis| (a[axis] - b[axis]).pow(2)).sum::<i64>() as f32
    }

    #[test]
    fn random_volumes_agree_with_brute_force() {
        let mut random = random();
        for (sides, share) in [([9, 7, 8], 0.05), ([20, 5, 3], 0.3), ([1, 1, 30], 0.1), ([17, 18, 1], 0.02)] {
            let draw = |_| if random() < share { 6.0 * random() - 3.0 } else { f32::NAN };
            let before: Vec<f32> = (0..sides.iter().product()).map(draw).collect();
            let known: Vec<usize> = (0..before.len()).filter(|&i| !before[i].is_nan()).collect();
            let mut after = before.clone();
            propagate(&mut after, sides);
            for (i, &value) in after.iter().enumerate() {
                let cost = |j: &usize| squared(sides, i, *j) + before[*j].powi(2);
                let best = known.iter().min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap();
                let expected =
                    if before[i].is_nan() { cost(best).sqrt().copysign(before[*best]) } else { before[i] };
                assert!((value - expected).abs() < 1e-4, "{sides:?} {i}: {value} for {expected}");
            }
        }
    }

    #[test]
    fn a_plane_of_zeros_gives_exact_distances() {
        let sides = [6, 5, 12];
        let mut values = vec![f32::NAN; 360];
        values[3 * 30..4 * 30].fill(-0.0);
        propagate(&mut values, sides);
        assert!((0..360).all(|i| values[i] == -((i / 30) as f32 - 3.0).abs()));
    }

    #[test]
    fn a_ball_seen_from_its_surface_is_exact_to_the_voxel() {
        let sides = [24; 3];
        let distance = |i: usize| {
            let [x, y, z] = place(sides, i).map(|v| v as f32 - 11.5);
            (x * x + y * y + z * z).sqrt() - 7.0
        };
        let near = |i| Some(distance(i)).filter(|d| d.abs() < 0.9).unwrap_or(f32::NAN);
        let mut values: Vec<f32> = (0..24 * 24 * 24).map(near).collect();
        propagate(&mut values, sides);
        assert!(values.iter().enumerate().all(|(i, value)| (value - distance(i)).abs() < 1.0));
        assert!(values.iter().enumerate().all(|(i, value)| (*value < 0.0) == (distance(i) < 0.0)));
    }

    #[test]
    fn threads_do_not_matter() {
        let mut random = random();
        let draw = |_| if random() < 0.1 { (4.0 * random()).floor() - 2.0 } else { f32::NAN };
        let values: Vec<f32> = (0..30 * 20 * 10).map(draw).collect();
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| sources(&values, [30, 20, 10]))
        };
        assert_eq!(with(1), with(3));
    }

    #[test]
    fn nothing_known_stays_unknown() {
        let mut values = vec![f32::NAN; 24];
        propagate(&mut values, [2, 3, 4]);
        assert!(values.iter().all(|v| v.is_nan()));
        propagate(&mut [], [0, 3, 4]);
    }
}
