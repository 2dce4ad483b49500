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
use super::mean_shape::{Mean, Shape};
use crate::register::probe::{Probe, Sums};
use nalgebra::Similarity3;
use rayon::prelude::*;

/// Gates of the rounds by similarities, class millimetres; each round takes a new mean.
pub(super) const GATES: [f64; 12] = [WIDE, 20.0, 16.0, 14.0, 12.0, 12.0, 10.0, 10.0, 10.0, 10.0, 10.0, 10.0];
/// The first of them, with which shapes are drawn that differ too much from the mean for a narrower one: of two bottles one
/// half as slender again as the other the narrow ones see the bodies alone, and make it a quarter larger, head to tail or not.
pub(super) const WIDE: f64 = 24.0;
/// Gauss-Newton steps of such a round.
const STEPS: usize = 2;
/// Rounds by deformations.
const BENT: usize = 8;
/// Shapes up to this number are compared with the mean of the others, more of them with the mean of all, to which one adds
/// little.
const FEW: usize = 8;
/// Within this distance, class millimetres, points lie together with the mean, the more the nearer ([`lying`]).
pub const TOGETHER: f64 = 16.0;
/// A shape of which this much less lies together with the mean than before has run away from it. Faces lose 0.02 at most,
/// femurs nothing; of bottles one lost 0.55, of two of them either lost 0.17, mugs lost 0.1 to 0.45.
const WORSE: f64 = 0.05;

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
pub(super) fn means(shapes: &[Shape], motions: &[Similarity3<f64>]) -> Vec<Mean> {
    if shapes.len() > FEW {
        return vec![Mean::of_all(shapes, motions)];
    }
    (0..shapes.len()).into_par_iter().map(|i| Mean::of_others(shapes, motions, i)).collect()
}

/// What of a shape in a pose, from its frame to the mean's voxels, lies together with the mean.
pub(super) fn lies(shape: &Shape, mean: &Mean, pose: &Similarity3<f64>, gate: f64) -> f64 {
    let there = Probe::of_all(&shape.points).explained(&mean.field, pose, gate);
    let back = mean.pattern.explained(&shape.field, &(pose * shape.to_field.inverse()).inverse(), gate);
    f64::midpoint(there, back)
}

/// A shape's pose after steps on distances in both directions.
pub(super) fn stepped(shape: &Shape, mean: &Mean, mut pose: Similarity3<f64>, gate: f64) -> Similarity3<f64> {
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
