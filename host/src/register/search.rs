//! Coarse registration: random point pairs for a few scales, and every good guess drawn to the surface.
//!
//! Guesses come as in the paper's section 3.1, from pairs of oriented points with equal relations in a loop over
//! the scale. How well one matches is what it explains times f, because shrinking a scan always finds more points
//! near the surface; the paper's f² prefers poses a fifth too large for half a head. The best of every scale are
//! drawn to the surface by a few Gauss-Newton steps and only then compared: next to a right guess that is ten degrees
//! off, much of a scan with hair and collar looks better somewhere else. Only possible sizes ([`SIZES`]) are looked at.

use super::field::{Field, SAMPLE};
use super::pairs::{Pair, Table};
use super::probe::Probe;
use super::rank::SIZES;
use crate::picks::in_random_order;
use crate::points::OrientedPoints;
use nalgebra::{Similarity3, Translation3, UnitQuaternion};
use rand::RngExt;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// A guess at the pose.
#[derive(Clone, Copy, Debug)]
pub struct Candidate {
    /// From the scan to the field's voxels.
    pub pose: Similarity3<f64>,
    /// Share of the scan that it explains, times the scan's size in terms of the class's.
    pub quality: f64,
}

/// Scale factors of the loop: the steps towards the surface find what lies between.
const FACTORS: [f64; 5] = [0.82, 0.91, 1.0, 1.11, 1.22];
/// Independent streams of draws for each of them.
const STREAMS: u64 = 2;
/// Points tried as the second of a pair.
const PARTNERS: usize = 8;
/// Matches tried for one pair.
const TRIES: usize = 12;
/// Pairs drawn for each that has a match, at most: most of those on clutter have none.
const MOST_DRAWS: usize = 16;
/// Points for guesses, steps and comparison.
const POINTS: [usize; 3] = [128, 256, 700];
/// A scene of many times the class's area gets as many times these points, up to this factor.
const MOST_SCENES: f64 = 8.0;
/// Gate of guesses, class millimetres.
const GUESS: f64 = 10.0;
/// Gates of the steps that draw guesses to the surface, then the best of them with more points; class millimetres.
const DRAW: [f64; 6] = [16.0, 16.0, 14.0, 12.0, 10.0, 8.0];
const DRAW_AGAIN: [f64; 4] = [8.0, 7.0, 6.0, 6.0];
/// Poses that are compared again with more points, for each one returned.
const DRAWN_AGAIN: usize = 4;
/// Shortest pair, and the width of a bin of lengths; class millimetres.
const NEAREST: f64 = 45.0;
const WIDTH: f64 = 6.0;

/// How long is searched.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Pairs with a match that are drawn for each scale.
    pub draws: usize,
    /// Guesses of a stream of draws that are drawn to the surface.
    pub kept: usize,
    /// Candidates that are returned, at most.
    pub candidates: usize,
}

/// A scan that is searched for in a field.
pub struct Search<'a> {
    field: &'a Field,
    scan: &'a OrientedPoints,
    table: Table,
    probes: [Probe; 3],
    /// Voxels per scan unit if the scan had exactly the class's mean size.
    unit_scale: f64,
    seed: u64,
}

impl<'a> Search<'a> {
    /// Prepares the search; `unit_scale` is voxels per scan unit if the scan had exactly the class's mean size.
    pub fn new(field: &'a Field, scan: &'a OrientedPoints, unit_scale: f64, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(u64::MAX);
        // Every beginning of a random order is a sample of the whole.
        let order = in_random_order(scan.points.len(), |left| random.random_range(0..=left - 1));
        // Of a scene, the part that belongs to the class has as many of them as a scan of the class alone.
        let class = field.samples.points.len() as f64 * (SAMPLE * field.millimetre).powi(2);
        let scenes = (scan.points.len() as f64 / class).clamp(1.0, MOST_SCENES);
        let probes = POINTS
            .map(|count| Probe::new(scan, &order[..((count as f64 * scenes) as usize).min(order.len())]));
        let table = Table::new(&field.samples, NEAREST * field.millimetre, WIDTH * field.millimetre);
        Self { field, scan, table, probes, unit_scale, seed }
    }

    /// The best candidates, best first; distinct ones only. The same for any number of threads; another `turn` draws other
    /// pairs.
    pub fn candidates(&self, turn: u64, effort: Effort) -> Vec<Candidate> {
        let streams = FACTORS.len() as u64 * STREAMS;
        let guesses: Vec<Candidate> = (0..streams)
            .into_par_iter()
            .flat_map_iter(|stream| self.guesses(turn * streams + stream, effort))
            .collect();
        let size = self.field.size;
        let drawn = self.inside(self.stepped(&self.probes[1], &guesses, &DRAW));
        let drawn = distinct(drawn, size, DRAWN_AGAIN * effort.candidates);
        distinct(self.inside(self.stepped(&self.probes[2], &drawn, &DRAW_AGAIN)), size, effort.candidates)
    }

    /// The poses that do not have a size at the border of the possible, for they were on the way beyond it; all where there
    /// are no others.
    fn inside(&self, mut poses: Vec<Candidate>) -> Vec<Candidate> {
        let inside = |candidate: &Candidate| {
            let size = self.unit_scale / candidate.pose.scaling();
            size > 1.001 * SIZES.start && size < 0.999 * SIZES.end
        };
        if poses.iter().any(inside) {
            poses.retain(inside);
        }
        poses
    }

