//! The order of a space-filling curve: neighbours in the list are neighbours in space, as the
//! [pose fit](crate::pose_fit) wants them.
//!
//! The Morton code of a point interleaves the bits of its coordinates, z above y above x. The points are sorted by
//! the code's first [`LEVELS`] bits in place, one bit at a time from the highest: each bit halves a range of
//! points, which are then sorted by the next bit. An order by which nothing is moved is the order already.

use crate::cloud::Packed;

/// Bits of a code that count: ten a coordinate, cells of 64 steps.
const LEVELS: u8 = 30;

/// Brings points into the order of the curve. At most [`LEVELS`] looks at each point; the recursion is as deep.
pub fn along_curve(points: &mut [Packed]) {
    sort(points, 0);
}

fn sort(points: &mut [Packed], level: u8) {
    if points.len() < 2 || level >= LEVELS {
        return;
    }
    let middle = halve(points, level);
    let Some((low, high)) = points.split_at_mut_checked(middle) else { return };
    sort(low, level.saturating_add(1));
    sort(high, level.saturating_add(1));
}

/// Brings the points whose bit is 0 before those whose bit is 1: how many there are of the former.
fn halve(points: &mut [Packed], level: u8) -> usize {
    let mut both_ends = points.iter_mut();
    let mut low = 0usize;
    while let Some(point) = both_ends.next() {
        if bit(point, level) {
            let Some(other) = both_ends.rfind(|other| !bit(other, level)) else { break };
            core::mem::swap(point, other);
        }
        low = low.saturating_add(1);
    }
    low
}

/// A bit of the code; 0 is the highest.
fn bit(&[x, y, z, ..]: &Packed, level: u8) -> bool {
    let coordinate = match level % 3 {
        0 => z,
        1 => y,
        _ => x,
    };
    // Negative coordinates come first.
    let ascending = coordinate.cast_unsigned() ^ 0x8000;
    ascending << (level / 3) & 0x8000 != 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn code(&[x, y, z, ..]: &Packed) -> u32 {
        let cell = |c: i16| (i32::from(c) + 32_768) as u32 / 64;
        let spread = |c: i16| (0..10).fold(0, |code, bit| code | (cell(c) >> bit & 1) << (3 * bit));
        spread(x) | spread(y) << 1 | spread(z) << 2
    }

    /// Points all over the range, the last number of each its place.
    fn scattered<const N: usize>() -> [Packed; N] {
        let mut state = 1u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 16) as i16
        };
        core::array::from_fn(|place| [next(), next(), next() / 64, 0, 0, place as i16])
    }

    #[test]
    fn points_come_into_the_order_of_their_codes_and_none_is_lost() {
        let mut points = scattered::<3000>();
        along_curve(&mut points);
        assert!(points.is_sorted_by_key(code));
        points.sort_unstable_by_key(|point| point[5]);
        assert_eq!(points, scattered::<3000>());
    }

    #[test]
    fn points_in_order_stay_where_they_are() {
        let mut points = scattered::<500>();
        along_curve(&mut points);
        let once = points;
        along_curve(&mut points);
        assert_eq!(points, once);
        let mut same = [[7; 6]; 9];
        along_curve(&mut same);
        assert_eq!(same, [[7; 6]; 9]);
    }
}
