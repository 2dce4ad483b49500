//! How much memory a completion needs: elements of each buffer, known before there is one.

use crate::arithmetic::{Arithmetic, Fixed};
use crate::box_filter::dense_len;
use crate::error::Error;
use crate::global_fit::normal_len;
use crate::hull_rows::rows_len;
use crate::memory::{BUFFERS, Memory, POSE_BUFFERS};
use crate::model::Model;
use crate::nodes::{Extent, map_len};
use crate::pose_fit::{columns_len, sums_len};
use crate::schedule::Schedule;
use crate::workspace::{cell_len, gradient_len, too_small};

/// Elements each buffer must have at least. Their types are those of the fields of [`Memory`],
/// [`PoseBuffers`](crate::PoseBuffers) and [`Workspace`](crate::Workspace); a build script that calls [`Sizes::required`] can
/// write them as constants for statics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sizes {
    /// Normal equations of the pose fit, f64.
    pub pose_normal: usize,
    /// The same of one patch of points, f32.
    pub pose_chunk: usize,
    /// Columns of the pose fit, each a [`Column`](crate::columns::Column).
    pub pose_columns: usize,
    /// Weights of the pose fit, f32.
    pub pose_weights: usize,
    /// Hull targets, i16.
    pub targets: usize,
    /// Normal equations of the global fit, f64.
    pub normal: usize,
    /// The same of one brick, i32.
    pub block: usize,
    /// Global weights, f64.
    pub global: usize,
    /// Weights at the nodes.
    pub node_weights: usize,
    /// The same before the last step; 0 without momentum.
    pub previous: usize,
    /// Residuals; the hull's keys share this memory.
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
    /// Weights and corner residuals of a cell.
    pub cell: usize,
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
        // More than a usize can say is more than any memory has.
        let node_weights = active.saturating_mul(modes);
        Ok(Self {
            pose_normal: sums_len(modes),
            pose_chunk: sums_len(modes),
            pose_columns: columns_len(modes),
            pose_weights: modes,
            targets: voxels,
            normal: normal_len(modes),
            block: normal_len(modes),
            global: modes,
            node_weights,
            previous: if schedule.momentum == 0 { 0 } else { node_weights },
            residuals: voxels,
            hull_rows: rows_len(model),
            gradient: gradient_len(Extent { active, widest }, modes),
            dense: dense_len(model.grid().node_sides(stride)),
            reciprocals: active,
            nodes: map_len(nodes),
            cell: cell_len(modes, stride),
        })
    }

    /// The sizes with names for constants, as a build script writes them for statics: those of
    /// [`Buffer`](crate::error::Buffer), in the order in which they are checked.
    pub const fn named(&self) -> [(&'static str, usize); BUFFERS] {
        [
            ("POSE_NORMAL", self.pose_normal),
            ("POSE_CHUNK", self.pose_chunk),
            ("POSE_COLUMNS", self.pose_columns),
            ("POSE_WEIGHTS", self.pose_weights),
            ("TARGETS", self.targets),
            ("NORMAL", self.normal),
            ("BLOCK", self.block),
            ("GLOBAL", self.global),
            ("NODE_WEIGHTS", self.node_weights),
            ("PREVIOUS", self.previous),
            ("RESIDUALS", self.residuals),
            ("HULL_ROWS", self.hull_rows),
            ("GRADIENT", self.gradient),
            ("DENSE", self.dense),
            ("RECIPROCALS", self.reciprocals),
            ("NODES", self.nodes),
            ("CELL", self.cell),
        ]
    }

    /// Whether the memory of a completion is large enough.
    ///
    /// # Errors
    /// The first buffer that is too small.
    pub fn check<A: Arithmetic>(&self, memory: &Memory<'_, A>) -> Result<(), Error> {
        let mut buffers = memory.buffers().into_iter().zip(self.named());
        let short = buffers.find(|(buffer, (_, needed))| buffer.elements < *needed);
        short.map_or(Ok(()), |(buffer, (_, needed))| Err(too_small(buffer.name, needed, buffer.elements)))
    }

    /// Bytes of all buffers in an arithmetic; `usize::MAX` if they are more than a `usize` can say.
    pub fn bytes<A: Arithmetic>(&self) -> usize {
        self.bytes_of_first::<A>(BUFFERS)
    }

    /// Bytes of the pose fit's buffers among them.
    pub fn pose_bytes(&self) -> usize {
        // They are the same in every arithmetic.
        self.bytes_of_first::<Fixed>(POSE_BUFFERS)
    }

    fn bytes_of_first<A: Arithmetic>(&self, count: usize) -> usize {
        let none = Memory::<A>::default();
        let bytes = none
            .buffers()
            .into_iter()
            .zip(self.named())
            .map(|(buffer, (_, n))| n.saturating_mul(buffer.size));
        bytes.take(count).fold(0, usize::saturating_add)
    }
}
