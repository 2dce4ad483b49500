//! Generalised alignment: every shape to the mean of all, again and again, none of them the pattern.
//!
//! The mean is the mean of the signed distances of the shapes where they lie so far. First each shape is drawn to it by
//! similarities, on distances in both directions, from the shape's points to the mean and from the mean's points to
//! the shape, along the normals: rims that end elsewhere and dense places weigh nothing. Then by what a similarity
//! explains of a smooth deformation, see [`super::deform`]. The mean scale of all shapes stays one.
//!
//! Deformations can run away: a bottle half as slender again as eleven others shrank to a twentieth, sixteen mugs lay
//! worse on their mean than before. Shapes that do are taken back and drawn by similarities alone.

use super::deform::drawn;
use crate::mesh::{Point, Vector, bounds};
use crate::points::OrientedPoints;
use crate::raster;
use crate::register::field::Field;
use crate::register::probe::{Probe, Sums};
use crate::register::search::{Effort, Search};
use nalgebra::{Matrix3, Similarity3, SymmetricEigen, Translation3, UnitQuaternion};
use rayon::prelude::*;
use std::f64::consts::PI;

/// A shape as the alignment sees it.
pub struct Shape {
    /// Its distances.
    pub field: Field,
    /// From its frame to the field's voxels.
    pub to_field: Similarity3<f64>,
    /// Points on it, in its frame.
    pub points: OrientedPoints,
}

/// Gates of the rounds by similarities, class millimetres; each round takes a new mean.
const GATES: [f64; 12] = [WIDE, 20.0, 16.0, 14.0, 12.0, 12.0, 10.0, 10.0, 10.0, 10.0, 10.0, 10.0];
/// The first of them, with which shapes are drawn that differ too much from the mean for a narrower one: of two bottles one
/// half as slender again as the other the narrow ones see the bodies alone, and make it a quarter larger, head to tail or not.
const WIDE: f64 = 24.0;
/// Gauss-Newton steps of such a round.
const STEPS: usize = 2;
/// Rounds by deformations.
const BENT: usize = 8;
/// Distances beyond this say little about the mean, class millimetres.
const FAR: f32 = 30.0;
/// Nodes of the mean's lattice along its longest side.
const NODES: f64 = 56.0;

/// Shapes up to this number are compared with the mean of the others, more of them with the mean of all, to which one adds
/// little.
const FEW: usize = 8;
/// Within this distance, class millimetres, points lie together with the mean, the more the nearer ([`lying`]).
pub const TOGETHER: f64 = 16.0;
/// A shape of which this much less lies together with the mean than before has run away from it. Faces lose 0.02 at most,
/// femurs nothing; of bottles one lost 0.55, of two of them either lost 0.17, mugs lost 0.1 to 0.45.
const WORSE: f64 = 0.05;
/// A turned pose is another one, and not the same again, where this much more lies together: the turns of bottles about their
/// own axis differ by 0.002, upright mugs from those upside down by 0.02.
const BETTER: f64 = 0.03;
/// Shapes of which less lies together with the mean are searched for again. Faces and femurs are at 0.9 or more, a bottle
/// half as slender again as the others at 0.78; a mug among feet is at 0.36.
const POOR: f64 = 0.6;
/// Effort of that search.
const EFFORT: Effort = Effort { draws: 1500, kept: 24, candidates: 4 };
/// Rounds in which shapes are turned round and all are drawn to the new mean.
const TURNS: usize = 2;

/// Moves the shapes to their mean: `motions` take them to a common frame, roughly before and well afterwards.
pub fn towards_mean(shapes: &[Shape], motions: &mut [Similarity3<f64>]) {
    for gate in GATES {
        centre_scales(motions);
        let mean = Mean::of_all(shapes, motions);
        motions.par_iter_mut().zip(shapes).for_each(|(motion, shape)| {
            *motion = mean.back(stepped(shape, &mean, mean.to_mean * *motion, gate));
        });
    }
    let (rough, before) = (motions.to_vec(), lying(shapes, motions, TOGETHER));
    let mut held = vec![false; shapes.len()];
    loop {
        bend(shapes, motions, &held);
        let after = lying(shapes, motions, TOGETHER);
        let lost: Vec<f64> = before.iter().zip(&after).map(|(before, after)| before - after).collect();
        if !hold(&mut held, &lost) {
            break;
        }
        motions.copy_from_slice(&rough);
    }
    centre_scales(motions);
}

