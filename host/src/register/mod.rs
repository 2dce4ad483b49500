//! Registration: where the scan lies in the model's frame, without a hint.
//!
//! Coarse search over point pairs, then every candidate is refined by the core's joint estimate of pose and
//! shape, and the one that explains most of the scan wins.

pub mod field;
pub mod icp;
pub mod pairs;
pub mod search;
pub mod spread;

use crate::check::size;
use crate::mesh::{Mesh, Point, Vector};
use crate::points::{OrientedPoints, thin};
use crate::sentence::sentence;
use crate::unit;
use field::Field;
use lacuna::pose_fit::{ROUNDS, Round, row_len, sums_len};
use lacuna::{Cloud, Model, Pose, PoseBuffers, PoseFit, Standing};
use rayon::prelude::*;
use search::{Candidate, Search};

/// A scan's place in the model: q = pose(p - centre), in voxels.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// A point near the scan, subtracted first so that single precision suffices.
    pub centre: Point,
    /// From the centred scan to voxels.
    pub pose: Pose,
}

/// The outcome of a registration.
#[derive(Clone, Debug)]
pub struct Registration {
    /// Where the scan lies.
    pub placed: Placed,
    /// Share of the scan's points within three class millimetres of the fitted surface, facing its way.
    pub inliers: f64,
    /// The same for the best of the other candidates, 0 without any.
    pub runner_up: f64,
}

/// Why a scan cannot be registered.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Too little surface.
    #[error(
        "the scan has only {0} points after thinning, at least 60 are needed: is it a scan of this class, in its unit?"
    )]
    TooFewPoints(usize),
    /// A size that does not fit.
    #[error(
        "the scan is {scan:.4} {unit} long and the model {model:.4} {unit}: they differ by more than a factor of {limit}. {hint}"
    )]
    Size {
        /// Longest side of the scan.
        scan: f64,
        /// Longest side of the mean shape, in the model's unit.
        model: f64,
        /// The model's unit.
        unit: &'static str,
        /// Largest factor accepted.
        limit: f64,
        /// What may be the reason.
        hint: String,
    },
    /// Nothing matched.
    #[error("the scan does not match the model anywhere: is it of the same class?")]
    NoMatch,
    /// The core refused.
    #[error("the pose could not be refined: {}", sentence(.0))]
    Core(lacuna::Error),
}

impl From<lacuna::Error> for Error {
    fn from(error: lacuna::Error) -> Self {
        Self::Core(error)
    }
}

impl Placed {
    /// A scan point in voxels.
    pub fn to_model(&self, p: &Point) -> Point {
        let q = self.pose.apply((p - self.centre).map(|c| c as f32).into());
        Point::from(Vector::from(q.map(f64::from)))
    }

    /// A voxel position in the scan's frame.
    pub fn to_scan(&self, q: &Point) -> Point {
        let pose = &self.pose;
        let moved = (q.coords - Vector::from(pose.translation.map(f64::from))) / f64::from(pose.scale);
        let rotation = nalgebra::Matrix3::from_row_slice(&pose.rotation.concat()).map(f64::from);
        self.centre + rotation.transpose() * moved
    }
}

/// Thinned and centred points of a scan, neighbours in space next to each other, as the pose fit wants them.
pub fn prepare(scan: &Mesh, cell: f64) -> (Point, OrientedPoints) {
    let mut points = thin(scan, cell).along_curve();
    let sum = points.points.iter().fold(Vector::zeros(), |sum, p| sum + p.coords);
    let centre = Point::from(sum / points.points.len().max(1) as f64);
    for point in &mut points.points {
        *point = Point::from(*point - centre);
    }
    (centre, points)
}

/// Candidates that are refined.
const REFINED: usize = 12;
/// Candidates that are refined with the shape.
const JOINT: usize = 4;
/// Points of the rigid and of the joint refinement.
const POINTS: [usize; 2] = [400, 1600];

/// Finds the pose of a scan.
///
/// # Errors
/// A scan that is too small, of another size, or unlike the model.
pub fn register(model: &Model<'_>, scan: &Mesh, seed: u64) -> Result<Registration, Error> {
    let field = Field::of_model(model);
    let spacing = f64::from(model.header().spacing);
    check_size(scan, &field, model)?;
    let (centre, points) = prepare(scan, spacing);
    if points.points.len() < 60 {
        return Err(Error::TooFewPoints(points.points.len()));
    }
    let settings = Search { seed, unit_scale: 1.0 / spacing, draws: 1500, candidates: REFINED };
    let candidates = search::search(&field, &points, &settings);
    let few = subsample(&points, POINTS[0]);
    let mut rigid: Vec<Scored> = candidates
        .par_iter()
        .filter_map(|candidate| refine(model, &few, to_pose(candidate), &ROUNDS[..2]).ok())
        .collect();
    rigid.sort_by(|a, b| b.explained.total_cmp(&a.explained));
    let many = subsample(&points, POINTS[1]);
    let mut joint: Vec<Scored> = rigid
        .par_iter()
        .take(JOINT)
        .filter_map(|scored| refine(model, &many, scored.pose, &ROUNDS[1..]).ok())
        .collect();
    joint.sort_by(|a, b| b.explained.total_cmp(&a.explained));
    if joint.is_empty() {
        return Err(Error::NoMatch);
    }
    let best = joint.remove(0);
    let runner_up =
        joint.iter().find(|other| apart(&best.pose, &other.pose)).map_or(0.0, |other| other.inliers);
    let placed = Placed { centre, pose: best.pose };
    Ok(Registration { placed, inliers: best.inliers, runner_up })
}

