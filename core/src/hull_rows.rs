//! Which voxels of every row are in the hull: one byte a row, so that the local fit's loops skip the rest of
//! the band without looking at its targets.

use crate::error::{Buffer, Error};
use crate::hull::Hull;
use crate::model::{Brick, Model};
use crate::workspace::first;

/// A mask a row, brick by brick, y fastest.
#[derive(Debug)]
pub struct HullRows<'b> {
    masks: &'b mut [u8],
    /// Rows of a brick.
    area: usize,
}

/// Rows of all bricks of a model.
pub const fn rows_len(model: &Model<'_>) -> usize {
    let edge = model.grid().brick() as usize;
    model.header().bricks as usize * edge * edge
}

impl<'b> HullRows<'b> {
    /// No voxel in the hull yet; `masks` has [`rows_len`] elements.
    ///
    /// # Errors
    /// A buffer that is too small.
    pub fn new(model: &Model<'_>, masks: &'b mut [u8]) -> Result<Self, Error> {
        let masks = first(masks, rows_len(model), Buffer::HullRows)?;
        let edge = usize::from(model.grid().brick());
        Ok(Self { masks, area: edge * edge })
    }

    /// Reads one brick's targets.
    pub fn mark(&mut self, index: usize, brick: &Brick<'_>, hull: &Hull<'_>) {
        let edge = brick.edge();
        let area = self.area;
        let Some(masks) = self.masks.get_mut(index * area..).and_then(|m| m.get_mut(..area)) else { return };
        let rows = (0..edge).flat_map(|z| (0..edge).map(move |y| (y, z)));
        for (mask, (y, z)) in masks.iter_mut().zip(rows) {
            let row = brick.row(y, z);
            let inside = |&x: &u8| row.voxel(x).is_some_and(|v| hull.target(brick.first + v).weight() != 0);
            *mask = (0..edge).filter(inside).fold(0, |mask, x| mask | 1 << (x & 7));
        }
    }

    /// The masks of a brick; nothing where none of its voxels is in the hull.
    #[inline]
    pub fn of(&self, index: usize) -> Option<&[u8]> {
        let masks = self.masks.get(index * self.area..)?.get(..self.area)?;
        masks.iter().any(|&mask| mask != 0).then_some(masks)
    }
}
