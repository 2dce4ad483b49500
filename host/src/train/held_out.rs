//! Shapes that are held back: scanned from some side and completed by the model of the rest.

use super::prepared::Prepared;
use super::views::{Partial, partial};
use crate::complete::{Completion, GivenPose, Options, complete};
use crate::distance::Surface;
use crate::mesh::{Mesh, Point, Vector};
use crate::register::Placed;
use crate::synth::{Kind, Random};
use crate::uncertainty::Cue;
use lacuna::{Fixed, Model, Pose};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// How far off the pose is that a completion starts from: degrees, class millimetres, share of the size.
const OFF: (f64, f64, f64) = (6.0, 6.0, 0.03);

/// Fewest shapes of which some can be held back.
pub const FEWEST: usize = 4;
/// Ways in which a held-back shape is scanned: from one side, and from three.
pub const KINDS: [Kind; 2] = [Kind::Front, Kind::Stitched];

/// How many shapes are held back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HeldOut {
    /// Shapes in all, at most; evenly over the list.
    pub shapes: usize,
    /// Models that are trained without some of them, at most.
    pub folds: usize,
}

impl HeldOut {
    /// Enough for a calibration.
    pub const SOME: Self = Self { shapes: 30, folds: 10 };
    /// Every shape by itself.
    pub const EACH: Self = Self { shapes: usize::MAX, folds: usize::MAX };

    /// The shapes that each model is trained without.
    fn groups(self, shapes: usize) -> Vec<Vec<usize>> {
        let held = self.shapes.min(shapes);
        if shapes < FEWEST || held == 0 {
            return vec![];
        }
        let folds = self.folds.clamp(1, held);
        let member = |fold: usize| (fold..held).step_by(folds).map(|i| i * shapes / held).collect();
        (0..folds).map(member).collect()
    }

    /// The shapes that are held back, in ascending order.
    pub fn numbers(self, shapes: usize) -> Vec<usize> {
        let mut numbers = self.groups(shapes).concat();
        numbers.sort_unstable();
        numbers
    }
}

/// A held-back shape, completed from a scan of a part of it.
pub struct Trial {
    /// Number of the shape.
    pub shape: usize,
    /// How it was scanned.
    pub kind: Kind,
    /// Distance of each vertex of the completed mesh from the shape, voxels; `None` beyond the shape's border.
    pub errors: Vec<Option<f32>>,
    /// What was known at those vertices.
    pub cues: Vec<Cue>,
    /// Where those vertices lie in the model, in the unit and frame of the shapes.
    pub places: Vec<[f32; 3]>,
    /// Distance of each vertex of the shape from the completed mesh, in its unit, and whether the scan showed nothing
    /// of it.
    pub covered: Vec<(f32, bool)>,
}

/// Holds back shapes and completes each of them from partial scans by the model of the rest. Shapes without which
/// there is no model, and scans that cannot be completed, are left out.
pub fn trials(
    prepared: &Prepared,
    shapes: &[Mesh],
    held: HeldOut,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Vec<Trial> {
    let groups = held.groups(shapes.len());
    let total = groups.iter().map(|group| group.len() * KINDS.len()).sum::<usize>() as u64;
    let done = AtomicU64::new(0);
    let mut all = Vec::new();
    for group in groups {
        let rest: Vec<usize> = (0..shapes.len()).filter(|i| !group.contains(i)).collect();
        let Ok(bytes) = prepared.model(&rest) else { continue };
        let Ok(model) = Model::from_bytes(&bytes) else { continue };
        let jobs: Vec<(usize, Kind)> = group.iter().flat_map(|&i| KINDS.map(|kind| (i, kind))).collect();
        let tried = jobs.par_iter().map(|&(number, kind)| {
            let trial = trial(&model, &shapes[number], number, kind);
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, total);
            trial
        });
        all.extend(tried.collect::<Vec<_>>().into_iter().flatten());
    }
    all.sort_by_key(|trial: &Trial| trial.shape);
    all
}

