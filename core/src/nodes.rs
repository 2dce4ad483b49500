//! The active nodes: those at a corner of a cell that holds a stored voxel. Only they have weights.
//!
//! They are numbered in x-fastest order through a bit set with running counts.

use crate::error::{Buffer, Error};
use crate::grid::{linear, position, product};
use crate::model::Model;
use crate::workspace::first;

/// Words of the map for a grid of `nodes` nodes.
pub const fn map_len(nodes: usize) -> usize {
    nodes.div_ceil(32) * 2
}

/// Numbers of the active nodes.
#[derive(Debug)]
pub struct NodeMap<'b> {
    sides: [u16; 3],
    /// Per 32 nodes: a bit each, then the active nodes before them.
    words: &'b [u32],
    active: usize,
}

impl<'b> NodeMap<'b> {
    /// The map of a model for a node every `stride` voxels, in a borrowed buffer of [`map_len`] words.
    ///
    /// # Errors
    /// A buffer that is too small.
    pub fn new(model: &Model<'_>, stride: u8, words: &'b mut [u32]) -> Result<Self, Error> {
        let nodes = model.grid().nodes(stride);
        let words = first(words, map_len(nodes), Buffer::Nodes)?;
        let mut active = 0;
        for (block, pair) in words.chunks_exact_mut(2).enumerate() {
            let [bits, before] = pair else { continue };
            (*bits, *before) = (0, active);
            for bit in 0..32 {
                let node = block * 32 + bit;
                if node < nodes && is_active(model, stride, node) {
                    *bits |= 1 << bit;
                    active += 1;
                }
            }
        }
        Ok(Self { sides: model.grid().node_sides(stride), words, active: active as usize })
    }

    /// Nodes along x, y and z.
    pub const fn sides(&self) -> [u16; 3] {
        self.sides
    }

    /// Number of active nodes.
    pub const fn active(&self) -> usize {
        self.active
    }

    /// Number of an active node.
    #[inline]
    pub fn number(&self, node: [u16; 3]) -> Option<usize> {
        let index = linear(node, self.sides);
        let [bits, before] = self.words.get(index / 32 * 2..)?.first_chunk()?;
        let bit = 1u32 << (index % 32);
        (bits & bit != 0).then(|| *before as usize + (bits & (bit - 1)).count_ones() as usize)
    }

    /// The active nodes in the order of their numbers: position in the dense field.
    pub fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.words.chunks_exact(2).enumerate().flat_map(|(block, pair)| {
            let bits = pair.first().copied().unwrap_or(0);
            (0..32).filter(move |bit| bits >> bit & 1 != 0).map(move |bit| block * 32 + bit)
        })
    }

    /// Node position of a place in the dense field.
    #[inline]
    pub const fn position(&self, index: usize) -> [u16; 3] {
        position(index, self.sides)
    }
}

/// Number of active nodes, counted without a buffer.
pub fn count(model: &Model<'_>, stride: u8) -> usize {
    (0..model.grid().nodes(stride)).filter(|&node| is_active(model, stride, node)).count()
}

fn is_active(model: &Model<'_>, stride: u8, node: usize) -> bool {
    let sides = model.grid().node_sides(stride);
    debug_assert!(node < product(sides));
    let at = position(node, sides);
    (0..8u16).any(|c| {
        let [x, y, z] = at;
        let cell = (x.checked_sub(c & 1), y.checked_sub(c >> 1 & 1), z.checked_sub(c >> 2));
        matches!(cell, (Some(x), Some(y), Some(z)) if is_occupied(model, stride, [x, y, z]))
    })
}

/// Whether the cell with its lowest node at `cell` holds a stored voxel.
fn is_occupied(model: &Model<'_>, stride: u8, cell: [u16; 3]) -> bool {
    let q = u16::from(stride);
    let edge = u16::from(model.grid().brick()).max(1);
    let corner = cell.map(|c| c * q);
    let Some(brick) = model.brick_at(corner) else { return false };
    let [x, y, z] = corner.map(|c| (c % edge) as u8);
    let mask = cell_mask(x, stride);
    (z..z + stride).any(|z| (y..y + stride).any(|y| brick.row(y, z).mask & mask != 0))
}

/// Bits of a row that belong to the cell starting at `x`.
#[inline]
pub const fn cell_mask(x: u8, stride: u8) -> u8 {
    (((1u16 << (stride & 15)) - 1) << (x & 7)) as u8
}
