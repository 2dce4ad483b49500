//! The gradient of a cell, Σ φ W e b' for its eight corners.
//!
//! A cell holds few voxels of the hull, so φ W e is worked out once for each of them and corner; then every mode
//! costs one product a voxel and corner, with the eight sums in registers.

use crate::arithmetic::Arithmetic;
use crate::cells::Cell;
use crate::model::Brick;

/// Modes whose gradients are held at a time.
pub const GROUP: usize = 5;

/// Most voxels of a cell: the stride is 4 at most.
const MOST: usize = 64;

/// What the voxels of a cell in the hull contribute, before their basis.
pub struct Shares<'c, A: Arithmetic> {
    /// φ W e for each corner, times q³; a voxel after the other.
    corners: &'c mut [[A::Coefficient; 8]],
    /// Numbers within the brick.
    voxels: [u16; MOST],
    count: usize,
}

/// Elements of the scratch memory of [`Shares`].
pub const fn shares_len(stride: u8) -> usize {
    8 * stride as usize * stride as usize * stride as usize
}

impl<'c, A: Arithmetic> Shares<'c, A> {
    /// The shares of the wanted voxels (a mask for each row of the brick); `residuals` begin with the brick's first
    /// voxel, `scratch` has [`shares_len`] elements.
    #[inline(never)]
    pub fn of(
        brick: &Brick<'_>,
        cell: &Cell,
        wanted: &[u8],
        residuals: &[A::Residual],
        q: u8,
        scratch: &'c mut [A::Coefficient],
    ) -> Self {
        let mut shares = Self { corners: scratch.as_chunks_mut().0, voxels: [0; MOST], count: 0 };
        for z in 0..q {
            for y in 0..q {
                let Some(piece) = cell.piece(brick, wanted, y, z, q) else { continue };
                for (x, voxel) in piece.voxels() {
                    let residual = residuals.get(voxel).copied().unwrap_or_default();
                    shares.push(voxel, trilinear([x, y, z], q).map(|share| A::share(residual, share)));
                }
            }
        }
        shares
    }

    #[inline]
    fn push(&mut self, voxel: usize, corners: [A::Coefficient; 8]) {
        let slots = self.corners.get_mut(self.count).zip(self.voxels.get_mut(self.count));
        if let Some((slot, number)) = slots {
            (*slot, *number) = (corners, voxel as u16);
            self.count += 1;
        }
    }

    /// Σ φ W e b' for each mode of a group and corner, in basis units times q³.
    pub fn gradient(&self, brick: &Brick<'_>, group: usize) -> [[A::Sum; 8]; GROUP] {
        let modes = brick.exponents().len();
        let mut basis = [[0; MOST]; GROUP];
        for (i, &voxel) in self.voxels.iter().enumerate().take(self.count) {
            // Beyond the last mode lie the next voxel's values; nobody reads those sums.
            let values = brick.basis_from(0).get(usize::from(voxel) * modes + group * GROUP..).unwrap_or(&[]);
            for (lane, &value) in basis.iter_mut().zip(values) {
                if let Some(slot) = lane.get_mut(i) {
                    *slot = value;
                }
            }
        }
        let shares = self.corners.get(..self.count).unwrap_or(&[]);
        basis.map(|lane| weighted::<A>(shares, &lane))
    }
}

/// Σ b share of one mode for each corner. Not inlined, or its sums would not stay in registers.
#[inline(never)]
fn weighted<A: Arithmetic>(shares: &[[A::Coefficient; 8]], basis: &[u8; MOST]) -> [A::Sum; 8] {
    let mut sums = [A::Sum::default(); 8];
    for (corners, &b) in shares.iter().zip(basis) {
        for (sum, &share) in sums.iter_mut().zip(corners) {
            *sum = A::accumulate(*sum, b as i8, share);
        }
    }
    sums
}

/// φ q³ of the eight corners for the voxel at `at` within a cell.
#[inline]
pub fn trilinear([x, y, z]: [u8; 3], q: u8) -> [u8; 8] {
    let (u, v, w) = (q - x, q - y, q - z);
    let (a, b, c, d) = (v * w, y * w, v * z, y * z);
    [u * a, x * a, u * b, x * b, u * c, x * c, u * d, x * d]
}