/// Holds those that have run away farthest, for they draw others with them: whether there are any. Where they are most of
/// the shapes, all are held.
fn hold(held: &mut [bool], lost: &[f64]) -> bool {
    let free = || lost.iter().zip(&*held).filter(|(_, held)| !**held).map(|(lost, _)| *lost);
    let most = free().fold(0.0, f64::max);
    if most < WORSE {
        return false;
    }
    let far = WORSE.max(most / 2.0);
    held.iter_mut().zip(lost).for_each(|(held, lost)| *held |= *lost >= far);
    if 2 * held.iter().filter(|held| **held).count() > held.len() {
        held.fill(true);
    }
    true
}

/// Rounds by deformations; the shapes that are `held` are drawn by similarities.
pub fn bend(shapes: &[Shape], motions: &mut [Similarity3<f64>], held: &[bool]) {
    for _ in 0..BENT {
        centre_scales(motions);
        let mean = Mean::of_all(shapes, motions);
        motions.par_iter_mut().zip(shapes).zip(held).for_each(|((motion, shape), held)| {
            let pose = mean.to_mean * *motion;
            *motion = mean.back(match held {
                true => stepped(shape, &mean, pose, WIDE),
                false => drawn(&mean.field, &shape.points, &pose),
            });
        });
    }
}

/// What of each shape lies together with the mean, of the points of both: each counts by the share 1 - (d / τ)² of its
/// distance d within the gate τ.
pub fn lying(shapes: &[Shape], motions: &[Similarity3<f64>], gate: f64) -> Vec<f64> {
    let means = means(shapes, motions);
    let lies = |(i, shape): (usize, &Shape)| {
        let mean = &means[i % means.len()];
        lies(shape, mean, &(mean.to_mean * motions[i]), gate)
    };
    shapes.par_iter().enumerate().map(lies).collect()
}

/// The means that the shapes are compared with: one for each, or one for all.
fn means(shapes: &[Shape], motions: &[Similarity3<f64>]) -> Vec<Mean> {
    if shapes.len() > FEW {
        return vec![Mean::of_all(shapes, motions)];
    }
    (0..shapes.len()).into_par_iter().map(|i| Mean::of_others(shapes, motions, i)).collect()
}

/// What of a shape in a pose, from its frame to the mean's voxels, lies together with the mean.
fn lies(shape: &Shape, mean: &Mean, pose: &Similarity3<f64>, gate: f64) -> f64 {
    let there = Probe::of_all(&shape.points).explained(&mean.field, pose, gate);
    let back = mean.pattern.explained(&shape.field, &(pose * shape.to_field.inverse()).inverse(), gate);
    f64::midpoint(there, back)
}

/// Moves the shapes to their mean as [`towards_mean`] does, and looks whether they lie better on it turned round, or, where
/// they lie badly, anywhere.
pub fn settle(shapes: &[Shape], motions: &mut [Similarity3<f64>], seed: u64) {
    towards_mean(shapes, motions);
    for _ in 0..TURNS {
        let lay = lying(shapes, motions, WIDE);
        let before = motions.to_vec();
        if !turn(shapes, motions, seed) {
            return;
        }
        towards_mean(shapes, motions);
        if lying(shapes, motions, WIDE).iter().sum::<f64>() <= lay.iter().sum() {
            motions.copy_from_slice(&before);
            return;
        }
    }
}

