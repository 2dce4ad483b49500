//! Distances from a layer of known voxels to all others: the distance transform of a sampled function
//! (Felzenszwalb & Huttenlocher 2004, FH04 in the paper).
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
    let found = transform(values, sides);
    values.par_iter_mut().zip(&found).with_min_len(4096).for_each(|(value, &(cost, source))| {
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
    let unmarked = |&(_, source): &Sample| if source == NO_SOURCE { source } else { source & !NEGATIVE };
    transform(values, sides).par_iter().with_min_len(4096).map(unmarked).collect()
}

/// Least cost and its source, marked by its sign.
type Sample = (f32, u32);

fn transform(values: &[f32], sides: [usize; 3]) -> Vec<Sample> {
    assert_eq!(values.len(), sides.iter().product::<usize>(), "one value a voxel");
    assert!(values.len() < NEGATIVE as usize, "at most 2^31 - 1 voxels");
    let mut samples = vec![(0.0, 0); values.len()];
    if values.is_empty() {
        return samples;
    }
    let [width, height, depth] = sides;
    let slice = width * height;
    let scratch = || Scratch::new(width.max(height).max(depth));
    samples.par_chunks_mut(slice).enumerate().for_each_init(scratch, |scratch, (z, samples)| {
        let mut rows: Vec<&mut [Sample]> = samples.chunks_mut(width).collect();
        for (row, start) in rows.iter_mut().zip((z * slice..).step_by(width)) {
            scratch.along(&values[start..start + width], start as u32, row);
        }
        scratch.across(&mut rows);
    });
    let mut sheets: Vec<Vec<&mut [Sample]>> = (0..height).map(|_| Vec::with_capacity(depth)).collect();
    samples.chunks_mut(width).enumerate().for_each(|(i, row)| sheets[i % height].push(row));
    sheets.par_iter_mut().for_each_init(scratch, |scratch, rows| scratch.across(rows));
    samples
}

/// Cost and source of a voxel by itself.
fn sample((value, place): (&f32, u32)) -> Sample {
    let mark = if value.is_sign_negative() { NEGATIVE } else { 0 };
    if value.is_nan() { (0.0, NO_SOURCE) } else { (value * value, place | mark) }
}

/// What a thread needs for itself: an envelope, and a tile of columns as rows of `TILE`.
struct Scratch {
    envelope: Envelope,
    tile: Vec<[Sample; TILE]>,
}

impl Scratch {
    fn new(longest: usize) -> Self {
        Self { envelope: Envelope::new(longest), tile: vec![[(0.0, 0); TILE]; longest] }
    }

    /// Minimises along a row of values, the first of which is at place `start`.
    fn along(&mut self, values: &[f32], start: u32, row: &mut [Sample]) {
        let tile = &mut self.tile[..values.len()];
        self.envelope.build(values.iter().zip(start..).map(sample), values.len());
        self.envelope.write(tile, 0);
        row.iter_mut().zip(tile).for_each(|(to, from)| *to = from[0]);
    }

    /// Minimises along the columns of some rows.
    fn across(&mut self, rows: &mut [&mut [Sample]]) {
        let (tile, width) = (&mut self.tile[..rows.len()], rows[0].len());
        for from in (0..width).step_by(TILE) {
            let columns = TILE.min(width - from);
            for (row, line) in rows.iter().zip(tile.iter_mut()) {
                line[..columns].copy_from_slice(&row[from..from + columns]);
            }
            for c in 0..columns {
                self.envelope.build(tile.iter().map(|line| line[c]), rows.len());
                self.envelope.write(tile, c);
            }
            for (row, line) in rows.iter_mut().zip(tile.iter()) {
                row[from..from + columns].copy_from_slice(&line[..columns]);
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

    /// Builds the envelope of a row of costs and sources.
    #[inline(always)]
    fn build(&mut self, row: impl Iterator<Item = Sample>, length: usize) {
        self.count = 0;
        let mut at = 0.0;
        for (cost, source) in row {
            if source != NO_SOURCE {
                self.add(at, cost, source, length as f32);
            }
            at += 1.0;
        }
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

    /// Writes the envelope into column `c` of a tile.
    #[inline(always)]
    fn write(&self, tile: &mut [[Sample; TILE]], c: usize) {
        let mut end = tile.len();
        for piece in self.pieces[..self.count].iter().rev() {
            let from = piece.from as usize;
            let mut offset = piece.from as i32 as f32 - piece.at;
            for line in &mut tile[from..end] {
                line[c] = (offset * offset + piece.cost, piece.source);
                offset += 1.0;
            }
            end = from;
        }
        // The first piece begins at zero: something is left only of an empty envelope.
        tile[..end].iter_mut().for_each(|line| line[c].1 = NO_SOURCE);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster;

    fn squared(sides: [usize; 3], i: usize, j: usize) -> f32 {
        raster::voxel(sides, i)
            .iter()
            .zip(raster::voxel(sides, j))
            .map(|(&a, b)| a.abs_diff(b).pow(2) as f32)
            .sum()
    }

    #[test]
    fn random_volumes_agree_with_brute_force() {
        let (mut state, pool) = (7_u32, |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap());
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        for (sides, share) in [([9, 7, 8], 0.05), ([20, 5, 3], 0.3), ([1, 1, 30], 0.1), ([17, 18, 1], 0.02)] {
            let draw = |_| if random() < share { 6.0 * random() - 3.0 } else { f32::NAN };
            let before: Vec<f32> = (0..sides.iter().product()).map(draw).collect();
            let cost = |i, j: usize| squared(sides, i, j) + before[j] * before[j];
            let mut after = before.clone();
            propagate(&mut after, sides);
            let found = sources(&before, sides);
            assert!([1, 3].iter().all(|&threads| found == pool(threads).install(|| sources(&before, sides))));
            for (i, source) in found.into_iter().enumerate() {
                let least = (0..before.len()).map(|j| cost(i, j)).fold(f32::INFINITY, f32::min);
                assert!(cost(i, source as usize) < least + 1e-4);
                let filled = least.sqrt().copysign(before[source as usize]);
                assert!((after[i] - if before[i].is_nan() { filled } else { before[i] }).abs() < 1e-4);
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
    fn a_ball_is_exact_but_for_the_known_layer() {
        let distance = |i| squared([25; 3], i, 12 * 651).sqrt() - 7.5;
        let known = |i| Some(distance(i)).filter(|d| d.abs() < 0.9).unwrap_or(f32::NAN);
        let mut values: Vec<f32> = (0..25 * 25 * 25).map(known).collect();
        propagate(&mut values, [25; 3]);
        let near = |value: f32, exact: f32| (value - exact).abs() < 1.0 && value * exact > 0.0;
        assert!(values.iter().enumerate().all(|(i, &value)| near(value, distance(i))));
    }

    #[test]
    fn nothing_known_stays_unknown() {
        let mut values = vec![f32::NAN; 24];
        propagate(&mut values, [2, 3, 4]);
        assert!(values.iter().all(|v| v.is_nan()));
        propagate(&mut [], [0, 3, 4]);
    }
}
