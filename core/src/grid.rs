//! The voxel grid: sizes, bricks and nodes. Positions are in voxels; the origin is the first voxel's centre.

use crate::error::{Error, Part};

/// Most voxels along one side.
pub const MAX_SIDE: u16 = 1024;

/// A box of voxels cut into cubic bricks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    sides: [u16; 3],
    brick: u8,
}

impl Grid {
    /// A grid of `sides` voxels, each a multiple of the brick edge `brick` (1..=8).
    ///
    /// # Errors
    /// [`Error::Inconsistent`] when the edge is not within 1..=8, or a side is 0, over [`MAX_SIDE`] or not a multiple of it.
    pub const fn new(sides: [u16; 3], brick: u8) -> Result<Self, Error> {
        let bad = Err(Error::Inconsistent(Part::Grid));
        if brick == 0 || brick > 8 {
            return bad;
        }
        let [x, y, z] = sides;
        let edge = brick as u16;
        if x == 0 || y == 0 || z == 0 || x > MAX_SIDE || y > MAX_SIDE || z > MAX_SIDE {
            return bad;
        }
        if !x.is_multiple_of(edge) || !y.is_multiple_of(edge) || !z.is_multiple_of(edge) {
            return bad;
        }
        Ok(Self { sides, brick })
    }

    /// Voxels along x, y and z.
    pub const fn sides(&self) -> [u16; 3] {
        self.sides
    }

    /// Edge of a brick, voxels.
    pub const fn brick(&self) -> u8 {
        self.brick
    }

    /// Bricks along x, y and z.
    pub const fn brick_sides(&self) -> [u16; 3] {
        self.divided(self.brick as u16)
    }

    /// Number of brick cells, stored or not.
    pub const fn brick_cells(&self) -> usize {
        product(self.brick_sides())
    }

    /// Nodes along x, y and z for a node every `stride` voxels.
    pub const fn node_sides(&self, stride: u8) -> [u16; 3] {
        let [x, y, z] = self.divided(stride as u16);
        [x + 1, y + 1, z + 1]
    }

    /// Number of nodes for a node every `stride` voxels.
    pub const fn nodes(&self, stride: u8) -> usize {
        product(self.node_sides(stride))
    }

    const fn divided(&self, by: u16) -> [u16; 3] {
        // A brick or stride of 0 is refused long before; this way the compiler knows it too.
        let by = if by == 0 { 1 } else { by };
        let [x, y, z] = self.sides;
        [x / by, y / by, z / by]
    }
}

/// Product of three sides.
pub const fn product([x, y, z]: [u16; 3]) -> usize {
    x as usize * y as usize * z as usize
}

/// Position of `(x, y, z)` in an x-fastest array with these sides.
#[inline]
pub const fn linear([x, y, z]: [u16; 3], sides: [u16; 3]) -> usize {
    (z as usize * sides[1] as usize + y as usize) * sides[0] as usize + x as usize
}

/// Inverse of [`linear`].
#[inline]
pub const fn position(index: usize, sides: [u16; 3]) -> [u16; 3] {
    let width = if sides[0] == 0 { 1 } else { sides[0] as usize };
    let height = if sides[1] == 0 { 1 } else { sides[1] as usize };
    [(index % width) as u16, (index / width % height) as u16, (index / width / height) as u16]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_must_be_multiples_of_the_brick() {
        assert!(Grid::new([12, 18, 6], 6).is_ok());
        assert!(Grid::new([12, 17, 6], 6).is_err());
        assert!(Grid::new([0, 18, 6], 6).is_err());
        assert!(Grid::new([12, 18, 6], 9).is_err());
    }

    #[test]
    fn nodes_close_the_last_cell() {
        let grid = Grid::new([12, 18, 6], 6).unwrap();
        assert_eq!(grid.node_sides(3), [5, 7, 3]);
        assert_eq!(grid.brick_cells(), 6);
    }

    #[test]
    fn positions_invert_linear() {
        let sides = [5, 7, 3];
        for index in 0..product(sides) {
            assert_eq!(linear(position(index, sides), sides), index);
        }
    }
}
