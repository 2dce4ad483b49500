//! The curvature of a cell, Σ φ W Σ_k g_k b'_k² for its eight corners.

use crate::arithmetic::{Arithmetic, Stride};
use crate::brick::Brick;
use crate::cells::Cell;
use crate::hull::Hull;
use crate::trilinear::trilinear;

/// The eight corners' sums, times q³. `gains` are in 1/256, `wanted` has a mask for each row of the brick.
pub fn cell_curvature<A: Arithmetic>(
    brick: &Brick<'_>,
    cell: &Cell,
    wanted: &[u8],
    hull: &Hull<'_>,
    gains: &[u16],
    stride: Stride,
) -> [A::Sum; 8] {
    let q = stride.voxels;
    let mut corners = [A::Sum::default(); 8];
    cell.visit(brick, wanted, q, |at, voxel| {
        let weight = hull.target(brick.first + voxel).weight();
        let raw = voxel_curvature(brick, voxel, gains);
        for (corner, &phi) in corners.iter_mut().zip(trilinear(at, q)) {
            *corner = A::add(*corner, A::curvature(raw, weight, i32::from(phi)));
        }
    });
    corners
}

/// Σ_k g_k b'² of a voxel in 2⁻¹² voxel²; each term is below 2²⁴ for exponents of 5 and more.
fn voxel_curvature(brick: &Brick<'_>, voxel: usize, gains: &[u16]) -> u32 {
    let terms = brick.basis(voxel).iter().zip(brick.exponents()).zip(gains);
    terms.fold(0, |sum: u32, ((&b, &e), &gain)| {
        let b = i32::from(b as i8);
        let square = (b * b) as u32;
        let shift = (2 * u32::from(e)).saturating_sub(4).min(31);
        sum.wrapping_add(square.wrapping_mul(u32::from(gain)) >> shift)
    })
}
