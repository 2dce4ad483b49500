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
use crate::box_filter::{box_sum, integrate};
use crate::cells::{Cell, Field, cell_len, cells};
use crate::error::{Buffer, Error};
use crate::format::{MAX_MODES, digest};
use crate::hull::Hull;
use crate::model::{Brick, MAX_BRICK_VOXELS, Model};
use crate::nodes::NodeMap;
use crate::schedule::Schedule;
use crate::workspace::{Progress, Workspace, first};

/// Modes whose gradients are held at a time.
pub const GROUP: usize = 4;

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
            gradient: first(workspace.gradient, active * GROUP, Buffer::Gradient)?,
            dense: first(workspace.dense, model.grid().nodes(stride.voxels), Buffer::Dense)?,
            reciprocals: first(workspace.reciprocals, active, Buffer::Reciprocals)?,
            cell: first(workspace.cell, cell_len(modes), Buffer::Cell)?,
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

    /// d of one brick, kept in the gradient's memory until it is inverted.
    fn add_curvature(&mut self, index: usize) {
        if index == 0 {
            self.gradient.fill(A::Sum::default());
        }
        let Some(brick) = self.model.brick(index) else { return };
        let q = self.stride.voxels;
        for cell in cells(&brick, q) {
            if !cell.any(&brick, q, |v| self.hull.target(brick.first + v).weight() != 0) {
                continue;
            }
            let corners = self.cell_curvature(&brick, &cell);
            for (c, corner) in (0u16..).zip(corners) {
                let number = self.nodes.number(cell.corner_node(c));
                if let Some(sum) = number.and_then(|n| self.gradient.get_mut(n)) {
                    *sum = A::add(*sum, A::curvature_to_node(corner, self.stride));
                }
            }
        }
    }

    fn cell_curvature(&self, brick: &Brick<'_>, cell: &Cell) -> [A::Sum; 8] {
        let q = self.stride.voxels;
        let mut corners = [A::Sum::default(); 8];
        for z in 0..q {
            for y in 0..q {
                for (x, voxel) in cell.voxels(brick, y, z, q) {
                    let weight = self.hull.target(brick.first + voxel).weight();
                    if weight == 0 {
                        continue;
                    }
                    let raw = self.voxel_curvature(brick, voxel);
                    for (c, corner) in (0u8..).zip(&mut corners) {
                        let factor = trilinear([x, y, z], c, q);
                        *corner = A::add(*corner, A::curvature(raw, weight, factor));
                    }
                }
            }
        }
        corners
    }

    /// Σ_k g_k b'² of a voxel in 2⁻¹² voxel²; each term is below 2²⁴ for exponents of 5 and more.
    fn voxel_curvature(&self, brick: &Brick<'_>, voxel: usize) -> u32 {
        let terms = brick.basis(voxel).iter().zip(brick.exponents()).zip(&self.gains);
        terms.fold(0, |sum: u32, ((&b, &e), &gain)| {
            let b = i32::from(b as i8);
            let square = (b * b) as u32;
            sum.wrapping_add(
                square.wrapping_mul(u32::from(gain)) >> (2 * u32::from(e)).saturating_sub(4).min(31),
            )
        })
    }

    fn invert_curvature(&mut self) {
        let kernel = self.kernel();
        let scales = &self.model.header().scales;
        let q = f64::from(self.stride.voxels);
        let ridge = f64::from(scales.local_ridge) + f64::from(scales.voxel_ridge) * (q * q * q);
        smooth::<A>(&self.nodes, self.dense, kernel.radius, self.gradient, 1, 0);
        for (reciprocal, &boxed) in self.reciprocals.iter_mut().zip(self.gradient.iter()) {
            *reciprocal = A::reciprocal(boxed, ridge, kernel);
        }
    }

    fn add_residuals(&mut self, index: usize) {
        let Some(brick) = self.model.brick(index) else { return };
        let Some(residuals) = self.residuals.get_mut(brick.first..) else { return };
        let hull = self.hull;
        let field = Field::<A> {
            stride: self.stride,
            nodes: &self.nodes,
            weights: self.weights,
            modes: self.model.modes(),
        };
        field.walk(
            &brick,
            self.cell,
            |voxel| hull.target(brick.first + voxel).weight() != 0,
            |voxel, sum| {
                let target = hull.target(brick.first + voxel);
                if let Some(residual) = residuals.get_mut(voxel) {
                    *residual = A::residual(brick.mean(voxel), target.distance(), target.weight(), sum);
                }
            },
        );
    }

    fn add_gradient(&mut self, group: usize, index: usize) {
        if index == 0 {
            self.gradient.fill(A::Sum::default());
        }
        let Some(brick) = self.model.brick(index) else { return };
        let exponents = brick.exponents().get(group * GROUP..).unwrap_or(&[]);
        let kernel = self.kernel();
        let q = self.stride.voxels;
        for cell in cells(&brick, q) {
            if !cell.any(&brick, q, |v| self.hull.target(brick.first + v).weight() != 0) {
                continue;
            }
            let corners = self.cell_gradient(&brick, &cell, group);
            for (c, corner) in (0u16..).zip(corners) {
                let Some(number) = self.nodes.number(cell.corner_node(c)) else { continue };
                let sums = self.gradient.get_mut(number * GROUP..).unwrap_or(&mut []);
                for ((sum, part), &exponent) in sums.iter_mut().zip(corner).zip(exponents) {
                    *sum = A::add(*sum, A::to_node(part, exponent, self.stride, kernel));
                }
            }
        }
    }

    /// Σ φ W e b' of a cell for each corner and mode of the group, in basis units times q³.
    fn cell_gradient(&self, brick: &Brick<'_>, cell: &Cell, group: usize) -> [[A::Sum; GROUP]; 8] {
        let q = self.stride.voxels;
        let mut corners = [[A::Sum::default(); GROUP]; 8];
        for z in 0..q {
            let mut edges = [[A::Sum::default(); GROUP]; 4];
            for y in 0..q {
                let [near, far] = self.row_gradient(brick, cell, [y, z], group);
                let [e0, e1, e2, e3] = &mut edges;
                scale_add::<A>(e0, q - y, &near);
                scale_add::<A>(e1, q - y, &far);
                scale_add::<A>(e2, y, &near);
                scale_add::<A>(e3, y, &far);
            }
            let (low, high) = corners.split_at_mut(4);
            for ((low, high), edge) in low.iter_mut().zip(high).zip(&edges) {
                scale_add::<A>(low, q - z, edge);
                scale_add::<A>(high, z, edge);
            }
        }
        corners
    }

    #[inline]
    fn row_gradient(
        &self,
        brick: &Brick<'_>,
        cell: &Cell,
        [y, z]: [u8; 2],
        group: usize,
    ) -> [[A::Sum; GROUP]; 2] {
        let q = self.stride.voxels;
        let mut near = [A::Sum::default(); GROUP];
        let mut far = near;
        for (x, voxel) in cell.voxels(brick, y, z, q) {
            if self.hull.target(brick.first + voxel).weight() == 0 {
                continue;
            }
            let residual = self.residuals.get(brick.first + voxel).copied().unwrap_or_default();
            let basis = brick.basis(voxel).get(group * GROUP..).unwrap_or(&[]);
            for ((near, far), &b) in near.iter_mut().zip(&mut far).zip(basis) {
                *near = A::gradient(*near, residual, q - x, b as i8);
                *far = A::gradient(*far, residual, x, b as i8);
            }
        }
        [near, far]
    }

    fn update(&mut self, group: usize) {
        let kernel = self.kernel();
        let passes = self.schedule.passes;
        let mu = passes.get(self.pass).and_then(|pass| pass.steps.get(self.iteration));
        let mu = f64::from(mu.copied().unwrap_or(0.0));
        let modes = self.model.modes();
        for (lane, k) in (group * GROUP..modes).take(GROUP).enumerate() {
            smooth::<A>(&self.nodes, self.dense, kernel.radius, self.gradient, GROUP, lane);
            let sums = self.gradient.iter_mut().skip(lane).step_by(GROUP);
            for (sum, &reciprocal) in sums.zip(self.reciprocals.iter()) {
                *sum = A::ratio(*sum, reciprocal, kernel);
            }
            smooth::<A>(&self.nodes, self.dense, kernel.radius, self.gradient, GROUP, lane);
            self.move_weights(k, lane, A::gain(mu, f64::from(self.model.gain(k)), kernel));
        }
    }

    /// One step of mode `k` at all nodes.
    fn move_weights(&mut self, k: usize, lane: usize, gain: A::Gain) {
        let modes = self.model.modes().max(1);
        let momentum = i32::from(self.schedule.momentum);
        let boxed = self.gradient.iter().skip(lane).step_by(GROUP);
        let weights = self.weights.iter_mut().skip(k).step_by(modes);
        if momentum == 0 {
            for (weight, &boxed) in weights.zip(boxed) {
                *weight = A::step(*weight, *weight, 0, boxed, gain);
            }
            return;
        }
        let previous = self.previous.iter_mut().skip(k).step_by(modes);
        for ((weight, previous), &boxed) in weights.zip(previous).zip(boxed) {
            let next = A::step(*weight, *previous, momentum, boxed, gain);
            *previous = *weight;
            *weight = next;
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
        field.walk(
            brick,
            self.cell,
            |_| true,
            |voxel, sum| {
                visit(brick.first + voxel, A::distance(brick.mean(voxel), sum));
            },
        );
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

/// φ q³ of corner `c` for the voxel at `at` within a cell.
#[inline]
fn trilinear(at: [u8; 3], c: u8, q: u8) -> u16 {
    let [x, y, z] = at;
    let along = |v: u8, bit: u8| u16::from(if c >> bit & 1 == 0 { q - v } else { v });
    along(x, 0) * along(y, 1) * along(z, 2)
}

#[inline(always)]
fn scale_add<A: Arithmetic>(sums: &mut [A::Sum; GROUP], factor: u8, parts: &[A::Sum; GROUP]) {
    for (sum, &part) in sums.iter_mut().zip(parts) {
        *sum = A::scale_add(*sum, factor, part);
    }
}

/// Replaces lane `lane` of a field at the active nodes (`lanes` side by side) by its box sums.
fn smooth<A: Arithmetic>(
    nodes: &NodeMap<'_>,
    dense: &mut [A::Sum],
    radius: u8,
    field: &mut [A::Sum],
    lanes: usize,
    lane: usize,
) {
    if radius == 0 {
        return;
    }
    dense.fill(A::Sum::default());
    for (index, &value) in nodes.iter().zip(field.iter().skip(lane).step_by(lanes)) {
        if let Some(place) = dense.get_mut(index) {
            *place = value;
        }
    }
    integrate::<A>(dense, nodes.sides());
    for (index, value) in nodes.iter().zip(field.iter_mut().skip(lane).step_by(lanes)) {
        *value = box_sum::<A>(dense, nodes.sides(), nodes.position(index), radius);
    }
}
