//! An iteration whose kernel is one node: a node's step needs nothing but the cells around it.
//!
//! One sweep over the layers of cells works out residuals and gradients of all modes, and moves a layer of nodes as
//! soon as the cells on both sides of it are done. Those cells are the only ones that read it, so the result is that
//! of one step for all nodes at once. Two layers of nodes share the gradient's memory by turns.

use super::{LocalFit, Many, Stage, move_node};
use crate::arithmetic::Arithmetic;
use crate::brick::Brick;
use crate::cells::cells_of_layer;
use crate::corner_rows::Row;
use crate::field::Field;
use crate::gradient::{CellGradient, CornerResiduals};
use crate::trilinear::trilinear;

impl<'m, A: Arithmetic> LocalFit<'m, '_, A> {
    /// One brick of a sweep, if it lies in the layer; then what comes next.
    pub(super) fn sweep(&mut self, layer: u16, index: usize) -> Stage {
        let cells = u16::from(self.model.grid().brick().checked_div(self.stride.voxels).unwrap_or(1)).max(1);
        let (across, within) = (layer / cells, layer % cells);
        let edge = u16::from(self.model.grid().brick());
        let Some(brick) = self.model.brick(index).filter(|brick| brick.corner[2] == across * edge) else {
            // A layer that ends with a layer of bricks hands on to the next of them.
            if within + 1 == cells {
                self.layer_first = index;
            }
            return Stage::Layer(layer);
        };
        self.sweep_brick(layer, index, &brick, within as u8);
        Stage::Sweep(layer, index + 1)
    }

    pub(super) const fn after_layer(&mut self, layer: u16) -> Stage {
        let next = layer + 1;
        if next < self.layers() {
            return Stage::Sweep(next, self.layer_first);
        }
        Stage::Layer(next)
    }

    /// Residuals of the brick's cells in a layer, and what they add to the gradients of the nodes on both sides.
    #[inline(never)]
    fn sweep_brick(&mut self, layer: u16, index: usize, brick: &Brick<'m>, within: u8) {
        let Some(wanted) = self.rows.of(index) else { return };
        let modes = self.model.modes();
        let (hull, stride, q, kernel) = (self.hull, self.stride, self.stride.voxels, self.kernel());
        let Some((corners, scratch)) = self.cell.split_at_mut_checked(A::Row::count(modes)) else { return };
        let field = Field::<A> { stride, nodes: &self.nodes, weights: self.weights, modes };
        let least = brick.least_exponent();
        let starts = [layer, layer + 1].map(|z| self.nodes.before(z));
        let halves = if layer.is_multiple_of(2) { [0, self.half] } else { [self.half, 0] };
        let mut corner_residuals = CornerResiduals::<A, Many<A>>::new(scratch);
        for cell in cells_of_layer(brick, q, within).filter(|cell| cell.any(brick, wanted, q)) {
            let nodes = self.nodes.corners(&cell);
            field.gather(brick, nodes, least, corners);
            corner_residuals.clear();
            cell.visit(brick, wanted, q, |at, voxel| {
                let target = hull.target(brick.first + voxel);
                let phi = trilinear(at, q);
                let sums = A::Row::dots(corners, brick.basis_from(voxel));
                let sum = A::blend(&sums, phi, least, stride);
                let residual = A::residual(brick.mean(voxel), target.distance(), target.weight(), sum);
                corner_residuals.push(voxel, residual, phi, stride);
            });
            let mut places = nodes;
            for (i, place) in places.iter_mut().enumerate() {
                let ([near, far], [near_half, far_half]) = (starts, halves);
                let (start, half) = if i < 4 { (near, near_half) } else { (far, far_half) };
                *place = half + place.saturating_sub(start) * modes;
            }
            for first in (0..modes).step_by(Many::<A>::MODES) {
                let count = (modes - first).min(Many::<A>::MODES);
                corner_residuals.add_to(brick, (first, count), kernel, (self.gradient, places));
                places = places.map(|place| place + count);
            }
        }
    }

    /// Moves the nodes of a layer whose cells are done, and clears its half of the gradient's memory.
    #[inline(never)]
    pub(super) fn move_layer(&mut self, layer: u16) {
        let (kernel, modes) = (self.kernel(), self.model.modes().max(1));
        let nodes = self.nodes.before(layer)..self.nodes.before(layer + 1);
        let half = if layer.is_multiple_of(2) { 0 } else { self.half };
        let momentum = i32::from(self.schedule.momentum);
        let Some(gradient) = self.gradient.get_mut(half..).and_then(|g| g.get_mut(..self.half)) else {
            return;
        };
        for (sums, number) in gradient.chunks_exact_mut(modes).zip(nodes) {
            // Most nodes lie beyond the hull's reach; only momentum moves those.
            if momentum == 0 && A::is_zero(sums) {
                continue;
            }
            let reciprocal = self.reciprocals.get(number).copied().unwrap_or_default();
            for sum in sums.iter_mut() {
                *sum = A::ratio(*sum, reciprocal, kernel);
            }
            let place = number * modes..(number + 1) * modes;
            let Some(weights) = self.weights.get_mut(place.clone()) else { return };
            move_node::<A>(weights, self.previous.get_mut(place), sums, &self.step_gains, momentum);
            sums.fill(A::Sum::default());
        }
    }
}
