//! Thin parts that nobody saw keep their volume.
//!
//! A distance of which a shape may have this or that value is stated as the mean of them, and the zero level of a mean is
//! not the mean of zero levels: where an ear a few millimetres thick may lie here or there, it is outside of most of
//! its places, the mean is positive everywhere and the ear is gone. What the scan leaves undecided is known
//! ([`Posterior`]), so is the volume to expect in the neighbourhood of a voxel, and there is a level τ whose inside
//! has it:
//!
//! ```text
//! B [ F((τ - Φ) / ε) ] = B [ F(-Φ / √(ε² + σ²)) ],    Φ ← Φ - τ
//! ```
//!
//! F is the normal distribution, B a box mean taken three times, σ the deviation of Φ and ε what is left of a voxel's edge
//! where Φ is known. Without doubt τ is zero; measured voxels stay as they are.

use super::dense::Dense;
use crate::uncertainty::posterior::Posterior;
use rayon::prelude::*;

/// The volume to expect is that of so many times the posterior's deviation. Calibrations say that true errors are 2.3 times as
/// large with 30 faces, 1.2 with 90, 1.1 with 30 heads, 0.9 with femurs; more doubt than that makes ears fuller, and errors
/// in other places. (1, 2.4, 4, 6 on six single views of faces, then on 32 others, means: from the true missing
/// part to the completed one 2.06, 1.93, 1.83, 1.83 mm, then 2.60, 2.54, 2.51, 2.49; from the inferred part to the true one
/// 1.82, 1.85, 1.90, 1.95, then 2.52, 2.58, 2.67, 2.74.)
const UNEXPLAINED: f32 = 4.0;
/// ε, voxels: about the deviation of places within a voxel.
const EDGE: f32 = 0.3;
/// 3⁹: B's nine box means are over three voxels each. That is about as wide as an ear is away from the head.
const WINDOW: f32 = 19_683.0;
/// Levels that are tried: the first one, and how far apart, voxels. (Up to 3 voxels instead of 1: blobs where the tip of an
/// ear may be anywhere, the inferred part 0.02 mm farther from the truth.)
const LEVELS: usize = 9;
const LOWEST: f32 = -1.0;
const STEP: f32 = 0.25;
/// Least share of the neighbourhood that is expected inside and has a level.
const LEAST: f32 = 4e-4;
/// Farthest from the zero level that a voxel counts, voxels: nobody's surface is expected there.
const FARTHEST: f32 = 6.0;

/// Takes from the distances the level that has the expected volume; `deviations` are those of the distances, NaN where
/// unknown, and `measured` tells the voxels that stay.
pub fn level(field: &mut Dense, deviations: &[f32], measured: &[bool]) {
    let counts = |&i: &usize| !(field.values[i] + deviations[i]).is_nan();
    let counted: Vec<usize> = (0..field.values.len()).filter(counts).collect();
    let volumes = |share: &dyn Fn(usize) -> f32| {
        let mut volumes = vec![0.0; field.values.len()];
        counted.iter().for_each(|&i| volumes[i] = share(i));
        means(&mut volumes, field.sides);
        volumes
    };
    let doubt = |i: usize| libm::hypotf(EDGE, UNEXPLAINED * deviations[i]);
    let expected = volumes(&|i| below(-field.values[i] / doubt(i)));
    let tau = |level: usize| LOWEST + STEP * level as f32;
    let tried: Vec<Vec<f32>> =
        (0..LEVELS).into_par_iter().map(|l| volumes(&|i| below((tau(l) - field.values[i]) / EDGE))).collect();
    let (mut levels, mut weights) = (vec![0.0; field.values.len()], vec![0.0; field.values.len()]);
    for &i in counted.iter().filter(|&&i| expected[i] >= LEAST) {
        let (level, surface) = reached(expected[i], |l| tried[l][i]);
        weights[i] = surface;
        levels[i] = if measured[i] { 0.0 } else { surface * level };
    }
    means(&mut levels, field.sides);
    means(&mut weights, field.sides);
    for &i in counted.iter().filter(|&&i| !measured[i] && weights[i] > 0.0) {
        field.values[i] -= levels[i] / weights[i];
    }
}

/// Deviations of the distances near the zero level, NaN elsewhere; beyond the stored voxels those of the nearest ones.
pub fn deviations(field: &Dense, posterior: &Posterior<'_>) -> Vec<f32> {
    let near = |i: usize| field.values[i].abs() <= FARTHEST;
    let deviation = |i: usize| {
        let place = field.voxel(i).map(|v| v as f32);
        near(i).then(|| posterior.of_distance(place)).flatten().unwrap_or(f32::NAN)
    };
    let all = (0..field.values.len()).into_par_iter().with_min_len(256);
    let mut deviations: Vec<f32> = all.map(deviation).collect();
    let unknown = |i: &usize| near(*i) && deviations[*i].is_nan();
    let mut unknown: Vec<usize> = (0..deviations.len()).filter(unknown).collect();
    loop {
        let grown = |&i: &usize| Some((i, field.mean_beside(i, &deviations)?));
        let grown: Vec<(usize, f32)> = unknown.par_iter().filter_map(grown).collect();
        if grown.is_empty() {
            return deviations;
        }
        grown.into_iter().for_each(|(i, deviation)| deviations[i] = deviation);
        unknown.retain(|&i| deviations[i].is_nan());
    }
}

