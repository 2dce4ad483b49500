//! The local fit: every node has its own weight vector, eqs. (14)-(16) made to converge.
//!
//! Over hull voxels n with trilinear weights φ_jn to their eight nodes j, and B a box mean over the nodes:
//!
//! ```text
//! d_j  = Σ_n φ_jn W_n Σ_k g_k b'_kn²                                  curvature
//! e_n  = M_n + Σ_k b'_kn (Σ_j φ_jn V_kj) - t_n                        residual, eq. (15)
//! G_kj = Σ_n φ_jn W_n e_n b'_kn                                       gradient, eq. (16)
//! U_kj = B( B(G)_kj / (B(d)_j + λ + δ q³) )                           smoothed on both sides of the division
//! V   <- clamp( V + β (V - V_prev) - μ g_k U_kj, ±16 )                all nodes start at the global weights
//! ```
//!
//! The print of (14) adds the gradient, which climbs, and smooths the weights, which caps the detail; here
//! the update descends and is smoothed instead. B D⁻¹ B is symmetric and positive, so a fixed radius is
//! stable for μ < 2 (1 + β).
//!
//! Modes are taken [`GROUP`] at a time, so that gradients need memory for a group and not for all.

use crate::arithmetic::{Arithmetic, Kernel, Stride};
use crate::box_filter::{box_sums, dense_len};
use crate::cells::cells;
use crate::curvature::cell_curvature;
use crate::error::{Buffer, Error};
use crate::field::Field;
use crate::format::{MAX_MODES, digest};
use crate::gradient::{GROUP, Shares};
use crate::hull::Hull;
use crate::hull_rows::HullRows;
use crate::model::{Brick, MAX_BRICK_ROWS, MAX_BRICK_VOXELS, Model};
use crate::nodes::NodeMap;
use crate::schedule::Schedule;
use crate::workspace::{Progress, Workspace, cell_len, first};

/// The kinds of work of a local fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// d and its reciprocals, once a pass.
    Curvature,
    /// e, once an iteration.
    Residuals,
    /// G of a group of modes.
    Gradient,
    /// U and V of a group of modes.
    Update,
}

/// What the next step does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Adds a brick's curvature.
    Curvature(usize),
    /// Smooths and inverts the curvature.
    Reciprocals,
    /// Residuals of a brick.
    Residuals(usize),
    /// Gradients of a group of modes in a brick.
    Gradient(usize, usize),
    /// Smooths a group's gradients and moves its weights.
    Update(usize),
    Done,
}

/// A local fit under way.
#[derive(Debug)]
pub struct LocalFit<'m, 'b, A: Arithmetic> {
    model: &'m Model<'m>,
    hull: Hull<'m>,
    schedule: Schedule<'m>,
    stride: Stride,
    nodes: NodeMap<'b>,
    weights: &'b mut [A::Weight],
    previous: &'b mut [A::Weight],
    residuals: &'b mut [A::Residual],
    rows: HullRows<'b>,
    gradient: &'b mut [A::Sum],
    dense: &'b mut [A::Sum],
    reciprocals: &'b mut [A::Reciprocal],
    cell: &'b mut [A::Coefficient],
    /// Gains g, 1/256.
    gains: [u16; MAX_MODES as usize],
    pass: usize,
    iteration: usize,
    stage: Stage,
    done: u32,
}

