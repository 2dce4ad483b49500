//! Borrowed memory: how much a fit needs, and the slices it works in.

use crate::arithmetic::Arithmetic;
use crate::cells::cell_len;
use crate::error::{Buffer, Error};
use crate::global_fit::normal_len;
use crate::local_fit::GROUP;
use crate::model::Model;
use crate::nodes::{count, map_len};
use crate::schedule::Schedule;

/// How far a job has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Pieces of work done.
    pub done: u32,
    /// Pieces of work in all.
    pub total: u32,
}

/// Elements each buffer must have at least; see [`Workspace`] for their types.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sizes {
    /// Hull targets, i16.
    pub targets: usize,
    /// Weights at the nodes.
    pub weights: usize,
    /// The same before the last step; 0 without momentum.
    pub previous: usize,
    /// Residuals; the hull's keys share this memory in fixed point.
    pub residuals: usize,
    /// Gradients of a group of modes.
    pub gradient: usize,
    /// Dense node field.
    pub dense: usize,
    /// Reciprocal curvatures.
    pub reciprocals: usize,
    /// Node map, u32.
    pub nodes: usize,
    /// Coefficients of one cell.
    pub cell: usize,
    /// Normal equations of the global fit, f64.
    pub normal: usize,
    /// Sums of the global fit over a brick, i32.
    pub block: usize,
    /// Global weights, f64.
    pub global: usize,
}

impl Sizes {
    /// What hull, global fit and local fit of a model need together.
    ///
    /// # Errors
    /// A schedule that does not go with the model.
    pub fn required(model: &Model<'_>, schedule: &Schedule<'_>) -> Result<Self, Error> {
        let stride = schedule.check(model)?.voxels;
        let (modes, voxels) = (model.modes(), model.voxels());
        let (active, nodes) = (count(model, stride), model.grid().nodes(stride));
        let weights = active * modes;
        Ok(Self {
            targets: voxels,
            weights,
            previous: if schedule.momentum == 0 { 0 } else { weights },
            residuals: voxels,
            gradient: active * GROUP,
            dense: nodes,
            reciprocals: active,
            nodes: map_len(nodes),
            cell: cell_len(modes),
            normal: normal_len(modes),
            block: normal_len(modes),
            global: modes,
        })
    }

    /// Bytes of all buffers in an arithmetic.
    pub const fn bytes<A: Arithmetic>(&self) -> usize {
        2 * self.targets
            + size_of::<A::Weight>() * (self.weights + self.previous)
            + size_of::<A::Residual>() * self.residuals
            + size_of::<A::Sum>() * (self.gradient + self.dense)
            + size_of::<A::Reciprocal>() * self.reciprocals
            + size_of::<A::Coefficient>() * self.cell
            + 4 * (self.nodes + self.block)
            + 8 * (self.normal + self.global)
    }
}

/// The local fit's memory, lent by the caller.
#[derive(Debug)]
pub struct Workspace<'b, A: Arithmetic> {
    /// K weights for each active node, mode fastest.
    pub weights: &'b mut [A::Weight],
    /// The weights before the last step; may be empty without momentum.
    pub previous: &'b mut [A::Weight],
    /// Weighted residuals, one a stored voxel.
    pub residuals: &'b mut [A::Residual],
    /// Gradients of a group of modes at the active nodes, mode fastest.
    pub gradient: &'b mut [A::Sum],
    /// A field over all nodes.
    pub dense: &'b mut [A::Sum],
    /// One over the smoothed curvature at the active nodes.
    pub reciprocals: &'b mut [A::Reciprocal],
    /// Numbers of the active nodes.
    pub nodes: &'b mut [u32],
    /// Coefficients of one cell.
    pub cell: &'b mut [A::Coefficient],
}

/// The first `needed` elements of a buffer.
pub(crate) fn first<T>(buffer: &mut [T], needed: usize, name: Buffer) -> Result<&mut [T], Error> {
    let given = buffer.len();
    buffer.get_mut(..needed).ok_or(Error::BufferTooSmall {
        buffer: name,
        needed: u32::try_from(needed).unwrap_or(u32::MAX),
        given: u32::try_from(given).unwrap_or(u32::MAX),
    })
}
