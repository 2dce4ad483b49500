//! Runs the core's completion in buffers of the host: pose, hull, global fit, local fit, distances.

use crate::points::PackedPoints;
use crate::raster;
use lacuna::columns::{Column, PATCH};
use lacuna::completion::{self, Outcome, Settings};
use lacuna::digest::digest;
use lacuna::format::PER_VOXEL;
use lacuna::hull::{Hull, Target};
use lacuna::mirror;
use lacuna::{
    Arithmetic, Completion, Error, LocalFit, Memory, Model, Pose, PoseBuffers, Schedule, Sizes, Workspace,
};
use std::fmt;

/// Results of a fit: distances are one a stored voxel, 1/256 voxel.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Pose, and what the stages counted.
    pub outcome: Outcome,
    /// Weights estimated together with the pose, standard deviations.
    pub shape: Vec<f32>,
    /// Packed hull targets; empty where the fit ran on a device.
    pub targets: Vec<i16>,
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

impl Fit {
    /// Voxels of the hull that only mirror images of the scan reach; unknown of a fit whose hull stayed on a device.
    pub fn mirrored(&self) -> Option<usize> {
        let is_mirrored = |target: &&i16| Target(**target).weight() == mirror::WEIGHT;
        (!self.targets.is_empty()).then(|| self.targets.iter().filter(is_mirrored).count())
    }
}

/// CRC-32 of each stage's result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Digests {
    /// Pose and the weights estimated with it.
    pub pose: u32,
    /// Hull targets.
    pub hull: u32,
    /// Global weights.
    pub global: u32,
    /// Node weights.
    pub local: u32,
    /// Fitted distances.
    pub distances: u32,
}

impl Digests {
    /// Those of the core's stages, and that of the fitted distances.
    pub fn of(outcome: &Outcome, distances: &[i16]) -> Self {
        let completion::Digests { pose, hull, global, local } = outcome.digests;
        Self { pose, hull, global, local, distances: digest(distances.iter().map(|d| d.to_le_bytes())) }
    }

    /// The stages in their order, each with its digest.
    pub const fn named(&self) -> [(&'static str, u32); 5] {
        let Self { pose, hull, global, local, distances } = *self;
        [("pose", pose), ("hull", hull), ("global", global), ("local", local), ("distances", distances)]
    }
}

impl fmt::Display for Digests {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = self.named().map(|(stage, crc)| format!("{stage} {crc:08x}"));
        f.write_str(&words.join(" "))
    }
}

/// Memory of a fit; see [`Memory`].
#[derive(Debug)]
#[allow(missing_docs)] // One field a buffer of `Memory`, which describes them.
pub struct Buffers<A: Arithmetic> {
    pub pose_normal: Vec<f64>,
    pub pose_chunk: Vec<f32>,
    pub pose_columns: Vec<Column>,
    pub pose_weights: Vec<f32>,
    pub targets: Vec<i16>,
    pub normal: Vec<f64>,
    pub block: Vec<i32>,
    pub global: Vec<f64>,
    pub node_weights: Vec<A::Weight>,
    pub previous: Vec<A::Weight>,
    pub residuals: Vec<A::Residual>,
    pub hull_rows: Vec<u8>,
    pub gradient: Vec<A::Sum>,
    pub dense: Vec<A::Sum>,
    pub reciprocals: Vec<A::Reciprocal>,
    pub nodes: Vec<u32>,
    pub cell: Vec<A::Row>,
}

impl<A: Arithmetic> Buffers<A> {
    /// As many elements as `sizes` asks for.
    pub fn new(sizes: &Sizes) -> Self {
        Self {
            pose_normal: vec![0.0; sizes.pose_normal],
            pose_chunk: vec![0.0; sizes.pose_chunk],
            pose_columns: vec![[0; PATCH]; sizes.pose_columns],
            pose_weights: vec![0.0; sizes.pose_weights],
            targets: vec![0; sizes.targets],
            normal: vec![0.0; sizes.normal],
            block: vec![0; sizes.block],
            global: vec![0.0; sizes.global],
            node_weights: vec![A::Weight::default(); sizes.node_weights],
            previous: vec![A::Weight::default(); sizes.previous],
            residuals: vec![A::Residual::default(); sizes.residuals],
            hull_rows: vec![0; sizes.hull_rows],
            gradient: vec![A::Sum::default(); sizes.gradient],
            dense: vec![A::Sum::default(); sizes.dense],
            reciprocals: vec![A::Reciprocal::default(); sizes.reciprocals],
            nodes: vec![0; sizes.nodes],
            cell: vec![A::Row::default(); sizes.cell],
        }
    }

