//! The scan as the core takes it: oriented points, packed into six 16-bit integers each.
//!
//! Host and device unpack the same integers to the same floats, so that both fit the same scan; on the wire
//! and in memory a point takes 12 bytes. Positions are relative to a centre the caller keeps (the scan may lie
//! far from its origin), in steps of the cloud: 65535 steps over 300 mm are 0.005 mm each.

use crate::error::{Error, OptionName};
use libm::floorf;

/// A point: position in steps, then its outward unit normal in 1/16384.
pub type Packed = [i16; 6];

/// Units a component of a unit normal has.
const NORMAL: f32 = 16384.0;

/// A scan's points.
#[derive(Clone, Copy, Debug)]
pub struct Cloud<'a> {
    points: &'a [Packed],
    step: f32,
}

impl<'a> Cloud<'a> {
    /// Points whose positions count in `step` scan units.
    ///
    /// # Errors
    /// A step that is not a positive number.
    pub fn new(points: &'a [Packed], step: f32) -> Result<Self, Error> {
        if step.is_normal() && step > 0.0 {
            Ok(Self { points, step })
        } else {
            Err(Error::Option(OptionName::Step))
        }
    }

    /// Number of points.
    pub const fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there are none.
    pub const fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Position, scan unit, and outward normal of point `index`.
    pub fn point(&self, index: usize) -> Option<([f32; 3], [f32; 3])> {
        let &[x, y, z, a, b, c] = self.points.get(index)?;
        let position = [x, y, z].map(|v| f32::from(v) * self.step);
        Some((position, [a, b, c].map(|v| f32::from(v) / NORMAL)))
    }
}

/// The step that just holds positions up to `extent` scan units from the centre.
pub fn step_for(extent: f32) -> f32 {
    // One part in 30000 instead of 32767, so that rounding cannot leave the range.
    (extent / 30_000.0).max(f32::MIN_POSITIVE)
}

/// A position (scan units from the centre) and a unit normal as integers, saturated.
pub fn pack(position: [f32; 3], normal: [f32; 3], step: f32) -> Packed {
    let round = |v: f32| floorf(v + 0.5) as i16;
    let ([x, y, z], [a, b, c]) = (position.map(|v| round(v / step)), normal.map(|v| round(v * NORMAL)));
    [x, y, z, a, b, c]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_come_back_to_half_a_step() {
        let step = step_for(150.0);
        let (position, normal) = ([-150.0, 0.01, 99.987], [0.6, -0.8, 0.0]);
        let points = [pack(position, normal, step)];
        let (p, n) = Cloud::new(&points, step).unwrap().point(0).unwrap();
        assert!(p.iter().zip(position).all(|(a, b)| (a - b).abs() <= 0.51 * step));
        assert!(n.iter().zip(normal).all(|(a, b)| (a - b).abs() <= 0.51 / NORMAL));
    }

    #[test]
    fn a_step_must_be_a_positive_number() {
        for step in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert!(Cloud::new(&[], step).is_err(), "{step}");
        }
    }
}
