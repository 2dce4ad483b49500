//! The global fit: one weight vector for the whole shape, the direct MAP solution of what the fixed point
//! of eqs. (11)-(13) converges to:
//!
//! ```text
//! v = (Aᵀ W A + λ I)⁻¹ Aᵀ W (t - M),   λ = ridge · Σ W
//! ```
//!
//! with A the whitened modes b' at the hull's voxels (voxels per σ). The sums are integers within a
//! brick, then f64 over the bricks in the order of the file: the same bits everywhere.

use crate::arithmetic::{DISTANCE_BITS, FULL_WEIGHT, FULL_WEIGHT_BITS, MAX_WEIGHT, RESIDUAL_LIMIT};
use crate::brick::{Brick, MAX_BRICK_VOXELS};
use crate::cholesky::solve;
use crate::error::{Buffer, Error};
use crate::hull::Hull;
use crate::model::Model;
use crate::packed::packed;
use crate::progress::Progress;
use crate::workspace::first;

/// Sums of a brick's voxels fit 32 bits: residuals are larger than basis values.
const _: () = assert!(MAX_BRICK_VOXELS as i64 * FULL_WEIGHT as i64 * 128 * (RESIDUAL_LIMIT as i64) < 1 << 31);

/// A global fit under way.
#[derive(Debug)]
pub struct GlobalFit<'m, 'b> {
    model: &'m Model<'m>,
    hull: Hull<'m>,
    /// AᵀWA packed, then AᵀW(t - M).
    normal: &'b mut [f64],
    block: &'b mut [i32],
    weights: &'b mut [f64],
    brick: usize,
}

/// Elements of the `normal` and `block` buffers for `modes` modes.
pub const fn normal_len(modes: usize) -> usize {
    packed(modes) + modes
}

impl<'m, 'b> GlobalFit<'m, 'b> {
    /// Prepares the fit. `normal` and `block` have [`normal_len`] elements, `weights` one a mode.
    ///
    /// # Errors
    /// An empty hull, or a buffer too small.
    pub fn new(
        model: &'m Model<'m>,
        hull: Hull<'m>,
        normal: &'b mut [f64],
        block: &'b mut [i32],
        weights: &'b mut [f64],
    ) -> Result<Self, Error> {
        if hull.count == 0 {
            return Err(Error::EmptyHull);
        }
        let length = normal_len(model.modes());
        let normal = first(normal, length, Buffer::Normal)?;
        let block = first(block, length, Buffer::Block)?;
        let weights = first(weights, model.modes(), Buffer::Global)?;
        normal.fill(0.0);
        Ok(Self { model, hull, normal, block, weights, brick: 0 })
    }

    /// One brick's sums, or the solve at the end; `None` when the weights are ready.
    pub fn step(&mut self) -> Option<Progress> {
        let total = usize::from(self.model.header().bricks) + 1;
        if self.brick >= total {
            return None;
        }
        match self.model.brick(self.brick) {
            Some(brick) => self.add_brick(&brick),
            None => self.solve(),
        }
        self.brick += 1;
        Some(Progress { done: self.brick as u32, total: total as u32 })
    }

