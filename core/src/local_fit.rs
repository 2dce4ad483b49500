//! The local fit: every node has its own weight vector, eqs. (14)-(16) made to converge.
//!
//! Over the hull's voxels n, those near the surface (3/4 of a voxel behind it, 5/8 in front) and one in four of the
//! others, with trilinear weights φ_jn to their eight nodes j, and B a box mean over the nodes:
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
//! the update descends and is smoothed instead. With D the smoothed curvatures, diagonal, B D⁻¹ B is symmetric and
//! positive, so a fixed radius is stable for μ < 2 (1 + β). The steps that ship are longer and differ: together they damp
//! what each of them alone would amplify ([`schedule::DEFAULT`](crate::schedule::DEFAULT)).
//!
//! Where the kernel is wider than a node, modes are taken [`GROUP`] at a time, so that gradients need memory for a
//! group and not for all (`local_fit/wide.rs`). Where it is not, a sweep takes all modes of a layer of nodes at once
//! (`local_fit/sweep.rs`).

mod sweep;
mod wide;

use crate::arithmetic::{Arithmetic, Kernel, Stride};
use crate::box_filter::dense_len;
use crate::brick::{Brick, MAX_BRICK_ROWS, MAX_BRICK_VOXELS};
use crate::cells::cells;
use crate::corner_rows::Row;
use crate::curvature::cell_curvature;
use crate::error::{Buffer, Error};
use crate::field::Field;
use crate::format::MAX_MODES;
use crate::gradient::GROUP;
use crate::hull::Hull;
use crate::hull_rows::HullRows;
use crate::model::Model;
use crate::nodes::{Extent, NodeMap};
use crate::progress::Progress;
use crate::schedule::Schedule;
use crate::workspace::{Workspace, cell_len, first, gradient_len};

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
    /// e, G, U and V of a layer, where the kernel is one node.
    Sweep,
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
    /// Residuals and gradients of a brick in a layer of cells.
    Sweep(u16, usize),
    /// Moves the weights of a layer of nodes.
    Layer(u16),
    Done,
}

