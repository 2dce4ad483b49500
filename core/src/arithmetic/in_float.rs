//! What the arithmetic that ships is measured against.

use super::{
    Arithmetic, DISTANCE_BITS, FULL_WEIGHT, Fixed, Kernel, MAX_WEIGHT, MOMENTUM_BITS, RATIO_LIMIT,
    RAW_CURVATURE_BITS, RESIDUAL_LIMIT, Stride,
};
use crate::trilinear::TrilinearWeights;

/// Double precision through the very same loops: what separates it from [`Fixed`] is rounding alone.
#[derive(Clone, Copy, Debug)]
pub struct Float;

fn power(exponent: u8) -> f64 {
    libm::scalbn(1.0, -i32::from(exponent))
}

fn distance(mean: i16) -> f64 {
    f64::from(mean) / f64::from(1 << DISTANCE_BITS)
}

impl Arithmetic for Float {
    type Weight = f64;
    type Row = [f64; 8];
    type Residual = f64;
    type Sum = f64;
    type Reciprocal = f64;
    type Gain = f64;

    const ZERO: f64 = 0.0;

    fn weight(sigma: f64) -> f64 {
        if sigma.is_nan() { 0.0 } else { sigma.clamp(-f64::from(MAX_WEIGHT), f64::from(MAX_WEIGHT)) }
    }

    fn stored(weight: f64) -> i16 {
        Fixed::weight(weight)
    }

    fn blend(sums: &[f64; 8], phi: &TrilinearWeights, least: u8, stride: Stride) -> f64 {
        let sum: f64 = sums.iter().zip(phi).map(|(sum, &phi)| sum * f64::from(phi)).sum();
        sum * power(least) / f64::from(stride.cube())
    }

    fn residual(mean: i16, target: i16, weight: i32, sum: f64) -> f64 {
        let limit = distance(RESIDUAL_LIMIT as i16);
        let residual = (distance(mean) + sum - distance(target)).clamp(-limit, limit);
        residual * f64::from(weight) / f64::from(FULL_WEIGHT)
    }

    fn distance(mean: i16, sum: f64) -> i16 {
        libm::floor((distance(mean) + sum) * f64::from(1 << DISTANCE_BITS) + 0.5) as i16
    }

    fn to_node(sum: f64, exponent: u8, _: Kernel) -> f64 {
        sum * power(exponent)
    }

    fn curvature(raw: u32, weight: i32, phi: i32) -> f64 {
        let voxel = f64::from(raw) / f64::from(1 << RAW_CURVATURE_BITS);
        voxel * f64::from(weight) / f64::from(FULL_WEIGHT) * f64::from(phi)
    }

    fn curvature_to_node(sum: f64, stride: Stride) -> f64 {
        sum / f64::from(stride.cube())
    }

    fn add(a: f64, b: f64) -> f64 {
        a + b
    }

    fn is_zero(sums: &[f64]) -> bool {
        sums.iter().all(|&sum| sum == 0.0)
    }

    fn subtract(a: f64, b: f64) -> f64 {
        a - b
    }

    fn reciprocal(boxed: f64, ridge: f64, kernel: Kernel) -> f64 {
        1.0 / ((boxed.max(0.0) + ridge * f64::from(kernel.volume)) * f64::from(kernel.cube))
    }

    fn ratio(boxed: f64, reciprocal: f64, _: Kernel) -> f64 {
        (boxed * reciprocal).clamp(-f64::from(RATIO_LIMIT), f64::from(RATIO_LIMIT))
    }

    fn gain(step: f64, gain: f64, kernel: Kernel) -> f64 {
        step * gain / f64::from(kernel.volume)
    }

    fn step(weight: f64, previous: f64, momentum: i32, boxed: f64, gain: f64) -> f64 {
        let inertia = (weight - previous) * f64::from(momentum) / f64::from(1 << MOMENTUM_BITS);
        Self::weight(weight + inertia - gain * boxed)
    }
}
