//! Pairs of oriented points and the four relations that a rigid motion keeps: distance, two angles between
//! the normals and the line, and the torsion about it (Winkelbach, Molkenstruck & Wahl 2006, WMW06).
//! The torsion has a sign: a mirrored surface has other relations.

use crate::mesh::{Point, Vector};
use crate::points::OrientedPoints;
use rayon::prelude::*;

/// Bins of half a turn for the two angles.
const ANGLE_BINS: f64 = 12.0;
/// Bins of a full turn for the torsion.
const TORSION_BINS: f64 = 18.0;

/// Two oriented points.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// Positions.
    pub points: [Point; 2],
    /// Unit normals.
    pub normals: [Vector; 2],
}

impl Pair {
    /// Points `i` and `j` of a set.
    pub fn of(set: &OrientedPoints, i: usize, j: usize) -> Self {
        Self { points: [set.points[i], set.points[j]], normals: [set.normals[i], set.normals[j]] }
    }

    /// Distance, angles and torsion; `None` where the torsion is undefined.
    fn relations(&self) -> Option<[f64; 4]> {
        let line = self.points[1] - self.points[0];
        let distance = line.norm();
        let u = line.try_normalize(1e-9)?;
        let [n1, n2] = self.normals;
        let (a, b) = (n1.cross(&u), n2.cross(&u));
        if a.norm() < 0.2 || b.norm() < 0.2 {
            return None;
        }
        let torsion = libm::atan2(u.dot(&a.cross(&b)), a.dot(&b));
        Some([
            distance,
            libm::acos(n1.dot(&u).clamp(-1.0, 1.0)),
            libm::acos(n2.dot(&u).clamp(-1.0, 1.0)),
            torsion,
        ])
    }

    /// The bin of the relations, for distances in units of `width`.
    pub fn key(&self, width: f64) -> Option<u32> {
        use std::f64::consts::{PI, TAU};
        let [distance, a, b, torsion] = self.relations()?;
        let bin = |x: f64, bins: f64| (x * bins).floor().clamp(0.0, bins - 1.0) as u32;
        let torsion = bin((torsion + PI) / TAU, TORSION_BINS);
        let angles = bin(a / PI, ANGLE_BINS) * ANGLE_BINS as u32 + bin(b / PI, ANGLE_BINS);
        let distance = (distance / width) as u32;
        Some((distance * (ANGLE_BINS * ANGLE_BINS) as u32 + angles) * TORSION_BINS as u32 + torsion)
    }

    /// The frame of the pair: origin halfway, x along the line, z along the mean normal as far as possible.
    pub fn frame(&self) -> Option<(Point, nalgebra::Rotation3<f64>)> {
        let x = (self.points[1] - self.points[0]).try_normalize(1e-9)?;
        let mean = self.normals[0] + self.normals[1];
        let z = (mean - x * mean.dot(&x)).try_normalize(1e-6)?;
        let basis = nalgebra::Matrix3::from_columns(&[x, z.cross(&x), z]);
        let middle = nalgebra::center(&self.points[0], &self.points[1]);
        Some((middle, nalgebra::Rotation3::from_matrix_unchecked(basis)))
    }
}

/// All pairs of a set by their relations.
pub struct Table {
    width: f64,
    reach: [f64; 2],
    entries: Vec<(u32, u16, u16)>,
}

impl Table {
    /// The table of a set's pairs that are at least `nearest` apart. Each is listed one way round: who draws pairs at
    /// random draws the other way round just as often.
    pub fn new(set: &OrientedPoints, nearest: f64, width: f64) -> Self {
        let count = set.points.len().min(usize::from(u16::MAX));
        let pairs = |i: usize| {
            let others = (0..i).filter(move |&j| (set.points[i] - set.points[j]).norm() > nearest);
            others.filter_map(move |j| Some((Pair::of(set, i, j).key(width)?, i as u16, j as u16)))
        };
        let mut entries: Vec<(u32, u16, u16)> = (0..count).into_par_iter().flat_map_iter(pairs).collect();
        entries.par_sort_unstable();
        let length =
            |&(_, i, j): &(u32, u16, u16)| (set.points[usize::from(i)] - set.points[usize::from(j)]).norm();
        let farthest = entries.iter().map(length).fold(0.0, f64::max);
        Self { width, reach: [nearest, farthest], entries }
    }

    /// Whether a pair can be in the table.
    pub fn reaches(&self, pair: &Pair) -> bool {
        let distance = (pair.points[1] - pair.points[0]).norm();
        self.reach[0] <= distance && distance <= self.reach[1]
    }

    /// The pairs with the relations of `pair`.
    pub fn matches(&self, pair: &Pair) -> &[(u32, u16, u16)] {
        let Some(key) = pair.key(self.width) else { return &[] };
        let from = self.entries.partition_point(|entry| entry.0 < key);
        let length = self.entries[from..].partition_point(|entry| entry.0 == key);
        &self.entries[from..from + length]
    }
}
