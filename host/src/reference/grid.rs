//! A dense box of samples.

use crate::raster;

/// A box of samples, x fastest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// Samples along x, y and z.
    pub sides: [usize; 3],
}

impl Grid {
    /// Samples in all.
    pub fn len(&self) -> usize {
        raster::len(self.sides)
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Place of a sample in the array.
    pub fn index(&self, sample: [usize; 3]) -> usize {
        raster::index(self.sides, sample)
    }

    /// Sample at a place of the array.
    pub fn position(&self, index: usize) -> [usize; 3] {
        raster::voxel(self.sides, index)
    }

    /// All samples of the box from `low` to `high`, both inclusive and cut at the grid, in the array's order.
    pub fn within(&self, low: [i64; 3], high: [i64; 3]) -> impl Iterator<Item = [usize; 3]> + use<> {
        let sides = self.sides;
        let [x, y, z]: [std::ops::Range<usize>; 3] = std::array::from_fn(|axis| {
            let end = (high[axis] + 1).clamp(0, sides[axis] as i64) as usize;
            low[axis].max(0) as usize..end
        });
        z.flat_map(move |z| {
            let x = x.clone();
            y.clone().flat_map(move |y| x.clone().map(move |x| [x, y, z]))
        })
    }

    /// All samples within `radius` of one along each axis.
    pub fn around(&self, at: [usize; 3], radius: usize) -> impl Iterator<Item = [usize; 3]> + use<> {
        let r = radius as i64;
        self.within(at.map(|v| v as i64 - r), at.map(|v| v as i64 + r))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { sides: [3, 4, 5] };

    #[test]
    fn boxes_are_cut_at_the_grid() {
        assert_eq!(GRID.around([1, 1, 1], 1).count(), 27);
        assert_eq!(GRID.around([0, 0, 0], 1).count(), 8);
        assert_eq!(GRID.around([1, 1, 1], 9).count(), GRID.len());
        assert_eq!(GRID.within([-5, 0, 0], [-1, 3, 3]).count(), 0);
    }
}
