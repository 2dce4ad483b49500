//! Integer kernels over the modes of a few voxels, the corners of one voxel cube.
//!
//! Corners that lie in the same brick share its exponents, and mostly all eight do. Weights of modes and trilinear weights are
//! fixed point, so that a product with the basis is one integer multiply-add, and the bits are the same whatever the
//! order. Modes are taken 32 at a time: loops of a known length are straight lines of code, and what lies behind the
//! last mode meets a weight of zero, or is not looked at.

use crate::arithmetic::{DISTANCE_BITS, MAX_WEIGHT, MIN_EXPONENT};
use crate::format::MAX_MODES;

/// Binary digits of a weight of one standard deviation.
const SIGMA_BITS: u32 = 17;
const _: () = {
    let largest = (MAX_WEIGHT as i64) << (SIGMA_BITS - MIN_EXPONENT as u32);
    assert!(largest * 128 * (MAX_MODES as i64) < 1 << 31);
};
/// Binary digits of a trilinear weight of one. All eight of a cube sum to one, so a sum with basis values is an i16.
pub const PHI_BITS: u32 = 8;
/// Binary digits of a factor of one.
pub const FACTOR_BITS: u32 = 13;
/// Corners taken at a time: four where there are vectors, or else as many as there are registers for.
pub const LANES: usize = if cfg!(feature = "vector") { 4 } else { 2 };
/// Modes taken at a time.
pub const MODES: usize = 32;
/// Parts of [`MODES`] modes.
pub const PARTS: usize = (MAX_MODES as usize).div_ceil(MODES);

/// A part of a voxel's basis values, and what lies behind the last.
pub type Basis = [u8; MODES];

/// One weight a mode in fixed point, made once for many places.
#[derive(Clone, Copy, Debug)]
pub struct Weights {
    parts: [[i32; MODES]; PARTS],
    count: usize,
}

impl Weights {
    /// No modes: the mean.
    pub const NONE: Self = Self { parts: [[0; MODES]; PARTS], count: 0 };

    /// From standard deviations, within ±[`MAX_WEIGHT`].
    pub fn new(deviations: &[f32]) -> Self {
        let mut weights = Self::NONE;
        for (value, &weight) in weights.parts.as_flattened_mut().iter_mut().zip(deviations) {
            let limited = weight.clamp(-MAX_WEIGHT as f32, MAX_WEIGHT as f32);
            *value = (limited * (1u32 << SIGMA_BITS) as f32) as i32;
        }
        weights.count = deviations.len().div_ceil(MODES);
        weights
    }

    /// 2⁻¹⁷ standard deviations, one a mode, zero behind the last.
    pub fn parts(&self) -> &[[i32; MODES]] {
        self.parts.get(..self.count).unwrap_or(&[])
    }
}

/// A mean distance, 1/256 voxel, in the unit of sums of products.
#[inline]
pub const fn of_mean(mean: i16) -> i32 {
    (mean as i32) << (SIGMA_BITS - DISTANCE_BITS)
}

/// A mean distance with a sum of products added to it, in voxels.
#[inline]
pub const fn in_voxels(sum: i32) -> f32 {
    sum as f32 / (1u32 << SIGMA_BITS) as f32
}

/// The weights by the exponents of a brick, kept for the next voxel, which mostly lies in the same one.
#[derive(Debug)]
pub struct ScaledWeights<'a, 'w> {
    weights: &'w Weights,
    parts: [[i32; MODES]; PARTS],
    /// The exponents that each part is scaled by.
    by: [&'a [u8]; PARTS],
}

impl<'a, 'w> ScaledWeights<'a, 'w> {
    /// Of these weights.
    pub const fn new(weights: &'w Weights) -> Self {
        Self { weights, parts: [[0; MODES]; PARTS], by: [&[]; PARTS] }
    }

    /// Parts of [`MODES`] modes.
    pub const fn parts(&self) -> usize {
        self.weights.count
    }