/// The level whose volume is the expected one, and by how much the volume grows there from one level to the next: as
/// much as there is surface.
fn reached(expected: f32, volume: impl Fn(usize) -> f32) -> (f32, f32) {
    let above = (1..LEVELS - 1).find(|&l| volume(l) >= expected).unwrap_or(LEVELS - 1);
    let grown = volume(above) - volume(above - 1);
    let level = above as f32 - (volume(above) - expected) / grown.max(f32::MIN_POSITIVE);
    (LOWEST + STEP * level.clamp(0.0, (LEVELS - 1) as f32), grown)
}

/// The normal distribution function.
fn below(z: f32) -> f32 {
    0.5 * libm::erfcf(-z * std::f32::consts::FRAC_1_SQRT_2)
}

/// B: box means of three voxels along the axes, taken three times; outside of the grid there is nothing.
fn means(values: &mut [f32], sides: [usize; 3]) {
    let mut before = values.to_vec();
    for _ in 0..3 {
        let mut step = 1;
        for side in sides {
            before.copy_from_slice(values);
            for (from, to) in before.chunks(step * side).zip(values.chunks_mut(step * side)) {
                add(&mut to[step..], from);
                add(to, &from[step..]);
            }
            step *= side;
        }
    }
    values.iter_mut().for_each(|value| *value /= WINDOW);
}

/// Adds what both have.
fn add(to: &mut [f32], from: &[f32]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to += from);
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: usize = 20;

    fn field(value: impl Fn([f32; 3]) -> f32) -> Dense {
        let values = (0..N * N * N).map(|i| value([i % N, i / N % N, i / N / N].map(|v| v as f32 - 9.5)));
        Dense { sides: [N; 3], values: values.collect() }
    }

    /// Voxels inside, with those on the surface counted in part.
    fn volume(field: &Dense) -> f32 {
        field.values.iter().map(|v| (0.5 - v).clamp(0.0, 1.0)).sum()
    }

    #[test]
    fn without_doubt_nothing_moves_and_measured_voxels_never_do() {
        let ball = |[x, y, z]: [f32; 3]| (x * x + y * y + z * z).sqrt() - 5.0;
        let before = field(ball);
        let mut sure = field(ball);
        level(&mut sure, &[0.0; N * N * N], &[false; N * N * N]);
        let moved = before.values.iter().zip(&sure.values).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(moved < 1e-3, "{moved}");
        let mut measured = field(ball);
        level(&mut measured, &[1.0; N * N * N], &[true; N * N * N]);
        assert_eq!(before.values, measured.values);
    }

    #[test]
    fn a_sheet_that_may_lie_here_or_there_does_not_vanish() {
        // Sheets 1.2 voxels thick at any of eleven places, two voxels apart at most from the one in the middle.
        let places: Vec<f32> = (-5..=5).map(|p| 0.4 * p as f32).collect();
        let at = |z: f32, place: f32| (z - place).abs() - 0.6;
        let mean = |z: f32| places.iter().map(|&p| at(z, p)).sum::<f32>() / places.len() as f32;
        let deviation = |z: f32| {
            let squares: f32 = places.iter().map(|&p| (at(z, p) - mean(z)).powi(2)).sum();
            (squares / places.len() as f32).sqrt() / UNEXPLAINED
        };
        let mut sheet = field(|[_, _, z]| mean(z));
        assert_eq!(sheet.values.iter().filter(|v| **v < 0.0).count(), 0, "gone");
        level(&mut sheet, &field(|[_, _, z]| deviation(z)).values, &[false; N * N * N]);
        let (found, wanted) = (volume(&sheet), 1.2 * (N * N) as f32);
        assert!((found / wanted - 1.0).abs() < 0.35, "{found} {wanted}");
    }

    #[test]
    fn thick_parts_hardly_move_and_unknown_voxels_stay_unknown() {
        let half = |[_, _, z]: [f32; 3]| if z < -8.0 { f32::NAN } else { z - 0.3 };
        let (before, mut after) = (field(half), field(half));
        level(&mut after, &[1.0 / UNEXPLAINED; N * N * N], &[false; N * N * N]);
        for i in 0..N * N * N {
            assert_eq!(before.values[i].is_nan(), after.values[i].is_nan());
            let [x, y, _] = before.voxel(i);
            let near = before.values[i].abs() < 1.0 && [x, y].iter().all(|v| (5..N - 5).contains(v));
            let moved = before.values[i] - after.values[i];
            assert!(!near || moved.abs() < 0.1, "{i}: {moved} at {}", before.values[i]);
        }
    }

    #[test]
    fn means_of_a_constant_are_that_constant_inside() {
        let mut values = vec![2.0; N * N * N];
        means(&mut values, [N; 3]);
        assert!((values[(9 * N + 9) * N + 9] - 2.0).abs() < 1e-5 && values[0] < 1.9);
    }
}
