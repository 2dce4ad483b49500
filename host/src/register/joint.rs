//! Pose and shape together, by the core's estimate, from a pose that is known roughly.

use super::field::Field;
use super::rank::Scored;
use super::search::Candidate;
use crate::mesh::Point;
use crate::points::OrientedPoints;
use lacuna::corners::Weights;
use lacuna::cube::Cube;
use lacuna::pose_fit::{PATCH, ROUNDS, Round, columns_len, sums_len};
use lacuna::{Cloud, Model, Pose, PoseBuffers, PoseFit, Standing};
use nalgebra::Similarity3;
use rayon::prelude::*;

/// Points of a candidate's refinement.
const FEW: usize = 400;
/// Points of the best one's refinement; many more if less than [`CLEAN`] of the scan is near the class: hair and
/// collar leave the size of a face to chance otherwise.
const MANY: [usize; 2] = [1600, 6000];
/// Least share of a scan without clutter that is near the class.
const CLEAN: f64 = 0.75;
/// Farthest that a point of the class lies from the mean, class millimetres.
const NEARBY: f32 = 25.0;

/// Pose and shape from each candidate.
pub fn refined(model: &Model<'_>, points: &OrientedPoints, candidates: &[Candidate]) -> Vec<Scored> {
    let few = subsample(points, FEW);
    let joint = |candidate: &Candidate| refine(model, &few, to_pose(&candidate.pose), &ROUNDS[1..]).ok();
    candidates.par_iter().filter_map(joint).collect()
}

/// The pose refined with about `MANY` of the points that may belong to the class, and what it explains of all points.
/// Every n-th point is taken: two poses that nearly agree are refined with the same points.
pub fn settled(
    model: &Model<'_>,
    field: &Field,
    points: &OrientedPoints,
    pose: Pose,
) -> Result<Scored, lacuna::Error> {
    let near = |p: &Point| {
        let read = field.at(pose.apply(p.coords.map(|c| c as f32).into()));
        read.is_some_and(|(distance, _)| distance.abs() < NEARBY * field.millimetre as f32)
    };
    let near: Vec<usize> = (0..points.points.len()).filter(|&i| near(&points.points[i])).collect();
    let clean = near.len() as f64 >= CLEAN * points.points.len() as f64;
    let stride = (near.len() / MANY[usize::from(!clean)]).max(1);
    let chosen = || near.iter().filter(|&i| i % stride == 0);
    let chosen = OrientedPoints {
        points: chosen().map(|&i| points.points[i]).collect(),
        normals: chosen().map(|&i| points.normals[i]).collect(),
    };
    let refined = refine(model, &chosen, pose, &ROUNDS)?;
    let share = near.len() as f64 / points.points.len().max(1) as f64;
    Ok(Scored { inliers: share * refined.inliers, explained: share * refined.explained, ..refined })
}

pub(super) fn refine(
    model: &Model<'_>,
    points: &OrientedPoints,
    pose: Pose,
    rounds: &[Round],
) -> Result<Scored, lacuna::Error> {
    let modes = model.modes();
    let (mut normal, mut chunk) = (vec![0.0; sums_len(modes)], vec![0.0; sums_len(modes)]);
    let (mut columns, mut weights) = (vec![[0; PATCH]; columns_len(modes)], vec![0.0; modes]);
    let packed = points.packed();
    let buffers =
        PoseBuffers { normal: &mut normal, chunk: &mut chunk, columns: &mut columns, weights: &mut weights };
    let (pose, _, weights) = PoseFit::new(model, packed.cloud()?, usize::MAX, pose, rounds, buffers)?.run();
    let inliers = inlier_share(model, packed.cloud()?, &pose, &Weights::new(weights));
    let factor = f64::from(pose.scale) * f64::from(model.header().spacing);
    let (size, shape) = (1.0 / factor, weights.to_vec());
    Ok(Scored { pose, explained: inliers * factor.sqrt(), inliers, size, shape })
}

/// Share of points that lie on the fitted surface and face its way.
fn inlier_share(model: &Model<'_>, cloud: Cloud<'_>, pose: &Pose, weights: &Weights) -> f64 {
    let points = (0..cloud.len()).filter_map(|i| cloud.point(i));
    let mut cube = Cube::new(model, weights);
    let inlier = |&(p, n): &([f32; 3], [f32; 3])| {
        Standing::of(&mut cube, pose.apply(p), pose.rotate(n)) == Standing::Inlier
    };
    points.filter(inlier).count() as f64 / cloud.len().max(1) as f64
}

fn to_pose(motion: &Similarity3<f64>) -> Pose {
    let rotation = motion.isometry.rotation.to_rotation_matrix().matrix().transpose().map(|c| c as f32);
    Pose {
        rotation: rotation.into(),
        scale: motion.scaling() as f32,
        translation: motion.isometry.translation.vector.map(|c| c as f32).into(),
    }
}

/// About `count` points, evenly over the list.
fn subsample(points: &OrientedPoints, count: usize) -> OrientedPoints {
    let n = points.points.len();
    let chosen = |list: &[Point]| (0..count.min(n)).map(|i| list[i * n / count.min(n)]).collect();
    let normals = (0..count.min(n)).map(|i| points.normals[i * n / count.min(n)]).collect();
    OrientedPoints { points: chosen(&points.points), normals }
}
