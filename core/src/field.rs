//! The modes' sum at a voxel, Σ_k b'_k(n) (Σ_j φ_jn V_kj): what residuals and fitted distances share.
//!
//! Within a row of a cell the trilinear weights are linear in x, so the dot products with the weights at the
//! row's two ends are enough for every voxel, and one of them on the cell's face.

use crate::arithmetic::{Arithmetic, Stride};
use crate::cells::{Cell, cells};
use crate::model::Brick;
use crate::nodes::NodeMap;

/// Elements of the scratch memory of [`Field::walk`]: two ends of a row for each mode.
pub const fn ends_len(modes: usize) -> usize {
    2 * modes
}

/// The weights at the active nodes.
#[derive(Clone, Copy, Debug)]
pub struct Field<'a, A: Arithmetic> {
    /// Stride of the nodes.
    pub stride: Stride,
    /// Numbers of the active nodes.
    pub nodes: &'a NodeMap<'a>,
    /// K weights for each active node, mode fastest.
    pub weights: &'a [A::Weight],
    /// K.
    pub modes: usize,
}

impl<A: Arithmetic> Field<'_, A> {
    /// Visits the wanted voxels of a brick (a mask for each of its rows) with the sum of their modes.
    /// `scratch` has [`ends_len`] elements.
    pub fn walk(
        &self,
        brick: &Brick<'_>,
        scratch: &mut [A::Coefficient],
        wanted: &[u8],
        mut visit: impl FnMut(usize, A::Sum),
    ) {
        let Some((near, far)) = scratch.split_at_mut_checked(self.modes) else { return };
        let far = far.get_mut(..self.modes).unwrap_or(&mut []);
        let q = self.stride.voxels;
        for cell in cells(brick, q).filter(|cell| cell.any(brick, wanted, q)) {
            let corners = self.corners(&cell);
            for z in 0..q {
                for y in 0..q {
                    let Some(piece) = cell.piece(brick, wanted, y, z, q) else { continue };
                    let [a, b, c, d, e, f, g, h] = corners;
                    self.row_end([a, c, e, g], [y, z], brick.exponents(), near);
                    self.row_end([b, d, f, h], [y, z], brick.exponents(), far);
                    for (x, voxel) in piece.voxels() {
                        let [near, far] = dots::<A>(brick.basis(voxel), near, far, x);
                        visit(voxel, A::mix(near, far, x, self.stride));
                    }
                }
            }
        }
    }

    /// The weights at the eight corners. All nodes of a cell with a stored voxel are active.
    fn corners(&self, cell: &Cell) -> [&[A::Weight]; 8] {
        let numbers = self.nodes.corners(cell);
        numbers.map(|n| self.weights.get(n * self.modes..).and_then(|w| w.get(..self.modes)).unwrap_or(&[]))
    }

    /// One end of row (y, z) from the nodes at (y0 z0), (y1 z0), (y0 z1), (y1 z1).
    #[inline]
    fn row_end(
        &self,
        [a, b, c, d]: [&[A::Weight]; 4],
        [y, z]: [u8; 2],
        exponents: &[u8],
        out: &mut [A::Coefficient],
    ) {
        let q = self.stride.voxels;
        match (y, z) {
            (0, 0) => self.blend([a], [q * q], exponents, out),
            (y, 0) => self.blend([a, b], [(q - y) * q, y * q], exponents, out),
            (0, z) => self.blend([a, c], [q * (q - z), q * z], exponents, out),
            (y, z) => {
                let (v, w) = (q - y, q - z);
                self.blend([a, b, c, d], [v * w, y * w, v * z, y * z], exponents, out);
            }
        }
    }

    /// Weights of one, two or four nodes, blended by integer shares.
    #[inline(never)]
    fn blend<const N: usize>(
        &self,
        nodes: [&[A::Weight]; N],
        shares: [u8; N],
        exponents: &[u8],
        out: &mut [A::Coefficient],
    ) {
        let mut nodes = nodes.map(|node| node.iter());
        for (value, &exponent) in out.iter_mut().zip(exponents) {
            let weights = nodes.each_mut().map(|node| node.next().copied().unwrap_or_default());
            *value = A::row_end(weights, shares, exponent, self.stride);
        }
    }
}

/// Dot products of a voxel's basis with the ends of its row; the far one does not count on the cell's face.
#[inline(never)]
fn dots<A: Arithmetic>(basis: &[u8], near: &[A::Coefficient], far: &[A::Coefficient], x: u8) -> [A::Sum; 2] {
    let mut sums = [A::Sum::default(); 2];
    let [at_near, at_far] = &mut sums;
    if x == 0 {
        for (&b, &near) in basis.iter().zip(near) {
            *at_near = A::accumulate(*at_near, b as i8, near);
        }
        return sums;
    }
    for ((&b, &near), &far) in basis.iter().zip(near).zip(far) {
        *at_near = A::accumulate(*at_near, b as i8, near);
        *at_far = A::accumulate(*at_far, b as i8, far);
    }
    sums
}