    /// Steps towards the surface, then what is explained.
    fn stepped(&self, probe: &Probe, from: &[Candidate], gates: &[f64]) -> Vec<Candidate> {
        let step = |pose, &gate: &f64| self.bounded(probe, probe.step(self.field, &pose, gate));
        let stepped = |candidate: &Candidate| {
            let pose = gates.iter().fold(candidate.pose, step);
            let factor = pose.scaling() / self.unit_scale;
            let gate = gates.last().copied().unwrap_or(GUESS);
            Candidate { pose, quality: probe.explained(self.field, &pose, gate) * factor }
        };
        from.par_iter().map(stepped).collect()
    }

    /// The pose with the scan in the nearest possible size: a scene is explained best when it is shrunk until most of it is
    /// in the field.
    fn bounded(&self, probe: &Probe, pose: Similarity3<f64>) -> Similarity3<f64> {
        let size = self.unit_scale / pose.scaling();
        let growth = size / size.clamp(SIZES.start, SIZES.end);
        let middle = probe.middle(&pose).coords;
        let translation = middle + (pose.isometry.translation.vector - middle) * growth;
        Similarity3::from_parts(translation.into(), pose.isometry.rotation, pose.scaling() * growth)
    }

    /// The best guesses of one stream of draws, hardly any two of them alike.
    fn guesses(&self, stream: u64, effort: Effort) -> Vec<Candidate> {
        let draws = effort.draws / STREAMS as usize;
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(stream);
        let factor = FACTORS[stream as usize % FACTORS.len()];
        let mut best: Vec<Candidate> = Vec::new();
        let (mut matched, mut drawn) = (0, 0);
        while matched < draws && drawn < MOST_DRAWS * draws {
            drawn += 1;
            let Some(pair) = self.random_pair(factor, &mut random) else { continue };
            let matches = self.table.matches(&pair);
            matched += usize::from(!matches.is_empty());
            for attempt in 0..TRIES.min(matches.len()) {
                let all = matches.len() <= TRIES;
                let (_, a, b) = matches[if all { attempt } else { random.random_range(0..matches.len()) }];
                let goal = Pair::of(&self.field.samples, usize::from(a), usize::from(b));
                let Some(pose) = align(&pair, &goal, self.unit_scale * factor) else { continue };
                self.judge(pose, factor, effort.kept, &mut best);
            }
        }
        best
    }

    /// Puts a guess among the best if it is one of them.
    fn judge(&self, pose: Similarity3<f64>, factor: f64, kept: usize, best: &mut Vec<Candidate>) {
        let least = if best.len() < kept { 0.0 } else { best[best.len() - 1].quality };
        let explained = self.probes[0].explained_at_least(self.field, &pose, GUESS, least / factor);
        if let Some(quality) = explained.map(|share| share * factor).filter(|&quality| quality > least) {
            insert(best, Candidate { pose, quality }, self.field.size, kept);
        }
    }

    /// A pair of the scan, in voxels, whose length occurs on the surface; none if [`PARTNERS`] draws give none.
    fn random_pair(&self, factor: f64, random: &mut ChaCha8Rng) -> Option<Pair> {
        let count = self.scan.points.len();
        let i = random.random_range(0..count);
        for _ in 0..PARTNERS {
            let mut pair = Pair::of(self.scan, i, random.random_range(0..count));
            pair.points = pair.points.map(|p| p * (self.unit_scale * factor));
            if self.table.reaches(&pair) {
                return Some(pair);
            }
        }
        None
    }
}

/// The motion that takes a pair, which is `scale` times the scan's, to its match.
fn align(from: &Pair, to: &Pair, scale: f64) -> Option<Similarity3<f64>> {
    let ((a, frame_a), (b, frame_b)) = (from.frame()?, to.frame()?);
    let turn = UnitQuaternion::from_rotation_matrix(&(frame_b * frame_a.inverse()));
    let translation = b.coords - turn * a.coords;
    Some(Similarity3::from_parts(Translation3::from(translation), turn, scale))
}

/// Puts a guess into the list, best first, unless a better one stands for it.
fn insert(best: &mut Vec<Candidate>, candidate: Candidate, size: f64, kept: usize) {
    let at = best.partition_point(|other| other.quality >= candidate.quality);
    if best[..at].iter().any(|other| alike(other, &candidate, size)) {
        return;
    }
    best.insert(at, candidate);
    let worse = best[at + 1..].iter().position(|other| alike(other, &candidate, size));
    match worse {
        Some(offset) => {
            best.remove(at + 1 + offset);
        }
        None => best.truncate(kept),
    }
}

/// Nearly the same turn and place: about twelve degrees and an eighth of the size.
fn alike(a: &Candidate, b: &Candidate, size: f64) -> bool {
    let between = a.pose.isometry.rotation.coords.dot(&b.pose.isometry.rotation.coords).abs();
    // Half the angle, as quaternions have it.
    between > 0.9945
        && (a.pose.isometry.translation.vector - b.pose.isometry.translation.vector).norm() < 0.12 * size
}

/// The best, without those that a better one stands for.
fn distinct(mut all: Vec<Candidate>, size: f64, most: usize) -> Vec<Candidate> {
    all.sort_by(|a, b| b.quality.total_cmp(&a.quality));
    let mut kept: Vec<Candidate> = Vec::new();
    for candidate in all {
        if kept.len() < most && !kept.iter().any(|other| alike(other, &candidate, size)) {
            kept.push(candidate);
        }
    }
    kept
}
