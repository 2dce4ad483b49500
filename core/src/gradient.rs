//! The gradient of a cell, Σ φ W e b' for its eight corners.
//!
//! A cell holds few voxels of the hull, so φ W e is worked out once for each of them and corner; then every mode
//! costs one product a voxel and corner, with the eight sums in registers.

use crate::arithmetic::{Arithmetic, Kernel, Stride};
use crate::field::dots;
use crate::model::Brick;

/// Modes whose gradients are held at a time.
pub const GROUP: usize = 5;

/// Most voxels of a cell: the stride is 4 at most.
const MOST: usize = 64;

/// What the voxels of a cell in the hull contribute, to `G` modes at a time.
pub struct Shares<'c, A: Arithmetic, const G: usize> {
    /// φ W e for each corner; a voxel after the other.
    corners: &'c mut [A::Row],
    /// Numbers within the brick.
    voxels: [u16; MOST],
    count: usize,
    /// Basis values of the modes, the voxels of a mode side by side.
    lanes: [[u8; MOST]; G],
    /// Σ φ W e b' of the modes for each corner.
    sums: [[A::Sum; 8]; G],
}

impl<'c, A: Arithmetic, const G: usize> Shares<'c, A, G> {
    /// No voxel yet; `scratch` has q³ rows.
    pub fn new(scratch: &'c mut [A::Row]) -> Self {
        let sums = [[A::Sum::default(); 8]; G];
        Self { corners: scratch, voxels: [0; MOST], count: 0, lanes: [[0; MOST]; G], sums }
    }

    /// Forgets the voxels, for the next cell.
    #[inline]
    pub const fn clear(&mut self) {
        self.count = 0;
    }

    /// Adds a voxel: its number within the brick, its residual and its trilinear weights.
    #[inline]
    pub fn push(&mut self, voxel: usize, residual: A::Residual, factors: [i32; 8], stride: Stride) {
        let slots = self.corners.get_mut(self.count).zip(self.voxels.get_mut(self.count));
        if let Some((slot, number)) = slots {
            (*slot, *number) = (A::share_row(residual, factors, stride), voxel as u16);
            self.count += 1;
        }
    }

    /// Adds Σ φ W e b' of the modes from `first` on to the sums of the eight nodes, which begin at `places`.
    #[inline(never)]
    pub fn add_to(
        &mut self,
        brick: &Brick<'_>,
        first: usize,
        kernel: Kernel,
        (gradient, places): (&mut [A::Sum], [usize; 8]),
    ) {
        self.transpose(brick, first);
        let shares = self.corners.get(..self.count).unwrap_or(&[]);
        let exponents = brick.exponents().get(first..).unwrap_or(&[]);
        for (sums, (lane, &exponent)) in self.sums.iter_mut().zip(self.lanes.iter().zip(exponents)) {
            *sums = dots::<A>(lane, shares);
            for sum in sums {
                *sum = A::to_node(*sum, exponent, kernel);
            }
        }
        let modes = exponents.len().min(G);
        for (corner, place) in places.into_iter().enumerate() {
            let slots =
                gradient.get_mut(place..).and_then(|slots| slots.get_mut(..modes)).unwrap_or_default();
            add_column::<A>(slots, &self.sums, corner);
        }
    }

    /// Reads the basis values of the modes from `first` on.
    #[inline]
    fn transpose(&mut self, brick: &Brick<'_>, first: usize) {
        let modes = brick.exponents().len();
        let from = brick.basis_from(0).get(first..).unwrap_or(&[]);
        let Self { voxels, lanes, count, .. } = self;
        for (i, &voxel) in voxels.iter().enumerate().take(*count) {
            // Beyond the last mode lie the next voxel's values; nobody reads those lanes.
            let values = from.get(usize::from(voxel) * modes..).unwrap_or(&[]);
            if let Some(values) = values.first_chunk() {
                fill(lanes, i, values);
            } else {
                // Only at the end of the brick.
                let mut padded = [0; G];
                padded.iter_mut().zip(values).for_each(|(slot, &value)| *slot = value);
                fill(lanes, i, &padded);
            }
        }
    }
}

/// Sets a voxel's value in each lane.
#[inline(always)]
fn fill<const G: usize>(lanes: &mut [[u8; MOST]; G], voxel: usize, values: &[u8; G]) {
    for (lane, &value) in lanes.iter_mut().zip(values) {
        if let Some(slot) = lane.get_mut(voxel) {
            *slot = value;
        }
    }
}

/// Adds one corner's sum of each mode to the sums of its node.
#[inline(always)]
fn add_column<A: Arithmetic>(slots: &mut [A::Sum], sums: &[[A::Sum; 8]], corner: usize) {
    for (slot, sums) in slots.iter_mut().zip(sums) {
        *slot = A::add(*slot, sums.get(corner).copied().unwrap_or_default());
    }
}

/// φ q³ of the eight corners for the voxel at `at` within a cell.
#[inline]
pub fn trilinear(at: [u8; 3], q: u8) -> [i32; 8] {
    let q = i32::from(q);
    let [x, y, z] = at.map(i32::from);
    let (u, v, w) = (q - x, q - y, q - z);
    let (a, b, c, d) = (v * w, y * w, v * z, y * z);
    [u * a, x * a, u * b, x * b, u * c, x * c, u * d, x * d]
}
