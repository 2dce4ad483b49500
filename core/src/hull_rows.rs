//! Which voxels of every row the local fit takes: one byte a row, so that its loops skip the rest of the band
//! without looking at its targets.
//!
//! The surface runs between the voxels next to it. Those farther off keep the distances from making a second sheet,
//! and one in four of them does that as well; it also leaves more of the steps to the surface.

use crate::brick::{Brick, MAX_BRICK_ROWS};
use crate::error::{Buffer, Error};
use crate::hull::{Hull, Target};
use crate::model::Model;
use crate::workspace::first;

/// A mask a row, brick by brick, y fastest.
#[derive(Debug)]
pub struct HullRows<'b> {
    masks: &'b mut [u8],
    /// Rows of a brick.
    area: usize,
    edge: u8,
    stride: u8,
}

/// Distances, 1/256 voxel, between which every voxel of the hull is taken.
const NEAR: (i16, i16) = (-192, 160);

/// Rows of all bricks of a model.
pub const fn rows_len(model: &Model<'_>) -> usize {
    let edge = model.grid().brick() as usize;
    model.header().bricks as usize * edge * edge
}

impl<'b> HullRows<'b> {
    /// No voxel taken yet, for nodes every `stride` voxels; `masks` has [`rows_len`] elements.
    ///
    /// # Errors
    /// A buffer that is too small.
    pub fn new(model: &Model<'_>, stride: u8, masks: &'b mut [u8]) -> Result<Self, Error> {
        let masks = first(masks, rows_len(model), Buffer::HullRows)?;
        let edge = model.grid().brick();
        Ok(Self { masks, area: usize::from(edge) * usize::from(edge), edge, stride })
    }

    /// Reads one brick's targets.
    pub fn mark(&mut self, index: usize, brick: &Brick<'_>, hull: &Hull<'_>) {
        let edge = brick.edge();
        let (area, stride) = (self.area, self.stride);
        let [x0, y0, z0] = brick.corner;
        let Some(masks) = self.masks.get_mut(index * area..).and_then(|m| m.get_mut(..area)) else { return };
        let rows = (0..edge).flat_map(|z| (0..edge).map(move |y| (y, z)));
        for (mask, (y, z)) in masks.iter_mut().zip(rows) {
            let row = brick.row(y, z);
            let taken = |&x: &u8| {
                let at = [x0 + u16::from(x), y0 + u16::from(y), z0 + u16::from(z)];
                row.voxel(x).is_some_and(|v| is_taken(at, hull.target(brick.first + v), stride))
            };
            *mask = (0..edge).filter(taken).fold(0, |mask, x| mask | 1 << (x & 7));
        }
    }

    /// The masks of a brick, thinned to every other voxel where `half` is wanted; nothing where no voxel is taken. What a
    /// kernel of several nodes learns from it, it learns from half of the voxels.
    #[inline]
    pub fn thinned<'d>(
        &'d self,
        index: usize,
        corner: [u16; 3],
        half: bool,
        buffer: &'d mut [u8; MAX_BRICK_ROWS],
    ) -> Option<&'d [u8]> {
        let masks = self.of(index)?;
        if !half {
            return Some(masks);
        }
        let edge = usize::from(self.edge);
        let [x0, y0, z0] = corner.map(usize::from);
        let rows = (0..edge).flat_map(|z| (0..edge).map(move |y| x0 + y0 + z0 + y + z));
        for ((thin, &mask), parity) in buffer.iter_mut().zip(masks).zip(rows) {
            *thin = mask & (0x55 << (parity & 1));
        }
        buffer.get(..masks.len())
    }

    /// The masks of a brick; nothing where none of its voxels is taken.
    #[inline]
    pub fn of(&self, index: usize) -> Option<&[u8]> {
        let masks = self.masks.get(index * self.area..)?.get(..self.area)?;
        masks.iter().any(|&mask| mask != 0).then_some(masks)
    }
}

/// Whether the local fit takes the voxel at `at`: in the hull, near the surface or one of four. Nodes in every voxel
/// have no others to learn from, so they take all.
const fn is_taken([x, y, z]: [u16; 3], target: Target, stride: u8) -> bool {
    let distance = target.distance();
    let near = distance > NEAR.0 && distance < NEAR.1;
    target.weight() != 0 && (near || stride < 2 || (x.is_multiple_of(2) && (y + z).is_multiple_of(2)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_near_voxels_and_a_quarter_of_the_others_are_taken() {
        let taken = |distance, stride| {
            let target = Target::new(distance, 16);
            (0..64).filter(|&i| is_taken([i % 4, i / 4 % 4, i / 16], target, stride)).count()
        };
        assert_eq!([-191, 0, 159].map(|distance| taken(distance, 3)), [64; 3]);
        assert_eq!([-192, 160, 700].map(|distance| taken(distance, 3)), [16; 3]);
        assert_eq!(taken(700, 1), 64);
        assert!(!is_taken([0; 3], Target(0), 3), "not in the hull");
    }
}
