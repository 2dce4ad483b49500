//! Box means over the node grid by integral images.
//!
//! With wrapping integers a box sum is exact as long as it fits itself, whatever wrapped on the way.

use crate::arithmetic::Arithmetic;
use crate::grid::linear;

/// Replaces a field (x fastest) by its integral image: entry (x, y, z) becomes the sum of all entries up to
/// and including x, y and z.
pub fn integrate<A: Arithmetic>(field: &mut [A::Sum], sides: [u16; 3]) {
    let width = usize::from(sides[0]).max(1);
    let slice = (width * usize::from(sides[1])).max(1);
    for row in field.chunks_exact_mut(width) {
        let mut sum = A::Sum::default();
        for value in row {
            sum = A::add(sum, *value);
            *value = sum;
        }
    }
    for plane in field.chunks_exact_mut(slice) {
        accumulate::<A>(plane, width);
    }
    accumulate::<A>(field, slice);
}

/// Adds to each block of `length` the block before it.
fn accumulate<A: Arithmetic>(field: &mut [A::Sum], length: usize) {
    let mut rest = field;
    while let Some((before, after)) = rest.split_at_mut_checked(length) {
        for (value, &above) in after.iter_mut().zip(before.iter()) {
            *value = A::add(*value, above);
        }
        rest = after;
    }
}

/// Sum over the box of `radius` nodes around `at`, cut at the grid (zero outside), from an integral image.
#[inline]
pub fn box_sum<A: Arithmetic>(integral: &[A::Sum], sides: [u16; 3], at: [u16; 3], radius: u8) -> A::Sum {
    let r = u16::from(radius);
    let [x, y, z] = at;
    let high = [x, y, z].map(|v| v.saturating_add(r));
    let last = sides.map(|side| side.saturating_sub(1));
    let high = [high[0].min(last[0]), high[1].min(last[1]), high[2].min(last[2])];
    let low = at.map(|v| v.checked_sub(r + 1));
    let value = |x: Option<u16>, y: Option<u16>, z: Option<u16>| match (x, y, z) {
        (Some(x), Some(y), Some(z)) => integral.get(linear([x, y, z], sides)).copied().unwrap_or_default(),
        _ => A::Sum::default(),
    };
    let face = |z: Option<u16>| {
        let (hx, hy) = (Some(high[0]), Some(high[1]));
        let upper = A::subtract(value(hx, hy, z), value(low[0], hy, z));
        let lower = A::subtract(value(hx, low[1], z), value(low[0], low[1], z));
        A::subtract(upper, lower)
    };
    A::subtract(face(Some(high[2])), face(low[2]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arithmetic::{Fixed, Float};

    const SIDES: [u16; 3] = [5, 4, 6];

    fn naive(field: &[i32], at: [u16; 3], r: u16) -> i32 {
        let mut sum = 0i32;
        for (index, &value) in field.iter().enumerate() {
            let p = crate::grid::position(index, SIDES);
            if p.iter().zip(at).all(|(&a, b)| a.abs_diff(b) <= r) {
                sum = sum.wrapping_add(value);
            }
        }
        sum
    }

    #[test]
    fn box_sums_equal_naive_sums_even_when_the_integral_wraps() {
        let field: [i32; 120] = core::array::from_fn(|i| (i as i32 * 7919 % 1009 - 500) * 40_000);
        let mut integral = field;
        integrate::<Fixed>(&mut integral, SIDES);
        let mut float = field.map(f64::from);
        integrate::<Float>(&mut float, SIDES);
        for index in 0..field.len() {
            let at = crate::grid::position(index, SIDES);
            for radius in 0..4 {
                let exact = naive(&field, at, u16::from(radius));
                assert_eq!(box_sum::<Fixed>(&integral, SIDES, at, radius), exact);
                if radius < 2 {
                    assert!((box_sum::<Float>(&float, SIDES, at, radius) - f64::from(exact)).abs() < 1e-3);
                }
            }
        }
    }
}