impl<'m, 'b, A: Arithmetic> LocalFit<'m, 'b, A> {
    /// Prepares the fit: all nodes start at the global weights `start` (standard deviations).
    ///
    /// # Errors
    /// A schedule that does not go with the model, or a buffer smaller than [`Sizes::required`](crate::Sizes::required) tells.
    pub fn new(
        model: &'m Model<'m>,
        hull: Hull<'m>,
        start: &[f64],
        schedule: Schedule<'m>,
        workspace: Workspace<'b, A>,
    ) -> Result<Self, Error> {
        let stride = schedule.check(model)?;
        let nodes = NodeMap::new(model, stride.voxels, workspace.nodes)?;
        let (active, modes) = (nodes.active(), model.modes());
        let previous = if schedule.momentum == 0 { 0 } else { active * modes };
        let mut fit = Self {
            weights: first(workspace.weights, active * modes, Buffer::NodeWeights)?,
            previous: first(workspace.previous, previous, Buffer::Previous)?,
            residuals: first(workspace.residuals, model.voxels(), Buffer::Residuals)?,
            rows: HullRows::new(model, workspace.hull_rows)?,
            gradient: first(workspace.gradient, active * GROUP, Buffer::Gradient)?,
            dense: first(workspace.dense, dense_len(nodes.sides()), Buffer::Dense)?,
            reciprocals: first(workspace.reciprocals, active, Buffer::Reciprocals)?,
            cell: first(workspace.cell, cell_len(modes, stride.voxels), Buffer::Cell)?,
            gains: [0; MAX_MODES as usize],
            stage: Stage::Curvature(0),
            model,
            hull,
            schedule,
            stride,
            nodes,
            pass: 0,
            iteration: 0,
            done: 0,
        };
        fit.start(start);
        Ok(fit)
    }

    fn start(&mut self, weights: &[f64]) {
        for (k, gain) in self.gains.iter_mut().enumerate().take(self.model.modes()) {
            *gain = libm::floorf(self.model.gain(k) * 256.0 + 0.5).clamp(1.0, 65535.0) as u16;
        }
        for node in self.weights.chunks_exact_mut(self.model.modes().max(1)) {
            for (value, &weight) in node.iter_mut().zip(weights) {
                *value = A::weight(weight);
            }
        }
        for (previous, &weight) in self.previous.iter_mut().zip(self.weights.iter()) {
            *previous = weight;
        }
        if self.schedule.iterations() == 0 {
            self.stage = Stage::Done;
        }
    }

    /// A bounded piece of work: one brick, or one group of modes over the nodes. `None` when done.
    pub fn step(&mut self) -> Option<Progress> {
        let bricks = usize::from(self.model.header().bricks);
        let groups = self.model.modes().div_ceil(GROUP);
        self.stage = match self.stage {
            Stage::Done => return None,
            Stage::Curvature(brick) => {
                self.add_curvature(brick);
                if brick + 1 < bricks { Stage::Curvature(brick + 1) } else { Stage::Reciprocals }
            }
            Stage::Reciprocals => {
                self.invert_curvature();
                Stage::Residuals(0)
            }
            Stage::Residuals(brick) => {
                self.add_residuals(brick);
                if brick + 1 < bricks { Stage::Residuals(brick + 1) } else { Stage::Gradient(0, 0) }
            }
            Stage::Gradient(group, brick) => {
                self.add_gradient(group, brick);
                if brick + 1 < bricks { Stage::Gradient(group, brick + 1) } else { Stage::Update(group) }
            }
            Stage::Update(group) => {
                self.update(group);
                if group + 1 < groups { Stage::Gradient(group + 1, 0) } else { self.next_iteration() }
            }
        };
        self.done = self.done.saturating_add(1);
        Some(Progress { done: self.done, total: self.total(bricks, groups) })
    }

    /// What the next step does; `None` when there is none.
    pub const fn task(&self) -> Option<Task> {
        match self.stage {
            Stage::Curvature(_) | Stage::Reciprocals => Some(Task::Curvature),
            Stage::Residuals(_) => Some(Task::Residuals),
            Stage::Gradient(..) => Some(Task::Gradient),
            Stage::Update(_) => Some(Task::Update),
            Stage::Done => None,
        }
    }

    /// Runs all steps.
    pub fn run(&mut self) {
        while self.step().is_some() {}
    }

    fn total(&self, bricks: usize, groups: usize) -> u32 {
        let iteration = bricks + groups * (bricks + 1);
        (self.schedule.passes.len() * (bricks + 1) + self.schedule.iterations() * iteration) as u32
    }

    fn next_iteration(&mut self) -> Stage {
        self.iteration += 1;
        let steps = self.schedule.passes.get(self.pass).map_or(0, |pass| pass.steps.len());
        if self.iteration < steps {
            return Stage::Residuals(0);
        }
        self.iteration = 0;
        self.pass += 1;
        if self.pass < self.schedule.passes.len() { Stage::Curvature(0) } else { Stage::Done }
    }

