//! Between measured places the local fit follows its wide neighbourhood: its deviation from the global fit is
//! diffused there.
//!
//! Weights of nodes at the scan's border answer to little and swing, and thin parts (ears, lips) turn every swing
//! into spikes and steps; their deviation from the global fit varies quickly, that of well measured places does not.
//! So δ = local - global is kept at voxels next to points and becomes elsewhere the solution of
//!
//! ```text
//! (h + (1 - h) c) δ = h δ₀ + (1 - h) Σ cᵢ δᵢ / 6,    c = Σ cᵢ / 6,    cᵢ = max(0, n·nᵢ)⁴
//! ```
//!
//! over its six neighbours, δ₀ being the deviation as it was fitted and n the global fit's direction outward: a membrane
//! through the measured deviations that forgets δ₀'s waves shorter than some 1/√(6 h) voxels. It goes along the surface
//! and not through it: an ear whose measured front lies farther back has its back farther back as well, which is the
//! opposite deviation.

use super::behind::{self, Deep};
use super::dense::Dense;
use super::diverged::{diverged, sound};
use crate::mesh::Point;
use rayon::prelude::*;

/// A voxel this near to a point is measured, voxels. (0.5, 0.7, 0.9, 1.2 on the nine scans of faces: seen part 0.34,
/// 0.25, 0.23, 0.23 mm, missing part 2.31 to 2.32.)
const NEAR: f64 = 0.9;
/// The fitted deviation's share h: a membrane two voxels long. (0.05, 0.1, 0.2: missing part of three stitched scans 1.24,
/// 1.21, 1.21 mm, but with 0.1 and more a head of ten thousand vertices, whose points are two voxels apart, keeps pits.)
const HOLD: f32 = 0.05;
/// Jacobi iterations: what is left of a wave of δ after them is less than (1 - h)^40, an eighth.
const ROUNDS: usize = 40;

/// Diffuses the deviation of `local` from `global` out of the measured voxels; `points` are the scan's, in voxels.
/// `scan` tells its own distance at a voxel, where it has one. It is taken at measured voxels around what is `behind` the
/// fit, to which the deviations beside are drawn. Where the fit diverged, which a node spreads over
/// `reach` voxels, measured voxels take that and all others nothing of what was fitted. Returns which voxels are measured.
pub fn diffuse(
    local: &mut Dense,
    global: &Dense,
    points: &[Point],
    reach: usize,
    behind: &[Deep],
    scan: impl Fn(usize) -> Option<f32> + Sync,
) -> Vec<bool> {
    let mut measured = local.mark(points, 1, |voxel, point| (voxel - point).norm() <= NEAR);
    let diverged = diverged(local, global, &mut measured, reach, &scan);
    let deviation = |(i, (l, g)): (usize, (&f32, &f32))| {
        // Not simply zero: where one of both is unknown, so is the deviation.
        if diverged[i] && !measured[i] { (l - g) * 0.0 } else { l - g }
    };
    let mut fitted: Vec<f32> = local.values.iter().zip(&global.values).enumerate().map(deviation).collect();
    for (i, deviation) in behind::drawn(local, &fitted, behind) {
        // A measured voxel that the fit has followed stays; what is not measured follows those that are.
        if measured[i] && f64::from((deviation - fitted[i]).abs()) <= behind::FOLLOWED {
            continue;
        }
        fitted[i] = deviation;
        let own = sound(local, i, &scan).filter(|_| measured[i]);
        measured[i] = own.is_some();
        if let Some(own) = own {
            (local.values[i], fitted[i]) = (own, own - global.values[i]);
        }
    }
    let hold = |i: usize| if diverged[i] { 0.0 } else { HOLD };
    let free: Vec<usize> = (0..fitted.len()).filter(|&i| !fitted[i].is_nan() && !measured[i]).collect();
    let deviations = relaxed(global, &fitted, &free, hold);
    free.iter().for_each(|&i| local.values[i] = global.values[i] + deviations[i]);
    measured
}

