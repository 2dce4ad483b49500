//! Memory of the local fit, and the error for a buffer that is too small.

use crate::arithmetic::Arithmetic;
use crate::error::{Buffer, Error};
use crate::gradient::{GROUP, MARGIN};
use crate::nodes::Extent;

/// The local fit's memory, lent by the caller; by default, none.
#[derive(Debug)]
pub struct Workspace<'b, A: Arithmetic> {
    /// K weights for each active node, mode fastest.
    pub node_weights: &'b mut [A::Weight],
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
    /// Weights of a cell, one row a mode, then the corner residuals of its voxels.
    pub cell: &'b mut [A::Row],
}

impl<A: Arithmetic> Default for Workspace<'_, A> {
    fn default() -> Self {
        Self {
            node_weights: &mut [],
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
    let group = extent.active.saturating_mul(GROUP);
    let layers = extent.widest.saturating_mul(modes).saturating_mul(2);
    let needed = if group > layers { group } else { layers };
    needed.saturating_add(MARGIN)
}

impl<A: Arithmetic> Workspace<'_, A> {
    /// The same memory, lent on for a while.
    pub const fn reborrow(&mut self) -> Workspace<'_, A> {
        Workspace {
            node_weights: self.node_weights,
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

/// The error for a buffer of `given` elements where `needed` are needed.
pub(crate) fn too_small(buffer: Buffer, needed: usize, given: usize) -> Error {
    let [needed, given] = [needed, given].map(|n| u32::try_from(n).unwrap_or(u32::MAX));
    Error::BufferTooSmall { buffer, needed, given }
}
