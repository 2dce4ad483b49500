//! The walk over a brick's cells that residuals and distances share: interpolates the weights to each
//! voxel and sums its modes, Σ_k b'_k(n) (Σ_j φ_jn V_kj).
//!
//! Within a row of a cell the trilinear weights are linear in x, so two dot products with the weights at
//! the row's ends are enough for every voxel.

use crate::arithmetic::{Arithmetic, Stride};
use crate::model::{Brick, Row};
use crate::nodes::{NodeMap, cell_mask};

/// Coefficients needed for one cell: 8 corners, 4 edges of a slice, 2 ends of a row, for each mode.
pub const fn cell_len(modes: usize) -> usize {
    14 * modes
}

/// A cell within a brick.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// First voxel of the cell within the brick.
    pub corner: [u8; 3],
    /// Node at that voxel.
    pub node: [u16; 3],
}

/// The cells of a brick.
pub fn cells(brick: &Brick<'_>, stride: u8) -> impl Iterator<Item = Cell> + use<> {
    let (corner, edge) = (brick.corner, brick.edge());
    let q = stride.max(1);
    let side = edge / q;
    (0..side).flat_map(move |z| {
        (0..side).flat_map(move |y| {
            (0..side).map(move |x| {
                let within = [x * q, y * q, z * q];
                let [a, b, c] = corner;
                let [x, y, z] = within.map(u16::from);
                let node = [a + x, b + y, c + z].map(|v| v.checked_div(u16::from(q)).unwrap_or(0));
                Cell { corner: within, node }
            })
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

    /// The part of row (y, z) of the cell that is stored: its mask, and the row for numbering.
    #[inline]
    pub fn row(&self, brick: &Brick<'_>, y: u8, z: u8, stride: u8) -> (u8, Row) {
        let [x0, y0, z0] = self.corner;
        let row = brick.row(y0 + y, z0 + z);
        (row.mask & cell_mask(x0, stride), row)
    }

    /// The stored voxels of row (y, z): offset from the cell's face and number within the brick.
    #[inline]
    pub fn voxels(
        &self,
        brick: &Brick<'_>,
        y: u8,
        z: u8,
        stride: u8,
    ) -> impl Iterator<Item = (u8, usize)> + use<> {
        let (mask, row) = self.row(brick, y, z, stride);
        let x0 = self.corner[0];
        let first = row.rank(x0);
        (0..stride).filter(move |x| mask >> (x0 + x) & 1 != 0).enumerate().map(move |(i, x)| (x, first + i))
    }

    /// Whether a stored voxel of the cell is `wanted` (asked by its number within the brick).
    #[inline]
    pub fn any(&self, brick: &Brick<'_>, stride: u8, wanted: impl Fn(usize) -> bool) -> bool {
        (0..stride).any(|z| (0..stride).any(|y| self.voxels(brick, y, z, stride).any(|(_, v)| wanted(v))))
    }
}

/// What the walk reads: the weights at the active nodes, mode fastest.
#[derive(Clone, Copy, Debug)]
pub struct Field<'a, A: Arithmetic> {
    /// Stride of the nodes.
    pub stride: Stride,
    /// Numbers of the active nodes.
    pub nodes: &'a NodeMap<'a>,
    /// K weights for each active node.
    pub weights: &'a [A::Weight],
    /// K.
    pub modes: usize,
}

impl<A: Arithmetic> Field<'_, A> {
    /// Visits the wanted voxels of a brick with the sum of their modes. `scratch` has [`cell_len`] elements.
    pub fn walk(
        &self,
        brick: &Brick<'_>,
        scratch: &mut [A::Coefficient],
        wanted: impl Fn(usize) -> bool,
        mut visit: impl FnMut(usize, A::Sum),
    ) {
        let Some((corners, rest)) = scratch.split_at_mut_checked(8 * self.modes) else { return };
        let Some((edges, rest)) = rest.split_at_mut_checked(4 * self.modes) else { return };
        let Some((near, rest)) = rest.split_at_mut_checked(self.modes) else { return };
        let Some((far, _)) = rest.split_at_mut_checked(self.modes) else { return };
        let q = self.stride.voxels;
        for cell in cells(brick, q) {
            if !cell.any(brick, q, &wanted) {
                continue;
            }
            self.load(&cell, brick.exponents(), corners);
            for z in 0..q {
                lerp_blocks::<A>(corners, 4 * self.modes, edges, z, self.stride);
                for y in 0..q {
                    if !cell.voxels(brick, y, z, q).any(|(_, v)| wanted(v)) {
                        continue;
                    }
                    // Edges in the order (x0 y0), (x1 y0), (x0 y1), (x1 y1).
                    self.row_end(edges, 0, near, y);
                    self.row_end(edges, 1, far, y);
                    for (x, voxel) in cell.voxels(brick, y, z, q).filter(|&(_, v)| wanted(v)) {
                        let basis = brick.basis(voxel);
                        let sum = A::mix(dot::<A>(basis, near), dot::<A>(basis, far), x, self.stride);
                        visit(voxel, sum);
                    }
                }
            }
        }
    }

    /// Coefficients of the eight corners; an inactive node counts as zero (no stored voxel leans on it).
    fn load(&self, cell: &Cell, exponents: &[u8], corners: &mut [A::Coefficient]) {
        for (c, block) in (0u16..).zip(corners.chunks_exact_mut(self.modes.max(1))) {
            let number = self.nodes.number(cell.corner_node(c));
            let weights = number.and_then(|n| self.weights.get(n * self.modes..)).unwrap_or(&[]);
            for ((value, &weight), &exponent) in block.iter_mut().zip(weights).zip(exponents) {
                *value = A::coefficient(weight, exponent, self.stride);
            }
        }
    }

    fn row_end(&self, edges: &[A::Coefficient], end: usize, out: &mut [A::Coefficient], y: u8) {
        let low = edges.get(end * self.modes..).unwrap_or(&[]);
        let high = edges.get((end + 2) * self.modes..).unwrap_or(&[]);
        for ((value, &a), &b) in out.iter_mut().zip(low).zip(high) {
            *value = A::row_end(A::lerp(a, b, y, self.stride));
        }
    }
}

/// out = lerp(first half, second half) of `blocks`, halves of `length`.
fn lerp_blocks<A: Arithmetic>(
    blocks: &[A::Coefficient],
    length: usize,
    out: &mut [A::Coefficient],
    at: u8,
    stride: Stride,
) {
    let Some((low, high)) = blocks.split_at_checked(length) else { return };
    for ((value, &a), &b) in out.iter_mut().zip(low).zip(high) {
        *value = A::lerp(a, b, at, stride);
    }
}

#[inline(always)]
fn dot<A: Arithmetic>(basis: &[u8], coefficients: &[A::Coefficient]) -> A::Sum {
    let mut sum = A::Sum::default();
    for (&b, &c) in basis.iter().zip(coefficients) {
        sum = A::accumulate(sum, b as i8, c);
    }
    sum
}
