//! The passes whose kernel is wider than a node: residuals of all bricks, then gradients, smoothing and steps of one group
//! of modes after the other.

use super::{Group, LocalFit, move_node};
use crate::arithmetic::Arithmetic;
use crate::box_filter::box_sums;
use crate::brick::MAX_BRICK_ROWS;
use crate::cells::cells;
use crate::corner_rows::Row;
use crate::field::Field;
use crate::gradient::{CornerResiduals, GROUP};
use crate::trilinear::trilinear;

impl<A: Arithmetic> LocalFit<'_, '_, A> {
    #[inline(never)]
    pub(super) fn add_residuals(&mut self, index: usize) {
        let Some(brick) = self.model.brick(index) else { return };
        let mut masks = [0; MAX_BRICK_ROWS];
        let Some(wanted) = self.rows.thinned(index, brick.corner, self.takes_half(), &mut masks) else {
            return;
        };
        let Some(residuals) = self.residuals.get_mut(brick.first..) else { return };
        let (hull, stride) = (self.hull, self.stride);
        let field =
            Field::<A> { stride, nodes: &self.nodes, weights: self.weights, modes: self.model.modes() };
        field.walk(&brick, self.cell, wanted, |voxel, sum| {
            let target = hull.target(brick.first + voxel);
            if let Some(residual) = residuals.get_mut(voxel) {
                *residual = A::residual(brick.mean(voxel), target.distance(), target.weight(), sum);
            }
        });
    }

    #[inline(never)]
    pub(super) fn add_gradient(&mut self, group: usize, index: usize) {
        if index == 0 {
            self.gradient.fill(A::Sum::default());
        }
        let Some(brick) = self.model.brick(index) else { return };
        let mut masks = [0; MAX_BRICK_ROWS];
        let Some(wanted) = self.rows.thinned(index, brick.corner, self.takes_half(), &mut masks) else {
            return;
        };
        let Some(residuals) = self.residuals.get(brick.first..) else { return };
        let (kernel, stride, q) = (self.kernel(), self.stride, self.stride.voxels);
        let modes = self.model.modes();
        let Some(scratch) = self.cell.get_mut(A::Row::count(modes)..) else { return };
        let mut corner_residuals = CornerResiduals::<A, Group<A>>::new(scratch);
        let (first, count) = (group * GROUP, modes.saturating_sub(group * GROUP).min(GROUP));
        for cell in cells(&brick, q).filter(|cell| cell.any(&brick, wanted, q)) {
            corner_residuals.clear();
            cell.visit(&brick, wanted, q, |at, voxel| {
                let residual = residuals.get(voxel).copied().unwrap_or_default();
                corner_residuals.push(voxel, residual, trilinear(at, q), stride);
            });
            let places = self.nodes.corners(&cell).map(|number| number * GROUP);
            corner_residuals.add_to(&brick, (first, count), kernel, (self.gradient, places));
        }
    }

    #[inline(never)]
    pub(super) fn update(&mut self, group: usize) {
        let kernel = self.kernel();
        let lanes = self.moving().saturating_sub(group * GROUP).min(GROUP);
        self.smooth(kernel.radius, lanes);
        let nodes = self.gradient.as_chunks_mut::<GROUP>().0;
        for (sums, &reciprocal) in nodes.iter_mut().zip(self.reciprocals.iter()) {
            for sum in sums {
                *sum = A::ratio(*sum, reciprocal, kernel);
            }
        }
        self.smooth(kernel.radius, lanes);
        self.move_group(group * GROUP, lanes);
    }

    /// Box sums of the first `lanes` modes of the group.
    pub(super) fn smooth(&mut self, radius: u8, lanes: usize) {
        for lane in (0..lanes).filter(|_| radius > 0) {
            let field = self.gradient.as_chunks_mut::<GROUP>().0;
            box_sums::<A>(&self.nodes, self.dense, radius, field, lane);
        }
    }

    /// One step of `lanes` modes from `first` on at all nodes.
    #[inline(never)]
    fn move_group(&mut self, first: usize, lanes: usize) {
        let modes = self.model.modes().max(1);
        let momentum = i32::from(self.schedule.momentum);
        let gains = self.step_gains.get(first..).and_then(|gains| gains.get(..lanes)).unwrap_or(&[]);
        let mut previous = self.previous.chunks_exact_mut(modes);
        let nodes = self.weights.chunks_exact_mut(modes).zip(self.gradient.as_chunks::<GROUP>().0);
        for (weights, sums) in nodes {
            let previous = previous.next().and_then(|node| node.get_mut(first..));
            let Some(weights) = weights.get_mut(first..) else { return };
            move_node::<A>(weights, previous, sums, gains, momentum);
        }
    }
}
