//! The modes' sum at a voxel, Σ_k b'_k(n) (Σ_j φ_jn V_kj): what residuals and fitted distances share.
//!
//! A cell's eight nodes lend their weights to all its voxels: they are gathered once, in the scale of the brick,
//! then every voxel takes its sums with each corner's weights and blends those.

use crate::arithmetic::{Arithmetic, Stride};
use crate::cells::cells;
use crate::gradient::trilinear;
use crate::model::Brick;
use crate::nodes::NodeMap;

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
        let rows = scratch.get_mut(..self.modes).unwrap_or(&mut []);
        let (q, least) = (self.stride.voxels, brick.least_exponent());
        for cell in cells(brick, q).filter(|cell| cell.any(brick, wanted, q)) {
            self.gather(brick, self.nodes.corners(&cell), least, rows);
            cell.visit(brick, wanted, q, |at, voxel| {
                let sums = dots::<A>(brick.basis(voxel), rows);
                visit(voxel, A::blend(&sums, trilinear(at, q), least, self.stride));
            });
        }
    }

    /// The weights of the eight nodes, one row a mode, V 2^(least - E).
    #[inline(never)]
    pub fn gather(&self, brick: &Brick<'_>, nodes: [usize; 8], least: u8, rows: &mut [A::Row]) {
        // The second node of each pair along x follows the first.
        let [a, _, b, _, c, _, d, _] = nodes;
        let ((a, b), (c, d)) = ((self.pair(a), self.pair(b)), (self.pair(c), self.pair(d)));
        let front = a.0.iter().zip(a.1).zip(b.0).zip(b.1);
        let back = c.0.iter().zip(c.1).zip(d.0).zip(d.1);
        let outputs = rows.iter_mut().zip(brick.exponents());
        for ((row, &exponent), (front, back)) in outputs.zip(front.zip(back)) {
            let (((&a, &b), &c), &d) = front;
            let (((&e, &f), &g), &h) = back;
            *row = A::corner_row([a, b, c, d, e, f, g, h], exponent.wrapping_sub(least));
        }
    }

    /// The weights of a node and of the next one.
    #[inline]
    fn pair(&self, node: usize) -> (&[A::Weight], &[A::Weight]) {
        let both = self.weights.get(node * self.modes..).and_then(|w| w.get(..2 * self.modes));
        both.and_then(|both| both.split_at_checked(self.modes)).unwrap_or((&[], &[]))
    }
}

/// Σ x · row for each corner. Not inlined, or its sums would not stay in registers; both ends are tested in every
/// round, or the compiler would unroll it and spill them.
#[inline(never)]
pub fn dots<A: Arithmetic>(values: &[u8], rows: &[A::Row]) -> [A::Sum; 8] {
    let mut sums = [A::Sum::default(); 8];
    let (mut values, mut rows) = (values.iter(), rows.iter());
    loop {
        let Some(row) = rows.next() else { return sums };
        let Some(&value) = values.next() else { return sums };
        A::accumulate(&mut sums, value as i8, row);
    }
}
