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
