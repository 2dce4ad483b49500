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
    /// One in how many of the modes move, the strongest ones; 0 counts as 1.
    pub part: u8,
}

impl Pass<'_> {
    /// How many of `modes` modes move, at least one.
    pub const fn moving(&self, modes: usize) -> usize {
        let part = if self.part == 0 { 1 } else { self.part as usize };
        modes.div_ceil(part)
    }
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
    Pass { radius: 3, steps: &[3.0; 4], part: 1 },
    Pass { radius: 1, steps: &[3.0; 4], part: 1 },
    Pass { radius: 0, steps: &[3.0; 16], part: 1 },
];

/// Varying steps without momentum, 19 iterations: what ships.
///
/// A step μ multiplies each part of a deviation from the solution by 1 - μ λ, with the eigenvalue λ of B D⁻¹ B
/// ([`local_fit`](crate::local_fit)) that belongs to it. They lie within 0..1.15, and within 0..1 where the kernel is one
/// node: a voxel's trilinear weights sum to one, and its curvature is the most that its modes can do. Steps 1/λ at the
/// Chebyshev nodes of 0.05..1.15 (wide kernels) and 0.009..1 (one node) damp all parts as well as momentum does, without its
/// second copy of the weights (measured on complete faces: 0.13 mm either way, 580 instead of 825 KiB).
///
/// Their order was searched for: a deviation grows to six times itself at most on the way (29 times in Leja order,
/// which drove weights into their limits and left bumps), and what is rounded off is amplified no more than in Leja
/// order (4 times, root mean square).
///
/// The widest kernel moves only the strongest third of the modes, which saves time: what the others would find with it, the
/// narrower kernels find in their passes anyway.
pub const DEFAULT: [Pass<'static>; 3] = [
    Pass { radius: 3, steps: &SHORT, part: 3 },
    Pass { radius: 1, steps: &SHORT, part: 1 },
    Pass { radius: 0, steps: &LONG, part: 1 },
];

/// Chebyshev steps for 2 iterations, eigenvalues within 0.05..1.15.
const SHORT: [f32; 2] = [1.0112, 4.7373];
/// Chebyshev steps for 15 iterations, eigenvalues within 0.009..1.
const LONG: [f32; 15] = [
    4.6893, 1.646, 1.0711, 30.0738, 1.0027, 13.2653, 2.4908, 1.4164, 1.1458, 85.365, 1.2567, 7.3383, 1.0249,
    1.9822, 3.3007,
];

/// Widest kernel, voxels: the bounds of the sums are proved up to there.
pub const WIDEST: u32 = 31;

impl Schedule<'static> {
    /// What ships, [`DEFAULT`], with the stride that a model is made for.
    pub const fn of(model: &Model<'_>) -> Self {
        Self { stride: model.header().stride, momentum: 0, passes: &DEFAULT }
    }

    /// [`MOMENTUM`] with the stride that a model is made for; needs a second copy of the weights.
    pub const fn with_momentum(model: &Model<'_>) -> Self {
        Self { stride: model.header().stride, momentum: 179, passes: &MOMENTUM }
    }
}

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
            if width > WIDEST {
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
    fn a_part_of_the_modes_moves_and_never_none() {
        let moving = |part, modes| Pass { radius: 3, steps: &SHORT, part }.moving(modes);
        assert_eq!([moving(1, 29), moving(3, 29), moving(3, 30), moving(3, 31)], [29, 10, 10, 11]);
        assert_eq!([moving(3, 2), moving(200, 127), moving(0, 7)], [1, 1, 7]);
    }

    #[test]
    fn the_steps_damp_what_they_are_made_for() {
        assert!(worst(&SHORT, 0.05, 1.15) < 0.73);
        assert!(worst(&LONG, 0.009, 1.0) < 0.12);
    }

    #[test]
    fn no_beginning_of_the_steps_amplifies_much() {
        for n in 1..=15 {
            assert!(worst(&LONG[..n], 0.0, 1.0) < 6.0, "{n}: {}", worst(&LONG[..n], 0.0, 1.0));
        }
    }
}
