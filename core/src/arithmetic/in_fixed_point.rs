//! The arithmetic that ships.

use super::{
    Arithmetic, CURVATURE_BITS, DISTANCE_BITS, FULL_WEIGHT_BITS, Kernel, MOMENTUM_BITS, RATIO_LIMIT,
    RAW_CURVATURE_BITS, RESIDUAL_LIMIT, Stride, WEIGHT_BITS,
};
use crate::corner_rows::FixedRow;
use crate::fixed::{Factor, Multiplier, round_shift, round_shift_wide, saturate};
use crate::trilinear::TrilinearWeights;

/// The arithmetic that ships: integers, one rounding rule, the same bits everywhere.
#[derive(Clone, Copy, Debug)]
pub struct Fixed;

impl Arithmetic for Fixed {
    type Weight = i16;
    type Row = FixedRow;
    type Residual = i16;
    type Sum = i32;
    type Reciprocal = Factor;
    type Gain = Multiplier;

    const ZERO: i32 = 0;

    fn weight(sigma: f64) -> i16 {
        // `as` saturates and takes NaN to 0; floor is libm's on every chip.
        let scaled = libm::floor(sigma * f64::from(1 << WEIGHT_BITS) + 0.5);
        scaled.clamp(-f64::from(i16::MAX), f64::from(i16::MAX)) as i16
    }

    #[inline(always)]
    fn stored(weight: i16) -> i16 {
        weight
    }

    #[inline(always)]
    fn blend(sums: &[i32; 8], phi: &TrilinearWeights, least: u8, stride: Stride) -> i32 {
        let products = sums.iter().zip(phi).map(|(&sum, &phi)| i64::from(sum) * i64::from(phi));
        let sum: i64 = products.fold(0, i64::wrapping_add);
        let shift = stride.bits + WEIGHT_BITS + u32::from(least) - DISTANCE_BITS;
        round_shift_wide(sum.wrapping_mul(i64::from(stride.reciprocal)), shift) as i32
    }

    #[inline(always)]
    fn residual(mean: i16, target: i16, weight: i32, sum: i32) -> i16 {
        let fitted = i32::from(mean).saturating_add(sum);
        let residual = fitted.saturating_sub(i32::from(target)).clamp(-RESIDUAL_LIMIT, RESIDUAL_LIMIT);
        saturate(round_shift(residual * weight, FULL_WEIGHT_BITS))
    }

    #[inline(always)]
    fn distance(mean: i16, sum: i32) -> i16 {
        saturate(i32::from(mean).saturating_add(sum))
    }

    #[inline(always)]
    fn to_node(sum: i32, exponent: u8, kernel: Kernel) -> i32 {
        round_shift(sum, kernel.node_shift(exponent))
    }

    #[inline(always)]
    fn curvature(raw: u32, weight: i32, phi: i32) -> i32 {
        let voxel = (raw >> (RAW_CURVATURE_BITS - CURVATURE_BITS)).min(65535) as i32;
        round_shift(voxel * weight, FULL_WEIGHT_BITS).wrapping_mul(phi)
    }

    #[inline(always)]
    fn curvature_to_node(sum: i32, stride: Stride) -> i32 {
        round_shift_wide(i64::from(sum) * i64::from(stride.reciprocal), stride.bits) as i32
    }

    #[inline(always)]
    fn add(a: i32, b: i32) -> i32 {
        a.wrapping_add(b)
    }

    #[inline(always)]
    fn is_zero(sums: &[i32]) -> bool {
        sums.iter().fold(0, |all, &sum| all | sum) == 0
    }

    #[inline(always)]
    fn subtract(a: i32, b: i32) -> i32 {
        a.wrapping_sub(b)
    }

    fn reciprocal(boxed: i32, ridge: f64, kernel: Kernel) -> Factor {
        let unit = f64::from(1 << CURVATURE_BITS);
        let denominator = f64::from(boxed.max(0)) + ridge * unit * f64::from(kernel.volume);
        // A gradient of H bits over a curvature of 8 bits gives H - 8; the ratio carries F.
        let exponent = kernel.ratio_bits as i32 + CURVATURE_BITS as i32 - kernel.gradient_bits as i32;
        Factor::new(libm::scalbn(1.0 / (denominator * f64::from(kernel.cube)), exponent))
    }

    #[inline(always)]
    fn ratio(boxed: i32, reciprocal: Factor, kernel: Kernel) -> i32 {
        let limit = RATIO_LIMIT << kernel.ratio_bits;
        reciprocal.unpacked().multiply(boxed).max(1 - limit).min(limit - 1)
    }

    fn gain(step: f64, gain: f64, kernel: Kernel) -> Multiplier {
        let bits = (WEIGHT_BITS + MOMENTUM_BITS) as i32 - kernel.ratio_bits as i32;
        Factor::new(libm::scalbn(step * gain / f64::from(kernel.volume), bits)).unpacked()
    }

    #[inline(always)]
    fn step(weight: i16, previous: i16, momentum: i32, boxed: i32, gain: Multiplier) -> i16 {
        // Below 2²⁴; from 2²⁶ on the product takes any weight to its limit.
        let inertia = (i32::from(weight) - i32::from(previous)) * momentum;
        let change = inertia.wrapping_sub(gain.multiply(boxed)).wrapping_add(1 << (MOMENTUM_BITS - 1));
        let next = i32::from(weight) + (change >> MOMENTUM_BITS);
        next.clamp(-i32::from(i16::MAX), i32::from(i16::MAX)) as i16
    }
}