/// Takes gradients of a group of modes.
type Group<A> = <<A as Arithmetic>::Row as Row<A>>::Group;
/// Takes gradients of many modes at a time.
type Many<A> = <<A as Arithmetic>::Row as Row<A>>::Many;

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
    cell: &'b mut [A::Row],
    /// Elements that each of the two layers of a sweep has in the gradient's memory.
    half: usize,
    /// First brick of the layer under way.
    layer_first: usize,
    /// μ g / (2 r + 1)³ of each mode in the iteration under way.
    step_gains: [A::Gain; MAX_MODES as usize],
    /// Gains g, 1/256.
    gains: [u16; MAX_MODES as usize],
    pass: usize,
    iteration: usize,
    stage: Stage,
    done: u32,
    /// Steps in all.
    total: u32,
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
        let weights = active.saturating_mul(modes);
        let previous = if schedule.momentum == 0 { 0 } else { weights };
        let layers = nodes.sides()[2];
        let widest = (0..layers).map(|z| nodes.before(z + 1) - nodes.before(z)).max().unwrap_or(0);
        let gradients = gradient_len(Extent { active, widest }, modes);
        let mut fit = Self {
            weights: first(workspace.node_weights, weights, Buffer::NodeWeights)?,
            previous: first(workspace.previous, previous, Buffer::Previous)?,
            residuals: first(workspace.residuals, model.voxels(), Buffer::Residuals)?,
            rows: HullRows::new(model, stride.voxels, workspace.hull_rows)?,
            gradient: first(workspace.gradient, gradients, Buffer::Gradient)?,
            dense: first(workspace.dense, dense_len(nodes.sides()), Buffer::Dense)?,
            reciprocals: first(workspace.reciprocals, active, Buffer::Reciprocals)?,
            cell: first(workspace.cell, cell_len(modes, stride.voxels), Buffer::Cell)?,
            half: widest.saturating_mul(modes),
            layer_first: 0,
            step_gains: [A::Gain::default(); MAX_MODES as usize],
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
            total: 0,
        };
        fit.total = fit.steps(usize::from(model.header().bricks));
        fit.start(start);
        Ok(fit)
    }

    fn start(&mut self, weights: &[f64]) {
        for (k, gain) in self.gains.iter_mut().enumerate().take(self.model.modes()) {
            *gain = libm::floorf(self.model.gain(k) * 256.0 + 0.5).clamp(1.0, 65535.0) as u16;
        }
        // Once converted and then copied: a conversion takes hundreds of instructions without a double precision unit.
        let modes = self.model.modes().max(1);
        let (first, others) = self.weights.split_at_mut(modes.min(self.weights.len()));
        // The memory is lent: what was in it is no weight of a mode that the start does not tell.
        first.fill(A::weight(0.0));
        for (value, &weight) in first.iter_mut().zip(weights) {
            *value = A::weight(weight);
        }
        for node in others.chunks_exact_mut(modes) {
            node.iter_mut().zip(first.iter()).for_each(|(value, &weight)| *value = weight);
        }
        for (previous, &weight) in self.previous.iter_mut().zip(self.weights.iter()) {
            *previous = weight;
        }
        if self.schedule.iterations() == 0 {
            self.stage = Stage::Done;
        }
    }

    /// A bounded piece of work: one brick, one group of modes over the nodes, or one layer of nodes. `None` when done.
    pub fn step(&mut self) -> Option<Progress> {
        let bricks = usize::from(self.model.header().bricks);
        let groups = self.moving().div_ceil(GROUP);
        self.stage = match self.stage {
            Stage::Done => return None,
            Stage::Curvature(brick) => {
                self.add_curvature(brick);
                if brick + 1 < bricks { Stage::Curvature(brick + 1) } else { Stage::Reciprocals }
            }
            Stage::Reciprocals => {
                self.invert_curvature();
                self.begin_iteration()
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
            Stage::Sweep(layer, brick) => self.sweep(layer, brick),
            Stage::Layer(layer) => {
                self.move_layer(layer);
                if layer < self.layers() { self.after_layer(layer) } else { self.next_iteration() }
            }
        };
        self.done = self.done.saturating_add(1);
        Some(Progress { done: self.done, total: self.total })
    }

    /// What the next step does; `None` when there is none.
    pub const fn task(&self) -> Option<Task> {
        match self.stage {
            Stage::Curvature(_) | Stage::Reciprocals => Some(Task::Curvature),
            Stage::Residuals(_) => Some(Task::Residuals),
            Stage::Gradient(..) => Some(Task::Gradient),
            Stage::Update(_) => Some(Task::Update),
            Stage::Sweep(..) | Stage::Layer(_) => Some(Task::Sweep),
            Stage::Done => None,
        }
    }

    /// Runs all steps.
    pub fn run(&mut self) {
        while self.step().is_some() {}
    }

    /// Steps of all passes.
    fn steps(&self, bricks: usize) -> u32 {
        let layers = usize::from(self.layers());
        let cells = usize::from(self.model.grid().brick().checked_div(self.stride.voxels).unwrap_or(0));
        let sweep = bricks * cells + 2 * layers + 1;
        let of_pass = |pass: &crate::schedule::Pass<'_>| {
            let groups = pass.moving(self.model.modes()).div_ceil(GROUP);
            let wide = bricks + groups * (bricks + 1);
            bricks + 1 + pass.steps.len() * if pass.radius == 0 { sweep } else { wide }
        };
        self.schedule.passes.iter().map(of_pass).sum::<usize>() as u32
    }

    /// Layers of cells.
    const fn layers(&self) -> u16 {
        self.nodes.sides()[2].saturating_sub(1)
    }

    fn next_iteration(&mut self) -> Stage {
        self.iteration += 1;
        let steps = self.schedule.passes.get(self.pass).map_or(0, |pass| pass.steps.len());
        if self.iteration < steps {
            return self.begin_iteration();
        }
        self.iteration = 0;
        self.pass += 1;
        if self.pass < self.schedule.passes.len() { Stage::Curvature(0) } else { Stage::Done }
    }

    fn begin_iteration(&mut self) -> Stage {
        let Some(pass) = self.schedule.passes.get(self.pass) else { return Stage::Done };
        let Some(&mu) = pass.steps.get(self.iteration) else { return self.next_iteration() };
        let (kernel, moving) = (self.kernel(), self.moving());
        for (k, gain) in self.step_gains.iter_mut().enumerate().take(self.model.modes()) {
            let moved = || A::gain(f64::from(mu), f64::from(self.model.gain(k)), kernel);
            *gain = if k < moving { moved() } else { A::Gain::default() };
        }
        if pass.radius > 0 {
            return Stage::Residuals(0);
        }
        self.gradient.fill(A::Sum::default());
        self.layer_first = 0;
        Stage::Sweep(0, 0)
    }

    /// Modes that the pass under way moves.
    fn moving(&self) -> usize {
        let modes = self.model.modes();
        self.schedule.passes.get(self.pass).map_or(modes, |pass| pass.moving(modes))
    }

    /// Whether half of the voxels are enough for the pass under way: its kernel is several nodes wide, and a node is
    /// more than a voxel.
    fn takes_half(&self) -> bool {
        self.stride.voxels > 1 && self.kernel().radius > 0
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
        let mut masks = [0; MAX_BRICK_ROWS];
        let Some(wanted) = self.rows.thinned(index, brick.corner, self.takes_half(), &mut masks) else {
            return;
        };
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

    /// Visits every stored voxel of a brick with its fitted distance M + b'·V, 1/256 voxel.
    pub fn distances(&mut self, brick: &Brick<'_>, mut visit: impl FnMut(usize, i16)) {
        let field = Field::<A> {
            stride: self.stride,
            nodes: &self.nodes,
            weights: self.weights,
            modes: self.model.modes(),
        };
        let mut masks = [0; MAX_BRICK_ROWS];
        field.walk(brick, self.cell, brick.row_masks(&mut masks), |voxel, sum| {
            visit(brick.first + voxel, A::distance(brick.mean(voxel), sum));
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
}

/// V <- clamp(V + β (V - V_prev) - gain · U) at one node.
#[inline(always)]
fn move_node<A: Arithmetic>(
    weights: &mut [A::Weight],
    previous: Option<&mut [A::Weight]>,
    sums: &[A::Sum],
    gains: &[A::Gain],
    momentum: i32,
) {
    let weights = weights.iter_mut().zip(sums).zip(gains);
    match previous {
        None => weights.for_each(|((weight, &boxed), &gain)| {
            *weight = A::step(*weight, *weight, 0, boxed, gain);
        }),
        Some(previous) => {
            for (((weight, &boxed), &gain), previous) in weights.zip(previous) {
                let next = A::step(*weight, *previous, momentum, boxed, gain);
                (*previous, *weight) = (*weight, next);
            }
        }
    }
}
