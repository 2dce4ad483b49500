//! The jointly fitted surface for many points: what [`Cube::distance`](crate::cube::Cube::distance) tells, to the last bit,
//! with every voxel's distance worked out once, because the points of a scan lie in the same few voxels.

use crate::brick::BrickRows;
use crate::corners::{MODES, ScaledWeights, Weights, dots, in_voxels, of_mean, padded};
use crate::lent::Lent;
use crate::model::Model;
use crate::sample::Place;

/// Distances M + b'·v at stored voxels, worked out when they are first asked for.
#[derive(Debug)]
pub struct DistanceCache<'m, 'b, W: Lent<u32>> {
    model: &'m Model<'m>,
    weights: ScaledWeights<'m, 'b>,
    /// Number of a voxel, one more, and its distance; each voxel has one place, which others may take.
    slots: &'b mut [[W; 2]],
    mask: usize,
}

impl<'m, 'b, W: Lent<u32>> DistanceCache<'m, 'b, W> {
    /// The surface of the weights `v` in memory of any length: zeros, or what was left there for the same surface.
    pub const fn new(model: &'m Model<'m>, weights: &'b Weights, memory: &'b mut [W]) -> Self {
        let slots = memory.as_chunks_mut().0;
        let mask = (slots.len() / 2 + 1).next_power_of_two() - 1;
        Self { model, weights: ScaledWeights::new(weights), slots, mask }
    }

    /// Distance and gradient at `at` (voxels); `None` unless all eight voxels around it are stored.
    pub fn sample(&mut self, at: [f32; 3]) -> Option<(f32, [f32; 3])> {
        let place = Place::new(at, 1)?;
        let [x, ..] = place.corner;
        let (mut near_rows, mut far_rows, mut values) = (None, None, [0.0; 8]);
        // Two corners along x are a pair, mostly two voxels side by side.
        for (pair, values) in values.as_chunks_mut::<2>().0.iter_mut().enumerate() {
            let [near, far] = [0, 1].map(|c| place.position(2 * pair + c));
            let (number, stored) = self.row(&mut near_rows, near)?;
            let second = match near_rows {
                Some(rows) if rows.spans(x + 1) => (number + 1, stored >> 1),
                _ => self.row(&mut far_rows, far)?,
            };
            if stored & second.1 & 1 == 0 {
                return None;
            }
            *values = [self.distance(near, number), self.distance(far, second.0)];
        }
        Some(place.interpolate(&values))
    }

    /// Number of the first stored voxel from `at` on in its row, and a bit for each; mostly it lies in the same brick as
    /// the one before.
    #[inline(always)]
    fn row(&self, rows: &mut Option<BrickRows<'m>>, at: [u16; 3]) -> Option<(usize, u8)> {
        let rows = match rows {
            Some(rows) if rows.covers(at) => rows,
            _ => rows.insert(self.model.rows_at(at)?),
        };
        rows.starting_at(at)
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
        let mut sum = of_mean(brick.mean(voxel));
        for part in 0..self.weights.parts() {
            let scaled = self.weights.part(part, brick.exponents());
            let values = brick.basis_from(voxel).get(part * MODES..).unwrap_or(&[]);
            let [dot] = match values.first_chunk() {
                Some(basis) => dots(scaled, [basis]),
                None => dots(scaled, [&padded(values)]),
            };
            sum = sum.wrapping_add(dot);
        }
        let distance = in_voxels(sum);
        if let Some(slot) = self.slots.get_mut(number & self.mask) {
            *slot = [W::store(tag), W::store(distance.to_bits())];
        }
        distance
    }
}
