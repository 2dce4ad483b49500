//! A voxel's entry in the hull: the measured distance and its weight, in 16 bits.

use crate::arithmetic::{FULL_WEIGHT, RESIDUAL_LIMIT};

/// A packed hull entry: distance in the upper twelve bits, weight in the lower four.
///
/// The nibble is 0 where the voxel is not in the hull and W - 1 otherwise, W = 16 for a measured voxel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Target(pub i16);

impl Target {
    /// A target at a distance (1/256 voxel, limited to ±2047) with a weight in sixteenths: 2 to 16, limited to that;
    /// 1 and less is none.
    #[inline]
    pub const fn new(distance: i32, weight: i32) -> Self {
        let limit = RESIDUAL_LIMIT;
        let distance = if distance > limit {
            limit
        } else if distance < -limit {
            -limit
        } else {
            distance
        };
        let nibble = if weight < 1 {
            0
        } else if weight > FULL_WEIGHT {
            FULL_WEIGHT - 1
        } else {
            weight - 1
        };
        Self(((distance << 4) | nibble) as i16)
    }

    /// Distance t, 1/256 voxel.
    #[inline(always)]
    pub const fn distance(self) -> i16 {
        self.0 >> 4
    }

    /// Weight W in sixteenths, 0 outside the hull.
    #[inline(always)]
    pub const fn weight(self) -> i32 {
        let nibble = (self.0 & 15) as i32;
        if nibble == 0 { 0 } else { nibble + 1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_keep_distance_and_weight_apart() {
        for distance in [-2047, -300, -1, 0, 1, 17, 2047] {
            for weight in 2..=16 {
                let target = Target::new(distance, weight);
                assert_eq!((i32::from(target.distance()), target.weight()), (distance, weight));
            }
        }
        assert_eq!(Target(0).weight(), 0);
        assert_eq!([-1, 0, 1, 16, 17, i32::MAX].map(|w| Target::new(5, w).weight()), [0, 0, 0, 16, 16, 16]);
        assert_eq!(Target::new(9999, 16).distance(), 2047);
    }
}
