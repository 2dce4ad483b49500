//! The order of a space-filling curve: neighbours in the list are neighbours in space, as the
//! [pose fit](crate::pose_fit) wants them.
//!
//! The Morton code of a place interleaves the bits of its coordinates, z above y above x. Items are sorted by the
//! first 30 bits of their places' codes, in their own memory, one bit at a time from the highest: each bit halves
//! a range of items, which are then sorted by the next bit. Items in order are not moved.

use crate::cloud::Packed;

/// Bits of a code that count: ten a coordinate, cells of 64.
const LEVELS: u8 = 30;

/// Brings packed points into the order of the curve.
pub fn along_curve(points: &mut [Packed]) {
    // Negative coordinates come first.
    sort_along_curve(points, &|&[x, y, z, ..]: &Packed| [x, y, z].map(|c| c.cast_unsigned() ^ 0x8000));
}

/// Brings items into the order of the curve by their places. Each is looked at 30 times at most, and calls nest 30 deep at
/// most: a bit of the code for each.
pub fn sort_along_curve<T>(items: &mut [T], place: &impl Fn(&T) -> [u16; 3]) {
    sort(items, place, 0);
}

fn sort<T>(items: &mut [T], place: &impl Fn(&T) -> [u16; 3], level: u8) {
    if items.len() < 2 || level >= LEVELS {
        return;
    }
    let middle = halve(items, |item| bit(place(item), level));
    let Some((low, high)) = items.split_at_mut_checked(middle) else { return };
    sort(low, place, level.saturating_add(1));
    sort(high, place, level.saturating_add(1));
}

/// Brings the items that are not `high` before those that are: how many there are of the former.
fn halve<T>(items: &mut [T], high: impl Fn(&T) -> bool) -> usize {
    let mut both_ends = items.iter_mut();
    let mut low = 0usize;
    while let Some(item) = both_ends.next() {
        if high(item) {
            let Some(other) = both_ends.rfind(|other| !high(other)) else { break };
            core::mem::swap(item, other);
        }
        low = low.saturating_add(1);
    }
    low
}

/// A bit of a place's code; 0 is the highest.
fn bit([x, y, z]: [u16; 3], level: u8) -> bool {
    let coordinate = match level % 3 {
        0 => z,
        1 => y,
        _ => x,
    };
    coordinate << (level / 3) & 0x8000 != 0
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