    /// Everything, lent to a completion.
    pub fn memory(&mut self) -> Memory<'_, A> {
        Memory {
            pose: PoseBuffers {
                normal: &mut self.pose_normal,
                chunk: &mut self.pose_chunk,
                columns: &mut self.pose_columns,
                weights: &mut self.pose_weights,
            },
            targets: &mut self.targets,
            normal: &mut self.normal,
            block: &mut self.block,
            global: &mut self.global,
            workspace: Workspace {
                node_weights: &mut self.node_weights,
                previous: &mut self.previous,
                residuals: &mut self.residuals,
                hull_rows: &mut self.hull_rows,
                gradient: &mut self.gradient,
                dense: &mut self.dense,
                reciprocals: &mut self.reciprocals,
                nodes: &mut self.nodes,
                cell: &mut self.cell,
            },
        }
    }
}

/// Fits the model to packed points, from a rough pose unless `settings` has no rounds.
///
/// # Errors
/// A schedule that does not go with the model, or points that miss it.
pub fn fit<A: Arithmetic>(
    model: &Model<'_>,
    points: &PackedPoints,
    pose: &Pose,
    settings: Settings<'_>,
) -> Result<Fit, Error> {
    let schedule = settings.schedule;
    let sizes = Sizes::required(model, &schedule)?;
    let mut buffers = Buffers::<A>::new(&sizes);
    let mut job = Completion::new(model, points.cloud()?, *pose, settings, buffers.memory())?;
    job.run();
    let outcome = job.outcome()?;
    let (targets, global) = (job.hull().targets.to_vec(), job.global().to_vec());
    let shape = job.shape().to_vec();
    let local_distances = job.local().map(|fit| distances(model, fit)).unwrap_or_default();
    let global_distances = global_distances(model, &global, schedule, &mut buffers)?;
    let digests = Digests::of(&outcome, &local_distances);
    let buffer_bytes = sizes.bytes::<A>();
    Ok(Fit { outcome, shape, targets, global, global_distances, local_distances, digests, buffer_bytes })
}

/// Distances of the global fit: those of a local fit that has not moved yet.
///
/// # Errors
/// A schedule that does not go with the model, or buffers that are not for them.
pub fn global_distances<A: Arithmetic>(
    model: &Model<'_>,
    weights: &[f64],
    schedule: Schedule<'_>,
    buffers: &mut Buffers<A>,
) -> Result<Vec<i16>, Error> {
    let still = Schedule { passes: &[], momentum: 0, ..schedule };
    let workspace = buffers.memory().workspace;
    Ok(distances(model, &mut LocalFit::<A>::new(model, Hull::new(&[]), weights, still, workspace)?))
}

fn distances<A: Arithmetic>(model: &Model<'_>, fit: &mut LocalFit<'_, '_, A>) -> Vec<i16> {
    let mut distances = vec![0; model.voxels()];
    for brick in model.bricks() {
        fit.distances(&brick, |voxel, distance| distances[voxel] = distance);
    }
    distances
}

/// The mean shape's distances at the stored voxels, 1/256 voxel.
pub fn means(model: &Model<'_>) -> Vec<i16> {
    model.bricks().flat_map(|brick| (0..brick.voxels()).map(move |voxel| brick.mean(voxel))).collect()
}

/// Distances of stored voxels as a dense volume in voxels, x fastest, NaN where nothing is stored.
pub fn dense(model: &Model<'_>, distances: &[i16]) -> Vec<f32> {
    let sides = model.grid().sides().map(usize::from);
    let mut volume = vec![f32::NAN; raster::len(sides)];
    for brick in model.bricks() {
        for (voxel, place) in brick.places() {
            volume[raster::index(sides, place.map(usize::from))] =
                f32::from(distances[brick.first + voxel]) / PER_VOXEL;
        }
    }
    volume
}
