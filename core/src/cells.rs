//! The cells of a brick: cubes of q³ voxels between eight nodes, walked row by row.

use crate::brick::{Brick, ones};

/// A cell within a brick.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// First voxel of the cell within the brick.
    pub corner: [u8; 3],
    /// Node at that voxel.
    pub node: [u16; 3],
}

/// The wanted voxels of a row of a cell.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    /// Bit x is set where the voxel x behind the cell's face is wanted; never 0.
    pub mask: u8,
    /// The same for the stored ones.
    stored: u8,
    /// Voxels of the brick before the cell's face in this row.
    first: usize,
}

/// Bits of a row that belong to the cell starting at `x`.
#[inline]
pub const fn cell_mask(x: u8, stride: u8) -> u8 {
    (((1u16 << (stride & 15)) - 1) << (x & 7)) as u8
}

/// The cells of a brick.
pub fn cells(brick: &Brick<'_>, stride: u8) -> impl Iterator<Item = Cell> + use<> {
    let (corner, edge) = (brick.corner, brick.edge());
    (0..edge / stride.max(1)).flat_map(move |z| layer(corner, edge, stride, z))
}

/// The cells of a brick in its layer `z` of cells.
pub fn cells_of_layer(brick: &Brick<'_>, stride: u8, z: u8) -> impl Iterator<Item = Cell> + use<> {
    layer(brick.corner, brick.edge(), stride, z)
}

fn layer([a, b, c]: [u16; 3], edge: u8, stride: u8, z: u8) -> impl Iterator<Item = Cell> {
    let q = stride.max(1);
    let side = edge / q;
    (0..side).flat_map(move |y| {
        (0..side).map(move |x| {
            let within = [x * q, y * q, z * q];
            let [x, y, z] = within.map(u16::from);
            let node = [a + x, b + y, c + z].map(|v| v.checked_div(u16::from(q)).unwrap_or(0));
            Cell { corner: within, node }
        })
    })
}

impl Cell {
    /// Node at corner `c` of 8: bit 0 is x, bit 1 is y, bit 2 is z.
    #[inline]
    pub const fn corner_node(&self, c: u16) -> [u16; 3] {
        let [x, y, z] = self.node;
        [x + (c & 1), y + (c >> 1 & 1), z + (c >> 2 & 1)]
    }

    /// Row (y, z) of the cell, by the wanted voxels of each row of the brick; `None` if there is none in it.
    #[inline]
    pub fn piece(&self, brick: &Brick<'_>, wanted: &[u8], y: u8, z: u8, stride: u8) -> Option<Piece> {
        let [x0, y0, z0] = self.corner;
        let index = usize::from(z0 + z) * usize::from(brick.edge()) + usize::from(y0 + y);
        let wanted = wanted.get(index)? & cell_mask(x0, stride);
        if wanted == 0 {
            return None;
        }
        let row = brick.row(y0 + y, z0 + z);
        let at_face = |mask: u8| mask >> (x0 & 7);
        Some(Piece { mask: at_face(wanted), stored: at_face(row.mask), first: row.rank(x0) })
    }

    /// Visits the wanted voxels of the cell: position within it and number within the brick.
    #[inline(always)]
    pub fn visit(&self, brick: &Brick<'_>, wanted: &[u8], q: u8, mut visit: impl FnMut([u8; 3], usize)) {
        for z in 0..q {
            for y in 0..q {
                let Some(piece) = self.piece(brick, wanted, y, z, q) else { continue };
                for (x, voxel) in piece.voxels() {
                    visit([x, y, z], voxel);
                }
            }
        }
    }

    /// Whether a voxel of the cell is wanted.
    #[inline]
    pub fn any(&self, brick: &Brick<'_>, wanted: &[u8], stride: u8) -> bool {
        let [x0, y0, z0] = self.corner;
        let mask = cell_mask(x0, stride);
        (z0..z0 + stride).any(|z| {
            let start = usize::from(z) * usize::from(brick.edge()) + usize::from(y0);
            let rows = wanted.get(start..).and_then(|rows| rows.get(..usize::from(stride)));
            rows.is_some_and(|rows| rows.iter().any(|row| row & mask != 0))
        })
    }
}

impl Piece {
    /// Offset from the cell's face and number within the brick of each wanted voxel.
    #[inline]
    pub fn voxels(self) -> impl Iterator<Item = (u8, usize)> {
        let Self { mask: mut left, stored, first } = self;
        core::iter::from_fn(move || {
            let x = left.trailing_zeros() as u8;
            let lowest = left & left.wrapping_neg();
            left ^= lowest;
            (lowest != 0).then(|| (x, first + ones(stored & lowest.wrapping_sub(1))))
        })
    }
}
