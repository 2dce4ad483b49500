//! ICP with scale between two meshes: closest points both ways, then the similarity that minimises their
//! squared distance (paper, section 3.1; closed form of Umeyama 1991). Pairs across a border or between
//! surfaces that face different ways are left out; taking both directions keeps the scale from shrinking.

use crate::distance::Surface;
use crate::mesh::{Point, Vector};
use crate::points::OrientedPoints;
use nalgebra::{Matrix3, Rotation3, Similarity3, Translation3, UnitQuaternion};
use rayon::prelude::*;

/// One side of a registration.
pub struct Side {
    /// Its surface.
    pub surface: Surface,
    /// Points on it.
    pub points: OrientedPoints,
}

/// What an ICP ended with.
#[derive(Clone, Copy, Debug)]
pub struct Outcome {
    /// From the moving side to the fixed one.
    pub motion: Similarity3<f64>,
    /// Median distance of the pairs, in the fixed side's unit.
    pub median: f64,
    /// Share of the points of both sides that found a partner.
    pub overlap: f64,
}

/// Refines `start`, a motion from `moving` to `fixed`.
pub fn icp(moving: &Side, fixed: &Side, start: Similarity3<f64>, iterations: usize, size: f64) -> Outcome {
    let mut motion = start;
    let mut outcome = Outcome { motion, median: f64::INFINITY, overlap: 0.0 };
    let mut gate = 0.1 * size;
    for _ in 0..iterations {
        let mut pairs = half(&moving.points, &fixed.surface, &motion, gate);
        let back = half(&fixed.points, &moving.surface, &motion.inverse(), gate / motion.scaling());
        pairs.extend(back.into_iter().map(|(f, m)| (m, f)));
        let total = moving.points.points.len() + fixed.points.points.len();
        let overlap = pairs.len() as f64 / total.max(1) as f64;
        let mut lengths: Vec<f64> = pairs.iter().map(|(m, f)| (motion * m - f).norm()).collect();
        lengths.sort_by(f64::total_cmp);
        let median = lengths.get(lengths.len() / 2).copied().unwrap_or(f64::INFINITY);
        outcome = Outcome { motion, median, overlap };
        gate = (4.0 * median).clamp(0.005 * size, 0.1 * size);
        match similarity(&pairs) {
            Some(next) => motion = next,
            None => break,
        }
    }
    outcome
}

/// Pairs (point, its partner on `surface`), each in its own side's frame.
fn half(
    points: &OrientedPoints,
    surface: &Surface,
    motion: &Similarity3<f64>,
    gate: f64,
) -> Vec<(Point, Point)> {
    let partner = |(point, normal): (&Point, &Vector)| {
        let found = surface.distance(&(motion * point), gate)?;
        let facing = found.normal.dot(&(motion.isometry.rotation * normal)) > 0.5 * found.normal.norm();
        (facing && !found.on_border).then_some((*point, found.closest))
    };
    points.points.par_iter().zip(&points.normals).filter_map(partner).collect()
}

/// The similarity that takes the first points of the pairs to the second ones.
pub fn similarity(pairs: &[(Point, Point)]) -> Option<Similarity3<f64>> {
    if pairs.len() < 8 {
        return None;
    }
    let n = pairs.len() as f64;
    let mean = |pick: fn(&(Point, Point)) -> &Point| {
        pairs.iter().fold(Vector::zeros(), |sum, pair| sum + pick(pair).coords) / n
    };
    let (from, to) = (mean(|p| &p.0), mean(|p| &p.1));
    let mut covariance = Matrix3::zeros();
    let (mut spread_from, mut spread_to) = (0.0, 0.0);
    for (p, q) in pairs {
        let (a, b) = (p.coords - from, q.coords - to);
        covariance += b * a.transpose();
        spread_from += a.norm_squared();
        spread_to += b.norm_squared();
    }
    let svd = covariance.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mut sign = Matrix3::identity();
    sign[(2, 2)] = (u * v_t).determinant().signum();
    let rotation = Rotation3::from_matrix_unchecked(u * sign * v_t);
    // The ratio of spreads treats both sides alike; the least squares scale would shrink with noise.
    let scale = (spread_to / spread_from).sqrt();
    let translation = to - rotation * from * scale;
    let usable = scale.is_finite() && scale > 0.0 && translation.iter().all(|t| t.is_finite());
    let turn = UnitQuaternion::from_rotation_matrix(&rotation);
    usable.then(|| Similarity3::from_parts(Translation3::from(translation), turn, scale))
}
