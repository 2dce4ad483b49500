//! Makes one vertex of those that have the same coordinates, bit for bit.

use super::error::Problem;
use super::finish::next_index;
use crate::mesh::Point;

/// Vertices in the order of their first use, and where to find them.
///
/// A hash table of indices alone: the coordinates stay in `points`, where neighbours are close
/// to each other, and the table is small enough for the processor's cache.
pub(crate) struct Weld {
    /// The distinct vertices.
    pub points: Vec<Point>,
    /// Indices into `points` at or after the slot of their hash; a power of two, half empty.
    slots: Vec<u32>,
}

/// A slot without a vertex.
const FREE: u32 = u32::MAX;

impl Weld {
    /// Room for the vertices of `triangles` triangles: about half as many on a closed surface.
    pub fn for_triangles(triangles: usize) -> Self {
        let points = Vec::with_capacity(triangles / 2 + 3);
        Self { points, slots: vec![FREE; (triangles + 16).next_power_of_two()] }
    }

    /// The index of the vertex at `xyz`, all finite. The two zeros are one: writers mix them on
    /// planes of symmetry, and a crack would follow.
    pub fn add(&mut self, xyz: [f64; 3]) -> Result<u32, Problem> {
        let point = Point::from(xyz.map(|value| value + 0.0));
        let slot = self.find(&point);
        if self.slots[slot] != FREE {
            return Ok(self.slots[slot]);
        }
        let index = next_index(&self.points)?;
        self.slots[slot] = index;
        self.points.push(point);
        if 2 * self.points.len() > self.slots.len() {
            self.grow();
        }
        Ok(index)
    }

    /// The slot of the vertex at `point`, or the free one that is to become it.
    fn find(&self, point: &Point) -> usize {
        let mask = self.slots.len() - 1;
        let mut slot = hash(point) & mask;
        while self.slots[slot] != FREE && self.points[self.slots[slot] as usize] != *point {
            slot = (slot + 1) & mask;
        }
        slot
    }

    fn grow(&mut self) {
        self.slots = vec![FREE; 2 * self.slots.len()];
        for index in 0..self.points.len() {
            let slot = self.find(&self.points[index]);
            self.slots[slot] = index as u32;
        }
    }
}

/// Multiply and fold the high half onto the low one: coordinates that were 32-bit floats have
/// zeros there.
fn hash(point: &Point) -> usize {
    let mixed = point.iter().fold(0_u64, |state, value| {
        let product = (state ^ value.to_bits()).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        product ^ (product >> 32)
    });
    mixed.wrapping_mul(0xD6E8_FEB8_6659_FD93).rotate_left(32) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_bits_are_one_vertex_and_a_last_bit_makes_two() {
        let mut weld = Weld::for_triangles(1);
        let next = 1.0_f64.next_up();
        let indices = [[1.0; 3], [next, 1.0, 1.0], [1.0; 3], [1.0, next, 1.0]].map(|p| weld.add(p));
        assert_eq!(indices, [Ok(0), Ok(1), Ok(0), Ok(2)]);
        assert_eq!(weld.points.len(), 3);
    }

    #[test]
    fn the_two_zeros_are_one() {
        let mut weld = Weld::for_triangles(0);
        assert_eq!(weld.add([0.0, 1.0, -0.0]), weld.add([-0.0, 1.0, 0.0]));
        assert!(weld.points[0].z.is_sign_positive());
    }

    #[test]
    fn the_table_grows_with_the_vertices() {
        let mut weld = Weld::for_triangles(0);
        for round in 0..2 {
            for i in 0..1000 {
                assert_eq!(weld.add([f64::from(i), 0.0, 0.0]), Ok(i), "round {round}");
            }
        }
    }

    #[test]
    fn a_regular_grid_spreads_over_all_buckets() {
        let bucket = |i: u32| hash(&Point::new(f64::from(i & 63), f64::from(i >> 6), 0.0)) & 4095;
        let buckets: std::collections::HashSet<_> = (0..4096).map(bucket).collect();
        assert!(buckets.len() > 2300, "{} of 4096, 63 % are due", buckets.len());
    }
}
