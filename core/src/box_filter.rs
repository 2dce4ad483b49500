//! Box means over the node grid by integral images.
//!
//! With wrapping integers a box sum is exact as long as it fits itself, whatever wrapped on the way.

use crate::arithmetic::Arithmetic;
use crate::gradient::GROUP;
use crate::grid::product;
use crate::nodes::NodeMap;

/// Elements of the memory of [`box_sums`] for a grid of nodes: the field, a row of zeros, and a row with room for
/// the widest kernel (31 nodes) at its ends.
pub const fn dense_len(sides: [u16; 3]) -> usize {
    product(sides) + 2 * sides[0] as usize + 2 * MARGIN
}

/// Nodes beyond either end of a row that a kernel may reach: radius and one more.
const MARGIN: usize = 16;

/// Replaces lane `lane` of a field at the active nodes by its sums over the box of `radius` nodes around each of
/// them, zero outside the grid and at the other nodes. `dense` has [`dense_len`] elements.
pub fn box_sums<A: Arithmetic>(
    nodes: &NodeMap<'_>,
    dense: &mut [A::Sum],
    radius: u8,
    field: &mut [[A::Sum; GROUP]],
    lane: usize,
) {
    let sides = nodes.sides();
    let width = usize::from(sides[0]);
    let Some((dense, lines)) = dense.split_at_mut_checked(product(sides)) else { return };
    let Some((zeros, line)) = lines.split_at_mut_checked(width) else { return };
    zeros.fill(A::Sum::default());
    integrate::<A>(nodes, field, lane, dense);
    let reach = 2 * usize::from(radius) + 1;
    let mut end = 0;
    nodes.for_each_run(|number, index, length| {
        if index >= end {
            let row = index.checked_div(width).unwrap_or(0);
            end = (row + 1) * width;
            prepare_line::<A>(dense, zeros, line, sides, row, usize::from(radius));
        }
        let x = index + width - end;
        let Some(low) = line.get(x..x + length + reach) else { return };
        let Some(high) = low.get(reach..) else { return };
        let Some(values) = field.get_mut(number..number + length) else { return };
        for ((lanes, &high), &low) in values.iter_mut().zip(high).zip(low) {
            if let Some(value) = lanes.get_mut(lane) {
                *value = A::subtract(high, low);
            }
        }
    });
}

/// Fills `dense` with the field's integral image: entry (x, y, z) is the sum of all entries up to and including x, y
/// and z.
#[inline(never)]
fn integrate<A: Arithmetic>(
    nodes: &NodeMap<'_>,
    field: &[[A::Sum; GROUP]],
    lane: usize,
    dense: &mut [A::Sum],
) {
    let [width, height, _] = nodes.sides().map(usize::from);
    sum_rows::<A>(nodes, field, lane, dense);
    let area = (width * height).max(1);
    dense.chunks_exact_mut(area).for_each(|plane| add_before::<A>(plane, width));
    add_before::<A>(dense, area);
}

/// Sums along x: nodes that are not active repeat the sum before them.
#[inline(always)]
fn sum_rows<A: Arithmetic>(
    nodes: &NodeMap<'_>,
    field: &[[A::Sum; GROUP]],
    lane: usize,
    dense: &mut [A::Sum],
) {
    let width = usize::from(nodes.sides()[0]).max(1);
    let (mut filled, mut end, mut sum) = (0, width, A::Sum::default());
    nodes.for_each_run(|number, index, length| {
        if index >= end {
            fill(dense, filled..end, sum);
            (filled, sum) = (end, A::Sum::default());
            while index >= end {
                end += width;
            }
        }
        fill(dense, filled..index, sum);
        filled = index + length;
        let Some(places) = dense.get_mut(index..filled) else { return };
        let Some(values) = field.get(number..number + length) else { return };
        for (place, lanes) in places.iter_mut().zip(values) {
            sum = A::add(sum, lanes.get(lane).copied().unwrap_or_default());
            *place = sum;
        }
    });
    fill(dense, filled..end, sum);
    fill(dense, end..dense.len(), A::Sum::default());
}

#[inline(always)]
fn fill<T: Copy>(elements: &mut [T], range: core::ops::Range<usize>, value: T) {
    if let Some(elements) = elements.get_mut(range) {
        elements.fill(value);
    }
}

