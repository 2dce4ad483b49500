//! How near two surfaces lie to each other as they are: closest points both ways. Pairs across a border or between surfaces
//! that face different ways are left out.

use crate::distance::Surface;
use crate::points::OrientedPoints;
use crate::quantile::median;
use rayon::prelude::*;

/// One of two surfaces.
pub struct Side {
    /// Itself.
    pub surface: Surface,
    /// Points on it.
    pub points: OrientedPoints,
}

/// How near they lie.
#[derive(Clone, Copy, Debug)]
pub struct Partners {
    /// Median distance of the pairs; infinite without any.
    pub median: f64,
    /// Share of the points of both sides that found a partner.
    pub overlap: f64,
}

/// The points of either side that have a partner on the other within `gate`.
pub fn partners(a: &Side, b: &Side, gate: f64) -> Partners {
    let mut distances = distances(&a.points, &b.surface, gate);
    distances.extend(self::distances(&b.points, &a.surface, gate));
    let total = a.points.points.len() + b.points.points.len();
    let overlap = distances.len() as f64 / total.max(1) as f64;
    Partners { median: median(distances).unwrap_or(f64::INFINITY), overlap }
}

fn distances(points: &OrientedPoints, surface: &Surface, gate: f64) -> Vec<f64> {
    let distance = |(i, point)| {
        let found = surface.distance(point, gate)?;
        let facing = found.normal.dot(&points.normals[i]) > 0.5 * found.normal.norm();
        (facing && !found.on_border).then(|| (point - found.closest).norm())
    };
    points.points.par_iter().enumerate().filter_map(distance).collect()
}
