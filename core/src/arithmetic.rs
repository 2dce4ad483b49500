//! The two arithmetics of the local fit: one algorithm, [`Fixed`] ships, [`Float`] is what it is measured against.
//!
//! | quantity | [`Fixed`] | [`Float`] |
//! |---|---|---|
//! | weight V | i16, 1/2048 σ, within ±16 σ | f64, σ |
//! | weight at a corner of a cell, V 2^(E₀ - E) | i16, 1/2048 σ | f64, σ |
//! | sum of a voxel's modes with a corner's weights | i32, 2^-(11 + E₀) voxel | f64, 2^-E₀ voxel |
//! | sum of a voxel's modes | i32, 1/256 voxel | f64, voxels |
//! | residual e | i16, 1/256 voxel, within ±8 voxels | f64, voxels |
//! | corner residual φ W e | i16, 2^s/256 voxel, times q³ | f64, voxels |
//! | sum of a cell's gradient | i32, basis units · 2^s/256 voxel · q³ | f64 |
//! | node gradient G | i32, 2^-H voxel², times q³ | f64 |
//! | node curvature d | i32, 2⁻⁸ voxel² | f64 |
//! | ratio U | i32, 2^-F σ, within ±64 σ | f64 |
//!
//! E is a mode's exponent in a brick and E₀ the least of them. s follows from the stride, H and F from the kernel's
//! width and volume. Trilinear weights are integers that sum to q³; gradients keep this factor, and the one
//! division by it is folded into the last step.
//!
//! Weights and corner residuals fit 16 bits, so that processors take two of them or eight at a time ([`crate::corner_rows`]).
//!
//! Bounds, with stride q ≤ 4, K ≤ 127 modes, exponents ≥ 5 (a basis value is 4 voxels per σ at most) and
//! q (2 r + 1) ≤ 31:
//! - a sum with a corner's weights: 127 · 128 · 2¹⁵ < 2³¹;
//! - a corner residual: 2047 · q³ / 2^s < 2¹⁵ by the choice of s;
//! - a cell's gradient: 2¹⁵ · 128 · q³ < 2³¹;
//! - a box of node gradients: 8 · 4 · q³ · (q (2 r + 1))³ · 2^H ≤ 2³¹ by the choice of H;
//! - a box of node curvatures: 65535 · 31³ < 2³¹;
//! - a box of ratios: 64 · (2 r + 1)³ · 2^F ≤ 2³¹ by the choice of F.

use crate::corner_rows::Row;
use crate::fixed::round_shift;
use crate::lent::Lent;
use crate::trilinear::TrilinearWeights;
use core::fmt::Debug;

mod in_fixed_point;
mod in_float;

pub use in_fixed_point::Fixed;
pub use in_float::Float;

/// Bits behind the point of a distance or residual in voxels.
pub const DISTANCE_BITS: u32 = 8;
/// Bits behind the point of a weight in standard deviations.
pub const WEIGHT_BITS: u32 = 11;
/// Largest weight of any fit, standard deviations: what is computed with weights has room for it.
pub const MAX_WEIGHT: i32 = 16;
const _: () = assert!(MAX_WEIGHT << WEIGHT_BITS == i16::MAX as i32 + 1);
/// Largest residual, 1/256 voxel.
pub const RESIDUAL_LIMIT: i32 = 2047;
/// Smallest exponent a basis block may have: |b'| ≤ 128 / 2⁵ = 4 voxels per σ.
pub const MIN_EXPONENT: u8 = 5;
/// Largest exponent a basis block may have.
pub const MAX_EXPONENT: u8 = 14;
/// Full weight of a hull voxel, sixteenths.
pub const FULL_WEIGHT: i32 = 16;
/// [`FULL_WEIGHT`] is 2 to this power.
pub const FULL_WEIGHT_BITS: u32 = FULL_WEIGHT.trailing_zeros();
const _: () = assert!(FULL_WEIGHT == 1 << FULL_WEIGHT_BITS);

/// Largest ratio U, standard deviations.
pub const RATIO_LIMIT: i32 = 64;
/// Bits behind the point of a node's curvature, and of a voxel's before it is rounded to them.
const CURVATURE_BITS: u32 = 8;
const RAW_CURVATURE_BITS: u32 = 12;
const MOMENTUM_BITS: u32 = 8;