/// Adds to every element the one `distance` before it, from the beginning on.
fn add_before<A: Arithmetic>(elements: &mut [A::Sum], distance: usize) {
    let mut rest = elements;
    while let Some((before, next)) = rest.split_at_mut_checked(distance) {
        for (place, &before) in next.iter_mut().zip(before.iter()) {
            *place = A::add(*place, before);
        }
        rest = next;
    }
}

/// The box sums over y and z of a row, summed along x: entry x + radius + 1 belongs to node x, zeros lie before and the
/// last sum behind.
fn prepare_line<A: Arithmetic>(
    integral: &[A::Sum],
    zeros: &[A::Sum],
    line: &mut [A::Sum],
    sides: [u16; 3],
    row: usize,
    radius: usize,
) {
    let [width, height, depth] = sides.map(usize::from);
    let (y, z) = (row.checked_rem(height).unwrap_or(0), row.checked_div(height).unwrap_or(0));
    let at = |y: Option<usize>, z: Option<usize>| {
        let start = y.zip(z).map(|(y, z)| (z * height + y) * width);
        start.and_then(|start| integral.get(start..)?.get(..width)).unwrap_or(zeros)
    };
    let high = |v: usize, side: usize| Some((v + radius).min(side.saturating_sub(1)));
    let low = |v: usize| v.checked_sub(radius + 1);
    let (y1, z1, y0, z0) = (high(y, height), high(z, depth), low(y), low(z));
    let rows = at(y1, z1).iter().zip(at(y0, z1)).zip(at(y1, z0)).zip(at(y0, z0));
    let Some((front, rest)) = line.split_at_mut_checked(radius + 1) else { return };
    front.fill(A::Sum::default());
    for (value, (((&a, &b), &c), &d)) in rest.iter_mut().zip(rows) {
        *value = A::subtract(A::subtract(a, b), A::subtract(c, d));
    }
    if let Some((sums, behind)) = rest.split_at_mut_checked(width) {
        let last = sums.last().copied().unwrap_or_default();
        behind.iter_mut().take(radius).for_each(|value| *value = last);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arithmetic::{Fixed, Float};
    use crate::grid::position;

    const SIDES: [u16; 3] = [5, 4, 6];

    /// Every third node is active; their values.
    fn field() -> [i32; 120] {
        core::array::from_fn(|i| if i % 3 == 0 { (i as i32 * 7919 % 1009 - 500) * 40_000 } else { 0 })
    }

    fn naive(field: &[i32], at: [u16; 3], r: u16) -> i32 {
        let mut sum = 0i32;
        for (index, &value) in field.iter().enumerate() {
            let p = position(index, SIDES);
            if p.iter().zip(at).all(|(&a, b)| a.abs_diff(b) <= r) {
                sum = sum.wrapping_add(value);
            }
        }
        sum
    }

    #[test]
    fn box_sums_equal_naive_sums_even_when_the_integral_wraps() {
        let field = field();
        let mut words = [0; 8];
        let nodes = NodeMap::of(SIDES, |node| node % 3 == 0, &mut words);
        for radius in 0..4u8 {
            let mut sums: [[i32; GROUP]; 40] = core::array::from_fn(|i| [field[3 * i], 5, 5, 5, 5]);
            let mut dense = [7; dense_len(SIDES)];
            box_sums::<Fixed>(&nodes, &mut dense, radius, &mut sums, 0);
            let mut floats = sums.map(|lanes| lanes.map(f64::from));
            floats.iter_mut().enumerate().for_each(|(i, lanes)| lanes[3] = f64::from(field[3 * i]));
            let before = floats;
            let mut dense = [7.0; dense_len(SIDES)];
            box_sums::<Float>(&nodes, &mut dense, radius, &mut floats, 3);
            for (i, &[sum, ..]) in sums.iter().enumerate() {
                let exact = naive(&field, position(3 * i, SIDES), u16::from(radius));
                assert_eq!(sum, exact, "node {i}, radius {radius}");
                if radius < 2 {
                    assert!((floats[i][3] - f64::from(exact)).abs() < 1e-3);
                }
                assert_eq!(floats[i][..3], before[i][..3], "the other lanes stay");
            }
        }
    }
}
