//! What a point contributes to the fit of pose and shape: a row of integers, its residual and its weight.
//!
//! ```text
//! row = √w [ b'(q) / γ | q~ × n | n | q~·n - r | r ]
//! ```
//!
//! Every entry is in a power of two of its own, chosen so that it is below [`LIMIT`], and then products of entries are
//! summed exactly ([`crate::columns`]):
//!
//! - modes: 2^-(3 + E), E the mode's least exponent in the model; |b'| ≤ 128 / 2^E and γ ≥ 0.3 make 3414 at most;
//! - n: 2⁻¹² voxel; it is at most 1 long;
//! - q~ × n and q~·n - r: 2⁻¹² of the power of two above the longest arm that a place in the grid can have, and c;
//! - r: 2⁻¹² of the power of two above c, because √w |r| = |r| / √(1 + (r / c)²) < c.

use crate::arithmetic::MAX_EXPONENT;
use crate::columns::LIMIT;
use crate::corners::{FACTOR_BITS, MODES, PARTS, Weights};
use crate::cube::Cube;
use crate::model::Model;
use crate::pose::{cross, dot, zip};
use crate::pose_fit::{POSE, Round};
use crate::sample::{self, power};

/// Entries of a row besides the modes: turn, shift, growth, residual.
pub const EXTRA: usize = POSE + 1;
/// Entries of one unit of n.
const ONE: f32 = (1 << 12) as f32;
const _: () = assert!(ONE < LIMIT as f32);

/// Most entries of a row.
pub const MOST_ENTRIES: usize = PARTS * MODES + EXTRA;

/// Makes the rows of points.
#[derive(Clone, Copy, Debug)]
pub struct Rows<'a> {
    model: &'a Model<'a>,
    /// Least exponent of each mode.
    least: [[u8; MODES]; PARTS],
    weights: Weights,
    centre: [f32; 3],
    /// c, voxels.
    misfit: f32,
    /// Whether the rows have the modes.
    shape: bool,
    /// Power of two above every arm, voxels.
    arm: f32,
    /// Power of two above c, voxels.
    residual: f32,
}

impl<'a> Rows<'a> {
    /// Rows for a model; [`Rows::set`] is wanted before the first one.
    pub fn new(model: &'a Model<'a>) -> Self {
        let mut least = [[MAX_EXPONENT; MODES]; PARTS];
        for brick in model.bricks() {
            for (least, &exponent) in least.as_flattened_mut().iter_mut().zip(brick.exponents()) {
                *least = (*least).min(exponent);
            }
        }
        let centre = [0.0; 3];
        Self {
            model,
            least,
            weights: Weights::NONE,
            centre,
            misfit: 1.0,
            shape: false,
            arm: 1.0,
            residual: 1.0,
        }
    }

    /// Turns are about `centre` (voxels), the shape is given by `weights` (standard deviations).
    pub fn set(&mut self, round: &Round, centre: [f32; 3], weights: &[f32]) {
        self.shape = round.shape;
        self.weights = if round.shape { Weights::new(weights) } else { Weights::NONE };
        self.misfit = round.misfit * self.model.header().scales.millimetre;
        self.centre = centre;
        let sides = self.model.grid().sides().map(f32::from);
        let longest = zip(centre, sides, |c, side| c.abs().max((side - c).abs()));
        self.arm = above(libm::sqrtf(dot(longest, longest)) + self.misfit);
        self.residual = above(self.misfit);
    }

    /// Entries of a row: the modes, if they are estimated, and [`EXTRA`].
    pub const fn entries(&self) -> usize {
        self.modes() + EXTRA
    }

    /// The model.
    pub const fn model(&self) -> &'a Model<'a> {
        self.model
    }

    const fn modes(&self) -> usize {
        if self.shape { self.model.modes() } else { 0 }
    }

    /// Units of the entries.
    pub fn units(&self) -> [f32; MOST_ENTRIES] {
        let mut units = [0.0; MOST_ENTRIES];
        let modes = self.modes();
        for (unit, &least) in units.iter_mut().zip(self.least.as_flattened()) {
            *unit = power(least + 3);
        }
        let (turn, shift) = (self.arm / ONE, 1.0 / ONE);
        let extra = [turn, turn, turn, shift, shift, shift, turn, self.residual / ONE];
        units.iter_mut().skip(modes).zip(extra).for_each(|(slot, unit)| *slot = unit);
        units
    }

    /// Finds the voxels around a place and the surface of the weights set last, for [`Rows::fill`]: to be kept from place to
    /// place, because neighbours lie in the same brick.
    pub const fn cube(&self) -> Cube<'a, '_> {
        Cube::new(self.model, &self.weights)
    }

    /// Fills the first [`Rows::entries`] entries of the row of a place `q` (voxels). Residual r and weight w where it
    /// counts; `None` off the model, or too far from its surface. `cube` is of these rows.
    pub fn fill(
        &self,
        q: [f32; 3],
        cube: &mut Cube<'_, '_>,
        row: &mut [i16; MOST_ENTRIES],
    ) -> Option<(f32, f32)> {
        let (distance, gradient) = match cube.find(q) {
            Some(cube) => cube.distance(),
            None if self.shape => return None,
            None => sample::far(self.model, q)?,
        };
        let steepness = steepness(gradient);
        let residual = distance / steepness;
        let farthest = (15.0 * self.model.header().scales.millimetre).max(2.0 * self.misfit);
        if residual.is_nan() || residual.abs() >= farthest {
            return None;
        }
        let ratio = residual / self.misfit;
        let weight = 1.0 / (1.0 + ratio * ratio);
        let root = libm::sqrtf(weight);
        let share = root / steepness;
        let modes = self.modes();
        let factor = share * (1 << FACTOR_BITS) as f32;
        let least = self.least.get(..modes.div_ceil(MODES))?;
        cube.modes(factor as i16, least, row.as_chunks_mut().0);
        let normal = gradient.map(|g| g * share * ONE);
        let arm = zip(q, self.centre, |a, b| (a - b) / self.arm);
        let [a, b, c] = cross(arm, normal);
        let [x, y, z] = normal;
        let pull = root * residual * ONE;
        let values = [a, b, c, x, y, z, dot(arm, normal) - pull / self.arm, pull / self.residual];
        for (slot, value) in row.get_mut(modes..)?.iter_mut().zip(values) {
            *slot = nearest(value);
        }
        Some((residual, weight))
    }
}

/// Least γ: where the distance changes less along its gradient, it is none.
const FLATTEST: f32 = 0.3;
const _: () = assert!(((1u32 << FACTOR_BITS) as f32 / FLATTEST) < 32768.0);

/// γ = max(|g|, 0.3) of a distance's gradient g.
pub fn steepness(gradient: [f32; 3]) -> f32 {
    libm::sqrtf(dot(gradient, gradient)).max(FLATTEST)
}

/// The least power of two above a positive number.
fn above(x: f32) -> f32 {
    f32::from_bits((x.to_bits() & 0x7f80_0000).wrapping_add(0x0080_0000))
}

/// The nearest integer of a number below 2¹⁵: at 1.5 · 2²³ floats are integers, and their last bits count.
fn nearest(x: f32) -> i16 {
    (x + 12_582_912.0).to_bits() as i16
}