    /// A part of the weights by all the exponents of a brick: those of its basis values.
    #[inline]
    pub fn part(&mut self, part: usize, exponents: &'a [u8]) -> &[i32; MODES] {
        let weights = self.weights.parts().get(part);
        let (Some(scaled), Some(by), Some(weights)) =
            (self.parts.get_mut(part), self.by.get_mut(part), weights)
        else {
            return &[0; MODES];
        };
        // A model does not change while it is lent: exponents in the same place are those of the same brick.
        if !core::ptr::eq(*by, exponents) {
            scale(scaled, weights, exponents.get(part * MODES..).unwrap_or(&[]));
            *by = exponents;
        }
        scaled
    }
}

/// Sets `scaled` to the weights by the exponents of a brick.
#[inline(never)]
fn scale(scaled: &mut [i32; MODES], weights: &[i32; MODES], exponents: &[u8]) {
    for ((scaled, &weight), &exponent) in scaled.iter_mut().zip(weights).zip(exponents) {
        *scaled = weight >> (exponent & 31);
    }
}

/// Values near the end of a brick, and zeros behind them.
#[inline(never)]
pub fn padded(values: &[u8]) -> Basis {
    let mut basis = [0; MODES];
    basis.iter_mut().zip(values).for_each(|(slot, &value)| *slot = value);
    basis
}

/// Σ w b of each corner.
#[inline(never)]
pub fn dots<const N: usize>(weights: &[i32; MODES], bases: [&Basis; N]) -> [i32; N] {
    let mut sums = [0i32; N];
    for (k, weight) in weights.iter().enumerate() {
        for (sum, basis) in sums.iter_mut().zip(bases) {
            *sum = sum.wrapping_add(weight.wrapping_mul(i32::from(basis[k] as i8)));
        }
    }
    sums
}

/// Adds two corners' basis values times their trilinear weights to each mode's sum.
#[inline(never)]
pub fn combine(sums: &mut [i16; MODES], [p, q]: [i16; 2], [a, b]: [&Basis; 2]) {
    let add = |sum: i16, phi: i16, value: u8| sum.wrapping_add(phi.wrapping_mul(i16::from(value as i8)));
    for ((sum, &a), &b) in sums.iter_mut().zip(a).zip(b) {
        *sum = add(add(*sum, p, a), q, b);
    }
}

/// Multiplies each mode's interpolated sum by `factor` / 2¹³. Sums of basis values times trilinear weights are in units of
/// 2^-(8 + exponent) voxel, which differ from brick to brick; results are in units of 2^-(3 + least), `least` the mode's
/// least exponent of all bricks, so that those of different bricks can be added.
///
/// With a factor of 1 / 0.3 and a sum of 128 · 2⁸ at most the result is below 3415.
#[inline(never)]
pub fn rescale(sums: &mut [i16; MODES], factor: i16, exponents: &[u8], least: &[u8; MODES]) {
    for ((sum, &exponent), &least) in sums.iter_mut().zip(exponents).zip(least) {
        let factor = i32::from(factor) >> (exponent.wrapping_sub(least) & 15);
        *sum = (i32::from(*sum).wrapping_mul(factor).wrapping_add(1 << 17) >> 18) as i16;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integer_sums_are_those_of_floats() {
        let exponents: [u8; 29] = core::array::from_fn(|k| 5 + (k % 6) as u8);
        let bases: [Basis; 2] =
            core::array::from_fn(|c| core::array::from_fn(|k| (c * 41 + k * 89 + 3) as u8));
        let value = |c: usize, k: usize| f32::from(bases[c][k] as i8) / (1u32 << exponents[k]) as f32;

        let deviations: [f32; 29] = core::array::from_fn(|k| libm::sinf(k as f32) * 3.0);
        let weights = Weights::new(&deviations);
        let [part] = weights.parts() else { panic!("one part") };
        let mut scaled = [0; MODES];
        scale(&mut scaled, part, &exponents);
        for (c, sum) in dots(&scaled, bases.each_ref()).into_iter().enumerate() {
            let exact: f32 = (0..29).map(|k| value(c, k) * deviations[k]).sum();
            assert!((sum as f32 / (1u32 << SIGMA_BITS) as f32 - exact).abs() < 2e-2, "{sum} {exact}");
        }

        let phi = [100, 156];
        let mut sums = [0; MODES];
        combine(&mut sums, phi, bases.each_ref());
        rescale(&mut sums, 1 << FACTOR_BITS, &exponents, &[5; MODES]);
        for (k, &entry) in sums.iter().enumerate().take(29) {
            let exact: f32 = (0..2).map(|c| f32::from(phi[c]) / 256.0 * value(c, k)).sum();
            assert!((f32::from(entry) / 256.0 - exact).abs() < 0.51 / 256.0, "{k}");
        }
    }

    #[test]
    fn any_number_of_lanes_sums_the_same() {
        let bases: [Basis; 4] = core::array::from_fn(|c| core::array::from_fn(|k| (c * 87 + k * 51) as u8));
        let [a, b, c, d] = bases.each_ref();
        let weights = core::array::from_fn(|k| (k as i32 - 11) * 1234);
        let [[p, q], [r, s]] = [dots(&weights, [a, b]), dots(&weights, [c, d])];
        assert_eq!(dots(&weights, [a, b, c, d]), [p, q, r, s]);
    }

    #[test]
    fn extreme_values_do_not_overflow() {
        for byte in [0x80u8, 0x7f] {
            let (basis, most) = ([byte; MODES], f64::from(byte as i8));
            // Sixteen deviations in each of 127 modes.
            let weights = Weights::new(&[f32::INFINITY; MAX_MODES as usize]);
            let scaled = weights.parts().as_flattened().iter().map(|w| w >> 5);
            let sum = scaled.fold(0i32, |sum, w| sum.checked_add(w * i32::from(byte as i8)).unwrap());
            assert_eq!(f64::from(sum), 127.0 * 16.0 * 4096.0 * most);

            let mut sums = [0; MODES];
            [[100, 50], [6, 0], [0, 99], [0, 1]].into_iter().for_each(|phi| {
                combine(&mut sums, phi, [&basis; 2]);
            });
            assert_eq!(f64::from(sums[0]), 256.0 * most);
            rescale(&mut sums, 27_307, &[5; MODES], &[5; MODES]);
            assert!(sums[0].unsigned_abs() < 3415, "{}", sums[0]);
        }
    }
}
