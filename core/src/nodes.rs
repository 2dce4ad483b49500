//! The active nodes: those at a corner of a cell that holds a stored voxel. Only they have weights.
//!
//! They are numbered in x-fastest order through a bit set with running counts.

use crate::brick::MAX_BRICK_ROWS;
use crate::cells::{Cell, cell_mask, cells};
use crate::error::{Buffer, Error};
use crate::grid::{linear, product};
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
        let words = first(words, map_len(model.grid().nodes(stride)), Buffer::Nodes)?;
        let sides = model.grid().node_sides(stride);
        words.fill(0);
        let mut masks = [0; MAX_BRICK_ROWS];
        for brick in model.bricks() {
            let stored = brick.row_masks(&mut masks);
            for cell in cells(&brick, stride).filter(|cell| cell.any(&brick, stored, stride)) {
                (0..8).for_each(|c| mark(words, linear(cell.corner_node(c), sides)));
            }
        }
        Ok(Self::numbered(sides, words))
    }

    /// The map of a grid of nodes from a test for each.
    #[cfg(test)]
    pub(crate) fn of(sides: [u16; 3], is_active: impl Fn(usize) -> bool, words: &'b mut [u32]) -> Self {
        words.fill(0);
        (0..product(sides)).filter(|&node| is_active(node)).for_each(|node| mark(words, node));
        Self::numbered(sides, words)
    }

    /// Counts the marked nodes.
    fn numbered(sides: [u16; 3], words: &'b mut [u32]) -> Self {
        let mut active = 0;
        for [bits, before] in words.as_chunks_mut().0 {
            *before = active;
            active += bits.count_ones();
        }
        Self { sides, words, active: active as usize }
    }

    /// Active nodes in the layers before layer `z`.
    pub fn before(&self, z: u16) -> usize {
        let [x, y, _] = self.sides;
        self.before_node(product([x, y, z]))
    }

    /// Active nodes before the node at `index` of the grid.
    #[inline]
    fn before_node(&self, index: usize) -> usize {
        match self.words.get(index / 32 * 2..).and_then(|words| words.first_chunk()) {
            Some([bits, before]) => {
                *before as usize + (bits & ((1 << (index % 32)) - 1)).count_ones() as usize
            }
            None => self.active,
        }
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

    /// Numbers of the eight corners of a cell that holds a stored voxel: there all of them are active, so that the
    /// second of each pair along x follows the first.
    #[inline]
    pub fn corners(&self, cell: &Cell) -> [usize; 8] {
        let [width, height, _] = self.sides.map(usize::from);
        let (first, area) = (linear(cell.node, self.sides), width * height);
        let [a, b, c, d] = [0, width, area, area + width].map(|offset| self.before_node(first + offset));
        [a, a + 1, b, b + 1, c, c + 1, d, d + 1]
    }
}

impl NodeMap<'_> {
    /// Visits the active nodes in runs of neighbours along x: number and position of the first one, length.
    #[inline]
    pub fn for_each_run(&self, mut visit: impl FnMut(usize, usize, usize)) {
        let width = usize::from(self.sides[0]).max(1);
        let (mut number, mut end) = (0, width);
        for (block, &[mut bits, _]) in self.words.as_chunks::<2>().0.iter().enumerate() {
            let mut index = block * 32;
            while bits != 0 {
                let skipped = bits.trailing_zeros();
                bits >>= skipped;
                index += skipped as usize;
                while index >= end {
                    end += width;
                }
                let length = (bits.trailing_ones() as usize).min(end - index);
                visit(number, index, length);
                // At most 32 bits, so not in one shift.
                bits = bits >> 1 >> ((length - 1) & 31);
                index += length;
                number += length;
            }
        }
    }
}

fn mark(words: &mut [u32], node: usize) {
    if let Some(bits) = words.get_mut(node / 32 * 2) {
        *bits |= 1 << (node % 32);
    }
}

/// How many active nodes a model has, and how many of them its widest layer of constant z.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Extent {
    /// Active nodes.
    pub active: usize,
    /// Active nodes of the widest layer.
    pub widest: usize,
}

impl Extent {
    /// Counts without a buffer: every node near a stored brick looks at the cells around it. The work is bounded by the
    /// length of the model.
    pub fn of(model: &Model<'_>, stride: u8) -> Self {
        let depth = model.grid().node_sides(stride)[2];
        (0..depth).map(|z| active_of_layer(model, stride, z)).fold(Self::default(), |extent, nodes| Self {
            active: extent.active + nodes,
            widest: extent.widest.max(nodes),
        })
    }
}

/// Active nodes of a layer of constant z: those of a brick are looked at only where it, or one before it, is stored.
fn active_of_layer(model: &Model<'_>, stride: u8, z: u16) -> usize {
    let side = u16::from(model.grid().brick().checked_div(stride).unwrap_or(1)).max(1);
    let [width, height, _] = model.grid().node_sides(stride);
    let starts = |end: u16| (0..end).step_by(usize::from(side));
    let of_brick = |start: u16, end: u16| start..(start + side).min(end);
    let mut active = 0;
    for (y, x) in starts(height).flat_map(|y| starts(width).map(move |x| (y, x))) {
        if lies_near_stored(model, [x, y, z].map(|node| node.checked_div(side).unwrap_or(0))) {
            let nodes = of_brick(y, height).flat_map(|y| of_brick(x, width).map(move |x| [x, y, z]));
            active += nodes.filter(|&node| is_active(model, stride, node)).count();
        }
    }
    active
}

/// Whether the brick at a position of the grid of bricks, or one before it in any direction, is stored.
fn lies_near_stored(model: &Model<'_>, brick: [u16; 3]) -> bool {
    cells_before(brick).any(|brick| model.brick_of_cell(brick).is_some())
}

/// The up to eight cells of which a node is a corner; bricks around one in the same way.
fn cells_before([x, y, z]: [u16; 3]) -> impl Iterator<Item = [u16; 3]> {
    (0..8u16).filter_map(move |c| {
        Some([x.checked_sub(c & 1)?, y.checked_sub(c >> 1 & 1)?, z.checked_sub(c >> 2)?])
    })
}

fn is_active(model: &Model<'_>, stride: u8, node: [u16; 3]) -> bool {
    cells_before(node).any(|cell| is_occupied(model, stride, cell))
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
