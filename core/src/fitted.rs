//! The jointly fitted surface for many points: what [`sample::band`](crate::sample::band) tells, to the last bit, with
//! every voxel's distance worked out once, because the points of a scan lie in the same few voxels.

use crate::corners::Corners;
use crate::model::{BrickRows, Model};
use crate::sample::Place;

/// A word of the memory that is lent; zero is what it begins with.
pub trait Word: Copy + Default {
    /// A word in this memory.
    fn store(word: u32) -> Self;
    /// The word that was stored.
    fn load(self) -> u32;
}

impl Word for i32 {
    #[inline(always)]
    fn store(word: u32) -> Self {
        word as Self
    }

    #[inline(always)]
    fn load(self) -> u32 {
        self as u32
    }
}

impl Word for f64 {
    fn store(word: u32) -> Self {
        Self::from(word)
    }

    fn load(self) -> u32 {
        self as u32
    }
}

/// Distances M + b'·v at stored voxels.
#[derive(Debug)]
pub struct Fitted<'m, 'b, W: Word> {
    model: &'m Model<'m>,
    weights: &'b [f32],
    /// Number of a voxel, one more, and its distance; each voxel has one place, which others may take.
    slots: &'b mut [[W; 2]],
    mask: usize,
}

impl<'m, 'b, W: Word> Fitted<'m, 'b, W> {
    /// The surface of the weights `v`, standard deviations, in memory of any length: zeros, or what was left there for
    /// the same surface.
    pub const fn new(model: &'m Model<'m>, weights: &'b [f32], memory: &'b mut [W]) -> Self {
        let slots = memory.as_chunks_mut().0;
        let mask = (slots.len() / 2 + 1).next_power_of_two() - 1;
        Self { model, weights, slots, mask }
    }

    /// Distance and gradient at `at` (voxels); `None` unless all eight voxels around it are stored.
    pub fn sample(&mut self, at: [f32; 3]) -> Option<(f32, [f32; 3])> {
        let place = Place::new(at, 1)?;
        let mut rows = None;
        let mut values = [0.0; 8];
        for (corner, value) in values.iter_mut().enumerate() {
            let at = place.position(corner);
            *value = self.distance(at, self.number(&mut rows, at)?);
        }
        Some(place.interpolate(&values))
    }

    /// Number of a stored voxel; mostly it lies in the same brick as the one before.
    #[inline]
    fn number(&self, rows: &mut Option<BrickRows<'m>>, at: [u16; 3]) -> Option<usize> {
        let found = match rows {
            Some(rows) if rows.covers(at) => *rows,
            _ => *rows.insert(self.model.rows_at(at)?),
        };
        let (number, stored) = found.from(at)?;
        (stored & 1 != 0).then_some(number)
    }

    #[inline]
    fn distance(&mut self, at: [u16; 3], number: usize) -> f32 {
        let tag = number as u32 + 1;
        match self.slots.get(number & self.mask) {
            Some([known, distance]) if known.load() == tag => f32::from_bits(distance.load()),
            _ => self.work_out(at, number, tag),
        }
    }

    #[inline(never)]
    fn work_out(&mut self, at: [u16; 3], number: usize, tag: u32) -> f32 {
        let Some(brick) = self.model.brick_at(at) else { return 0.0 };
        let voxel = number.wrapping_sub(brick.first);
        let mut values = [f32::from(brick.mean(voxel)) / 256.0; 8];
        if !self.weights.is_empty() {
            let mut corners = Corners::new(&brick);
            corners.push(0, brick.basis(voxel));
            corners.add_sums(self.weights, &mut values);
        }
        let [distance, ..] = values;
        if let Some(slot) = self.slots.get_mut(number & self.mask) {
            *slot = [W::store(tag), W::store(distance.to_bits())];
        }
        distance
    }
}
