//! Borrowed memory: how much a fit needs, and the slices it works in.

use crate::arithmetic::Arithmetic;
use crate::box_filter::dense_len;
use crate::columns::Column;
use crate::completion::Memory;
use crate::error::{Buffer, Error};
use crate::global_fit::normal_len;
use crate::gradient::{GROUP, MARGIN};
use crate::hull_rows::rows_len;
use crate::model::Model;
use crate::nodes::{Extent, map_len};
use crate::pose_fit::{columns_len, sums_len};
use crate::schedule::Schedule;

/// How far a job has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Progress {
    /// Pieces of work done.
    pub done: u32,
    /// Pieces of work in all.
    pub total: u32,
}

/// Elements each buffer must have at least. Their types are those of the fields of [`Memory`],
/// [`PoseBuffers`](crate::pose_fit::PoseBuffers) and [`Workspace`]; a build script that calls [`Sizes::required`] can
/// write them as constants for statics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sizes {
    /// Hull targets, i16.
    pub targets: usize,
    /// Weights at the nodes.
    pub weights: usize,
    /// The same before the last step; 0 without momentum.
    pub previous: usize,
    /// Residuals; the hull's keys share this memory in fixed point.
    pub residuals: usize,
    /// Masks of the hull's rows, u8.
    pub hull_rows: usize,
    /// Gradients of a group of modes, or of all modes in two layers of nodes.
    pub gradient: usize,
    /// Dense node field, and the lines of the box filter.
    pub dense: usize,
    /// Reciprocal curvatures, one an active node.
    pub reciprocals: usize,
    /// Node map, u32.
    pub nodes: usize,
    /// Weights and shares of a cell.
    pub cell: usize,
    /// Normal equations of the global fit, f64.
    pub normal: usize,
    /// Sums of the global fit over a brick, i32.
    pub block: usize,
    /// Global weights, f64.
    pub global: usize,
    /// Sums of the pose fit, f64, and again f32.
    pub pose_sums: usize,
    /// Columns of the pose fit, each a [`Column`].
    pub pose_columns: usize,
}

impl Sizes {
    /// What pose, hull, global fit and local fit of a model need together.
    ///
    /// # Errors
    /// A schedule that does not go with the model.
    pub fn required(model: &Model<'_>, schedule: &Schedule<'_>) -> Result<Self, Error> {
        let stride = schedule.check(model)?.voxels;
        let (modes, voxels) = (model.modes(), model.voxels());
        let (Extent { active, widest }, nodes) = (Extent::of(model, stride), model.grid().nodes(stride));
        let weights = active * modes;
        Ok(Self {
            targets: voxels,
            weights,
            previous: if schedule.momentum == 0 { 0 } else { weights },
            residuals: voxels,
            hull_rows: rows_len(model),
            gradient: gradient_len(Extent { active, widest }, modes),
            dense: dense_len(model.grid().node_sides(stride)),
            reciprocals: active,
            nodes: map_len(nodes),
            cell: cell_len(modes, stride),
            normal: normal_len(modes),
            block: normal_len(modes),
            global: modes,
            pose_sums: sums_len(modes),
            pose_columns: columns_len(modes),
        })
    }

