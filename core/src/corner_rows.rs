//! What the eight corners of a cell lend its voxels and get from them, in the order that suits the processor.
//!
//! A [`Row`] holds eight numbers, one for each corner. A list of rows is multiplied with basis values in two ways: the
//! weights of all modes with the values of one voxel ([`Row::dots`]), and the corner residuals of all voxels with the values of
//! one mode ([`crate::gradient`]). There are two orders for fixed point, with the same bits:
//!
//! - `[i32; 4]`: corners in pairs, a row after the other, for processors that multiply halves of words;
//! - `[i16; 8]`: eight modes of a corner together, for vector units that add up the products of a whole vector
//!   (feature `vector`, for Cortex-M55: a third of the instructions there, twice as many on Cortex-M7).

use crate::arithmetic::{Arithmetic, Fixed, Float, Stride};
use crate::fixed::round_shift;
use crate::gradient::{CellGradient, GROUP, Straight, Transposed};
use crate::trilinear::TrilinearWeights;
use core::fmt::Debug;

/// Modes whose gradients are taken at a time where all are, a multiple of [`GROUP`].
const TAKEN: usize = 15;

/// Rows of the order that this build uses.
#[cfg(not(feature = "vector"))]
pub type FixedRow = [i32; 4];
/// Rows of the order that this build uses.
#[cfg(feature = "vector")]
pub type FixedRow = [i16; 8];

/// Eight numbers, or eighths of eight rows.
pub trait Row<A: Arithmetic>: Copy + Default + Debug {
    /// All numbers 0, for static buffers.
    const EMPTY: Self;
    /// Takes gradients of [`GROUP`] modes at most.
    type Group: CellGradient<A, Row = Self>;
    /// Takes gradients of more modes at a time.
    type Many: CellGradient<A, Row = Self>;

    /// Rows that the weights of so many modes fill.
    fn count(modes: usize) -> usize {
        modes
    }

    /// Sets the rows to the weights V of eight nodes times 2^(least - E), E the modes' exponents. A node's weights
    /// may be followed by others.
    fn gather(rows: &mut [Self], nodes: [&[A::Weight]; 8], exponents: &[u8], least: u8);

    /// Σ value · row of the gathered weights, for each corner; more values may follow.
    fn dots(rows: &[Self], values: &[u8]) -> [A::Sum; 8];

    /// Corner residuals φ W e of a voxel, from its residual W e and its integer trilinear weights φ.
    fn corner_residuals(residual: A::Residual, phi: &TrilinearWeights, stride: Stride) -> Self;
}

/// A row that is whole by itself.
pub trait Whole<A: Arithmetic>: Row<A> {
    /// V 2^-shift of a mode at the eight corners.
    fn corners(weights: [A::Weight; 8], shift: u8) -> Self;
    /// sums + basis · row.
    fn accumulate(&self, sums: &mut [A::Sum; 8], basis: i8);

    /// [`Row::gather`], one row a mode.
    #[inline(always)]
    fn gather_whole(rows: &mut [Self], nodes: [&[A::Weight]; 8], exponents: &[u8], least: u8) {
        let [a, b, c, d, e, f, g, h] = nodes;
        let (front, back) = (a.iter().zip(b).zip(c).zip(d), e.iter().zip(f).zip(g).zip(h));
        let outputs = rows.iter_mut().zip(exponents);
        for ((row, &exponent), (front, back)) in outputs.zip(front.zip(back)) {
            let (((&a, &b), &c), &d) = front;
            let (((&e, &f), &g), &h) = back;
            *row = Self::corners([a, b, c, d, e, f, g, h], exponent.wrapping_sub(least));
        }
    }

    /// Σ value · row. Not inlined, or its sums would not stay in registers; both ends are tested in every round, or
    /// the compiler would unroll it and spill them.
    #[inline(never)]
    fn dots_whole(rows: &[Self], values: &[u8]) -> [A::Sum; 8] {
        let mut sums = [A::Sum::default(); 8];
        let (mut values, mut rows) = (values.iter(), rows.iter());
        loop {
            let Some(row) = rows.next() else { return sums };
            let Some(&value) = values.next() else { return sums };
            row.accumulate(&mut sums, value as i8);
        }
    }
}

/// The numbers of corners c and c + 4 in word c, the latter in its upper half.
impl Row<Fixed> for [i32; 4] {
    const EMPTY: Self = [0; 4];
    type Group = Transposed<Fixed, Self, GROUP>;
    type Many = Transposed<Fixed, Self, TAKEN>;

    #[inline(always)]
    fn gather(rows: &mut [Self], nodes: [&[i16]; 8], exponents: &[u8], least: u8) {
        Self::gather_whole(rows, nodes, exponents, least);
    }

    #[inline(always)]
    fn dots(rows: &[Self], values: &[u8]) -> [i32; 8] {
        Self::dots_whole(rows, values)
    }

    #[inline(always)]
    fn corner_residuals(residual: i16, phi: &TrilinearWeights, stride: Stride) -> Self {
        packed(phi.map(|phi| stride.corner_residual(residual, phi)))
    }
}

impl Whole<Fixed> for [i32; 4] {
    #[inline(always)]
    fn corners(weights: [i16; 8], shift: u8) -> Self {
        packed(weights.map(|weight| round_shift(i32::from(weight), u32::from(shift))))
    }

    #[inline(always)]
    fn accumulate(&self, sums: &mut [i32; 8], basis: i8) {
        let basis = i32::from(basis);
        let (low, high) = sums.split_at_mut(4);
        for ((low, high), &pair) in low.iter_mut().zip(high).zip(self) {
            *low = low.wrapping_add(((pair << 16) >> 16).wrapping_mul(basis));
            *high = high.wrapping_add((pair >> 16).wrapping_mul(basis));
        }
    }
}