    /// Runs to the end: weights in standard deviations, one a mode.
    pub fn run(mut self) -> &'b [f64] {
        while self.step().is_some() {}
        self.finish()
    }

    /// The weights of a fit whose steps are done, standard deviations, one a mode.
    pub fn finish(self) -> &'b [f64] {
        self.weights
    }

    fn add_brick(&mut self, brick: &Brick<'_>) {
        self.block.fill(0);
        let none = Equation { basis: &[], weight: 0, residual: 0 };
        let (mut any, mut waiting, mut count) = (false, [none; TOGETHER], 0);
        for voxel in 0..brick.voxels() {
            let target = self.hull.target(brick.first + voxel);
            if target.weight() == 0 {
                continue;
            }
            let residual = i32::from(target.distance()) - i32::from(brick.mean(voxel));
            let residual = residual.clamp(-RESIDUAL_LIMIT, RESIDUAL_LIMIT);
            if let Some(slot) = waiting.get_mut(count) {
                *slot = Equation { basis: brick.basis(voxel), weight: target.weight(), residual };
            }
            (any, count) = (true, count + 1);
            if count == TOGETHER {
                add_equations(self.block, &waiting);
                count = 0;
            }
        }
        if count > 0 {
            // Those that are there once more count nothing.
            waiting.iter_mut().skip(count).for_each(|equation| equation.weight = 0);
            let [first, ..] = waiting;
            for equation in waiting.iter_mut().filter(|equation| equation.basis.is_empty()) {
                equation.basis = first.basis;
            }
            add_equations(self.block, &waiting);
        }
        if any {
            fold(self.normal, self.block, brick.exponents());
        }
    }

    fn solve(&mut self) {
        let modes = self.model.modes();
        let ridge = f64::from(self.model.header().scales.global_ridge);
        let lambda = ridge * f64::from(self.hull.weight) / f64::from(FULL_WEIGHT);
        let Some((matrix, vector)) = self.normal.split_at_mut_checked(packed(modes)) else { return };
        for i in 0..modes {
            if let Some(diagonal) = matrix.get_mut(packed(i) + i) {
                *diagonal += lambda;
            }
        }
        solve(matrix, vector);
        for (weight, value) in self.weights.iter_mut().zip(vector) {
            *weight = value.clamp(-f64::from(MAX_WEIGHT), f64::from(MAX_WEIGHT));
        }
    }
}

/// What a voxel asks for.
#[derive(Clone, Copy)]
struct Equation<'a> {
    basis: &'a [u8],
    weight: i32,
    /// t - M.
    residual: i32,
}

/// Voxels that are added together.
const TOGETHER: usize = 4;

/// Adds W b bᵀ and W b (t - M) of four voxels, so that each sum is loaded and stored once for all: at most
/// 512 · 16 · 127 · 2047 < 2³¹ in a brick.
#[inline(never)]
fn add_equations(block: &mut [i32], equations: &[Equation<'_>; TOGETHER]) {
    let [a, b, c, d] = equations.map(|equation| equation.basis);
    let mut rest = block;
    let rows = a.iter().zip(b).zip(c).zip(d).enumerate();
    for (i, (((&p, &q), &r), &s)) in rows {
        let Some((row, tail)) = rest.split_at_mut_checked(i + 1) else { return };
        let [w, x, y, z] = equations.map(|equation| equation.weight);
        add_row(row, [signed(p) * w, signed(q) * x, signed(r) * y, signed(s) * z], [a, b, c, d]);
        rest = tail;
    }
    add_row(rest, equations.map(|equation| equation.weight * equation.residual), [a, b, c, d]);
}

/// Adds the sums of four factors with basis values.
#[inline(always)]
fn add_row(row: &mut [i32], [w, x, y, z]: [i32; TOGETHER], [a, b, c, d]: [&[u8]; TOGETHER]) {
    for ((((sum, &a), &b), &c), &d) in row.iter_mut().zip(a).zip(b).zip(c).zip(d) {
        let (front, back) = (
            w.wrapping_mul(signed(a)).wrapping_add(x.wrapping_mul(signed(b))),
            y.wrapping_mul(signed(c)).wrapping_add(z.wrapping_mul(signed(d))),
        );
        *sum = sum.wrapping_add(front.wrapping_add(back));
    }
}

#[inline(always)]
fn signed(basis: u8) -> i32 {
    i32::from(basis as i8)
}

/// Adds a brick's sums, scaled by its exponents, to the normal equations.
fn fold(normal: &mut [f64], block: &[i32], exponents: &[u8]) {
    // 2^-e / FULL_WEIGHT by its bits: without a double precision unit scalbn takes hundreds of instructions.
    let power = |e: i32| f64::from_bits(((1023 - FULL_WEIGHT_BITS as i32 - e).max(0) as u64) << 52);
    let mut sums = normal.iter_mut().zip(block);
    for (i, &row) in exponents.iter().enumerate() {
        for ((sum, &part), &column) in sums.by_ref().take(i + 1).zip(exponents) {
            *sum += f64::from(part) * power(i32::from(row) + i32::from(column));
        }
    }
    for ((sum, &part), &row) in sums.zip(exponents) {
        *sum += f64::from(part) * power(i32::from(row) + DISTANCE_BITS as i32);
    }
}