    /// The sizes with names for constants, as a build script writes them for statics.
    pub const fn named(&self) -> [(&'static str, usize); 15] {
        [
            ("TARGETS", self.targets),
            ("WEIGHTS", self.weights),
            ("PREVIOUS", self.previous),
            ("RESIDUALS", self.residuals),
            ("HULL_ROWS", self.hull_rows),
            ("GRADIENT", self.gradient),
            ("DENSE", self.dense),
            ("RECIPROCALS", self.reciprocals),
            ("NODES", self.nodes),
            ("CELL", self.cell),
            ("NORMAL", self.normal),
            ("BLOCK", self.block),
            ("GLOBAL", self.global),
            ("POSE_SUMS", self.pose_sums),
            ("POSE_COLUMNS", self.pose_columns),
        ]
    }

    /// Whether the memory of a completion is large enough.
    ///
    /// # Errors
    /// The first buffer that is too small.
    pub fn check<A: Arithmetic>(&self, memory: &Memory<'_, A>) -> Result<(), Error> {
        let Memory { pose, targets, normal, block, global, workspace: w } = memory;
        let buffers = [
            (pose.normal.len(), self.pose_sums, Buffer::PoseSums),
            (pose.chunk.len(), self.pose_sums, Buffer::PoseChunk),
            (pose.columns.len(), self.pose_columns, Buffer::Columns),
            (pose.weights.len(), self.global, Buffer::PoseWeights),
            (targets.len(), self.targets, Buffer::Targets),
            (normal.len(), self.normal, Buffer::Normal),
            (block.len(), self.block, Buffer::Block),
            (global.len(), self.global, Buffer::Weights),
            (w.weights.len(), self.weights, Buffer::NodeWeights),
            (w.previous.len(), self.previous, Buffer::Previous),
            (w.residuals.len(), self.residuals, Buffer::Residuals),
            (w.hull_rows.len(), self.hull_rows, Buffer::HullRows),
            (w.gradient.len(), self.gradient, Buffer::Gradient),
            (w.dense.len(), self.dense, Buffer::Dense),
            (w.reciprocals.len(), self.reciprocals, Buffer::Reciprocals),
            (w.nodes.len(), self.nodes, Buffer::Nodes),
            (w.cell.len(), self.cell, Buffer::Cell),
        ];
        let short = buffers.into_iter().find(|&(given, needed, _)| given < needed);
        short.map_or(Ok(()), |(given, needed, name)| Err(too_small(name, needed, given)))
    }

    /// Bytes of all buffers in an arithmetic; `usize::MAX` if they are more than a `usize` can say.
    pub fn bytes<A: Arithmetic>(&self) -> usize {
        let buffers = [
            (2, self.targets),
            (1, self.hull_rows),
            (size_of::<A::Weight>(), self.weights),
            (size_of::<A::Weight>(), self.previous),
            (size_of::<A::Residual>(), self.residuals),
            (size_of::<A::Sum>(), self.gradient),
            (size_of::<A::Sum>(), self.dense),
            (size_of::<A::Reciprocal>(), self.reciprocals),
            (size_of::<A::Row>(), self.cell),
            (4, self.nodes),
            (4, self.block),
            (8, self.normal),
            (8, self.global),
        ];
        let bytes = buffers.map(|(size, elements)| elements.saturating_mul(size));
        bytes.into_iter().fold(self.pose_bytes(), usize::saturating_add)
    }

    /// Bytes of the pose fit's buffers among them.
    pub const fn pose_bytes(&self) -> usize {
        // Sums in double and in single precision, columns, and a weight a mode.
        let sums = self.pose_sums.saturating_mul(size_of::<f64>() + size_of::<f32>());
        let columns = self.pose_columns.saturating_mul(size_of::<Column>());
        sums.saturating_add(columns).saturating_add(self.global.saturating_mul(size_of::<f32>()))
    }
}

/// The local fit's memory, lent by the caller; by default, none.
#[derive(Debug)]
pub struct Workspace<'b, A: Arithmetic> {
    /// K weights for each active node, mode fastest.
    pub weights: &'b mut [A::Weight],
    /// The weights before the last step; may be empty without momentum.
    pub previous: &'b mut [A::Weight],
    /// Weighted residuals, one a stored voxel.
    pub residuals: &'b mut [A::Residual],
    /// Masks of the hull's rows.
    pub hull_rows: &'b mut [u8],
    /// Gradients of a group of modes at the active nodes, or of all modes in two layers of nodes, mode fastest.
    pub gradient: &'b mut [A::Sum],
    /// A field over all nodes, and the lines of the box filter.
    pub dense: &'b mut [A::Sum],
    /// One over the smoothed curvature at the active nodes.
    pub reciprocals: &'b mut [A::Reciprocal],
    /// Numbers of the active nodes.
    pub nodes: &'b mut [u32],
    /// Weights of a cell, one row a mode, then the shares of its voxels.
    pub cell: &'b mut [A::Row],
}

impl<A: Arithmetic> Default for Workspace<'_, A> {
    fn default() -> Self {
        Self {
            weights: &mut [],
            previous: &mut [],
            residuals: &mut [],
            hull_rows: &mut [],
            gradient: &mut [],
            dense: &mut [],
            reciprocals: &mut [],
            nodes: &mut [],
            cell: &mut [],
        }
    }
}

/// Elements of [`Workspace::cell`]: a row for each mode, in blocks of eight, and one for each voxel of a cell.
pub(crate) const fn cell_len(modes: usize, stride: u8) -> usize {
    let q = stride as usize;
    modes.next_multiple_of(8) + q * q * q
}

/// Elements of [`Workspace::gradient`], and some behind the last node, so that it can be added to in whole vectors.
pub(crate) const fn gradient_len(extent: Extent, modes: usize) -> usize {
    let (group, layers) = (extent.active * GROUP, 2 * extent.widest * modes);
    let needed = if group > layers { group } else { layers };
    needed + MARGIN
}

impl<A: Arithmetic> Workspace<'_, A> {
    /// The same memory, lent on for a while.
    pub const fn reborrow(&mut self) -> Workspace<'_, A> {
        Workspace {
            weights: self.weights,
            previous: self.previous,
            residuals: self.residuals,
            hull_rows: self.hull_rows,
            gradient: self.gradient,
            dense: self.dense,
            reciprocals: self.reciprocals,
            nodes: self.nodes,
            cell: self.cell,
        }
    }
}

/// The first `needed` elements of a buffer.
pub(crate) fn first<T>(buffer: &mut [T], needed: usize, name: Buffer) -> Result<&mut [T], Error> {
    let given = buffer.len();
    buffer.get_mut(..needed).ok_or(too_small(name, needed, given))
}

fn too_small(buffer: Buffer, needed: usize, given: usize) -> Error {
    let [needed, given] = [needed, given].map(|n| u32::try_from(n).unwrap_or(u32::MAX));
    Error::BufferTooSmall { buffer, needed, given }
}