/// Deviations from `global` after some rounds in which each `free` voxel takes the mean of those beside it, and is held by
/// what was `fitted` there by a share of `hold`.
fn relaxed(global: &Dense, fitted: &[f32], free: &[usize], hold: impl Fn(usize) -> f32 + Sync) -> Vec<f32> {
    let directions: Vec<[f32; 3]> = (0..fitted.len()).into_par_iter().map(|i| global.direction(i)).collect();
    let way = |i: usize, near: Option<usize>| match near.filter(|&j| !fitted[j].is_nan()) {
        Some(j) => (j, conductance(&directions[i], &directions[j])),
        None => (i, 0.0),
    };
    let ways = |&i: &usize| global.beside(i).map(|near| way(i, near));
    let ways: Vec<[(usize, f32); 6]> = free.par_iter().map(ways).collect();
    let mut deviations = fitted.to_vec();
    for _ in 0..ROUNDS {
        let next = |(&i, ways): (&usize, &[(usize, f32); 6])| {
            let sums =
                |(sum, share): (f32, f32), &(j, c): &(usize, f32)| (sum + c * deviations[j], share + c);
            let (sum, share) = ways.iter().fold((0.0, 0.0), sums);
            let (held, along) = (6.0 * hold(i), 1.0 - hold(i));
            let whole = held + along * share;
            if whole > 0.0 { (held * fitted[i] + along * sum) / whole } else { fitted[i] }
        };
        let next: Vec<f32> = free.par_iter().zip(&ways).map(next).collect();
        free.iter().zip(next).for_each(|(&i, deviation)| deviations[i] = deviation);
    }
    deviations
}

/// How well a deviation goes from one voxel to the next: fully along a surface, not at all through a thin part.
fn conductance(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    let cosine = a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>().max(0.0);
    (cosine * cosine) * (cosine * cosine)
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: usize = 24;

    fn field(value: impl Fn([usize; 3]) -> f32) -> Dense {
        let values = (0..N * N * N).map(|i| value([i % N, i / N % N, i / N / N])).collect();
        Dense { sides: [N; 3], values }
    }

    #[test]
    fn measured_deviations_stay_and_waves_between_them_vanish() {
        let global = field(|[_, _, z]| z as f32 - 11.5);
        let deviation = |[x, y, _]: [usize; 3]| if x < 8 { 0.5 } else { 0.5 - ((x + y) % 2) as f32 };
        let mut local = field(|at| global.values[at[2] * N * N] + deviation(at));
        let points: Vec<Point> =
            (0..8 * N).map(|i| Point::new((i % 8) as f64, (i / 8) as f64, 11.5)).collect();
        let before = local.values.clone();
        diffuse(&mut local, &global, &points, 5, &[], |_| None);
        let at = |x: usize, y: usize| (11 * N + y) * N + x;
        (0..8).for_each(|x| assert_eq!(local.values[at(x, 12)], before[at(x, 12)]));
        let deviations: Vec<f32> =
            (8..N - 1).map(|x| local.values[at(x, 12)] - global.values[at(x, 12)]).collect();
        let steps = deviations.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f32::max);
        assert!(steps < 0.2, "{deviations:?}");
        // The measured half a voxel fades within a few voxels into the fitted mean, which is zero.
        assert!(deviations[0] > 0.25 && deviations[14].abs() < 0.15, "{deviations:?}");
    }

    #[test]
    fn the_back_of_a_thin_part_does_not_follow_its_front() {
        // A sheet two voxels thick, whose front was measured half a voxel farther back than expected.
        let sheet = |middle: f32| field(move |[_, _, z]| (z as f32 - middle).abs() - 1.0);
        let (global, mut local) = (sheet(11.5), sheet(11.0));
        let points: Vec<Point> =
            (0..N * N).map(|i| Point::new((i % N) as f64, (i / N) as f64, 12.0)).collect();
        diffuse(&mut local, &global, &points, 5, &[], |_| None);
        let back = |field: &Dense| {
            let at = |z: usize| field.values[(z * N + 12) * N + 12];
            let z = (2..12).rev().find(|&z| at(z) >= 0.0).expect("a back");
            z as f32 + at(z) / (at(z) - at(z + 1))
        };
        assert!((back(&local) - 10.0).abs() < 0.2, "{}", back(&local));
        assert_eq!(back(&global), 10.5);
    }

    #[test]
    fn unknown_voxels_stay_unknown() {
        let mut local = field(|[x, ..]| if x == 5 { f32::NAN } else { x as f32 });
        let global = field(|[x, ..]| if x == 5 { f32::NAN } else { 0.9 * x as f32 });
        diffuse(&mut local, &global, &[], 5, &[], |_| None);
        assert!((0..N * N * N).all(|i| local.values[i].is_nan() == (i % N == 5)));
    }
}
