//! Finds where the local fit diverged: it is farther off the very points it was fitted to than the global fit,
//! which it started from.
//!
//! A node that only a few voxels at the end of the stored ones tell about may run off to distances of many voxels, of
//! either sign, and bulge or tear the surface around it.

use super::dense::Dense;
use crate::mesh::{Point, Vector};
use rayon::prelude::*;

/// By how much farther off a measured voxel's distance the local fit must be than the global one, voxels. Where it
/// converged it is nearer, but for a fraction of a voxel.
const MISS: f32 = 0.5;
/// How far the scan's distance may be from the global fit's to be taken, voxels: farther off it may be something else
/// (a collar), and the surface would tear on its way there.
const FAR: f32 = 1.5;
/// Most by which distances of voxels with a common face may differ, voxels: by one, and rounding.
const STEEPEST: f32 = 1.1;

/// Marks the voxels at most `reach` steps along each axis off a measured one at which `local` misses `scan`, the scan's
/// own distance at a voxel where it has one. Measured voxels among them take that distance; those without it, or far
/// off the `global` fit, are no longer measured. A distance that those beside it contradict tells nothing.
pub fn diverged(
    local: &mut Dense,
    global: &Dense,
    measured: &mut [bool],
    reach: usize,
    scan: impl Fn(usize) -> Option<f32> + Sync,
) -> Vec<bool> {
    let sound = |i: usize| sound(local, i, &scan);
    let misses = |i: usize, own: f32| (local.values[i] - own).abs() > (global.values[i] - own).abs() + MISS;
    // The closest points around a voxel are asked for last, and only where it matters.
    let missed = |&i: &usize| measured[i] && scan(i).is_some_and(|own| misses(i, own)) && sound(i).is_some();
    let missed: Vec<usize> = (0..measured.len()).into_par_iter().filter(missed).collect();
    let places: Vec<Point> =
        missed.into_iter().map(|i| Point::from(Vector::from(local.voxel(i).map(|v| v as f64)))).collect();
    let around = local.mark(&places, reach, |_, _| true);
    let near = |own: &f32, i: usize| (own - global.values[i]).abs() <= FAR;
    let taken = |i: usize| match (scan(i), sound(i)) {
        (Some(_), None) => Some(local.values[i]),
        (_, own) => own.filter(|own| near(own, i)),
    };
    let taken: Vec<(usize, Option<f32>)> =
        (0..around.len()).filter(|&i| around[i] && measured[i]).map(|i| (i, taken(i))).collect();
    for (i, own) in taken {
        measured[i] = own.is_some();
        local.values[i] = own.unwrap_or(local.values[i]);
    }
    around
}

/// A scan's distance at a voxel of a grid, unless those beside it contradict it.
pub fn sound(grid: &Dense, i: usize, scan: impl Fn(usize) -> Option<f32>) -> Option<f32> {
    scan(i).filter(|own| !contradicted(*own, || grid.neighbours(i).filter_map(&scan)))
}

/// Whether a scan's distance has the wrong sign: more of those beside it speak against it than against its opposite. Where
/// triangles are folded over, the nearest one may face the wrong way.
fn contradicted<I: Iterator<Item = f32>>(own: f32, beside: impl Fn() -> I) -> bool {
    let against = |own: f32| beside().filter(|other| (own - other).abs() > STEEPEST).count();
    against(own) > against(-own)
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: usize = 16;

    #[test]
    fn around_a_miss_the_scan_is_taken_and_elsewhere_the_fit_stays() {
        let height = |i: usize| (i / N / N) as f32 - 7.5;
        let miss = 8 * N * N + 8 * N + 8;
        let mut fit = Dense { sides: [N; 3], values: (0..N * N * N).map(|i| height(i) + 0.2).collect() };
        let global = Dense { sides: [N; 3], values: (0..N * N * N).map(|i| height(i) - 1.3).collect() };
        fit.values[miss] = -9.0;
        let before = fit.values.clone();
        let mut measured: Vec<bool> = (0..N * N * N).map(|i| height(i).abs() < 1.0).collect();
        // Beside the miss the scan ends on one side, and is something else on the other.
        let own = |i: usize| match i {
            _ if i == miss + 1 => None,
            _ if i % N < 8 => Some(height(i) + 3.0),
            _ => Some(height(i)),
        };
        let around = diverged(&mut fit, &global, &mut measured, 2, own);
        assert_eq!(around.iter().filter(|around| **around).count(), 125);
        assert_eq!((fit.values[miss], fit.values[miss + 2]), (height(miss), height(miss)));
        assert!(measured[miss] && !measured[miss + 1] && !measured[miss - 1]);
        assert_eq!(fit.values[miss - 1], before[miss - 1]);
        let untouched = |&i: &usize| !around[i] || height(i).abs() > 1.0;
        assert!((0..N * N * N).filter(untouched).all(|i| fit.values[i] == before[i]));
    }

    #[test]
    fn a_distance_of_the_wrong_sign_is_no_miss_and_is_not_taken() {
        let height = |i: usize| (i / N / N) as f32 - 7.5;
        let folded = 9 * N * N + 8 * N + 8;
        let own = |i: usize| Some(if i == folded { -height(i) } else { height(i) });
        let fields = || {
            let local = Dense { sides: [N; 3], values: (0..N * N * N).map(|i| height(i) + 0.2).collect() };
            let global = Dense { sides: [N; 3], values: (0..N * N * N).map(|i| height(i) - 0.8).collect() };
            let measured: Vec<bool> = (0..N * N * N).map(|i| height(i).abs() < 2.0).collect();
            (local, global, measured)
        };
        let (mut local, global, mut measured) = fields();
        assert!(!diverged(&mut local, &global, &mut measured, 2, own).contains(&true));
        // Next to a real miss it stays as it was fitted, and measured.
        let (mut local, global, mut measured) = fields();
        local.values[folded - 1] = -9.0;
        assert!(diverged(&mut local, &global, &mut measured, 2, own)[folded]);
        assert_eq!((local.values[folded - 1], local.values[folded]), (1.5, 1.7));
        assert!(measured[folded]);
    }

    #[test]
    fn the_sign_that_fits_the_neighbours_better_is_right() {
        // Beside a fold on the neck of a real head, voxels: half of the neighbours allow either sign.
        let beside = || [-0.25, -1.06, -0.03, -1.43, -1.32, -0.12].into_iter();
        assert!(contradicted(0.73, beside) && !contradicted(-0.73, beside));
        assert!(!contradicted(0.2, std::iter::empty));
    }

    #[test]
    fn a_fit_that_converged_is_left_alone() {
        let mut fit = Dense { sides: [N; 3], values: vec![0.5; N * N * N] };
        let global = Dense { sides: [N; 3], values: vec![1.5; N * N * N] };
        let mut measured = vec![true; N * N * N];
        let around = diverged(&mut fit, &global, &mut measured, 2, |i| (i % 2 == 0).then_some(0.0));
        assert!(around.iter().all(|around| !around) && measured.iter().all(|measured| *measured));
        assert!(fit.values.iter().all(|value| *value == 0.5));
    }
}