    fn kernel(&self) -> Kernel {
        Kernel::new(self.schedule.passes.get(self.pass).map_or(0, |pass| pass.radius), self.stride)
    }

    /// d of one brick, kept in the first lane of the gradient's memory until it is inverted.
    #[inline(never)]
    fn add_curvature(&mut self, index: usize) {
        if index == 0 {
            self.gradient.fill(A::Sum::default());
        }
        let Some(brick) = self.model.brick(index) else { return };
        if self.pass == 0 {
            self.rows.mark(index, &brick, &self.hull);
        }
        let Some(wanted) = self.rows.of(index) else { return };
        let q = self.stride.voxels;
        for cell in cells(&brick, q).filter(|cell| cell.any(&brick, wanted, q)) {
            let corners = cell_curvature::<A>(&brick, &cell, wanted, &self.hull, &self.gains, self.stride);
            let sums = self.gradient.as_chunks_mut::<GROUP>().0;
            for (number, corner) in self.nodes.corners(&cell).into_iter().zip(corners) {
                if let Some([sum, ..]) = sums.get_mut(number) {
                    *sum = A::add(*sum, A::curvature_to_node(corner, self.stride));
                }
            }
        }
    }

    fn invert_curvature(&mut self) {
        let kernel = self.kernel();
        let scales = &self.model.header().scales;
        let q = f64::from(self.stride.voxels);
        let ridge = f64::from(scales.local_ridge) + f64::from(scales.voxel_ridge) * (q * q * q);
        self.smooth(kernel.radius, 1);
        let sums = self.gradient.as_chunks::<GROUP>().0;
        for (reciprocal, [boxed, ..]) in self.reciprocals.iter_mut().zip(sums) {
            *reciprocal = A::reciprocal(*boxed, ridge, kernel);
        }
    }

    #[inline(never)]
    fn add_residuals(&mut self, index: usize) {
        let Some(wanted) = self.rows.of(index) else { return };
        let Some(brick) = self.model.brick(index) else { return };
        let Some(residuals) = self.residuals.get_mut(brick.first..) else { return };
        let (hull, stride) = (self.hull, self.stride);
        let field =
            Field::<A> { stride, nodes: &self.nodes, weights: self.weights, modes: self.model.modes() };
        field.walk(&brick, self.cell, wanted, |voxel, sum| {
            let target = hull.target(brick.first + voxel);
            if let Some(residual) = residuals.get_mut(voxel) {
                *residual = A::residual(brick.mean(voxel), target.distance(), target.weight(), sum, stride);
            }
        });
    }

    #[inline(never)]
    fn add_gradient(&mut self, group: usize, index: usize) {
        if index == 0 {
            self.gradient.fill(A::Sum::default());
        }
        let Some(wanted) = self.rows.of(index) else { return };
        let Some(brick) = self.model.brick(index) else { return };
        let Some(residuals) = self.residuals.get(brick.first..) else { return };
        let exponents = brick.exponents().get(group * GROUP..).unwrap_or(&[]);
        let (kernel, q) = (self.kernel(), self.stride.voxels);
        let gradient = self.gradient.as_chunks_mut::<GROUP>().0;
        for cell in cells(&brick, q).filter(|cell| cell.any(&brick, wanted, q)) {
            let shares = Shares::<A>::of(&brick, &cell, wanted, residuals, q, self.cell);
            let corners = self.nodes.corners(&cell);
            let parts = shares.gradient(&brick, group);
            for (corner, number) in corners.into_iter().enumerate() {
                let Some(sums) = gradient.get_mut(number) else { continue };
                for ((sum, part), &exponent) in sums.iter_mut().zip(&parts).zip(exponents) {
                    let part = part.get(corner).copied().unwrap_or_default();
                    *sum = A::add(*sum, A::to_node(part, exponent, kernel));
                }
            }
        }
    }

    #[inline(never)]
    fn update(&mut self, group: usize) {
        let kernel = self.kernel();
        let modes = self.model.modes();
        let lanes = modes.saturating_sub(group * GROUP).min(GROUP);
        self.smooth(kernel.radius, lanes);
        let nodes = self.gradient.as_chunks_mut::<GROUP>().0;
        for (sums, &reciprocal) in nodes.iter_mut().zip(self.reciprocals.iter()) {
            if A::is_zero(sums) {
                continue;
            }
            for sum in sums {
                *sum = A::ratio(*sum, reciprocal, kernel);
            }
        }
        self.smooth(kernel.radius, lanes);
        self.move_weights(group * GROUP, self.gains_of(group, kernel));
    }