/// Moves shapes to poses in which clearly more of them lies together with the mean: whether there are any. Half of the shapes at
/// most, those that gain most, for of two that lie head to tail one has to stay.
fn turn(shapes: &[Shape], motions: &mut [Similarity3<f64>], seed: u64) -> bool {
    let means = means(shapes, motions);
    let found = |(i, shape): (usize, &Shape)| {
        let mean = &means[i % means.len()];
        let (gain, pose) = better(shape, mean, &(mean.to_mean * motions[i]), seed)?;
        Some((gain, i, mean.back(pose)))
    };
    let mut found: Vec<(f64, usize, Similarity3<f64>)> =
        shapes.par_iter().enumerate().filter_map(found).collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.truncate(shapes.len() / 2);
    found.iter().for_each(|(_, i, motion)| motions[*i] = *motion);
    !found.is_empty()
}

/// A pose in which clearly more of a shape lies together with the mean than where it lies, and how much more.
fn better(shape: &Shape, mean: &Mean, pose: &Similarity3<f64>, seed: u64) -> Option<(f64, Similarity3<f64>)> {
    let settled = |start| {
        let pose = GATES.iter().fold(start, |pose, &gate| stepped(shape, mean, pose, gate));
        (lies(shape, mean, &pose, WIDE), pose)
    };
    let here = lies(shape, mean, pose, WIDE).max(settled(*pose).0);
    let mut starts = turned(shape, mean, pose).to_vec();
    if here < POOR {
        starts.extend(searched(shape, mean, seed));
    }
    let best = starts.into_iter().map(settled).max_by(|a, b| a.0.total_cmp(&b.0))?;
    (best.0 > here + BETTER).then_some((best.0 - here, best.1))
}

/// The shape's middle on the mean's, in the mean's size, as it is turned in a pose, and by half a turn more about each principal
/// axis of its points: where it lies head to tail, its middle and its size are wrong as well.
fn turned(shape: &Shape, mean: &Mean, pose: &Similarity3<f64>) -> [Similarity3<f64>; 4] {
    let probe = Probe::of_all(&shape.points);
    let middle = probe.middle(pose);
    let arms = shape.points.points.iter().map(|p| pose * p - middle);
    let spread = arms.fold(Matrix3::zeros(), |sum, arm| sum + arm * arm.transpose());
    let axes = SymmetricEigen::new(spread).eigenvectors;
    let goal = mean.pattern.middle(&Similarity3::identity());
    let centred = Similarity3::from_scaling(sized(shape, mean) / pose.scaling())
        * Translation3::from(-middle.coords)
        * pose;
    [None, Some(0), Some(1), Some(2)].map(|axis| {
        let turn = axis.map_or(Vector::zeros(), |axis| axes.column(axis) * PI);
        Translation3::from(goal.coords) * UnitQuaternion::from_scaled_axis(turn) * centred
    })
}

/// The scale of a pose in which a shape has the size of the mean.
fn sized(shape: &Shape, mean: &Mean) -> f64 {
    mean.field.millimetre * shape.to_field.scaling() / shape.field.millimetre
}

/// The best poses of a search on the mean.
fn searched(shape: &Shape, mean: &Mean, seed: u64) -> Vec<Similarity3<f64>> {
    let search = Search::new(&mean.field, &shape.points, sized(shape, mean), seed);
    search.candidates(0, EFFORT).into_iter().map(|found| found.pose).collect()
}

/// A shape's pose after steps on distances in both directions.
fn stepped(shape: &Shape, mean: &Mean, mut pose: Similarity3<f64>, gate: f64) -> Similarity3<f64> {
    let probe = Probe::of_all(&shape.points);
    for _ in 0..STEPS {
        let mut sums = Sums::about(probe.middle(&pose));
        probe.add(&mean.field, &pose, gate, &mut sums);
        mean.pattern.add_back(&shape.field, &(pose * shape.to_field.inverse()), gate, &mut sums);
        pose = sums.moved(&mean.field, &pose);
    }
    pose
}