/// Refines a pose that is known roughly.
///
/// # Errors
/// Too little surface, or a pose that is none.
pub fn refine_hint(model: &Model<'_>, scan: &Mesh, hint: &Placed) -> Result<Registration, Error> {
    let (centre, points) = prepare(scan, f64::from(model.header().spacing));
    let pose = Pose { translation: hint.to_model(&centre).coords.map(|c| c as f32).into(), ..hint.pose };
    let Scored { pose, inliers, .. } = refine(model, &subsample(&points, POINTS[1]), pose, &ROUNDS)?;
    Ok(Registration { placed: Placed { centre, pose }, inliers, runner_up: 0.0 })
}

/// Whether two poses differ by more than ten degrees.
fn apart(a: &Pose, b: &Pose) -> bool {
    let trace: f32 =
        a.rotation.as_flattened().iter().zip(b.rotation.as_flattened()).map(|(x, y)| x * y).sum();
    (trace - 1.0) / 2.0 < 10f32.to_radians().cos()
}

struct Scored {
    pose: Pose,
    /// Share of inliers times the squared scale: shrinking must not pay.
    explained: f64,
    inliers: f64,
}

fn refine(
    model: &Model<'_>,
    points: &OrientedPoints,
    pose: Pose,
    rounds: &[Round],
) -> Result<Scored, lacuna::Error> {
    let modes = model.modes();
    let (mut normal, mut chunk) = (vec![0.0; sums_len(modes)], vec![0.0; sums_len(modes)]);
    let (mut row, mut weights) = (vec![0.0; row_len(modes)], vec![0.0; modes]);
    let packed = points.packed();
    let buffers =
        PoseBuffers { normal: &mut normal, chunk: &mut chunk, row: &mut row, weights: &mut weights };
    let (pose, _, weights) = PoseFit::new(model, packed.cloud()?, usize::MAX, pose, rounds, buffers)?.run();
    let inliers = inlier_share(model, packed.cloud()?, &pose, weights);
    let factor = f64::from(pose.scale) * f64::from(model.header().spacing);
    Ok(Scored { pose, explained: inliers * factor * factor, inliers })
}

/// Share of points that lie on the fitted surface and face its way.
fn inlier_share(model: &Model<'_>, cloud: Cloud<'_>, pose: &Pose, weights: &[f32]) -> f64 {
    let points = (0..cloud.len()).filter_map(|i| cloud.point(i));
    let inlier = |&(p, n): &([f32; 3], [f32; 3])| {
        Standing::of(model, pose.apply(p), pose.rotate(n), weights) == Standing::Inlier
    };
    points.filter(inlier).count() as f64 / cloud.len().max(1) as f64
}

fn to_pose(candidate: &Candidate) -> Pose {
    let rotation = candidate.rotation.matrix().transpose().map(|c| c as f32);
    Pose {
        rotation: rotation.into(),
        scale: candidate.scale as f32,
        translation: candidate.translation.map(|c| c as f32).into(),
    }
}

/// About `count` points, evenly over the list.
fn subsample(points: &OrientedPoints, count: usize) -> OrientedPoints {
    let n = points.points.len();
    let chosen = |list: &[Point]| (0..count.min(n)).map(|i| list[i * n / count.min(n)]).collect();
    let normals = (0..count.min(n)).map(|i| points.normals[i * n / count.min(n)]).collect();
    OrientedPoints { points: chosen(&points.points), normals }
}

/// Refuses scans that cannot be of the model's size in the model's unit.
fn check_size(scan: &Mesh, field: &Field, model: &Model<'_>) -> Result<(), Error> {
    let model_size = field.size * f64::from(model.header().spacing);
    let size = size::of_mesh(scan);
    let Some(hint) = size::misfit(size, model_size, model.header().unit) else { return Ok(()) };
    let symbol = unit::symbol(model.header().unit);
    Err(Error::Size { scan: size, model: model_size, unit: symbol, limit: size::LIMIT, hint })
}