/// Eight numbers of 16 bits in four words, the last four in the upper halves.
#[inline(always)]
fn packed([a, b, c, d, e, f, g, h]: [i32; 8]) -> [i32; 4] {
    [(a, e), (b, f), (c, g), (d, h)].map(|(low, high)| (low & 0xffff) | (high << 16))
}

/// Gathered weights: a block of eight rows for eight modes, in it a row for each corner. Corner residuals: a row for each voxel.
impl Row<Fixed> for [i16; 8] {
    const EMPTY: Self = [0; 8];
    type Group = Straight<8, 1>;
    type Many = Straight<16, 2>;

    fn count(modes: usize) -> usize {
        modes.next_multiple_of(8)
    }

    #[inline(always)]
    fn gather(rows: &mut [Self], nodes: [&[i16]; 8], exponents: &[u8], least: u8) {
        let nodes = nodes.map(|node| node.as_chunks::<8>());
        let blocks = rows.as_chunks_mut::<8>().0.iter_mut().zip(exponents.chunks(8));
        for (index, (block, exponents)) in blocks.enumerate() {
            let scale = Scale::new(exponents, least);
            for (row, (whole, rest)) in block.iter_mut().zip(&nodes) {
                match whole.get(index) {
                    Some(weights) => scale.apply(row, weights),
                    // Only at the end of the nodes.
                    None => {
                        *row = [0; 8];
                        scale.apply(row, rest);
                    }
                }
            }
        }
    }

    #[inline(never)]
    fn dots(rows: &[Self], values: &[u8]) -> [i32; 8] {
        let blocks = rows.as_chunks::<8>().0;
        let whole = values.as_chunks::<8>().0;
        if whole.len() >= blocks.len() {
            return dots_of_blocks(blocks, whole);
        }
        dots_at_the_end(blocks, values)
    }

    #[inline(always)]
    fn corner_residuals(residual: i16, phi: &TrilinearWeights, stride: Stride) -> Self {
        let mut row = [0; 8];
        for (slot, &phi) in row.iter_mut().zip(phi) {
            *slot = stride.short_corner_residual(residual, phi);
        }
        row
    }
}

/// Shifts to the right of eight modes.
#[derive(Clone, Copy)]
struct Scale {
    /// All bits but one, at most 15.
    most: [u16; 8],
    /// The last bit, which rounds; 0 where nothing is shifted.
    last: [u16; 8],
}

impl Scale {
    /// 2^(least - E) of up to eight modes; beyond the last one nothing is left, because a voxel's values are followed by
    /// those of the next one.
    #[inline(always)]
    fn new(exponents: &[u8], least: u8) -> Self {
        let mut scale = Self { most: [15; 8], last: [1; 8] };
        for ((most, last), &exponent) in scale.most.iter_mut().zip(&mut scale.last).zip(exponents) {
            let shift = u16::from(exponent.wrapping_sub(least));
            *last = shift.min(1);
            *most = (shift - *last) & 15;
        }
        scale
    }

    /// Weights / 2^shift, rounded half up; rounding them after the shift needs no 17th bit.
    #[inline(always)]
    fn apply(&self, row: &mut [i16; 8], weights: &[i16]) {
        let shifts = self.most.iter().zip(&self.last);
        for ((slot, &weight), (&most, &last)) in row.iter_mut().zip(weights).zip(shifts) {
            let doubled = weight >> (most & 15);
            *slot = (doubled >> (last & 1)) + (doubled & last as i16);
        }
    }
}

/// The same for the last voxel of a brick, whose values end before a block does.
#[inline(never)]
fn dots_at_the_end(blocks: &[[[i16; 8]; 8]], values: &[u8]) -> [i32; 8] {
    let mut padded = [0; 128];
    padded.iter_mut().zip(values).for_each(|(slot, &value)| *slot = value);
    dots_of_blocks(blocks, padded.as_chunks::<8>().0)
}

/// The sums of the eight corners over blocks of eight modes.
#[inline(always)]
fn dots_of_blocks(blocks: &[[[i16; 8]; 8]], values: &[[u8; 8]]) -> [i32; 8] {
    let mut sums = [0i32; 8];
    for (block, values) in blocks.iter().zip(values) {
        for (sum, row) in sums.iter_mut().zip(block) {
            let products = row.iter().zip(values).map(|(&a, &b)| i32::from(a) * i32::from(b as i8));
            *sum = sum.wrapping_add(products.fold(0, i32::wrapping_add));
        }
    }
    sums
}

impl Row<Float> for [f64; 8] {
    const EMPTY: Self = [0.0; 8];
    type Group = Transposed<Float, Self, GROUP>;
    type Many = Transposed<Float, Self, TAKEN>;

    fn gather(rows: &mut [Self], nodes: [&[f64]; 8], exponents: &[u8], least: u8) {
        Self::gather_whole(rows, nodes, exponents, least);
    }

    fn dots(rows: &[Self], values: &[u8]) -> [f64; 8] {
        Self::dots_whole(rows, values)
    }

    fn corner_residuals(residual: f64, phi: &TrilinearWeights, _: Stride) -> Self {
        phi.map(|phi| residual * f64::from(phi))
    }
}

impl Whole<Float> for [f64; 8] {
    fn corners(weights: [f64; 8], shift: u8) -> Self {
        weights.map(|weight| weight * libm::scalbn(1.0, -i32::from(shift)))
    }

    fn accumulate(&self, sums: &mut [f64; 8], basis: i8) {
        sums.iter_mut().zip(self).for_each(|(sum, value)| *sum += f64::from(basis) * value);
    }
}