/// Stride of the weight grid with the reciprocal of its cube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stride {
    /// Voxels between nodes, 1..=4.
    pub voxels: u8,
    /// round(2^bits / q³), within 2¹⁵..2¹⁶.
    reciprocal: i32,
    bits: u32,
    /// s: bits that a corner residual loses, so that it fits 16.
    lost_bits: u32,
}

impl Stride {
    /// A stride of 1..=4 voxels; anything else is `None`.
    pub const fn new(voxels: u8) -> Option<Self> {
        let (reciprocal, bits, lost_bits) = match voxels {
            1 => (1 << 15, 15, 0),
            2 => (1 << 15, 18, 0),
            3 => (38_836, 20, 1),
            4 => (1 << 15, 21, 2),
            _ => return None,
        };
        Some(Self { voxels, reciprocal, bits, lost_bits })
    }

    /// Corner residual: a voxel's residual times an integer trilinear weight, 16 bits.
    #[inline(always)]
    pub const fn corner_residual(self, residual: i16, phi: i16) -> i32 {
        round_shift(residual as i32 * phi as i32, self.lost_bits)
    }

    /// [`Stride::corner_residual`] in numbers of 16 bits alone, for vectors of eight.
    #[inline(always)]
    pub const fn short_corner_residual(self, residual: i16, phi: i16) -> i16 {
        let shift = self.lost_bits as u16 & 15;
        let rounds = (shift != 0) as u16;
        let low = residual.wrapping_mul(phi) as u16;
        let high = ((residual as i32 * phi as i32) >> 16) as i16;
        let whole = ((high << 1) << (15 - shift)) | (low >> shift) as i16;
        whole.wrapping_add(((low >> (shift - rounds)) & rounds) as i16)
    }

    /// q³.
    const fn cube(self) -> u32 {
        let q = self.voxels as u32;
        q * q * q
    }
}

/// How far a box of ratios is shifted, and what it is divided by, for one kernel radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kernel {
    /// Radius in nodes.
    pub radius: u8,
    /// Nodes in the box, (2 r + 1)³.
    pub volume: u32,
    /// q³, by which a node's gradient is still multiplied.
    cube: u32,
    /// s: bits that the corner residuals of a gradient have lost.
    lost_bits: u32,
    /// F: bits behind the point of a ratio.
    pub ratio_bits: u32,
    /// H: bits behind the point of a node gradient.
    pub gradient_bits: u32,
}

impl Kernel {
    /// The kernel of a radius in nodes that are `stride` voxels apart; stride (2 radius + 1) is 31 at most.
    pub const fn new(radius: u8, stride: Stride) -> Self {
        let side = 2 * radius as u32 + 1;
        let (volume, cube) = (side * side * side, stride.cube());
        let ratio_bits = least(25 - bits(volume), 16);
        // Few enough that a cell's gradient is never shifted to the left.
        let lost_bits = stride.lost_bits;
        let most = DISTANCE_BITS + MIN_EXPONENT as u32 - lost_bits;
        let gradient_bits = least(26 - bits(volume * cube * cube), most);
        Self { radius, volume, cube, lost_bits, ratio_bits, gradient_bits }
    }

    /// Bits by which a cell's gradient of a mode with this exponent is shifted to node units.
    #[inline(always)]
    pub const fn node_shift(self, exponent: u8) -> u32 {
        exponent as u32 + DISTANCE_BITS - self.gradient_bits - self.lost_bits
    }
}

/// The least n with 2^n >= x.
const fn bits(x: u32) -> u32 {
    32 - (x - 1).leading_zeros()
}

const fn least(a: u32, b: u32) -> u32 {
    if a < b { a } else { b }
}

/// The numbers of the local fit and what is done with them.
pub trait Arithmetic: Copy {
    /// Weight of a mode at a node.
    type Weight: Copy + Default + Debug;
    /// Numbers of the eight corners of a cell: weights of a mode, or corner residuals of a voxel.
    type Row: Row<Self>;
    /// Residual of a voxel, already times its hull weight; the hull's keys use the same memory before.
    type Residual: Lent<u16> + Debug;
    /// Sums of products, node fields and their integral images; the fitted surface uses the same memory before.
    type Sum: Lent<u32> + Debug;
    /// One over a node's smoothed curvature.
    type Reciprocal: Copy + Default + Debug;
    /// What a box of ratios of one mode is multiplied by.
    type Gain: Copy + Default + Debug;

