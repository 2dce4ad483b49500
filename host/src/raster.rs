//! A box of samples as one array, x fastest: the raster scan that makes a vector of a volume, section 2.2 of the paper.

/// Samples of a box with `sides` of them along x, y and z.
pub fn len(sides: [usize; 3]) -> usize {
    sides.iter().product()
}

/// From a sample's place in the array to that of the next one along x, y and z.
pub const fn strides(sides: [usize; 3]) -> [usize; 3] {
    [1, sides[0], sides[0] * sides[1]]
}

/// Place of a sample in the array.
pub fn index(sides: [usize; 3], [x, y, z]: [usize; 3]) -> usize {
    (z * sides[1] + y) * sides[0] + x
}

/// Sample at a place of the array.
pub fn voxel([width, height, _]: [usize; 3], index: usize) -> [usize; 3] {
    [index % width, index / width % height, index / width / height]
}

/// Slope of a sample's value along an axis, from the values before and behind it, each NaN where there is none: the
/// central difference, or that to the one there is, or 0.
pub fn slope(before: f32, own: f32, behind: f32) -> f32 {
    match (before.is_nan(), behind.is_nan()) {
        (false, false) => (behind - before) / 2.0,
        (false, true) => own - before,
        (true, false) => behind - own,
        (true, true) => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_central_one_sided_or_none() {
        let none = f32::NAN;
        let slopes =
            [slope(1.0, 2.0, 5.0), slope(none, 2.0, 5.0), slope(1.0, 2.0, none), slope(none, 2.0, none)];
        assert_eq!(slopes, [2.0, 3.0, 1.0, 0.0]);
        assert!(slope(none, none, 5.0).is_nan());
    }

    #[test]
    fn samples_invert_places_and_x_is_fastest() {
        let sides = [3, 4, 5];
        assert!((0..len(sides)).all(|i| index(sides, voxel(sides, i)) == i));
        assert_eq!([index(sides, [1, 0, 0]), index(sides, [0, 1, 0]), index(sides, [0, 0, 1])], [1, 3, 12]);
        assert_eq!(strides(sides), [1, 3, 12]);
    }
}