/// The mean scale becomes one.
fn centre_scales(motions: &mut [Similarity3<f64>]) {
    let growth = motions.iter().map(|m| libm::log(m.scaling())).sum::<f64>() / motions.len().max(1) as f64;
    let back = Similarity3::from_scaling(libm::exp(-growth));
    motions.iter_mut().for_each(|motion| *motion = back * *motion);
}

/// From a voxel of the mean to a shape's field, and the length of the field's voxels in the mean's.
struct Way(Similarity3<f64>, f32);

/// A shape and its motion to the common frame.
type Placed<'a> = (&'a Shape, &'a Similarity3<f64>);

/// A mean shape.
struct Mean {
    field: Field,
    /// Its points, voxels.
    pattern: Probe,
    /// From the common frame to its voxels.
    to_mean: Similarity3<f64>,
}

impl Mean {
    /// Of all shapes where they lie.
    fn of_all(shapes: &[Shape], motions: &[Similarity3<f64>]) -> Self {
        Self::of(&shapes.iter().zip(motions).collect::<Vec<_>>())
    }

    /// Of all but one of them.
    fn of_others(shapes: &[Shape], motions: &[Similarity3<f64>], but: usize) -> Self {
        let others = shapes.iter().zip(motions).enumerate().filter(|(i, _)| *i != but);
        Self::of(&others.map(|(_, placed)| placed).collect::<Vec<_>>())
    }

    fn of(placed: &[Placed]) -> Self {
        let (field, to_mean) = mean(placed);
        Self { pattern: Probe::of_all(&field.samples), field, to_mean }
    }

    /// A pose, from a shape's frame to the voxels, as a motion to the common frame.
    fn back(&self, pose: Similarity3<f64>) -> Similarity3<f64> {
        self.to_mean.inverse() * pose
    }
}

/// The distances of the mean shape, and the transform from the common frame to its voxels.
fn mean(placed: &[Placed]) -> (Field, Similarity3<f64>) {
    let moved = placed.iter().flat_map(|(s, m)| s.points.points.iter().map(move |p| *m * p));
    let (low, high) = bounds(moved).unwrap_or_default();
    let spacing = (high - low).max() / NODES;
    let origin = low - Vector::repeat(3.0 * spacing);
    let sides: [usize; 3] = (high - low).map(|length| (length / spacing).ceil() as usize + 7).into();
    let to_mean = Similarity3::from_scaling(1.0 / spacing) * Translation3::from(-origin.coords);
    let way = |(shape, motion): &Placed| {
        let way = shape.to_field * motion.inverse() * to_mean.inverse();
        Way(way, (1.0 / way.scaling()) as f32)
    };
    let ways: Vec<Way> = placed.iter().map(way).collect();
    let millimetres =
        placed.iter().zip(&ways).map(|((shape, _), way)| shape.field.millimetre * f64::from(way.1));
    let millimetre = millimetres.sum::<f64>() / placed.len().max(1) as f64;
    let value = |i: usize| {
        let node = Point::from(raster::voxel(sides, i).map(|v| v as f64));
        mean_distance(placed, &ways, &node, FAR * millimetre as f32)
    };
    let values: Vec<f32> = (0..raster::len(sides)).into_par_iter().map(value).collect();
    (Field::of_values(sides, &values, millimetre), to_mean)
}

/// Mean distance at a node, NaN where fewer than half of the shapes know theirs or it is `far` away.
fn mean_distance(placed: &[Placed], ways: &[Way], node: &Point, far: f32) -> f32 {
    let (mut sum, mut count) = (0.0, 0);
    for ((shape, _), Way(way, long)) in placed.iter().zip(ways) {
        if let Some((distance, _)) = shape.field.at((way * node).coords.map(|c| c as f32).into()) {
            sum += (distance * long).clamp(-far, far);
            count += 1;
        }
    }
    let mean = sum / count as f32;
    if 2 * count > placed.len() && mean.abs() < 0.9 * far { mean } else { f32::NAN }
}