    /// The sum of nothing.
    const ZERO: Self::Sum;

    /// A weight from a global one in standard deviations, limited to ±16.
    fn weight(sigma: f64) -> Self::Weight;
    /// A weight as the fixed-point fit keeps it, for digests.
    fn stored(weight: Self::Weight) -> i16;
    /// The sum of a voxel's modes from those with each corner's weights, its integer trilinear weights and the
    /// brick's least exponent.
    fn blend(sums: &[Self::Sum; 8], phi: &TrilinearWeights, least: u8, stride: Stride) -> Self::Sum;
    /// W (M + sum - t), limited to ±8 voxels before the weight; `mean` and `target` in 1/256 voxel.
    fn residual(mean: i16, target: i16, weight: i32, sum: Self::Sum) -> Self::Residual;
    /// M + sum, 1/256 voxel, saturated: the fitted distance of a voxel.
    fn distance(mean: i16, sum: Self::Sum) -> i16;
    /// A cell's gradient 2^-exponent in node units.
    fn to_node(sum: Self::Sum, exponent: u8, kernel: Kernel) -> Self::Sum;
    /// W Σ g b'² of a voxel (2⁻¹² voxel² `raw`) times an integer trilinear weight φ.
    fn curvature(raw: u32, weight: i32, phi: i32) -> Self::Sum;
    /// A cell's curvature / q³ in node units.
    fn curvature_to_node(sum: Self::Sum, stride: Stride) -> Self::Sum;
    /// a + b, wrapping: box sums are exact whatever wraps on the way.
    fn add(a: Self::Sum, b: Self::Sum) -> Self::Sum;
    /// Whether all sums are 0.
    fn is_zero(sums: &[Self::Sum]) -> bool;
    /// a - b, wrapping.
    fn subtract(a: Self::Sum, b: Self::Sum) -> Self::Sum;
    /// 1 / (boxed curvature + volume · ridge), `ridge` in voxel².
    fn reciprocal(boxed: Self::Sum, ridge: f64, kernel: Kernel) -> Self::Reciprocal;
    /// boxed gradient · reciprocal, limited to ±[`RATIO_LIMIT`] σ.
    fn ratio(boxed: Self::Sum, reciprocal: Self::Reciprocal, kernel: Kernel) -> Self::Sum;
    /// μ g / volume.
    fn gain(step: f64, gain: f64, kernel: Kernel) -> Self::Gain;
    /// clamp(V + β (V - V_prev) - gain · boxed ratio, ±16), `momentum` = 256 β.
    fn step(
        weight: Self::Weight,
        previous: Self::Weight,
        momentum: i32,
        boxed: Self::Sum,
        gain: Self::Gain,
    ) -> Self::Weight;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::MAX_MODES;
    use crate::schedule::WIDEST;

    /// Largest basis value.
    const BASIS: u64 = i8::MIN.unsigned_abs() as u64;

    /// Strides, each with the kernels that go with it.
    fn kernels() -> impl Iterator<Item = (Stride, Kernel)> {
        let radii = |stride| (0..=WIDEST as u8).map(move |radius| (stride, radius));
        let fits = |&(stride, radius): &(Stride, u8)| {
            u32::from(stride.voxels) * (2 * u32::from(radius) + 1) <= WIDEST
        };
        let all = (1..=4).filter_map(Stride::new).flat_map(radii);
        all.filter(fits).map(|(stride, radius)| (stride, Kernel::new(radius, stride)))
    }

    #[test]
    fn reciprocal_of_the_cube_is_exact_to_four_millionths() {
        for voxels in 1..=4u8 {
            let stride = Stride::new(voxels).unwrap();
            let cube = f64::from(voxels).powi(3);
            let found = f64::from(stride.reciprocal) / 2f64.powi(stride.bits as i32);
            assert!((found * cube - 1.0).abs() < 4e-6, "{voxels}: {found}");
        }
    }

