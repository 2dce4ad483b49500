//! Answers from a fit's results.

use super::distances::{Packer, brick_of};
use super::message::{MAX_DATA, Reply, Vector};
use super::refusal::Refusal;
use crate::arithmetic::Fixed;
use crate::brick::MAX_BRICK_VOXELS;
use crate::completion::Completion;
use crate::model::Model;

/// A job, and memory for its results on their way.
#[derive(Debug)]
pub(super) struct Results<'r> {
    model: &'r Model<'r>,
    pub job: Completion<'r, Fixed>,
    data: &'r mut [u8; MAX_DATA],
    /// Distances of a brick, and which one's.
    brick: &'r mut [i16; MAX_BRICK_VOXELS],
    loaded: Option<usize>,
}

impl<'r> Results<'r> {
    pub const fn new(
        model: &'r Model<'r>,
        job: Completion<'r, Fixed>,
        data: &'r mut [u8; MAX_DATA],
        brick: &'r mut [i16; MAX_BRICK_VOXELS],
    ) -> Self {
        Self { model, job, data, brick, loaded: None }
    }

    /// What the fit found.
    pub fn outcome(&self) -> Reply<'static> {
        match self.job.outcome() {
            Ok(outcome) => Reply::Outcome(outcome),
            Err(error) => Reply::Refused(Refusal::Core(error)),
        }
    }

    /// Weights from `first` on.
    pub fn weights(&mut self, of: Vector, first: u32) -> Reply<'_> {
        let data = &mut *self.data;
        match of {
            Vector::Shape => values(data, first, self.job.shape(), f32::to_le_bytes),
            Vector::Global => values(data, first, self.job.global(), f64::to_le_bytes),
        }
    }

    /// Packed distances from voxel `first` on.
    pub fn distances(&mut self, first: u32) -> Reply<'_> {
        let limit = self.model.header().voxels;
        if first > limit {
            return Reply::Refused(Refusal::OutOfRange { limit });
        }
        let mut packer = Packer::new(&mut *self.data);
        let mut voxel = first as usize;
        for index in brick_of(self.model, voxel)..usize::from(self.model.header().bricks) {
            let Some(brick) = self.model.brick(index) else { break };
            if self.loaded != Some(index) {
                if let Some(fit) = self.job.local() {
                    fit.ordered_distances(&brick, self.brick);
                }
                self.loaded = Some(index);
            }
            let from = voxel.saturating_sub(brick.first);
            let mut distances = self.brick.iter().enumerate().take(brick.voxels()).skip(from);
            if !distances.all(|(v, &distance)| packer.push(distance, brick.mean(v))) {
                break;
            }
            voxel = brick.first.saturating_add(brick.voxels());
        }
        Reply::Data { first, bytes: packer.finish() }
    }
}

/// As many values from `first` on as fit, as bytes.
fn values<'d, T: Copy, const N: usize>(
    data: &'d mut [u8],
    first: u32,
    values: &[T],
    bytes: fn(T) -> [u8; N],
) -> Reply<'d> {
    let Some(rest) = values.get(first as usize..) else {
        return Reply::Refused(Refusal::OutOfRange {
            limit: u32::try_from(values.len()).unwrap_or(u32::MAX),
        });
    };
    let (places, _) = data.as_chunks_mut::<N>();
    let mut length = 0usize;
    for (place, &value) in places.iter_mut().zip(rest) {
        *place = bytes(value);
        length = length.saturating_add(N);
    }
    Reply::Data { first, bytes: data.get(..length).unwrap_or(&[]) }
}
