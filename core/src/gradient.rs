//! The gradient of a cell, Σ φ W e b' for its eight corners.
//!
//! A cell holds few voxels of the hull, so φ W e, the corner residual, is worked out once for each of them and corner; then every mode
//! costs one product a voxel and corner, with the sums in registers: those of a mode for the eight corners
//! ([`Transposed`]), or those of eight or sixteen modes for one corner ([`Straight`]).

use crate::arithmetic::{Arithmetic, Fixed, Kernel, Stride};
use crate::brick::Brick;
use crate::corner_rows::{Row, Whole};
use crate::trilinear::{CELL_VOXELS, TrilinearWeights};
use core::marker::PhantomData;

/// Modes whose gradients are held at a time.
pub const GROUP: usize = 5;

/// Sums behind the last node that are added to, zeros only.
pub const MARGIN: usize = 16;

/// Residuals of the voxels of a cell in the hull, times the trilinear weight of each corner: what the cell's gradient is made
/// of.
pub struct CornerResiduals<'c, A: Arithmetic, C> {
    /// φ W e for each corner; a voxel after the other.
    corners: &'c mut [A::Row],
    /// Numbers within the brick.
    voxels: [u16; CELL_VOXELS],
    count: usize,
    cell: C,
}

/// Which modes of which voxels a cell's gradient is taken of.
#[derive(Clone, Copy, Debug)]
pub struct Taken<'a> {
    /// The brick.
    pub brick: &'a Brick<'a>,
    /// Numbers of the voxels within it.
    pub voxels: &'a [u16],
    /// First mode.
    pub first: usize,
    /// Modes.
    pub count: usize,
}

/// A way to the gradients of a cell, with the memory that it needs.
pub trait CellGradient<A: Arithmetic> {
    /// Corner residuals φ W e of a voxel.
    type Row;
    /// Nothing taken.
    const EMPTY: Self;
    /// Most modes at a time.
    const MODES: usize;

    /// Adds Σ φ W e b' to the sums of the eight nodes, which begin at the given places of the gradient; it has
    /// [`MARGIN`] sums behind the last node.
    fn add(
        &mut self,
        residuals: &[Self::Row],
        taken: Taken<'_>,
        kernel: Kernel,
        target: (&mut [A::Sum], [usize; 8]),
    );
}

impl<'c, A: Arithmetic, C: CellGradient<A, Row = A::Row>> CornerResiduals<'c, A, C> {
    /// No voxel yet; `scratch` has q³ rows.
    pub fn new(scratch: &'c mut [A::Row]) -> Self {
        Self { corners: scratch, voxels: [0; CELL_VOXELS], count: 0, cell: C::EMPTY }
    }

    /// Forgets the voxels, for the next cell.
    #[inline]
    pub const fn clear(&mut self) {
        self.count = 0;
    }

    /// Adds a voxel: its number within the brick, its residual and its trilinear weights.
    #[inline]
    pub fn push(&mut self, voxel: usize, residual: A::Residual, phi: &TrilinearWeights, stride: Stride) {
        let slots = self.corners.get_mut(self.count).zip(self.voxels.get_mut(self.count));
        if let Some((slot, number)) = slots {
            (*slot, *number) = (A::Row::corner_residuals(residual, phi, stride), voxel as u16);
            self.count += 1;
        }
    }

    /// Adds Σ φ W e b' of `count` modes from `first` on to the sums of the eight nodes, which begin at `places`.
    #[inline]
    pub fn add_to(
        &mut self,
        brick: &Brick<'_>,
        (first, count): (usize, usize),
        kernel: Kernel,
        target: (&mut [A::Sum], [usize; 8]),
    ) {
        let residuals = self.corners.get(..self.count).unwrap_or(&[]);
        let voxels = self.voxels.get(..self.count).unwrap_or(&[]);
        self.cell.add(residuals, Taken { brick, voxels, first, count }, kernel, target);
    }
}

/// Mode by mode, the eight sums of a mode in registers.
#[derive(Debug)]
pub struct Transposed<A: Arithmetic, R, const G: usize> {
    /// Basis values of the modes, the voxels of a mode side by side.
    lanes: [[u8; CELL_VOXELS]; G],
    /// Σ φ W e b' of the modes for each corner.
    sums: [[A::Sum; 8]; G],
    row: PhantomData<R>,
}

impl<A: Arithmetic, R: Whole<A>, const G: usize> CellGradient<A> for Transposed<A, R, G> {
    type Row = R;
    const EMPTY: Self = Self { lanes: [[0; CELL_VOXELS]; G], sums: [[A::ZERO; 8]; G], row: PhantomData };
    const MODES: usize = G;

    #[inline(never)]
    fn add(
        &mut self,
        residuals: &[R],
        taken: Taken<'_>,
        kernel: Kernel,
        (gradient, places): (&mut [A::Sum], [usize; 8]),
    ) {
        self.transpose(taken);
        let count = taken.count.min(G);
        let exponents = taken.brick.exponents().get(taken.first..).unwrap_or(&[]);
        for (sums, (lane, &exponent)) in self.sums.iter_mut().zip(self.lanes.iter().zip(exponents)) {
            *sums = R::dots(residuals, lane);
            for sum in sums {
                *sum = A::to_node(*sum, exponent, kernel);
            }
        }
        for (corner, place) in places.into_iter().enumerate() {
            let slots =
                gradient.get_mut(place..).and_then(|slots| slots.get_mut(..count)).unwrap_or_default();
            add_column::<A>(slots, &self.sums, corner);
        }
    }
}