    #[test]
    fn every_box_of_ratios_and_gradients_stays_within_31_bits() {
        for (stride, kernel) in kernels() {
            let ratios = RATIO_LIMIT as u64 * u64::from(kernel.volume);
            assert!(ratios << kernel.ratio_bits <= 1 << 31, "{kernel:?}");
            // Of every voxel the largest residual times the largest basis value.
            let bits = DISTANCE_BITS + u32::from(MIN_EXPONENT);
            let gradient = u128::from(RESIDUAL_LIMIT as u64 * BASIS * u64::from(stride.cube()));
            let voxels = u128::from(kernel.volume * stride.cube());
            assert!((gradient * voxels) << kernel.gradient_bits <= 1 << (31 + bits), "{kernel:?}");
        }
    }

    #[test]
    fn every_box_of_curvatures_stays_within_31_bits() {
        // The largest that a voxel can have is limited.
        let voxel = Fixed::curvature(u32::MAX, FULL_WEIGHT, 1) as u64;
        assert!(voxel * u64::from(WIDEST).pow(3) < 1 << 31);
    }

    #[test]
    fn corner_residuals_and_sums_of_cells_stay_within_their_bits() {
        let most = 1 << 15;
        assert!(u64::from(MAX_MODES) * BASIS * most < 1 << 31, "sums with the weights of a corner");
        for stride in (1..=4).filter_map(Stride::new) {
            let cube = u64::from(stride.cube());
            // Rounded half up.
            let half = (1 << stride.lost_bits) >> 1;
            assert!((RESIDUAL_LIMIT as u64 * cube + half) >> stride.lost_bits < most, "{stride:?}");
            assert!(most * BASIS * cube < 1 << 31, "{stride:?}: a cell's gradient");
        }
    }

    #[test]
    fn corner_residuals_in_sixteen_bits_are_the_same() {
        for voxels in 1..=4u8 {
            let (stride, most) = (Stride::new(voxels).unwrap(), i16::from(voxels).pow(3));
            for residual in (-RESIDUAL_LIMIT as i16..=RESIDUAL_LIMIT as i16).step_by(7) {
                let same = |phi: i16| {
                    i32::from(stride.short_corner_residual(residual, phi))
                        == stride.corner_residual(residual, phi)
                };
                assert!((0..=most).all(same), "{voxels}: {residual}");
            }
        }
    }

    #[test]
    fn fixed_and_float_agree_on_one_step() {
        let kernel = Kernel::new(1, Stride::new(3).unwrap());
        let fixed = Fixed::step(1000, 900, 179, 1 << 16, Fixed::gain(3.0, 2.0, kernel));
        let boxed = f64::from(1 << 16) / f64::from(1u32 << kernel.ratio_bits);
        let float = Float::step(1000.0 / 2048.0, 900.0 / 2048.0, 179, boxed, Float::gain(3.0, 2.0, kernel));
        assert!((f64::from(fixed) / 2048.0 - float).abs() < 1.0 / 2048.0);
    }

    #[test]
    fn every_step_of_every_mode_is_as_long_as_in_floats() {
        let stride = Stride::new(3).unwrap();
        for pass in crate::schedule::DEFAULT.iter().chain(&crate::schedule::MOMENTUM) {
            let kernel = Kernel::new(pass.radius, stride);
            for &step in pass.steps {
                for gain in [0.01, 1.0, 60.0, 96.0, 130.0, crate::format::MAX_MODE] {
                    let (step, gain) = (f64::from(step), f64::from(gain));
                    let moved = Fixed::step(0, 0, 0, -32, Fixed::gain(step, gain, kernel));
                    let boxed = -32.0 / f64::from(1u32 << kernel.ratio_bits);
                    let exact = Float::step(0.0, 0.0, 0, boxed, Float::gain(step, gain, kernel)) * 2048.0;
                    let found = f64::from(moved);
                    assert!((found - exact).abs() < 0.6 + exact / 32768.0, "{step} {gain}: {found} {exact}");
                }
            }
        }
    }

    #[test]
    fn weights_saturate_and_refuse_nan() {
        assert_eq!(Fixed::weight(99.0), 32767);
        assert_eq!(Fixed::weight(-99.0), -32767);
        assert_eq!(Fixed::weight(f64::NAN), 0);
        assert_eq!(Float::weight(f64::NAN), 0.0);
    }
}
