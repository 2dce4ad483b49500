//! Pose and shape together, by the core's estimate, from a pose that is known roughly.

use super::field::Field;
use super::rank::Scored;
use super::search::Candidate;
use crate::mesh::Point;
use crate::picks::evenly;
use crate::points::OrientedPoints;
use lacuna::corners::Weights;
use lacuna::cube::Cube;
use lacuna::pose_fit::{PATCH, ROUNDS, Round, columns_len, sums_len};
use lacuna::pose_row::steepness;
use lacuna::standing::{INLIER, Standing};
use lacuna::{Cloud, Model, Pose, PoseBuffers, PoseFit};
use nalgebra::{Similarity3, Vector3};
use rayon::prelude::*;

/// Points of a candidate's refinement.
const FEW: usize = 400;
/// Points of the best one's refinement; many more if less than `CLEAN` of the scan is near the class: hair and
/// collar leave the size of a face to chance otherwise.
pub const MANY: [usize; 2] = [1600, 6000];
/// Least share of a scan without clutter that is near the class.
const CLEAN: f64 = 0.75;
/// Farthest that a point of the class lies from the mean, class millimetres.
const NEARBY: f32 = 25.0;

/// Pose and shape from each candidate.
pub fn refined(
    model: &Model<'_>,
    field: &Field,
    points: &OrientedPoints,
    candidates: &[Candidate],
) -> Vec<Scored> {
    let from = |candidate: &Candidate| {
        let pose = to_pose(&candidate.pose);
        let near = near(field, points, &pose);
        let chosen = evenly(near.len(), FEW).map(|i| near[i]);
        joint(model, points, (near.len(), chosen.collect()), pose, &ROUNDS[1..]).ok()
    };
    candidates.par_iter().filter_map(from).collect()
}

/// The pose refined with those points that may belong to the class, thinned to about `MANY` of them ([`every_nth`]), and what
/// it explains of all points.
pub fn refined_by_many(
    model: &Model<'_>,
    field: &Field,
    points: &OrientedPoints,
    pose: Pose,
) -> Result<Scored, lacuna::Error> {
    let near = near(field, points, &pose);
    let clean = near.len() as f64 >= CLEAN * points.points.len() as f64;
    let chosen = every_nth(&near, MANY[usize::from(!clean)]);
    joint(model, points, (near.len(), chosen), pose, &ROUNDS)
}

/// The points whose number is a multiple of n, with n so that `least` to twice as many are left, or all where there are
/// fewer. Numbers, and not places in the list, decide: two poses that have nearly the same points near them keep nearly the
/// same ones, and are refined to one pose.
pub fn every_nth(points: &[usize], least: usize) -> Vec<usize> {
    let stride = (points.len() / least).max(1);
    points.iter().copied().filter(|i| i % stride == 0).collect()
}

/// The numbers of the points that may belong to the class in a pose.
pub fn near(field: &Field, points: &OrientedPoints, pose: &Pose) -> Vec<usize> {
    let near = |p: &Point| {
        let read = field.at(pose.apply(p.coords.map(|c| c as f32).into()));
        read.is_some_and(|(distance, _)| distance.abs() < NEARBY * field.millimetre as f32)
    };
    (0..points.points.len()).filter(|&i| near(&points.points[i])).collect()
}

/// A pose refined with the points `chosen` of `near` ones, and what it explains of all.
fn joint(
    model: &Model<'_>,
    points: &OrientedPoints,
    (near, chosen): (usize, Vec<usize>),
    pose: Pose,
    rounds: &[Round],
) -> Result<Scored, lacuna::Error> {
    let refined = refine(model, &points.chosen(&chosen), pose, rounds)?;
    Ok(refined.of_all(near as f64 / points.points.len().max(1) as f64))
}

/// Pose and shape fitted to points, and what they explain of them.
pub(super) fn refine(
    model: &Model<'_>,
    points: &OrientedPoints,
    pose: Pose,
    rounds: &[Round],
) -> Result<Scored, lacuna::Error> {
    let packed = points.packed();
    let (pose, shape) = pose_and_shape(model, packed.cloud()?, pose, rounds)?;
    Ok(scored(model, packed.cloud()?, pose, shape))
}

/// Pose and weights of the shape fitted to points.
pub(super) fn pose_and_shape(
    model: &Model<'_>,
    cloud: Cloud<'_>,
    pose: Pose,
    rounds: &[Round],
) -> Result<(Pose, Vec<f32>), lacuna::Error> {
    let modes = model.modes();
    let (mut normal, mut chunk) = (vec![0.0; sums_len(modes)], vec![0.0; sums_len(modes)]);
    let (mut columns, mut weights) = (vec![[0; PATCH]; columns_len(modes)], vec![0.0; modes]);
    let buffers =
        PoseBuffers { normal: &mut normal, chunk: &mut chunk, columns: &mut columns, weights: &mut weights };
    let (pose, _, weights) = PoseFit::new(model, cloud, usize::MAX, pose, rounds, buffers)?.run();
    Ok((pose, weights.to_vec()))
}

/// What a pose and a shape explain of points.
pub(super) fn scored(model: &Model<'_>, cloud: Cloud<'_>, pose: Pose, shape: Vec<f32>) -> Scored {
    let (inliers, agreement) = agreement(model, cloud, &pose, &Weights::new(&shape));
    let factor = f64::from(pose.scale) * f64::from(model.header().spacing);
    Scored { pose, explained: agreement * factor.sqrt(), inliers, near: 1.0, size: 1.0 / factor, shape }
}

/// Signed distance of a place from the surface of `cube`, voxels, and the surface's normal, about as long as 1.
pub fn signed_distance(cube: &mut Cube<'_, '_>, place: [f32; 3]) -> Option<(f32, Vector3<f32>)> {
    let (distance, gradient) = cube.find(place)?.distance();
    let steepness = steepness(gradient);
    Some((distance / steepness, Vector3::from(gradient) / steepness))
}

/// Share of points that lie on the fitted surface and face its way; and the mean of (1 - (r / τ)²)² over all points, of
/// their distances r within the gate τ: a face lies on its own surface exactly, and a shock of hair on a face does not.
pub fn agreement(model: &Model<'_>, cloud: Cloud<'_>, pose: &Pose, weights: &Weights) -> (f64, f64) {
    let gate = INLIER * model.header().scales.millimetre;
    let mut cube = Cube::new(model, weights);
    let (mut inliers, mut sum) = (0usize, 0.0);
    for (p, n) in (0..cloud.len()).filter_map(|i| cloud.point(i)) {
        let Some(sample) = cube.find(pose.apply(p)).map(Cube::distance) else { continue };
        if Standing::from_sample(model, sample, pose.rotate(n)) == Standing::Inlier {
            let (distance, gradient) = sample;
            let ratio = f64::from(distance / (steepness(gradient) * gate));
            inliers += 1;
            sum += (1.0 - ratio * ratio).powi(2);
        }
    }
    let count = cloud.len().max(1) as f64;
    (inliers as f64 / count, sum / count)
}

fn to_pose(motion: &Similarity3<f64>) -> Pose {
    let rotation = motion.isometry.rotation.to_rotation_matrix().matrix().transpose().map(|c| c as f32);
    Pose {
        rotation: rotation.into(),
        scale: motion.scaling() as f32,
        translation: motion.isometry.translation.vector.map(|c| c as f32).into(),
    }
}