impl<A: Arithmetic, R, const G: usize> Transposed<A, R, G> {
    /// Reads the basis values.
    #[inline]
    fn transpose(&mut self, Taken { brick, voxels, first, .. }: Taken<'_>) {
        let modes = brick.exponents().len();
        let from = brick.basis_from(0).get(first..).unwrap_or(&[]);
        for (i, &voxel) in voxels.iter().enumerate() {
            // Beyond the last mode lie the next voxel's values; nobody reads those lanes.
            let values = from.get(usize::from(voxel) * modes..).unwrap_or(&[]);
            if let Some(values) = values.first_chunk() {
                fill(&mut self.lanes, i, values);
            } else {
                // Only at the end of the brick.
                let mut padded = [0; G];
                padded.iter_mut().zip(values).for_each(|(slot, &value)| *slot = value);
                fill(&mut self.lanes, i, &padded);
            }
        }
    }
}

/// Sets a voxel's value in each lane.
#[inline(always)]
fn fill<const G: usize>(lanes: &mut [[u8; CELL_VOXELS]; G], voxel: usize, values: &[u8; G]) {
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

/// Corner by corner, the sums of `L` modes of a corner in registers; `N` times as many modes in all.
#[derive(Debug)]
pub struct Straight<const L: usize, const N: usize> {
    /// Basis values of the modes, a voxel after the other.
    values: [[[u8; L]; N]; CELL_VOXELS],
}

impl<const L: usize, const N: usize> CellGradient<Fixed> for Straight<L, N> {
    type Row = [i16; 8];
    const EMPTY: Self = Self { values: [[[0; L]; N]; CELL_VOXELS] };
    const MODES: usize = L * N;

    #[inline(never)]
    fn add(
        &mut self,
        residuals: &[[i16; 8]],
        taken: Taken<'_>,
        kernel: Kernel,
        (gradient, places): (&mut [i32], [usize; 8]),
    ) {
        self.copy(taken);
        let exponents = taken.brick.exponents().get(taken.first..).unwrap_or(&[]);
        let mut shifts = [[0; L]; N];
        for (shift, &exponent) in shifts.as_flattened_mut().iter_mut().zip(exponents).take(taken.count) {
            *shift = kernel.node_shift(exponent) & 31;
        }
        for (block, shifts) in shifts.iter().enumerate() {
            let halves = shifts.map(|shift| (1i32 << (shift & 31)) >> 1);
            for (corner, place) in places.into_iter().enumerate() {
                let mut sums = self.sums(residuals, corner, block, halves);
                sums.iter_mut().zip(shifts).for_each(|(sum, &shift)| *sum >>= shift & 31);
                let slots =
                    gradient.get_mut(place + block * L..).and_then(|slots| slots.first_chunk_mut::<L>());
                let Some(slots) = slots else { return };
                slots.iter_mut().zip(sums).for_each(|(slot, sum)| *slot = slot.wrapping_add(sum));
            }
        }
    }
}

impl<const L: usize, const N: usize> Straight<L, N> {
    /// Reads the basis values; those beyond the last mode, which are other modes' or voxels', become 0.
    #[inline]
    fn copy(&mut self, Taken { brick, voxels, first, count }: Taken<'_>) {
        let modes = brick.exponents().len();
        let from = brick.basis_from(0).get(first..).unwrap_or(&[]);
        let mut masks = [[0; L]; N];
        masks.as_flattened_mut().iter_mut().take(count).for_each(|mask| *mask = 255);
        for (blocks, &voxel) in self.values.iter_mut().zip(voxels) {
            let mut values = from.get(usize::from(voxel) * modes..).unwrap_or(&[]);
            for (block, mask) in blocks.iter_mut().zip(&masks) {
                match values.split_first_chunk::<L>() {
                    Some((whole, rest)) => {
                        keep(block, whole, mask);
                        values = rest;
                    }
                    // Only at the end of the brick.
                    None => {
                        *block = [0; L];
                        keep(block, values, mask);
                        values = &[];
                    }
                }
            }
        }
    }

    /// Σ φ W e b' of a corner and a block of modes, added to `sums`. Both ends are tested in every round, or the
    /// compiler would take four voxels at a time, from as many places, instead of four modes.
    #[inline(always)]
    fn sums(&self, residuals: &[[i16; 8]], corner: usize, block: usize, mut sums: [i32; L]) -> [i32; L] {
        let (mut values, mut residuals) = (self.values.iter(), residuals.iter());
        loop {
            let Some(values) = values.next().and_then(|values| values.get(block)) else { return sums };
            let Some(residuals) = residuals.next() else { return sums };
            let residual = i32::from(residuals.get(corner).copied().unwrap_or(0));
            for (sum, &value) in sums.iter_mut().zip(values) {
                *sum = sum.wrapping_add(residual.wrapping_mul(i32::from(value as i8)));
            }
        }
    }
}

#[inline(always)]
fn keep<const L: usize>(block: &mut [u8; L], values: &[u8], mask: &[u8; L]) {
    block.iter_mut().zip(values).zip(mask).for_each(|((slot, &value), mask)| *slot = value & mask);
}