    /// Box sums of the first `lanes` modes of the group.
    fn smooth(&mut self, radius: u8, lanes: usize) {
        for lane in (0..lanes).filter(|_| radius > 0) {
            let field = self.gradient.as_chunks_mut::<GROUP>().0;
            box_sums::<A>(&self.nodes, self.dense, radius, field, lane);
        }
    }

    /// μ g / (2 r + 1)³ for the modes of a group.
    fn gains_of(&self, group: usize, kernel: Kernel) -> [A::Gain; GROUP] {
        let pass = self.schedule.passes.get(self.pass);
        let mu = f64::from(pass.and_then(|pass| pass.steps.get(self.iteration)).copied().unwrap_or(0.0));
        let mut gains = [A::Gain::default(); GROUP];
        for (k, gain) in (group * GROUP..self.model.modes()).zip(&mut gains) {
            *gain = A::gain(mu, f64::from(self.model.gain(k)), kernel);
        }
        gains
    }

    /// One step of the modes from `first` on at all nodes.
    #[inline(never)]
    fn move_weights(&mut self, first: usize, gains: [A::Gain; GROUP]) {
        let modes = self.model.modes().max(1);
        let momentum = i32::from(self.schedule.momentum);
        let mut previous = self.previous.chunks_exact_mut(modes);
        let nodes = self.weights.chunks_exact_mut(modes).zip(self.gradient.as_chunks::<GROUP>().0);
        for (weights, sums) in nodes {
            // Most nodes lie beyond the hull's reach; only momentum moves those.
            if momentum == 0 && A::is_zero(sums) {
                continue;
            }
            let weights = weights.iter_mut().skip(first).zip(sums).zip(&gains);
            match previous.next() {
                None => weights.for_each(|((weight, &boxed), &gain)| {
                    *weight = A::step(*weight, *weight, 0, boxed, gain);
                }),
                Some(previous) => {
                    for (((weight, &boxed), &gain), previous) in weights.zip(previous.iter_mut().skip(first))
                    {
                        let next = A::step(*weight, *previous, momentum, boxed, gain);
                        (*previous, *weight) = (*weight, next);
                    }
                }
            }
        }
    }

    /// Visits every stored voxel of a brick with its fitted distance M + b'·V, 1/256 voxel.
    pub fn distances(&mut self, brick: &Brick<'_>, mut visit: impl FnMut(usize, i16)) {
        let field = Field::<A> {
            stride: self.stride,
            nodes: &self.nodes,
            weights: self.weights,
            modes: self.model.modes(),
        };
        let (stride, mut masks) = (self.stride, [0; MAX_BRICK_ROWS]);
        field.walk(brick, self.cell, brick.row_masks(&mut masks), |voxel, sum| {
            visit(brick.first + voxel, A::distance(brick.mean(voxel), sum, stride));
        });
    }

    /// The same in the order of the voxels, in `buffer`: what is sent and digested.
    pub fn ordered_distances<'d>(
        &mut self,
        brick: &Brick<'_>,
        buffer: &'d mut [i16; MAX_BRICK_VOXELS],
    ) -> &'d [i16] {
        self.distances(brick, |voxel, distance| {
            if let Some(place) = voxel.checked_sub(brick.first).and_then(|v| buffer.get_mut(v)) {
                *place = distance;
            }
        });
        buffer.get(..brick.voxels()).unwrap_or(&[])
    }

    /// K weights for each active node, mode fastest.
    pub fn weights(&self) -> &[A::Weight] {
        self.weights
    }

    /// The active nodes.
    pub const fn nodes(&self) -> &NodeMap<'b> {
        &self.nodes
    }
}

impl LocalFit<'_, '_, crate::arithmetic::Fixed> {
    /// CRC-32 of the weights.
    pub fn digest(&self) -> u32 {
        digest(self.weights.iter().map(|w| w.to_le_bytes()))
    }
}
