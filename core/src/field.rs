//! The modes' sum at a voxel, Σ_k b'_k(n) (Σ_j φ_jn V_kj): what residuals and fitted distances share.
//!
//! A cell's eight nodes lend their weights to all its voxels: they are gathered once, in the scale of the brick,
//! then every voxel takes its sums with each corner's weights and blends those.

use crate::arithmetic::{Arithmetic, Stride};
use crate::brick::Brick;
use crate::cells::cells;
use crate::corner_rows::Row;
use crate::nodes::NodeMap;
use crate::trilinear::trilinear;

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
    /// `scratch` has a row for each mode.
    pub fn walk(
        &self,
        brick: &Brick<'_>,
        scratch: &mut [A::Row],
        wanted: &[u8],
        mut visit: impl FnMut(usize, A::Sum),
    ) {
        let rows = scratch.get_mut(..A::Row::count(self.modes)).unwrap_or(&mut []);
        let (q, least) = (self.stride.voxels, brick.least_exponent());
        for cell in cells(brick, q).filter(|cell| cell.any(brick, wanted, q)) {
            self.gather(brick, self.nodes.corners(&cell), least, rows);
            cell.visit(brick, wanted, q, |at, voxel| {
                let sums = A::Row::dots(rows, brick.basis_from(voxel));
                visit(voxel, A::blend(&sums, trilinear(at, q), least, self.stride));
            });
        }
    }

    /// The weights of the eight nodes, V 2^(least - E).
    #[inline(never)]
    pub fn gather(&self, brick: &Brick<'_>, nodes: [usize; 8], least: u8, rows: &mut [A::Row]) {
        // The second node of each pair along x follows the first.
        let [a, _, b, _, c, _, d, _] = nodes;
        let [(a, b), (c, d), (e, f), (g, h)] = [a, b, c, d].map(|node| self.pair(node));
        A::Row::gather(rows, [a, b, c, d, e, f, g, h], brick.exponents(), least);
    }

    /// The weights from a node on and from the next one on.
    #[inline]
    fn pair(&self, node: usize) -> (&[A::Weight], &[A::Weight]) {
        let first = self.weights.get(node * self.modes..).unwrap_or(&[]);
        (first, first.get(self.modes..).unwrap_or(&[]))
    }
}