/// Completes shape `number` from a partial scan of it.
pub fn trial(model: &Model<'_>, shape: &Mesh, number: usize, kind: Kind) -> Option<Trial> {
    let seed = 1000 + number as u64;
    let Partial { mesh, missing } = partial(shape, kind, seed);
    let pose = GivenPose::Rough(roughly(model, &mesh, seed)?);
    // As users get it: on a coarser surface the seam, from which the ways are measured, lies elsewhere.
    let options = Options { pose, seed, ..Options::of(model) };
    let completion = complete::<Fixed>(model, &mesh, &options).ok()?;
    if completion.cues.is_empty() {
        return None;
    }
    let errors = errors(&completion, shape, model.header().spacing)?;
    let done = Surface::new(&completion.merged.mesh)?;
    let off = |p: &Point| done.distance(p, f64::INFINITY).map_or(f32::INFINITY, |d| d.value.abs() as f32);
    let covered: Vec<f32> = shape.points.par_iter().map(off).collect();
    let covered = covered.into_iter().zip(missing).collect();
    let places = places(&completion, model);
    Some(Trial { shape: number, kind, errors, cues: completion.cues, places, covered })
}

/// Where each vertex of the completed mesh lies in the model, in the unit and frame of the shapes.
fn places(completion: &Completion, model: &Model<'_>) -> Vec<[f32; 3]> {
    let header = model.header();
    let place = |p: &Point| {
        let q = completion.placed.to_model(p);
        [0, 1, 2].map(|axis| header.origin[axis] + header.spacing * q[axis] as f32)
    };
    completion.merged.mesh.points.iter().map(place).collect()
}

/// Distance of each vertex of the completed mesh from the shape, voxels; `None` beyond its border.
fn errors(completion: &Completion, shape: &Mesh, spacing: f32) -> Option<Vec<Option<f32>>> {
    let truth = Surface::new(shape)?;
    let error = |p: &Point| {
        let found = truth.distance(p, f64::INFINITY)?;
        (!found.on_border).then_some(found.value.abs() as f32 / spacing)
    };
    Some(completion.merged.mesh.points.par_iter().map(error).collect())
}

/// The true pose of a scan in the frame of the shapes, some way off.
fn roughly(model: &Model<'_>, scan: &Mesh, seed: u64) -> Option<Placed> {
    let mut random = Random::new(seed, 78);
    let (low, high) = scan.bounds()?;
    let centre = nalgebra::center(&low, &high);
    let header = model.header();
    let spacing = f64::from(header.spacing);
    let at = (centre - Point::from(Vector::from(header.origin.map(f64::from)))) / spacing;
    let axis = nalgebra::Unit::new_normalize(random.direction());
    let turn = nalgebra::Rotation3::from_axis_angle(&axis, OFF.0.to_radians());
    let shift = random.direction() * (OFF.1 * f64::from(header.scales.millimetre));
    let scale = (1.0 + OFF.2 * random.range(-1.0, 1.0)) / spacing;
    let pose = Pose {
        rotation: turn.matrix().transpose().map(|c| c as f32).into(),
        scale: scale as f32,
        translation: (at + shift).map(|c| c as f32).into(),
    };
    Some(Placed { centre, pose })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shape_is_held_back_once_and_never_all_of_them() {
        assert_eq!(HeldOut::SOME.numbers(30), (0..30).collect::<Vec<_>>());
        assert!(HeldOut::SOME.groups(30).iter().all(|group| group.len() == 3));
        assert_eq!(HeldOut::SOME.numbers(90).len(), 30);
        assert!(HeldOut::EACH.groups(8).iter().all(|group| group.len() == 1));
        assert_eq!((HeldOut::EACH.groups(8).len(), HeldOut::EACH.groups(3).len()), (8, 0));
    }
}
