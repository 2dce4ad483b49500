//! The local fit's schedule: a fixed list of kernel radii and step lengths, no convergence test.

use crate::arithmetic::Stride;
use crate::error::{Error, OptionName};
use crate::model::Model;

/// Iterations at one kernel radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pass<'a> {
    /// Radius r of the box kernel, nodes: its side is (2 r + 1) q voxels.
    pub radius: u8,
    /// Step length μ of each iteration, within 0..=1024.
    pub steps: &'a [f32],
}

/// A local fit's settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Schedule<'a> {
    /// Voxels between nodes, q.
    pub stride: u8,
    /// 256 β, 0..=255. Only with β > 0 the previous weights are kept, which takes as much memory again
    /// as the weights.
    pub momentum: u8,
    /// Passes, widest kernel first.
    pub passes: &'a [Pass<'a>],
}

/// Constant steps with heavy-ball momentum, 24 iterations: μ = 3, β = 179/256.
pub const MOMENTUM: [Pass<'static>; 3] = [
    Pass { radius: 3, steps: &[3.0; 4] },
    Pass { radius: 1, steps: &[3.0; 4] },
    Pass { radius: 0, steps: &[3.0; 16] },
];

/// Varying steps without momentum, 24 iterations: what ships.
///
/// The eigenvalues of B D⁻¹ B lie within 0..1.15. Steps 1/λ at the Chebyshev nodes of 0.02..1.15 (wide
/// kernels) and 0.009..1.15 (none), in Leja order so that rounding is not amplified on the way, damp all
/// of them as well as momentum does, without its second copy of the weights (measured on complete faces:
/// 0.13 mm either way, 580 instead of 825 KiB).
pub const DEFAULT: [Pass<'static>; 3] =
    [Pass { radius: 3, steps: &SHORT }, Pass { radius: 1, steps: &SHORT }, Pass { radius: 0, steps: &LONG }];

/// Chebyshev steps for 4 iterations, eigenvalues within 0.02..1.15.
const SHORT: [f32; 4] = [0.9033, 15.8710, 1.2481, 2.7116];
/// Chebyshev steps for 16 iterations, eigenvalues within 0.009..1.15.
const LONG: [f32; 16] = [
    0.8716, 85.1273, 1.5738, 3.2199, 1.0622, 7.2203, 0.9237, 1.9099, 13.0952, 1.1786, 0.8885, 4.5960, 1.3421,
    29.7925, 0.9799, 2.4161,
];

impl<'a> Schedule<'a> {
    /// Iterations in all passes.
    pub fn iterations(&self) -> usize {
        self.passes.iter().map(|pass| pass.steps.len()).sum()
    }

    /// Checks the settings against a model.
    ///
    /// # Errors
    /// A stride that does not divide the brick, a kernel beyond the proved bounds, a step out of range.
    pub fn check(&self, model: &Model<'_>) -> Result<Stride, Error> {
        let brick = model.grid().brick();
        let stride = Stride::new(self.stride).filter(|_| brick.is_multiple_of(self.stride));
        let stride = stride.ok_or(Error::Stride { asked: self.stride, brick })?;
        for pass in self.passes {
            let width = u32::from(self.stride) * (2 * u32::from(pass.radius) + 1);
            if width > 31 {
                return Err(Error::Radius { asked: pass.radius });
            }
            if !pass.steps.iter().all(|s| s.is_finite() && (0.0..=1024.0).contains(s)) {
                return Err(Error::Option(OptionName::Step));
            }
        }
        Ok(stride)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest |Π (1 - λ μ)| over the eigenvalues.
    fn worst(steps: &[f32], low: f64, high: f64) -> f64 {
        let left = |l: f64| steps.iter().fold(1.0, |p: f64, &mu| p * (1.0 - l * f64::from(mu)));
        (0..=1000)
            .map(|i| low + (high - low) * f64::from(i) / 1000.0)
            .map(|l| left(l).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn the_steps_damp_what_they_are_made_for() {
        assert!(worst(&SHORT, 0.02, 1.15) < 0.7);
        assert!(worst(&LONG, 0.009, 1.15) < 0.12);
    }

    #[test]
    fn no_beginning_of_the_steps_amplifies_much() {
        for n in 1..=16 {
            assert!(worst(&LONG[..n], 0.0, 1.15) < 40.0, "{n}: {}", worst(&LONG[..n], 0.0, 1.15));
        }
    }
}
