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

/// Columns worked on together, so that a cache line is read once.
const TILE: usize = 16;

/// Fills the unknown voxels of an x-fastest array: size √(min |x - y|² + d(y)²) over the known voxels y, sign of
/// that y's value. Unknown is NaN; known are signed distances in voxels, which are kept. Where nothing is known
/// all stays NaN.
///
/// # Panics
/// If `values` does not have the length that `sides` tells.
pub fn propagate(values: &mut [f32], sides: [usize; 3]) {
    let field = Field::new(values, sides);
    let known = values.to_vec();
    let costs = field.costs.par_iter().zip(&field.sources);
    values.par_iter_mut().zip(costs).with_min_len(4096).for_each(|(value, (cost, &source))| {
        if value.is_nan() && source != NO_SOURCE {
            *value = cost.sqrt().copysign(known[source as usize]);
        }
    });
}

/// For every voxel the place of the known voxel y of least |x - y|² + d(y)², or [`NO_SOURCE`]. Arguments as for
/// [`propagate`].
///
/// # Panics
/// If `values` does not have the length that `sides` tells.
pub fn sources(values: &[f32], sides: [usize; 3]) -> Vec<u32> {
    Field::new(values, sides).sources
}

/// Least cost and its source at every voxel.
struct Field {
    costs: Vec<f32>,
    sources: Vec<u32>,
}

/// One row of each array.
type Row<'a> = (&'a mut [f32], &'a mut [u32]);

impl Field {
    fn new(values: &[f32], sides: [usize; 3]) -> Self {
        assert_eq!(values.len(), sides.iter().product::<usize>(), "one value a voxel");
        let mut field = Self { costs: vec![0.0; values.len()], sources: vec![NO_SOURCE; values.len()] };
        if values.is_empty() {
            return field;
        }
        let [width, height, depth] = sides;
        let scratch = || Scratch::new(width.max(height).max(depth));
        let slices = field.costs.par_chunks_mut(width * height).zip(field.sources.par_chunks_mut(width * height));
        slices.enumerate().for_each_init(scratch, |scratch, (z, (costs, sources))| {
            let first = z * width * height;
            let mut rows: Vec<Row<'_>> = costs.chunks_mut(width).zip(sources.chunks_mut(width)).collect();
            for (y, row) in rows.iter_mut().enumerate() {
                let start = first + y * width;
                scratch.envelope.along(&values[start..start + width], start as u32, row);
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

/// What a thread needs for itself.
struct Scratch {
    envelope: Envelope,
    costs: Vec<f32>,
    sources: Vec<u32>,
}

impl Scratch {
    fn new(longest: usize) -> Self {
        let (costs, sources) = (vec![0.0; TILE * longest], vec![0; TILE * longest]);
        Self { envelope: Envelope::new(longest), costs, sources }
    }

    /// Minimises along the columns of some rows.
    fn across(&mut self, rows: &mut [Row<'_>]) {
        let (width, length) = (rows[0].0.len(), rows.len());
        for from in (0..width).step_by(TILE) {
            let columns = TILE.min(width - from);
            for (i, (costs, sources)) in rows.iter().enumerate() {
                for (c, (cost, source)) in costs[from..].iter().zip(&sources[from..]).take(columns).enumerate() {
                    self.costs[c * length + i] = *cost;
                    self.sources[c * length + i] = *source;
                }
            }
            let tile = self.costs.chunks_exact_mut(length).zip(self.sources.chunks_exact_mut(length));
            tile.take(columns).for_each(|mut column| self.envelope.again(&mut column));
            for (i, (costs, sources)) in rows.iter_mut().enumerate() {
                for c in 0..columns {
                    costs[from + c] = self.costs[c * length + i];
                    sources[from + c] = self.sources[c * length + i];
                }
            }
        }
    }
}

/// A parabola of the lower envelope.
#[derive(Clone, Copy)]
struct Piece {
    /// First voxel where it is the lowest.
    from: u32,
    at: u32,
    cost: f32,
    source: u32,
}

struct Envelope {
    pieces: Vec<Piece>,
    /// 1 / 2n at n.
    inverse: Vec<f32>,
}

impl Envelope {
    fn new(longest: usize) -> Self {
        let inverse = (0..longest).map(|n| 0.5 / n as f32).collect();
        Self { pieces: Vec::with_capacity(longest), inverse }
    }

    /// The first axis: known values at places from `start` on.
    fn along(&mut self, values: &[f32], start: u32, row: &mut Row<'_>) {
        self.pieces.clear();
        for (at, value) in values.iter().enumerate().filter(|(_, value)| !value.is_nan()) {
            self.add(at as u32, value * value, start + at as u32, values.len() as u32);
        }
        self.write(row);
    }

    /// A further axis, in place.
    fn again(&mut self, row: &mut Row<'_>) {
        self.pieces.clear();
        let length = row.0.len() as u32;
        for (at, (&cost, &source)) in row.0.iter().zip(row.1.iter()).enumerate() {
            if source != NO_SOURCE {
                self.add(at as u32, cost, source, length);
            }
        }
        self.write(row);
    }

    #[inline]
    fn add(&mut self, at: u32, cost: f32, source: u32, length: u32) {
        let mut from = 0;
        while let Some(top) = self.pieces.last() {
            let middle = 0.5 * (at + top.at) as f32;
            let crossing = middle + (cost - top.cost) * self.inverse[(at - top.at) as usize];
            // The first whole number beyond the crossing: on a tie the earlier parabola stays.
            from = (crossing + 1.0).max(0.0) as u32;
            if from > top.from {
                break;
            }
            from = 0;
            self.pieces.pop();
        }
        if from < length {
            self.pieces.push(Piece { from, at, cost, source });
        }
    }

    fn write(&self, (costs, sources): &mut Row<'_>) {
        let mut end = costs.len();
        for piece in self.pieces.iter().rev() {
            let from = piece.from as usize;
            for (i, cost) in (from..end).zip(&mut costs[from..end]) {
                let offset = i as f32 - piece.at as f32;
                *cost = offset * offset + piece.cost;
            }
            sources[from..end].fill(piece.source);
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
                let expected = if before[i].is_nan() { cost(best).sqrt().copysign(before[*best]) } else { before[i] };
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
    #[ignore = "takes the time"]
    fn speed() {
        let side = 100;
        let distance = |i: usize| {
            let [x, y, z] = place([side; 3], i).map(|v| v as f32 - 49.5);
            x.hypot(y).hypot(z) - 35.0
        };
        for reach in [1.0, 3.0] {
            let known = |i| Some(distance(i)).filter(|d| d.abs() < reach).unwrap_or(f32::NAN);
            let before: Vec<f32> = (0..side.pow(3)).map(known).collect();
            for _ in 0..8 {
                let mut values = before.clone();
                let start = std::time::Instant::now();
                propagate(&mut values, [side; 3]);
                let mid = start.elapsed();
                let s = sources(&before, [side; 3]);
                eprintln!("{reach}: {mid:?} {:?} {}", start.elapsed() - mid, s[0]);
            }
        }
    }

    #[test]
    fn nothing_known_stays_unknown() {
        let mut values = vec![f32::NAN; 24];
        propagate(&mut values, [2, 3, 4]);
        assert!(values.iter().all(|v| v.is_nan()));
        propagate(&mut [], [0, 3, 4]);
    }
}
