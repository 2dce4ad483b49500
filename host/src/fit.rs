//! Runs the core's fit with buffers of the host: hull, global fit, local fit, distances.

use crate::points::OrientedPoints;
use lacuna::format::digest;
use lacuna::{Arithmetic, Error, Fixed, GlobalFit, HullBuilder, LocalFit, Model, Pose, Reach, Schedule};
use lacuna::{Sizes, Workspace};

/// Results of a fit: distances are one a stored voxel, 1/256 voxel.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Packed hull targets.
    pub targets: Vec<i16>,
    /// Voxels in the hull.
    pub hull_voxels: u32,
    /// Global weights, standard deviations.
    pub global: Vec<f64>,
    /// Distances of the global fit.
    pub global_distances: Vec<i16>,
    /// Distances of the local fit.
    pub local_distances: Vec<i16>,
    /// What the stages computed, for comparing builds.
    pub digests: Digests,
    /// Bytes of the buffers the fit ran in.
    pub buffer_bytes: usize,
}

/// CRC-32 of each stage's result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Digests {
    /// Hull targets.
    pub hull: u32,
    /// Global weights.
    pub global: u32,
    /// Node weights.
    pub local: u32,
    /// Fitted distances.
    pub distances: u32,
}

/// Memory of a fit.
struct Buffers<A: Arithmetic> {
    targets: Vec<i16>,
    keys: Vec<i16>,
    weights: Vec<A::Weight>,
    previous: Vec<A::Weight>,
    residuals: Vec<A::Residual>,
    gradient: Vec<A::Sum>,
    dense: Vec<A::Sum>,
    reciprocals: Vec<A::Reciprocal>,
    nodes: Vec<u32>,
    cell: Vec<A::Coefficient>,
    normal: Vec<f64>,
    block: Vec<i32>,
    global: Vec<f64>,
}

/// Lends the local fit its part of the buffers, leaving the others free.
macro_rules! workspace {
    ($buffers:expr) => {
        Workspace {
            weights: &mut $buffers.weights,
            previous: &mut $buffers.previous,
            residuals: &mut $buffers.residuals,
            gradient: &mut $buffers.gradient,
            dense: &mut $buffers.dense,
            reciprocals: &mut $buffers.reciprocals,
            nodes: &mut $buffers.nodes,
            cell: &mut $buffers.cell,
        }
    };
}

impl<A: Arithmetic> Buffers<A> {
    fn new(sizes: &Sizes) -> Self {
        Self {
            targets: vec![0; sizes.targets],
            keys: vec![0; sizes.targets],
            weights: vec![A::Weight::default(); sizes.weights],
            previous: vec![A::Weight::default(); sizes.previous],
            residuals: vec![A::Residual::default(); sizes.residuals],
            gradient: vec![A::Sum::default(); sizes.gradient],
            dense: vec![A::Sum::default(); sizes.dense],
            reciprocals: vec![A::Reciprocal::default(); sizes.reciprocals],
            nodes: vec![0; sizes.nodes],
            cell: vec![A::Coefficient::default(); sizes.cell],
            normal: vec![0.0; sizes.normal],
            block: vec![0; sizes.block],
            global: vec![0.0; sizes.global],
        }
    }
}

/// Fits the model to oriented points in a known pose.
///
/// # Errors
/// A schedule that does not go with the model, or points that miss it.
pub fn fit<A: Arithmetic>(
    model: &Model<'_>,
    points: &OrientedPoints,
    pose: &Pose,
    reach: Reach,
    schedule: Schedule<'_>,
) -> Result<Fit, Error> {
    let sizes = Sizes::required(model, &schedule)?;
    let mut b = Buffers::<A>::new(&sizes);
    let mut builder = HullBuilder::new(model, reach, &mut b.targets, &mut b.keys)?;
    for (point, normal) in points.points.iter().zip(&points.normals) {
        let point = pose.apply(point.coords.map(|c| c as f32).into());
        builder.add(point, pose.rotate(normal.map(|c| c as f32).into()));
    }
    let hull = builder.finish();
    let (hull_voxels, hull_digest) = (hull.count, hull.digest());
    let global = GlobalFit::new(model, hull, None, &mut b.normal, &mut b.block, &mut b.global)?.run();
    let still = Schedule { stride: schedule.stride, momentum: 0, passes: &[] };
    let global_distances =
        distances(model, &mut LocalFit::<A>::new(model, hull, global, still, workspace!(b))?);
    let mut local = LocalFit::<A>::new(model, hull, global, schedule, workspace!(b))?;
    local.run();
    let local_distances = distances(model, &mut local);
    let quantised = |weight: &f64| Fixed::weight(*weight).to_le_bytes();
    let node_weights = local.weights().iter().map(|&w| Fixed::weight(A::sigma(w)).to_le_bytes());
    let digests = Digests {
        hull: hull_digest,
        global: digest(global.iter().map(quantised)),
        local: digest(node_weights),
        distances: digest(local_distances.iter().map(|d| d.to_le_bytes())),
    };
    let global = global.to_vec();
    let buffer_bytes = sizes.bytes::<A>();
    Ok(Fit {
        targets: b.targets,
        hull_voxels,
        global,
        global_distances,
        local_distances,
        digests,
        buffer_bytes,
    })
}

fn distances<A: Arithmetic>(model: &Model<'_>, fit: &mut LocalFit<'_, '_, A>) -> Vec<i16> {
    let mut distances = vec![0; model.voxels()];
    for brick in model.bricks() {
        fit.distances(&brick, |voxel, distance| distances[voxel] = distance);
    }
    distances
}

/// Distances of stored voxels as a dense volume in voxels, x fastest, NaN where nothing is stored.
pub fn dense(model: &Model<'_>, distances: &[i16]) -> Vec<f32> {
    let [width, height, depth] = model.grid().sides().map(usize::from);
    let mut volume = vec![f32::NAN; width * height * depth];
    for brick in model.bricks() {
        let [cx, cy, cz] = brick.corner.map(usize::from);
        for z in 0..brick.edge() {
            for y in 0..brick.edge() {
                let row = brick.row(y, z);
                let start = ((cz + usize::from(z)) * height + cy + usize::from(y)) * width + cx;
                for x in 0..brick.edge() {
                    if let Some(voxel) = row.voxel(x) {
                        volume[start + usize::from(x)] = f32::from(distances[brick.first + voxel]) / 256.0;
                    }
                }
            }
        }
    }
    volume
}
