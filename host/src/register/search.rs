//! Coarse registration: the scale loop of the paper's section 3.1 around a random search over point pairs.
//!
//! Matching quality is the number of inliers in an ε-neighbourhood times f², because shrinking a scan always
//! finds more of them. The inlier test is one look-up in the distance grid.

use super::field::Field;
use super::pairs::{Pair, Table};
use crate::mesh::{Point, Vector};
use crate::points::OrientedPoints;
use nalgebra::Rotation3;
use rand::RngExt;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// A guess at the pose: q = scale · rotation · p + translation.
#[derive(Clone, Copy, Debug)]
pub struct Candidate {
    /// From the scan's directions to the field's.
    pub rotation: Rotation3<f64>,
    /// Voxels per scan unit.
    pub scale: f64,
    /// Voxels.
    pub translation: Vector,
    /// Inlier share times f².
    pub quality: f64,
}

impl Candidate {
    /// Where a scan point lies.
    pub fn apply(&self, p: &Point) -> Point {
        Point::from(self.rotation * p.coords * self.scale + self.translation)
    }
}

/// How to search.
#[derive(Clone, Copy, Debug)]
pub struct Search {
    /// Seed of the random draws.
    pub seed: u64,
    /// Voxels per scan unit if the scan had exactly the class's mean size.
    pub unit_scale: f64,
    /// Pairs drawn for each scale factor.
    pub draws: usize,
    /// Candidates returned at most.
    pub candidates: usize,
}

/// Scale factors of the loop.
const FACTORS: [f64; 10] = [0.8, 0.85, 0.9, 0.95, 1.0, 1.05, 1.1, 1.15, 1.2, 1.25];
/// Matches tried for one drawn pair.
const TRIES: usize = 12;
/// Points of the first, quick test.
const GLANCE: usize = 32;
/// Inlier distance, share of the size (5 mm of a face).
const EPSILON: f64 = 5.0 / 230.0;

/// The best candidates, best first; distinct ones only. The same for any number of threads.
pub fn search(field: &Field, scan: &OrientedPoints, settings: &Search) -> Vec<Candidate> {
    let table = Table::new(&field.samples, field.size);
    let mut all: Vec<Candidate> = FACTORS
        .par_iter()
        .enumerate()
        .flat_map_iter(|(index, &factor)| one_scale(field, &table, scan, settings, index as u64, factor))
        .collect();
    all.sort_by(|a, b| b.quality.total_cmp(&a.quality));
    distinct(&all, field.size, settings.candidates)
}

fn one_scale(
    field: &Field,
    table: &Table,
    scan: &OrientedPoints,
    settings: &Search,
    stream: u64,
    factor: f64,
) -> Vec<Candidate> {
    let count = scan.points.len();
    let mut random = ChaCha8Rng::seed_from_u64(settings.seed);
    random.set_stream(stream);
    let scale = settings.unit_scale * factor;
    let order = spread(count, &mut random);
    let mut best: Vec<Candidate> = Vec::new();
    for _ in 0..settings.draws {
        let (i, j) = (random.random_range(0..count), random.random_range(0..count));
        let mut pair = Pair::of(scan, i, j);
        pair.points = pair.points.map(|p| p * scale);
        if (pair.points[1] - pair.points[0]).norm() < table.nearest() {
            continue;
        }
        let matches = table.matches(&pair);
        for _ in 0..TRIES.min(matches.len()) {
            let (_, a, b) = matches[random.random_range(0..matches.len())];
            let goal = Pair::of(&field.samples, usize::from(a), usize::from(b));
            let Some(mut candidate) = align(&pair, &goal, scale) else { continue };
            let worst = if best.len() < settings.candidates { 0.0 } else { best[best.len() - 1].quality };
            candidate.quality = quality(field, scan, &order, &candidate, factor, worst);
            if candidate.quality > worst {
                let at = best.partition_point(|other| other.quality >= candidate.quality);
                best.insert(at, candidate);
                best.truncate(settings.candidates);
            }
        }
    }
    best
}

/// A random order of the points: every beginning of it is a sample of the whole.
fn spread(count: usize, random: &mut ChaCha8Rng) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    for i in (1..count).rev() {
        order.swap(i, random.random_range(0..=i));
    }
    order
}

/// The motion that takes a scaled pair to its match.
fn align(from: &Pair, to: &Pair, scale: f64) -> Option<Candidate> {
    let ((a, frame_a), (b, frame_b)) = (from.frame()?, to.frame()?);
    let rotation = frame_b * frame_a.inverse();
    let translation = b.coords - rotation * a.coords;
    Some(Candidate { rotation, scale, translation, quality: 0.0 })
}

/// Inlier share times f²; given up early where it cannot reach `worst` any more.
fn quality(
    field: &Field,
    scan: &OrientedPoints,
    order: &[usize],
    candidate: &Candidate,
    factor: f64,
    worst: f64,
) -> f64 {
    let reach = (EPSILON * field.size) as f32;
    let count = order.len().min(400);
    let mut inliers = 0;
    for (seen, &i) in order.iter().take(count).enumerate() {
        let normal = candidate.rotation * scan.normals[i];
        inliers += usize::from(field.agrees(&candidate.apply(&scan.points[i]), &normal, reach));
        let glance_over = seen + 1 == GLANCE;
        if glance_over && (inliers as f64 + 3.0) / (GLANCE as f64) * factor * factor < worst {
            return 0.0;
        }
    }
    inliers as f64 / count.max(1) as f64 * factor * factor
}

/// Drops candidates that a better one stands for: nearly the same turn and place.
fn distinct(sorted: &[Candidate], size: f64, most: usize) -> Vec<Candidate> {
    let mut kept: Vec<Candidate> = Vec::new();
    for candidate in sorted {
        let same = |other: &Candidate| {
            let angle = (other.rotation.inverse() * candidate.rotation).angle();
            let shift = (other.translation - candidate.translation).norm();
            angle < 0.2 && shift < 0.12 * size
        };
        if !kept.iter().any(same) {
            kept.push(*candidate);
        }
        if kept.len() == most {
            break;
        }
    }
    kept
}
