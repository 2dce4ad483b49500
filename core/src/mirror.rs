//! The mirror prior: in a class that is symmetric about a plane, what was measured on one side hints at the other.
//!
//! ```text
//! p' = p - 2 (n·p - d) n          n' = normal - 2 (n·normal) n
//! ```
//!
//! The points of a scan claim voxels a second time through their mirror images, but only voxels that no measured
//! point claims, and with [`WEIGHT`] instead of sixteen sixteenths ([`HullBuilder::add_mirrored`]). Faces are not
//! symmetric to a millimetre, so this is worth having only where a whole side is missing: mirrored voxels that are
//! fewer than [`LEAST_SHARE`] of the measured ones are dropped again.
//!
//! [`HullBuilder::add_mirrored`]: crate::HullBuilder::add_mirrored

use crate::format::Symmetry;
use crate::pose::{dot, zip};

/// Weight of a mirrored voxel, sixteenths.
pub const WEIGHT: i32 = 5;
/// Mirrored voxels are kept from this share of the measured ones on, hundredths.
pub const LEAST_SHARE: u32 = 15;

impl Symmetry {
    /// The mirror image of a point, voxels.
    pub fn reflect(&self, point: [f32; 3]) -> [f32; 3] {
        let twice = 2.0 * (dot(self.normal, point) - self.offset);
        zip(point, self.normal, |p, n| p - twice * n)
    }

    /// The mirror image of a direction.
    pub fn turn(&self, direction: [f32; 3]) -> [f32; 3] {
        let twice = 2.0 * dot(self.normal, direction);
        zip(direction, self.normal, |v, n| v - twice * n)
    }

    /// Whether this is a plane: finite, with a normal of unit length.
    pub fn is_sound(&self) -> bool {
        let length = dot(self.normal, self.normal);
        let finite = self.offset.is_finite() && self.deviation.is_finite() && self.deviation >= 0.0;
        finite && (0.999..1.001).contains(&length) && self.offset.abs() < 1e5
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_is_mirrored_at_the_plane_and_back() {
        let plane = Symmetry { normal: [0.6, 0.0, 0.8], offset: 2.0, deviation: 0.0 };
        let point = [3.0, -1.0, 5.0];
        let image = plane.reflect(point);
        let middle = zip(point, image, |a, b| (a + b) / 2.0);
        assert!((dot(plane.normal, middle) - plane.offset).abs() < 1e-5);
        let back = plane.reflect(image);
        assert!(back.iter().zip(point).all(|(a, b)| (a - b).abs() < 1e-5), "{back:?}");
        let along = plane.turn(plane.normal);
        assert!(along.iter().zip(plane.normal).all(|(a, n)| (a + n).abs() < 1e-5), "{along:?}");
    }

    #[test]
    fn a_normal_that_is_not_of_unit_length_is_no_plane() {
        let plane = Symmetry { normal: [1.0, 0.0, 0.0], offset: 0.0, deviation: 0.1 };
        assert!(plane.is_sound());
        assert!(!Symmetry { normal: [1.1, 0.0, 0.0], ..plane }.is_sound());
        assert!(!Symmetry { offset: f32::NAN, ..plane }.is_sound());
    }
}
